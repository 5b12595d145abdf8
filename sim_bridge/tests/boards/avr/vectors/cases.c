/* cases.c: what single instructions do. Prints, for the machine that it is linked with:
 *
 * 1. which opcodes are instructions of the chip;
 * 2. of each instruction some lines to read: before, after;
 * 3. of each opcode more cases, of which only a checksum is printed for some of them together;
 * 4. of arithmetic all results, by a checksum for each value of Rd or K.
 *
 *   line:  0100: 0C12 ADD r1=7F r2=01 ithsvnzc > r1=80 itHsVNzc 0101 1
 *          address of the instruction (words): its word or words, name, operands and flags (capital: set) before it, all
 *          cells that it changes, flags and address after it, cycles
 *
 * The state before an instruction is drawn from the instruction's number and the case's: all 32 registers, the flags,
 * SP, pointers, one RAM. Left out, as the manual or the data sheet leaves open what happens: loads and stores that move
 * the very pointer that they load or store; addresses outside of data memory, beyond flash, or behind its end; SP in its own
 * registers. I/O registers: those that do nothing but store (GPIOR0 to 2), SREG and SP. */
#include <stdio.h>
#include <string.h>

#include "instructions.h"
#include "vectors.h"

#define LINES 40u    /* of an instruction */
#define STATES 4u    /* of an opcode */
#define TOGETHER 64u /* cases in a checksum */
#define GPIOR0 0x3Eu /* data addresses; data sheet, section 30 */
#define GPIOR1 0x4Au
#define GPIOR2 0x4Bu
#define RAM 0x100u
#define AT 0x1000u /* where an instruction is, when this does not matter (words) */

bool for_witness;

static uint8_t background[DATA_SIZE]; /* of all cases; I/O registers are 0 */
static uint16_t program[FLASH_SIZE / 2];

/* ---- the state before ---- */

typedef struct {
  const instruction *which;
  uint16_t words[3];
  int reads[2]; /* cells to be shown; -1: none */
  uint8_t before[DATA_SIZE];
  machine_state start, end;
} trial;

static uint8_t any_value(numbers *from) {
  static const uint8_t edges[] = {0x00, 0x01, 0x0F, 0x10, 0x7F, 0x80, 0xF0, 0xFF};
  return one_in(from, 2) ? edges[below(from, sizeof edges)] : (uint8_t)draw(from);
}

/* A cell of data memory that a load or a store can reach. */
static uint32_t any_cell(numbers *from) {
  static const uint16_t edges[] = {RAM, RAM + 1, 0x1FF, 0x200, DATA_SIZE - 2, DATA_SIZE - 1};
  static const uint16_t io[] = {GPIOR0, GPIOR1, GPIOR2, SPL, SPH, SREG};
  switch (below(from, 8)) {
    case 0:
      return edges[below(from, sizeof edges / sizeof *edges)];
    case 1:
      return below(from, 32);
    case 2:
      return for_witness ? between(from, SPL, SREG) : io[below(from, sizeof io / sizeof *io)];
    default:
      return between(from, RAM, DATA_SIZE - 1);
  }
}

/* Where `bytes` of a stack can be, the upper one's address: RAM, and in few cases registers, where QEMU's calls find none. */
static uint32_t any_stack(numbers *from, uint32_t bytes) {
  return !for_witness && one_in(from, 8) ? between(from, bytes, 31) : between(from, RAM + bytes - 1, DATA_SIZE - 1);
}

static void put_word(uint8_t *cells, uint32_t value) {
  cells[0] = (uint8_t)value;
  cells[1] = (uint8_t)(value >> 8);
}

/* Where RJMP and RCALL are: anywhere; for QEMU where they do not lead over the ends of flash, which it has no ring for. */
static uint32_t any_near(numbers *from) {
  return for_witness ? between(from, 0x800, FLASH_SIZE / 2 - 0x801) : below(from, FLASH_SIZE / 2 - 1);
}

static uint16_t any_code_word(numbers *from) { return (uint16_t)below(from, FLASH_SIZE / 2); }

/* What a skip can be in front of: of one and of two words. */
static uint16_t any_next(numbers *from) {
  static const uint16_t words[] = {
      0x0000, 0x9409, 0x900F, 0x920F, 0x9508, 0x9408, 0x940A, 0x900C, 0x960C, 0x97FE, 0xFFFF, /* one */
      0x9000, 0x91F0, 0x9200, 0x93F0, 0x940C, 0x940E, 0x95FD, 0x95FF, 0x940D}; /* two: LDS, STS, JMP, CALL */
  return words[below(from, sizeof words / sizeof *words)];
}

