/* two_wire.c: see two_wire.h. */
#include "two_wire.h"

static void pull(two_wire *self, int low, uint64_t cycle) {
  if (self->pulling == low) return;
  self->pulling = (uint8_t)low;
  part_drive(&self->part, cycle + TWO_WIRE_DELAY_CYCLES, self->part.pins[0].pin, low ? BOARD_LOW : BOARD_HIGH);
}

/* The eight bits of an address are in: 1 if somebody has it. */
static int take_address(two_wire *self, uint64_t cycle) {
  const int reading = self->shift & 1;
  const int is_its = self->device->op->begin(self->device, self->shift >> 1, reading, cycle);
  self->phase = !is_its ? TWO_WIRE_IGNORE : reading ? TWO_WIRE_READ : TWO_WIRE_WRITE;
  return is_its;
}

static void next_byte(two_wire *self, uint64_t cycle) {
  self->bit = 0;
  self->shift = self->phase == TWO_WIRE_READ ? self->device->op->read(self->device, cycle) : 0;
}

/* SCL has fallen: the next bit is put on SDA, whose clock is to come. */
static void on_fall(two_wire *self, uint64_t cycle) {
  if (self->bit == 8 && self->phase == TWO_WIRE_ADDRESS) {
    pull(self, take_address(self, cycle), cycle);
    return;
  }
  if (self->bit == 8 && self->phase == TWO_WIRE_WRITE) {
    pull(self, self->device->op->write(self->device, self->shift, cycle), cycle);
    return;
  }
  if (self->bit == 9) next_byte(self, cycle);
  if (self->phase == TWO_WIRE_READ && self->bit < 8) {
    pull(self, !(self->shift >> (7 - self->bit) & 1), cycle);
  } else {
    pull(self, 0, cycle);
  }
}

/* SCL has risen: SDA is read. */
static void on_rise(two_wire *self) {
  if (self->phase == TWO_WIRE_IDLE || self->phase == TWO_WIRE_IGNORE) return;
  if (self->bit < 8 && self->phase != TWO_WIRE_READ) self->shift = (uint8_t)(self->shift << 1 | self->sda);
  if (self->bit == 8 && self->phase == TWO_WIRE_READ && self->sda && !self->pulling) {
    self->phase = TWO_WIRE_IGNORE; /* the board does not acknowledge: that was the last byte */
  }
  self->bit++;
}

static void begin_or_end(two_wire *self, uint64_t cycle) {
  self->phase = self->sda ? TWO_WIRE_IDLE : TWO_WIRE_ADDRESS;
  self->bit = self->shift = 0;
  pull(self, 0, cycle);
}

void two_wire_edge(part *base, uint64_t cycle, uint8_t pin, uint8_t level) {
  two_wire *self = (two_wire *)base;
  const uint8_t high = level != BOARD_LOW;
  uint8_t *line = pin == self->part.pins[0].pin ? &self->sda : &self->scl;
  if (*line == high) return;
  *line = high;
  if (pin == self->part.pins[0].pin) {
    if (self->scl && !self->pulling) begin_or_end(self, cycle); /* START or STOP */
  } else if (high) {
    on_rise(self);
  } else if (self->phase != TWO_WIRE_IDLE) {
    on_fall(self, cycle);
  }
}

void two_wire_init(two_wire *self, const part_operations *op, const part_place *place, const uint8_t *pins,
                   two_wire_device *device) {
  const uint8_t role = PART_HEARS | PART_DRIVES | PART_PULLED_UP;
  part_join(&self->part, op, place, (part_pin[]){{pins[0], role}, {pins[1], role}}, 2);
  self->device = device;
  self->sda = self->scl = 1;
  part_drive(&self->part, 0, pins[0], BOARD_HIGH);
  part_drive(&self->part, 0, pins[1], BOARD_HIGH);
}
