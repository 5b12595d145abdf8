/* paths.c: see paths.h. */
#include "paths.h"

#include "numbers.h"

/* The waypoint that precedes `time`, by bisection: 0 <= time < time of the last. */
static size_t segment_at(const path *self, double time) {
  size_t low = 0;
  size_t high = self->count - 1;
  while (high - low > 1) {
    const size_t middle = (low + high) / 2;
    if (self->waypoints[middle].time <= time) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

static void rest_at(const path_waypoint *where, path_state *out) {
  *out = (path_state){.x = where->x, .y = where->y, .heading = where->heading};
}

void path_at(const path *self, double time, path_state *out) {
  const path_waypoint *last = &self->waypoints[self->count - 1];
  const double period = last->time;
  double direction = 1.0;
  if (self->count == 1 || !(time >= 0.0) || time > 1e12) {
    rest_at(&self->waypoints[0], out);
    return;
  }
  if (time >= period) {
    if (self->repeat == PATH_ONCE) {
      rest_at(last, out);
      return;
    }
    const long long round = number_floor(time / period);
    time -= (double)round * period;
    if (self->repeat == PATH_BACK_AND_FORTH && round % 2 != 0) {
      time = period - time;
      direction = -1.0;
    }
    if (time < 0.0) time = 0.0; /* rounding */
  }
  size_t i = time < period ? segment_at(self, time) : self->count - 2;
  if (direction < 0.0 && time <= self->waypoints[i].time && i > 0) i--; /* the segment that follows on the way back */
  const path_waypoint *a = &self->waypoints[i];
  const path_waypoint *b = &self->waypoints[i + 1];
  const double duration = b->time - a->time;
  const double share = (time - a->time) / duration;
  const double rate = direction / duration;
  *out = (path_state){
      .x = a->x + share * (b->x - a->x),
      .y = a->y + share * (b->y - a->y),
      .heading = a->heading + share * (b->heading - a->heading),
      .vx = rate * (b->x - a->x),
      .vy = rate * (b->y - a->y),
      .turn_rate = rate * (b->heading - a->heading),
  };
}
