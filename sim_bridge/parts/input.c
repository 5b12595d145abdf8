/* input.c: see input.h. */
#include "input.h"

static uint64_t now(const part *base) { return base->chassis->board->op->now(base->chassis->board); }

/* ---- contact ------------------------------------------------------------------------------------------------------- */

typedef struct {
  part part;
  contact_parameters parameters;
} contact;

/* What it does to its pin, closed or not. */
static uint8_t level_of(const contact_parameters *p, int closed) {
  if (!closed && !p->resistor) return BOARD_RELEASED;
  return (closed != 0) == (p->to_supply != 0) ? BOARD_HIGH : BOARD_LOW;
}

static int set_contact(part *base, double value) {
  contact *self = (contact *)base;
  contact_parameters *p = &self->parameters;
  if (value != 0.0 && value != 1.0) return -1;
  const int closed = value == 1.0;
  if (closed == p->closed) return 0;
  p->closed = closed;
  part_bounce(base, &base->noise, now(base) + PART_GUARD, level_of(p, closed), level_of(p, !closed), p->bounce_s);
  return 0;
}

static int read_contact(part *base, double *values) {
  *values = ((contact *)base)->parameters.closed;
  return 1;
}

static const part_operations CONTACT = {.read = read_contact, .set = set_contact};

static int init_contact(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  contact *self = (contact *)base;
  const contact_parameters *p = parameters;
  self->parameters = *p;
  const uint8_t resistor = p->to_supply ? PART_WEAK_LOW : PART_PULLED_UP, pulled = p->resistor ? resistor : PART_OPENS;
  part_join(base, &CONTACT, place, &(part_pin){pins[0], PART_DRIVES | pulled}, 1);
  part_drive(base, 0, pins[0], level_of(p, p->closed));
  return 0;
}

const part_kind contact_kind = {.size = sizeof(contact), .noise = 200, .pins = 1, .init = init_contact};

/* ---- potentiometer ------------------------------------------------------------------------------------------------- */

typedef struct {
  part part;
  double position, noise_v;
} potentiometer;

static double volts(part *base, uint64_t cycle) {
  potentiometer *self = (potentiometer *)base;
  const double rail = base->chassis->supply * BOARD_NOMINAL_VOLTS;
  const double v = self->position * rail + self->noise_v * noise_next_normal(&base->noise);
  return v < 0.0 ? 0.0 : (v > rail ? rail : v);
}

/* What a digital input makes of it: low below 2.1 V and high above 2.6 V of 5 V, between them as before (ATmega328P data
 * sheet, typical thresholds of I/O pins). */
static void show_level(part *base, uint64_t at) {
  const double position = ((potentiometer *)base)->position;
  if (position <= 2.1 / BOARD_NOMINAL_VOLTS) part_drive(base, at, base->pins[0].pin, BOARD_LOW);
  if (position >= 2.6 / BOARD_NOMINAL_VOLTS) part_drive(base, at, base->pins[0].pin, BOARD_HIGH);
}

static int turn(part *base, double value) {
  if (!(value >= 0.0 && value <= 1.0)) return -1;
  ((potentiometer *)base)->position = value;
  show_level(base, now(base) + PART_GUARD);
  return 0;
}

static int read_position(part *base, double *values) {
  *values = ((potentiometer *)base)->position;
  return 1;
}

static const part_operations POTENTIOMETER = {.analog = volts, .read = read_position, .set = turn};

static int init_potentiometer(part *base, const part_place *place, const uint8_t *pins, const void *parameters) {
  potentiometer *self = (potentiometer *)base;
  const double *p = parameters;
  self->position = p[0];
  self->noise_v = p[1];
  if (pins[0] < BOARD_FIRST_ANALOG_PIN || !(p[0] >= 0.0 && p[0] <= 1.0)) return -1;
  const uint8_t role = PART_ANALOG | PART_DRIVES | PART_WEAK_HIGH | PART_WEAK_LOW;
  part_join(base, &POTENTIOMETER, place, &(part_pin){pins[0], role}, 1);
  part_drive(base, 0, pins[0], BOARD_LOW);
  show_level(base, 0);
  return 0;
}

const part_kind potentiometer_kind = {
    .size = sizeof(potentiometer), .noise = 240, .pins = 1, .init = init_potentiometer};
