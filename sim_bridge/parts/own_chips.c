/* own_chips.c: see own_chips.h. */
#include "own_chips.h"

#include <stddef.h>

typedef struct {
  two_wire bus;
  two_wire_device device;
  own_chips_parameters asked;
} own_chips;

static int ask(two_wire_device *device, int does, uint8_t byte, uint64_t cycle) {
  const own_chips *self = (own_chips *)(void *)((char *)device - offsetof(own_chips, device));
  return self->asked.answer(self->asked.context, does, byte, cycle);
}

static int begin(two_wire_device *device, uint8_t address, int reading, uint64_t cycle) {
  return ask(device, OWN_CHIP_BEGIN, (uint8_t)(address << 1 | reading), cycle);
}

static int write(two_wire_device *device, uint8_t byte, uint64_t cycle) {
  return ask(device, OWN_CHIP_WRITE, byte, cycle);
}

static uint8_t read(two_wire_device *device, uint64_t cycle) { return (uint8_t)ask(device, OWN_CHIP_READ, 0, cycle); }

static const two_wire_operations CHIPS = {.begin = begin, .write = write, .read = read};
static const part_operations OPERATIONS = {.edge = two_wire_edge};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  own_chips *self = (own_chips *)base;
  two_wire_init(&self->bus, &OPERATIONS, place, pins, &self->device);
  self->device.op = &CHIPS;
  self->asked = *(const own_chips_parameters *)parameters;
  return 0;
}

const part_kind own_chips_kind = {.size = sizeof(own_chips), .noise = 0, .pins = 2, .init = init};
