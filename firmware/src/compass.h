/* compass.h: the compass HMC5883L on the two-wire bus (Honeywell, HMC5883L data sheet, 2010): 75 measurements a second, mean
 * of 8 samples, range 1.3 Ga (1090 counts/Ga). Its three axes are read every 40 ms. A device that does not answer is asked
 * again; a transfer that has not ended after a tick is given up, and the bus is freed by clock pulses, until whoever holds
 * the data line lets it go (NXP UM10204, 3.1.16). */
#ifndef COMPASS_H
#define COMPASS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  int16_t x, y, z; /* raw counts; -4096: overflow */
  uint8_t age;     /* ticks since they were read; 255: never or older */
  uint8_t status;  /* COMPASS_STATUS_... */
} compass_reading;

void compass_start(void);

const compass_reading *compass_read(void);

#ifdef __cplusplus
}
#endif

#endif
