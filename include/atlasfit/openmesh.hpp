/* atlasfit/openmesh.hpp - atlasfit on OpenMesh's TriMesh_ArrayKernelT and PolyMesh_ArrayKernelT, with any
 * traits. OpenMesh 8 or newer; needs no CGAL.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 *   atlasfit::unwrap(mesh);                    // texcoords2D of the halfedges, texture_index of the faces
 *   auto quality = atlasfit::measure_uv(mesh);
 *   auto clean = atlasfit::denoise(mesh);      // vertices moved onto the surface
 *   atlasfit::copy_surface(clean, surface);
 *
 * Edges whose status says feature are seams of the UVs. Deleted vertices, edges and faces are passed over.
 * The texcoord of a halfedge is that of its face at its to-vertex, as OpenMesh reads them from OBJ. A
 * failure leaves the mesh as it was. */
#ifndef ATLASFIT_OPENMESH_HPP
#define ATLASFIT_OPENMESH_HPP

#include "polygons.hpp"

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Utils/color_cast.hh>

namespace atlasfit {

/// What unwrap() did beside the texcoords and texture indices, which are in the mesh.
struct OpenMeshLayout {
  std::vector<std::uint32_t> chart;  ///< By the index of a face; no_chart for deleted ones.
  /// Faces that do not lie flat and had to be cut between charts.
  std::vector<OpenMesh::FaceHandle> torn;
  atlasfit_uv_info info = detail::output<atlasfit_uv_info>();  ///< Of the triangles that faces were cut into.
  std::vector<std::string> warnings;                           ///< What the user should hear.
};

namespace detail {

/// Calls f with each halfedge of a face, in order.
template <class M, class F>
void around_face(const M &mesh, OpenMesh::FaceHandle face, F &&f) {
  const OpenMesh::HalfedgeHandle first = mesh.halfedge_handle(face);
  OpenMesh::HalfedgeHandle h = first;
  do {
    f(h);
    h = mesh.next_halfedge_handle(h);
  } while (h != first);
}

inline std::size_t index_of(OpenMesh::BaseHandle handle) { return static_cast<std::size_t>(handle.idx()); }

/// Three numbers as a vector of the mesh's own type.
template <class V, class T>
V open_vector(const T *from) {
  using Number = typename OpenMesh::vector_traits<V>::value_type;
  return V(static_cast<Number>(from[0]), static_cast<Number>(from[1]), static_cast<Number>(from[2]));
}

template <class M>
typename M::TexCoord2D open_uv(const float *uv) {
  using Number = typename OpenMesh::vector_traits<typename M::TexCoord2D>::value_type;
  return typename M::TexCoord2D(static_cast<Number>(uv[0]), static_cast<Number>(uv[1]));
}

/// The vertices of a mesh that are not deleted, in order.
template <class M>
Polygons open_vertices(const M &mesh, std::vector<std::uint32_t> &number) {
  Polygons all;
  all.xyz.reserve(3 * mesh.n_vertices());
  number.assign(mesh.n_vertices(), 0);
  std::size_t count = 0;
  for (auto v = mesh.vertices_sbegin(); v != mesh.vertices_end(); ++v) {
    number[index_of(*v)] = narrow(count++);
    const auto &p = mesh.point(*v);
    for (std::size_t k = 0; k < 3; k++) all.xyz.push_back(static_cast<double>(p[k]));
  }
  return all;
}

/// A mesh as polygons, in the order of its faces, with its feature edges.
template <class M>
Polygons open_polygons(const M &mesh) {
  std::vector<std::uint32_t> number, corners;
  Polygons all = open_vertices(mesh, number);
  if (mesh.has_edge_status())
    for (auto e = mesh.edges_sbegin(); e != mesh.edges_end(); ++e)
      if (mesh.status(*e).feature()) {
        const OpenMesh::HalfedgeHandle h = mesh.halfedge_handle(*e, 0);
        all.seams.push_back(number[index_of(mesh.from_vertex_handle(h))]);
        all.seams.push_back(number[index_of(mesh.to_vertex_handle(h))]);
      }
  all.reserve(mesh.n_faces());
  for (auto f = mesh.faces_sbegin(); f != mesh.faces_end(); ++f) {
    corners.clear();
    around_face(mesh, *f, [&](OpenMesh::HalfedgeHandle h) {
      corners.push_back(number[index_of(mesh.to_vertex_handle(h))]);
    });
    all.add(corners);
  }
  return all;
}

/// The texcoords of the halfedges by corner; empty where the mesh has none.
template <class M>
std::vector<float> open_uvs(const M &mesh, const Polygons &polygons) {
  std::vector<float> uv;
  if (!mesh.has_halfedge_texcoords2D()) return uv;
  uv.reserve(2 * polygons.corners());
  for (auto f = mesh.faces_sbegin(); f != mesh.faces_end(); ++f)
    around_face(mesh, *f, [&](OpenMesh::HalfedgeHandle h) {
      const auto &at = mesh.texcoord2D(h);
      for (std::size_t k = 0; k < 2; k++) uv.push_back(static_cast<float>(at[k]));
    });
  return uv;
}

template <class M>
OpenMeshLayout open_unwrap(M &mesh, const UnwrapOptions &options, const Run &run) {
  const Polygons polygons = open_polygons(mesh);
  const std::vector<float> before = open_uvs(mesh, polygons);
  Mesh view = polygons.mesh();
  if (!before.empty()) view.corner_uv(before.data());
  const UvLayout made = unwrap(view, options, run);
  const std::vector<float> uv = made.corners();
  const std::vector<std::uint32_t> charts = made.face_charts(), pages = made.face_pages(), cut = made.torn();
  OpenMeshLayout out;
  out.info = made.info();
  out.warnings = made.warnings();
  out.chart.assign(mesh.n_faces(), no_chart);
  if (!mesh.has_halfedge_texcoords2D()) mesh.request_halfedge_texcoords2D();
  if (!mesh.has_face_texture_index()) mesh.request_face_texture_index();
  std::size_t p = 0, corner = 0, torn = 0;
  for (auto f = mesh.faces_sbegin(); f != mesh.faces_end(); ++f, ++p) {
    out.chart[index_of(*f)] = charts[p];
    mesh.set_texture_index(*f, static_cast<typename M::TextureIndex>(pages[p]));
    if (torn < cut.size() && cut[torn] == p) {
      out.torn.push_back(*f);
      torn++;
    }
    around_face(mesh, *f, [&](OpenMesh::HalfedgeHandle h) {
      mesh.set_texcoord2D(h, open_uv<M>(&uv[2 * corner]));
      corner++;
    });
  }
  return out;
}

template <class M>
atlasfit_uv_quality open_measure_uv(const M &mesh, const Run &run) {
  const Polygons polygons = open_polygons(mesh);
  const std::vector<float> uv = open_uvs(mesh, polygons);
  Mesh view = polygons.mesh();
  if (!uv.empty()) view.corner_uv(uv.data());
  std::vector<std::uint32_t> page;
  if (mesh.has_face_texture_index()) {
    for (auto f = mesh.faces_sbegin(); f != mesh.faces_end(); ++f)
      page.push_back(static_cast<std::uint32_t>(mesh.texture_index(*f)));
    view.face_page(page.data());
  }
  return measure_uv(view, run);
}

template <class M>
Denoised open_denoise(M &mesh, const DenoiseOptions &options, const Run &run) {
  const Polygons polygons = open_polygons(mesh);
  std::vector<float> normals = polygons.normals();
  const bool faces = polygons.size() > 0;
  if (!faces && mesh.has_vertex_normals()) {
    std::size_t n = 0;
    for (auto v = mesh.vertices_sbegin(); v != mesh.vertices_end(); ++v)
      for (std::size_t k = 0; k < 3; k++) normals[n++] = static_cast<float>(mesh.normal(*v)[k]);
  }
  Denoised clean = denoise(polygons.vertices().normals(normals.data()), options, run);
  const Moved moved(clean, polygons.xyz.size() / 3);
  std::size_t n = 0;
  for (auto v = mesh.vertices_sbegin(); v != mesh.vertices_end(); ++v, ++n) {
    if (!moved.placed(n, polygons.xyz)) continue;
    mesh.set_point(*v, open_vector<typename M::Point>(&moved.xyz[3 * n]));
    if (mesh.has_vertex_normals())
      mesh.set_normal(*v, open_vector<typename M::Normal>(&moved.normals[3 * n]));
  }
  return clean;
}

template <class M>
std::size_t open_surface(const Surface &from, M &mesh) {
  if (!from.normals.empty() && !mesh.has_vertex_normals()) mesh.request_vertex_normals();
  if (!from.rgba.empty() && !mesh.has_vertex_colors()) mesh.request_vertex_colors();
  if (!from.corner_uv.empty() && !mesh.has_halfedge_texcoords2D()) mesh.request_halfedge_texcoords2D();
  const auto vertex = [&](std::size_t v) -> OpenMesh::VertexHandle {
    const OpenMesh::VertexHandle at = mesh.add_vertex(open_vector<typename M::Point>(&from.xyz[3 * v]));
    if (!from.normals.empty()) mesh.set_normal(at, open_vector<typename M::Normal>(&from.normals[3 * v]));
    if (!from.rgba.empty()) {
      const float *c = &from.rgba[4 * v];
      mesh.set_color(at, OpenMesh::color_cast<typename M::Color>(OpenMesh::Vec4f(c[0], c[1], c[2], c[3])));
    }
    return at;
  };
  using Vertex = OpenMesh::VertexHandle;
  const auto face = [&](std::size_t t, Vertex a, Vertex b, Vertex c) {
    const OpenMesh::FaceHandle f = mesh.add_face(a, b, c);
    if (!f.is_valid()) return false;
    if (from.corner_uv.empty()) return true;
    around_face(mesh, f, [&](OpenMesh::HalfedgeHandle h) {
      const Vertex to = mesh.to_vertex_handle(h);
      mesh.set_texcoord2D(h, open_uv<M>(&from.corner_uv[6 * t + (to == a ? 0u : to == b ? 2u : 4u)]));
    });
    return true;
  };
  return add_surface<Vertex>(from, vertex, face);
}

}  // namespace detail

/// Lays out UVs: they go to the texcoords2D of the halfedges, and pages to the texture_index of the faces;
/// both are requested where the mesh has none. With keep_uv_seams the texcoords that are there tell the
/// seams.
template <class T>
OpenMeshLayout unwrap(OpenMesh::PolyMesh_ArrayKernelT<T> &mesh,
                      const UnwrapOptions &options = UnwrapOptions(), const Run &run = Run()) {
  return detail::open_unwrap(mesh, options, run);
}
template <class T>
OpenMeshLayout unwrap(OpenMesh::TriMesh_ArrayKernelT<T> &mesh, const UnwrapOptions &options = UnwrapOptions(),
                      const Run &run = Run()) {
  return detail::open_unwrap(mesh, options, run);
}

/// How a mesh hangs together, its polygons cut into triangles.
template <class T>
atlasfit_topology measure_topology(const OpenMesh::PolyMesh_ArrayKernelT<T> &mesh, const Run &run = Run()) {
  return measure_topology(detail::open_polygons(mesh).mesh(), run);
}
template <class T>
atlasfit_topology measure_topology(const OpenMesh::TriMesh_ArrayKernelT<T> &mesh, const Run &run = Run()) {
  return measure_topology(detail::open_polygons(mesh).mesh(), run);
}

/// Quality of the texcoords2D of the halfedges, on the pages that the texture_index of the faces says.
template <class T>
atlasfit_uv_quality measure_uv(const OpenMesh::PolyMesh_ArrayKernelT<T> &mesh, const Run &run = Run()) {
  return detail::open_measure_uv(mesh, run);
}
template <class T>
atlasfit_uv_quality measure_uv(const OpenMesh::TriMesh_ArrayKernelT<T> &mesh, const Run &run = Run()) {
  return detail::open_measure_uv(mesh, run);
}

/// Denoises the vertices as a scan and moves them, and turns their normals if there are any. Faces stay;
/// vertices on no chart (outliers) follow their neighbours, or where they are to be dropped stay as they are.
/// The side out is that of the faces; of a mesh without faces, that of its normals.
template <class T>
Denoised denoise(OpenMesh::PolyMesh_ArrayKernelT<T> &mesh, const DenoiseOptions &options = DenoiseOptions(),
                 const Run &run = Run()) {
  return detail::open_denoise(mesh, options, run);
}
template <class T>
Denoised denoise(OpenMesh::TriMesh_ArrayKernelT<T> &mesh, const DenoiseOptions &options = DenoiseOptions(),
                 const Run &run = Run()) {
  return detail::open_denoise(mesh, options, run);
}

/// Adds a surface, Denoised for example, to a mesh, with normals, colours and texcoords. Returns how many
/// faces the mesh refused: they have vertices of their own.
template <class T>
std::size_t copy_surface(const Surface &from, OpenMesh::PolyMesh_ArrayKernelT<T> &mesh) {
  return detail::open_surface(from, mesh);
}
template <class T>
std::size_t copy_surface(const Surface &from, OpenMesh::TriMesh_ArrayKernelT<T> &mesh) {
  return detail::open_surface(from, mesh);
}

/// A mesh against the true surface.
template <template <class> class M, class T, template <class> class N, class U>
auto measure_surface(const M<T> &mesh, const N<U> &truth, const DistanceOptions &options = DistanceOptions(),
                     const Run &run = Run())
    -> decltype(mesh.faces_sbegin(), truth.faces_sbegin(), atlasfit_distance()) {
  const detail::Polygons one = detail::open_polygons(mesh), other = detail::open_polygons(truth);
  return measure_surface(one.mesh(), other.mesh(), options, run);
}

}  // namespace atlasfit

#endif
