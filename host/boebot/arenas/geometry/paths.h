/* paths.h: scripted motion of a shape: pose and velocity as a pure function of time.
 *
 * Between waypoints position and heading go linearly in time. A heading is not wrapped: from 0 to 4 pi is two turns.
 * Lengths in m, angles in rad, times in s.
 */
#ifndef GEOMETRY_PATHS_H
#define GEOMETRY_PATHS_H

#include <stddef.h>

/* python: begin */
/* At the last waypoint a path starts again (the last one equals the first), turns back, or ends. */
enum { PATH_LOOP = 0, PATH_BACK_AND_FORTH = 1, PATH_ONCE = 2 };

typedef struct {
  double time, x, y, heading;
} path_waypoint;

typedef struct {
  const path_waypoint *waypoints; /* at least one; times increase, the first is 0 */
  size_t count;
  int repeat;
} path;

typedef struct {
  double x, y, heading;
  double vx, vy, turn_rate;
} path_state;

/* Where a thing on the path is at `time` and how fast; before 0 it rests at the first waypoint. At a waypoint the
 * velocity is that of what follows. */
void path_at(const path *self, double time, path_state *out);
/* python: end */

#endif
