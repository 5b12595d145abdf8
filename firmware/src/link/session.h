/* session.h: the session, from its opening by a host until it is closed, the host is silent, or the board starts again
 * (protocol/PROTOCOL.md, "Session"). Its seed (session_seed.h) separates its frames from those of all others. */
#ifndef LINK_SESSION_H
#define LINK_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"

/* At start: no session is open; says hello. */
void session_start(void);

/* The host opens a session, or confirms the one that is open: hello follows. False if that is refused. */
bool session_open(const msg_open *message);

/* The host leaves the session of that seed. False if it is not the one that is open. */
bool session_close(uint32_t seed);

/* The host asks for the identity: it follows. */
void session_identify(void);

/* A frame of the session was accepted. */
void session_heard(void);

#endif
