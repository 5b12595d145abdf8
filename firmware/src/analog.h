/* analog.h: the one owner of the analog converter (data sheet of the ATmega328P, 24): it measures the chip's bandgap for
 * the supply (supply.h), and in turn the battery's divider and the analog infra-red sensor, as far as they are on. In every
 * slot it makes one step: select an input, in a later slot convert, in a later slot read the result. So an input has a slot
 * to settle, and nothing waits. */
#ifndef ANALOG_H
#define ANALOG_H

#include <stdbool.h>
#include <stdint.h>

enum { ANALOG_BANDGAP, ANALOG_BATTERY, ANALOG_INFRARED, ANALOG_INPUTS };

/* Its pin becomes an input to be measured, or is pulled up. */
void analog_connect(uint8_t input, bool connected);

void analog_start(void);

/* The last result of an input, in 1/1024 of the supply, rounded down; 0 before the first. */
uint16_t analog_read(uint8_t input);

/* Its age in ticks; 255: none yet, or older, or switched off. */
uint8_t analog_age(uint8_t input);

/* The bandgap's last result; 0 when it was read before. */
uint16_t analog_take_bandgap(void);

#endif
