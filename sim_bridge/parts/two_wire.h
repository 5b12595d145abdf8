/* two_wire.h: the two-wire bus (I2C) with a device, seen from the device's side: START, bytes, acknowledgement, STOP.
 *
 * Both lines are open drain with pull-ups on the devices' boards. The bus watches the board's edges and moves SDA
 * TWO_WIRE_DELAY_CYCLES after SCL has fallen, at once, inside the board's run. A device never stretches the clock. The line
 * logic is here; a chip (compass.h) is the `two_wire_device` behind it.
 */
#ifndef PART_TWO_WIRE_H
#define PART_TWO_WIRE_H

#include "part.h"

#define TWO_WIRE_DELAY_CYCLES 5u /* 0.3 us, as the specification of the bus asks for */

typedef struct two_wire_device two_wire_device;

/* What a chip does when it is spoken to; `cycle`: when. */
typedef struct {
  /* Somebody is addressed (seven bits), to be read or written. Returns 1 if that is the chip. */
  int (*begin)(two_wire_device *self, uint8_t address, int reading, uint64_t cycle);
  /* It got a byte. Returns 1 to acknowledge it. */
  int (*write)(two_wire_device *self, uint8_t byte, uint64_t cycle);
  /* It is to send a byte. */
  uint8_t (*read)(two_wire_device *self, uint64_t cycle);
} two_wire_operations;

struct two_wire_device {
  const two_wire_operations *op;
};

typedef enum { TWO_WIRE_IDLE, TWO_WIRE_ADDRESS, TWO_WIRE_WRITE, TWO_WIRE_READ, TWO_WIRE_IGNORE } two_wire_phase;

typedef struct {
  part part;
  two_wire_device *device;
  uint8_t sda, scl; /* what the board does: 0 low, 1 let go */
  uint8_t pulling;  /* 1: a device holds SDA low */
  two_wire_phase phase;
  uint8_t bit; /* of the byte under way: 0..7 data, 8 acknowledgement */
  uint8_t shift;
} two_wire;

/* A part that begins with a bus, whose `edge` is two_wire_edge; pins: SDA, SCL. */
void two_wire_init(two_wire *self, const part_operations *op, const part_place *place, const uint8_t *pins,
                   two_wire_device *device);
void two_wire_edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level);

#endif
