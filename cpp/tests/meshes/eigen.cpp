// atlasfit/eigen.hpp: matrices of any order, type and stride, without a copy where that is possible.
#include <atlasfit/eigen.hpp>

#include "common.hpp"

template <class T, int Order>
using M = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Order>;
template <class T>
using Packed = Eigen::Matrix<T, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// A torus as V and F.
static std::pair<Eigen::MatrixXd, Eigen::MatrixXi> made() {
  const Faces from = torus(24, 12);
  Eigen::MatrixXd v(from.at.size(), 3);
  for (std::size_t i = 0; i < from.at.size(); i++)
    for (int k = 0; k < 3; k++) v(static_cast<Eigen::Index>(i), k) = from.at[i][static_cast<std::size_t>(k)];
  std::vector<int> corners;
  for (const auto &f : from.faces)
    for (std::size_t k = 2; k < f.size(); k++)
      for (const std::size_t c : {f[0], f[k - 1], f[k]}) corners.push_back(static_cast<int>(c));
  return {v, atlasfit::rows<3>(corners)};
}

/// What holds for V and F of any type: the layout is the one of V and F as libigl has them.
template <class V, class F>
void alike(const V &v, const F &f, const atlasfit::MatrixLayout &known, double tolerance) {
  const auto layout = atlasfit::unwrap(v, f);
  want(layout.uv.rows() == known.uv.rows() && layout.faces == known.faces && layout.chart == known.chart,
       "the same faces and charts");
  if (layout.uv.rows() == known.uv.rows())
    want((layout.uv - known.uv).cwiseAbs().maxCoeff() <= tolerance, "the same UVs");
  want(atlasfit::measure_topology(v, f).closed == 1, "closed");
}

static void every_order_alike() {
  const auto [v, f] = made();
  const auto layout = atlasfit::unwrap(v, f);
  want(layout.faces.rows() == f.rows() && layout.page.isZero() && layout.chart.minCoeff() == 0 &&
           layout.chart.maxCoeff() + 1 == static_cast<int>(layout.info.charts),
       "sizes");
  for (Eigen::Index r = 0; r < f.rows(); r++)
    for (Eigen::Index c = 0; c < 3; c++)
      want(layout.vertex(layout.faces(r, c)) == f(r, c), "each UV is of its corner's vertex");
  const auto q = atlasfit::measure_uv(v, f, layout.uv, layout.faces);
  want(q.flips + q.overlapping_faces + q.degenerate == 0 && q.charts == layout.info.charts, "sound");

  alike(M<double, Eigen::RowMajor>(v), M<int, Eigen::RowMajor>(f), layout, 0.0);
  alike(Packed<double>(v), Packed<std::uint32_t>(f.cast<std::uint32_t>()), layout, 0.0);
  alike(v, M<std::int64_t, Eigen::ColMajor>(f.cast<std::int64_t>()), layout, 0.0);
  alike(v.cast<long double>().eval(), M<std::int16_t, Eigen::RowMajor>(f.cast<std::int16_t>()), layout, 0.0);
  alike(1.0 * v, (f.array() + 0).matrix(), layout, 0.0);
  Eigen::MatrixXd wide = Eigen::MatrixXd::Constant(v.rows(), 7, -1.0);
  wide.middleCols<3>(2) = v;
  M<double, Eigen::RowMajor> wide_rows = wide;
  alike(wide.middleCols<3>(2), f, layout, 0.0);
  alike(wide_rows.middleCols<3>(2), f, layout, 0.0);
  const Eigen::MatrixXd columns = v.transpose();
  alike(columns.transpose(), f, layout, 0.0);
  const M<float, Eigen::ColMajor> floats = v.cast<float>();
  alike(floats, f, atlasfit::unwrap(Packed<float>(floats), f), 0.0);
}

/// Whatever the strides are, the library is given the caller's own numbers.
static void no_copies() {
  const auto [v, f] = made();
  const auto given = [](const auto &m) {
    return atlasfit::detail::Coordinates<std::decay_t<decltype(m)>>(m).points().c();
  };
  const Packed<double> packed = v;
  want(given(packed).positions == packed.data(), "packed rows");
  const M<float, Eigen::RowMajor> wide = M<float, Eigen::RowMajor>::Zero(50, 7);
  const auto strided = given(wide.middleCols<3>(2));
  want(strided.positions == wide.data() + 2 && strided.stride == 28 && strided.component_stride == 4,
       "rows with a stride");
  const Eigen::MatrixXd columns = v.transpose();
  want(given(columns.transpose()).positions == columns.data(), "columns, turned");
  const auto apart = given(v);
  want(apart.positions == v.data() && apart.component_stride == 8 * static_cast<std::size_t>(v.rows()),
       "column-major");
  const M<std::int64_t, Eigen::ColMajor> wide_f = f.cast<std::int64_t>();
  const auto faces = atlasfit::detail::Triangles<M<std::int64_t, Eigen::ColMajor>>(wide_f).faces();
  want(faces.corners == wide_f.data() && faces.scalar == ATLASFIT_I64 && faces.face_stride == 8,
       "indices of 64 bits, column-major");
}

