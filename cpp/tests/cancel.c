/* How long a cancel takes: cancels a fit of POINTS points at MOMENTS random moments from another thread. A
 * measurement, not a test: what else the machine does counts too. Names the stages of the slowest. cancel
 * [POINTS [MOMENTS]] */
#define _POSIX_C_SOURCE 200809L
#include <atlasfit.h>

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* What a cancel took, and the stage that was running. */
struct cancelled {
  double seconds;
  uint32_t stage;
};

struct request {
  atlasfit_cancel *token;
  double after, at;
};

static void *cancel(void *user) {
  struct request *r = user;
  struct timespec t;
  t.tv_sec = (time_t)r->after;
  t.tv_nsec = (long)((r->after - (double)t.tv_sec) * 1e9);
  nanosleep(&t, NULL);
  r->at = now();
  atlasfit_cancel_request(r->token);
  return NULL;
}

static int32_t watch(void *user, uint32_t stage, double fraction) {
  (void)fraction;
  *(uint32_t *)user = stage;
  return 1;
}

static int slowest_first(const void *a, const void *b) {
  const double s = ((const struct cancelled *)a)->seconds, t = ((const struct cancelled *)b)->seconds;
  return (s < t) - (s > t);
}

int main(int argc, char **argv) {
  const size_t n = argc > 1 ? (size_t)atol(argv[1]) : 200000;
  const int moments = argc > 2 ? atoi(argv[2]) : 50;
  double *xyz = malloc(3 * n * sizeof *xyz);
  struct cancelled *late = malloc((size_t)moments * sizeof *late);
  uint32_t stage = 0;
  if (!xyz || !late) return 1;
  srand(7);
  for (size_t i = 0; i < n; i++) {
    double z = 2.0 * ((double)i + 0.5) / (double)n - 1.0, a = 2.399963229728653 * (double)i,
           s = sqrt(1.0 - z * z);
    double r = 1.0 + 0.1 * sin(6.0 * z) * cos(3.0 * a) +
               0.003 * ((double)rand() / RAND_MAX + (double)rand() / RAND_MAX - 1.0);
    xyz[3 * i] = r * s * cos(a);
    xyz[3 * i + 1] = r * s * sin(a);
    xyz[3 * i + 2] = r * z;
  }
  atlasfit_points points;
  atlasfit_run run;
  if (atlasfit_points_init(&points, sizeof points) || atlasfit_run_init(&run, sizeof run)) return 1;
  points.positions = xyz;
  points.count = n;
  points.scalar = ATLASFIT_F64;
  atlasfit_result *result;
  double start = now();
  if (atlasfit_denoise(&points, NULL, &run, &result)) return 1;
  const double whole = now() - start;
  atlasfit_result_free(result);
  int cancelled = 0;
  run.progress = watch;
  run.progress_user = &stage;
  for (int i = 0; i < moments; i++) {
    struct request r = {NULL, whole * rand() / RAND_MAX, 0.0};
    if (atlasfit_cancel_new(&r.token)) return 1;
    run.cancel = r.token;
    pthread_t thread;
    if (pthread_create(&thread, NULL, cancel, &r)) return 1;
    int32_t status = atlasfit_denoise(&points, NULL, &run, &result);
    const double end = now();
    pthread_join(thread, NULL);
    if (status == ATLASFIT_CANCELLED) late[cancelled++] = (struct cancelled){end - r.at, stage};
    else atlasfit_result_free(result);
    atlasfit_cancel_free(r.token);
  }
  qsort(late, (size_t)cancelled, sizeof *late, slowest_first);
  printf("%zu points, %.2f s whole; %d of %d cancelled in time", n, whole, cancelled, moments);
  if (cancelled) printf("; cancel to return: median %.0f ms", 1e3 * late[cancelled / 2].seconds);
  printf("\n");
  for (int i = 0; i < cancelled && i < 5; i++)
    printf("%5.0f ms  %s\n", 1e3 * late[i].seconds, atlasfit_stage_name(late[i].stage));
  free(late);
  free(xyz);
  return 0;
}
