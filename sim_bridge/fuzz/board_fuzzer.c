/* board_fuzzer.c: libFuzzer writes programs that set up the emulated board's peripherals in every way, and what happens to
 * its pins and its line meanwhile. The same happens to three boards: one runs fast, one executes each instruction and each
 * cycle of sleep by itself, one is stopped more often. They do the same. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../boards/avr/avr_board.h"

#define BOARDS 3
#define SLICES 12u
#define SLICE 1500u    /* cycles, about */
#define MAIN 64u       /* first word behind the vectors and the interrupts' program */
#define BOOT 0x3800u   /* first word of the largest boot section */
#define BOOT_FUSE 0xD9 /* the high fuse byte for it; a reset leads to 0 */

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      abort();                                                        \
    }                                                                 \
  } while (0)

typedef struct {
  const uint8_t *at, *end;
} input;

static uint8_t byte(input *in) { return in->at < in->end ? *in->at++ : 0; }

/* ---- the program ---- */

typedef struct {
  uint8_t flash[AVR_FLASH_SIZE];
  uint32_t words;
} program;

static void put(program *p, unsigned word) {
  p->flash[2 * p->words] = (uint8_t)word;
  p->flash[2 * p->words + 1] = (uint8_t)(word >> 8);
  p->words++;
}

static void put_jump(program *p, unsigned to) {
  put(p, 0x940C);
  put(p, to);
}

static void put_load(program *p, unsigned value) { put(p, 0xE080 | (value & 0xF0) << 4 | (value & 0xF)); } /* LDI r24 */

static void put_write(program *p, unsigned address, unsigned value) {
  put_load(p, value);
  put(p, 0x9380); /* STS address, r24 */
  put(p, address);
}

static void put_read(program *p, unsigned address) {
  put(p, 0x9100 | (address & 7u) << 4); /* LDS r16 to r23 */
  put(p, address);
}

/* Vectors, and one program for all interrupts: it takes what the receiver has. */
static void put_interrupts(program *p, unsigned main) {
  put_jump(p, main);
  for (unsigned vector = 1; vector < VECTOR_COUNT; vector++) put_jump(p, 2 * VECTOR_COUNT);
  put(p, 0x938F); /* PUSH r24 */
  put(p, 0x9180); /* LDS r24 */
  put(p, REG_UDR0);
  put(p, 0x9403); /* INC r0 */
  put(p, 0x918F); /* POP r24 */
  put(p, 0x9518); /* RETI */
  p->words = main;
}

/* Something of it that a and b choose. */
static void put_step(program *p, unsigned kind, unsigned a, unsigned b) {
  const unsigned address = AVR_IO_BEGIN + a % (0xC8 - AVR_IO_BEGIN);
  switch (kind % 16u) {
    case 6:
    case 7:
      put_read(p, address);
      break;
    case 8: /* CBI, SBIC, SBI, SBIS, and what may be skipped */
      put(p, 0x9800 | (b & 3u) << 8 | (a & 0x1Fu) << 3 | b >> 5);
      put(p, 0x9513);
      break;
    case 9: /* SEI, WDR, SLEEP in a mode */
      put(p, 0x9478);
      if (a % 3u == 1u) put(p, 0x95A8);
      if (a % 3u == 2u) {
        put_write(p, REG_SMCR, b & 0xFu);
        put(p, 0x9588);
      }
      break;
    case 10: /* wait: DEC r24, BRNE */
      put_load(p, a);
      put(p, 0x958A);
      put(p, 0xF7F1);
      break;
    case 11:
      put(p, a | b << 8);
      break;
    case 12:
      put_write(p, REG_WDTCSR, 0x18);
      put_write(p, REG_WDTCSR, a);
      break;
    case 13: /* SBI EECR, EEMPE and EEPE */
      put(p, 0x9AFA);
      put(p, 0x9AF9);
      break;
    case 14:
      put_write(p, REG_UCSR0B, a | 8u);
      put_write(p, REG_UDR0, b);
      break;
    case 15: /* LDI r31; SPM, which works in the boot section */
      put(p, 0xE0F0 | (b & 0xF0) << 4 | (b & 0xF));
      put_write(p, REG_SPMCSR, a);
      put(p, 0x95E8);
      break;
    default:
      put_write(p, address, b);
  }
}

/* ---- what happens to the boards ---- */

static uint32_t edges[BOARDS]; /* checksum of those of a board */

