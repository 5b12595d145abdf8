/* requests.h: numbered requests of the host, each carried out once and in order (protocol/PROTOCOL.md, "Delivery"). */
#ifndef LINK_REQUESTS_H
#define LINK_REQUESTS_H

#include <stdbool.h>
#include <stdint.h>

/* A new session: the next request is number 1. */
void requests_start(void);

/* A request came: carries it out, or only answers it again, or refuses it and returns false: neither the next nor the
 * last. The caller has seen to room for the answer. */
bool requests_take(uint8_t id, const uint8_t *payload);

#endif
