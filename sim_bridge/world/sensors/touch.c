/* touch.c: see touch.h. */
#include "touch.h"

#include <math.h>

static double reach(const void *self) {
  const touch_parameters *p = self;
  return sqrt(fmax(p->root_x * p->root_x + p->root_y * p->root_y, p->tip_x * p->tip_x + p->tip_y * p->tip_y));
}

static void read(const void *self, sensor_memory *memory, const sensing *s, noise_source *noise, double *readings) {
  const touch_parameters *p = self;
  *readings = body_segment_touches(s->body, s->from.around, p->root_x, p->root_y, p->tip_x, p->tip_y, WHISKER_HEIGHT_M);
}

const sensor_kind touch_sensor = {
    .noise = 10, .size = sizeof(touch_parameters), .readings = 1, .reach = reach, .read = read};
