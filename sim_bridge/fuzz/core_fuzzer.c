/* core_fuzzer.c: libFuzzer writes the programs that the AVR core executes, with interrupts, I/O registers that answer and
 * ask, and self-programming at any place. The same program runs in three cores at once: in one go, cut at every cycle, and
 * with all that the board can keep of a run. They do the same; and what is decoded is what is in flash. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_core.h"
#include "avr_decode.h"

#define CORES 3
#define CYCLES 2000u
#define MOST 300u /* cycles to what is due next */
#define INTERRUPT_CYCLES 4u
#define PROGRAM 0x800u
#define PIECE 0x100u

#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      abort();                                                        \
    }                                                                 \
  } while (0)

/* The core's owner: what it does depends on the cycle and the input alone. */
struct avr_board {
  avr_core core;
  uint32_t seed;
  uint64_t halted; /* until that cycle */
  bool ended;      /* at what is no instruction, or outside of the flash */
  bool programs;   /* has executed SPM */
};

static uint32_t mixed(const avr_board *b, uint64_t cycle, uint32_t what) {
  uint64_t z = (cycle + ((uint64_t)what << 40) + b->seed) * 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  return (uint32_t)(z >> 32);
}

static void interrupts_changed(avr_board *b) {
  if ((b->core.raised & b->core.enabled) && b->core.flags.i) avr_stop(&b->core);
}

static void happen(avr_board *b, uint64_t cycle) {
  avr_core *core = &b->core;
  while (core->next_due <= cycle) {
    const uint64_t due = core->next_due;
    if (due > core->clock) core->clock = due;
    core->raised |= 1u << (1u + mixed(b, due, 1) % (VECTOR_COUNT - 1u));
    core->next_due = due + 1u + mixed(b, due, 2) % MOST;
    if (core->next_due < core->until) core->until = core->next_due;
    interrupts_changed(b);
  }
  if (cycle > core->clock) core->clock = cycle;
}

static uint8_t read_register(avr_board *b, uint16_t address, uint64_t cycle) {
  CHECK(cycle <= b->core.clock && b->core.next_due > cycle);
  return (uint8_t)mixed(b, cycle, address);
}

/* A write asks for interrupts, clears some, delays what is due, or halts the CPU. */
static void write_register(avr_board *b, uint16_t address, uint8_t value, uint64_t end) {
  avr_core *core = &b->core;
  CHECK(end <= core->clock + 1u && core->next_due >= end);
  core->data[address] = value;
  switch (address % 4u) {
    case 0:
      core->enabled = mixed(b, 0, value) & ((1u << VECTOR_COUNT) - 2u);
      break;
    case 1:
      core->raised &= ~(uint32_t)value;
      break;
    case 2:
      core->next_due = end + value;
      if (core->next_due < core->until) core->until = core->next_due;
      break;
    default: /* the CPU is halted */
      b->halted = core->cycle += value % 8u;
      avr_stop(core);
  }
  interrupts_changed(b);
}

/* SPM: r1:r0 into flash at Z, at once; the first one may also say that code begins elsewhere. */
static void store_program(avr_board *b) {
  avr_core *core = &b->core;
  const uint32_t address = (core->data[30] | (uint32_t)core->data[31] << 8) % AVR_FLASH_SIZE & ~1u;
  memcpy(core->flash + address, core->data, 2);
  avr_core_flash_changed(core, address, 2);
  if (!b->programs && core->data[0] % 2u) avr_core_set_code(core, core->data[1], core->code_end);
  b->programs = true;
}

static uint8_t load_program(avr_board *b, uint16_t address) { return (uint8_t)mixed(b, 3, address); }

static void never_written(avr_board *b) { CHECK(b->core.written); }

static void left_stack(avr_board *b, uint32_t pc, uint16_t before) {
  (void)before;
  CHECK(pc < AVR_FLASH_SIZE && b->core.code[pc / 2u].kind != INVALID);
}

static void cannot_go_on(avr_board *b, unsigned opcode) {
  CHECK(opcode == (b->core.flash[b->core.pc] | (unsigned)b->core.flash[b->core.pc + 1u] << 8));
  b->ended = true;
}

static const avr_owner_calls CALLS = {
    .happen = happen,
    .store_program = store_program,
    .load_program = load_program,
    .left_stack = left_stack,
    .never_written = never_written,
    .cannot_go_on = cannot_go_on,
};

/* ---- a run ---- */

/* A core as it was made; what was in its flash stays, and is changed only where the next program differs: decoding all of
 * it takes longer than most runs. */
static void renew(avr_core *core) {
  if (!core->flash) CHECK(avr_core_create(core));
  uint8_t *const flash = core->flash;
  avr_instruction *const code = core->code;
  const uint32_t begin = core->code_begin, end = core->code_end;
  memset(core, 0, sizeof *core);
  core->flash = flash;
  core->code = code;
  core->code_begin = begin;
  core->code_end = end;
  avr_core_reset(core, 0);
}

static void write_flash(avr_core *core, const uint8_t *image) {
  for (uint32_t at = 0; at < AVR_FLASH_SIZE; at += PIECE) {
    if (memcmp(core->flash + at, image + at, PIECE) == 0) continue;
    memcpy(core->flash + at, image + at, PIECE);
    avr_core_flash_changed(core, at, PIECE);
  }
}

