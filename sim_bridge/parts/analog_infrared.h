/* analog_infrared.h: Sharp GP2Y0A21 / GP2D12 at an analog pin: its voltage at the instant of the converter's sample
 * (world/sensors/sharp_infrared: curve with fold-back, a new value every 38 ms, 7.6 ms late).
 */
#ifndef PART_ANALOG_INFRARED_H
#define PART_ANALOG_INFRARED_H

#include "../world/sensors/sharp_infrared.h"
#include "part.h"

typedef struct {
  part part;
  sharp_infrared sensor;
  sharp_infrared_state state;
} analog_infrared;

/* python: begin */
/* Parameters: sharp_infrared_parameters. Pin: an analog one. */
extern const part_kind analog_infrared_kind;
/* python: end */

#endif
