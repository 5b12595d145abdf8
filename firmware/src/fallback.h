/* fallback.h: the board's own brain. It wanders and avoids what IR pairs and whiskers see, while no host speaks.
 *
 * Off unless the parameter fallback_after says after how much silence of the host it takes over. Whether it may drive at
 * all, safety.h decides. It also needs a sensor of obstacles: IR pairs or whiskers must be switched on, and if the IR pairs are, their
 * readings must be fresh. An event says when it begins and ends, and STATUS_FALLBACK is set meanwhile. */
#ifndef FALLBACK_H
#define FALLBACK_H

/* Begins to wait for the host. */
void fallback_start(void);

/* The host has spoken: the motors follow it again, and get no pulses before its next set-point. */
void fallback_host_spoke(void);

#endif
