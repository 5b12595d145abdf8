/* session_seed.h: the seed of the open session, and the board's half of the next one's. */
#ifndef LINK_SESSION_SEED_H
#define LINK_SESSION_SEED_H

#include <stdbool.h>
#include <stdint.h>

/* A session of that seed is open from now on, or none (FRAME_NO_SESSION). Draws the nonce that the next opening must name. */
void session_use_seed(uint32_t seed);

/* FRAME_NO_SESSION: none is open. */
uint32_t session_seed(void);
bool session_is_open(void);

/* The board's half of the next session's seed. */
uint32_t session_board_nonce(void);

#endif
