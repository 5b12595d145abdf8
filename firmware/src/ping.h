/* ping.h: the Ping))) distance sensor on the input-capture pin. Every ping_period ticks a 5 us trigger; after 750 us the
 * sensor raises the same pin for as long as the sound travels, 115 us to 18.5 ms. Both edges are captured by the timer;
 * without an echo the reading is given up 20 ms after the trigger. What is shorter than any echo counts as none. */
#ifndef PING_H
#define PING_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void ping_start(void);

/* Once per tick: ends readings and triggers the next one. */
void ping_task(void) __attribute__((noinline));

/* Once per tick, before the next two: takes over an echo that has ended. */
void ping_collect(void);

/* Length of the last echo in us; 0: none. */
uint16_t ping_echo(void);

/* Ticks since it ended or was given up; 255: never or older. */
uint8_t ping_age(void);

#ifdef __cplusplus
}
#endif

#endif
