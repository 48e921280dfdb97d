// A scan in a matrix in, its denoised surface as V and F out, with UVs: eigen_denoise scan.ply
#include <atlasfit/eigen.hpp>

#include "../ply.hpp"

#include <iostream>

int main(int argc, char **argv) try {
  if (argc != 2) return 2;
  const Eigen::MatrixXd scan = atlasfit::rows<3>(read_ply(argv[1]));

  // atlasfit
  const auto clean = atlasfit::denoise(scan);
  const Eigen::MatrixXd V = atlasfit::rows<3>(clean.surface_positions());
  const Eigen::MatrixXi F = atlasfit::rows<3>(clean.surface_triangles()).cast<int>();
  const auto layout = atlasfit::unwrap(V, F);
  const auto quality = atlasfit::measure_uv(V, F, layout.uv, layout.faces);
  // done

  std::cout << V.rows() << " vertices, " << F.rows() << " faces, " << layout.info.charts << " charts\n";
  return quality.flips + quality.overlapping_faces == 0 ? 0 : 1;
} catch (const std::exception &error) {
  std::cerr << error.what() << "\n";
  return 1;
}
