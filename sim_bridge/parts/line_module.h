/* line_module.h: a line sensor of a reflex coupler and a resistor (TCRT5000, ITR20001 modules): the brighter the floor, the
 * lower the voltage between them.
 *
 * The phototransistor pulls the node down from the supply by a current in proportion to the floor's reflectance; it
 * saturates at some 0.3 V. An analog output is that voltage. A digital one is a comparator's (LM393), against the module's
 * potentiometer, with a little hysteresis. Fault: dirty, a share of the light is lost.
 */
#ifndef PART_LINE_MODULE_H
#define PART_LINE_MODULE_H

#include "../world/sensors/line.h"
#include "part.h"

/* python: begin */
typedef struct {
  reflectance_parameters floor;
  double slope;               /* by which a reflectance of 1 lowers the voltage, parts of the supply */
  double threshold;           /* of the comparator, parts of the supply */
  double hysteresis;          /* to either side */
  int dark_level, is_digital; /* LOW or HIGH over a dark floor; 1: behind the comparator */
} line_module_parameters;

/* Shows the voltage, V, and 1 over a dark floor by the comparator. Parameters: line_module_parameters. Pin: the output. */
extern const part_kind line_module_kind;
/* python: end */

#endif
