// CGAL's surfaces of oriented points and smoothed scans, for `atlasfit bench surfaces`. It is under the
// GPL, as CGAL is.
//
//   c++ -std=c++17 -O2 -DNDEBUG -frounding-math -I/usr/include/eigen3 tests/peers/surfaces.cpp -o surfaces \
//     -lgmp -lmpfr          (Debian: libcgal-dev libeigen3-dev)
//   surfaces METHOD POINTS.xyz OUT.off SPACING NOISE
//
// In: a line "x y z nx ny nz" for each point; the methods that smooth take no notice of normals. Out: a
// surface, or smoothed points without faces, and the seconds that it took without files.
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/bilateral_smooth_point_set.h>
#include <CGAL/jet_estimate_normals.h>
#include <CGAL/jet_smooth_point_set.h>
#include <CGAL/mst_orient_normals.h>
#include <CGAL/poisson_surface_reconstruction.h>
#include <CGAL/wlop_simplify_and_regularize_point_set.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Oriented = std::pair<Point, Kernel::Vector_3>;
using Mesh = CGAL::Surface_mesh<Point>;

// Neighbours that jets and bilateral smoothing are fitted to, as CGAL's examples have it.
constexpr unsigned kNeighbours = 24;
using Sequential = CGAL::Sequential_tag;

/// Smoothed points; nothing of them where the method is none that smooths.
bool smooth(const std::string &method, std::vector<Oriented> points, std::vector<Point> *smoothed) {
  const auto named = CGAL::parameters::point_map(CGAL::First_of_pair_property_map<Oriented>());
  if (method == "wlop") {
    // As many points as the scan has; CGAL's own radius and iterations.
    CGAL::wlop_simplify_and_regularize_point_set<Sequential>(points, std::back_inserter(*smoothed),
                                                             named.select_percentage(100.0));
    return true;
  }
  if (method == "jet") {
    CGAL::jet_smooth_point_set<Sequential>(points, kNeighbours, named);
  } else if (method == "bilateral") {
    const auto both = named.normal_map(CGAL::Second_of_pair_property_map<Oriented>());
    CGAL::jet_estimate_normals<Sequential>(points, kNeighbours, both);
    CGAL::mst_orient_normals(points, kNeighbours, both);
    for (int i = 0; i < 2; i++) CGAL::bilateral_smooth_point_set<Sequential>(points, kNeighbours, both);
  } else {
    return false;
  }
  for (const Oriented &p : points) smoothed->push_back(p.first);
  return true;
}

int main(int argc, char **argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: %s METHOD POINTS.xyz OUT.off SPACING NOISE\n", argv[0]);
    return 2;
  }
  const std::string method = argv[1];
  const double spacing = std::atof(argv[4]), noise = std::atof(argv[5]);
  std::vector<Oriented> points;
  std::vector<Point> places;
  std::ifstream in(argv[2]);
  for (double x, y, z, u, v, w; in >> x >> y >> z >> u >> v >> w;) {
    points.emplace_back(Point(x, y, z), Kernel::Vector_3(u, v, w));
    places.push_back(points.back().first);
  }
  Mesh mesh;
  const auto start = std::chrono::steady_clock::now();
  if (method == "alpha-wrap") {
    // A ball that does not fall between neighbours, and a shell outside of the noise.
    CGAL::alpha_wrap_3(places, 3.0 * spacing, std::max(noise, 0.2 * spacing), mesh);
  } else if (method == "advancing-front") {
    std::vector<std::array<std::size_t, 3>> faces;
    CGAL::advancing_front_surface_reconstruction(places.begin(), places.end(), std::back_inserter(faces));
    for (const Point &p : places) mesh.add_vertex(p);
    for (const auto &f : faces)
      mesh.add_face(Mesh::Vertex_index(static_cast<Mesh::size_type>(f[0])),
                    Mesh::Vertex_index(static_cast<Mesh::size_type>(f[1])),
                    Mesh::Vertex_index(static_cast<Mesh::size_type>(f[2])));
  } else if (method == "poisson") {
    if (!CGAL::poisson_surface_reconstruction_delaunay(
            points.begin(), points.end(), CGAL::First_of_pair_property_map<Oriented>(),
            CGAL::Second_of_pair_property_map<Oriented>(), mesh, spacing)) {
      std::fprintf(stderr, "Poisson made no surface\n");
      return 1;
    }
  } else if (std::vector<Point> smoothed; smooth(method, points, &smoothed)) {
    for (const Point &p : smoothed) mesh.add_vertex(p);
  } else {
    std::fprintf(stderr, "%s: no such method\n", argv[1]);
    return 2;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::ofstream out(argv[3]);
  out.precision(17);
  out << "OFF\n" << mesh.number_of_vertices() << ' ' << mesh.number_of_faces() << " 0\n";
  for (const auto v : mesh.vertices()) out << mesh.point(v) << '\n';
  for (const auto f : mesh.faces()) {
    out << 3;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) out << ' ' << std::size_t(v);
    out << '\n';
  }
  std::printf("%.6f\n", took.count());
  return out.flush() ? 0 : 1;
}
