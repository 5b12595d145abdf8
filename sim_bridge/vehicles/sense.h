/* sense.h: the first stage of a step: all sensors of one world take what is due. */
#ifndef VEHICLES_SENSE_H
#define VEHICLES_SENSE_H

#include "vehicle.h"

/* Readings of world `i` after its present step; does nothing when they are there already. */
void vehicle_sense(vehicles *self, size_t i);

/* Sensors at the beginning of a run. */
void vehicle_sensors_start(vehicles *self, size_t i);

#endif
