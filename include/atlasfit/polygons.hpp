/* atlasfit/polygons.hpp - what the headers for other libraries' meshes share; it needs none of them.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * In: positions, and the vertices of each polygon in order. Out: views that atlasfit.hpp takes. */
#ifndef ATLASFIT_POLYGONS_HPP
#define ATLASFIT_POLYGONS_HPP

#include "../atlasfit.hpp"

#include <cmath>
#include <cstring>

namespace atlasfit {

/// u, v of a corner.
using Uv = std::array<float, 2>;

/// The chart and page of a face that has none: it has fewer than three corners.
constexpr std::uint32_t no_chart = UINT32_MAX;

namespace detail {

using Vec3 = std::array<double, 3>;

inline Vec3 minus(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3 cross(const Vec3 &a, const Vec3 &b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// An index as the library takes it.
inline std::uint32_t narrow(std::size_t index) {
  if (index >= UINT32_MAX)
    throw Error(ATLASFIT_INVALID_ARGUMENT,
                "the mesh has more vertices or corners than 32 bits count. Cut it into parts");
  return static_cast<std::uint32_t>(index);
}

/// Polygons as the library takes them. Corners are numbered on from polygon to polygon.
class Polygons {
 public:
  /// x, y, z of each vertex.
  std::vector<double> xyz;
  /// Edges that must be seams, as pairs of vertices.
  std::vector<std::uint32_t> seams;

  void reserve(std::size_t faces) {
    corners_.reserve(3 * faces);
    offsets_.reserve(faces + 1);
  }
  /// Adds the polygon of these vertices. No chart spans polygons of different groups.
  void add(const std::vector<std::uint32_t> &vertices) {
    corners_.insert(corners_.end(), vertices.begin(), vertices.end());
    offsets_.push_back(narrow(corners_.size()));
  }
  /// Adds a polygon of a group: no chart spans two groups.
  void add(const std::vector<std::uint32_t> &vertices, std::uint32_t group) {
    add(vertices);
    groups_.push_back(group);
  }
  /// What the library takes; a view of this object.
  Mesh mesh() const {
    Mesh view(xyz, faces());
    if (!groups_.empty()) view.face_group(groups_.data());
    if (!seams.empty()) view.seam_edges(seams.data(), seams.size() / 2);
    return view;
  }
  /// The vertices as points that know their faces; a view of this object.
  Points vertices() const {
    Points view(xyz);
    if (!corners_.empty()) view.faces(faces());
    return view;
  }
  std::size_t size() const noexcept { return offsets_.size() - 1; }
  std::size_t corners() const noexcept { return corners_.size(); }
  /// Normals of the vertices: the sum of those of their polygons, weighted by area (Newell's); zeros where
  /// there is no face.
  std::vector<float> normals() const {
    std::vector<float> all(xyz.size(), 0.0f);
    std::vector<double> sum(xyz.size(), 0.0);
    const auto place = [this](std::size_t c) {
      const std::size_t v = corners_[c];
      return Vec3{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]};
    };
    for (std::size_t f = 0; f < size(); f++) {
      const std::size_t first = offsets_[f], end = offsets_[f + 1];
      Vec3 normal = {0, 0, 0};
      for (std::size_t c = first + 2; c < end; c++) {
        const Vec3 part = cross(minus(place(c - 1), place(first)), minus(place(c), place(first)));
        for (std::size_t k = 0; k < 3; k++) normal[k] += part[k];
      }
      if (!std::isfinite(dot(normal, normal))) continue;
      for (std::size_t c = first; c < end; c++)
        for (std::size_t k = 0; k < 3; k++) sum[3 * std::size_t(corners_[c]) + k] += normal[k];
    }
    for (std::size_t v = 0; v < sum.size(); v += 3) {
      const double length = std::sqrt(sum[v] * sum[v] + sum[v + 1] * sum[v + 1] + sum[v + 2] * sum[v + 2]);
      if (!(length > 0.0) || !std::isfinite(length)) continue;
      for (std::size_t k = v; k < v + 3; k++) all[k] = static_cast<float>(sum[k] / length);
    }
    return all;
  }

 private:
  Faces faces() const { return Faces(corners_.data(), offsets_.data(), size()); }
  std::vector<std::uint32_t> corners_, groups_, offsets_ = {0};
};

/// What denoising says of each point that was given.
struct Moved {
  std::vector<double> xyz;        ///< x, y, z per point given.
  std::vector<float> normals;     ///< 3 per point given.
  std::vector<char> kept, known;  ///< Whether it is among the denoised points; and on a chart.
  Moved(const Denoised &clean, std::size_t given)
      : xyz(3 * given), normals(3 * given), kept(given, 0), known(given, 0) {
    const std::vector<double> from = clean.point_positions();
    const std::vector<float> sides = clean.point_normals();
    const std::vector<std::uint32_t> sources = clean.point_sources(), charts = clean.point_charts();
    for (std::size_t i = 0; i < sources.size(); i++) {
      const std::size_t to = sources[i];
      kept[to] = 1;
      known[to] = charts[i] != no_chart;
      for (std::size_t k = 0; k < 3; k++) {
        xyz[3 * to + k] = from[3 * i + k];
        normals[3 * to + k] = sides[3 * i + k];
      }
    }
  }
  /// Whether a vertex of a mesh has a new place: on a chart, or, as an outlier, between its neighbours. The
  /// others stay as they are to the last bit, whatever the mesh's number type.
  bool placed(std::size_t vertex, const std::vector<double> &given) const {
    return kept[vertex] &&
           (known[vertex] || std::memcmp(&xyz[3 * vertex], &given[3 * vertex], 3 * sizeof(double)) != 0);
  }
};

}  // namespace detail

/// An attribute that a surface carries.
struct SurfaceAttribute {
  std::string name;
  std::uint32_t scalar = ATLASFIT_F32;  ///< The points' own: ATLASFIT_F32 to ATLASFIT_I32.
  std::vector<double> values;           ///< One per vertex.
};

/// Triangles with what belongs to them, for copy_surface(); what there is none of is empty.
struct Surface {
  std::vector<double> xyz;                ///< x, y, z per vertex.
  std::vector<std::uint32_t> triangles;   ///< 3 vertices each.
  std::vector<float> normals;             ///< 3 per vertex.
  std::vector<float> rgba;                ///< 4 per vertex, 0 to 1.
  std::vector<float> corner_uv;           ///< u, v per corner of a triangle.
  std::vector<std::uint32_t> face_chart;  ///< Per triangle.
  std::vector<SurfaceAttribute> attributes;

