/* atlasfit.hpp - atlasfit for C++17, header only, over atlasfit.h.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * One move-only class per handle; failures are atlasfit::Error with the status and the text; arrays go in as
 * anything with data() and size() (std::vector, std::array, std::span), or as pointer, count and stride
 * (Eigen: matrix.data(), matrix.cols(), 0 for column-major 3 x n). An exception thrown by a progress callback
 * cancels the work and comes out of the call.
 *
 * One file, long as it is: so it can be copied into a project, and tools find all of it in one place. */
#ifndef ATLASFIT_HPP
#define ATLASFIT_HPP

#include "atlasfit.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace atlasfit {

/// A failed call: its status and the library's text.
class Error : public std::runtime_error {
 public:
  Error(atlasfit_status status, const std::string &text) : std::runtime_error(text), status_(status) {}
  /// ATLASFIT_CANCELLED, ATLASFIT_EMPTY_INPUT, ...
  atlasfit_status status() const noexcept { return status_; }

 private:
  atlasfit_status status_;
};

namespace detail {

inline void check(atlasfit_status status) {
  if (status == ATLASFIT_OK) return;
  std::string text(atlasfit_last_error(nullptr, 0), '\0');
  atlasfit_last_error(&text[0], text.size() + 1);
  throw Error(status, text.empty() ? atlasfit_status_name(status) : text);
}

template <class T, atlasfit_status (*Free)(T *)>
struct Freer {
  void operator()(T *handle) const noexcept { Free(handle); }
};

/// A handle that frees itself.
template <class T, atlasfit_status (*Free)(T *)>
using Owner = std::unique_ptr<T, Freer<T, Free>>;

/// A struct for a result: zeros and its size.
template <class T>
T output() {
  T value{};
  value.struct_size = sizeof(T);
  return value;
}

template <class T>
constexpr std::uint32_t scalar() {
  static_assert(std::is_same<T, float>::value || std::is_same<T, double>::value,
                "positions are float or double");
  return std::is_same<T, float>::value ? ATLASFIT_F32 : ATLASFIT_F64;
}

/// The type of indices.
template <class I>
constexpr std::uint32_t index_scalar() {
  static_assert(std::is_integral<I>::value && sizeof(I) <= 8 && !std::is_same<I, bool>::value,
                "indices are integers of up to 64 bits");
  constexpr bool is_signed = std::is_signed<I>::value;
  return sizeof(I) == 1   ? (is_signed ? ATLASFIT_I8 : ATLASFIT_U8)
         : sizeof(I) == 2 ? (is_signed ? ATLASFIT_I16 : ATLASFIT_U16)
         : sizeof(I) == 4 ? (is_signed ? ATLASFIT_I32 : ATLASFIT_U32)
                          : (is_signed ? ATLASFIT_I64 : ATLASFIT_U64);
}

/// Numbers of a container, as groups of `width`.
template <class C>
std::size_t groups(const C &numbers, std::size_t width) {
  if (numbers.size() % width != 0) {
    throw Error(ATLASFIT_INVALID_ARGUMENT, "an array of " + std::to_string(numbers.size()) +
                                               " numbers is no whole number of groups of " +
                                               std::to_string(width));
  }
  return numbers.size() / width;
}

template <class C>
using Number = typename std::remove_cv<
    typename std::remove_pointer<decltype(std::declval<const C &>().data())>::type>::type;

/// The lines of a text that `get(text, capacity, &length)` copies.
template <class Get>
std::vector<std::string> lines(Get get) {
  std::size_t length = 0;
  check(get(nullptr, std::size_t{0}, &length));
  std::string text(length + 1, '\0');
  check(get(&text[0], text.size(), &length));
  text.resize(length);
  std::vector<std::string> all;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find('\n', from), text.size());
    all.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return all;
}

/// Whether C, as it is given to a forwarding reference, is a container that owns its numbers and is gone
/// after the line.
template <class C>
struct Gone : std::false_type {};
template <class T, class A>
struct Gone<std::vector<T, A>> : std::true_type {};
template <class T, class A>
struct Gone<const std::vector<T, A>> : std::true_type {};
template <class T, std::size_t N>
struct Gone<std::array<T, N>> : std::true_type {};
template <class T, std::size_t N>
struct Gone<const std::array<T, N>> : std::true_type {};

}  // namespace detail

/// major << 24 | minor << 16 | patch << 8 of the library.
inline std::uint32_t version() noexcept { return atlasfit_version(); }

/// Faces of any number of corners, with indices of any integer type: a view of the caller's arrays, which
/// must outlive the call that it is handed to.
struct Faces : atlasfit_faces {
  /// Polygons: the vertices of their corners, and `n` + 1 numbers that say where those of each begin.
  template <class I>
  Faces(const I *vertices, const I *starts, std::size_t n) : Faces(vertices, n) {
    offsets = starts;
  }
  /// Triangles: `apart` bytes from the first corner of one to that of the next (0 = three corners), `step`
  /// from one corner to the next (0 = tightly packed).
  template <class I>
  Faces(const I *vertices, std::size_t n, std::size_t apart = 0, std::size_t step = 0) : atlasfit_faces() {
    corners = vertices;
    count = n;
    face_stride = apart;
    corner_stride = step;
    scalar = detail::index_scalar<I>();
  }
};

