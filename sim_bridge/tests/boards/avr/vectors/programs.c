/* programs.c: what random programs do. Prints, for the machine that it is linked with, of each program where it is and a
 * checksum of its memory at fixed intervals of cycles:
 *
 *   cycle address SP flags checksum     address in words; the checksum is that of r0 to r31, I/O registers and RAM
 *
 * A program goes round: some hundred groups of instructions, then a jump to its start. A group leaves the stack as it
 * found it, and loads a pointer before it uses it, so that all accesses are to what the chip has. It branches, skips and
 * jumps forward over other groups, counts loops down, calls subroutines, and has data between its instructions. */
#include <stdio.h>
#include <string.h>

#include "instructions.h"
#include "vectors.h"

#define PROGRAMS 48u
#define STOPS 24u
#define CYCLES 5000u /* from one stop to the next, about */
#define GROUPS 300u
#define SUBROUTINES 6u
#define RAM 0x100u
#define GPIOR0 0x3Eu
#define IO 0x20u /* data address of I/O register 0 */

typedef struct {
  numbers random;
  uint16_t words[FLASH_SIZE / 2];
  uint32_t at;       /* next word */
  int kept;          /* register that only its loop may change; -1: none */
  uint32_t callable; /* first of `subroutines` that may be called from here */
  uint32_t subroutines[SUBROUTINES];
} maker;

static void emit(maker *m, uint32_t word) { m->words[m->at++] = (uint16_t)word; }

/* ---- single instructions ---- */

static uint16_t with(const char *name, uint32_t operands) {
  for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
    if (!strcmp(INSTRUCTIONS[i].name, name)) return (uint16_t)(instruction_value(&INSTRUCTIONS[i]) | operands);
  }
  return 0;
}

static uint32_t d_of(uint32_t d) { return d << 4; }
static uint32_t h_of(uint32_t d) { return (d - 16) << 4; }
static uint32_t k_of(uint32_t k) { return (k & 0xF0) << 4 | (k & 0xF); }
static uint32_t a_of(uint32_t cell) { return ((cell - IO) & 0x30) << 5 | ((cell - IO) & 0xF); }

static void emit_ldi(maker *m, uint32_t d, uint32_t k) { emit(m, with("LDI", h_of(d) | k_of(k))); }

static uint32_t any_register(maker *m) {
  uint32_t d;
  do {
    d = below(&m->random, 32);
  } while ((int)d == m->kept);
  return d;
}

static bool spoils_kept(const maker *m, const instruction *which, uint16_t opcode) {
  if (m->kept < 0) return false;
  for (const char *letter = "dhew"; *letter; letter++) {
    const int r = instruction_register(which, opcode, *letter);
    if (r >= 0 && (r | 1) == (m->kept | 1)) return true;
  }
  return false;
}

/* Any that needs nothing but registers. */
static void emit_plain(maker *m) {
  const instruction *which;
  uint16_t opcode;
  do {
    do {
      which = &INSTRUCTIONS[below(&m->random, (uint32_t)INSTRUCTION_COUNT)];
    } while (which->needs != PLAIN || !strcmp(which->name, "SLEEP") || !strcmp(which->name, "BREAK") ||
             (for_witness && !strcmp(which->name, "WDR")));
    opcode = (uint16_t)((draw(&m->random) & ~(unsigned)instruction_mask(which)) | instruction_value(which));
  } while (spoils_kept(m, which, opcode));
  emit(m, opcode);
}

static void emit_direct(maker *m) {
  const uint32_t cell = !for_witness && one_in(&m->random, 6) ? GPIOR0 : between(&m->random, RAM, 0x8BF);
  if (one_in(&m->random, 2)) {
    emit(m, with("LDS", d_of(any_register(m))));
  } else {
    emit(m, with("STS", d_of(below(&m->random, 32))));
  }
  emit(m, cell);
}

static void emit_port(maker *m) {
  static const uint8_t cells[] = {GPIOR0, 0x4A, 0x4B, SPL, SPH, SREG};
  const uint32_t bit = (GPIOR0 - IO) << 3 | below(&m->random, 8);
  switch (below(&m->random, for_witness ? 1 : 5)) {
    case 0:
      emit(m, with("IN", d_of(any_register(m)) | a_of(for_witness ? between(&m->random, SPL, SREG)
                                                                  : cells[below(&m->random, sizeof cells)])));
      break;
    case 1:
      emit(m, with("OUT", d_of(below(&m->random, 32)) | a_of(cells[below(&m->random, 3)])));
      break;
    case 2:
      emit(m, with("OUT", d_of(below(&m->random, 32)) | a_of(SREG)));
      break;
    case 3:
      emit(m, with("SBI", bit));
      break;
    default:
      emit(m, with("CBI", bit));
  }
}

