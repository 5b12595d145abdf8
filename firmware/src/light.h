/* light.h: light sensors, read by the time in which a phototransistor discharges a capacitor (Robotics with the Board of
 * Education Shield, chapter 6): charge for a slot, let go, and take the time until the input reads low: the brighter, the
 * shorter. Both sides at once, once in each servo frame (20 ms): charged in its last slot, let go in its first.
 *
 * Nothing waits for the edge: the right line's is stamped by the pin change of port D, the left one's by the encoders' pin
 * change of port C, which sees that line during the measurement only. */
#ifndef LIGHT_H
#define LIGHT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LIGHT_LONGEST 14000u /* us */

void light_start(void);

/* In every slot. */
void light_task(void) __attribute__((noinline));

/* Decay time of a side in us, 1 to LIGHT_LONGEST (so long or longer); 0: none, or no sensor. */
uint16_t light_read(uint8_t side);

/* Ticks since the end of the measurement; 255: none yet, or older. */
uint8_t light_age(void);

#ifdef __cplusplus
}
#endif

#endif
