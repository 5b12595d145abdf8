/* vehicle.c: see loop.h. Here: robots without a board, which motor signals drive. They share the world's step, so that
 * their model steps as far as the world does.
 */
#include <math.h>

#include "state.h"

int sim_add_vehicle(sim *self, int number, const vehicle_model *model, double x, double y, double heading) {
  if (fabs(model->dt - self->world.dt) > 1e-12) return SIM_BAD_ARGUMENT;
  if (!world_is_free(&self->world, x, y, body_reach_of(&model->body), 0)) return SIM_NOT_FREE;
  vehicles *v = vehicles_new(model, 1, 0);
  if (v == NULL) return SIM_NO_MEMORY;
  const int status = vehicles_place(v, 0, self->world.arena, self->seed, robot_mover_id(number), x, y, heading);
  robot *r = status == VEHICLE_OK ? sim_new_robot(self, number, NULL) : NULL;
  if (r == NULL) {
    vehicles_destroy(v);
    return status == VEHICLE_NOT_FREE ? SIM_NOT_FREE : SIM_NO_MEMORY;
  }
  v->worlds[0].in = &self->world;
  r->vehicle = v;
  r->body = &v->worlds[0].body;
  sim_insert(self, r, x, y, heading);
  return SIM_OK;
}
