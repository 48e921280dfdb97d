// Denoises points on a sphere with what the package has installed.
#include <atlasfit.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

int main() {
  std::vector<double> xyz;
  for (int i = 0; i < 2000; ++i) {
    const double z = 1 - (2 * i + 1) / 2000.0, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    xyz.insert(xyz.end(), {r * std::cos(turn), r * std::sin(turn), z});
  }
  const atlasfit::Points points(xyz);
  const auto result = atlasfit::denoise(points);
  std::printf("%zu faces\n", static_cast<std::size_t>(result.surface_triangles().size() / 3));
  return result.surface_triangles().empty() ? 1 : 0;
}