/// Points to work on: a view of the caller's arrays, which must outlive the call that it is handed to.
class Points {
 public:
  /// x, y, z after each other: anything with data() and size() over float or double.
  template <class C, class = decltype(std::declval<const C &>().data())>
  explicit Points(const C &xyz) : Points(xyz.data(), detail::groups(xyz, 3)) {}
  /// A container that owns its numbers and is gone after this line: keep it in a variable. (A view, such as
  /// std::span, is taken from one.)
  template <class C, class = typename std::enable_if<detail::Gone<C>::value>::type, class = void>
  explicit Points(C &&xyz) = delete;
  /// `count` points, `stride` bytes apart (0 = tightly packed).
  template <class T>
  Points(const T *xyz, std::size_t count, std::size_t stride = 0) {
    detail::check(atlasfit_points_init(&c_, sizeof c_));
    c_.positions = xyz;
    c_.count = count;
    c_.stride = stride;
    c_.scalar = detail::scalar<T>();
  }
  /// Unit normals, 3 floats per point.
  Points &normals(const float *normals, std::size_t stride = 0) {
    c_.normals = normals;
    c_.normal_stride = stride;
    return *this;
  }
  /// Colours of `width` channels per point, 0 to 1.
  Points &colors(const float *colors, std::uint32_t width = 4, std::size_t stride = 0) {
    return colors_of(colors, width, stride, ATLASFIT_F32);
  }
  /// Colours of `width` channels per point, 0 to 255.
  Points &colors(const std::uint8_t *colors, std::uint32_t width = 4, std::size_t stride = 0) {
    return colors_of(colors, width, stride, ATLASFIT_U8);
  }
  /// An attribute of `width` numbers per point, of type `scalar` (ATLASFIT_F32 to ATLASFIT_I32). `name` must
  /// outlive the call too.
  Points &attribute(const char *name, const void *values, std::uint32_t scalar, std::uint32_t width = 1,
                    std::size_t stride = 0) {
    atlasfit_attribute a;
    detail::check(atlasfit_attribute_init(&a, sizeof a));
    a.name = name;
    a.values = values;
    a.scalar = scalar;
    a.width = width;
    a.stride = stride;
    attributes_.push_back(a);
    return *this;
  }
  /// Where the points are a mesh's vertices: its triangles, three indices each. Outliers that are kept then
  /// follow the surface between their neighbours.
  Points &triangles(const std::uint32_t *triangles, std::size_t count) {
    c_.triangles = triangles;
    c_.triangle_count = count;
    return *this;
  }
  /// The same for polygons, or indices of other types.
  Points &faces(const Faces &faces) {
    c_.faces = faces;
    return *this;
  }
  /// Bytes from x to y to z, where they lie apart; the stride is then from x to x.
  Points &component_stride(std::size_t bytes) {
    c_.component_stride = bytes;
    return *this;
  }
  /// The C struct; it points into this object.
  atlasfit_points c() const noexcept {
    atlasfit_points all = c_;
    all.attributes = attributes_.empty() ? nullptr : attributes_.data();
    all.attribute_count = static_cast<std::uint32_t>(attributes_.size());
    return all;
  }

 private:
  Points &colors_of(const void *colors, std::uint32_t width, std::size_t stride, std::uint32_t scalar) {
    c_.colors = colors;
    c_.color_width = width;
    c_.color_stride = stride;
    c_.color_scalar = scalar;
    return *this;
  }
  atlasfit_points c_;
  std::vector<atlasfit_attribute> attributes_;
};

