/* laser.c: see laser.h. */
#include "laser.h"

#include <math.h>
#include <stdlib.h>

#include "geometry/numbers.h"

struct laser {
  laser_parameters parameters;
  beam mount;    /* one ray, along the fan's middle */
  scan_fan *fan; /* NULL with a single ray */
};

laser *laser_new(const laser_parameters *p) {
  laser *self = calloc(1, sizeof *self);
  if (self == NULL) return NULL;
  const double heading = p->rays > 1 ? p->heading : p->heading + p->first;
  const beam_parameters mount = {.x = p->x, .y = p->y, .heading = heading, .height = p->height, .rays = 1};
  self->parameters = *p;
  if (p->rays > 1) self->fan = scan_fan_new(p->first, p->first + (p->rays - 1) * p->step, (size_t)p->rays);
  if ((p->rays > 1 && self->fan == NULL) || beam_init(&self->mount, &mount)) {
    laser_destroy(self);
    return NULL;
  }
  return self;
}

void laser_destroy(laser *self) {
  if (self == NULL) return;
  scan_fan_destroy(self->fan);
  free(self);
}

void laser_scan(laser *self, const viewpoint *from, noise_source *noise, double *distances) {
  const laser_parameters *p = &self->parameters;
  const size_t rays = (size_t)p->rays;
  const beam_origin at = beam_from(&self->mount, from);
  if (self->fan == NULL) {
    distances[0] = beam_ray(&self->mount, from, at, 0, p->range, NULL);
  } else {
    double cosine, sine;
    beam_direction(&self->mount, from, 0, &cosine, &sine);
    scan_look(self->fan, from->around, at.x, at.y, cosine, sine, p->range, p->height, from->id, distances);
  }
  if (p->sigma <= 0.0 || !noise->on) return;
  double draws[LASER_RAYS];
  noise_next_normals(noise, draws, rays); /* also where nothing is seen: each ray keeps its own sequence */
  const double sigma = p->sigma;
  const double range = p->range;
  for (size_t i = 0; i < rays; i++) {
    const double noisy = distances[i] * (1.0 + sigma * draws[i]); /* (3.1) */
    const double positive = noisy > 0.0 ? noisy : 0.0;
    const double seen = positive < range ? positive : range;
    distances[i] = distances[i] >= 0.0 ? seen : distances[i];
  }
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static size_t make(void *self, const void *parameters) {
  const laser_parameters *p = parameters;
  *(laser_parameters *)self = *p;
  return (size_t)p->rays;
}

static void *work(const void *self) { return laser_new(self); }
static void free_work(void *work) { laser_destroy(work); }

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  laser_scan(memory->work, &s->from, noise, readings);
}

const sensor_kind laser_sensor = {
    .noise = 4, .size = sizeof(laser_parameters), .make = make, .work = work, .free_work = free_work, .read = read};
