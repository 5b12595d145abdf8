/* touch.h: a whisker of a robot without a board: a segment on the body that reads 1 while it touches something.
 */
#ifndef SENSORS_TOUCH_H
#define SENSORS_TOUCH_H

#include "sensor.h"

#define WHISKER_HEIGHT_M 0.03 /* above the floor: what is lower does not bend it */

/* python: begin */
typedef struct {
  double root_x, root_y, tip_x, tip_y; /* in the body's frame, m */
} touch_parameters;

extern const sensor_kind touch_sensor;
/* python: end */

#endif
