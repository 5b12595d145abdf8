/* robots.c: what the other files of the loop ask of its robots; see state.h. */
#include "state.h"
#include "vehicles/sense.h"

robot *sim_robot(const sim *self, int number) {
  for (int i = 0; i < self->robot_count; i++) {
    if (self->robots[i]->number == number) return self->robots[i];
  }
  return NULL;
}

turret *robot_turret(const robot *self, uint8_t pin) {
  for (int i = 0; i < self->part_count; i++) {
    turret *t = turret_of(self->parts[i]);
    if (t != NULL && t->part.pins[0].pin == pin) return t;
  }
  return NULL;
}

int robot_read_parts(robot *self, int first, double *values) {
  int count = 0;
  for (int i = first; i < self->part_count; i++) {
    part *p = self->parts[i];
    if (p->op->read != NULL) count += p->op->read(p, values + count);
  }
  return count;
}

int robot_read_letters(const robot *self, int number, uint8_t *codes) {
  part *p = self->parts[number];
  return p->op->letters == NULL ? 0 : p->op->letters(p, codes);
}

int robot_set_part(robot *self, int number, double value) {
  part *p = self->parts[number];
  return p->op->set != NULL && p->op->set(p, value) == 0 ? SIM_OK : SIM_BAD_ARGUMENT;
}

void robot_update_supply(robot *self) {
  chassis *c = &self->chassis;
  const int held = self->held_supply > 0.0;
  const supply *s = self->battery == NULL || held ? NULL : &self->battery->supply;
  c->supply = s == NULL ? (held ? self->held_supply : 1.0) : s->board_v / BOARD_NOMINAL_VOLTS;
  c->servo_supply = s == NULL ? c->supply : s->servo_v / BOARD_NOMINAL_VOLTS;
}

void sim_sense_anew(sim *self) {
  for (int i = 0; i < self->robot_count; i++) {
    vehicles *v = self->robots[i]->vehicle;
    if (v == NULL) continue;
    v->worlds[0].state.sensed = 0;
    vehicle_sensors_start(v, 0);
  }
}
