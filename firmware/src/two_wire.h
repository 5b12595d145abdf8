/* two_wire.h: the master of the two-wire bus (I2C; data sheet of the ATmega328P, 22, and its status codes): one transfer at a
 * time, carried on by the bus's interrupt. A transfer writes some bytes to a device and then reads some after a repeated
 * start. The driver that began it asks whether it has ended, and gives it up when it takes too long. */
#ifndef TWO_WIRE_H
#define TWO_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#define TWO_WIRE_WRITE_MAX 4u
#define TWO_WIRE_READ_MAX 6u

typedef enum {
  TWO_WIRE_BUSY,
  TWO_WIRE_OK,
  TWO_WIRE_NO_ANSWER, /* nobody has that address */
  TWO_WIRE_FAILED,    /* a byte was refused, arbitration lost, or a bus error */
} two_wire_result;

/* Switches the bus on. */
void two_wire_start(void);

/* Begins a transfer; none may be under way. The bytes are copied. */
void two_wire_begin(uint8_t address, const uint8_t *bytes, uint8_t to_write, uint8_t to_read);

/* How the last transfer ended. */
two_wire_result two_wire_ended(void);

/* The bytes that it has read; while it is not busy. */
const volatile uint8_t *two_wire_bytes(void);

/* Switches the bus off and lets both lines go; a transfer under way has failed. */
void two_wire_stop(void);

#endif
