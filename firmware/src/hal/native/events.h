/* events.h: the event queue of hal/native, shared by its files: each source of events has the cycle of its next one. A file
 * calls only those that stand before it here. */
#ifndef NATIVE_EVENTS_H
#define NATIVE_EVENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/native/machine.h"

/* At the same cycle they come in this order. */
typedef enum {
  EVENT_PIN, /* input edges and bytes are queued by the machine's owner */
  EVENT_BYTE,
  EVENT_CARRIER,    /* the next toggle of a LED */
  EVENT_EDGE,       /* Timer1's compare A */
  EVENT_SLOT,       /* and B */
  EVENT_ROOM,       /* a sender that asked for room has it */
  EVENT_CONVERSION, /* the end of one */
  EVENT_EEPROM,     /* the end of a write */
  EVENT_TONE,       /* the next toggle of the buzzer */
  EVENT_TWO_WIRE,   /* the next step of the bus */
  EVENTS
} native_event;

/* ---- clock_native.c */
extern native_machine *native;
extern uint64_t native_next[EVENTS]; /* NATIVE_NEVER: none */

/* The edge of the capture's pin has come. */
void native_capture_edge(bool rising);
void native_capture_reset(void);

/* ---- pins_native.c */

/* Works out the level on a pin; interrupts if it has changed. */
void native_settle(uint8_t pin);
void native_pins_reset(void); /* releases every pin */

/* Pins as the two-wire unit has them, its lines low or let go with the pull-up, and their level. */
void native_pull(uint8_t pin, bool low);
bool native_level(uint8_t pin);

/* ---- the devices, which build on clock and pins; chip.c calls all */

/* What each event does, and what a reset does to its source. */
void native_byte_arrived(void);
void native_carrier_toggle(void);
void native_conversion_done(void);
void native_eeprom_event(void);
void native_tone_toggle(void);
void native_two_wire_step(void);
void native_serial_reset(void);
void native_memory_reset(void);
void native_devices_reset(void);
void native_two_wire_reset(void);

#endif