static void hear_edge(void *context, uint64_t cycle, uint8_t pin, uint8_t level) {
  uint32_t *sum = context;
  *sum = (*sum ^ (uint32_t)cycle ^ (uint32_t)pin << 24 ^ (uint32_t)level << 16) * 0x9E3779B1u;
}

static double voltage(void *context, uint64_t cycle, uint8_t channel) {
  (void)context;
  return channel < 6 ? (double)(cycle % 5000u) / 1000.0 : 5.0;
}

static void happen(board *b, uint64_t now, const uint8_t *choice) {
  const uint64_t at = now + BOARD_GUARD_CYCLES + choice[1] * 8u;
  switch (choice[0] % 8u) {
    case 0:
    case 1:
    case 2:
      b->op->drive(b, at, choice[2] % BOARD_PIN_COUNT, choice[3] % 3u);
      break;
    case 3:
    case 4:
      b->op->send(b, at, choice + 2, 2);
      break;
    case 5:
      b->op->line_rate(b, choice[2] * 1000u);
      break;
    case 6:
      if (choice[2] % 4u == 0) b->op->reset(b, choice[3] % 4u);
      break;
    default:
      if (choice[2] % 4u == 0) b->op->hold(b, choice[3] % 2u);
  }
}

static void check_same(board *a, board *b) {
  board_counters one, other;
  CHECK(a->op->now(a) == b->op->now(b));
  CHECK(memcmp(a->op->extension(a, BOARD_DATA), b->op->extension(b, BOARD_DATA), 32) == 0);
  CHECK(memcmp((uint8_t *)a->op->extension(a, BOARD_DATA) + AVR_RAM_BEGIN,
               (uint8_t *)b->op->extension(b, BOARD_DATA) + AVR_RAM_BEGIN, AVR_DATA_SIZE - AVR_RAM_BEGIN) == 0);
  a->op->counters(a, &one);
  b->op->counters(b, &other);
  CHECK(memcmp(&one, &other, sizeof one) == 0);
  for (uint8_t pin = 0; pin < BOARD_PIN_COUNT; pin++) CHECK(a->op->output(a, pin) == b->op->output(b, pin));
  const char *fault = a->op->fault(a), *other_fault = b->op->fault(b);
  CHECK(!fault == !other_fault && (!fault || !strcmp(fault, other_fault)));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static program p;
  static const uint8_t eeprom[BOARD_EEPROM_SIZE];
  input in = {data, data + size};
  uint8_t choices[SLICES][4];
  for (uint32_t i = 0; i < sizeof choices; i++) choices[i / 4][i % 4] = byte(&in);
  memset(p.flash, 0xFF, sizeof p.flash);
  p.words = 0;
  const unsigned main = choices[0][0] & 8u ? BOOT : MAIN;
  put_interrupts(&p, main);
  while (in.at < in.end) {
    const unsigned kind = byte(&in), a = byte(&in), b = byte(&in);
    put_step(&p, kind, a, b);
  }
  put_jump(&p, main);
  const avr_program loaded = {p.flash, eeprom, BOOT_FUSE, 2 * p.words, AVR_RAM_BEGIN + 64};
  board *boards[BOARDS];
  for (int i = 0; i < BOARDS; i++) {
    boards[i] = avr_board_create(&loaded);
    CHECK(boards[i]);
    boards[i]->sink = hear_edge;
    boards[i]->sink_context = &edges[i];
    boards[i]->op->analog(boards[i], voltage, NULL);
    edges[i] = 0;
  }
  avr_board_no_fast_forward(boards[1]);
  uint64_t now = 0;
  for (uint32_t slice = 0; slice < SLICES; slice++) {
    for (int i = 0; i < BOARDS; i++) happen(boards[i], now, choices[slice]);
    const uint64_t until = now + SLICE + choices[slice][3];
    for (uint64_t cut = now; cut < until; cut += 1u + choices[slice][2]) (void)boards[2]->op->advance(boards[2], cut);
    for (int i = 0; i < BOARDS; i++) (void)boards[i]->op->advance(boards[i], until);
    for (int i = 1; i < BOARDS; i++) {
      check_same(boards[0], boards[i]);
      CHECK(edges[0] == edges[i]);
    }
    now = boards[0]->op->now(boards[0]);
  }
  for (int i = 0; i < BOARDS; i++) boards[i]->op->destroy(boards[i]);
  return 0;
}