/* The state of a case: false: there is none for this opcode. */
static bool prepare(trial *t, const instruction *which, uint16_t opcode, numbers *from) {
  if (is_undefined(which, opcode)) return false;
  uint8_t *cells = t->before;
  memcpy(cells, background, DATA_SIZE);
  t->which = which;
  t->reads[0] = t->reads[1] = -1;
  t->words[0] = opcode;
  t->words[1] = any_next(from);
  t->words[2] = any_code_word(from);
  const uint8_t equal = any_value(from);
  const bool all_equal = one_in(from, 8);
  for (int r = 0; r < 32; r++) cells[r] = all_equal ? equal : any_value(from);
  cells[GPIOR0] = any_value(from);
  put_word(cells + SPL, between(from, RAM + 2, DATA_SIZE - 3));
  t->start.pc = 2u * between(from, 0x80, FLASH_SIZE / 2 - 0x80);
  t->start.flags = (uint8_t)draw(from);
  t->start.cycle = 0;

  const uint32_t q = (uint32_t)instruction_field(which, opcode, 'q');
  uint32_t cell;
  switch (which->needs) {
    case POINTER:
      do {
        cell = any_cell(from);
      } while ((int)q > (int)cell || (which->moves && (cell & ~1u) == which->pointer));
      put_word(cells + which->pointer, cell - ((int)q > 0 ? q : 0) + (which->moves < 0));
      if (instruction_field(which, opcode, 'd') >= 0) t->reads[0] = (int)cell;
      break;
    case DIRECT:
      cell = any_cell(from);
      t->words[1] = (uint16_t)cell;
      if (instruction_field(which, opcode, 'd') >= 0) t->reads[0] = (int)cell;
      break;
    case PROGRAM:
      put_word(cells + 30, below(from, FLASH_SIZE));
      break;
    case PUSH:
      put_word(cells + SPL, any_stack(from, 1));
      break;
    case NEAR_CALL:
    case FAR_CALL:
    case INDIRECT_CALL:
      put_word(cells + SPL, any_stack(from, 2));
      if (which->needs == NEAR_CALL) t->start.pc = 2u * any_near(from);
      if (which->needs == FAR_CALL) t->words[1] = any_code_word(from);
      if (which->needs == INDIRECT_CALL) put_word(cells + 30, any_code_word(from));
      break;
    case POP:
      cell = any_stack(from, 1);
      put_word(cells + SPL, cell - 1);
      t->reads[0] = (int)cell;
      break;
    case RETURN:
      cell = any_stack(from, 2);
      put_word(cells + SPL, cell - 2);
      cells[cell - 1] &= FLASH_SIZE / 2 / 256 - 1; /* the upper byte of an address */
      t->reads[0] = (int)cell - 1;
      t->reads[1] = (int)cell;
      break;
    case NEAR:
      t->start.pc = 2u * any_near(from);
      break;
    case FAR:
      t->words[1] = any_code_word(from);
      break;
    case INDIRECT:
      put_word(cells + 30, any_code_word(from));
      break;
    case PORT:
    case PORT_SKIP:
      t->reads[0] = instruction_field(which, opcode, 'A') + 0x20;
      break;
    default:
      break;
  }
  return true;
}

/* Whether there are cases for its operands: of I/O registers some, of jumps the second word alone. */
static bool is_operand(const instruction *which, uint16_t opcode) {
  const int port = instruction_field(which, opcode, 'A');
  if (which->needs == FAR || which->needs == FAR_CALL) return instruction_field(which, opcode, 'k') == 0;
  if (port < 0) return true;
  const uint32_t cell = (uint32_t)port + 0x20;
  if (for_witness) return cell >= SPL && cell <= SREG;
  return cell == GPIOR0 || cell == GPIOR1 || cell == GPIOR2 || (cell >= SPL && cell <= SREG);
}

/* ---- execution ---- */

static void write_words(uint32_t pc, const uint16_t *words) {
  for (uint32_t i = 0; i < 3; i++) machine_write_flash((pc + 2 * i) % FLASH_SIZE, words[i]);
}

static bool execute(trial *t) {
  write_words(t->start.pc, t->words);
  memcpy(machine_data(), t->before, DATA_SIZE);
  machine_set(&t->start);
  const bool valid = machine_run(1);
  t->end = machine_get();
  uint16_t old[3];
  for (uint32_t i = 0; i < 3; i++) old[i] = program[(t->start.pc / 2 + i) % (FLASH_SIZE / 2)];
  write_words(t->start.pc, old);
  return valid;
}

