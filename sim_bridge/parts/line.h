/* line.h: a line sensor (Parallax QTI): a phototransistor that looks at the floor and discharges a capacitor (capacitor.h),
 * the sooner, the brighter the floor. */
#ifndef PART_LINE_H
#define PART_LINE_H

#include "../world/sensors/line.h"
#include "capacitor.h"

/* python: begin */
typedef struct {
  reflectance_parameters floor;
  capacitor_parameters capacitor;
  double decay_s; /* from the full charge to the threshold over a floor that throws all light back */
} line_part_parameters;

/* Parameters: line_part_parameters. Pin: the capacitor. */
extern const part_kind line_kind;
/* python: end */

#endif
