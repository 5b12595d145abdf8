/* identity.h: who speaks (hello) and which image runs (identity). */
#ifndef IDENTITY_H
#define IDENTITY_H

#ifdef __cplusplus
extern "C" {
#endif

/* Computes the image's hash. */
void identity_start(void);

void identity_send_hello(void);
void identity_send(void);

#ifdef __cplusplus
}
#endif

#endif
