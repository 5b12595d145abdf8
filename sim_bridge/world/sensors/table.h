/* table.h: a sensor known by its table of readings (table_noise.h): by distance and angle of incidence of the nearest thing
 * that its rays meet.
 */
#ifndef SENSORS_TABLE_H
#define SENSORS_TABLE_H

#include "sensor.h"
#include "table_noise.h"

/* python: begin */
typedef struct {
  beam_parameters beam;
  const table_noise *table; /* stays the caller's */
  double reach;             /* m */
  double none;              /* the reading where nothing is nearer */
} table_parameters;

extern const sensor_kind table_sensor;
/* python: end */

#endif