/// A mesh to work on: a view of the caller's arrays, which must outlive the call that it is handed
/// to.
class Mesh {
 public:
  /// x, y, z of each vertex, and three vertex indices (32 bits, unsigned) of each triangle.
  template <class C, class I, class = decltype(std::declval<const C &>().data())>
  Mesh(const C &xyz, const I &triangles)
      : Mesh(xyz.data(), detail::groups(xyz, 3), triangles.data(), detail::groups(triangles, 3)) {}
  /// Containers that are gone after this line: keep them in variables.
  template <class C, class I,
            class = typename std::enable_if<detail::Gone<C>::value || detail::Gone<I>::value>::type,
            class = void>
  Mesh(C &&xyz, I &&triangles) = delete;
  /// Vertices `stride` bytes apart (0 = tightly packed).
  template <class T>
  Mesh(const T *xyz, std::size_t vertices, const std::uint32_t *triangles, std::size_t triangle_count,
       std::size_t stride = 0) {
    detail::check(atlasfit_mesh_init(&c_, sizeof c_));
    c_.positions = xyz;
    c_.vertex_count = vertices;
    c_.stride = stride;
    c_.scalar = detail::scalar<T>();
    c_.triangles = triangles;
    c_.triangle_count = triangle_count;
  }
  /// Polygons, or triangles with indices of other types. What is said below of triangles holds of faces.
  template <class C, class = decltype(std::declval<const C &>().data())>
  Mesh(const C &xyz, const Faces &faces) : Mesh(xyz.data(), detail::groups(xyz, 3), faces) {}
  /// The same, with vertices `stride` bytes apart, and x, y, z `component_stride` bytes (0 = beside each
  /// other).
  template <class T>
  Mesh(const T *xyz, std::size_t vertices, const Faces &faces, std::size_t stride = 0,
       std::size_t component_stride = 0)
      : Mesh(xyz, vertices, nullptr, 0, stride) {
    c_.component_stride = component_stride;
    c_.faces = faces;
  }
  /// A byte per face, not 0 where the face is to be ignored; it keeps its number.
  Mesh &face_ignored(const std::uint8_t *ignored) {
    c_.face_ignored = ignored;
    return *this;
  }
  /// How many faces there are.
  std::size_t faces() const noexcept { return c_.faces.corners ? c_.faces.count : c_.triangle_count; }
  /// u, v of each corner of each triangle.
  Mesh &corner_uv(const float *uv) {
    c_.corner_uv = uv;
    return *this;
  }
  /// A group per triangle: no UV chart spans two.
  Mesh &face_group(const std::uint32_t *group) {
    c_.face_group = group;
    return *this;
  }
  /// The polygon that each triangle was cut from.
  Mesh &face_polygon(const std::uint32_t *polygon) {
    c_.face_polygon = polygon;
    return *this;
  }
  /// Edges that must be seams, as pairs of vertex indices.
  Mesh &seam_edges(const std::uint32_t *pairs, std::size_t count) {
    c_.seam_edges = pairs;
    c_.seam_edge_count = count;
    return *this;
  }
  /// What a seam costs per unit of length at each vertex: 1 as usual, less where seams may be.
  Mesh &seam_price(const float *price) {
    c_.seam_price = price;
    return *this;
  }
  /// Triangles in UVs of the first page, 6 numbers each, that unwrapped charts keep free of.
  Mesh &occupied_uv(const float *uv, std::size_t count) {
    c_.occupied_uv = uv;
    c_.occupied_count = count;
    return *this;
  }
  /// The page of each triangle's UVs.
  Mesh &face_page(const std::uint32_t *page) {
    c_.face_page = page;
    return *this;
  }
  /// Width and height of a page, in any unit, where it is not square.
  Mesh &page_size(std::uint32_t width, std::uint32_t height) {
    c_.page_width = width;
    c_.page_height = height;
    return *this;
  }
  /// Colours of the vertices, of `width` channels, 0 to 1.
  Mesh &colors(const float *colors, std::uint32_t width = 4, std::size_t stride = 0) {
    return colors_of(colors, width, stride, ATLASFIT_F32);
  }
  /// Colours of the vertices, of `width` channels, 0 to 255.
  Mesh &colors(const std::uint8_t *colors, std::uint32_t width = 4, std::size_t stride = 0) {
    return colors_of(colors, width, stride, ATLASFIT_U8);
  }
  /// The C struct.
  const atlasfit_mesh &c() const noexcept { return c_; }

 private:
  Mesh &colors_of(const void *colors, std::uint32_t width, std::size_t stride, std::uint32_t scalar) {
    c_.colors = colors;
    c_.color_width = width;
    c_.color_stride = stride;
    c_.color_scalar = scalar;
    return *this;
  }
  atlasfit_mesh c_;
};

/// Cancels runs from another thread.
class CancelToken {
 public:
  CancelToken() {
    atlasfit_cancel *handle = nullptr;
    detail::check(atlasfit_cancel_new(&handle));
    handle_.reset(handle);
  }
  /// Every run that holds the token stops within 100 ms.
  void request() const { detail::check(atlasfit_cancel_request(handle())); }
  /// Throws Error with ATLASFIT_INVALID_HANDLE where the token was moved from: a run that took it for none
  /// could not be cancelled.
  const atlasfit_cancel *handle() const {
    if (!handle_)
      throw Error(ATLASFIT_INVALID_HANDLE,
                  "the cancel token was moved from. Give the one that it was moved to");
    return handle_.get();
  }

 private:
  detail::Owner<atlasfit_cancel, atlasfit_cancel_free> handle_;
};

/// How long work is run. All members may be set freely.
struct Run {
  std::uint64_t seed = 0;
  /// 0 = all cores.
  std::uint32_t threads = 0;
  /// Seconds; 0 = no limit.
  double time_limit_s = 0.0;
  /// Bytes; 0 = no limit.
  std::uint64_t memory_limit_bytes = 0;
  /// Told stage and share done, on the calling thread; false cancels.
  std::function<bool(std::uint32_t stage, double fraction)> progress;
  /// May be null; must outlive the call.
  const CancelToken *cancel = nullptr;
  /// Where the share of the whole call that is done, in [0, 1], is put before each call of progress; it never
  /// falls. May be null.
  double *overall = nullptr;
  /// Told what happens in the call, a line each, on the calling thread: ATLASFIT_LOG_INFO, ...
  std::function<void(std::uint32_t level, const std::string &line)> log;
};

