// See cgal.hpp. CGAL is under the GPL: so is a program that has this file in it.
#include "atlasfit-native/src/cgal.hpp"
#include "atlasfit-native/src/cgal.rs.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace atlasfit_native {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;

/// What a run that is to stop throws through CGAL; the caller knows why.
struct Stopped : std::exception {
  const char *what() const noexcept override { return "stopped"; }
};

void check(const Stop &stop) {
  if (stop.asked()) throw Stopped();
}

/// Asks at every look and every n-th after it.
class Often {
 public:
  explicit Often(const Stop &stop) : stop_(stop) {}
  void operator()() {
    if (++looks_ % 256 == 0) check(stop_);
  }

 private:
  const Stop &stop_;
  std::size_t looks_ = 0;
};

/// Asks between the steps of wrapping: each facet takes microseconds.
struct Visitor : CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
  explicit Visitor(const Stop &stop) : often(stop) {}
  template <class Wrapper, class Gate>
  void before_facet_treatment(const Wrapper &, const Gate &) {
    often();
  }
  Often often;
};

using Mesh = CGAL::Surface_mesh<Point>;

/// The places of a mesh's vertices. Remeshing has no visitor, but it looks places up all the time: that asks
/// whether to stop.
struct WatchedPoints {
  using key_type = Mesh::Vertex_index;
  using value_type = Point;
  using reference = const Point &;
  using category = boost::read_write_property_map_tag;
  Mesh::Property_map<Mesh::Vertex_index, Point> places;
  Often *often;

  friend reference get(const WatchedPoints &map, key_type v) {
    (*map.often)();
    return map.places[v];
  }
  friend void put(const WatchedPoints &map, key_type v, const Point &p) { put(map.places, v, p); }
};

void copy_out(const Mesh &mesh, rust::Vec<double> &xyz, rust::Vec<std::uint32_t> &triangles) {
  std::vector<std::uint32_t> number(mesh.number_of_vertices() + mesh.number_of_removed_vertices());
  std::uint32_t count = 0;
  for (const auto v : mesh.vertices()) {
    if (mesh.is_isolated(v)) continue;
    number[v.idx()] = count++;
    for (int k = 0; k < 3; k++) xyz.push_back(mesh.point(v)[k]);
  }
  for (const auto f : mesh.faces())
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) triangles.push_back(number[v.idx()]);
}

std::vector<Point> points_of(Numbers xyz) {
  std::vector<Point> all;
  all.reserve(xyz.size() / 3);
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) all.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
  return all;
}

std::vector<std::array<std::size_t, 3>> faces_of(Indices triangles) {
  std::vector<std::array<std::size_t, 3>> all;
  all.reserve(triangles.size() / 3);
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3)
    all.push_back({triangles[i], triangles[i + 1], triangles[i + 2]});
  return all;
}

/// Whether two triangles meet elsewhere than in corners that they share.
bool meet(const std::vector<Point> &at, const std::array<std::size_t, 3> &s,
          const std::array<std::size_t, 3> &t) {
  std::vector<std::size_t> shared;
  for (const std::size_t v : s)
    if (std::find_if(t.begin(), t.end(), [&](std::size_t w) { return at[v] == at[w]; }) != t.end())
      shared.push_back(v);
  const auto triangle = [&](const std::array<std::size_t, 3> &f) {
    return Kernel::Triangle_3(at[f[0]], at[f[1]], at[f[2]]);
  };
  if (triangle(s).is_degenerate() || triangle(t).is_degenerate()) return false;
  const auto is_shared = [&](std::size_t v) {
    return std::any_of(shared.begin(), shared.end(), [&](std::size_t w) { return at[v] == at[w]; });
  };
  if (shared.empty()) return CGAL::do_intersect(triangle(s), triangle(t));
  if (shared.size() == 1) {
    // The edge opposite to the shared corner must not meet the other triangle.
    const auto opposite = [&](const std::array<std::size_t, 3> &f) {
      std::vector<Point> ends;
      for (const std::size_t v : f)
        if (!is_shared(v)) ends.push_back(at[v]);
      return Kernel::Segment_3(ends[0], ends[1]);
    };
    return CGAL::do_intersect(opposite(s), triangle(t)) || CGAL::do_intersect(opposite(t), triangle(s));
  }
  if (shared.size() == 3) return true;
  // An edge is shared: they meet where they lie in one plane on the same side of it.
  const auto other = [&](const std::array<std::size_t, 3> &f) {
    return at[*std::find_if(f.begin(), f.end(), [&](std::size_t v) { return !is_shared(v); })];
  };
  const Point a = at[shared[0]], b = at[shared[1]], p = other(s), q = other(t);
  return CGAL::coplanar(a, b, p, q) && CGAL::coplanar_orientation(a, b, p, q) == CGAL::POSITIVE;
}

}  // namespace

