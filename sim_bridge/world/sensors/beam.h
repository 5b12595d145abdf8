/* beam.h: what sensors that look have in common: where the body that carries them is, and a beam made of rays.
 *
 * Poses by (3.9), directions by (3.10), (3.11) of the notes. A ray's direction in the body's frame does not change, so its
 * sine and cosine are computed once and turned with the body's.
 */
#ifndef SENSORS_BEAM_H
#define SENSORS_BEAM_H

#include "../noise.h"
#include "geometry/scene.h"

#define BEAM_RAYS 32

/* python: begin */
/* The body that carries a sensor, and what is around it. */
typedef struct {
  const scene *around;
  double x, y, heading, cosine, sine;
  uint32_t id; /* of the body among the movers, which its sensors do not see; 0: none */
} viewpoint;

/* Where a sensor is on the body and what it sees: x forward, y left of the axle's middle. */
typedef struct {
  double x, y;    /* m */
  double heading; /* rad, of the beam's middle */
  double opening; /* rad, full */
  double height;  /* m above the floor */
  int rays;       /* 1 to 32, spread evenly over the opening, the first on the right */
} beam_parameters;

typedef struct {
  double x, y, height;
  int rays;
  ray_fan fan;       /* of the rays in the body's frame */
  double inward[32]; /* cosine of each ray's angle to the beam's middle, (3.14) */
  double middle_cosine, middle_sine;
} beam;

/* 0, or -1 if a number is not finite, the opening not in [0, pi] or the rays not 1 to 32. */
int beam_init(beam *self, const beam_parameters *parameters);
/* python: end */

typedef struct {
  double x, y;
} beam_origin;

/* (3.9) */
static inline beam_origin beam_from(const beam *self, const viewpoint *from) {
  return (beam_origin){.x = from->x + self->x * from->cosine - self->y * from->sine,
                       .y = from->y + self->x * from->sine + self->y * from->cosine};
}

/* Direction of ray i in the world. */
static inline void beam_direction(const beam *self, const viewpoint *from, int i, double *cosine, double *sine) {
  *cosine = from->cosine * self->fan.cosine[i] - from->sine * self->fan.sine[i];
  *sine = from->sine * self->fan.cosine[i] + from->cosine * self->fan.sine[i];
}

/* Distance along ray i from the beam's origin, -1 if nothing is nearer than `reach`; `hit` may be NULL. */
static inline double beam_ray(const beam *self, const viewpoint *from, beam_origin at, int i, double reach,
                              ray_hit *hit) {
  double cosine, sine;
  beam_direction(self, from, i, &cosine, &sine);
  return scene_ray(from->around, at.x, at.y, cosine, sine, reach, self->height, from->id, hit);
}

/* Distances along all rays, as beam_ray; room for a multiple of 4. */
static inline void beam_rays(const beam *self, const viewpoint *from, double reach, double *distances) {
  const beam_origin at = beam_from(self, from);
  const fan_question question = {.where = from->around->arena,
                                 .rays = &self->fan,
                                 .x = at.x,
                                 .y = at.y,
                                 .cosine = from->cosine,
                                 .sine = from->sine,
                                 .reach = reach,
                                 .height = self->height,
                                 .distances = distances};
  scene_fan(from->around, &question, from->id);
}

/* A source whose next draws are those of `step`, at most 1024 per step: a reading is a function of key and step alone. */
static inline uint64_t noise_first(uint64_t step) { return step << 10; }
static inline void noise_at(noise_source *self, uint64_t step) { self->step = noise_first(step); }

#endif