namespace detail {

/// The C struct of a Run for one call. An exception of the callback is kept while C frames are below, and
/// thrown after the call.
class Call {
 public:
  explicit Call(const Run &run) : run_(run) {
    check(atlasfit_run_init(&c_, sizeof c_));
    c_.seed = run.seed;
    c_.threads = run.threads;
    c_.time_limit_s = run.time_limit_s;
    c_.memory_limit_bytes = run.memory_limit_bytes;
    c_.cancel = run.cancel ? run.cancel->handle() : nullptr;
    c_.overall = run.overall;
    if (run.progress) {
      c_.progress = &Call::told;
      c_.progress_user = this;
    }
    if (run.log) {
      c_.log = &Call::logged;
      c_.log_user = this;
    }
  }
  Call(const Call &) = delete;
  Call &operator=(const Call &) = delete;
  const atlasfit_run *c() const noexcept { return &c_; }
  void done(atlasfit_status status) const {
    if (thrown_) std::rethrow_exception(thrown_);
    check(status);
  }

 private:
  static std::int32_t told(void *user, std::uint32_t stage, double fraction) {
    Call *self = static_cast<Call *>(user);
    if (self->thrown_) return 0;
    try {
      return self->run_.progress(stage, fraction) ? 1 : 0;
    } catch (...) {
      self->thrown_ = std::current_exception();
      return 0;
    }
  }
  static void logged(void *user, std::uint32_t level, const char *line) {
    Call *self = static_cast<Call *>(user);
    if (self->thrown_) return;
    try {
      self->run_.log(level, line);
    } catch (...) {
      self->thrown_ = std::current_exception();
    }
  }
  const Run &run_;
  atlasfit_run c_;
  std::exception_ptr thrown_;
};

}  // namespace detail

/// atlasfit_denoise_options with its defaults.
struct DenoiseOptions : atlasfit_denoise_options {
  DenoiseOptions() { detail::check(atlasfit_denoise_options_init(this, sizeof(atlasfit_denoise_options))); }
};

/// atlasfit_unwrap_options with its defaults.
struct UnwrapOptions : atlasfit_unwrap_options {
  UnwrapOptions() { detail::check(atlasfit_unwrap_options_init(this, sizeof(atlasfit_unwrap_options))); }
  /// Sets the numbers of ATLASFIT_PRESET_FEW_SEAMS, _BALANCED or _LOW_STRETCH; what is set after it counts.
  UnwrapOptions &preset(std::uint32_t preset) {
    detail::check(atlasfit_unwrap_options_set_preset(this, preset));
    return *this;
  }
};

/// atlasfit_textures with its defaults: none.
struct Textures : atlasfit_textures {
  Textures() { detail::check(atlasfit_textures_init(this, sizeof(atlasfit_textures))); }
};

/// atlasfit_bake_options with its defaults.
struct BakeOptions : atlasfit_bake_options {
  BakeOptions() { detail::check(atlasfit_bake_options_init(this, sizeof(atlasfit_bake_options))); }
};

/// atlasfit_distance_options with its defaults.
struct DistanceOptions : atlasfit_distance_options {
  DistanceOptions() {
    detail::check(atlasfit_distance_options_init(this, sizeof(atlasfit_distance_options)));
  }
};

/// Where points are on an atlas.
struct Projection {
  std::vector<double> positions;        ///< x, y, z per point.
  std::vector<float> normals;           ///< 3 per point.
  std::vector<std::uint32_t> charts;    ///< UINT32_MAX for points that are not finite.
  std::vector<float> chart_uv;          ///< 2 per point.
  std::vector<double> distances;        ///< 1 per point.
};

/// Places of chart coordinates.
struct Places {
  std::vector<double> positions;  ///< x, y, z per place.
  std::vector<float> normals;     ///< 3 per place.
  std::vector<float> inside;      ///< In [0, 1]; one half at the surface's edge.
};

/// A fitted atlas.
class Atlas {
 public:
  /// Takes a handle over.
  explicit Atlas(atlasfit_atlas *handle) noexcept : handle_(handle) {}
  atlasfit_atlas_info info() const {
    auto info = detail::output<atlasfit_atlas_info>();
    detail::check(atlasfit_atlas_get_info(handle_.get(), &info));
    return info;
  }
  /// The nearest place of the surface for each point.
  Projection project(const Points &points, const Run &run = Run()) const {
    const atlasfit_points in = points.c();
    Projection p;
    p.positions.resize(3 * in.count);
    p.normals.resize(3 * in.count);
    p.charts.resize(in.count);
    p.chart_uv.resize(2 * in.count);
    p.distances.resize(in.count);
    auto out = detail::output<atlasfit_projection>();
    out.capacity = in.count;
    out.positions = p.positions.data();
    out.normals = p.normals.data();
    out.charts = p.charts.data();
    out.chart_uv = p.chart_uv.data();
    out.distances = p.distances.data();
    detail::Call call(run);
    call.done(atlasfit_atlas_project(handle_.get(), &in, call.c(), &out));
    return p;
  }
  /// The places of chart coordinates: u, v from -1 to 1 after each other.
  template <class C>
  Places eval(std::size_t chart, const C &uv) const {
    static_assert(std::is_same<detail::Number<C>, double>::value, "chart coordinates are double");
    const std::size_t n = detail::groups(uv, 2);
    Places p;
    p.positions.resize(3 * n);
    p.normals.resize(3 * n);
    p.inside.resize(n);
    detail::check(atlasfit_atlas_eval(handle_.get(), chart, uv.data(), n, p.positions.data(),
                                      p.normals.data(), p.inside.data(), n));
    return p;
  }
  /// The atlas as bytes, for a file.
  std::vector<std::uint8_t> save() const {
    std::size_t size = 0;
    detail::check(atlasfit_atlas_save(handle_.get(), nullptr, 0, &size));
    std::vector<std::uint8_t> bytes(size);
    detail::check(atlasfit_atlas_save(handle_.get(), bytes.data(), bytes.size(), &size));
    return bytes;
  }
  /// The atlas that save() made bytes of; the bytes need not be trusted.
  static Atlas load(const std::uint8_t *bytes, std::size_t size) {
    atlasfit_atlas *handle = nullptr;
    detail::check(atlasfit_atlas_load(bytes, size, &handle));
    return Atlas(handle);
  }
  const atlasfit_atlas *handle() const noexcept { return handle_.get(); }

