// What the headers for other libraries' meshes add to a call: what the call takes beside the work that the
// library says it did, less what atlasfit.hpp takes so for the same polygons or points in arrays.
// tests/meshes PREFIX --bench runs it. Timing decides no test.
#include <CGAL/Point_set_3.h>
#include <CGAL/Polyhedron_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <atlasfit/cgal.hpp>
#include <atlasfit/eigen.hpp>
#include <atlasfit/openmesh.hpp>

#include "common.hpp"

#include <chrono>
#include <cmath>

using K = CGAL::Simple_cartesian<double>;

template <class F>
double seconds(F &&f) {
  const auto begin = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// The least over runs of what a call takes, and of what it takes beside the library's work; `call` returns
/// the seconds of that work.
struct Took {
  double whole = INFINITY, beside = INFINITY;
  template <class F>
  explicit Took(F &&call) {
    for (int run = 0; run < 3; run++) {
      double worked = 0.0;
      const double all = seconds([&] { worked = call(); });
      whole = std::min(whole, all);
      beside = std::min(beside, all - worked);
    }
  }
};

/// Prints what the library's own arrays take, or what is added to it.
void report(const char *name, const Took &took, const Took &own) {
  const double added = took.beside - own.beside;
  std::printf("%-34s %8.3f s %8.2f ms added, %5.2f %%\n", name, took.whole, 1e3 * added,
              100.0 * added / took.whole);
}
Took report_own(const Took &own) {
  std::printf("  %-32s %8.3f s %8.2f ms beside the work\n", "atlasfit.hpp alone", own.whole,
              1e3 * own.beside);
  return own;
}

template <class G>
void build(const Faces &from, G &g) {
  auto points = get(CGAL::vertex_point, g);
  std::vector<typename boost::graph_traits<G>::vertex_descriptor> at;
  for (const auto &p : from.at) {
    at.push_back(add_vertex(g));
    put(points, at.back(), K::Point_3(p[0], p[1], p[2]));
  }
  for (const auto &face : from.faces) {
    std::vector<typename boost::graph_traits<G>::vertex_descriptor> corners;
    for (const std::size_t v : face) corners.push_back(at[v]);
    CGAL::Euler::add_face(corners, g);
  }
}

static void unwrapping(std::size_t rings, std::size_t sides) {
  const Faces from = torus(rings, sides);
  CGAL::Surface_mesh<K::Point_3> surface;
  CGAL::Polyhedron_3<K> polyhedron;
  OpenMesh::PolyMesh_ArrayKernelT<> open;
  build(from, surface);
  build(from, polyhedron);
  std::vector<double> xyz;
  std::vector<OpenMesh::VertexHandle> at;
  for (const auto &p : from.at) {
    xyz.insert(xyz.end(), p.begin(), p.end());
    at.push_back(open.add_vertex(OpenMesh::Vec3f(float(p[0]), float(p[1]), float(p[2]))));
  }
  std::vector<std::uint32_t> triangles, corners, offsets = {0};
  for (const auto &f : from.faces) {
    std::vector<OpenMesh::VertexHandle> handles;
    for (const std::size_t v : f) handles.push_back(at[v]);
    open.add_face(handles);
    for (const std::size_t v : f) corners.push_back(static_cast<std::uint32_t>(v));
    offsets.push_back(static_cast<std::uint32_t>(corners.size()));
    for (std::size_t k = 2; k < f.size(); k++)
      for (const std::size_t v : {f[0], f[k - 1], f[k]}) triangles.push_back(static_cast<std::uint32_t>(v));
  }
  const Eigen::MatrixXd v = atlasfit::rows<3>(xyz);
  const Eigen::MatrixXi f = atlasfit::rows<3>(triangles).cast<int>();
  std::printf("unwrapping %zu triangles\n", triangles.size() / 3);
  // What unwrap() of a mesh reads of its results.
  const auto read = [](const atlasfit::UvLayout &made) {
    made.corners(), made.face_charts(), made.face_pages(), made.torn();
    return made.info().seconds;
  };
  const atlasfit::Faces polygons(corners.data(), offsets.data(), offsets.size() - 1);
  const Took own = report_own(Took([&] { return read(atlasfit::unwrap(atlasfit::Mesh(xyz, polygons))); }));
  report("  CGAL::Surface_mesh", Took([&] { return atlasfit::unwrap(surface).info.seconds; }), own);
  report("  CGAL::Polyhedron_3", Took([&] { return atlasfit::unwrap(polyhedron).info.seconds; }), own);
  report("  OpenMesh::PolyMesh_ArrayKernelT", Took([&] { return atlasfit::unwrap(open).info.seconds; }), own);
  std::printf("the same, as triangles\n");
  const Took cut = report_own(Took([&] { return read(atlasfit::unwrap(atlasfit::Mesh(xyz, triangles))); }));
  report("  Eigen::MatrixXd, MatrixXi", Took([&] { return atlasfit::unwrap(v, f).info.seconds; }), cut);
}

static double worked(const atlasfit::Denoised &clean) {
  double sum = 0.0;
  for (const double s : clean.report().stage_seconds) sum += s;
  return sum;
}

static void denoising(std::size_t count) {
  const auto scan = noisy_sphere(count);
  std::vector<double> xyz;
  CGAL::Point_set_3<K::Point_3> set;
  for (const auto &p : scan) {
    xyz.insert(xyz.end(), p.begin(), p.end());
    set.insert(K::Point_3(p[0], p[1], p[2]));
  }
  std::printf("denoising %zu points, and the surface out\n", count);
  const Took own = report_own(Took([&] { return worked(atlasfit::denoise(atlasfit::Points(xyz))); }));
  report("  CGAL::Point_set_3, Surface_mesh", Took([&] {
           CGAL::Point_set_3<K::Point_3> copy(set);
           CGAL::Surface_mesh<K::Point_3> surface;
           const auto clean = atlasfit::denoise(copy);
           atlasfit::copy_surface(clean, surface);
           return worked(clean);
         }),
         own);
}

int main() {
  unwrapping(200, 100);
  unwrapping(400, 200);
  denoising(10000);
  return 0;
}
