/* compass.c: see compass.h. */
#include "compass.h"

#include <math.h>
#include <string.h>

#include "geometry/numbers.h"

#define NEVER UINT64_MAX
#define CYCLES_PER_US (BOARD_CLOCK_HZ / 1000000u)
#define MEASUREMENT_CYCLES (6000u * CYCLES_PER_US)
#define WRITING_CYCLES (250u * CYCLES_PER_US) /* RDY is 0 while data are written */
#define BEYOND_RANGE (-4096)
#define BIAS_HORIZONTAL_GAUSS 1.16 /* of the self test */
#define BIAS_VERTICAL_GAUSS 1.08

enum { CONFIGURATION_A, CONFIGURATION_B, MODE, DATA = 3, STATUS = 9, IDENTIFICATION = 10, REGISTERS = 13 };
enum { MODE_CONTINUOUS = 0, MODE_SINGLE = 1, MODE_IDLE = 3, MODE_MASK = 3 };
enum { STATUS_READY = 1, STATUS_LOCK = 2 };
enum { ALL_DATA = 0x3F };

/* ---- measuring ---- */

/* From one measurement to the next in continuous mode: 0.75, 1.5, 3, 7.5, 15, 30, 75 Hz. */
static uint64_t period_cycles(const compass *self) {
  static const double hertz[] = {0.75, 1.5, 3.0, 7.5, 15.0, 30.0, 75.0, 75.0};
  return (uint64_t)(BOARD_CLOCK_HZ / hertz[self->registers[CONFIGURATION_A] >> 2 & 7]);
}

static int16_t counts(const compass *self, double gauss) {
  static const double per_gauss[] = {1370, 1090, 820, 660, 440, 390, 330, 230};
  const double value = gauss * per_gauss[self->registers[CONFIGURATION_B] >> 5];
  const long long rounded = number_floor(value + 0.5);
  return rounded < -2048 || rounded > 2047 ? BEYOND_RANGE : (int16_t)rounded;
}

/* The field at the end of the measurement, averaged over 1, 2, 4 or 8 samples. */
static void measure(compass *self) {
  const hmc5883l_parameters *p = &self->parameters;
  const viewpoint from = part_view(&self->bus.part, self->done);
  double x, y, sine, cosine;
  compass_field(&p->field, &from, self->bus.part.chassis->motors_a, &x, &y);
  number_sincos(p->field.bias, &sine, &cosine); /* a turned mounting turns the field */
  const double samples = 1 << (self->registers[CONFIGURATION_A] >> 5 & 3);
  const double sigma = p->field.sigma / sqrt(samples);
  noise_source *noise = &self->bus.part.noise;
  double gauss[3] = {
      p->horizontal_gauss * (x * cosine + y * sine + sigma * noise_next_normal(noise)),
      p->horizontal_gauss * (y * cosine - x * sine + sigma * noise_next_normal(noise)),
      p->horizontal_gauss * sigma * noise_next_normal(noise) - p->down_gauss,
  };
  const int test = self->registers[CONFIGURATION_A] & 3; /* 1: positive bias, 2: negative */
  const double bias = test == 1 ? 1.0 : (test == 2 ? -1.0 : 0.0);
  for (int i = 0; i < 3; i++) {
    self->sample[i] = counts(self, gauss[i] + bias * (i == 2 ? BIAS_VERTICAL_GAUSS : BIAS_HORIZONTAL_GAUSS));
  }
  self->measured = 1;
}

static void put_data(compass *self, int offset, int16_t value) {
  self->registers[DATA + offset] = (uint8_t)((uint16_t)value >> 8);
  self->registers[DATA + offset + 1] = (uint8_t)value;
}

/* A measurement is over: its result goes into the registers, unless they are locked. */
static void publish(compass *self) {
  if (self->data_read == 0) {
    put_data(self, 0, self->sample[0]);
    put_data(self, 2, self->sample[2]);
    put_data(self, 4, self->sample[1]);
    self->ready = 1;
  }
  self->measured = 0;
  if ((self->registers[MODE] & MODE_MASK) == MODE_CONTINUOUS) {
    self->done += period_cycles(self);
  } else {
    self->done = NEVER;
    self->registers[MODE] = (uint8_t)(self->registers[MODE] | MODE_IDLE);
  }
}

