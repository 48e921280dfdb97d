// What the headers for other libraries' meshes add to a call: its time without the time that the library says
// it worked. tests/meshes PREFIX --bench runs it. Timing decides no test.
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

using K = CGAL::Simple_cartesian<double>;

template <class F>
double seconds(F &&f) {
  const auto begin = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Prints the least over runs of what a call takes and of what is added; `call` returns the seconds that the
/// library worked.
template <class F>
void report(const char *name, F &&call) {
  std::vector<double> added, whole;
  for (int run = 0; run < 3; run++) {
    double worked = 0.0;
    const double all = seconds([&] { worked = call(); });
    added.push_back(all - worked);
    whole.push_back(all);
  }
  std::sort(added.begin(), added.end());
  std::sort(whole.begin(), whole.end());
  std::printf("%-34s %8.3f s %8.2f ms added, %5.2f %%\n", name, whole[0], 1e3 * added[0],
              100.0 * added[0] / whole[0]);
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
  std::vector<std::uint32_t> triangles;
  for (const auto &f : from.faces) {
    std::vector<OpenMesh::VertexHandle> corners;
    for (const std::size_t v : f) corners.push_back(at[v]);
    open.add_face(corners);
    for (std::size_t k = 2; k < f.size(); k++)
      for (const std::size_t v : {f[0], f[k - 1], f[k]}) triangles.push_back(static_cast<std::uint32_t>(v));
  }
  const Eigen::MatrixXd v = atlasfit::rows<3>(xyz);
  const Eigen::MatrixXi f = atlasfit::rows<3>(triangles).cast<int>();
  std::printf("unwrapping %zu triangles\n", triangles.size() / 3);
  report("  atlasfit.hpp alone",
         [&] { return atlasfit::unwrap(atlasfit::Mesh(xyz, triangles)).info().seconds; });
  report("  CGAL::Surface_mesh", [&] { return atlasfit::unwrap(surface).info.seconds; });
  report("  CGAL::Polyhedron_3", [&] { return atlasfit::unwrap(polyhedron).info.seconds; });
  report("  OpenMesh::PolyMesh_ArrayKernelT", [&] { return atlasfit::unwrap(open).info.seconds; });
  report("  Eigen::MatrixXd, MatrixXi", [&] { return atlasfit::unwrap(v, f).info.seconds; });
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
  report("  atlasfit.hpp alone", [&] { return worked(atlasfit::denoise(atlasfit::Points(xyz))); });
  report("  CGAL::Point_set_3, Surface_mesh", [&] {
    CGAL::Point_set_3<K::Point_3> copy(set);
    CGAL::Surface_mesh<K::Point_3> surface;
    const auto clean = atlasfit::denoise(copy);
    atlasfit::copy_surface(clean, surface);
    return worked(clean);
  });
}

int main() {
  unwrapping(200, 100);
  unwrapping(400, 200);
  denoising(10000);
  return 0;
}