  Surface() = default;
  /// The surface of a denoised scan.
  Surface(const Denoised &clean)
      : xyz(clean.surface_positions()),
        triangles(clean.surface_triangles()),
        normals(clean.surface_normals()) {
    if (clean.report().has_colors) rgba = clean.surface_colors();
    if (!clean.report().has_uv) return;
    corner_uv = clean.surface_corner_uv();
    face_chart = clean.surface_face_charts();
  }
  /// Throws Error unless sizes and indices fit.
  void check() const {
    const std::size_t v = xyz.size() / 3, t = triangles.size() / 3;
    const auto fits = [](std::size_t size, std::size_t wanted) { return size == 0 || size == wanted; };
    bool good = xyz.size() == 3 * v && triangles.size() == 3 * t && fits(normals.size(), 3 * v) &&
                fits(rgba.size(), 4 * v) && fits(corner_uv.size(), 6 * t) && fits(face_chart.size(), t);
    for (const SurfaceAttribute &a : attributes) good = good && a.values.size() == v;
    if (!good) throw Error(ATLASFIT_INVALID_ARGUMENT, "an array of the surface is too short or too long");
    for (std::size_t k = 0; k < triangles.size(); k++)
      if (triangles[k] >= v)
        throw Error(ATLASFIT_INDEX_OUT_OF_RANGE, "triangle " + std::to_string(k / 3) + " names vertex " +
                                                     std::to_string(triangles[k]) + ", but there are " +
                                                     std::to_string(v));
  }
};

namespace detail {

/// Adds a surface to a mesh that may refuse faces, as half-edge meshes do where an edge or a vertex would not
/// be manifold: such a face gets vertices of its own, so that none is lost. `vertex(v)` adds a copy of vertex
/// v, `face(t, a, b, c)` triangle t, and says whether it was taken. Returns how many were refused.
template <class Handle, class AddVertex, class AddFace>
std::size_t add_surface(const Surface &from, AddVertex vertex, AddFace face) {
  from.check();
  std::vector<Handle> at;
  at.reserve(from.xyz.size() / 3);
  for (std::size_t v = 0; v < from.xyz.size() / 3; v++) at.push_back(vertex(v));
  std::size_t refused = 0;
  for (std::size_t t = 0; t < from.triangles.size() / 3; t++) {
    const std::uint32_t *corner = &from.triangles[3 * t], a = corner[0], b = corner[1], c = corner[2];
    if (a != b && b != c && c != a && face(t, at[a], at[b], at[c])) continue;
    refused++;
    const Handle x = vertex(a), y = vertex(b), z = vertex(c);
    face(t, x, y, z);
  }
  return refused;
}

}  // namespace detail
}  // namespace atlasfit

#endif
