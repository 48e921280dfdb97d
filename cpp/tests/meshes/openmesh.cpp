// atlasfit/openmesh.hpp: texcoords, feature edges, pages, garbage, traits of other types, surfaces.
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <atlasfit/openmesh.hpp>

#include "common.hpp"

/// All of double, with other colours than the defaults.
struct DoubleTraits : OpenMesh::DefaultTraitsDouble {
  typedef OpenMesh::Vec2d TexCoord2D;
};
using Poly = OpenMesh::PolyMesh_ArrayKernelT<>;
using Tri = OpenMesh::TriMesh_ArrayKernelT<>;
using DoublePoly = OpenMesh::PolyMesh_ArrayKernelT<DoubleTraits>;

/// Builds a mesh, and counts the faces that it refuses. A TriMesh cuts polygons itself.
template <class M>
std::size_t build(const Faces &from, M &mesh) {
  std::vector<OpenMesh::VertexHandle> at;
  for (const auto &p : from.at)
    at.push_back(mesh.add_vertex(atlasfit::detail::open_vector<typename M::Point>(p.data())));
  std::size_t refused = 0;
  for (const auto &face : from.faces) {
    std::vector<OpenMesh::VertexHandle> corners;
    for (const std::size_t v : face) corners.push_back(at[v]);
    if (!mesh.add_face(corners).is_valid()) refused++;
  }
  return refused;
}

template <class M>
std::vector<double> uvs(const M &mesh) {
  std::vector<double> all;
  for (const auto f : mesh.faces())
    atlasfit::detail::around_face(mesh, f, [&](OpenMesh::HalfedgeHandle h) {
      all.insert(all.end(),
                 {static_cast<double>(mesh.texcoord2D(h)[0]), static_cast<double>(mesh.texcoord2D(h)[1])});
    });
  return all;
}

template <class M>
void check_layout(const Faces &from) {
  M mesh;
  want(build(from, mesh) == 0, "built");
  OpenMesh::VPropHandleT<int> tag;
  mesh.add_property(tag, "tag");
  for (const auto v : mesh.vertices()) mesh.property(tag, v) = v.idx() * 3;
  const std::size_t faces = mesh.n_faces();
  want(stops([&] { atlasfit::unwrap(mesh, {}, stopping()); }), "an exception comes out");
  want(!mesh.has_halfedge_texcoords2D() && !mesh.has_face_texture_index(), "and leaves the mesh as it was");
  const auto layout = atlasfit::unwrap(mesh);
  want(mesh.n_faces() == faces && mesh.n_vertices() == from.at.size(), "no vertex and no face is lost");
  for (const auto v : mesh.vertices()) want(mesh.property(tag, v) == v.idx() * 3, "properties stay");
  want(layout.chart.size() == faces && layout.torn.empty(), "flat polygons stay whole");
  for (const auto f : mesh.faces()) {
    want(layout.chart[static_cast<std::size_t>(f.idx())] < layout.info.charts, "each face has a chart");
    want(mesh.texture_index(f) == 0, "one page");
  }
  for (const double x : uvs(mesh)) want(x > 0.0 && x < 1.0, "UVs are on the page");
  const auto q = atlasfit::measure_uv(mesh);
  want(q.flips + q.overlapping_faces + q.degenerate == 0 && q.charts == layout.info.charts,
       "no flips, no overlaps");
  want(atlasfit::measure_topology(mesh).closed == 1, "closed");
  want(atlasfit::measure_surface(mesh, mesh).accuracy.max < 1e-6, "the same surface");
  // The texcoord that two faces of a chart have at a vertex is one: the right halfedge has it.
  mesh.request_halfedge_texcoords2D();
  const auto again = atlasfit::unwrap(mesh);
  want(again.info.charts == layout.info.charts, "unwrapped again");
}

static void features_are_seams() {
  Poly mesh;
  build(torus(24, 12), mesh);
  mesh.request_edge_status();
  std::vector<OpenMesh::EdgeHandle> ring;
  for (const auto e : mesh.edges())
    if (e.v0().idx() % 12 == 5 && e.v1().idx() % 12 == 5) {
      mesh.status(e).set_feature(true);
      ring.push_back(e);
    }
  atlasfit::unwrap(mesh);
  want(ring.size() == 24, "a ring of edges");
  for (const auto e : ring) {
    const auto h = mesh.halfedge_handle(e, 0), o = mesh.halfedge_handle(e, 1);
    want(mesh.texcoord2D(h) != mesh.texcoord2D(mesh.prev_halfedge_handle(o)) ||
             mesh.texcoord2D(o) != mesh.texcoord2D(mesh.prev_halfedge_handle(h)),
         "a feature edge is a seam");
  }
}

static void pages() {
  Poly mesh;
  build(torus(24, 12), mesh);
  atlasfit::UnwrapOptions options;
  options.page_width = options.page_height = 256;
  options.texels_per_unit = 80.0;
  const auto layout = atlasfit::unwrap(mesh, options);
  int last = 0;
  for (const auto f : mesh.faces()) last = std::max(last, mesh.texture_index(f));
  want(layout.info.pages > 1 && static_cast<std::size_t>(last) + 1 == layout.info.pages,
       "a page per texture index");
  want(atlasfit::measure_uv(mesh).overlapping_faces == 0, "pages are measured apart");
}