static void emit_one(maker *m) {
  switch (below(&m->random, 8)) {
    case 0:
      emit_direct(m);
      break;
    case 1:
      emit_port(m);
      break;
    default:
      emit_plain(m);
  }
}

/* ---- groups ---- */

/* X, Y or Z into RAM, one access. */
static void emit_pointer(maker *m) {
  const instruction *which;
  uint16_t opcode;
  do {
    do {
      which = &INSTRUCTIONS[below(&m->random, (uint32_t)INSTRUCTION_COUNT)];
    } while (which->needs != POINTER);
    opcode = (uint16_t)((draw(&m->random) & ~(unsigned)instruction_mask(which)) | instruction_value(which));
  } while (is_undefined(which, opcode) || spoils_kept(m, which, opcode) || which->pointer == (m->kept & ~1));
  emit_ldi(m, which->pointer + 1u, between(&m->random, 2, 7));
  emit(m, opcode);
}

static void emit_program(maker *m) {
  static const char *const names[] = {"LPM", "LPM Z", "LPM Z+"};
  const char *name = names[below(&m->random, 3)];
  if ((m->kept & ~1) == 30) return;
  const uint32_t d = strcmp(name, "LPM") ? any_register(m) % 30 : 0;
  emit_ldi(m, 31, below(&m->random, FLASH_SIZE >> 8));
  emit(m, with(name, d_of(d)));
}

static void emit_skip(maker *m) {
  const uint32_t bit = below(&m->random, 8);
  switch (for_witness ? below(&m->random, 3) : below(&m->random, 5)) {
    case 0:
      emit(m, with("CPSE", (uint32_t)draw(&m->random) & 0x3FF));
      break;
    case 1:
      emit(m, with("SBRC", d_of(below(&m->random, 32)) | bit));
      break;
    case 2:
      emit(m, with("SBRS", d_of(below(&m->random, 32)) | bit));
      break;
    case 3:
      emit(m, with("SBIC", (GPIOR0 - IO) << 3 | bit));
      break;
    default:
      emit(m, with("SBIS", (GPIOR0 - IO) << 3 | bit));
  }
  emit_one(m);
}

static void emit_stack(maker *m) {
  emit(m, with("PUSH", d_of(below(&m->random, 32))));
  if (one_in(&m->random, 2)) emit_one(m);
  emit(m, with("POP", d_of(any_register(m))));
}

/* What functions of avr-gcc do for their variables. */
static void emit_frame(maker *m) {
  const uint32_t bytes = between(&m->random, 1, 20);
  const uint32_t operands = 2u << 4 | (bytes & 0x30) << 2 | (bytes & 0xF);
  if ((m->kept & ~1) == 28) return;
  emit(m, with("IN", d_of(28) | a_of(SPL)));
  emit(m, with("IN", d_of(29) | a_of(SPH)));
  for (int way = 0; way < 2; way++) {
    emit(m, with(way ? "ADIW" : "SBIW", operands));
    emit(m, with("OUT", d_of(29) | a_of(SPH)));
    emit(m, with("OUT", d_of(28) | a_of(SPL)));
    if (!way) emit(m, with("STD Y", d_of(below(&m->random, 32)) | between(&m->random, 1, bytes < 7 ? bytes : 7)));
  }
}

static void emit_call(maker *m) {
  if (m->callable >= SUBROUTINES || m->kept >= 0) return;
  const uint32_t address = m->subroutines[between(&m->random, m->callable, SUBROUTINES - 1)];
  const uint32_t way = below(&m->random, 3), distance = (address - m->at - 1) & 0xFFF;
  if (way == 0) {
    emit(m, with("CALL", 0));
    emit(m, address);
  } else if (way == 1 && (address - m->at - 1 + 0x800) % (FLASH_SIZE / 2) < 0x1000) {
    emit(m, with("RCALL", distance));
  } else {
    emit_ldi(m, 30, address & 0xFF);
    emit_ldi(m, 31, address >> 8);
    emit(m, with("ICALL", 0));
  }
}

/* Over data. */
static void emit_jump(maker *m) {
  const uint32_t words = between(&m->random, 0, 3);
  const uint32_t way = below(&m->random, 3);
  if (way == 0) {
    emit(m, with("RJMP", words));
  } else if (way == 1 || (m->kept & ~1) == 30) {
    emit(m, with("JMP", 0));
    emit(m, m->at + 1 + words);
  } else {
    const uint32_t address = m->at + 3 + words;
    emit_ldi(m, 30, address & 0xFF);
    emit_ldi(m, 31, address >> 8);
    emit(m, with("IJMP", 0));
  }
  for (uint32_t word = 0; word < words; word++) emit(m, (uint32_t)draw(&m->random));
}

static void emit_group(maker *m, int depth);