void alpha_wrap(Numbers xyz, Indices triangles, double alpha, double offset, const Stop &stop,
                rust::Vec<double> &shell_xyz, rust::Vec<std::uint32_t> &shell_triangles) {
  Mesh shell;
  Visitor visitor(stop);
  const std::vector<Point> points = points_of(xyz);
  const auto faces = faces_of(triangles);
  check(stop);
  CGAL::alpha_wrap_3(points, faces, alpha, offset, shell, CGAL::parameters::default_values(),
                     CGAL::parameters::visitor(visitor));
  check(stop);
  copy_out(shell, shell_xyz, shell_triangles);
}

bool remesh(Numbers xyz, Indices triangles, double length, std::uint32_t iterations, const Stop &stop,
            rust::Vec<double> &new_xyz, rust::Vec<std::uint32_t> &new_triangles) {
  Mesh mesh;
  Often often(stop);
  for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) mesh.add_vertex(Point(xyz[i], xyz[i + 1], xyz[i + 2]));
  const auto vertex = [&](std::size_t c) { return Mesh::Vertex_index(triangles[c]); };
  for (std::size_t c = 0; c + 2 < triangles.size(); c += 3) {
    often();
    if (mesh.add_face(vertex(c), vertex(c + 1), vertex(c + 2)) == Mesh::null_face()) return false;
  }
  const WatchedPoints points{mesh.points(), &often};
  CGAL::Polygon_mesh_processing::isotropic_remeshing(
      mesh.faces(), length, mesh,
      CGAL::parameters::number_of_iterations(iterations).vertex_point_map(points));
  check(stop);
  copy_out(mesh, new_xyz, new_triangles);
  return true;
}

void self_intersections(Numbers xyz, Indices triangles, const Stop &stop, rust::Vec<std::uint32_t> &pairs) {
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;
  const std::vector<Point> at = points_of(xyz);
  const auto faces = faces_of(triangles);
  std::vector<Box> boxes;
  boxes.reserve(faces.size());
  for (std::size_t f = 0; f < faces.size(); f++) {
    const auto &t = faces[f];
    boxes.emplace_back(at[t[0]].bbox() + at[t[1]].bbox() + at[t[2]].bbox(), static_cast<std::uint32_t>(f));
  }
  check(stop);
  Often often(stop);
  std::vector<std::array<std::uint32_t, 2>> found;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box &a, const Box &b) {
    often();
    if (meet(at, faces[a.info()], faces[b.info()]))
      found.push_back({std::min(a.info(), b.info()), std::max(a.info(), b.info())});
  });
  std::sort(found.begin(), found.end());
  for (const auto &pair : found)
    for (const std::uint32_t f : pair) pairs.push_back(f);
}

void exact_distances(Numbers xyz, Indices triangles, Numbers points, const Stop &stop,
                     rust::Vec<double> &distances) {
  using Exact = CGAL::Simple_cartesian<CGAL::Exact_rational>;
  const auto place = [](Numbers from, std::size_t i) {
    return Exact::Point_3(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
  };
  std::vector<Exact::Triangle_3> all;
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3)
    all.emplace_back(place(xyz, triangles[i]), place(xyz, triangles[i + 1]), place(xyz, triangles[i + 2]));
  for (std::size_t p = 0; 3 * p < points.size(); p++) {
    const Exact::Point_3 from = place(points, p);
    CGAL::Exact_rational least = -1;
    for (const auto &t : all) {
      check(stop);
      const CGAL::Exact_rational d = CGAL::squared_distance(from, t);
      if (least < 0 || d < least) least = d;
    }
    distances.push_back(std::sqrt(CGAL::to_double(least)));
  }
}

}  // namespace atlasfit_native