static void garbage_is_passed_over() {
  Poly mesh;
  build(torus(24, 12), mesh);
  mesh.request_vertex_status();
  mesh.request_edge_status();
  mesh.request_halfedge_status();
  mesh.request_face_status();
  std::vector<OpenMesh::FaceHandle> some;
  for (const auto f : mesh.faces())
    if (f.idx() % 7 == 3) some.push_back(f);
  for (const auto f : some) mesh.delete_face(f, true);
  const auto layout = atlasfit::unwrap(mesh);
  want(layout.chart.size() == mesh.n_faces(), "charts go by index");
  for (const auto f : some)
    want(layout.chart[static_cast<std::size_t>(f.idx())] == atlasfit::no_chart, "a deleted face has none");
  std::vector<double> before = uvs(mesh);
  want(atlasfit::measure_topology(mesh).unused_vertices == 0, "deleted vertices are no vertices");
  mesh.garbage_collection();
  // It moves the last faces to where the deleted ones were.
  std::vector<double> after = uvs(mesh);
  std::sort(before.begin(), before.end());
  std::sort(after.begin(), after.end());
  want(after == before && atlasfit::measure_uv(mesh).flips == 0, "UVs survive the collection of garbage");
}

static void bent_polygons_are_told() {
  Poly mesh;
  build(bent(), mesh);
  const auto layout = atlasfit::unwrap(mesh);
  want(layout.torn.size() == 1 && layout.torn[0].idx() == 1 && layout.info.split_polygons == 1,
       "the polygon that had to be cut is listed");
  want(uvs(mesh).size() == 2 * 68, "each corner has a UV");
}

template <class M>
void spikes_follow_their_neighbours() {
  M mesh;
  build(noisy_torus(), mesh);
  const OpenMesh::VertexHandle spike(77);
  mesh.set_point(spike, mesh.point(spike) * 4);
  const auto clean = atlasfit::denoise(mesh);
  const auto p = mesh.point(spike);
  want(clean.report().outliers == 1 && clean.report().followed_outliers == 1, "the spike is an outlier");
  want(off_torus(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])) < 0.1,
       "it goes between its neighbours");
}

template <class M>
void denoised_in_place() {
  M mesh;
  build(noisy_torus(), mesh);
  mesh.request_face_normals();
  mesh.request_vertex_normals();
  mesh.update_normals();
  const auto off = [&] {
    double sum = 0.0;
    for (const auto v : mesh.vertices()) {
      const auto p = mesh.point(v);
      sum += off_torus(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
    }
    return sum / static_cast<double>(mesh.n_vertices());
  };
  const double before = off();
  const std::size_t faces = mesh.n_faces();
  want(stops([&] { atlasfit::denoise(mesh, {}, stopping()); }) && off() == before,
       "an exception leaves the points");
  const auto clean = atlasfit::denoise(mesh);
  want(mesh.n_faces() == faces && mesh.n_vertices() == 1800, "no vertex and no face is lost");
  want(off() < 0.5 * before && clean.report().outliers == 0, "points are on the surface");
  for (const auto v : mesh.vertices()) {
    const double length = static_cast<double>(mesh.normal(v).norm());
    want(std::abs(length - 1.0) < 1e-3, "normals are of the surface");
  }
  M surface;
  want(atlasfit::copy_surface(clean, surface) == 0 && surface.n_faces() == clean.report().triangles,
       "the surface");
  want(surface.has_vertex_normals() && atlasfit::measure_uv(surface).flips == 0, "with normals and UVs");
  const auto d = atlasfit::measure_surface(surface, mesh);
  want(d.accuracy.mean < 0.02 && d.normal_orientation > 0.9, "it lies at the mesh and faces as it does");
}

static void refused_faces_are_counted() {
  // Three faces at an edge: the mesh takes two of them. OpenMesh says so itself on its error stream.
  omerr().disable();
  Faces book;
  book.at = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  book.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  Poly fan;
  want(build(book, fan) == 1 && atlasfit::unwrap(fan).chart.size() == 2, "the rest is unwrapped");
  atlasfit::Surface all;
  for (const auto &p : book.at) all.xyz.insert(all.xyz.end(), p.begin(), p.end());
  all.triangles = {0, 1, 2, 1, 0, 3, 0, 1, 4};
  all.corner_uv.assign(18, 0.25f);
  all.rgba.assign(20, 1.0f);
  DoublePoly mesh;
  want(atlasfit::copy_surface(all, mesh) == 1 && mesh.n_faces() == 3 && mesh.n_vertices() == 8,
       "a refused face is counted and has vertices of its own");
  for (const double x : uvs(mesh)) want(x == 0.25, "and its UVs");
  for (const auto v : mesh.vertices()) want(mesh.color(v)[2] == 1.0f, "and colours");
  omerr().enable();
}

int main() {
  for (const Faces &from : {ell(), torus(24, 12)}) {
    check_layout<Poly>(from);
    check_layout<DoublePoly>(from);
  }
  check_layout<Tri>(torus(24, 12));
  features_are_seams();
  pages();
  garbage_is_passed_over();
  bent_polygons_are_told();
  denoised_in_place<Poly>();
  spikes_follow_their_neighbours<Poly>();
  spikes_follow_their_neighbours<Tri>();
  denoised_in_place<DoublePoly>();
  denoised_in_place<Tri>();
  refused_faces_are_counted();
  Tri none;
  want(status_of([&] { atlasfit::unwrap(none); }) == ATLASFIT_DEGENERATE, "a mesh without faces");
  want(atlasfit_live_handles() == 0, "no handle is left");
  return verdict();
}
