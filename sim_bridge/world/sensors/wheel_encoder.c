/* wheel_encoder.c: see wheel_encoder.h. */
#include "wheel_encoder.h"

#include <math.h>

#include "geometry/numbers.h"

#define STAMP_S 16e-6
#define PERIOD_LONGEST 31250.0 /* 0.5 s in stamps */
#define EDGES_MAXIMUM 1e5      /* in a step */
#define INDEX_MAXIMUM 1e15

typedef struct {
  double begun;    /* 1: the phase is drawn */
  double phase;    /* edges, in [0, 1) */
  double position; /* edges, at the end of the last step */
  double index;    /* of the last edge passed */
  double hidden;   /* 1: the last one was missed, so that the next one changes nothing */
  double count;    /* of edges seen */
  double last;     /* stamp of the last one seen */
  double gap;      /* stamps between the last two */
} kept;

int wheel_encoder_pass(double before, double after, long long *index, double *share) {
  const int way = after >= (double)(*index + 1) ? 1 : (after < (double)*index ? -1 : 0);
  if (way == 0) return 0;
  const double border = (double)(way > 0 ? *index + 1 : *index);
  *share = (border - before) / (after - before);
  if (!(*share > 0.0)) *share = 0.0;
  if (*share > 1.0) *share = 1.0;
  *index += way;
  return way;
}

static double position_of(const wheel_encoder_parameters *p, const kept *k, const sensing *s) {
  const double angle = p->right ? s->body->state.wheel_right : s->body->state.wheel_left;
  return angle * p->edges_per_turn / (2.0 * NUMBERS_PI) + k->phase;
}

static void see(const wheel_encoder_parameters *p, kept *k, int way, double stamp, noise_source *noise) {
  const int was_hidden = k->hidden != 0.0;
  k->hidden = !was_hidden && p->missed > 0.0 && noise_next_uniform(noise) < p->missed;
  if (was_hidden || k->hidden != 0.0) return;
  k->count += p->directed ? way : 1;
  k->gap = stamp - k->last;
  k->last = stamp;
}

static void step(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise) {
  const wheel_encoder_parameters *p = self;
  kept *k = (kept *)memory->numbers;
  const double before = k->position, after = position_of(p, k, s);
  long long index = (long long)k->index;
  k->position = after;
  if (!(fabs(after - before) < EDGES_MAXIMUM && fabs(after) < INDEX_MAXIMUM)) { /* no disc turns as fast or as far */
    if (fabs(after) < INDEX_MAXIMUM) k->index = floor(after);
    return;
  }
  double share;
  for (int way; (way = wheel_encoder_pass(before, after, &index, &share)) != 0;)
    see(p, k, way, floor((s->time - (1.0 - share) * s->dt) / STAMP_S), noise);
  k->index = (double)index;
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const wheel_encoder_parameters *p = self;
  kept *k = (kept *)memory->numbers;
  if (k->begun == 0.0) {
    k->begun = 1.0;
    k->phase = noise_next_uniform(noise); /* 0.5 without noise */
    k->position = position_of(p, k, s);
    k->index = (double)number_floor(k->position);
    k->last = -PERIOD_LONGEST;
  }
  const int is_known = k->gap < PERIOD_LONGEST && s->time / STAMP_S - k->last < PERIOD_LONGEST;
  readings[0] = k->count;
  readings[1] = is_known ? fmax(k->gap, 1.0) : 0.0;
}

const sensor_kind wheel_encoder_sensor = {.noise = 13,
                                          .size = sizeof(wheel_encoder_parameters),
                                          .numbers = sizeof(kept) / sizeof(double),
                                          .readings = 2,
                                          .step = step,
                                          .read = read};