 private:
  detail::Owner<atlasfit_atlas, atlasfit_atlas_free> handle_;
};

/// A denoised scan.
class Denoised {
 public:
  /// Takes a handle over.
  explicit Denoised(atlasfit_result *handle) : handle_(handle), report_(detail::output<atlasfit_report>()) {
    detail::check(atlasfit_result_report(handle_.get(), &report_));
  }
  const atlasfit_report &report() const noexcept { return report_; }
  /// What the user should hear; empty where all is well.
  std::vector<std::string> warnings() const {
    return detail::lines([this](char *text, std::size_t n, std::size_t *length) {
      return atlasfit_result_warnings(handle_.get(), text, n, length);
    });
  }
  std::vector<double> point_positions() const {
    return copy<double>(atlasfit_result_point_positions, 3 * report_.points);
  }
  std::vector<float> point_normals() const {
    return copy<float>(atlasfit_result_point_normals, 3 * report_.points);
  }
  std::vector<std::uint32_t> point_sources() const {
    return copy<std::uint32_t>(atlasfit_result_point_sources, report_.points);
  }
  std::vector<std::uint32_t> point_charts() const {
    return copy<std::uint32_t>(atlasfit_result_point_charts, report_.points);
  }
  std::vector<double> surface_positions() const {
    return copy<double>(atlasfit_result_surface_positions, 3 * report_.vertices);
  }
  std::vector<float> surface_normals() const {
    return copy<float>(atlasfit_result_surface_normals, 3 * report_.vertices);
  }
  std::vector<std::uint32_t> surface_triangles() const {
    return copy<std::uint32_t>(atlasfit_result_surface_triangles, 3 * report_.triangles);
  }
  /// Throws Error with ATLASFIT_NOT_AVAILABLE without UVs; so does what is below for what is not there.
  std::vector<float> surface_corner_uv() const {
    return copy<float>(atlasfit_result_surface_corner_uv, 6 * report_.triangles);
  }
  std::vector<std::uint32_t> surface_face_charts() const {
    return copy<std::uint32_t>(atlasfit_result_surface_face_charts, report_.triangles);
  }
  std::vector<float> surface_colors() const {
    return copy<float>(atlasfit_result_surface_colors, 4 * report_.vertices);
  }
  /// The unit normal at each corner of each triangle, where the surface has creases.
  std::vector<float> surface_corner_normals() const {
    return told(ATLASFIT_SURFACE_CORNER_NORMALS, 9 * report_.triangles);
  }
  /// One attribute that was given with `width` numbers per point.
  std::vector<double> surface_attribute(std::size_t index, std::size_t width = 1) const {
    std::vector<double> values(width * report_.vertices);
    detail::check(atlasfit_result_surface_attribute(handle_.get(), index, values.data(), values.size()));
    return values;
  }
  /// With uncertainty of the options: the standard deviation of each point along its normal; of outliers
  /// their distance from the nearest point that is none.
  std::vector<float> point_uncertainty() const { return told(ATLASFIT_POINT_UNCERTAINTY, report_.points); }
  /// With uncertainty: the standard deviation of the noise that each point had; 0 of outliers.
  std::vector<float> point_noise() const { return told(ATLASFIT_POINT_NOISE, report_.points); }
  /// With uncertainty: the probability that each point is on no surface.
  std::vector<float> point_outlier_probability() const {
    return told(ATLASFIT_POINT_OUTLIER_PROBABILITY, report_.points);
  }
  /// With uncertainty: the standard deviation of each vertex along its normal.
  std::vector<float> surface_uncertainty() const {
    return told(ATLASFIT_SURFACE_UNCERTAINTY, report_.vertices);
  }
  /// With uncertainty or watertight: 1 for each vertex that was invented, else 0.
  std::vector<float> surface_extrapolated() const {
    return told(ATLASFIT_SURFACE_EXTRAPOLATED, report_.vertices);
  }
  /// How each sweep was moved, by their numbers, where sweeps of the options named an attribute.
  std::vector<atlasfit_sweep> sweeps() const {
    std::vector<atlasfit_sweep> all(report_.sweeps, detail::output<atlasfit_sweep>());
    for (std::size_t i = 0; i < all.size(); i++)
      detail::check(atlasfit_result_sweep(handle_.get(), i, &all[i]));
    return all;
  }
  Atlas atlas() const {
    atlasfit_atlas *atlas = nullptr;
    detail::check(atlasfit_result_atlas(handle_.get(), &atlas));
    return Atlas(atlas);
  }
  const atlasfit_result *handle() const noexcept { return handle_.get(); }

