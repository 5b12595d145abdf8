/* part.c: see part.h. */
#include "part.h"

#include <math.h>

#include "../world/numbers.h"

double part_look(const part_place *place, const part_mount *mount, int rays, double reach, double grazing_cosine) {
  const body_state *s = &place->body->state;
  const double x = s->x + mount->x * s->cosine - mount->y * s->sine; /* (3.9) */
  const double y = s->y + mount->x * s->sine + mount->y * s->cosine;
  double nearest = -1.0;
  for (int i = 0; i < rays; i++) {
    const double share = rays > 1 ? (double)i / (double)(rays - 1) - 0.5 : 0.0; /* (3.10), (3.11) */
    double sine, cosine;
    number_sincos(s->heading + mount->heading + share * mount->beam, &sine, &cosine);
    uint32_t hit = 0;
    const double d = arena_ray(place->arena, x, y, cosine, sine, reach, 0.0, &hit);
    if (d < 0.0 || (nearest >= 0.0 && d >= nearest)) continue;
    if (grazing_cosine > 0.0 && hit < arena_edge_count(place->arena)) {
      const arena_edge *e = &arena_edges(place->arena)[hit];
      const double normal = fabs(cosine * e->ey - sine * e->ex) / sqrt(e->length_squared);
      if (normal < grazing_cosine) continue;
    }
    nearest = d;
  }
  return nearest;
}
