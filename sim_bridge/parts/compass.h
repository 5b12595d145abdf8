/* compass.h: the HMC5883L, a magnetic compass on the two-wire bus (data sheet of Honeywell, form 900405).
 *
 * Registers 0 to 12: two of configuration, mode, six of data (X, Z, Y; high byte first), status, identification "H43". A
 * measurement takes 6 ms: one after each write of mode 1, then idle; in mode 0 one after another at the rate of
 * configuration A. The field is that of world/sensors/compass, in gauss, times the gain of configuration B; beyond the
 * range of 12 bits a channel reads -4096. While some but not all of the data have been read, new data are lost (LOCK).
 * X points forward, Y to the left, Z up. Idle after power-on until a mode is written, whatever the mode register says.
 */
#ifndef PART_COMPASS_H
#define PART_COMPASS_H

#include "../world/sensors/compass.h"
#include "two_wire.h"

#define COMPASS_ADDRESS 0x1Eu

/* python: begin */
typedef struct {
  compass_parameters field; /* sigma: noise of one sample of each axis, in parts of the horizontal field */
  double horizontal_gauss;  /* the earth's field */
  double down_gauss;
} hmc5883l_parameters;
/* python: end */

typedef struct {
  two_wire bus; /* that it is on, by itself */
  two_wire_device device;
  hmc5883l_parameters parameters;
  uint8_t registers[13];
  uint8_t pointer;
  int expects_pointer; /* the next byte written is the pointer */
  uint8_t data_read;   /* bits of data registers read since they were complete: not 0 is LOCK */
  uint64_t done;       /* when the measurement under way ends; UINT64_MAX: none */
  int measured;        /* `sample` holds its result */
  int16_t sample[3];   /* X, Y, Z */
  int ready;           /* there are data */
} compass;

/* python: begin */
/* Parameters: hmc5883l_parameters. Pins: SDA and SCL. */
extern const part_kind compass_kind;
/* python: end */

#endif
