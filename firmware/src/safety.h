/* safety.h: whether the motors may run. A set-point lives for its time to live; when no newer one came by then, the
 * motors stop (dead-man). A stop command stops them until the next set-point. In both cases there are no more pulses
 * from the next servo frame on (motion.h). At start nothing is in force. */
#ifndef SAFETY_H
#define SAFETY_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void safety_start(void);

/* A set-point came, with its time to live in ms (0: the default). Returns whether it may be put in force. */
bool safety_accept(uint16_t time_to_live);

/* A stop command came. */
void safety_stop(void);

/* In every slot: ends set-points that have outlived themselves. */
void safety_task(void);

/* STATUS_MOTORS_ENABLED, STATUS_DEAD_MAN, STATUS_STOPPED. */
uint16_t safety_status(void);

#ifdef __cplusplus
}
#endif

#endif