static void emit_branch(maker *m) {
  const uint32_t branch = m->at;
  emit(m, 0);
  for (uint32_t groups = between(&m->random, 0, 2); groups > 0; groups--) emit_group(m, 0);
  const uint32_t operands = (m->at - branch - 1) << 3 | below(&m->random, 8);
  m->words[branch] = with(one_in(&m->random, 2) ? "BRBS" : "BRBC", operands);
}

static void emit_loop(maker *m) {
  if (m->kept >= 0) return;
  const uint32_t counter = between(&m->random, 16, 25);
  emit_ldi(m, counter, between(&m->random, 1, 6));
  m->kept = (int)counter;
  const uint32_t start = m->at;
  for (uint32_t groups = between(&m->random, 1, 3); groups > 0; groups--) emit_group(m, 0);
  m->kept = -1;
  emit(m, with("DEC", d_of(counter)));
  emit(m, with("BRBC", ((start - m->at - 1) & 0x7F) << 3 | 1)); /* BRNE */
}

static void emit_group(maker *m, int depth) {
  static void (*const ways[])(maker *) = {emit_one,  emit_one,    emit_one,    emit_one,  emit_pointer, emit_pointer,
                                          emit_skip, emit_skip,   emit_stack,  emit_jump, emit_program, emit_frame,
                                          emit_call, emit_branch, emit_branch, emit_loop};
  const uint32_t count = (uint32_t)(sizeof ways / sizeof *ways);
  ways[below(&m->random, depth > 0 ? count : count - 4)](m);
}

/* ---- a program ---- */

static void make(maker *m, uint64_t seed) {
  m->random = numbers_of(1u << 21, seed);
  m->kept = -1;
  for (uint32_t at = 0; at < FLASH_SIZE / 2; at++) m->words[at] = (uint16_t)draw(&m->random);
  /* Subroutines call only those behind them. */
  for (uint32_t i = 0; i < SUBROUTINES; i++) m->subroutines[i] = 0x2000 + 0x200 * i;
  for (uint32_t i = 0; i < SUBROUTINES; i++) {
    m->at = m->subroutines[i];
    m->callable = i + 1;
    for (uint32_t groups = between(&m->random, 1, 12); groups > 0; groups--) emit_group(m, 1);
    emit(m, with(one_in(&m->random, 4) ? "RETI" : "RET", 0));
  }
  m->at = 0;
  m->callable = 0;
  for (uint32_t groups = 0; groups < GROUPS; groups++) emit_group(m, 1);
  emit(m, with("JMP", 0));
  emit(m, 0);
}

static uint32_t checksum(void) {
  machine_data()[SREG] = 0;
  return crc32_of(0, machine_data(), DATA_SIZE);
}

static void load(uint64_t seed) {
  static maker m;
  make(&m, seed);
  for (uint32_t at = 0; at < FLASH_SIZE / 2; at++) machine_write_flash(2 * at, m.words[at]);
  uint8_t *cells = machine_data();
  memset(cells, 0, DATA_SIZE);
  for (uint32_t cell = RAM; cell < DATA_SIZE; cell++) cells[cell] = (uint8_t)draw(&m.random);
  for (uint32_t cell = 0; cell < 32; cell++) cells[cell] = (uint8_t)draw(&m.random);
  cells[SPL] = 0xFF; /* at the end of RAM */
  cells[SPH] = 0x08;
  const machine_state start = {0, 0, (uint8_t)draw(&m.random)};
  machine_set(&start);
}

void print_program(uint64_t seed, uint32_t stops) {
  printf("program %llu:\n", (unsigned long long)seed);
  load(seed);
  numbers random = numbers_of(1u << 22, seed);
  uint64_t until = 0;
  for (uint32_t stop = 0; stop < stops; stop++) {
    until += between(&random, 1, 2 * CYCLES);
    const bool valid = machine_run(until);
    const machine_state now = machine_get();
    const uint8_t *cells = machine_data();
    printf("%llu %04X %02X%02X %02X %08X%s\n", (unsigned long long)now.cycle, now.pc / 2, cells[SPH], cells[SPL],
           now.flags, checksum(), valid ? "" : " invalid");
    if (!valid) return;
  }
}

void print_programs(void) {
  printf("# random programs: cycle, address, SP, flags, checksum of memory\n");
  for (uint64_t seed = 0; seed < PROGRAMS; seed++) print_program(seed, STOPS);
}

void print_witness_program(uint64_t seed, uint32_t rounds) {
  for_witness = true;
  load(seed);
  for (uint32_t round = 0; round < rounds; round++) {
    const bool came_round = machine_go_round();
    const uint8_t *cells = machine_data();
    printf("%llu %u: %02X%02X %02X %08X%s\n", (unsigned long long)seed, round, cells[SPH], cells[SPL],
           machine_get().flags, checksum(), came_round ? "" : " not at its start");
  }
}
