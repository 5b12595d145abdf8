/* host_frame.c: see host_frame.h. The names that frame.c exports are changed, for the board's build is linked too. */
#define FRAME_OF_HOST
#define frame_encode host_frame_encode
#define frame_decoder_start host_frame_decoder_start
#define frame_decoder_seed host_frame_decoder_seed
#define frame_decoder_cut host_frame_decoder_cut
#define frame_decoder_take host_frame_decoder_take
#define frame_decoder_accept host_frame_decoder_accept
#include "link/frame.c"

#include "host_frame.h"

_Static_assert(sizeof(frame_decoder) <= sizeof(host_decoder), "the decoder fits");

static inline frame_decoder *of(host_decoder *decoder) { return (frame_decoder *)(void *)decoder; }
static inline const frame_decoder *of_const(const host_decoder *decoder) {
  return (const frame_decoder *)(const void *)decoder;
}

void host_decoder_start(host_decoder *decoder, uint32_t seed) { frame_decoder_start(of(decoder), seed); }
void host_decoder_seed(host_decoder *decoder, uint32_t seed) { frame_decoder_seed(of(decoder), seed); }
bool host_decode(host_decoder *decoder, uint8_t byte) { return frame_decode(of(decoder), byte); }
uint8_t host_message_id(const host_decoder *decoder) { return frame_id(of_const(decoder)); }
uint8_t host_message_sequence(const host_decoder *decoder) { return frame_sequence(of_const(decoder)); }
const uint8_t *host_message_payload(const host_decoder *decoder) { return frame_payload(of_const(decoder)); }
uint16_t host_frames_good(const host_decoder *decoder) { return of_const(decoder)->good; }
uint16_t host_frames_bad(const host_decoder *decoder) { return of_const(decoder)->bad; }
uint16_t host_frames_resynchronised(const host_decoder *decoder) { return of_const(decoder)->resynchronised; }
