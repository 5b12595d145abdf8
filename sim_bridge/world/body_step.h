/* body_step.h: bodies move for a step of time, alone or together in one world. */
#ifndef WORLD_BODY_STEP_H
#define WORLD_BODY_STEP_H

#include "body.h"

/* One step of `dt` seconds of all robots of one world under their wheels' torques (left, right; N m; in the order of the
 * bodies). `around`: the arena and its moving obstacles as they are at the step's beginning, without the robots. Moving
 * obstacles push and are not pushed; one that would push a robot into something waits, and `waited` of it grows. Robots
 * push each other. The result does not depend on the order of the bodies.
 * Ids differ, and there are at most BODY_MAXIMUM. With a torque that is no finite number nothing moves. A body is copied as
 * a whole: its lists of near things belong to it. */
void body_step(body *const bodies[], size_t count, const scene *around, const double torques[][2], double dt);

#endif