 private:
  template <class T>
  std::vector<T> copy(atlasfit_status (*get)(const atlasfit_result *, T *, std::size_t),
                      std::size_t count) const {
    std::vector<T> all(count);
    detail::check(get(handle_.get(), all.data(), all.size()));
    return all;
  }
  /// An array of so many numbers.
  std::vector<float> told(std::uint32_t array, std::size_t count) const {
    std::vector<float> all(count);
    atlasfit_buffer to;
    detail::check(atlasfit_buffer_init(&to, sizeof to));
    to.data = all.data();
    to.capacity = count;
    detail::check(atlasfit_result_copy(handle_.get(), array, &to));
    return all;
  }
  detail::Owner<atlasfit_result, atlasfit_result_free> handle_;
  atlasfit_report report_;
};

/// Bytes that denoise() needs at its peak for so many evenly sampled points: an upper bound.
inline std::uint64_t denoise_memory_needed(std::size_t points,
                                           const DenoiseOptions &options = DenoiseOptions(),
                                           const Run &run = Run()) {
  detail::Call call(run);
  std::uint64_t bytes = 0;
  call.done(atlasfit_denoise_memory_needed(points, &options, call.c(), &bytes));
  return bytes;
}

/// Denoises a scan.
inline Denoised denoise(const Points &points, const DenoiseOptions &options = DenoiseOptions(),
                        const Run &run = Run()) {
  const atlasfit_points in = points.c();
  detail::Call call(run);
  atlasfit_result *result = nullptr;
  const atlasfit_status status = atlasfit_denoise(&in, &options, call.c(), &result);
  detail::Owner<atlasfit_result, atlasfit_result_free> owner(result);
  call.done(status);
  return Denoised(owner.release());
}

/// The form of a mesh with one vertex per pair of vertex and UV.
struct SplitMesh {
  std::vector<std::uint32_t> indices;  ///< The new vertex of each corner of each face.
  std::vector<std::uint32_t> sources;  ///< The mesh's vertex of each new vertex.
  std::vector<float> vertex_uv;        ///< u, v per new vertex.
};

/// UVs of a mesh.
class UvLayout {
 public:
  /// Takes a handle over.
  explicit UvLayout(atlasfit_uv *handle) : handle_(handle), info_(detail::output<atlasfit_uv_info>()) {
    detail::check(atlasfit_uv_get_info(handle_.get(), &info_));
  }
  const atlasfit_uv_info &info() const noexcept { return info_; }
  /// What the user should hear; empty where all is well.
  std::vector<std::string> warnings() const {
    return detail::lines([this](char *text, std::size_t n, std::size_t *length) {
      return atlasfit_uv_warnings(handle_.get(), text, n, length);
    });
  }
  /// u, v of each corner of each face.
  std::vector<float> corners() const {
    std::vector<float> all(2 * info_.corners);
    detail::check(atlasfit_uv_corners(handle_.get(), all.data(), all.size()));
    return all;
  }
  /// UINT32_MAX for a face without a triangle; the pages too.
  std::vector<std::uint32_t> face_charts() const { return numbers(atlasfit_uv_face_charts, info_.faces); }
  std::vector<std::uint32_t> face_pages() const { return numbers(atlasfit_uv_face_pages, info_.faces); }
  /// Faces that do not lie flat and were cut between charts.
  std::vector<std::uint32_t> torn() const { return numbers(atlasfit_uv_face_torn, info_.torn_faces); }
  SplitMesh split() const {
    SplitMesh s;
    s.indices.resize(info_.corners);
    s.sources.resize(info_.split_vertices);
    s.vertex_uv.resize(2 * info_.split_vertices);
    detail::check(atlasfit_uv_split(handle_.get(), s.indices.data(), s.indices.size(), s.sources.data(),
                                    s.vertex_uv.data(), s.sources.size()));
    return s;
  }
  const atlasfit_uv *handle() const noexcept { return handle_.get(); }

 private:
  std::vector<std::uint32_t> numbers(atlasfit_status (*get)(const atlasfit_uv *, std::uint32_t *,
                                                            std::size_t),
                                     std::size_t count) const {
    std::vector<std::uint32_t> all(count);
    detail::check(get(handle_.get(), all.data(), all.size()));
    return all;
  }
  detail::Owner<atlasfit_uv, atlasfit_uv_free> handle_;
  atlasfit_uv_info info_;
};