/* ---- lines ---- */

typedef struct {
  char text[512];
  size_t length;
} line;

static void add_text(line *to, const char *text) {
  while (*text) to->text[to->length++] = *text++;
}

static void add_hex(line *to, uint32_t value, int digits) {
  while (digits--) to->text[to->length++] = "0123456789ABCDEF"[value >> 4 * digits & 0xF];
}

static void add_number(line *to, uint32_t value) {
  if (value > 9) add_number(to, value / 10);
  to->text[to->length++] = (char)('0' + value % 10);
}

static void add_flags(line *to, uint8_t flags) {
  for (int bit = 7; bit >= 0; bit--) to->text[to->length++] = (flags >> bit & 1 ? "CZNVSHTI" : "cznvshti")[bit];
  add_text(to, " ");
}

static void add_cell(line *to, uint32_t cell, uint8_t value) {
  if (cell < 32) {
    add_text(to, "r");
    add_number(to, cell);
  } else if (cell == SPL || cell == SPH) {
    add_text(to, cell == SPL ? "SPL" : "SPH");
  } else {
    add_text(to, "[");
    add_hex(to, cell, 3);
    add_text(to, "]");
  }
  add_text(to, "=");
  add_hex(to, value, 2);
  add_text(to, " ");
}

static void add_operands(line *to, const trial *t) {
  for (const char *letter = "dherwif"; *letter; letter++) {
    const int r = instruction_register(t->which, t->words[0], *letter);
    if (r < 0) continue;
    add_cell(to, (uint32_t)r, t->before[r]);
    if (*letter == 'e' || *letter == 'f' || *letter == 'w') add_cell(to, (uint32_t)r + 1, t->before[r + 1]);
  }
  const need needs = t->which->needs;
  const int pointer = needs == INDIRECT || needs == INDIRECT_CALL ? 30 : t->which->pointer;
  for (int r = pointer; r && r < pointer + 2; r++) add_cell(to, (uint32_t)r, t->before[r]);
  if (needs == PUSH || needs == POP || needs == RETURN || needs == NEAR_CALL || needs == FAR_CALL ||
      needs == INDIRECT_CALL) {
    for (uint32_t cell = SPL; cell <= SPH; cell++) add_cell(to, cell, t->before[cell]);
  }
  for (const int *cell = t->reads; cell < t->reads + 2; cell++) {
    if (*cell >= 32 && *cell != SREG) add_cell(to, (uint32_t)*cell, t->before[*cell]);
  }
}

static void write_line(line *to, const trial *t, bool valid) {
  to->length = 0;
  const need needs = t->which->needs;
  const bool two = needs == DIRECT || needs == FAR || needs == FAR_CALL;
  const bool skips = needs == SKIP || needs == PORT_SKIP;
  add_hex(to, t->start.pc / 2, 4);
  add_text(to, ": ");
  add_hex(to, t->words[0], 4);
  add_text(to, two || skips ? " " : "");
  if (two || skips) add_hex(to, t->words[1], 4);
  add_text(to, " ");
  add_text(to, t->which->name);
  add_text(to, " ");
  add_operands(to, t);
  add_flags(to, t->start.flags);
  add_text(to, "> ");
  const uint8_t *now = machine_data();
  for (uint32_t cell = 0; cell < DATA_SIZE; cell++) {
    if (now[cell] != t->before[cell] && cell != SREG) add_cell(to, cell, now[cell]);
  }
  add_flags(to, t->end.flags);
  add_hex(to, t->end.pc / 2, 4);
  if (!for_witness) {
    add_text(to, " ");
    add_number(to, (uint32_t)t->end.cycle);
  }
  add_text(to, valid ? "\n" : " invalid\n");
  to->text[to->length] = 0;
}

/* ---- 1. all opcodes ---- */

/* SBRS and its like with bit 3 set: the manual has no such instruction; left out, but for erased flash. */
static bool is_reserved(uint32_t opcode) { return (opcode & 0xF808) == 0xF808 && opcode != 0xFFFF; }

static bool is_instruction(uint32_t opcode) {
  uint8_t *cells = machine_data();
  const uint16_t words[3] = {(uint16_t)opcode, 0x0200, 0};
  const machine_state start = {2 * AT, 0, 0};
  memcpy(cells, background, DATA_SIZE);
  for (uint32_t pointer = 26; pointer < 32; pointer += 2) put_word(cells + pointer, 0x200);
  put_word(cells + SPL, 0x400);
  write_words(start.pc, words);
  machine_set(&start);
  return machine_run(1);
}