/* Everything that the chip has done by `cycle`. */
static void settle(compass *self, uint64_t cycle) {
  while (self->done <= cycle) {
    if (!self->measured) measure(self);
    publish(self);
  }
}

/* The world's step is there: what ends within it is measured while its way is known. */
static void step(part *base) {
  compass *self = (compass *)base;
  settle(self, base->chassis->since);
  if (self->done < part_step_end(base) && !self->measured) measure(self);
}

/* ---- registers ---- */

static void start(compass *self, uint64_t cycle) {
  const int mode = self->registers[MODE] & MODE_MASK;
  self->measured = 0;
  self->data_read = 0;
  self->ready = 0;
  self->done = mode == MODE_CONTINUOUS || mode == MODE_SINGLE ? cycle + MEASUREMENT_CYCLES : NEVER;
}

static uint8_t status_at(const compass *self, uint64_t cycle) {
  const int writing = self->done != NEVER && cycle + WRITING_CYCLES >= self->done;
  return (uint8_t)((self->ready && !writing ? STATUS_READY : 0) | (self->data_read ? STATUS_LOCK : 0));
}

static compass *of_device(two_wire_device *device) {
  return (compass *)(void *)((char *)device - offsetof(compass, device));
}

static int begin(two_wire_device *device, uint8_t address, int reading, uint64_t cycle) {
  if (address != COMPASS_ADDRESS) return 0;
  compass *self = of_device(device);
  settle(self, cycle);
  self->expects_pointer = !reading;
  return 1;
}

static void advance_pointer(compass *self) {
  self->pointer++;
  if (self->pointer == STATUS) self->pointer = DATA; /* data are read over and over */
  if (self->pointer >= REGISTERS) self->pointer = 0;
}

static int write(two_wire_device *device, uint8_t byte, uint64_t cycle) {
  compass *self = of_device(device);
  settle(self, cycle);
  if (self->expects_pointer) {
    self->expects_pointer = 0;
    self->pointer = byte;
    return 1;
  }
  if (self->pointer <= MODE) {
    self->registers[self->pointer] = byte;
    if (self->pointer != CONFIGURATION_B) self->data_read = 0; /* unlocked */
    if (self->pointer == MODE) start(self, cycle);
  }
  advance_pointer(self);
  return 1;
}

static uint8_t read(two_wire_device *device, uint64_t cycle) {
  compass *self = of_device(device);
  settle(self, cycle);
  if (self->pointer >= REGISTERS) self->pointer = 0;
  uint8_t value = self->pointer == STATUS ? status_at(self, cycle) : self->registers[self->pointer];
  if (self->pointer >= DATA && self->pointer < STATUS) {
    self->data_read |= (uint8_t)(1u << (self->pointer - DATA));
    if (self->data_read == ALL_DATA) self->data_read = 0;
  }
  advance_pointer(self);
  return value;
}

static const two_wire_operations CHIP = {.begin = begin, .write = write, .read = read};
static const part_operations OPERATIONS = {.edge = two_wire_edge, .step = step};

static int init(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  compass *self = (compass *)base;
  const hmc5883l_parameters *p = parameters;
  two_wire_init(&self->bus, &OPERATIONS, place, pins, &self->device);
  self->device = (two_wire_device){.op = &CHIP};
  self->parameters = *p;
  self->registers[CONFIGURATION_A] = 0x10;
  self->registers[CONFIGURATION_B] = 0x20;
  self->registers[MODE] = MODE_SINGLE;
  memcpy(&self->registers[IDENTIFICATION], "H43", 3);
  self->done = NEVER;
  return 0;
}

const part_kind compass_kind = {.size = sizeof(compass), .noise = 61, .pins = 2, .init = init};
