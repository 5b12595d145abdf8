/* pins.h: the pin map that this image is built for, chosen by a -DPIN_MAP_...; the maps are generated from protocol/robots/. */
#ifndef PINS_H
#define PINS_H

#if defined(PIN_MAP_SHIELDBOT)
#include "generated/pins_shieldbot.h"
#elif defined(PIN_MAP_SHIELDBOT_BASIC)
#include "generated/pins_shieldbot_basic.h"
#elif defined(PIN_MAP_SHIELDBOT_QUAD)
#include "generated/pins_shieldbot_quad.h"
#elif defined(PIN_MAP_BOEBOT)
#include "generated/pins_boebot.h"
#else
#error "choose a pin map: -DPIN_MAP_SHIELDBOT, ..._SHIELDBOT_BASIC, ..._SHIELDBOT_QUAD or ..._BOEBOT"
#endif

/* Pin 8 is the timer's capture pin: the Ping's, or the left light sensor's. */
#if defined(PIN_LIGHT_LEFT) && PIN_LIGHT_LEFT == 8
#define LIGHT_LEFT_IS_CAPTURED
#endif

/* The sides of the robot, as indices. */
enum { LEFT = 0, RIGHT = 1, SIDES = 2 };

#endif
