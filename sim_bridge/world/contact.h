/* contact.h: bodies that meet things, section 3.2.5 of the notes and beyond it.
 *
 * A contact is a point of a body's core (outline.h) nearer to something than the roundings allow. Motion is cut into parts
 * in which nothing moves farther than half of the distance that a core has from everything: nothing can be passed
 * through. After each part the bodies are put out of what they have entered, and lose the velocity into it by an impulse
 * at the contact, on the mass that they have there; an inelastic impulse never adds energy, and between two robots it is
 * equal and opposite.
 *
 * Where no place is found, movers that press on a body give way first: they stop where they are for the rest of the step,
 * and the clocks of their paths with them, as a door with a safety edge. If that is not enough (a wedge narrower than
 * the body) the bodies stay where they were, at rest. So a place once good stays good: nobody is moved into anything.
 */
#ifndef WORLD_CONTACT_H
#define WORLD_CONTACT_H

#include "body.h"

#define CONTACTS_CAPACITY 32
#define CONTACT_FAR 0.1     /* m: what is farther apart is not looked at closely */
#define CONTACT_DEPTH 1e-10 /* m: less is not put out */

typedef struct {
  body *other;   /* NULL: nothing that gives way */
  mover *pusher; /* NULL: no mover */
  double nx, ny; /* direction from there to the body */
  double px, py; /* point of the core, in the body's frame */
  double qx, qy; /* point on the other side: in the arena, or in the other body's frame */
  double vx, vy; /* its velocity, if it does not give way */
  double apart;  /* distance of the two points in contact: the roundings */
  double gap;
} contact;

typedef struct {
  contact list[CONTACTS_CAPACITY];
  int count;
  double nearest; /* distance of the core from anything, at least */
  double first;   /* s, until the first gap that is still open would close at the speeds of now */
} contacts;

/* Contacts of a body with movers, those moved on by `elapsed` seconds, and with the arena, where the gap is below
 * `margin`: of too many the deepest. Movers come first, so that what is solved contact by contact ends with the arena. */
void contact_find(body *self, const scene *around, double elapsed, double margin, contacts *out);

/* Contacts of one robot with another. */
void contact_find_pair(body *self, body *other, double margin, contacts *out);

/* What a unit impulse along a contact's normal does to a body. */
typedef struct {
  double speed, lateral, turn_rate; /* changes */
  double along, across, moment;     /* components of the impulse */
  double gain;                      /* change of the velocity along the impulse: 1 / the mass felt there */
} contact_answer;

/* A contact at poses that stay as they are: what depends on them is known once for many rounds. */
typedef struct {
  body *other;
  contact_answer own, its; /* of the body and of the other */
  double met;              /* velocity along the normal of what does not give way, m/s */
  double allowed;          /* m/s into the contact that stay */
} contact_hold;

typedef struct {
  contact_hold list[CONTACTS_CAPACITY];
  int count;
} contact_holds;

/* What of movers and arena a body that touches leans on, none otherwise: what closes a gap within `within` seconds is
 * allowed. */
void contact_lean(body *self, const scene *around, double within, contact_holds *out);

/* Takes away the velocities into the contacts beyond what is allowed. Returns the largest change, m/s. */
double contact_stop(body *self, const contact_holds *at);

/* Moves the bodies of one group for `dt` seconds by the speeds that they have. */
void contact_move(body *const bodies[], size_t count, const scene *around, double dt);

/* Turns a body by an angle; a slipping one keeps its velocity in the plane. */
void contact_turn(body *self, double angle);

/* The fastest that any point of a mover moves at the step's beginning, m/s. */
double contact_mover_speed(const mover *self);

#endif
