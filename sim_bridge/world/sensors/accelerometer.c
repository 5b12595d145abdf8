/* accelerometer.c: see accelerometer.h. */
#include "accelerometer.h"

void accelerometer_step(const accelerometer_parameters *p, accelerometer_state *s, double acceleration, double dt) {
  const double k = p->stiffness / p->mass;
  const double c = p->damping / p->mass;
  /* v' = v + dt (a - c v' - k z') with z' = z + dt v' */
  s->speed = (s->speed + dt * (acceleration - k * s->deflection)) / (1.0 + dt * c + dt * dt * k);
  s->deflection += dt * s->speed;
  const double stop = p->range / k;
  if (s->deflection > stop || s->deflection < -stop) {
    s->deflection = s->deflection > 0.0 ? stop : -stop;
    s->speed = 0.0;
  }
}

double accelerometer_read(const accelerometer_parameters *p, const accelerometer_state *s, noise_source *noise) {
  const double a = p->stiffness * s->deflection / p->mass + p->bias;
  return p->sigma > 0.0 ? a + p->sigma * noise_next_normal(noise) : a;
}

/* ---- of a robot without a board ----------------------------------------------------------------------------------- */

static void step(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise) {
  accelerometer_step(self, (accelerometer_state *)memory->numbers, s->acceleration, s->dt);
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  *readings = accelerometer_read(self, (const accelerometer_state *)memory->numbers, noise);
}

const sensor_kind accelerometer_sensor = {
    .noise = 6, .size = sizeof(accelerometer_parameters), .numbers = 2, .readings = 1, .step = step, .read = read};
