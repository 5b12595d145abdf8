/* pin_changes.h: changes of the pins of port C, stamped by their interrupt and given, one after another, to the encoders and
 * the left light sensor.
 *
 * Noise must not take all the time: when five changes in a row come within 256 cycles of each other, or the ring is full,
 * the interrupt masks all pins. The main loop then masks those that made the noise until the next tick, and listens to the
 * others. Wheels that turn never do that: of four lines that each change once in 2,300 cycles or slower (69 edges in a
 * tick) no five changes are so close. */
#ifndef PIN_CHANGES_H
#define PIN_CHANGES_H

#include <stdint.h>

void pin_changes_start(void);

/* Not 0: a part of the ring waits, or the interrupt has masked the pins. */
uint8_t pin_changes_due(void);

/* Works off what waits, and listens to the pins that encoders and light sensor want now. Whenever it is due. */
void pin_changes_poll(void) __attribute__((noinline));

/* The same at the beginning of every slot's work: stamps of 16 bits roll over after 4 ms. In a tick's first slot masked pins are
 * listened to again from here on. */
void pin_changes_begin_slot(void);

#endif