/* An input: 8 bytes of choices, the registers, then the program, which fills the first PROGRAM bytes of flash again and
 * again. */
static void load(avr_board *b, const uint8_t *data, size_t size) {
  static uint8_t image[AVR_FLASH_SIZE];
  avr_core *core = &b->core;
  uint8_t first[40] = {0};
  memcpy(first, data, size < sizeof first ? size : sizeof first);
  renew(core);
  core->calls = &CALLS;
  core->owner = b;
  b->ended = b->programs = false;
  b->halted = 0;
  memcpy(&b->seed, first, 4);
  memcpy(core->data, first + 8, AVR_IO_BEGIN);
  for (uint32_t at = AVR_IO_BEGIN; at < AVR_RAM_BEGIN; at++) {
    if (at >= REG_SPMCSR && at <= REG_SREG) continue;
    if (mixed(b, 4, at) % 2u) core->reads[at] = read_register;
    if (mixed(b, 5, at) % 2u) core->writes[at] = write_register;
  }
  core->ones = mixed(b, 6, 0);
  core->next_due = 1u + first[4];
  core->stack_floor = (uint16_t)(AVR_RAM_BEGIN + first[5] * 4u);
  core->enabled = mixed(b, 0, first[7]) & ((1u << VECTOR_COUNT) - 2u);
  memset(image, 0xFF, sizeof image);
  for (uint32_t at = 0; at < PROGRAM && size > sizeof first; at++) {
    image[at] = data[sizeof first + at % (size - sizeof first)];
  }
  avr_core_set_code(core, first[7] & 1u, first[6] % 16u == 1u ? PROGRAM - first[6] : AVR_FLASH_SIZE);
  write_flash(core, image);
}

static bool enter_interrupt(avr_core *core) {
  const uint32_t pending = core->raised & core->enabled;
  if (!core->flags.i || core->one_more || !pending) return false;
  const unsigned vector = (unsigned)__builtin_ctz(pending);
  core->raised &= ~(1u << vector);
  avr_enter_interrupt(core, vector);
  core->cycle += INTERRUPT_CYCLES;
  core->sleeping = false;
  return true;
}

static void run_until(avr_board *b, uint64_t until, const avr_stops *stops) {
  avr_core *core = &b->core;
  while (core->cycle < until && !b->ended) {
    happen(b, core->cycle);
    if (enter_interrupt(core)) continue;
    uint64_t horizon = until < core->next_due ? until : core->next_due;
    if (core->sleeping) {
      core->cycle = horizon;
      continue;
    }
    const uint64_t before = core->cycle;
    if (core->one_more) horizon = before + 1u;
    core->one_more = false;
    const bool is_code = core->pc + 2u > core->code_begin && core->pc < core->code_end;
    const uint32_t last = avr_run(core, horizon, stops);
    CHECK(core->pc % 2u == 0 && last % 2u == 0);
    CHECK(core->cycle >= before && (core->cycle > b->halted || b->halted == 0));
    CHECK(is_code || core->cycle == before);
    if (core->cycle == before) b->ended = true;
  }
}

static void check_same(const avr_core *a, const avr_core *b) {
  CHECK(a->pc == b->pc && a->cycle == b->cycle);
  CHECK(avr_core_flags(a) == avr_core_flags(b));
  CHECK(memcmp(a->data, b->data, AVR_DATA_SIZE) == 0);
  CHECK(memcmp(a->flash, b->flash, AVR_FLASH_SIZE) == 0);
  CHECK(a->raised == b->raised && a->enabled == b->enabled && a->sleeping == b->sleeping);
}

/* What it has decoded step by step is what is decoded of the whole flash. */
static void check_decoded(const avr_core *core) {
  static avr_core again;
  renew(&again);
  memcpy(again.flash, core->flash, AVR_FLASH_SIZE);
  avr_core_set_code(&again, core->code_begin, core->code_end);
  avr_core_flash_changed(&again, 0, AVR_FLASH_SIZE);
  CHECK(memcmp(again.code, core->code, AVR_FLASH_SIZE / 2u * sizeof *core->code) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static avr_board boards[CORES];
  static uint8_t written[AVR_DATA_SIZE], covered[AVR_FLASH_SIZE / 2u];
  static avr_stops stops;
  for (int i = 0; i < CORES; i++) load(&boards[i], data, size);
  run_until(&boards[0], CYCLES, NULL);
  for (uint64_t cycle = 1; cycle <= CYCLES; cycle++) run_until(&boards[1], cycle, NULL);
  memset(written, 0, sizeof written);
  boards[2].core.written = written;
  boards[2].core.covered = covered;
  for (uint32_t at = 0; at < AVR_FLASH_SIZE / 2u; at++) stops.marked[at] = mixed(&boards[2], 7, at) % 8u == 0;
  stops.lowest = (uint16_t)(mixed(&boards[2], 8, 0) % AVR_DATA_SIZE);
  stops.highest = AVR_DATA_SIZE;
  run_until(&boards[2], CYCLES, &stops);
  for (int i = 1; i < CORES; i++) check_same(&boards[0].core, &boards[i].core);
  if (boards[0].programs) check_decoded(&boards[0].core);
  return 0;
}