static void print_opcodes(void) {
  printf("# opcodes that are instructions\n");
  uint32_t first = 0, last = 0;
  bool before = false;
  for (uint32_t opcode = 0; opcode <= 0x10000; opcode++) {
    if (is_reserved(opcode)) continue;
    const bool valid = opcode < 0x10000 && is_instruction(opcode);
    if (valid && !before) first = opcode;
    if (!valid && before) printf(first == last ? "%04X\n" : "%04X-%04X\n", first, last);
    if (valid) last = opcode;
    before = valid;
  }
  write_words(2 * AT, program + AT);
}

/* ---- 2. lines ---- */

static uint16_t any_opcode(const instruction *which, numbers *from) {
  uint16_t opcode;
  do {
    opcode = (uint16_t)((draw(from) & ~(unsigned)instruction_mask(which)) | instruction_value(which));
  } while (!is_operand(which, opcode) || is_undefined(which, opcode));
  return opcode;
}

static void print_lines(void) {
  trial t;
  line out;
  printf("# cases\n");
  for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
    const instruction *which = &INSTRUCTIONS[i];
    const uint16_t operands = (uint16_t)~instruction_mask(which);
    const uint32_t count = operands || which->needs == SKIP ? LINES : LINES / 4;
    for (uint32_t n = 0; n < count; n++) {
      numbers from = numbers_of(i, n);
      if (!prepare(&t, which, any_opcode(which, &from), &from)) continue;
      const bool valid = execute(&t);
      write_line(&out, &t, valid);
      fwrite(out.text, 1, out.length, stdout);
    }
  }
}

/* ---- 3. more cases of each opcode ---- */

#define CHECKSUMS -1
#define EVERY_LINE -2

/* The checksums of an instruction, or the lines of one of them, or all lines. */
static void print_more_of(size_t i, int chunk) {
  const instruction *which = &INSTRUCTIONS[i];
  const unsigned operands = (uint16_t)~instruction_mask(which);
  trial t;
  line out;
  uint32_t crc = 0, cases = 0;
  unsigned at = 0;
  do {
    const uint16_t opcode = (uint16_t)(instruction_value(which) | at);
    for (uint32_t n = 0; n < STATES && is_operand(which, opcode); n++) {
      numbers from = numbers_of(0x10000u + opcode, n);
      if (!prepare(&t, which, opcode, &from)) continue;
      const bool valid = execute(&t);
      write_line(&out, &t, valid);
      if (chunk == EVERY_LINE || chunk == (int)(cases / TOGETHER)) fwrite(out.text, 1, out.length, stdout);
      crc = crc32_of(crc, out.text, out.length);
      if (++cases % TOGETHER == 0 && chunk == CHECKSUMS) printf(" %08X", crc);
    }
    at = (at - operands) & operands; /* the next number in the operands' bits */
  } while (at);
  if (cases % TOGETHER && chunk == CHECKSUMS) printf(" %08X", crc);
}

static void print_more(void) {
  printf("# checksums of %u cases each\n", TOGETHER);
  for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
    printf("%s:", INSTRUCTIONS[i].name);
    print_more_of(i, CHECKSUMS);
    printf("\n");
  }
}

/* ---- 4. all results ---- */

static const uint8_t FLAGS[] = {0x00, 0xFD, 0x02, 0xFF}; /* C and Z in all ways, the others both ways */
#define FIRST 17u                                        /* Rd; Rr is the next one */

static uint32_t result_of(uint32_t crc, uint8_t flags, uint32_t cell, uint32_t bytes) {
  const machine_state start = {2 * AT, 0, flags};
  machine_set(&start);
  machine_run(1);
  uint8_t result[3];
  memcpy(result, machine_data() + cell, bytes);
  result[bytes] = machine_get().flags;
  return crc32_of(crc, result, bytes + 1);
}

