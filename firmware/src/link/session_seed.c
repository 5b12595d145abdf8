/* session_seed.c: see session_seed.h. */
#include "link/session_seed.h"

#include "link/frame.h"
#include "reset.h"

static uint32_t open_seed;   /* or FRAME_NO_SESSION */
static uint32_t board_nonce; /* that the next opening must name */

void session_use_seed(uint32_t seed) {
  open_seed = seed;
  board_nonce = reset_nonce();
}

uint32_t session_seed(void) { return open_seed; }

bool session_is_open(void) { return open_seed != FRAME_NO_SESSION; }

uint32_t session_board_nonce(void) { return board_nonce; }
