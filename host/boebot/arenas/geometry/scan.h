/* scan.h: the fan of a laser range finder, all beams from one point at once.
 *
 * The work goes by edges, not by beams: an edge that faces the sensor covers an interval of beams, and in each of them
 * the nearest edge wins. Beams at the ends of an interval are asked exactly, so that no crack opens between neighbours.
 * What is farther than what every beam has met already is left out.
 * Agrees with scene_ray, except that from inside a closed shape that shape is seen from inside only. Lengths in m,
 * angles in rad.
 */
#ifndef GEOMETRY_SCAN_H
#define GEOMETRY_SCAN_H

#include <stddef.h>
#include <stdint.h>

#include "scene.h"

/* python: begin */
typedef struct scan_fan scan_fan;

/* `count` beams of equal spacing from the angle `first` to `last` of the sensor's frame, first < last <= first + 2 pi.
 * NULL without memory, with less than 2 beams, or with such angles. A fan serves one thread at a time. */
scan_fan *scan_fan_new(double first, double last, size_t count);
void scan_fan_destroy(scan_fan *self);

/* Distances from (x, y) along all beams, the sensor's x axis pointing to (cosine, sine): -1 where nothing is nearer than
 * `reach`. Things lower than `height` and the mover `self_id` are not seen. */
void scan_look(scan_fan *self, const scene *around, double x, double y, double cosine, double sine, double reach,
               double height, uint32_t self_id, double *distances);
/* python: end */

#endif
