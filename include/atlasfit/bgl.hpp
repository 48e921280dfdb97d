/* atlasfit/bgl.hpp - atlasfit on meshes that are models of CGAL's FaceGraph: CGAL::Surface_mesh,
 * CGAL::Polyhedron_3, OpenMesh through CGAL's graph traits, your own. CGAL 5.5 or newer.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * What it includes of CGAL is under the LGPL (named parameters, property maps); it includes no GPL header.
 * The mesh may be GPL: docs/meshes.md says which licence a program then has.
 *
 *   auto layout = atlasfit::unwrap(mesh);          // layout.uv: UV per halfedge, layout.chart: per face
 *   auto quality = atlasfit::measure_uv(mesh, layout);
 *   auto clean = atlasfit::denoise(mesh);          // vertices moved onto the surface
 *
 * Named parameters, all of them CGAL's: vertex_point_map; edge_is_constrained_map (true = a seam of the UVs);
 * face_patch_map (no chart spans two patches). The UV of a halfedge is that of its face at its target.
 * A failure leaves the mesh as it was. */
#ifndef ATLASFIT_BGL_HPP
#define ATLASFIT_BGL_HPP

#include "polygons.hpp"

#include <CGAL/Dynamic_property_map.h>
#include <CGAL/Named_function_parameters.h>
#include <CGAL/boost/graph/named_params_helper.h>
#include <CGAL/boost/graph/properties.h>
#include <CGAL/number_utils.h>
#include <boost/graph/graph_traits.hpp>

#include <deque>
#include <memory>

namespace atlasfit {
namespace detail {

template <class G>
using Vertex = typename boost::graph_traits<G>::vertex_descriptor;
template <class G>
using Halfedge = typename boost::graph_traits<G>::halfedge_descriptor;
template <class G>
using Face = typename boost::graph_traits<G>::face_descriptor;

/// Whether a descriptor points at its vertex, halfedge or face, as CGAL::Polyhedron_3's do.
template <class K, class = void>
struct PointsAt : std::false_type {};
template <class K>
struct PointsAt<K, std::void_t<decltype(*std::declval<const K &>())>>
    : std::is_lvalue_reference<decltype(*std::declval<const K &>())> {};

/// A property map by address, for meshes whose vertices, halfedges and faces have no indices but lie
/// somewhere in memory. Values of nodes that lie side by side lie side by side too, in pages; a table by hash
/// value finds the page. What has no value has the default of its type.
template <class K, class V>
class AddressMap {
 public:
  using key_type = K;
  using value_type = V;
  using reference = const V &;
  using category = boost::read_write_property_map_tag;

  AddressMap() : table_(std::make_shared<Table>()) {}
  friend reference get(const AddressMap &map, const K &key) {
    const std::size_t place = map.place(key);
    const Slot &slot = map.table_->slots[map.find(place / page)];
    return slot.values == nullptr ? map.table_->none : (*slot.values)[place % page];
  }
  friend void put(const AddressMap &map, const K &key, const V &value) {
    Table &table = *map.table_;
    const std::size_t place = map.place(key);
    std::size_t at = map.find(place / page);
    if (table.slots[at].values == nullptr) {
      if (value == table.none) return;
      if (2 * (table.pages.size() + 1) > table.slots.size()) {
        map.grow();
        at = map.find(place / page);
      }
      table.slots[at] = {place / page, &table.pages.emplace_back()};
    }
    (*table.slots[at].values)[place % page] = value;
  }

