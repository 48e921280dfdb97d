// atlasfit/bgl.hpp on Surface_mesh, Polyhedron_3, OpenMesh through CGAL's traits, and filtered graphs.
#include <CGAL/Polyhedron_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>
#include <CGAL/boost/graph/graph_traits_PolyMesh_ArrayKernelT.h>
#include <atlasfit/bgl.hpp>
#include <atlasfit/openmesh.hpp>

#include "common.hpp"

#include <map>

using K = CGAL::Simple_cartesian<double>;
using Surface = CGAL::Surface_mesh<K::Point_3>;
using FloatSurface = CGAL::Surface_mesh<CGAL::Simple_cartesian<float>::Point_3>;
using Polyhedron = CGAL::Polyhedron_3<K>;
using Open = OpenMesh::PolyMesh_ArrayKernelT<>;

/// Builds any mesh, and counts the faces that it refuses.
template <class G>
std::size_t build(const Faces &from, G &g) {
  using Vertex = typename boost::graph_traits<G>::vertex_descriptor;
  auto points = get(CGAL::vertex_point, g);
  using Point = typename boost::property_traits<decltype(points)>::value_type;
  std::vector<Vertex> at;
  for (const auto &p : from.at) {
    at.push_back(add_vertex(g));
    put(points, at.back(), atlasfit::detail::point_at<Point>(p.data()));
  }
  std::size_t refused = 0;
  for (const auto &face : from.faces) {
    std::vector<Vertex> corners;
    for (const std::size_t v : face) corners.push_back(at[v]);
    if (CGAL::Euler::add_face(corners, g) == boost::graph_traits<G>::null_face()) refused++;
  }
  return refused;
}

template <class G>
std::size_t count_faces(const G &g) {
  std::size_t n = 0;
  const auto f = faces(g);
  for (auto i = f.first; i != f.second; ++i) n++;
  return n;
}

/// All UVs of a mesh, face after face.
template <class G>
std::vector<float> uvs(const G &g, const atlasfit::HalfedgeLayout<G> &layout) {
  std::vector<float> all;
  const auto f = faces(g);
  for (auto i = f.first; i != f.second; ++i)
    atlasfit::detail::around(g, *i, [&](auto h) {
      const atlasfit::Uv uv = get(layout.uv, h);
      all.insert(all.end(), uv.begin(), uv.end());
    });
  return all;
}

/// What holds for UVs of any sound mesh: each face has a chart, each corner a UV on the page; nothing flips
/// or overlaps. Returns the UVs.
template <class G>
std::vector<float> check_layout(const G &g) {
  const std::size_t vertices_before = num_vertices(g), faces_before = count_faces(g);
  const auto layout = atlasfit::unwrap(g);
  want(num_vertices(g) == vertices_before && count_faces(g) == faces_before, "no vertex and no face is lost");
  want(layout.torn.empty() && layout.info.charts > 0, "flat polygons stay whole");
  const auto f = faces(g);
  for (auto i = f.first; i != f.second; ++i)
    want(get(layout.chart, *i) < layout.info.charts && get(layout.page, *i) == 0, "each face has a chart");
  const std::vector<float> all = uvs(g, layout);
  for (const float x : all) want(x > 0.0f && x < 1.0f, "UVs are on the page");
  const auto q = atlasfit::measure_uv(g, layout);
  want(q.flips + q.overlapping_faces + q.degenerate == 0 && q.inside == 1, "no flips, no overlaps");
  want(q.charts == layout.info.charts && q.faces == layout.info.triangles, "measured as laid out");
  const auto again = atlasfit::measure_uv(g, layout.uv);
  want(again.stretch_p95 == q.stretch_p95, "a property map of UVs is measured as the layout is");
  return all;
}

static void every_model_alike() {
  for (const Faces &from : {ell(), torus(24, 12)}) {
    Surface surface;
    FloatSurface floats;
    Polyhedron polyhedron;
    Open open;
    want(build(from, surface) + build(from, floats) + build(from, polyhedron) + build(from, open) == 0,
         "built");
    const std::vector<float> uv = check_layout(surface);
    want(check_layout(polyhedron) == uv, "a polyhedron gets the UVs of a surface mesh");
    check_layout(floats);
    const Open &fixed = open;
    check_layout(fixed);
    const auto d = atlasfit::measure_surface(surface, polyhedron);
    want(d.accuracy.max < 1e-9 && d.completeness.max < 1e-9, "the same surface in two types");
    want(atlasfit::measure_topology(surface).closed == 1 && atlasfit::measure_topology(floats).closed == 1,
         "closed");
  }
}

