/* atlasfit/cgal.hpp - atlasfit on CGAL's point sets (CGAL::Point_set_3), and surfaces as CGAL::Surface_mesh.
 * CGAL 5.5 or newer.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * It includes no GPL header of CGAL, but the point set and the surface mesh that you hand in are GPL:
 * docs/meshes.md says which licence a program then has.
 *
 *   auto clean = atlasfit::denoise(points);        // in place; dropped outliers become garbage of the set
 *   auto other = atlasfit::denoised(points);       // other.points is a new set
 *   atlasfit::copy_surface(clean, mesh);           // a Surface_mesh with normals, colours, UVs, attributes
 *
 * Removed points are passed over. Colours are the properties red, green, blue (or r, g, b) of unsigned char,
 * or color of CGAL::IO::Color; all other properties that are numbers of up to 32 bits, float or double are
 * carried over to the surface. Points keep all properties, of whatever type. A failure leaves the set as it
 * was. */
#ifndef ATLASFIT_CGAL_HPP
#define ATLASFIT_CGAL_HPP

#include "bgl.hpp"

#include <CGAL/IO/Color.h>
#include <CGAL/Kernel_traits.h>

namespace CGAL {
template <class Point>
class Surface_mesh;
}

namespace atlasfit {

/// A denoised point set: what atlasfit::Denoised holds, and the attributes that the surface carries.
class DenoisedSet : public Denoised {
 public:
  DenoisedSet(Denoised &&clean, std::vector<SurfaceAttribute> names)
      : Denoised(std::move(clean)), names_(std::move(names)) {}
  /// The surface with the attributes of the point set.
  Surface surface() const {
    Surface all(*this);
    all.attributes = names_;
    for (std::size_t i = 0; i < names_.size(); i++) all.attributes[i].values = surface_attribute(i);
    return all;
  }

 private:
  std::vector<SurfaceAttribute> names_;
};

/// A denoised copy of a point set.
template <class PointSet>
struct DenoisedCopy {
  PointSet points;
  DenoisedSet clean;
};

namespace detail {

/// Calls f(T(), its number) for each type of an attribute until f returns true.
template <class F>
void of_scalars(F &&f) {
  constexpr std::uint32_t plain_char = std::is_signed<char>::value ? ATLASFIT_I8 : ATLASFIT_U8;
  (void)(f(float(), ATLASFIT_F32) || f(double(), ATLASFIT_F64) || f(std::uint8_t(), ATLASFIT_U8) ||
         f(std::int8_t(), ATLASFIT_I8) || f(char(), plain_char) || f(std::uint16_t(), ATLASFIT_U16) ||
         f(std::int16_t(), ATLASFIT_I16) || f(std::uint32_t(), ATLASFIT_U32) ||
         f(std::int32_t(), ATLASFIT_I32));
}

/// The points of a set as arrays, in its order and without its garbage.
template <class PointSet>
class SetArrays {
 public:
  explicit SetArrays(const PointSet &set) {
    xyz_.reserve(3 * set.size());
    for (auto i = set.begin(); i != set.end(); ++i) append(xyz_, coordinates(set.point(*i)));
    if (set.has_normal_map())
      for (auto i = set.begin(); i != set.end(); ++i) append(normals_, coordinates(set.normal(*i)));
    if (!color(set) && !channels(set, {"red", "green", "blue"})) channels(set, {"r", "g", "b"});
    for (const std::string &name : set.properties()) {
      if (std::find(channels_.begin(), channels_.end(), name) == channels_.end()) attribute(set, name);
    }
  }
  /// A view of this object.
  Points points() const {
    Points all(xyz_);
    if (!normals_.empty()) all.normals(normals_.data());
    if (!rgb_.empty()) all.colors(rgb_.data(), 3);
    for (std::size_t i = 0; i < names_.size(); i++)
      all.attribute(names_[i].name.c_str(), values_[i].data(), names_[i].scalar);
    return all;
  }
  const std::vector<SurfaceAttribute> &names() const { return names_; }
  std::size_t size() const { return xyz_.size() / 3; }

