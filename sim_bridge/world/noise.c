/* noise.c: see noise.h. A counter-based generator (each word of the key is folded in by a 64-bit finaliser), and the rare
 * cases of the ziggurat. */
#include "noise.h"

#include "generated/noise_layers.h"
#include "geometry/numbers.h"

#define UNITS UINT64_C(0x756e697473000000) /* the seed of units' peculiarities: no run has it by chance */

uint64_t noise_bits(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step) {
  return hash_mix(noise_key(seed, robot, device) ^ step);
}

double noise_normal(uint64_t seed, uint32_t robot, uint32_t device, uint64_t step) {
  return noise_normal_of(noise_bits(seed, robot, device, step));
}

double unit_normal(uint64_t serial, uint32_t kind, uint32_t what) {
  return serial == 0 ? 0.0 : noise_normal(UNITS ^ serial, kind, what, 0);
}

/* Beyond edge 1: the tail's exponential bound, thinned out to the bell. */
static double tail(uint64_t bits, int negative) {
  const double begin = noise_layer_edges[1];
  double x, y;
  do {
    bits = hash_mix(bits);
    x = -number_log(1.0 - noise_unit(bits)) / begin;
    bits = hash_mix(bits);
    y = -number_log(1.0 - noise_unit(bits));
  } while (y + y < x * x);
  return negative ? -(begin + x) : begin + x;
}

/* How high the bell is, 1 in its middle. */
static double bell(double x) { return number_exp(-0.5 * x * x); }

double noise_normal_outside(uint64_t bits) {
  for (;;) {
    const unsigned layer = (unsigned)(bits & (NOISE_LAYERS - 1));
    const double *edge = &noise_layer_edges[layer];
    const double x = ((double)(int64_t)(bits >> 11) * 0x1p-52 - 1.0) * edge[0];
    if (fabs(x) < edge[1]) return x;
    if (layer == 0) return tail(bits, x < 0.0);
    /* Within the layer, from its lower border, where the bell is at edge[0], to its upper one. */
    const double low = bell(edge[0]);
    bits = hash_mix(bits);
    if (low + noise_unit(bits) * (bell(edge[1]) - low) < bell(x)) return x;
    bits = hash_mix(bits);
  }
}
