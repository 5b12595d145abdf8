/* outline.h: the collision outline of a body: any simple polygon, made ready for contact.
 *
 * Contact is reckoned between a core and what is around it: the core of a circle is its centre, that of a polygon is the
 * polygon shrunk by its rounding, and the body is everything within the rounding of its core. So the straight sides are
 * where the polygon says, its outward corners are rounded, and a contact always has a direction. A corner's tip lies
 * outside of that by r (1 / sin(a/2) - 1), r the rounding and a the corner's angle: the sharpest corner decides the
 * rounding, so that this is at most 0.1 mm. Section 3.2.5 of the notes: a detailed robot has its own
 * simplified collision geometry.
 */
#ifndef WORLD_OUTLINE_H
#define WORLD_OUTLINE_H

#include <stddef.h>

/* python: begin */
enum { BODY_CORNERS_MAXIMUM = 32 };
enum { OUTLINE_OK = 0, OUTLINE_THIN = -1 };

/* Shared by all bodies of that kind; it must outlive them. */
typedef struct {
  size_t corners;
  double xy[64];   /* the polygon, counter-clockwise, x0 y0 x1 y1 ..., m, in the body's frame */
  double core[64]; /* the same corners moved inwards */
  double rounding; /* m; 1 mm unless a sharp corner (at 90 degrees 0.24 mm) or a narrow place needs less */
  double reach;    /* of the farthest corner from the origin */
} body_outline;

/* Takes a simple polygon of 3 to 32 corners, in either sense, none of them sharper than 15 degrees (outlines.py of
 * boebot.description has checked it). Returns OUTLINE_OK, or OUTLINE_THIN: a place is narrower than 0.4 mm. */
int body_outline_make(body_outline *self, const double *xy, size_t corners);
/* python: end */

#endif
