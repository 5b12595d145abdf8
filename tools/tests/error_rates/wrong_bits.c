/* wrong_bits.c: see wrong_bits.h. */
#include "wrong_bits.h"

#include <stdbool.h>
#include <string.h>

#include "channel.h"
#include "link/frame.h"

#define BITS_MAX 8u

typedef struct {
  uint8_t neighbour[FRAME_SIZE_MAX], wire[FRAME_SIZE_MAX];
  uint8_t neighbour_size, size;
  uint8_t neighbour_sequence;
  frame_decoder idle; /* behind the neighbour before */
} wire_scene;

/* The neighbours are of the same kind, with another sequence number and payload. */
static void prepare(const wrong_bits_frame *frame, wire_scene *scene) {
  uint8_t other[sizeof frame->payload];
  for (size_t i = 0; i < sizeof other; i++) {
    other[i] = (uint8_t)(frame->payload[i] ^ (0x5Au + i));
  }
  scene->neighbour_sequence = (uint8_t)(frame->sequence + 1u);
  scene->neighbour_size =
      frame_encode(scene->neighbour, frame->id, scene->neighbour_sequence, other, frame->length, frame->seed);
  scene->size = frame_encode(scene->wire, frame->id, frame->sequence, frame->payload, frame->length, frame->seed);
  frame_decoder_start(&scene->idle, frame->seed);
  for (uint8_t i = 0; i < scene->neighbour_size; i++) {
    frame_decode(&scene->idle, scene->neighbour[i]);
  }
}

/* What the decoder makes of the spoilt bytes and of the neighbour behind them. */
static void judge(const wire_scene *scene, wrong_bits_tally *tally) {
  frame_decoder decoder = scene->idle;
  uint32_t accepted = 0;
  for (uint8_t i = 0; i < scene->size; i++) {
    accepted += frame_decode(&decoder, scene->wire[i]);
  }
  bool arrived = false;
  for (uint8_t i = 0; i < scene->neighbour_size; i++) {
    if (frame_decode(&decoder, scene->neighbour[i])) {
      const bool last = i == scene->neighbour_size - 1u && frame_sequence(&decoder) == scene->neighbour_sequence;
      arrived = last;
      accepted += !last;
    }
  }
  tally->patterns++;
  tally->accepted += accepted != 0;
  tally->lost += !arrived;
}

static void flip(wire_scene *scene, uint32_t bit) { scene->wire[bit / 8u] ^= (uint8_t)(1u << bit % 8u); }

/* Every set of `bits` more wrong bits from bit `first` on. */
static void judge_sets(wire_scene *scene, uint32_t first, uint8_t bits, wrong_bits_tally *tally) {
  if (bits == 0) {
    judge(scene, tally);
    return;
  }
  for (uint32_t bit = first; bit < 8u * scene->size; bit++) {
    flip(scene, bit);
    judge_sets(scene, bit + 1u, (uint8_t)(bits - 1u), tally);
    flip(scene, bit);
  }
}

void wrong_bits_all(const wrong_bits_frame *frame, uint8_t bits, wrong_bits_tally *tally) {
  wire_scene scene;
  prepare(frame, &scene);
  judge_sets(&scene, 0, bits, tally);
}

/* Whether the bit makes a delimiter or unmakes one. */
static bool is_delimiting(const wire_scene *scene, uint32_t bit) {
  const uint8_t byte = scene->wire[bit / 8u];
  return byte == 0 || byte == 1u << bit % 8u;
}

/* A set of different bits; the first, if wanted, one that makes or unmakes a delimiter. */
static void draw(const wire_scene *scene, uint8_t bits, bool delimiting, uint64_t *random, uint32_t *drawn) {
  for (uint8_t i = 0; i < bits;) {
    drawn[i] = channel_below(random, 8u * scene->size);
    bool fits = i > 0 || !delimiting || is_delimiting(scene, drawn[i]);
    for (uint8_t before = 0; before < i; before++) {
      fits = fits && drawn[before] != drawn[i];
    }
    i = (uint8_t)(i + fits);
  }
}

void wrong_bits_some(const wrong_bits_frame *frame, uint8_t bits, uint64_t count, uint64_t random,
                     wrong_bits_tally *tally) {
  wire_scene scene;
  uint32_t drawn[BITS_MAX];
  prepare(frame, &scene);
  for (uint64_t i = 0; i < count; i++) {
    draw(&scene, bits, i % 2 != 0, &random, drawn);
    for (uint8_t bit = 0; bit < bits; bit++) {
      flip(&scene, drawn[bit]);
    }
    judge(&scene, tally);
    for (uint8_t bit = 0; bit < bits; bit++) {
      flip(&scene, drawn[bit]);
    }
  }
}
