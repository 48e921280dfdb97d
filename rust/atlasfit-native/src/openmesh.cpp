// See openmesh.hpp.
#include "atlasfit-native/src/openmesh.hpp"
#include "atlasfit-native/src/openmesh.rs.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>
#include <OpenMesh/Tools/Subdivider/Uniform/Sqrt3T.hh>

#include <algorithm>
#include <memory>
#include <vector>

namespace atlasfit_native {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

/// A vertex for each that a triangle names; false where a triangle does not fit.
bool fill(Mesh &mesh, rust::Slice<const double> xyz, rust::Slice<const std::uint32_t> triangles) {
  std::vector<Mesh::VertexHandle> vertex(xyz.size() / 3);
  for (const std::uint32_t v : triangles)
    if (!vertex[v].is_valid()) vertex[v] = mesh.add_vertex({xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]});
  for (std::size_t c = 0; c + 2 < triangles.size(); c += 3) {
    const std::uint32_t a = triangles[c], b = triangles[c + 1], d = triangles[c + 2];
    if (!mesh.add_face(vertex[a], vertex[b], vertex[d]).is_valid()) return false;
  }
  // OpenMesh takes vertices that hold two sheets together, but its steps do not.
  return std::all_of(mesh.vertices_begin(), mesh.vertices_end(),
                     [&](Mesh::VertexHandle v) { return mesh.is_manifold(v); });
}

template <class Scheme>
class By : public Subdivider {
 public:
  bool begin(rust::Slice<const double> xyz, rust::Slice<const std::uint32_t> triangles) {
    mesh_.request_edge_status();
    mesh_.request_face_status();
    mesh_.request_vertex_status();
    mesh_.request_halfedge_status();
    if (!fill(mesh_, xyz, triangles)) return false;
    // The tables of weights end at a valence of 50.
    std::size_t most = 50;
    for (const auto v : mesh_.vertices()) most = std::max<std::size_t>(most, 2 * mesh_.valence(v));
    scheme_.init_weights(most + 1);
    scheme_.attach(mesh_);
    return true;
  }
  // The scheme's own destructor would call what is gone by then.
  ~By() override { scheme_.detach(); }
  void step() override { scheme_(1); }
  void copy(rust::Vec<double> &xyz, rust::Vec<std::uint32_t> &triangles) const override {
    for (const auto v : mesh_.vertices())
      for (int k = 0; k < 3; k++) xyz.push_back(mesh_.point(v)[k]);
    for (const auto f : mesh_.faces())
      for (const auto v : mesh_.fv_range(f)) triangles.push_back(static_cast<std::uint32_t>(v.idx()));
  }

 private:
  Mesh mesh_;
  Scheme scheme_;
};

template <class Scheme>
std::unique_ptr<Subdivider> begun(rust::Slice<const double> xyz, rust::Slice<const std::uint32_t> triangles) {
  auto by = std::make_unique<By<Scheme>>();
  if (!by->begin(xyz, triangles)) return nullptr;
  return by;
}

}  // namespace

std::unique_ptr<Subdivider> subdivider(rust::Slice<const double> xyz,
                                       rust::Slice<const std::uint32_t> triangles, bool sqrt3) {
  namespace uniform = OpenMesh::Subdivider::Uniform;
  return sqrt3 ? begun<uniform::Sqrt3T<Mesh, double>>(xyz, triangles)
               : begun<uniform::LoopT<Mesh, double>>(xyz, triangles);
}

}  // namespace atlasfit_native