/// Bytes that unwrap() needs at its peak for a mesh of so many vertices and triangles: an upper bound.
inline std::uint64_t unwrap_memory_needed(std::size_t vertices, std::size_t triangles,
                                          const UnwrapOptions &options = UnwrapOptions(),
                                          const Run &run = Run()) {
  detail::Call call(run);
  std::uint64_t bytes = 0;
  call.done(atlasfit_unwrap_memory_needed(vertices, triangles, &options, call.c(), &bytes));
  return bytes;
}

/// Lays out UVs for a mesh.
inline UvLayout unwrap(const Mesh &mesh, const UnwrapOptions &options = UnwrapOptions(),
                       const Run &run = Run()) {
  detail::Call call(run);
  atlasfit_uv *uv = nullptr;
  const atlasfit_status status = atlasfit_unwrap(&mesh.c(), &options, call.c(), &uv);
  detail::Owner<atlasfit_uv, atlasfit_uv_free> owner(uv);
  call.done(status);
  return UvLayout(owner.release());
}

/// Draws the colours of the mesh's vertices, or of `points` near it, into a texture for its corner UVs: red,
/// green, blue, alpha of each texel, the top row first.
inline std::vector<std::uint8_t> bake(const Mesh &mesh, const BakeOptions &options = BakeOptions(),
                                      const Run &run = Run(), const Points *points = nullptr) {
  const atlasfit_points from = points ? points->c() : atlasfit_points();
  std::vector<std::uint8_t> rgba(std::size_t(4) * options.width * options.height);
  detail::Call call(run);
  call.done(atlasfit_bake(&mesh.c(), points ? &from : nullptr, &options, call.c(), rgba.data(), rgba.size()));
  return rgba;
}

/// A column of a file: its name, numbers per point, the type that the file keeps them in, the numbers.
struct Column {
  std::string name;
  std::uint32_t width = 1;
  std::uint32_t scalar = ATLASFIT_F32;
  std::vector<double> values;
};

/// What a file holds: a scan, or a mesh.
class File {
 public:
  /// Reads a file of any format that the library knows.
  static File load(const std::string &path, const Run &run = Run()) {
    detail::Call call(run);
    atlasfit_file *file = nullptr;
    const atlasfit_status status = atlasfit_file_load(path.c_str(), call.c(), &file);
    detail::Owner<atlasfit_file, atlasfit_file_free> owner(file);
    call.done(status);
    return File(owner.release());
  }
  /// Takes a handle over.
  explicit File(atlasfit_file *handle)
      : handle_(handle), info_(detail::output<atlasfit_file_info>()) {
    detail::check(atlasfit_file_get_info(handle_.get(), &info_));
  }
  const atlasfit_file_info &info() const noexcept { return info_; }
  /// What was repaired or left out; empty where all is well.
  std::vector<std::string> notes() const {
    return detail::lines([this](char *text, std::size_t n, std::size_t *length) {
      return atlasfit_file_notes(handle_.get(), text, n, length);
    });
  }
  std::vector<double> positions() const { return all(atlasfit_file_positions, 3 * info_.points); }
  std::vector<float> normals() const { return all(atlasfit_file_normals, 3 * info_.points); }
  std::vector<float> colors() const { return all(atlasfit_file_colors, 4 * info_.points); }
  std::vector<std::uint32_t> triangles() const {
    return all(atlasfit_file_triangles, 3 * info_.triangles);
  }
  std::vector<float> corner_uv() const { return all(atlasfit_file_corner_uv, 6 * info_.triangles); }
  /// Where info().has_corner_normals.
  std::vector<float> corner_normals() const { return all(atlasfit_file_corner_normals, 9 * info_.triangles); }
  std::vector<std::uint32_t> face_charts() const {
    return all(atlasfit_file_face_charts, info_.triangles);
  }
  /// The bytes of the image that colours the faces.
  std::vector<std::uint8_t> texture() const { return all(atlasfit_file_texture, info_.texture_bytes); }
  /// The column of this number, below info().attributes.
  Column attribute(std::size_t i) const {
    Column out;
    const auto name = detail::lines([&](char *text, std::size_t n, std::size_t *length) {
      return atlasfit_file_attribute_type(handle_.get(), i, text, n, length, &out.width, &out.scalar);
    });
    for (const std::string &line : name) out.name += line;
    out.values.resize(out.width * info_.points);
    detail::check(atlasfit_file_attribute(handle_.get(), i, out.values.data(), out.values.size()));
    return out;
  }
  const atlasfit_file *handle() const noexcept { return handle_.get(); }

 private:
  template <class T>
  std::vector<T> all(atlasfit_status (*get)(const atlasfit_file *, T *, std::size_t), std::size_t n) const {
    std::vector<T> values(n);
    detail::check(get(handle_.get(), values.data(), values.size()));
    return values;
  }
  detail::Owner<atlasfit_file, atlasfit_file_free> handle_;
  atlasfit_file_info info_;
};

/// What save() writes besides the points, with the library's defaults.
struct SaveOptions : atlasfit_save_options {
  SaveOptions() { detail::check(atlasfit_save_options_init(this, sizeof(atlasfit_save_options))); }
};

