/* atlasfit/eigen.hpp - atlasfit on matrices of Eigen, a vertex or a face in each row, as libigl has them.
 * Eigen 3.4; needs nothing else.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 *   auto layout = atlasfit::unwrap(V, F);          // layout.uv (TC), layout.faces (FTC)
 *   auto quality = atlasfit::measure_uv(V, F, layout.uv, layout.faces);
 *   auto clean = atlasfit::denoise(V);             // or denoise(V, N), denoise(V, N, C)
 *   Eigen::MatrixXd P = atlasfit::rows<3>(clean.point_positions());
 *
 * V is of float or double, F of integers of any type, in row- or column-major order; maps, blocks and
 * expressions do too. All but expressions are read where they lie, whatever their strides are. */
#ifndef ATLASFIT_EIGEN_HPP
#define ATLASFIT_EIGEN_HPP

#include "../atlasfit.hpp"

#include <Eigen/Core>

namespace atlasfit {
namespace detail {

/// A matrix of n columns, a row after the other.
template <class T, int N>
using Rows = Eigen::Matrix<T, Eigen::Dynamic, N, N == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

inline void wanted(bool good, const char *what) {
  if (!good) throw Error(ATLASFIT_INVALID_ARGUMENT, what);
}

/// A matrix of D's storage order that is read where it lies, whatever its strides are. Expressions are
/// copied.
template <class D, class T>
using View = Eigen::Ref<
    const Eigen::Matrix<T, Eigen::Dynamic, 3, D::IsRowMajor ? Eigen::RowMajor : Eigen::ColMajor>, 0,
    Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;

/// Bytes from one row of a matrix to the next, and from one column to the next.
template <class M>
std::array<std::size_t, 2> strides(const M &m) {
  const std::size_t size = sizeof(typename M::Scalar);
  return {static_cast<std::size_t>(m.rowStride()) * size, static_cast<std::size_t>(m.colStride()) * size};
}

/// Positions. Numbers that are neither float nor double become doubles.
template <class D>
class Coordinates {
  using Given = typename D::Scalar;
  static constexpr bool exact = std::is_same<Given, float>::value || std::is_same<Given, double>::value;

 public:
  using Number = std::conditional_t<exact, Given, double>;
  explicit Coordinates(const D &v) : rows_(checked(v)) {}
  Points points() const {
    return Points(rows_.data(), count(), strides(rows_)[0]).component_stride(strides(rows_)[1]);
  }
  Mesh mesh(const Faces &faces) const {
    return Mesh(rows_.data(), count(), faces, strides(rows_)[0], strides(rows_)[1]);
  }
  std::size_t count() const { return static_cast<std::size_t>(rows_.rows()); }

 private:
  static decltype(auto) checked(const D &v) {
    wanted(v.cols() == 3, "V must have a row for each vertex and three columns");
    if constexpr (exact)
      return (v);
    else
      return v.template cast<double>();
  }
  View<D, Number> rows_;
};

/// Triangles.
template <class D>
class Triangles {
 public:
  explicit Triangles(const D &f) : rows_((wanted(f.cols() == 3, "F must have three columns"), f)) {}
  Faces faces() const {
    const auto apart = strides(rows_);
    return Faces(rows_.data(), static_cast<std::size_t>(rows_.rows()), apart[0], apart[1]);
  }

 private:
  View<D, typename D::Scalar> rows_;
};

/// V and F as the library takes them.
template <class DV, class DF>
class Matrices {
 public:
  Matrices(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DF> &f)
      : v_(v.derived()), f_(f.derived()) {}
  Mesh mesh() const { return v_.mesh(f_.faces()); }

