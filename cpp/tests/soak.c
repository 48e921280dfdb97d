/* Every kind of call once, also failing and cancelled at each stage, for valgrind and the sanitizers: all
 * memory must be given back. soak [POINTS [THREADS]] */
#include <atlasfit.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int wrong = 0;

static void want(int32_t status, int32_t expected, const char *what) {
  if (status != expected) {
    char text[512];
    atlasfit_last_error(text, sizeof text);
    fprintf(stderr, "%s: %s instead of %s; %s\n", what, atlasfit_status_name(status),
            atlasfit_status_name(expected), text);
    wrong++;
  }
}

/* Cancels at a share of the stages. */
static int32_t until(void *user, uint32_t stage, double fraction) {
  return stage + fraction < *(double *)user;
}

static double noise(void) { return (double)rand() / RAND_MAX - 0.5; }

int main(int argc, char **argv) {
  const size_t n = argc > 1 ? (size_t)atol(argv[1]) : 3000;
  double *xyz = malloc(3 * n * sizeof *xyz);
  uint8_t *rgb = malloc(3 * n);
  float *weight = malloc(n * sizeof *weight);
  if (!xyz || !rgb || !weight) return 1;
  for (size_t i = 0; i < n; i++) {
    double z = 2.0 * ((double)i + 0.5) / (double)n - 1.0, a = 2.399963229728653 * (double)i,
           s = sqrt(1.0 - z * z), r = 1.0 + 0.02 * noise();
    xyz[3 * i] = r * s * cos(a) + 1000000.0;
    xyz[3 * i + 1] = r * s * sin(a);
    xyz[3 * i + 2] = r * z;
    rgb[3 * i] = rgb[3 * i + 1] = rgb[3 * i + 2] = (uint8_t)i;
    weight[i] = (float)i;
  }
  atlasfit_points points;
  atlasfit_attribute attribute;
  atlasfit_run run;
  want(atlasfit_points_init(&points, sizeof points), ATLASFIT_OK, "points");
  want(atlasfit_attribute_init(&attribute, sizeof attribute), ATLASFIT_OK, "attribute");
  want(atlasfit_run_init(&run, sizeof run), ATLASFIT_OK, "run");
  attribute.name = "weight";
  attribute.values = weight;
  points.positions = xyz;
  points.count = n;
  points.scalar = ATLASFIT_F64;
  points.colors = rgb;
  points.color_scalar = ATLASFIT_U8;
  points.color_width = 3;
  points.attributes = &attribute;
  points.attribute_count = 1;
  run.threads = argc > 2 ? (uint32_t)atoi(argv[2]) : 2;

  /* Failing. */
  atlasfit_result *result = NULL;
  atlasfit_points bad = points;
  bad.count = 0;
  want(atlasfit_denoise(&bad, NULL, &run, &result), ATLASFIT_EMPTY_INPUT, "no points");
  bad.count = 5;
  want(atlasfit_denoise(&bad, NULL, &run, &result), ATLASFIT_DEGENERATE, "five points");
  bad.struct_size = 3;
  want(atlasfit_denoise(&bad, NULL, &run, &result), ATLASFIT_ABI_MISMATCH, "struct_size");
  atlasfit_denoise_options seen;
  want(atlasfit_denoise_options_init(&seen, sizeof seen), ATLASFIT_OK, "options");
  seen.has_viewpoint = 1;
  seen.viewpoint[1] = NAN;
  want(atlasfit_denoise(&points, &seen, &run, &result), ATLASFIT_INVALID_ARGUMENT, "viewpoint");
  /* What a call needs is told beforehand, and a limit below that refuses the call. */
  uint64_t needed = 0, more = 0, to_unwrap = 0;
  want(atlasfit_denoise_memory_needed(n, NULL, &run, &needed), ATLASFIT_OK, "memory of denoising");
  want(atlasfit_denoise_memory_needed(2 * n, NULL, &run, &more), ATLASFIT_OK, "memory of denoising");
  want(atlasfit_unwrap_memory_needed(n, 2 * n, NULL, &run, &to_unwrap), ATLASFIT_OK, "memory of unwrapping");
  if (more <= needed || needed <= to_unwrap || to_unwrap < 100 * n) {
    fprintf(stderr, "memory needed: %.0f, %.0f, %.0f\n", (double)needed, (double)more, (double)to_unwrap);
    wrong++;
  }
  want(atlasfit_unwrap_memory_needed(n, 2 * n, NULL, &run, NULL), ATLASFIT_INVALID_ARGUMENT, "no place");
  run.memory_limit_bytes = needed / 2;
  want(atlasfit_denoise(&points, NULL, &run, &result), ATLASFIT_OUT_OF_MEMORY, "memory limit");
  run.memory_limit_bytes = 0;
  run.time_limit_s = 1e-6;
  want(atlasfit_denoise(&points, NULL, &run, &result), ATLASFIT_TIMED_OUT, "time limit");
  run.time_limit_s = 0;

  /* Cancelled at the start, early, in the middle, late, and by a token. */
  const double moments[] = {-1.0, 1.0, 2.0, 3.5, 4.5, 5.5, 6.5, 8.0};
  for (size_t i = 0; i < sizeof moments / sizeof *moments; i++) {
    double moment = moments[i];
    run.progress = until;
    run.progress_user = &moment;
    /* A stage may be too short to be seen: then it is done. */
    int32_t status = atlasfit_denoise(&points, NULL, &run, &result);
    if (status != ATLASFIT_OK || moment < 0.0) want(status, ATLASFIT_CANCELLED, "cancel");
    want(atlasfit_result_free(result), ATLASFIT_OK, "free");
  }
  run.progress = NULL;
  atlasfit_cancel *token = NULL;
  want(atlasfit_cancel_new(&token), ATLASFIT_OK, "token");
  want(atlasfit_cancel_request(token), ATLASFIT_OK, "request");
  run.cancel = token;
  want(atlasfit_denoise(&points, NULL, &run, &result), ATLASFIT_CANCELLED, "token");
  run.cancel = NULL;
  want(atlasfit_cancel_free(token), ATLASFIT_OK, "free");
  want(atlasfit_cancel_free(token), ATLASFIT_INVALID_HANDLE, "freed twice");

  /* Denoising. */
  atlasfit_denoise_options sure;
  want(atlasfit_denoise_options_init(&sure, sizeof sure), ATLASFIT_OK, "options");
  sure.uncertainty = 1;
  want(atlasfit_denoise(&points, &sure, &run, &result), ATLASFIT_OK, "denoise");
  atlasfit_report report;
  report.struct_size = sizeof report;
  want(atlasfit_result_report(result, &report), ATLASFIT_OK, "report");
  const size_t p = report.points, v = report.vertices, t = report.triangles;
  double *places = malloc(3 * (p > v ? p : v) * sizeof *places);
  double *vertices = malloc(3 * v * sizeof *vertices);
  float *floats = malloc(6 * (p + v + t) * sizeof *floats);
  uint32_t *triangles = malloc(3 * t * sizeof *triangles), *words = malloc((p + v + 3 * t) * sizeof *words);
  if (!places || !vertices || !floats || !triangles || !words) return 1;
  want(atlasfit_result_point_positions(result, places, 3 * p), ATLASFIT_OK, "positions");
  want(atlasfit_result_point_normals(result, floats, 3 * p), ATLASFIT_OK, "normals");
  want(atlasfit_result_point_sources(result, words, p), ATLASFIT_OK, "sources");
  want(atlasfit_result_point_charts(result, words, p), ATLASFIT_OK, "charts");
  want(atlasfit_result_surface_positions(result, vertices, 3 * v), ATLASFIT_OK, "vertices");
  want(atlasfit_result_surface_normals(result, floats, 3 * v), ATLASFIT_OK, "vertex normals");
  want(atlasfit_result_surface_colors(result, floats, 4 * v), ATLASFIT_OK, "colours");
  want(atlasfit_result_surface_attribute(result, 0, places, v), ATLASFIT_OK, "attribute");
  atlasfit_buffer told;
  want(atlasfit_buffer_init(&told, sizeof told), ATLASFIT_OK, "buffer");
  told.data = floats;
  told.capacity = p;
  want(atlasfit_result_copy(result, ATLASFIT_POINT_UNCERTAINTY, &told), ATLASFIT_OK, "uncertainty");
  want(atlasfit_result_copy(result, ATLASFIT_POINT_NOISE, &told), ATLASFIT_OK, "noise");
  want(atlasfit_result_copy(result, ATLASFIT_POINT_OUTLIER_PROBABILITY, &told), ATLASFIT_OK, "outliers");
  told.capacity = v;
  want(atlasfit_result_copy(result, ATLASFIT_SURFACE_UNCERTAINTY, &told), ATLASFIT_OK, "uncertainty");
  told.capacity = v - 1;
  want(atlasfit_result_copy(result, ATLASFIT_SURFACE_EXTRAPOLATED, &told), ATLASFIT_BUFFER_TOO_SMALL,
       "small");
  want(atlasfit_result_surface_triangles(result, triangles, 3 * t), ATLASFIT_OK, "triangles");
  want(atlasfit_result_surface_corner_uv(result, floats, 6 * t - 1), ATLASFIT_BUFFER_TOO_SMALL, "small");
  want(atlasfit_result_surface_face_charts(result, words, t), ATLASFIT_OK, "UV charts");
  want(atlasfit_result_surface_corner_uv(result, floats, 6 * t), ATLASFIT_OK, "UVs");

  /* The atlas outlives its result. */
  atlasfit_atlas *atlas = NULL;
  want(atlasfit_result_atlas(result, &atlas), ATLASFIT_OK, "atlas");
  want(atlasfit_atlas_free((atlasfit_atlas *)result), ATLASFIT_INVALID_HANDLE, "another kind");
  want(atlasfit_result_free(result), ATLASFIT_OK, "free");
  want(atlasfit_result_report(result, &report), ATLASFIT_INVALID_HANDLE, "used after it was freed");
  atlasfit_atlas_info info;
  info.struct_size = sizeof info;
  want(atlasfit_atlas_get_info(atlas, &info), ATLASFIT_OK, "info");
  atlasfit_projection out;
  want(atlasfit_projection_init(&out, sizeof out), ATLASFIT_OK, "projection");
  out.capacity = n;
  out.positions = places;
  want(atlasfit_atlas_project(atlas, &points, &run, &out), ATLASFIT_OK, "project");
  const double uv[2] = {0.1, -0.2};
  double place[3];
  want(atlasfit_atlas_eval(atlas, info.charts - 1, uv, 1, place, NULL, NULL, 1), ATLASFIT_OK, "eval");
  want(atlasfit_atlas_eval(atlas, info.charts, uv, 1, place, NULL, NULL, 1), ATLASFIT_INDEX_OUT_OF_RANGE,
       "eval");
  size_t size = 0;
  want(atlasfit_atlas_save(atlas, NULL, 0, &size), ATLASFIT_OK, "size");
  uint8_t *bytes = malloc(size);
  want(atlasfit_atlas_save(atlas, bytes, size, &size), ATLASFIT_OK, "save");
  want(atlasfit_atlas_free(atlas), ATLASFIT_OK, "free");
  want(atlasfit_atlas_load(bytes, size - 5, &atlas), ATLASFIT_BAD_FILE, "load a part");
  want(atlasfit_atlas_load(bytes, size, &atlas), ATLASFIT_OK, "load");
  want(atlasfit_atlas_free(atlas), ATLASFIT_OK, "free");
  free(bytes);

  /* Measuring and unwrapping the surface. */
  atlasfit_mesh mesh;
  want(atlasfit_mesh_init(&mesh, sizeof mesh), ATLASFIT_OK, "mesh");
  mesh.positions = vertices;
  mesh.vertex_count = v;
  mesh.scalar = ATLASFIT_F64;
  mesh.triangles = triangles;
  mesh.triangle_count = t;
  mesh.corner_uv = floats;
  atlasfit_topology topology;
  topology.struct_size = sizeof topology;
  want(atlasfit_measure_topology(&mesh, &run, &topology), ATLASFIT_OK, "topology");
  atlasfit_uv_quality quality;
  quality.struct_size = sizeof quality;
  float *stretch = malloc(t * sizeof *stretch);
  want(atlasfit_measure_uv(&mesh, &run, &quality, stretch, t), ATLASFIT_OK, "UV quality");
  free(stretch);
  atlasfit_distance distance;
  distance.struct_size = sizeof distance;
  atlasfit_distance_options few;
  want(atlasfit_distance_options_init(&few, sizeof few), ATLASFIT_OK, "options");
  few.samples = few.chamfer_samples = 500;
  want(atlasfit_measure_surface(&mesh, &mesh, &few, &run, &distance), ATLASFIT_OK, "distance");
  want(atlasfit_measure_points(&points, &mesh, &few, &run, &distance, NULL, 0), ATLASFIT_OK,
       "distance of points");
  atlasfit_bake_options page;
  want(atlasfit_bake_options_init(&page, sizeof page), ATLASFIT_OK, "options");
  page.width = page.height = 64;
  const size_t room = 4 * 64 * 64;
  uint8_t *texels = malloc(room);
  want(atlasfit_bake(&mesh, NULL, &page, &run, texels, room), ATLASFIT_EMPTY_INPUT, "no colours");
  want(atlasfit_bake(&mesh, &points, &page, &run, texels, room - 1), ATLASFIT_BUFFER_TOO_SMALL, "small");
  want(atlasfit_bake(&mesh, &points, &page, &run, texels, room), ATLASFIT_OK, "bake");
  free(texels);
  mesh.corner_uv = NULL;
  atlasfit_uv *layout = NULL;
  for (double moment = -1.0; moment < 10.0; moment += 3.0) {
    run.progress = until;
    run.progress_user = &moment;
    int32_t status = atlasfit_unwrap(&mesh, NULL, &run, &layout);
    if (status != ATLASFIT_OK) want(status, ATLASFIT_CANCELLED, "cancelled unwrap");
    want(atlasfit_uv_free(layout), ATLASFIT_OK, "free");
  }
  run.progress = NULL;
  triangles[4] = (uint32_t)v;
  want(atlasfit_unwrap(&mesh, NULL, &run, &layout), ATLASFIT_INDEX_OUT_OF_RANGE, "an index that is none");
  triangles[4] = 0;
  want(atlasfit_unwrap(&mesh, NULL, &run, &layout), ATLASFIT_OK, "unwrap");
  atlasfit_uv_info uv_info;
  uv_info.struct_size = sizeof uv_info;
  want(atlasfit_uv_get_info(layout, &uv_info), ATLASFIT_OK, "UV info");
  if (uv_info.padding != 2) {
    fprintf(stderr, "a padding of %u instead of the default\n", (unsigned)uv_info.padding);
    wrong++;
  }
  want(atlasfit_uv_corners(layout, floats, 6 * t), ATLASFIT_OK, "corners");
  uint32_t *sources = malloc(uv_info.split_vertices * sizeof *sources);
  float *split = malloc(2 * uv_info.split_vertices * sizeof *split);
  want(atlasfit_uv_split(layout, words, 3 * t, sources, split, uv_info.split_vertices), ATLASFIT_OK, "split");
  want(atlasfit_uv_face_charts(layout, words, t), ATLASFIT_OK, "face charts");
  want(atlasfit_uv_face_pages(layout, words, t), ATLASFIT_OK, "face pages");
  want(atlasfit_uv_free(layout), ATLASFIT_OK, "free");

  /* Polygons with indices of 64 bits, the first of them ignored; then fewer triangles. */
  int64_t *corners = malloc(3 * t * sizeof *corners);
  uint8_t *ignored = calloc(t, 1);
  if (!corners || !ignored) return 1;
  for (size_t i = 0; i < 3 * t; i++) corners[i] = (int64_t)triangles[i];
  ignored[0] = 1;
  mesh.triangles = NULL;
  mesh.triangle_count = 0;
  mesh.faces.corners = corners;
  mesh.faces.count = t;
  mesh.faces.scalar = ATLASFIT_I64;
  mesh.face_ignored = ignored;
  want(atlasfit_unwrap(&mesh, NULL, &run, &layout), ATLASFIT_OK, "unwrap faces");
  want(atlasfit_uv_face_charts(layout, words, t), ATLASFIT_OK, "face charts");
  if (words[0] != UINT32_MAX || words[t - 1] == UINT32_MAX) {
    fprintf(stderr, "an ignored face has a chart, or another has none\n");
    wrong++;
  }
  want(atlasfit_uv_face_torn(layout, NULL, 0), ATLASFIT_OK, "torn faces");
  want(atlasfit_uv_free(layout), ATLASFIT_OK, "free");
  atlasfit_simplify_options fewer;
  want(atlasfit_simplify_options_init(&fewer, sizeof fewer), ATLASFIT_OK, "options");
  fewer.faces = t / 4;
  atlasfit_simplified *light = NULL;
  want(atlasfit_simplify(&mesh, &fewer, &run, &light), ATLASFIT_OK, "simplify");
  atlasfit_simplified_info lightness;
  lightness.struct_size = sizeof lightness;
  want(atlasfit_simplified_get_info(light, &lightness), ATLASFIT_OK, "info");
  want(atlasfit_simplified_positions(light, vertices, 3 * v), ATLASFIT_OK, "positions");
  want(atlasfit_simplified_triangles(light, triangles, 3 * t), ATLASFIT_OK, "triangles");
  want(atlasfit_simplified_corner_uv(light, floats, 6 * t), ATLASFIT_NOT_AVAILABLE, "UVs");
  want(atlasfit_simplified_free(light), ATLASFIT_OK, "free");
  free(corners);
  free(ignored);

  free(sources);
  free(split);
  free(words);
  free(triangles);
  free(floats);
  free(vertices);
  free(places);
  free(weight);
  free(rgb);
  free(xyz);
  if (atlasfit_live_handles() != 0) {
    fprintf(stderr, "%zu handles are left\n", atlasfit_live_handles());
    wrong++;
  }
  printf("%d wrong\n", wrong);
  return wrong != 0;
}