static void garbage_is_passed_over() {
  Surface whole, holed;
  const Faces from = torus(24, 12);
  build(from, whole);
  build(from, holed);
  std::size_t n = 0;
  std::vector<Surface::Face_index> gone;
  for (const auto f : holed.faces())
    if (n++ % 7 == 3) gone.push_back(f);
  for (const auto f : gone) CGAL::Euler::remove_face(holed.halfedge(f), holed);
  want(holed.has_garbage() && holed.number_of_faces() + gone.size() == whole.number_of_faces(),
       "some faces are gone");
  const auto layout = atlasfit::unwrap(holed);
  const std::vector<float> before = uvs(holed, layout);
  want(layout.info.triangles < 2 * 24 * 12 && atlasfit::measure_uv(holed, layout).flips == 0,
       "unwrapped without them");
  want(atlasfit::measure_topology(holed).unused_vertices == 0, "removed vertices are no vertices");
  holed.collect_garbage();
  want(uvs(holed, atlasfit::unwrap(holed)).size() == before.size(), "as many corners without garbage");
}

static void bent_polygons_are_told() {
  Surface mesh;
  build(bent(), mesh);
  const auto layout = atlasfit::unwrap(mesh);
  want(layout.torn.size() == 1 && layout.torn[0] == Surface::Face_index(1) && layout.info.split_polygons == 1,
       "the polygon that had to be cut is listed");
  want(count_faces(mesh) == 2 && uvs(mesh, layout).size() == 2 * 68, "all faces and corners are there");
  for (const float x : uvs(mesh, layout)) want(x >= 0.0f && x <= 1.0f, "each corner has a UV");
}

static void named_parameters() {
  Surface mesh;
  build(torus(24, 12), mesh);
  auto seam = mesh.add_property_map<Surface::Edge_index, bool>("e:seam", false).first;
  auto patch = mesh.add_property_map<Surface::Face_index, int>("f:patch", 0).first;
  auto moved = mesh.add_property_map<Surface::Vertex_index, K::Point_3>("v:moved").first;
  for (const auto e : mesh.edges()) seam[e] = source(e, mesh) % 12 == 5 && target(e, mesh) % 12 == 5;
  for (const auto f : mesh.faces()) patch[f] = static_cast<int>(f) / 100;
  for (const auto v : mesh.vertices())
    moved[v] = K::Point_3(2 * mesh.point(v).x(), 2 * mesh.point(v).y(), 2 * mesh.point(v).z());
  namespace cp = CGAL::parameters;
  const auto layout =
      atlasfit::unwrap(mesh, cp::edge_is_constrained_map(seam).face_patch_map(patch).vertex_point_map(moved));
  std::map<std::uint32_t, int> patch_of;
  for (const auto f : mesh.faces())
    want(patch_of.emplace(get(layout.chart, f), patch[f]).first->second == patch[f],
         "no chart spans two patches");
  std::size_t seams = 0;
  for (const auto e : mesh.edges()) {
    if (!seam[e]) continue;
    seams++;
    const auto h = halfedge(e, mesh), o = opposite(h, mesh);
    want(get(layout.uv, h) != get(layout.uv, prev(o, mesh)) ||
             get(layout.uv, o) != get(layout.uv, prev(h, mesh)),
         "a constrained edge is a seam");
  }
  want(seams == 24, "there is a ring of constrained edges");
  const auto plain = atlasfit::unwrap(mesh, cp::vertex_point_map(mesh.points()));
  const auto twice = atlasfit::unwrap(mesh, cp::vertex_point_map(moved));
  want(std::abs(plain.info.texels_per_unit / twice.info.texels_per_unit - 2.0) < 1e-3,
       "the point map given counts");
  // UVs of another type.
  auto points = mesh.add_property_map<Surface::Halfedge_index, K::Point_2>("h:mine").first;
  for (const auto h : mesh.halfedges()) points[h] = K::Point_2(get(plain.uv, h)[0], get(plain.uv, h)[1]);
  want(atlasfit::measure_uv(mesh, points).stretch_p95 == atlasfit::measure_uv(mesh, plain.uv).stretch_p95,
       "UVs may be CGAL's points");
}

template <class G>
double mean_off_torus(const G &g) {
  double sum = 0.0;
  std::size_t n = 0;
  const auto v = vertices(g);
  const auto points = get(CGAL::vertex_point, g);
  for (auto i = v.first; i != v.second; ++i, ++n) {
    const auto p = atlasfit::detail::coordinates(get(points, *i));
    sum += off_torus(p[0], p[1], p[2]);
  }
  return sum / static_cast<double>(n);
}

