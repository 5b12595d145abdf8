/* sensor.c: see sensor.h. */
#include "sensor.h"

#include "geometry/hash.h"

uint64_t sensor_hash_beam(uint64_t sum, const beam *b) {
  const size_t rays = (size_t)b->rays;
  sum = HASH_NUMBERS(sum, b->x, b->y, b->height, b->middle_cosine, b->middle_sine);
  return hash_numbers(hash_numbers(hash_numbers(sum, b->fan.cosine, rays), b->fan.sine, rays), b->inward, rays);
}
