/* interventions.c: see loop.h. Here: what a test does to a simulation, past its parts. */
#include <math.h>

#include "parts/ping.h"
#include "state.h"

#define WAVE_EDGES_MAXIMUM 10000000u

static int bad_pin(uint8_t pin) { return pin >= BOARD_PIN_COUNT; }

static int bad_pose(double x, double y, double heading) {
  return !(fabs(heading) <= BODY_HEADING_LIMIT) || !isfinite(x + y);
}

/* The truth has where it was, and a cycle later where it is. */
static void lift(robot *r, double x, double y, double heading) {
  const uint64_t at = r->sim->world_at;
  const int is_recorded = r->sim->record_cycles > 0;
  if (is_recorded && at > 0) robot_record(r, at - 1u);
  body_place(r->body, x, y, heading);
  r->touched = 0;
  if (is_recorded) robot_record(r, at > r->next_row ? at : r->next_row);
}

int sim_place(sim *self, int number, double x, double y, double heading) {
  robot *r = sim_robot(self, number);
  if (r == NULL || bad_pose(x, y, heading)) return SIM_BAD_ARGUMENT;
  if (!world_is_free(&self->world, x, y, r->body->body_reach, r->chassis.self_id)) return SIM_NOT_FREE;
  lift(r, x, y, heading);
  r->chassis.x = x;
  r->chassis.y = y;
  r->chassis.heading = heading;
  world_update(&self->world);
  return SIM_OK;
}

int sim_place_shape(sim *self, int shape, double x, double y, double heading) {
  if (shape < 0 || (size_t)shape >= self->world.obstacles || bad_pose(x, y, heading)) return SIM_BAD_ARGUMENT;
  if (!world_place_obstacle(&self->world, (size_t)shape, x, y, heading)) return SIM_NOT_FREE;
  const mover *m = &self->movers[shape];
  const sim_shift row = {(double)self->world_at / BOARD_CLOCK_HZ, shape, m->shift_x, m->shift_y, m->shift_heading};
  if (self->record_cycles > 0) buffer_append(&self->shifts, &row, sizeof row);
  return SIM_OK;
}

/* Takes a pin from its part. Returns 1 if a resistor pulls it up when nobody drives it. */
static int take_pin(robot *r, uint8_t pin) {
  int pulled_up = 0;
  for (int i = 0; i < r->part_count; i++) {
    part *p = r->parts[i];
    for (int k = 0; k < PART_PINS; k++) {
      if (p->pins[k].pin != pin || !(p->pins[k].role & PART_DRIVES)) continue;
      p->overridden = 1;
      pulled_up |= (p->pins[k].role & PART_PULLED_UP) != 0;
    }
  }
  return pulled_up;
}

int sim_drive(sim *self, int number, uint64_t at, uint8_t pin, uint8_t level) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || bad_pin(pin) || level > BOARD_RELEASED) return SIM_BAD_ARGUMENT;
  const int pulled_up = take_pin(r, pin);
  if (level == BOARD_RELEASED && pulled_up) level = BOARD_HIGH;
  r->chassis.driven[pin] = level;
  r->board->op->drive(r->board, at, pin, level);
  return SIM_OK;
}

int sim_wave(sim *self, int number, uint8_t pin, uint32_t half_cycles, uint64_t duration) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || bad_pin(pin) || half_cycles == 0 || duration / half_cycles > WAVE_EDGES_MAXIMUM)
    return SIM_BAD_ARGUMENT;
  take_pin(r, pin);
  const uint64_t start = self->world_at + PART_GUARD; /* edges up to there are queued already */
  uint8_t level = r->chassis.driven[pin];
  r->board->op->drive(r->board, start, pin, level); /* ends what was queued */
  for (uint64_t at = start + half_cycles; at <= start + duration; at += half_cycles) {
    level = level == BOARD_HIGH ? BOARD_LOW : BOARD_HIGH;
    r->board->op->drive(r->board, at, pin, level);
  }
  return SIM_OK;
}

int sim_answer_ping(sim *self, int number, int64_t echo_cycles) {
  robot *r = sim_robot_with_board(self, number);
  int pings = 0;
  for (int i = 0; r != NULL && i < r->part_count; i++) {
    ping *p = ping_of(r->parts[i]);
    if (p == NULL) continue;
    p->answer = echo_cycles;
    pings++;
  }
  if (pings == 0) return SIM_BAD_ARGUMENT;
  return SIM_OK;
}

int sim_unplug(sim *self, int number, uint8_t pin, int unplugged) {
  robot *r = sim_robot_with_board(self, number);
  int parts = 0;
  for (int i = 0; r != NULL && i < r->part_count; i++) {
    part *p = r->parts[i];
    for (int k = 0; k < PART_PINS; k++) {
      if (p->pins[k].pin != pin || p->pins[k].pin == PART_NO_PIN) continue;
      part_unplug(p, unplugged != 0);
      parts++;
    }
  }
  if (parts == 0) return SIM_BAD_ARGUMENT;
  return SIM_OK;
}

int sim_set_supply(sim *self, int number, double volts) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || !(volts >= 0.0) || !isfinite(volts)) return SIM_BAD_ARGUMENT;
  r->held_supply = volts / BOARD_NOMINAL_VOLTS;
  robot_update_supply(r);
  return SIM_OK;
}

int sim_set_brown_out(sim *self, int number, const brown_out_parameters *parameters) {
  robot *r = sim_robot_with_board(self, number);
  const brown_out_parameters *p = parameters;
  if (r == NULL || !(p->reset_v >= 0.0 && p->reset_v < p->erratic_v && p->hysteresis_v >= 0.0)) return SIM_BAD_ARGUMENT;
  if (!(p->upsets_per_s >= 0.0)) return SIM_BAD_ARGUMENT;
  r->brown_out.parameters = *p;
  return SIM_OK;
}

int sim_reset(sim *self, int number, int cause) {
  robot *r = sim_robot_with_board(self, number);
  if (r == NULL || cause < BOARD_RESET_POWER || cause > BOARD_RESET_WATCHDOG) return SIM_BAD_ARGUMENT;
  r->reset_at = self->now;
  r->board->op->reset(r->board, (board_reset_cause)cause);
  return SIM_OK;
}
