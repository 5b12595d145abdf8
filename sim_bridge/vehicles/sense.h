/* sense.h: the first stage of a step: all sensors of one world take what is due. */
#ifndef VEHICLES_SENSE_H
#define VEHICLES_SENSE_H

#include "vehicle.h"

/* Each sensor's place for the numbers that it keeps. */
void vehicle_sensors_give_numbers(vehicles *self);

/* Room to work in for the sensors of world `i` that need it; 0 without memory. */
int vehicle_sensors_find_room(vehicles *self, size_t i);
void vehicle_sensors_free_room(vehicles *self); /* of all worlds; the model may be gone already */

/* Sensors at the beginning of a run. */
void vehicle_sensors_start(vehicles *self, size_t i);

/* Where its body is, and what is around it. */
static inline viewpoint vehicle_viewpoint(const vehicle *self) {
  const body_state *b = &self->body.state;
  return (viewpoint){.around = &self->in->around,
                     .x = b->x,
                     .y = b->y,
                     .heading = b->heading,
                     .cosine = b->cosine,
                     .sine = b->sine,
                     .id = self->state.id};
}

#endif
