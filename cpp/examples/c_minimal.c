/* The smallest use: points in, denoised points and a surface out. */
#include <atlasfit.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define COUNT 5000

static int failed(const char *what) {
  char text[512];
  atlasfit_last_error(text, sizeof text);
  fprintf(stderr, "%s: %s\n", what, text);
  return 1;
}

int main(void) {
  /* A scan: a sphere of radius 2 with noise. */
  static float xyz[3 * COUNT];
  srand(1);
  for (int i = 0; i < COUNT; i++) {
    double z = 2.0 * rand() / RAND_MAX - 1.0, angle = 6.2831853 * rand() / RAND_MAX;
    double radius = 2.0 + 0.03 * ((double)rand() / RAND_MAX + (double)rand() / RAND_MAX - 1.0);
    xyz[3 * i] = (float)(radius * sqrt(1.0 - z * z) * cos(angle));
    xyz[3 * i + 1] = (float)(radius * sqrt(1.0 - z * z) * sin(angle));
    xyz[3 * i + 2] = (float)(radius * z);
  }

  atlasfit_points points;
  if (atlasfit_points_init(&points, sizeof points) != ATLASFIT_OK) return failed("points");
  points.positions = xyz;
  points.count = COUNT;

  atlasfit_result *result = NULL;
  if (atlasfit_denoise(&points, NULL, NULL, &result) != ATLASFIT_OK) return failed("denoise");

  atlasfit_report report;
  report.struct_size = sizeof report;
  if (atlasfit_result_report(result, &report) != ATLASFIT_OK) return failed("report");
  printf("%zu points, noise %.4f, spacing %.4f\n", report.points, report.noise, report.spacing);
  printf("surface: %zu vertices, %zu triangles, %zu part, %zu UV charts\n", report.vertices, report.triangles,
         report.parts, report.uv_charts);

  double *clean = malloc(3 * report.points * sizeof *clean);
  if (!clean) return 1;
  if (atlasfit_result_point_positions(result, clean, 3 * report.points) != ATLASFIT_OK)
    return failed("positions");
  double before = 0.0, after = 0.0;
  for (size_t i = 0; i < report.points; i++) {
    const float *p = xyz + 3 * i;
    const double *q = clean + 3 * i;
    before += pow(sqrt((double)p[0] * p[0] + (double)p[1] * p[1] + (double)p[2] * p[2]) - 2.0, 2);
    after += pow(sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) - 2.0, 2);
  }
  printf("distance from the true sphere: %.4f before, %.4f after\n", sqrt(before / COUNT),
         sqrt(after / COUNT));

  free(clean);
  atlasfit_result_free(result);
  return after < before ? 0 : 1;
}
