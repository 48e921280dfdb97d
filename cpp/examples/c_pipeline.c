/* A scan's file in, its denoised surface with UVs out, in any format: c_pipeline scan.ply surface.glb */
#include <atlasfit.h>

#include <stdio.h>
#include <stdlib.h>

/* atlasfit */
/* What a call of the library said: its text when it failed. */
static int failed(int32_t status) {
  char text[512];
  if (status == ATLASFIT_OK) return 0;
  atlasfit_last_error(text, sizeof text);
  fprintf(stderr, "%s\n", text);
  return 1;
}

static int load(const char *path, double **xyz, size_t *count) {
  atlasfit_file *file;
  atlasfit_file_info info = {.struct_size = sizeof info};
  if (failed(atlasfit_file_load(path, NULL, &file))) return 1;
  int bad = failed(atlasfit_file_get_info(file, &info));
  *count = info.points;
  *xyz = malloc(3 * info.points * sizeof **xyz);
  bad = bad || !*xyz || failed(atlasfit_file_positions(file, *xyz, 3 * info.points));
  atlasfit_file_free(file);
  return bad;
}

static int save(const char *path, const atlasfit_result *result) {
  atlasfit_report report = {.struct_size = sizeof report};
  if (failed(atlasfit_result_report(result, &report))) return 1;
  const size_t n = report.vertices, m = report.triangles;
  double *xyz = malloc(3 * n * sizeof *xyz);
  uint32_t *corners = malloc(3 * m * sizeof *corners);
  float *uv = malloc(6 * m * sizeof *uv);
  atlasfit_points mesh;
  atlasfit_save_options options;
  int bad = !xyz || !corners || !uv || failed(atlasfit_points_init(&mesh, sizeof mesh)) ||
            failed(atlasfit_save_options_init(&options, sizeof options)) ||
            failed(atlasfit_result_surface_positions(result, xyz, 3 * n)) ||
            failed(atlasfit_result_surface_triangles(result, corners, 3 * m)) ||
            failed(atlasfit_result_surface_corner_uv(result, uv, 6 * m));
  if (!bad) {
    mesh.positions = xyz;
    mesh.count = n;
    mesh.scalar = ATLASFIT_F64;
    mesh.triangles = corners;
    mesh.triangle_count = m;
    options.corner_uv = uv;
    bad = failed(atlasfit_file_save(path, &mesh, &options, NULL, NULL, 0));
  }
  free(xyz);
  free(corners);
  free(uv);
  return bad;
}

int main(int argc, char **argv) {
  double *xyz = NULL;
  atlasfit_points scan;
  atlasfit_result *result = NULL;
  if (argc != 3 || failed(atlasfit_points_init(&scan, sizeof scan))) return 2;
  int bad = load(argv[1], &xyz, &scan.count);
  scan.positions = xyz;
  scan.scalar = ATLASFIT_F64;
  bad = bad || failed(atlasfit_denoise(&scan, NULL, NULL, &result)) || save(argv[2], result);
  atlasfit_result_free(result);
  free(xyz);
  return bad;
}
/* done */
