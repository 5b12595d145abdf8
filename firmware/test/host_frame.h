/* host_frame.h: the host's end of the line for tests: the firmware's own frame.c, compiled with -DFRAME_OF_HOST. */
#ifndef HOST_FRAME_H
#define HOST_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define HOST_DECODER_SIZE 128u

/* A frame_decoder of the host, which the board's frame.h does not know. */
typedef struct {
  uint32_t room[HOST_DECODER_SIZE / 4u];
} host_decoder;

void host_decoder_start(host_decoder *decoder, uint32_t seed);
void host_decoder_seed(host_decoder *decoder, uint32_t seed);

/* Takes one byte; true when it completes an accepted message: then the functions below read it. */
bool host_decode(host_decoder *decoder, uint8_t byte);
uint8_t host_message_id(const host_decoder *decoder);
uint8_t host_message_sequence(const host_decoder *decoder);
const uint8_t *host_message_payload(const host_decoder *decoder);

/* Frames accepted, refused, and good ones after bad ones. */
uint16_t host_frames_good(const host_decoder *decoder);
uint16_t host_frames_bad(const host_decoder *decoder);
uint16_t host_frames_resynchronised(const host_decoder *decoder);

/* frame_encode() as the host's build has it. */
uint8_t host_frame_encode(uint8_t *wire, uint8_t id, uint8_t sequence, const void *payload, uint8_t length,
                          uint32_t seed);

#ifdef __cplusplus
}
#endif

#endif
