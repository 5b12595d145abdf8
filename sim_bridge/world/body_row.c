/* body_row.c: body_advance_row of body_step.h: speeds and the way where nothing blocks it for a whole row at once, all else for
 * each body alone. */
#include <string.h>

#include "body_drive.h"
#include "body_step.h"

/* Bodies of a row side by side, as numbers that wait for each other's turn in no order. */
typedef struct {
  double x[ROW], y[ROW], heading[ROW], cosine[ROW], sine[ROW];
  double speed[ROW], turn_rate[ROW], lateral[ROW];
  double way[ROW], distance[ROW];
  double rim_left[ROW], rim_right[ROW], wheel_left[ROW], wheel_right[ROW];
} motion;

static void speed_up_row(body *const bodies[], const double left[], const double right[], double dt, motion *all) {
  double speed[ROW], turn_rate[ROW];
  for (size_t k = 0; k < ROW; k++) speed[k] = bodies[k]->state.speed;
  for (size_t k = 0; k < ROW; k++) turn_rate[k] = bodies[k]->state.turn_rate;
  for (size_t k = 0; k < ROW; k++) body_speed_up(bodies[0], left[k], right[k], dt, &speed[k], &turn_rate[k]);
  memcpy(all->speed, speed, sizeof speed);
  memcpy(all->turn_rate, turn_rate, sizeof turn_rate);
}

/* What drive does. Tyres that may slip, and what drifts sideways, are looked at for each body alone. */
static void drive_row(body *const bodies[], const scene around[], const double left[], const double right[], double dt,
                      motion *all) {
  speed_up_row(bodies, left, right, dt, all);
  for (size_t k = 0; k < ROW; k++) {
    body *b = bodies[k];
    if (b->parameters.slip || b->state.lateral != 0.0) {
      body_drive(b, &around[k], (const double[]){left[k], right[k]}, dt);
    } else {
      b->state.speed = all->speed[k];
      b->state.turn_rate = all->turn_rate[k];
    }
  }
}

/* What move_freely and turn_wheels do for bodies that do not slip. */
static void go_row(body *const bodies[], double dt, motion *all) {
  const double half_track = bodies[0]->parameters.half_track;
  const double angle = bodies[0]->per_radius * dt;
  for (size_t k = 0; k < ROW; k++) {
    all->x[k] = bodies[k]->state.x;
    all->y[k] = bodies[k]->state.y;
    all->heading[k] = bodies[k]->state.heading;
    all->speed[k] = bodies[k]->state.speed;
    all->turn_rate[k] = bodies[k]->state.turn_rate;
    all->lateral[k] = bodies[k]->state.lateral;
    all->distance[k] = bodies[k]->state.distance;
    all->wheel_left[k] = bodies[k]->state.wheel_left;
    all->wheel_right[k] = bodies[k]->state.wheel_right;
  }
  for (size_t k = 0; k < ROW; k++) {
    all->heading[k] = number_wrap(all->heading[k] + all->turn_rate[k] * dt);
    number_sincos(all->heading[k], &all->sine[k], &all->cosine[k]);
    body_shift(all->speed[k], all->lateral[k], all->cosine[k], all->sine[k], dt, &all->x[k], &all->y[k]);
    all->distance[k] += all->way[k];
    all->rim_left[k] = all->speed[k] - half_track * all->turn_rate[k];
    all->rim_right[k] = all->speed[k] + half_track * all->turn_rate[k];
    all->wheel_left[k] += all->rim_left[k] * angle;
    all->wheel_right[k] += all->rim_right[k] * angle;
  }
}

static void give(const motion *all, size_t k, body_state *s) {
  s->x = all->x[k];
  s->y = all->y[k];
  s->heading = all->heading[k];
  s->cosine = all->cosine[k];
  s->sine = all->sine[k];
  s->distance = all->distance[k];
  s->rim_left = all->rim_left[k];
  s->rim_right = all->rim_right[k];
  s->wheel_left = all->wheel_left[k];
  s->wheel_right = all->wheel_right[k];
  s->touching = 0;
}

void body_advance_row(body *const bodies[], const scene around[], const double left[], const double right[],
                      double dt) {
  motion all;
  int clear[ROW];
  for (size_t k = 0; k < ROW; k++) body_rest_movers(&around[k], dt);
  drive_row(bodies, around, left, right, dt, &all);
  for (size_t k = 0; k < ROW; k++) {
    body_start_movers(&around[k], dt);
    all.way[k] = body_way(bodies[k], dt);
    clear[k] = body_stays_clear(bodies[k], &around[k], all.way[k], dt);
  }
  go_row(bodies, dt, &all);
  for (size_t k = 0; k < ROW; k++) {
    if (clear[k] && !bodies[k]->state.slipping) {
      give(&all, k, &bodies[k]->state);
    } else {
      body_move_alone(bodies[k], &around[k], clear[k], all.way[k], dt);
      body_turn_wheels(bodies[k], dt);
    }
    body_count_waits(&around[k], dt);
  }
}