/// Writes points, with their triangles a mesh, by the extension of the path. Gives what the format could not
/// hold, in words.
inline std::string save(const std::string &path, const Points &points,
                        const SaveOptions &options = SaveOptions(), const Run &run = Run()) {
  const atlasfit_points in = points.c();
  std::vector<char> lost(4096);
  detail::Call call(run);
  call.done(atlasfit_file_save(path.c_str(), &in, &options, call.c(), lost.data(), lost.size()));
  return lost.data();
}

/// atlasfit_simplify_options with its defaults: set faces, max_error or both.
struct SimplifyOptions : atlasfit_simplify_options {
  SimplifyOptions() {
    detail::check(atlasfit_simplify_options_init(this, sizeof(atlasfit_simplify_options)));
  }
};

/// A mesh with fewer triangles.
class Simplified {
 public:
  /// Takes a handle over.
  explicit Simplified(atlasfit_simplified *handle)
      : handle_(handle), info_(detail::output<atlasfit_simplified_info>()) {
    detail::check(atlasfit_simplified_get_info(handle_.get(), &info_));
  }
  const atlasfit_simplified_info &info() const noexcept { return info_; }
  /// What the user should hear; empty where all is well.
  std::vector<std::string> warnings() const {
    return detail::lines([this](char *text, std::size_t n, std::size_t *length) {
      return atlasfit_simplified_warnings(handle_.get(), text, n, length);
    });
  }
  std::vector<double> positions() const {
    return copy<double>(atlasfit_simplified_positions, 3 * info_.vertices);
  }
  std::vector<std::uint32_t> triangles() const {
    return copy<std::uint32_t>(atlasfit_simplified_triangles, 3 * info_.triangles);
  }
  /// A vertex of the given mesh near each vertex.
  std::vector<std::uint32_t> sources() const {
    return copy<std::uint32_t>(atlasfit_simplified_sources, info_.vertices);
  }
  /// Throws Error with ATLASFIT_NOT_AVAILABLE where the mesh had none; so do the colours.
  std::vector<float> corner_uv() const {
    return copy<float>(atlasfit_simplified_corner_uv, 6 * info_.triangles);
  }
  std::vector<float> colors() const { return copy<float>(atlasfit_simplified_colors, 4 * info_.vertices); }

 private:
  template <class T>
  std::vector<T> copy(atlasfit_status (*get)(const atlasfit_simplified *, T *, std::size_t),
                      std::size_t count) const {
    std::vector<T> all(count);
    detail::check(get(handle_.get(), all.data(), all.size()));
    return all;
  }
  detail::Owner<atlasfit_simplified, atlasfit_simplified_free> handle_;
  atlasfit_simplified_info info_;
};

/// Makes a mesh of fewer triangles; UVs and colours of the mesh stay.
inline Simplified simplify(const Mesh &mesh, const SimplifyOptions &options, const Run &run = Run()) {
  detail::Call call(run);
  atlasfit_simplified *light = nullptr;
  const atlasfit_status status = atlasfit_simplify(&mesh.c(), &options, call.c(), &light);
  detail::Owner<atlasfit_simplified, atlasfit_simplified_free> owner(light);
  call.done(status);
  return Simplified(owner.release());
}

/// The optional parts that the library was built with; empty for the permissive one.
inline std::string features() { return atlasfit_features(); }

/// How a mesh hangs together.
inline atlasfit_topology measure_topology(const Mesh &mesh, const Run &run = Run()) {
  detail::Call call(run);
  auto out = detail::output<atlasfit_topology>();
  call.done(atlasfit_measure_topology(&mesh.c(), call.c(), &out));
  return out;
}

/// Quality of the mesh's corner UVs; `face_stretch`, if given, gets a number per face.
inline atlasfit_uv_quality measure_uv(const Mesh &mesh, const Run &run = Run(),
                                      std::vector<float> *face_stretch = nullptr) {
  if (face_stretch) face_stretch->resize(mesh.faces());
  detail::Call call(run);
  auto out = detail::output<atlasfit_uv_quality>();
  call.done(atlasfit_measure_uv(&mesh.c(), call.c(), &out, face_stretch ? face_stretch->data() : nullptr,
                                face_stretch ? face_stretch->size() : 0));
  return out;
}

/// A mesh against the true surface.
inline atlasfit_distance measure_surface(const Mesh &mesh, const Mesh &truth,
                                         const DistanceOptions &options = DistanceOptions(),
                                         const Run &run = Run()) {
  detail::Call call(run);
  auto out = detail::output<atlasfit_distance>();
  call.done(atlasfit_measure_surface(&mesh.c(), &truth.c(), &options, call.c(), &out));
  return out;
}

/// Points against the true surface; `distances`, if given, gets a number per point.
inline atlasfit_distance measure_points(const Points &points, const Mesh &truth,
                                        const DistanceOptions &options = DistanceOptions(),
                                        const Run &run = Run(), std::vector<double> *distances = nullptr) {
  const atlasfit_points in = points.c();
  if (distances) distances->resize(in.count);
  detail::Call call(run);
  auto out = detail::output<atlasfit_distance>();
  call.done(atlasfit_measure_points(&in, &truth.c(), &options, call.c(), &out,
                                    distances ? distances->data() : nullptr,
                                    distances ? distances->size() : 0));
  return out;
}

}  // namespace atlasfit

#endif
