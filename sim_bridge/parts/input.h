/* input.h: what a person works by hand: a contact (button, slide switch), which bounces, and a potentiometer.
 *
 * A contact joins its pin to ground or to 5 V while it is closed; open, it lets go of the pin, or a resistor pulls it the
 * other way. A potentiometer's wiper has a share of the rail's voltage. Both stay as they are set (robot_set_part).
 */
#ifndef PART_INPUT_H
#define PART_INPUT_H

#include "part.h"

/* python: begin */
typedef struct {
  int to_supply;   /* 1: closed it joins the pin to 5 V; 0: to ground */
  int resistor;    /* 1: open, a resistor pulls the pin the other way */
  int closed;      /* 1: at first */
  double bounce_s; /* mean, of part_bounce; 0: none */
} contact_parameters;

/* Set to 0 or 1; shows whether it is closed. Parameters: contact_parameters. Pin: the contact. */
extern const part_kind contact_kind;

/* Set to 0 ... 1; shows that. Parameters: double[2], where it stands at first, and the standard deviation of its voltage.
 * Pin: the wiper, an analog input. */
extern const part_kind potentiometer_kind;
/* python: end */

#endif