static void scans() {
  const auto points = noisy_sphere(3000);
  Eigen::MatrixXd v(3000, 3);
  for (Eigen::Index i = 0; i < 3000; i++)
    for (Eigen::Index k = 0; k < 3; k++)
      v(i, k) = points[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
  const auto clean = atlasfit::denoise(v);
  const Eigen::MatrixXd p = atlasfit::rows<3>(clean.point_positions());
  const auto off = [](const Eigen::MatrixXd &m) { return (m.rowwise().norm().array() - 1.0).abs().mean(); };
  want(p.rows() == 3000 && off(p) < 0.5 * off(v), "points are on the surface, in order");
  want(atlasfit::rows<3>(atlasfit::denoise(Packed<double>(v)).point_positions()) == p,
       "in any order of numbers");
  Eigen::MatrixXd n = -v.rowwise().normalized();
  Eigen::Matrix<unsigned char, Eigen::Dynamic, 3> c(3000, 3);
  c.setConstant(51);
  const auto inward = atlasfit::denoise(v, n, c);
  const Eigen::MatrixXd normals = atlasfit::rows<3>(inward.point_normals()).cast<double>();
  want((normals.array() * v.array()).rowwise().sum().maxCoeff() < 0.0, "normals tell the side");
  const auto rgba = atlasfit::rows<4>(inward.surface_colors());
  want((rgba.leftCols<3>().array() - 0.2f).abs().maxCoeff() < 1e-3f, "bytes of colours are 0 to 255");
  want(stops([&] { atlasfit::denoise(v, {}, stopping()); }), "an exception comes out");
  const Eigen::MatrixXd sv = atlasfit::rows<3>(clean.surface_positions());
  const Eigen::MatrixXi sf = atlasfit::rows<3>(clean.surface_triangles()).cast<int>();
  want(atlasfit::measure_surface(sv, sf, Packed<float>(sv.cast<float>()), sf).accuracy.max < 1e-5,
       "two types");
}

static void failures() {
  const auto [v, f] = made();
  const Eigen::MatrixXd flat = v.leftCols<2>();
  Eigen::MatrixXi low = f, high = f;
  low(3, 1) = -1;
  high(3, 1) = 100000;
  const M<std::int64_t, Eigen::ColMajor> huge = f.cast<std::int64_t>() * (std::int64_t(1) << 32);
  const Eigen::MatrixXd none(0, 3);
  want(status_of([&] { atlasfit::unwrap(flat, f); }) == ATLASFIT_INVALID_ARGUMENT, "two columns");
  want(status_of([&] { atlasfit::unwrap(v, f.leftCols(2)); }) == ATLASFIT_INVALID_ARGUMENT, "two corners");
  want(status_of([&] { atlasfit::unwrap(v, low); }) == ATLASFIT_INDEX_OUT_OF_RANGE, "a negative index");
  want(status_of([&] { atlasfit::unwrap(v, M<int, Eigen::RowMajor>(low)); }) == ATLASFIT_INDEX_OUT_OF_RANGE,
       "a negative index that is not copied");
  want(status_of([&] { atlasfit::unwrap(v, high); }) == ATLASFIT_INDEX_OUT_OF_RANGE, "an index too large");
  want(status_of([&] { atlasfit::unwrap(v, huge); }) == ATLASFIT_INDEX_OUT_OF_RANGE, "an index of 64 bits");
  want(status_of([&] { atlasfit::denoise(none); }) == ATLASFIT_EMPTY_INPUT, "no points");
  want(status_of([&] { atlasfit::denoise(v, none); }) == ATLASFIT_INVALID_ARGUMENT, "too few normals");
  const auto layout = atlasfit::unwrap(v, f);
  want(status_of([&] { atlasfit::measure_uv(v, f, layout.uv.topRows(3), layout.faces); }) ==
           ATLASFIT_INDEX_OUT_OF_RANGE,
       "a UV that is not there");
}

int main() {
  every_order_alike();
  no_copies();
  scans();
  failures();
  want(atlasfit_live_handles() == 0, "no handle is left");
  return verdict();
}