 private:
  /// Values a page. A lone node costs a whole one; neighbours share a look-up and its cache lines.
  static constexpr std::size_t page = 32;
  using Page = std::array<V, page>;
  struct Slot {
    std::size_t number = 0;
    Page *values = nullptr;  ///< None = a free slot.
  };
  struct Table {
    unsigned shift = 60;  ///< 64 - log2 of the number of slots.
    std::vector<Slot> slots = std::vector<Slot>(16);
    std::deque<Page> pages;
    V none{};
  };
  /// A number of its own for each node: nodes do not overlap, so the quotients differ.
  static std::size_t place(const K &key) {
    return reinterpret_cast<std::uintptr_t>(std::addressof(*key)) / sizeof(*key);
  }
  /// The slot of a page, or the free one where it would be.
  std::size_t find(std::size_t number) const {
    const std::vector<Slot> &slots = table_->slots;
    const std::size_t mask = slots.size() - 1;
    // Fibonacci hashing (Knuth, The Art of Computer Programming 3, 6.4): the highest bits spread best.
    std::size_t at = static_cast<std::size_t>((std::uint64_t(number) * 0x9e3779b97f4a7c15u) >> table_->shift);
    while (slots[at].values != nullptr && slots[at].number != number) at = (at + 1) & mask;
    return at;
  }
  void grow() const {
    std::vector<Slot> old(2 * table_->slots.size());
    old.swap(table_->slots);
    table_->shift--;
    for (const Slot &slot : old)
      if (slot.values != nullptr) table_->slots[find(slot.number)] = slot;
  }
  std::shared_ptr<Table> table_;
};

/// A map of new values for a mesh that stays as it is: by address where halfedges have no index, if they have
/// one; else CGAL's own.
template <class G, class K, class V, class Tag>
struct NewMap {
  static constexpr bool by_address =
      !CGAL::graph_has_property<G, boost::halfedge_index_t>::value && PointsAt<K>::value;
  template <class H, class T>
  struct Dynamic {
    using type = typename boost::property_map<H, T>::const_type;
  };
  struct Address {
    using type = AddressMap<K, V>;
  };
  using type = typename std::conditional_t<by_address, Address, Dynamic<G, Tag>>::type;
  static type make(const G &g) {
    if constexpr (by_address)
      return type();
    else
      return get(Tag(), g);
  }
};
template <class G, class V>
using VertexMap = NewMap<G, Vertex<G>, V, CGAL::dynamic_vertex_property_t<V>>;
template <class G, class V>
using HalfedgeMap = NewMap<G, Halfedge<G>, V, CGAL::dynamic_halfedge_property_t<V>>;
template <class G, class V>
using FaceMap = NewMap<G, Face<G>, V, CGAL::dynamic_face_property_t<V>>;

/// Whether the named parameter of a tag was given.
template <class NP, class Tag>
constexpr bool given() {
  using Value = decltype(CGAL::parameters::get_parameter(std::declval<const NP &>(), Tag()));
  return !std::is_same<std::decay_t<Value>, CGAL::internal_np::Param_not_found>::value;
}

/// Calls f with each halfedge of a face, in order.
template <class G, class F>
void around(const G &g, Face<G> face, F &&f) {
  const Halfedge<G> first = halfedge(face, g);
  Halfedge<G> h = first;
  do {
    f(h);
    h = next(h, g);
  } while (h != first);
}

/// x, y, z of a point of any kernel.
template <class P>
Vec3 coordinates(const P &p) {
  return {CGAL::to_double(p[0]), CGAL::to_double(p[1]), CGAL::to_double(p[2])};
}

/// A point or a vector of any kernel.
template <class P, class T>
P point_at(const T *xyz) {
  using Number = std::decay_t<decltype(std::declval<const P &>()[0])>;
  return P(static_cast<Number>(xyz[0]), static_cast<Number>(xyz[1]), static_cast<Number>(xyz[2]));
}

/// The faces and halfedges that Polygons were made of: where results go without a second walk over a mesh
/// whose parts lie anywhere in memory.
template <class G>
struct Places {
  std::vector<Face<G>> faces;
  std::vector<Halfedge<G>> corners;
};

/// A mesh as polygons, in the order of its faces, with what the named parameters say.
template <class G, class NP>
Polygons polygons_of(const G &g, const NP &np, Places<G> *places = nullptr) {
  namespace tags = CGAL::internal_np;
  using CGAL::parameters::get_parameter;
  const auto points = CGAL::parameters::choose_parameter(get_parameter(np, tags::vertex_point),
                                                         CGAL::get_const_property_map(CGAL::vertex_point, g));
  Polygons all;
  const auto number = VertexMap<G, std::uint32_t>::make(g);
  std::size_t count = 0;
  all.xyz.reserve(3 * num_vertices(g));
  const auto v = vertices(g);
  for (auto i = v.first; i != v.second; ++i) {
    put(number, *i, narrow(count++));
    const Vec3 p = coordinates(get(points, *i));
    all.xyz.insert(all.xyz.end(), p.begin(), p.end());
  }
  if constexpr (given<NP, tags::edge_is_constrained_t>()) {
    const auto seam = get_parameter(np, tags::edge_is_constrained);
    const auto e = edges(g);
    for (auto i = e.first; i != e.second; ++i)
      if (get(seam, *i)) {
        all.seams.push_back(get(number, source(*i, g)));
        all.seams.push_back(get(number, target(*i, g)));
      }
  }
  std::vector<std::uint32_t> corners;
  const auto f = faces(g);
  all.reserve(num_faces(g));
  if (places != nullptr) {
    places->faces.reserve(num_faces(g));
    places->corners.reserve(3 * num_faces(g));
  }
  for (auto i = f.first; i != f.second; ++i) {
    corners.clear();
    if (places != nullptr) places->faces.push_back(*i);
    around(g, *i, [&](Halfedge<G> h) {
      corners.push_back(get(number, target(h, g)));
      if (places != nullptr) places->corners.push_back(h);
    });
    if constexpr (given<NP, tags::face_patch_t>())
      all.add(corners, static_cast<std::uint32_t>(get(get_parameter(np, tags::face_patch), *i)));
    else
      all.add(corners);
  }
  return all;
}

/// Whether G is a graph with faces. Boost's traits of other types do not compile, so they are not asked.
template <class G>
using IfGraph = decltype(faces(std::declval<const G &>()));

using Defaults = CGAL::parameters::Default_named_parameters;

}  // namespace detail

/// UVs of a mesh that is a model of FaceGraph. The maps hold the values and outlive the mesh; halfedges and
/// faces that are added to the mesh later have none.
template <class G>
struct HalfedgeLayout {
  typename detail::HalfedgeMap<G, Uv>::type uv;  ///< Of a halfedge's face at its target.
  typename detail::FaceMap<G, std::uint32_t>::type chart,
      page;                                    ///< no_chart for faces of fewer than 3 corners.
  std::vector<typename detail::Face<G>> torn;  ///< Faces that had to be cut between charts.
  atlasfit_uv_info info = detail::output<atlasfit_uv_info>();  ///< Of the triangles that faces were cut into.
  std::vector<std::string> warnings;                           ///< What the user should hear.
};

/// Lays out UVs for a mesh, which stays as it is. Polygons are cut into triangles for it; each has one UV per
/// corner.
template <class G, class T, class Tag, class Base, class = detail::IfGraph<G>>
HalfedgeLayout<G> unwrap(const G &mesh, const CGAL::Named_function_parameters<T, Tag, Base> &np,
                         const UnwrapOptions &options = UnwrapOptions(), const Run &run = Run()) {
  detail::Places<G> places;
  const detail::Polygons polygons = detail::polygons_of(mesh, np, &places);
  const UvLayout made = unwrap(polygons.mesh(), options, run);
  const std::vector<float> uv = made.corners();
  const std::vector<std::uint32_t> charts = made.face_charts(), pages = made.face_pages(), cut = made.torn();
  HalfedgeLayout<G> out{detail::HalfedgeMap<G, Uv>::make(mesh),
                        detail::FaceMap<G, std::uint32_t>::make(mesh),
                        detail::FaceMap<G, std::uint32_t>::make(mesh),
                        {},
                        made.info(),
                        made.warnings()};
  for (std::size_t c = 0; c < places.corners.size(); c++)
    put(out.uv, places.corners[c], Uv{uv[2 * c], uv[2 * c + 1]});
  for (std::size_t p = 0; p < places.faces.size(); p++) {
    put(out.chart, places.faces[p], charts[p]);
    put(out.page, places.faces[p], pages[p]);
  }
  for (const std::uint32_t p : cut) out.torn.push_back(places.faces[p]);
  return out;
}
template <class G, class = detail::IfGraph<G>>
HalfedgeLayout<G> unwrap(const G &mesh, const UnwrapOptions &options = UnwrapOptions(),
                         const Run &run = Run()) {
  return unwrap(mesh, detail::Defaults(), options, run);
}

/// How a mesh hangs together, its polygons cut into triangles.
template <class G, class NP = detail::Defaults, class = detail::IfGraph<G>>
atlasfit_topology measure_topology(const G &mesh, const Run &run = Run(), const NP &np = NP()) {
  return measure_topology(detail::polygons_of(mesh, np).mesh(), run);
}

namespace detail {

/// Corner UVs from a map of halfedges.
template <class G, class UvMap>
std::vector<float> corner_uvs(const G &mesh, const Polygons &polygons, const UvMap &uv) {
  std::vector<float> all;
  all.reserve(2 * polygons.corners());
  const auto f = faces(mesh);
  for (auto i = f.first; i != f.second; ++i)
    around(mesh, *i, [&](Halfedge<G> h) {
      const auto &at = get(uv, h);
      for (int k = 0; k < 2; k++) all.push_back(static_cast<float>(CGAL::to_double(at[k])));
    });
  return all;
}

}  // namespace detail

/// Quality of the UVs that a property map gives halfedges: of their face, at their target. Anything with [0]
/// and [1] is a UV, CGAL's Point_2 too. All are on one page.
template <class G, class UvMap, class NP = detail::Defaults, class = detail::IfGraph<G>,
          class = typename boost::property_traits<UvMap>::value_type>
atlasfit_uv_quality measure_uv(const G &mesh, const UvMap &uv, const Run &run = Run(), const NP &np = NP()) {
  const detail::Polygons polygons = detail::polygons_of(mesh, np);
  const std::vector<float> corners = detail::corner_uvs(mesh, polygons, uv);
  return measure_uv(polygons.mesh().corner_uv(corners.data()), run);
}
/// Quality of the UVs that unwrap() gave.
template <class G, class NP = detail::Defaults, class = detail::IfGraph<G>>
atlasfit_uv_quality measure_uv(const G &mesh, const HalfedgeLayout<G> &layout, const Run &run = Run(),
                               const NP &np = NP()) {
  const detail::Polygons polygons = detail::polygons_of(mesh, np);
  const std::vector<float> corners = detail::corner_uvs(mesh, polygons, layout.uv);
  std::vector<std::uint32_t> page;
  const auto f = faces(mesh);
  for (auto i = f.first; i != f.second; ++i) page.push_back(get(layout.page, *i));
  return measure_uv(polygons.mesh()
                        .corner_uv(corners.data())
                        .face_page(page.data())
                        .page_size(layout.info.width, layout.info.height),
                    run);
}

/// A mesh against the true surface, which may be of another type.
template <class G, class H, class = detail::IfGraph<G>, class = detail::IfGraph<H>>
atlasfit_distance measure_surface(const G &mesh, const H &truth,
                                  const DistanceOptions &options = DistanceOptions(),
                                  const Run &run = Run()) {
  const detail::Polygons one = detail::polygons_of(mesh, detail::Defaults()),
                         other = detail::polygons_of(truth, detail::Defaults());
  return measure_surface(one.mesh(), other.mesh(), options, run);
}

/// Denoises the vertices of a mesh as a scan and writes them back to its vertex points. Faces stay; vertices
/// on no chart (outliers) follow their neighbours, or where they are to be dropped stay as they are. The side
/// out is that of the faces.
template <class G, class T, class Tag, class Base, class = detail::IfGraph<G>>
Denoised denoise(G &mesh, const CGAL::Named_function_parameters<T, Tag, Base> &np,
                 const DenoiseOptions &options = DenoiseOptions(), const Run &run = Run()) {
  const detail::Polygons polygons = detail::polygons_of(mesh, np);
  const std::vector<float> normals = polygons.normals();
  Denoised clean = denoise(polygons.vertices().normals(normals.data()), options, run);
  const detail::Moved moved(clean, polygons.xyz.size() / 3);
  auto points =
      CGAL::parameters::choose_parameter(CGAL::parameters::get_parameter(np, CGAL::internal_np::vertex_point),
                                         CGAL::get_property_map(CGAL::vertex_point, mesh));
  using Point = typename boost::property_traits<decltype(points)>::value_type;
  std::size_t n = 0;
  const auto v = vertices(mesh);
  for (auto i = v.first; i != v.second; ++i, ++n)
    if (moved.placed(n, polygons.xyz)) put(points, *i, detail::point_at<Point>(&moved.xyz[3 * n]));
  return clean;
}
template <class G, class = detail::IfGraph<G>>
Denoised denoise(G &mesh, const DenoiseOptions &options = DenoiseOptions(), const Run &run = Run()) {
  return denoise(mesh, detail::Defaults(), options, run);
}

}  // namespace atlasfit

#endif
