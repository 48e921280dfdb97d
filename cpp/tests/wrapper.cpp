// The C++ wrapper: results, errors as exceptions, exceptions out of callbacks, moves.
#include "want.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <thread>

int main() {
  std::vector<float> xyz;
  for (int i = 0; i < 3000; i++) {
    const float z = 2.0f * (static_cast<float>(i) + 0.5f) / 3000.0f - 1.0f,
                a = 2.39996323f * static_cast<float>(i), s = std::sqrt(1.0f - z * z);
    const float r = 1.0f + 0.01f * std::sin(static_cast<float>(i) * 12.9898f);
    xyz.insert(xyz.end(), {r * s * std::cos(a), r * s * std::sin(a), r * z});
  }
  int calls = 0;
  atlasfit::Run run;
  double overall = -1.0, before = 0.0;
  bool falls = false;
  run.overall = &overall;
  run.progress = [&](std::uint32_t, double) {
    falls = falls || overall < before || overall > 1.0;
    before = overall;
    return ++calls > 0;
  };
  atlasfit::Denoised one = atlasfit::denoise(atlasfit::Points(xyz), {}, run);
  atlasfit::Denoised clean = std::move(one);
  want(calls > 0, "progress is told");
  want(overall >= 0.0 && !falls, "the overall share never falls");
  want(clean.report().parts == 1 && clean.report().points == 3000, "one part, all points");
  want(clean.point_positions().size() == 9000 &&
           clean.surface_corner_uv().size() == 6 * clean.report().triangles,
       "sizes");
  want(status_of([&] { clean.surface_colors(); }) == ATLASFIT_NOT_AVAILABLE, "no colours");
  want(status_of([&] { clean.point_uncertainty(); }) == ATLASFIT_NOT_AVAILABLE &&
           clean.report().uncertainty_factor == 0.0,
       "uncertainty was not asked for");
  atlasfit::DenoiseOptions asked;
  asked.uncertainty = 1;
  const atlasfit::Denoised sure = atlasfit::denoise(atlasfit::Points(xyz), asked);
  const std::vector<float> sd = sure.point_uncertainty(), noise = sure.point_noise();
  want(sure.point_positions() == clean.point_positions() &&
           sure.surface_corner_uv() == clean.surface_corner_uv(),
       "uncertainty changes nothing else");
  want(sd.size() == 3000 && sd[7] > 0.0f && sd[7] < noise[7] && noise[7] < 0.02f &&
           sure.point_outlier_probability()[7] < 0.5f,
       "a point of the sphere is surer than its noise");
  want(sure.surface_uncertainty().size() == sure.report().vertices && sure.surface_extrapolated()[0] == 0.0f,
       "vertices are told too");

  const atlasfit::Atlas atlas = clean.atlas();
  const std::array<double, 6> two = {0, 0, 1.5, 0.2, 0, -0.9};
  const atlasfit::Projection p = atlas.project(atlasfit::Points(two));
  want(std::abs(p.positions[2] - 1.0) < 0.05 && std::abs(p.distances[0] - 0.5) < 0.05,
       "projected onto the sphere");
  const atlasfit::Places places = atlas.eval(0, std::vector<double>{0.0, 0.0});
  want(std::abs(std::hypot(places.positions[0], places.positions[1], places.positions[2]) - 1.0) < 0.05,
       "a chart is on the sphere");

  const std::vector<std::uint8_t> bytes = atlas.save();
  want(atlasfit::Atlas::load(bytes.data(), bytes.size()).project(atlasfit::Points(two)).positions ==
           p.positions,
       "saved and loaded");
  want(status_of([&] { atlasfit::Atlas::load(bytes.data(), 100); }) == ATLASFIT_BAD_FILE,
       "a part of the bytes is refused");

  // Eigen-style: a pointer, a count, a stride in bytes.
  struct Vertex {
    float xyz[3];
    int tag;
  };
  std::vector<Vertex> wide(3000);
  for (std::size_t i = 0; i < 3000; i++) wide[i] = Vertex{{xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]}, 7};
  const atlasfit::Denoised same =
      atlasfit::denoise(atlasfit::Points(wide[0].xyz, wide.size(), sizeof(Vertex)));
  want(same.point_positions() == clean.point_positions(), "a stride changes nothing");

  const std::vector<double> surface = clean.surface_positions();
  const std::vector<std::uint32_t> triangles = clean.surface_triangles();
  atlasfit::UnwrapOptions options;
  const double balanced = options.max_stretch, few = options.preset(ATLASFIT_PRESET_FEW_SEAMS).max_stretch;
  want(few > balanced && options.preset(ATLASFIT_PRESET_BALANCED).max_stretch == balanced, "presets");
  options.max_stretch = 1.5;
  const atlasfit::UvLayout layout = atlasfit::unwrap(atlasfit::Mesh(surface, triangles), options);
  const std::vector<float> corners = layout.corners();
  std::vector<float> stretch;
  const atlasfit_uv_quality q =
      atlasfit::measure_uv(atlasfit::Mesh(surface, triangles).corner_uv(corners.data()), {}, &stretch);
  want(q.flips == 0 && q.overlapping_faces == 0 && stretch.size() == clean.report().triangles,
       "UVs are sound");
  want(layout.split().indices.size() == triangles.size(), "split form");
  want(atlasfit::measure_topology(atlasfit::Mesh(surface, triangles)).closed == 1, "closed");

  // The same triangles as faces with indices of 64 bits.
  const std::vector<std::int64_t> wide_corners(triangles.begin(), triangles.end());
  const atlasfit::Faces faces(wide_corners.data(), wide_corners.size() / 3);
  want(atlasfit::unwrap(atlasfit::Mesh(surface, faces), options).corners() == corners,
       "indices of 64 bits change nothing");
  atlasfit::SimplifyOptions fewer;
  fewer.faces = 200;
  const atlasfit::Simplified light =
      atlasfit::simplify(atlasfit::Mesh(surface, triangles).corner_uv(corners.data()), fewer);
  const std::vector<double> light_xyz = light.positions();
  const std::vector<std::uint32_t> light_triangles = light.triangles();
  const std::vector<float> light_uv = light.corner_uv();
  want(light.info().triangles <= 200 && light.warnings().empty(), "a few triangles are left");
  want(atlasfit::measure_uv(atlasfit::Mesh(light_xyz, light_triangles).corner_uv(light_uv.data())).flips ==
           0,
       "their UVs are sound");
  want(light.sources().size() == light.info().vertices, "each vertex has one of the mesh beside it");
  want(atlasfit::features().empty(), "the library is permissive");

  atlasfit::BakeOptions page;
  page.width = page.height = 64;
  const std::vector<std::uint8_t> grey(surface.size(), 77);
  const std::vector<std::uint8_t> texels = atlasfit::bake(
      atlasfit::Mesh(surface, triangles).corner_uv(corners.data()).colors(grey.data(), 3), page);
  want(texels.size() == 4 * 64 * 64 && texels[0] == 77 && texels[3] == 255, "baked vertex colours");
  const std::vector<float> white(xyz.size(), 1.0f);
  const atlasfit::Points scan = atlasfit::Points(xyz).colors(white.data(), 3);
  want(atlasfit::bake(atlasfit::Mesh(surface, triangles).corner_uv(corners.data()), page, {}, &scan)[0] ==
           255,
       "baked colours of a scan");

  const std::vector<std::uint16_t> labels(surface.size() / 3, 65535);
  atlasfit::SaveOptions with_uv;
  with_uv.corner_uv = corners.data();
  const std::string saved = "atlasfit_wrapper.ply";
  const std::string lost = atlasfit::save(
      saved,
      atlasfit::Points(surface).triangles(triangles.data(), triangles.size() / 3).attribute(
          "label", labels.data(), ATLASFIT_U16),
      with_uv);
  const atlasfit::File file = atlasfit::File::load(saved);
  std::remove(saved.c_str());
  want(lost.empty() && file.notes().empty() && file.positions() == surface && file.triangles() == triangles &&
           file.corner_uv() == corners,
       "what was saved is loaded");
  const atlasfit::Column label = file.attribute(0);
  want(file.info().attributes == 1 && label.name == "label" && label.scalar == ATLASFIT_U16 &&
           label.values == std::vector<double>(labels.begin(), labels.end()),
       "a label comes back with its type");
  want(status_of([&] { atlasfit::File::load(saved); }) == ATLASFIT_IO, "a file that is not there");

  // A square of one face and a triangle beside it.
  const std::vector<double> corners5 = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0};
  const std::vector<std::int64_t> around = {0, 1, 2, 3, 1, 4, 2}, starts = {0, 4, 7};
  const std::string quads = "atlasfit_wrapper.off";
  atlasfit::save(quads, atlasfit::Points(corners5).faces(atlasfit::Faces(around.data(), starts.data(), 2)));
  const atlasfit::File polygons = atlasfit::File::load(quads);
  std::remove(quads.c_str());
  want(polygons.triangles().size() == 9, "a saved quad is two triangles when it is read");

  atlasfit::Run logged;
  std::vector<std::string> told;
  logged.log = [&](std::uint32_t level, const std::string &line) {
    if (level == ATLASFIT_LOG_ERROR) told.push_back(line);
  };
  want(status_of([&] { atlasfit::File::load(quads, logged); }) == ATLASFIT_IO && told.size() == 1 &&
           told[0].find(quads) != std::string::npos,
       "the log is told why a call fails");

  const std::uint64_t needed = atlasfit::denoise_memory_needed(3000);
  want(atlasfit::denoise_memory_needed(6000) > needed && needed > 100 * 3000, "denoising tells its memory");
  want(atlasfit::unwrap_memory_needed(6000, 12000) > atlasfit::unwrap_memory_needed(3000, 6000),
       "unwrapping tells its memory");
  atlasfit::Run little;
  little.memory_limit_bytes = needed / 2;
  want(status_of([&] { atlasfit::denoise(atlasfit::Points(xyz), {}, little); }) == ATLASFIT_OUT_OF_MEMORY,
       "a limit below the need refuses");

  want(layout.info().padding == 2, "the padding asked for is kept");
  // Two hundred triangles that share no vertex are as many charts.
  std::vector<double> loose;
  std::vector<std::uint32_t> corner;
  for (int i = 0; i < 200; i++) {
    loose.insert(loose.end(), {2.0 * i, 0, 0, 2.0 * i + 1, 0, 0, 2.0 * i, 1, 0});
    for (int k = 0; k < 3; k++) corner.push_back(static_cast<std::uint32_t>(3 * i + k));
  }
  atlasfit::UnwrapOptions spread;
  spread.page_width = spread.page_height = 64;
  spread.padding = 8;
  const atlasfit::UvLayout narrow = atlasfit::unwrap(atlasfit::Mesh(loose, corner), spread);
  want(narrow.info().padding < 8 && !narrow.warnings().empty(), "a padding that does not fit is lowered");

  // A rectangle that lies askew.
  const std::vector<double> askew{0, 0, 0, 4, 3, 0, 2.5, 5, 0, -1.5, 2, 0};
  const std::vector<std::uint32_t> halves{0, 1, 2, 0, 2, 3};
  atlasfit::UnwrapOptions straight;
  straight.straighten = ATLASFIT_STRAIGHTEN_AUTO;
  const atlasfit::UvLayout along = atlasfit::unwrap(atlasfit::Mesh(askew, halves), straight);
  const std::vector<float> along_uv = along.corners();
  want(atlasfit::unwrap(atlasfit::Mesh(askew, halves)).info().straightened_charts == 0, "not by itself");
  want(along.info().straightened_charts == 1 &&
           atlasfit::measure_uv(atlasfit::Mesh(askew, halves).corner_uv(along_uv.data())).straightness == 1.0,
       "a rectangle lies along the page where that is asked for");

  // Prices that say nothing change nothing; what is no price is refused.
  const std::vector<float> alike(4, 2.0F), below(4, -1.0F);
  want(atlasfit::unwrap(atlasfit::Mesh(askew, halves).seam_price(alike.data())).corners() ==
           atlasfit::unwrap(atlasfit::Mesh(askew, halves)).corners(),
       "one price everywhere changes nothing");
  bool refused = false;
  try {
    atlasfit::unwrap(atlasfit::Mesh(askew, halves).seam_price(below.data()));
  } catch (const atlasfit::Error &e) {
    refused = std::string(e.what()).find("seam_price of vertex 0") != std::string::npos;
  }
  want(refused, "a negative price is refused");

  // A sheet faces where its scanner stood.
  std::vector<double> sheet;
  for (int i = 0; i < 60; i++)
    for (int j = 0; j < 60; j++)
      sheet.insert(sheet.end(), {i / 60.0, j / 60.0, 0.001 * std::sin(7.0 * i * j)});
  for (const double side : {1.0, -1.0}) {
    atlasfit::DenoiseOptions from;
    from.has_viewpoint = 1;
    from.viewpoint[0] = from.viewpoint[1] = 0.5;
    from.viewpoint[2] = 3.0 * side;
    const std::vector<float> normals = atlasfit::denoise(atlasfit::Points(sheet), from).point_normals();
    double up = 0.0;
    for (std::size_t i = 2; i < normals.size(); i += 3) up += static_cast<double>(normals[i]);
    want(up * side > 0.9 * 3600, "a sheet faces its viewpoint");
  }

  // A bowl, seen twice: the second sweep is a fiftieth too high.
  std::vector<double> bowl, sweep_of;
  for (int k = 0; k < 2; k++)
    for (int i = 0; i < 40; i++)
      for (int j = 0; j < 40; j++) {
        const double x = i / 40.0 - 0.5, y = j / 40.0 - 0.5;
        bowl.insert(bowl.end(), {x, y, x * x + y * y + 0.02 * k + 0.001 * std::sin(7.0 * i * j)});
        sweep_of.push_back(k);
      }
  atlasfit::Points twice(bowl);
  twice.attribute("view", sweep_of.data(), ATLASFIT_F64);
  atlasfit::DenoiseOptions together;
  together.uv = 0;
  together.sweeps = "view";
  const atlasfit::Denoised joined = atlasfit::denoise(twice, together);
  const std::vector<atlasfit_sweep> moved = joined.sweeps();
  const atlasfit_report &report = joined.report();
  want(moved.size() == 2 && report.apart_after < 0.5 * report.apart_before, "sweeps are moved");
  want(moved[1].sweep == 1 && moved[0].points == 1600 && moved[1].pairs > 100, "and each is told");
  want(std::abs(moved[0].matrix[11] - moved[1].matrix[11] - 0.02) < 0.005, "by as much as they were apart");
  together.sweeps = "scan";
  want(status_of([&] { atlasfit::denoise(twice, together); }) == ATLASFIT_INVALID_ARGUMENT,
       "an attribute that is not there");

  const std::vector<double> none, four(4);
  want(status_of([&] { atlasfit::denoise(atlasfit::Points(none)); }) == ATLASFIT_EMPTY_INPUT, "no points");
  want(status_of([&] { atlasfit::Points{four}; }) == ATLASFIT_INVALID_ARGUMENT, "four numbers are no points");
  want(clean.warnings().empty() && layout.warnings().empty(), "a good scan has no warnings");
  atlasfit::DenoiseOptions calm;
  calm.noise = 1e-6;
  const std::vector<std::string> warned = atlasfit::denoise(atlasfit::Points(xyz), calm).warnings();
  want(warned.size() == 1 && warned[0].find("noise") != std::string::npos, "too little noise is warned of");
  struct Stop {};
  run.progress = [](std::uint32_t, double) -> bool { throw Stop(); };
  bool stopped = false;
  try {
    atlasfit::denoise(atlasfit::Points(xyz), {}, run);
  } catch (const Stop &) {
    stopped = true;
  }
  want(stopped, "a callback's exception comes out");
  atlasfit::CancelToken token;
  run.progress = nullptr;
  run.cancel = &token;
  std::thread([&token] { token.request(); }).join();
  want(status_of([&] { atlasfit::denoise(atlasfit::Points(xyz), {}, run); }) == ATLASFIT_CANCELLED,
       "cancelled from a thread");
  const atlasfit::CancelToken kept = std::move(token);
  want(status_of([&] { token.request(); }) == ATLASFIT_INVALID_HANDLE,
       "a token that was moved from asks nobody");
  want(status_of([&] { atlasfit::denoise(atlasfit::Points(xyz), {}, run); }) == ATLASFIT_INVALID_HANDLE,
       "and is refused by a run");
  std::printf("%d wrong\n", wrong);
  return wrong != 0;
}
