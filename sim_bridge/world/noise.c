/* noise.c: a counter-based generator (each word of the key is folded in by a 64-bit finaliser) and the Box-Muller
 * transform on top of it. */
#include "noise.h"

#include <math.h>

#include "numbers.h"

static uint64_t mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

uint64_t noise_bits(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step) {
  const uint64_t who = ((uint64_t)robot << 32) | device;
  return mix(mix(mix(seed) ^ who) ^ step);
}

static double unit(uint64_t bits) { return (double)(bits >> 11) * 0x1p-53; }

double noise_uniform(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step) {
  return unit(noise_bits(seed, robot, device, step));
}

double noise_normal(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step) {
  const uint64_t bits = noise_bits(seed, robot, device, step);
  const double radius = sqrt(-2.0 * number_log(1.0 - unit(bits))); /* sqrt is exact by IEEE 754 */
  double sine, cosine;
  number_sincos(2.0 * NUMBERS_PI * unit(mix(bits)), &sine, &cosine);
  return radius * cosine;
}

double noise_next_uniform(noise_source *self) {
  if (!self->on) return 0.5;
  return noise_uniform(self->seed, self->robot, self->device, self->step++);
}

double noise_next_normal(noise_source *self) {
  if (!self->on) return 0.0;
  return noise_normal(self->seed, self->robot, self->device, self->step++);
}