 private:
  Coordinates<DV> v_;
  Triangles<DF> f_;
};

/// Numbers of rows that may have any type, as floats; bytes become 0 to 1.
template <class D>
Rows<float, 3> floats(const D &m, std::size_t rows, const char *what) {
  wanted(m.cols() == 3 && static_cast<std::size_t>(m.rows()) == rows, what);
  Rows<float, 3> all = m.template cast<float>();
  if (std::is_integral<typename D::Scalar>::value) all /= 255.0f;
  return all;
}

}  // namespace detail

/// Numbers of the library as a matrix with N in each row.
template <int N, class T>
detail::Rows<T, N> rows(const std::vector<T> &numbers) {
  const Eigen::Index count = static_cast<Eigen::Index>(detail::groups(numbers, N));
  return Eigen::Map<const detail::Rows<T, N>>(numbers.data(), count, N);
}

/// UVs of V and F. Corner c of face f has the UV in row faces(f, c) of uv.
struct MatrixLayout {
  Eigen::MatrixXd uv;           ///< u, v in each row: libigl's TC.
  Eigen::MatrixXi faces;        ///< Rows of uv for the corners of each face: libigl's FTC.
  Eigen::VectorXi vertex;       ///< The row of V that each row of uv belongs to.
  Eigen::VectorXi chart, page;  ///< Of each face.
  atlasfit_uv_info info = detail::output<atlasfit_uv_info>();
  std::vector<std::string> warnings;  ///< What the user should hear.
};

/// Lays out UVs for V and F.
template <class DV, class DF>
MatrixLayout unwrap(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DF> &f,
                    const UnwrapOptions &options = UnwrapOptions(), const Run &run = Run()) {
  const detail::Matrices<DV, DF> m(v, f);
  const UvLayout made = unwrap(m.mesh(), options, run);
  const SplitMesh split = made.split();
  MatrixLayout out;
  out.uv = rows<2>(split.vertex_uv).template cast<double>();
  out.faces = rows<3>(split.indices).template cast<int>();
  out.vertex = rows<1>(split.sources).template cast<int>();
  out.chart = rows<1>(made.face_charts()).template cast<int>();
  out.page = rows<1>(made.face_pages()).template cast<int>();
  out.info = made.info();
  out.warnings = made.warnings();
  return out;
}

/// How V and F hang together.
template <class DV, class DF>
atlasfit_topology measure_topology(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DF> &f,
                                   const Run &run = Run()) {
  return measure_topology(detail::Matrices<DV, DF>(v, f).mesh(), run);
}

/// Quality of UVs: rows of uv, and which of them the corners of each face have. All are on one page.
template <class DV, class DF, class DU, class DT>
atlasfit_uv_quality measure_uv(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DF> &f,
                               const Eigen::MatrixBase<DU> &uv, const Eigen::MatrixBase<DT> &faces,
                               const Run &run = Run()) {
  detail::wanted(uv.cols() == 2 && faces.rows() == f.rows() && faces.cols() == 3,
                 "UVs must have two columns, and rows for the three corners of each face");
  std::vector<float> corners;
  corners.reserve(6 * static_cast<std::size_t>(f.rows()));
  for (Eigen::Index r = 0; r < faces.rows(); r++)
    for (Eigen::Index c = 0; c < 3; c++) {
      const auto at = static_cast<Eigen::Index>(faces(r, c));
      if (at < 0 || at >= uv.rows())
        throw Error(ATLASFIT_INDEX_OUT_OF_RANGE, "face " + std::to_string(r) + " names UV " +
                                                     std::to_string(at) + ", but there are " +
                                                     std::to_string(uv.rows()));
      corners.insert(corners.end(), {static_cast<float>(uv(at, 0)), static_cast<float>(uv(at, 1))});
    }
  return measure_uv(detail::Matrices<DV, DF>(v, f).mesh().corner_uv(corners.data()), run);
}

/// A mesh against the true surface.
template <class DV, class DF, class EV, class EF>
atlasfit_distance measure_surface(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DF> &f,
                                  const Eigen::MatrixBase<EV> &true_v, const Eigen::MatrixBase<EF> &true_f,
                                  const DistanceOptions &options = DistanceOptions(),
                                  const Run &run = Run()) {
  const detail::Matrices<DV, DF> mesh(v, f);
  const detail::Matrices<EV, EF> truth(true_v, true_f);
  return measure_surface(mesh.mesh(), truth.mesh(), options, run);
}

/// Denoises the points in the rows of V; rows<3>(clean.point_positions()) is then the new V.
template <class DV>
Denoised denoise(const Eigen::MatrixBase<DV> &v, const DenoiseOptions &options = DenoiseOptions(),
                 const Run &run = Run()) {
  return denoise(detail::Coordinates<DV>(v.derived()).points(), options, run);
}
/// The same for points with normals, zeros where none is known.
template <class DV, class DN>
Denoised denoise(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DN> &n,
                 const DenoiseOptions &options = DenoiseOptions(), const Run &run = Run()) {
  const detail::Coordinates<DV> at(v.derived());
  const auto normals = detail::floats(n, at.count(), "N must have a row for each of V and three columns");
  return denoise(at.points().normals(normals.data()), options, run);
}
/// The same for points with normals and colours: 0 to 1, or 0 to 255 of an integer type.
template <class DV, class DN, class DC>
Denoised denoise(const Eigen::MatrixBase<DV> &v, const Eigen::MatrixBase<DN> &n,
                 const Eigen::MatrixBase<DC> &c, const DenoiseOptions &options = DenoiseOptions(),
                 const Run &run = Run()) {
  const detail::Coordinates<DV> at(v.derived());
  const auto normals = detail::floats(n, at.count(), "N must have a row for each of V and three columns");
  const auto colors = detail::floats(c, at.count(), "C must have a row for each of V and three columns");
  return denoise(at.points().normals(normals.data()).colors(colors.data(), 3), options, run);
}

}  // namespace atlasfit

#endif
