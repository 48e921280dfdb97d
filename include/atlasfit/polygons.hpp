/* atlasfit/polygons.hpp - polygon meshes as the triangles that atlasfit.h takes, and UVs back to the corners
 * of the polygons. What the headers for other libraries' meshes share; it needs none of them.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * In: positions, and the vertices of each polygon in order. Out: triangles; a UV per corner of a polygon. */
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
using Vec2 = std::array<double, 2>;

inline Vec3 minus(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3 cross(const Vec3 &a, const Vec3 &b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Twice the area of a triangle of the plane; positive where it runs counter-clockwise.
inline double turn(const Vec2 &a, const Vec2 &b, const Vec2 &c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// An index as the library takes it.
inline std::uint32_t narrow(std::size_t index) {
  if (index >= UINT32_MAX)
    throw Error(ATLASFIT_INVALID_ARGUMENT,
                "the mesh has more vertices or corners than 32 bits count. Cut it into parts");
  return static_cast<std::uint32_t>(index);
}

/// Cuts ears off a polygon of the plane until a triangle is left (Meisters 1975). `tests` is how many more
/// tests of a point in a triangle may be made: where none are left, a polygon becomes a plain fan.
inline void clip_ears(const std::vector<Vec2> &p, std::uint64_t &tests,
                      std::vector<std::array<std::size_t, 3>> &out) {
  const std::size_t n = p.size();
  std::vector<std::size_t> reflex, next(n), previous(n);
  for (std::size_t i = 0; i < n; i++) {
    next[i] = (i + 1) % n;
    previous[i] = (i + n - 1) % n;
    if (turn(p[previous[i]], p[i], p[next[i]]) < 0.0) reflex.push_back(i);
  }
  if (reflex.empty() || tests == 0) {
    for (std::size_t i = 2; i < n; i++) out.push_back({0, i - 1, i});
    return;
  }
  // Only a reflex corner can lie inside of an ear.
  std::vector<char> gone(n, 0);
  const auto free_of_corners = [&](std::size_t a, std::size_t i, std::size_t c) {
    tests -= std::min<std::uint64_t>(tests, reflex.size());
    for (const std::size_t r : reflex) {
      const bool own = gone[r] || r == a || r == c || p[r] == p[a] || p[r] == p[i] || p[r] == p[c];
      if (!own && turn(p[a], p[i], p[r]) >= 0.0 && turn(p[i], p[c], p[r]) >= 0.0 &&
          turn(p[c], p[a], p[r]) >= 0.0)
        return false;
    }
    return true;
  };
  // A full round without an ear means a self-crossing or flat polygon: any corner is then cut off.
  std::size_t i = 0, looked = 0;
  for (std::size_t left = n; left > 3;) {
    const std::size_t a = previous[i], c = next[i];
    const bool forced = looked >= left || tests == 0;
    if (forced || (turn(p[a], p[i], p[c]) > 0.0 && free_of_corners(a, i, c))) {
      out.push_back({a, i, c});
      next[a] = c;
      previous[c] = a;
      gone[i] = 1;
      left--;
      looked = 0;
    } else {
      looked++;
    }
    i = c;
  }
  out.push_back({previous[i], i, next[i]});
}

/// Cuts a polygon of four or more corners into triangles that do not fold, as corner numbers.
inline void triangulate(const std::vector<Vec3> &at, std::uint64_t &tests,
                        std::vector<std::array<std::size_t, 3>> &out) {
  const std::size_t n = at.size();
  // Newell's normal, relative to the first corner so that far-away coordinates do not cancel.
  Vec3 normal = {0, 0, 0};
  for (std::size_t i = 2; i < n; i++) {
    const Vec3 part = cross(minus(at[i - 1], at[0]), minus(at[i], at[0]));
    for (std::size_t k = 0; k < 3; k++) normal[k] += part[k];
  }
  out.clear();
  if (n == 4) {
    // Both triangles of a diagonal must face as the polygon does; of two such diagonals the shorter.
    const auto facing = [&](std::size_t a, std::size_t b, std::size_t c) {
      return dot(cross(minus(at[b], at[a]), minus(at[c], at[a])), normal) > 0.0;
    };
    const bool first = facing(0, 1, 2) && facing(0, 2, 3), second = facing(1, 2, 3) && facing(1, 3, 0);
    const Vec3 other = minus(at[1], at[3]), own = minus(at[0], at[2]);
    // Equal diagonals must not be told apart by rounding.
    const bool shorter = dot(other, other) < dot(own, own) * (1.0 - 1e-12);
    if (second && (!first || shorter))
      out.insert(out.end(), {{1, 2, 3}, {1, 3, 0}});
    else
      out.insert(out.end(), {{0, 1, 2}, {0, 2, 3}});
    return;
  }
  // The polygon counter-clockwise in the coordinate plane that its normal points away from most.
  std::size_t largest = 0;
  for (std::size_t k = 1; k < 3; k++)
    if (std::abs(normal[k]) >= std::abs(normal[largest])) largest = k;
  std::vector<Vec2> flat;
  flat.reserve(n);
  for (const Vec3 &corner : at) {
    const Vec3 p = minus(corner, at[0]);
    const double u = p[(largest + 1) % 3], v = p[(largest + 2) % 3];
    flat.push_back(normal[largest] < 0.0 ? Vec2{v, u} : Vec2{u, v});
  }
  clip_ears(flat, tests, out);
}

/// Polygons and the triangles that they are cut into. Corners are numbered on from polygon to polygon.
class Polygons {
 public:
  /// x, y, z of each vertex. Set them before polygons are added.
  std::vector<double> xyz;
  /// Edges that must be seams, as pairs of vertices.
  std::vector<std::uint32_t> seams;

  void reserve(std::size_t faces) { triangles_.reserve(3 * faces); }
  /// Adds the polygon of these vertices; one of fewer than three corners gives no triangle. No chart spans
  /// polygons of different groups.
  void add(const std::vector<std::uint32_t> &vertices) {
    const std::size_t n = vertices.size();
    narrow(corners_ + n);
    if (n != 3 && !numbered_) number_triangles();
    if (n == 3) {
      append({0, 1, 2}, vertices);
    } else if (n > 3) {
      at_.clear();
      for (const std::uint32_t v : vertices)
        at_.push_back({xyz[3 * std::size_t(v)], xyz[3 * std::size_t(v) + 1], xyz[3 * std::size_t(v) + 2]});
      triangulate(at_, tests_, cut_);
      for (const auto &t : cut_) append(t, vertices);
    }
    corners_ += n;
    count_++;
  }
  /// Adds a polygon of a group: no chart spans two groups.
  void add(const std::vector<std::uint32_t> &vertices, std::uint32_t group) {
    const std::size_t before = triangles_.size() / 3;
    add(vertices);
    groups_.insert(groups_.end(), triangles_.size() / 3 - before, group);
  }
  /// What the library takes; a view of this object.
  Mesh mesh() const {
    Mesh view(xyz.data(), xyz.size() / 3, triangles_.data(), triangles_.size() / 3);
    if (numbered_) view.face_polygon(polygon_.data());
    if (!groups_.empty()) view.face_group(groups_.data());
    if (!seams.empty()) view.seam_edges(seams.data(), seams.size() / 2);
    return view;
  }
  /// The vertices as points that know their triangles; a view of this object.
  Points vertices() const {
    Points view(xyz);
    view.triangles(triangles_.data(), triangles_.size() / 3);
    return view;
  }
  std::size_t size() const noexcept { return count_; }
  std::size_t corners() const noexcept { return corners_; }
  std::size_t triangles() const noexcept { return triangles_.size() / 3; }
  /// Whether all polygons are triangles: their numbers and corners are then those of the triangles.
  bool plain() const noexcept { return !numbered_; }
  /// The polygon of a triangle.
  std::size_t polygon_of(std::size_t triangle) const { return numbered_ ? polygon_[triangle] : triangle; }
  /// The polygons' corner at a triangle's corner.
  std::size_t corner_of(std::size_t triangle_corner) const {
    return numbered_ ? corner_[triangle_corner] : triangle_corner;
  }
  /// Normals of the vertices, weighted by area: zeros where there is no face.
  std::vector<float> normals() const {
    std::vector<float> all(xyz.size(), 0.0f);
    std::vector<double> sum(xyz.size(), 0.0);
    const auto place = [this](std::size_t v) { return Vec3{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}; };
    for (std::size_t t = 0; t < triangles_.size(); t += 3) {
      const Vec3 a = place(triangles_[t]);
      const Vec3 n = cross(minus(place(triangles_[t + 1]), a), minus(place(triangles_[t + 2]), a));
      if (!std::isfinite(dot(n, n))) continue;
      for (std::size_t k = 0; k < 9; k++) sum[3 * std::size_t(triangles_[t + k / 3]) + k % 3] += n[k % 3];
    }
    for (std::size_t v = 0; v < sum.size(); v += 3) {
      const double length = std::sqrt(sum[v] * sum[v] + sum[v + 1] * sum[v + 1] + sum[v + 2] * sum[v + 2]);
      if (!(length > 0.0) || !std::isfinite(length)) continue;
      for (std::size_t k = v; k < v + 3; k++) all[k] = static_cast<float>(sum[k] / length);
    }
    return all;
  }

 private:
  void number_triangles() {
    for (std::size_t k = 0; k < triangles_.size(); k++) {
      corner_.push_back(static_cast<std::uint32_t>(k));
      if (k % 3 == 0) polygon_.push_back(static_cast<std::uint32_t>(k / 3));
    }
    numbered_ = true;
  }
  void append(const std::array<std::size_t, 3> &cut, const std::vector<std::uint32_t> &vertices) {
    for (const std::size_t k : cut) {
      triangles_.push_back(vertices[k]);
      if (numbered_) corner_.push_back(static_cast<std::uint32_t>(corners_ + k));
    }
    if (numbered_) polygon_.push_back(static_cast<std::uint32_t>(count_));
  }
  std::vector<std::uint32_t> triangles_, corner_, polygon_, groups_;
  std::vector<Vec3> at_;
  std::vector<std::array<std::size_t, 3>> cut_;
  std::size_t corners_ = 0, count_ = 0;
  bool numbered_ = false;
  /// Ear clipping is quadratic at worst: beyond this many tests in one mesh, polygons become plain fans.
  std::uint64_t tests_ = std::uint64_t(1) << 26;
};

/// UVs of polygons.
struct PolygonUvs {
  std::vector<float> uv;                   ///< u, v per corner.
  std::vector<std::uint32_t> chart, page;  ///< Per polygon; no_chart where it has no triangle.
  std::vector<std::size_t> torn;           ///< Polygons whose triangles do not agree on a corner's UV.
};

/// A triangle mesh's UVs as those of the polygons. A polygon that does not lie flat may have been cut between
/// charts: its corners then have the UVs of its first triangles, and it is listed as torn.
inline PolygonUvs polygon_uvs(const Polygons &polygons, const UvLayout &layout) {
  PolygonUvs out;
  if (polygons.plain()) {
    out.uv = layout.corners();
    out.chart = layout.face_charts();
    out.page = layout.face_pages();
    return out;
  }
  const std::vector<float> corners = layout.corners();
  const std::vector<std::uint32_t> charts = layout.face_charts(), pages = layout.face_pages();
  out.uv.assign(2 * polygons.corners(), 0.0f);
  out.chart.assign(polygons.size(), no_chart);
  out.page.assign(polygons.size(), no_chart);
  std::vector<char> known(polygons.corners(), 0);
  for (std::size_t t = 0; t < polygons.triangles(); t++) {
    const std::size_t p = polygons.polygon_of(t);
    bool agrees = out.chart[p] == no_chart || out.chart[p] == charts[t];
    if (out.chart[p] == no_chart) {
      out.chart[p] = charts[t];
      out.page[p] = pages[t];
    }
    for (std::size_t k = 3 * t; k < 3 * t + 3; k++) {
      const std::size_t c = polygons.corner_of(k);
      const Uv uv = {corners[2 * k], corners[2 * k + 1]};
      if (!known[c]) {
        known[c] = 1;
        out.uv[2 * c] = uv[0];
        out.uv[2 * c + 1] = uv[1];
      }
      agrees = agrees && out.uv[2 * c] == uv[0] && out.uv[2 * c + 1] == uv[1];
    }
    if (!agrees && (out.torn.empty() || out.torn.back() != p)) out.torn.push_back(p);
  }
  return out;
}

/// The polygons' UVs as those of the triangles.
inline std::vector<float> triangle_uvs(const Polygons &polygons, const std::vector<float> &uv) {
  if (polygons.plain()) return uv;
  std::vector<float> all(6 * polygons.triangles());
  for (std::size_t k = 0; k < 3 * polygons.triangles(); k++) {
    all[2 * k] = uv[2 * polygons.corner_of(k)];
    all[2 * k + 1] = uv[2 * polygons.corner_of(k) + 1];
  }
  return all;
}

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

/// Numbers of the polygons as numbers of the triangles.
inline std::vector<std::uint32_t> triangle_numbers(const Polygons &polygons,
                                                   const std::vector<std::uint32_t> &numbers) {
  std::vector<std::uint32_t> all(polygons.triangles());
  for (std::size_t t = 0; t < all.size(); t++) all[t] = numbers[polygons.polygon_of(t)];
  return all;
}

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
