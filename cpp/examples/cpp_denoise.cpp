// A scan (PLY) in, its denoised surface with normals and UVs (GLB) out: cpp_denoise scan.ply surface.glb
#include <atlasfit.hpp>

#include "glb.hpp"
#include "ply.hpp"

#include <cstdio>

int main(int argc, char **argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s SCAN.ply SURFACE.glb\n", argv[0]);
    return 2;
  }
  try {
    const std::vector<double> scan = read_ply(argv[1]);

    atlasfit::Run run;
    std::uint32_t shown = UINT32_MAX;
    run.progress = [&shown](std::uint32_t stage, double) {
      if (stage != shown) std::fprintf(stderr, "%s ...\n", atlasfit_stage_name(stage));
      shown = stage;
      return true;
    };
    atlasfit::DenoiseOptions options;
    options.outliers = ATLASFIT_OUTLIERS_DROP;
    const atlasfit::Denoised clean = atlasfit::denoise(atlasfit::Points(scan), options, run);

    const auto &report = clean.report();
    std::printf("%zu points, %zu outliers, noise %g, %zu triangles\n", report.points_given, report.outliers,
                report.noise, report.triangles);

    // glTF wants one UV per vertex: vertices on seams are doubled. GLB's positions are floats about the
    // scan's centre.
    const std::vector<double> xyz = clean.surface_positions();
    const std::vector<float> normals = clean.surface_normals(), corner_uv = clean.surface_corner_uv();
    const std::vector<std::uint32_t> triangles = clean.surface_triangles();
    const atlasfit_atlas_info frame = clean.atlas().info();
    write_glb(argv[2], xyz, normals, triangles, corner_uv, frame.origin);

    const atlasfit_uv_quality quality =
        atlasfit::measure_uv(atlasfit::Mesh(xyz, triangles).corner_uv(corner_uv.data()));
    std::printf("UVs: %zu charts, 95%% of the area stretched less than %.3f, %zu flips, %zu overlaps\n",
                quality.charts, quality.stretch_p95, quality.flips, quality.overlapping_faces);
    return quality.flips + quality.overlapping_faces == 0 ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