template <class G>
void denoised_in_place() {
  G mesh;
  build(noisy_torus(), mesh);
  const double before = mean_off_torus(mesh);
  const std::size_t count = count_faces(mesh);
  want(stops([&] { atlasfit::denoise(mesh, {}, stopping()); }) && mean_off_torus(mesh) == before,
       "a callback that throws leaves the points");
  const auto clean = atlasfit::denoise(mesh);
  want(clean.report().points == num_vertices(mesh) && count_faces(mesh) == count,
       "all vertices and faces stay");
  want(mean_off_torus(mesh) < 0.5 * before, "points are on the surface");
  want(atlasfit::measure_topology(mesh).closed == 1, "still closed");
}

template <class G>
void spikes_follow_their_neighbours() {
  G mesh;
  build(noisy_torus(), mesh);
  const auto points = CGAL::get_property_map(CGAL::vertex_point, mesh);
  using Point = typename boost::property_traits<decltype(points)>::value_type;
  const auto spike = *vertices(mesh).first;
  const Point p = get(points, spike);
  put(points, spike, Point(4 * p[0], 4 * p[1], 4 * p[2]));
  const auto clean = atlasfit::denoise(mesh);
  const Point q = get(points, spike);
  want(clean.report().outliers == 1 && clean.report().followed_outliers == 1, "the spike is an outlier");
  want(off_torus(CGAL::to_double(q[0]), CGAL::to_double(q[1]), CGAL::to_double(q[2])) < 0.1,
       "it goes between its neighbours");
}

static void failures() {
  Surface none;
  want(status_of([&] { atlasfit::unwrap(none); }) == ATLASFIT_DEGENERATE, "a mesh without faces");
  Surface mesh;
  build(ell(), mesh);
  want(stops([&] { atlasfit::unwrap(mesh, {}, stopping()); }), "an exception comes out of unwrap");
  atlasfit::UnwrapOptions bad;
  bad.max_stretch = 0.5;
  want(status_of([&] { atlasfit::unwrap(mesh, bad); }) == ATLASFIT_INVALID_ARGUMENT, "a bad option");
  want(mesh.is_valid() && mesh.number_of_faces() == 8, "the mesh is as it was");
  // Three faces at an edge: a half-edge mesh takes two of them.
  Faces book;
  book.at = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  book.faces = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  Surface fan;
  want(build(book, fan) == 1 && check_layout(fan).size() == 12, "what is refused is not there");
  // A point that is not finite makes degenerate faces, not a failure.
  mesh.point(Surface::Vertex_index(0)) = K::Point_3(std::nan(""), 0, 0);
  const auto layout = atlasfit::unwrap(mesh);
  want(layout.info.degenerate_faces > 0 && uvs(mesh, layout).size() == 2 * 36, "counted, all corners there");
}

/// The map for meshes without indices grows, keeps the last value, and tells lone nodes from neighbours.
static void maps_by_address() {
  struct Node {
    char bytes[56];
  };
  std::vector<Node> nodes(5000);
  std::vector<std::unique_ptr<Node>> lone(100);
  const atlasfit::detail::AddressMap<const Node *, int> map;
  for (int round = 0; round < 2; round++)
    for (std::size_t i = 0; i < nodes.size(); i += 2) put(map, &nodes[i], static_cast<int>(i) + round);
  for (std::size_t i = 0; i < lone.size(); i++) {
    lone[i] = std::make_unique<Node>();
    put(map, lone[i].get(), -static_cast<int>(i));
  }
  for (std::size_t i = 0; i < nodes.size(); i += 2)
    want(get(map, &nodes[i]) == static_cast<int>(i) + 1 && get(map, &nodes[i + 1]) == 0, "values by node");
  for (std::size_t i = 0; i < lone.size(); i++)
    want(get(map, lone[i].get()) == -static_cast<int>(i), "values of lone nodes");
  put(map, &nodes[0], 0);
  want(get(map, &nodes[0]) == 0, "back to the default");
}

int main() {
  maps_by_address();
  every_model_alike();
  garbage_is_passed_over();
  bent_polygons_are_told();
  named_parameters();
  denoised_in_place<Surface>();
  denoised_in_place<FloatSurface>();
  denoised_in_place<Polyhedron>();
  spikes_follow_their_neighbours<Surface>();
  failures();
  want(atlasfit_live_handles() == 0, "no handle is left");
  return verdict();
}
