/* noise.h: random numbers without a state.
 *
 * A draw is a function of (seed, robot, device, step) and of nothing else: no order of calls, thread or batch can change
 * it, and a device keeps its own sequence whatever the others draw. Normal draws serve (3.1). They come from 256 layers
 * of equal area under the bell (the ziggurat): one mix of bits, one look into a table and one product for 98.8 % of them.
 */
#ifndef WORLD_NOISE_H
#define WORLD_NOISE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "geometry/hash.h"

/* python: begin */
/* 64 well-mixed bits. */
uint64_t noise_bits(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step);

/* Normal with mean 0 and standard deviation 1. */
double noise_normal(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step);

/* What a device keeps from run to run, keyed by its serial number and not by the run's seed: standard normal draw of quantity
 * `what` of unit `serial` of a kind of device; 0 for serial 0, the nominal unit. */
double unit_normal(uint64_t serial, uint32_t kind, uint32_t what);

enum { NOISE_LAYERS = 256 };

/* Layer i of the bell is as wide as edge i; edge 256 is 0. */
extern const double noise_layer_edges[NOISE_LAYERS + 1];

/* A device's own sequence: each draw takes the next step. */
typedef struct {
  uint64_t seed;
  uint32_t robot;
  uint32_t device;
  uint64_t step;
  uint64_t key; /* of the three, once `keyed` */
  uint8_t keyed;
  uint8_t on; /* 0: uniform gives 0.5 and normal gives 0, always */
} noise_source;
/* python: end */

/* What the steps of one device are mixed with. */
static inline uint64_t noise_key(uint64_t seed, uint32_t robot, uint32_t device) {
  return hash_mix(hash_mix(seed) ^ (((uint64_t)robot << 32) | device));
}

static inline double noise_unit(uint64_t bits) { return (double)(bits >> 11) * 0x1p-53; }

/* The rare draw that falls outside the rectangle within its layer. */
double noise_normal_outside(uint64_t bits);

/* Normal draw from 64 mixed bits: the low 8 choose the layer, the high 53 the place in it. */
static inline double noise_normal_of(uint64_t bits) {
  const double *edge = &noise_layer_edges[bits & (NOISE_LAYERS - 1)];
  const double x = ((double)(int64_t)(bits >> 11) * 0x1p-52 - 1.0) * edge[0];
  if (fabs(x) < edge[1]) return x;
  return noise_normal_outside(bits);
}

static inline uint64_t noise_next_bits(noise_source *self) {
  if (!self->keyed) {
    self->key = noise_key(self->seed, self->robot, self->device);
    self->keyed = 1;
  }
  return hash_mix(self->key ^ self->step++);
}

static inline double noise_next_uniform(noise_source *self) {
  return self->on ? noise_unit(noise_next_bits(self)) : 0.5;
}

static inline double noise_next_normal(noise_source *self) {
  return self->on ? noise_normal_of(noise_next_bits(self)) : 0.0;
}

/* What `count` calls of noise_next_normal give. */
static inline void noise_next_normals(noise_source *self, double *draws, size_t count) {
  noise_source source = *self; /* which no draw can overwrite */
  for (size_t i = 0; i < count; i++) draws[i] = noise_next_normal(&source);
  *self = source;
}

#endif
