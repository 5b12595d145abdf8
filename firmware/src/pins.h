/* pins.h: the pin map that this image is built for. Chosen by -DPIN_MAP_SHIELDBOT, -DPIN_MAP_SHIELDBOT_QUAD or
 * -DPIN_MAP_BOEBOT; the maps are generated from protocol/robots/. */
#ifndef PINS_H
#define PINS_H

#if defined(PIN_MAP_SHIELDBOT)
#include "generated/pins_shieldbot.h"
#elif defined(PIN_MAP_SHIELDBOT_QUAD)
#include "generated/pins_shieldbot_quad.h"
#elif defined(PIN_MAP_BOEBOT)
#include "generated/pins_boebot.h"
#else
#error "choose a pin map: -DPIN_MAP_SHIELDBOT, -DPIN_MAP_SHIELDBOT_QUAD or -DPIN_MAP_BOEBOT"
#endif

/* The sides of the robot, as indices. */
enum { LEFT = 0, RIGHT = 1, SIDES = 2 };

#endif
