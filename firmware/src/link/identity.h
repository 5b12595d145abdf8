/* identity.h: who speaks (hello), which image runs (identity), and how it understands each message (description). */
#ifndef IDENTITY_H
#define IDENTITY_H

#include <stdbool.h>
#include <stdint.h>

/* Computes the image's hash. */
void identity_start(void);

/* Each returns false if there was no room for it. */
bool identity_send_hello(void);
bool identity_send(void) __attribute__((noinline));

/* The message of that index in order of ids; id 0 beyond the last. */
bool identity_describe(uint8_t index);

#endif
