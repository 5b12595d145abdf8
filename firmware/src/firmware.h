/* firmware.h: the whole firmware as main() sees it: start once, then poll whenever something may be due. */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include <stdint.h>

/* Brings up board, devices and link, says hello, and starts the slots. */
void firmware_start(void);

/* Does the work that is due: a slot's tasks; if no slot waits, the changes of pins and one received frame. So at most one
 * frame delays a slot, and frames wait while slots do. */
void firmware_poll(void);

/* Not 0: there is something for firmware_poll() to do. */
uint8_t firmware_due(void);

#endif
