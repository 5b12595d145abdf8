/* sensor.h: what each kind of sensor of a robot without a board says about itself: how it is made, what it keeps, how it
 * reads. A kind is a `sensor_kind` in the sensor's own file; it is listed nowhere.
 *
 * A made sensor does not change and may serve any number of worlds; what it keeps from step to step is its memory in one
 * world. Its noise is keyed by its kind and its number among that kind, so that another sensor changes no draw.
 */
#ifndef SENSORS_SENSOR_H
#define SENSORS_SENSOR_H

#include <stddef.h>
#include <stdint.h>

#include "../body.h"
#include "beam.h"

/* What a sensor may use of its robot, after a step of the world. */
typedef struct {
  viewpoint from;
  body *body;
  double dt;           /* of a step, s */
  double time;         /* s */
  double acceleration; /* of the body along its heading in the step before, m/s^2 */
  double energy;       /* charge of the notes' battery, 0 to 1 */
  const void *robot;
  double (*motor_current)(const void *robot); /* of both motors, A */
} sensing;

/* What a sensor keeps in one world. */
typedef struct {
  double *numbers; /* a struct of doubles */
  void *work;      /* room to work in, without meaning from one reading to the next; NULL: needs none */
} sensor_memory;

typedef struct sensor_kind {
  uint32_t noise; /* part of the key of its draws, different for each kind, less than 1000 */
  size_t size;    /* bytes of a made sensor */
  size_t numbers; /* that it keeps */

  size_t readings; /* that it gives, where it is its parameters; else `make` says */

  /* Makes it of parameters within the ranges of its file in sim_bridge/devices, which the caller has checked; returns
   * how many readings it gives, or 0: they do not fit together. NULL: it is a copy of them. */
  size_t (*make)(void *self, const void *parameters);

  /* NULL where there is nothing to do. */
  double (*reach)(const void *self); /* how far it sticks out from the middle of the body, m */
  void *(*work)(const void *self);   /* new room to work in; NULL without memory */
  void (*free_work)(void *work);
  void (*start)(const void *self, sensor_memory *memory, const sensing *s);
  void (*step)(const void *self, sensor_memory *memory, const sensing *s,
               noise_source *noise); /* in each step but the first */

  void (*read)(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings);
} sensor_kind;

#endif
