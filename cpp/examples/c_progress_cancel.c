/* Progress on a terminal, and stopping: Ctrl-C, a time limit, or after a share of the work (for a trial:
 * c_progress_cancel 0.5). */
#include <atlasfit.h>

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#define COUNT 50000

static volatile sig_atomic_t interrupted = 0;

static void on_interrupt(int number) {
  (void)number;
  interrupted = 1; /* A signal handler may set a flag and nothing more; the progress callback sees it. */
}

struct progress {
  double stop_after; /* stages, with fraction */
  uint32_t stage;
  unsigned calls;
};

static int32_t tell(void *user, uint32_t stage, double fraction) {
  struct progress *p = user;
  p->calls++;
  if (stage != p->stage) {
    fprintf(stderr, "%s%s ... ", p->calls > 1 ? "\n" : "", atlasfit_stage_name(stage));
    p->stage = stage;
  }
  return !interrupted && stage + fraction < p->stop_after;
}

int main(int argc, char **argv) {
  float *xyz = malloc(3 * COUNT * sizeof *xyz);
  if (!xyz) return 1;
  for (int i = 0; i < COUNT; i++) { /* A torus. */
    double u = 6.2831853 * fmod(i * 0.6180339887, 1.0), v = 6.2831853 * i / COUNT * 180.0;
    xyz[3 * i] = (float)((3.0 + cos(v)) * cos(u));
    xyz[3 * i + 1] = (float)((3.0 + cos(v)) * sin(u));
    xyz[3 * i + 2] = (float)sin(v);
  }

  atlasfit_points points;
  atlasfit_run run;
  if (atlasfit_points_init(&points, sizeof points) != ATLASFIT_OK ||
      atlasfit_run_init(&run, sizeof run) != ATLASFIT_OK)
    return 1;
  points.positions = xyz;
  points.count = COUNT;

  struct progress progress = {argc > 1 ? atof(argv[1]) : INFINITY, UINT32_MAX, 0};
  signal(SIGINT, on_interrupt);
  run.progress = tell;
  run.progress_user = &progress;
  run.time_limit_s = 600.0;

  atlasfit_result *result = NULL;
  int32_t status = atlasfit_denoise(&points, NULL, &run, &result);
  free(xyz);
  if (status != ATLASFIT_OK) {
    char text[512];
    atlasfit_last_error(text, sizeof text);
    fprintf(stderr, "\n%s: %s\n", atlasfit_status_name(status), text);
    /* Stopped as asked is what this example is about. */
    return status == ATLASFIT_CANCELLED ? 0 : 1;
  }
  atlasfit_report report;
  report.struct_size = sizeof report;
  status = atlasfit_result_report(result, &report);
  if (status == ATLASFIT_OK) {
    fprintf(stderr, "\ndone after %u calls\n", progress.calls);
    printf("%zu triangles\n", report.triangles);
  }
  atlasfit_result_free(result);
  return status == ATLASFIT_OK ? 0 : 1;
}
