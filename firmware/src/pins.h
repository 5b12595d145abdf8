/* pins.h: the pin map that this image is built for, chosen by a -DPIN_MAP_... (generated/pin_map.h, made from
 * protocol/robots), and what follows from it. */
#ifndef PINS_H
#define PINS_H

#include "generated/pin_map.h"

/* Pin 8 is the timer's capture pin: the Ping's, or the left light sensor's. */
#if defined(PIN_LIGHT_LEFT) && PIN_LIGHT_LEFT == 8
#define LIGHT_LEFT_IS_CAPTURED
#endif

/* The sides of the robot, as indices. */
enum { LEFT = 0, RIGHT = 1, SIDES = 2 };

#endif
