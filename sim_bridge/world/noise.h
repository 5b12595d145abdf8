/* noise.h: random numbers without a state.
 *
 * A draw is a function of (seed, robot, device, step) and of nothing else: no order of calls, thread or batch can change
 * it, and a device keeps its own sequence whatever the others draw. Normal draws serve (3.1).
 */
#ifndef WORLD_NOISE_H
#define WORLD_NOISE_H

#include <stdint.h>

/* python: begin */
/* 64 well-mixed bits. */
uint64_t noise_bits(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step);

/* Uniform in [0, 1). */
double noise_uniform(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step);

/* Normal with mean 0 and standard deviation 1. */
double noise_normal(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step);
/* python: end */

/* A device's own sequence: each draw takes the next step. */
typedef struct {
  uint64_t seed;
  uint32_t robot;
  uint32_t device;
  uint64_t step;
  int on; /* 0: uniform gives 0.5 and normal gives 0, always */
} noise_source;

double noise_next_uniform(noise_source *self);
double noise_next_normal(noise_source *self);

#endif