/* Of a row's value all values of the other operand with each of FLAGS: the result, or r1:r0, and the flags. */
static void print_two(const instruction *which) {
  const bool multiplies = strstr(which->name, "MUL") != NULL;
  const bool constant = strchr(which->bits, 'K') != NULL;
  uint8_t *cells = machine_data();
  for (uint32_t row = 0; row < 256; row++) {
    uint16_t opcode = instruction_value(which) | (strchr(which->bits, 'h') ? (FIRST - 16) << 4 : FIRST << 4);
    if (constant) {
      opcode |= (uint16_t)((row & 0xF0) << 4 | (row & 0xF));
    } else {
      opcode |= strchr(which->bits, 'i') ? FIRST + 1 - 16 : 0x200 | (FIRST + 1 - 16);
    }
    if (row == 0 || constant) machine_write_flash(2 * AT, opcode);
    uint32_t crc = 0;
    for (uint32_t f = 0; f < sizeof FLAGS; f++) {
      for (uint32_t value = 0; value < 256; value++) {
        cells[FIRST] = (uint8_t)(constant ? value : row);
        if (!constant) cells[FIRST + 1] = (uint8_t)value;
        crc = multiplies ? result_of(crc, FLAGS[f], 0, 2) : result_of(crc, FLAGS[f], FIRST, 1);
      }
    }
    printf(" %08X", crc);
  }
}

/* Of each set of flags all values of Rd. */
static void print_one(const instruction *which) {
  machine_write_flash(2 * AT, (uint16_t)(instruction_value(which) | FIRST << 4));
  for (uint32_t flags = 0; flags < 256; flags++) {
    uint32_t crc = 0;
    for (uint32_t value = 0; value < 256; value++) {
      machine_data()[FIRST] = (uint8_t)value;
      crc = result_of(crc, (uint8_t)flags, FIRST, 1);
    }
    printf(" %08X", crc);
  }
}

/* Of each K all values of r25:r24, with some flags. */
static void print_word(const instruction *which) {
  for (uint32_t k = 0; k < 64; k++) {
    uint32_t crc = 0;
    machine_write_flash(2 * AT, (uint16_t)(instruction_value(which) | (k & 0x30) << 2 | (k & 0xF)));
    for (uint32_t value = 0; value < 0x10000; value++) {
      put_word(machine_data() + 24, value);
      crc = result_of(crc, FLAGS[k % sizeof FLAGS], 24, 2);
    }
    printf(" %08X", crc);
  }
}

static void print_results(void) {
  static const struct {
    void (*print)(const instruction *which);
    const char *names[16];
  } WAYS[] = {
      {print_two,
       {"ADD", "ADC", "SUB", "SBC", "CP", "CPC", "AND", "EOR", "OR", "MUL", "MULS", "MULSU", "FMUL", "FMULS",
        "FMULSU"}},
      {print_two, {"CPI", "SBCI", "SUBI", "ORI", "ANDI"}},
      {print_one, {"COM", "NEG", "SWAP", "INC", "DEC", "ASR", "LSR", "ROR"}},
      {print_word, {"ADIW", "SBIW"}},
  };
  printf("# checksums of all results, for each value of Rd or K, or for each set of flags\n");
  for (size_t way = 0; way < sizeof WAYS / sizeof *WAYS; way++) {
    for (const char *const *name = WAYS[way].names; *name; name++) {
      for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
        if (strcmp(INSTRUCTIONS[i].name, *name) != 0) continue;
        printf("%s:", *name);
        WAYS[way].print(&INSTRUCTIONS[i]);
        printf("\n");
      }
    }
  }
}

/* ---- all ---- */

static void fill(void) {
  numbers from = numbers_of(1u << 20, 0);
  for (uint32_t cell = RAM; cell < DATA_SIZE; cell++) background[cell] = (uint8_t)draw(&from);
  for (uint32_t cell = 0; cell < 32; cell++) background[cell] = (uint8_t)draw(&from);
  background[GPIOR1] = (uint8_t)draw(&from);
  background[GPIOR2] = (uint8_t)draw(&from);
  for (uint32_t at = 0; at < FLASH_SIZE / 2; at++) {
    program[at] = (uint16_t)draw(&from);
    machine_write_flash(2 * at, program[at]);
  }
}

void print_cases(void) {
  fill();
  print_opcodes();
  print_lines();
  print_more();
  print_results();
}

void print_chunk(const char *name, int chunk) {
  fill();
  for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
    if (!strcmp(INSTRUCTIONS[i].name, name)) print_more_of(i, chunk);
  }
}

/* Skips end in the middle where a debugger stops QEMU behind them; programs have them. */
void print_witness_cases(void) {
  for_witness = true;
  fill();
  for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
    const char *const stops[] = {"SLEEP", "BREAK", "WDR", "SPM"};
    const need needs = INSTRUCTIONS[i].needs;
    bool stopping = needs == SKIP || needs == PORT_SKIP;
    for (size_t k = 0; k < sizeof stops / sizeof *stops; k++) stopping |= !strcmp(INSTRUCTIONS[i].name, stops[k]);
    if (!stopping) print_more_of(i, EVERY_LINE);
  }
}