 private:
  template <class T>
  static void append(std::vector<T> &to, const Vec3 &from) {
    for (const double x : from) to.push_back(static_cast<T>(x));
  }
  bool color(const PointSet &set) {
    const auto map = set.template property_map<CGAL::IO::Color>("color");
    if (!map.second) return false;
    for (auto i = set.begin(); i != set.end(); ++i) {
      const CGAL::IO::Color &c = map.first[*i];
      rgb_.insert(rgb_.end(), {c.red(), c.green(), c.blue()});
    }
    return true;
  }
  bool channels(const PointSet &set, const std::array<const char *, 3> &names) {
    for (const char *name : names)
      if (!set.template has_property_map<std::uint8_t>(name)) return false;
    channels_.assign(names.begin(), names.end());
    rgb_.resize(3 * set.size());
    for (std::size_t c = 0; c < 3; c++) {
      const auto map = set.template property_map<std::uint8_t>(names[c]).first;
      std::size_t at = c;
      for (auto i = set.begin(); i != set.end(); ++i, at += 3) rgb_[at] = map[*i];
    }
    return true;
  }
  void attribute(const PointSet &set, const std::string &name) {
    of_scalars([&](auto type, std::uint32_t scalar) {
      using T = decltype(type);
      const auto map = set.template property_map<T>(name);
      if (!map.second) return false;
      std::vector<unsigned char> bytes(set.size() * sizeof(T));
      unsigned char *to = bytes.data();
      for (auto i = set.begin(); i != set.end(); ++i, to += sizeof(T)) {
        const T value = map.first[*i];
        std::copy_n(reinterpret_cast<const unsigned char *>(&value), sizeof(T), to);
      }
      values_.push_back(std::move(bytes));
      names_.push_back({name, scalar, {}});
      return true;
    });
  }
  std::vector<double> xyz_;
  std::vector<float> normals_;
  std::vector<std::uint8_t> rgb_;
  std::vector<std::string> channels_;
  std::vector<SurfaceAttribute> names_;
  std::vector<std::vector<unsigned char>> values_;
};

inline CGAL::IO::Color color_at(const float *rgba) {
  std::array<unsigned char, 4> c{};
  for (std::size_t k = 0; k < 4; k++)
    c[k] = static_cast<unsigned char>(std::lround(255.0f * std::min(std::max(rgba[k], 0.0f), 1.0f)));
  return CGAL::IO::Color(c[0], c[1], c[2], c[3]);
}

/// Writes denoised points back to the set that they came from. Points on no chart stay exactly as they are;
/// points that were dropped are removed, and the order of the others stays.
template <class PointSet>
void write_back(const Moved &moved, PointSet &set) {
  using Point = typename PointSet::Point_3;
  using Vector = typename PointSet::Vector_3;
  const bool normals = set.has_normal_map();
  std::vector<std::pair<typename PointSet::Index, char>> order;
  order.reserve(set.size());
  std::size_t n = 0;
  for (auto i = set.begin(); i != set.end(); ++i, ++n) {
    order.emplace_back(*i, moved.kept[n]);
    if (!moved.known[n]) continue;
    set.point(*i) = point_at<Point>(&moved.xyz[3 * n]);
    if (normals) set.normal(*i) = point_at<Vector>(&moved.normals[3 * n]);
  }
  const auto dropped =
      std::stable_partition(order.begin(), order.end(), [](const auto &entry) { return entry.second != 0; });
  if (dropped == order.end()) return;
  n = 0;
  for (auto i = set.begin(); i != set.end(); ++i, ++n) *i = order[n].first;
  set.remove(set.begin() + (dropped - order.begin()), set.end());
}

/// Gives vertices of a Surface_mesh the attribute of the vertices that they were copied from, as a property
/// of the type that the points had.
template <class Vertex, class SurfaceMesh>
void add_attribute(const SurfaceAttribute &from, const std::vector<std::pair<Vertex, std::size_t>> &copies,
                   SurfaceMesh &mesh) {
  of_scalars([&](auto type, std::uint32_t scalar) {
    using T = decltype(type);
    if (scalar != from.scalar) return false;
    const auto map = mesh.template add_property_map<Vertex, T>("v:" + from.name, T()).first;
    for (const auto &copy : copies) map[copy.first] = static_cast<T>(from.values[copy.second]);
    return true;
  });
}

}  // namespace detail

/// Denoises a point set in place: its points are moved, and its normals, if it has any, are turned. Points
/// that the options drop are removed, which makes them garbage: set.collect_garbage() frees them.
template <class PointSet, class = typename PointSet::Point_map, class = typename PointSet::Vector_map>
DenoisedSet denoise(PointSet &set, const DenoiseOptions &options = DenoiseOptions(), const Run &run = Run()) {
  const detail::SetArrays<PointSet> arrays(set);
  DenoisedSet clean(denoise(arrays.points(), options, run), arrays.names());
  detail::write_back(detail::Moved(clean, arrays.size()), set);
  return clean;
}

/// Denoises a copy of a point set, with all of its properties and without garbage.
template <class PointSet, class = typename PointSet::Point_map, class = typename PointSet::Vector_map>
DenoisedCopy<PointSet> denoised(const PointSet &set, const DenoiseOptions &options = DenoiseOptions(),
                                const Run &run = Run()) {
  PointSet copy(set);
  DenoisedSet clean = denoise(copy, options, run);
  copy.collect_garbage();
  return {std::move(copy), std::move(clean)};
}

/// Adds a surface to a mesh, with the properties "v:normal", "v:color", "h:uv" (atlasfit::Uv), "f:chart" and
/// "v:NAME" for each attribute, as far as there are any. Returns how many faces the mesh refused: they have
/// vertices of their own.
template <class Point>
std::size_t copy_surface(const Surface &from, CGAL::Surface_mesh<Point> &mesh) {
  using M = CGAL::Surface_mesh<Point>;
  using Vertex = typename M::Vertex_index;
  using Halfedge = typename M::Halfedge_index;
  using Face = typename M::Face_index;
  using Vector = typename CGAL::Kernel_traits<Point>::Kernel::Vector_3;
  from.check();
  typename M::template Property_map<Vertex, Vector> normal;
  typename M::template Property_map<Vertex, CGAL::IO::Color> color;
  typename M::template Property_map<Halfedge, Uv> uv;
  typename M::template Property_map<Face, std::uint32_t> chart;
  if (!from.normals.empty()) normal = mesh.template add_property_map<Vertex, Vector>("v:normal").first;
  if (!from.rgba.empty()) color = mesh.template add_property_map<Vertex, CGAL::IO::Color>("v:color").first;
  if (!from.corner_uv.empty()) uv = mesh.template add_property_map<Halfedge, Uv>("h:uv", Uv()).first;
  if (!from.face_chart.empty())
    chart = mesh.template add_property_map<Face, std::uint32_t>("f:chart", no_chart).first;
  std::vector<std::pair<Vertex, std::size_t>> copies;
  const auto vertex = [&](std::size_t v) {
    const Vertex at = mesh.add_vertex(detail::point_at<Point>(&from.xyz[3 * v]));
    if (!from.normals.empty()) normal[at] = detail::point_at<Vector>(&from.normals[3 * v]);
    if (!from.rgba.empty()) color[at] = detail::color_at(&from.rgba[4 * v]);
    copies.emplace_back(at, v);
    return at;
  };
  const auto face = [&](std::size_t t, Vertex a, Vertex b, Vertex c) {
    const Face f = mesh.add_face(a, b, c);
    if (f == M::null_face()) return false;
    if (!from.face_chart.empty()) chart[f] = from.face_chart[t];
    if (from.corner_uv.empty()) return true;
    detail::around(mesh, f, [&](Halfedge h) {
      const float *at = &from.corner_uv[6 * t + (target(h, mesh) == a ? 0u : target(h, mesh) == b ? 2u : 4u)];
      uv[h] = Uv{at[0], at[1]};
    });
    return true;
  };
  const std::size_t refused = detail::add_surface<Vertex>(from, vertex, face);
  for (const SurfaceAttribute &a : from.attributes) detail::add_attribute(a, copies, mesh);
  return refused;
}
/// The same with the attributes of the point set.
template <class Point>
std::size_t copy_surface(const DenoisedSet &from, CGAL::Surface_mesh<Point> &mesh) {
  return copy_surface(from.surface(), mesh);
}

}  // namespace atlasfit

#endif
