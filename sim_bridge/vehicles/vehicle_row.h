/* vehicle_row.h: ROW worlds make one step side by side (../world/row.h), with the bits that each has alone. */
#ifndef VEHICLES_VEHICLE_ROW_H
#define VEHICLES_VEHICLE_ROW_H

#include "vehicle.h"

/* From motor signals that were sent to the next readings; `row`: numbers of ROW different worlds that run. */
void vehicle_row_step(vehicles *self, const size_t row[]);

#endif
