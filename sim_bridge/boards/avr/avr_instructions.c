/* avr_instructions.c: see avr_instructions.h. After the AVR instruction set manual; cycles are those of AVRe+ with a
 * 16-bit program counter. sim_bridge/tests/test_avr_instructions.py has each opcode executed here and by simavr.
 *
 * Left to simavr is whatever reaches an I/O register or the interrupt system, or leaves flash or RAM.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include "avr_instructions.h"

#include "avr_parts.h"
#include "sim_core.h"

#define RAM_BEGIN 0x100u
#define REG_SPMCSR 0x57u
#define SKIPPED_MASK 0xFE0Fu

enum { X = 26, Y = 28, Z = 30 };

/* What is executed here; UNCOMMON is simavr's. */
enum {
  UNCOMMON,
  NOP,
  MOVW,
  CPC,
  SBC,
  ADD,
  CPSE,
  CP,
  SUB,
  ADC,
  AND,
  EOR,
  OR,
  MOV,
  CPI,
  SBCI,
  SUBI,
  ORI,
  ANDI,
  LDI,
  LDD_Y,
  LDD_Z,
  STD_Y,
  STD_Z,
  LD_X,
  LD_X_UP,
  LD_X_DOWN,
  LD_Y_UP,
  LD_Y_DOWN,
  LD_Z_UP,
  LD_Z_DOWN,
  ST_X,
  ST_X_UP,
  ST_X_DOWN,
  ST_Y_UP,
  ST_Y_DOWN,
  ST_Z_UP,
  ST_Z_DOWN,
  LDS,
  STS,
  LPM,
  LPM_UP,
  PUSH,
  POP,
  COM,
  NEG,
  SWAP,
  INC,
  DEC,
  ASR,
  LSR,
  ROR,
  ADIW,
  SBIW,
  MUL,
  BLD,
  BST,
  IN_SREG,
  IN_STACK,
  JMP,
  RJMP,
  IJMP,
  CALL,
  RCALL,
  ICALL,
  RET,
  BRANCH_SET,
  BRANCH_CLEAR,
  SKIP_CLEAR,
  SKIP_SET
}; /* clang-format keeps the table below in columns */

/* clang-format off */
static const struct { uint16_t mask, value; uint8_t kind; } PATTERNS[] = {
  {0xFFFF, 0x0000, NOP},   {0xFF00, 0x0100, MOVW},  {0xFC00, 0x0400, CPC},   {0xFC00, 0x0800, SBC},
  {0xFC00, 0x0C00, ADD},   {0xFC00, 0x1000, CPSE},  {0xFC00, 0x1400, CP},    {0xFC00, 0x1800, SUB},
  {0xFC00, 0x1C00, ADC},   {0xFC00, 0x2000, AND},   {0xFC00, 0x2400, EOR},   {0xFC00, 0x2800, OR},
  {0xFC00, 0x2C00, MOV},   {0xF000, 0x3000, CPI},   {0xF000, 0x4000, SBCI},  {0xF000, 0x5000, SUBI},
  {0xF000, 0x6000, ORI},   {0xF000, 0x7000, ANDI},  {0xF000, 0xE000, LDI},
  {0xD208, 0x8008, LDD_Y}, {0xD208, 0x8000, LDD_Z}, {0xD208, 0x8208, STD_Y}, {0xD208, 0x8200, STD_Z},
  {0xFE0F, 0x900C, LD_X},  {0xFE0F, 0x900D, LD_X_UP}, {0xFE0F, 0x900E, LD_X_DOWN},
  {0xFE0F, 0x9009, LD_Y_UP}, {0xFE0F, 0x900A, LD_Y_DOWN}, {0xFE0F, 0x9001, LD_Z_UP}, {0xFE0F, 0x9002, LD_Z_DOWN},
  {0xFE0F, 0x920C, ST_X},  {0xFE0F, 0x920D, ST_X_UP}, {0xFE0F, 0x920E, ST_X_DOWN},
  {0xFE0F, 0x9209, ST_Y_UP}, {0xFE0F, 0x920A, ST_Y_DOWN}, {0xFE0F, 0x9201, ST_Z_UP}, {0xFE0F, 0x9202, ST_Z_DOWN},
  {0xFE0F, 0x9000, LDS},   {0xFE0F, 0x9200, STS},   {0xFE0F, 0x9004, LPM},   {0xFE0F, 0x9005, LPM_UP},
  {0xFE0F, 0x920F, PUSH},  {0xFE0F, 0x900F, POP},
  {0xFE0F, 0x9400, COM},   {0xFE0F, 0x9401, NEG},   {0xFE0F, 0x9402, SWAP},  {0xFE0F, 0x9403, INC},
  {0xFE0F, 0x940A, DEC},   {0xFE0F, 0x9405, ASR},   {0xFE0F, 0x9406, LSR},   {0xFE0F, 0x9407, ROR},
  {0xFF00, 0x9600, ADIW},  {0xFF00, 0x9700, SBIW},  {0xFC00, 0x9C00, MUL},
  {0xFE08, 0xF800, BLD},   {0xFE08, 0xFA00, BST},
  {0xFE0F, 0xB60F, IN_SREG}, {0xFE0F, 0xB60D, IN_STACK}, {0xFE0F, 0xB60E, IN_STACK},
  {0xFFFE, 0x940C, JMP},   {0xF000, 0xC000, RJMP},  {0xFFFF, 0x9409, IJMP},
  {0xFFFE, 0x940E, CALL},  {0xF000, 0xD000, RCALL}, {0xFFFF, 0x9509, ICALL}, {0xFFFF, 0x9508, RET},
  {0xFC00, 0xF000, BRANCH_SET}, {0xFC00, 0xF400, BRANCH_CLEAR}, {0xFE08, 0xFC00, SKIP_CLEAR}, {0xFE08, 0xFE00, SKIP_SET},
};
/* clang-format on */

static uint8_t kinds[0x10000]; /* by opcode */

__attribute__((constructor)) static void fill_kinds(void) {
  for (size_t i = 0; i < sizeof PATTERNS / sizeof *PATTERNS; i++) {
    uint32_t rest = (uint16_t)~PATTERNS[i].mask, operands = 0;
    do {
      kinds[PATTERNS[i].value | operands] = PATTERNS[i].kind;
      operands = (operands - rest) & rest; /* the next number in the bits that the pattern leaves */
    } while (operands);
  }
}

/* ---- operands ---- */

static inline unsigned word_at(const uint8_t *bytes, uint32_t address) {
  return bytes[address] | (unsigned)bytes[address + 1] << 8;
}

static inline void put_word(uint8_t *bytes, unsigned address, unsigned value) {
  bytes[address] = (uint8_t)value;
  bytes[address + 1] = (uint8_t)(value >> 8);
}

static inline bool in_ram(uint16_t address) { return (uint16_t)(address - RAM_BEGIN) < BOARD_DATA_SIZE - RAM_BEGIN; }

static inline unsigned displacement(unsigned opcode) {
  return (opcode & 0x2000) >> 8 | (opcode & 0x0C00) >> 7 | (opcode & 7);
}

static inline bool is_two_words(unsigned opcode) {
  unsigned kind = kinds[opcode];
  return kind == LDS || kind == STS || (opcode & 0xFE0C) == 0x940C /* JMP, CALL */;
}

/* ---- flags: avr_t keeps each in a byte of its own ---- */

static inline void flags_negative(uint8_t *f, bool negative) {
  f[S_N] = negative;
  f[S_S] = f[S_N] ^ f[S_V];
}

static inline void flags_logic(uint8_t *f, uint8_t result) {
  f[S_V] = 0;
  f[S_Z] = result == 0;
  flags_negative(f, result >> 7);
}

static inline uint8_t add(uint8_t *f, uint8_t a, uint8_t b, uint8_t carry) {
  unsigned sum = (unsigned)a + b + carry;
  uint8_t result = (uint8_t)sum;
  f[S_C] = (uint8_t)(sum >> 8);
  f[S_H] = (a ^ b ^ result) >> 4 & 1;
  f[S_V] = ((a ^ result) & (b ^ result)) >> 7;
  f[S_Z] = result == 0;
  flags_negative(f, result >> 7);
  return result;
}

/* `chained`: Z stays false where it was. */
static inline uint8_t subtract(uint8_t *f, uint8_t a, uint8_t b, uint8_t carry, bool chained) {
  unsigned difference = (unsigned)a - b - carry;
  uint8_t result = (uint8_t)difference;
  f[S_C] = difference >> 8 & 1;
  f[S_H] = (a ^ b ^ result) >> 4 & 1;
  f[S_V] = ((a ^ b) & (a ^ result)) >> 7;
  f[S_Z] = result == 0 && (!chained || f[S_Z]);
  flags_negative(f, result >> 7);
  return result;
}

static inline uint8_t shift_right(uint8_t *f, uint8_t value, uint8_t top) {
  uint8_t result = (uint8_t)(value >> 1 | top);
  f[S_C] = value & 1;
  f[S_Z] = result == 0;
  f[S_N] = result >> 7;
  f[S_V] = f[S_N] ^ f[S_C];
  f[S_S] = f[S_C]; /* N ^ V */
  return result;
}

static inline uint8_t count(uint8_t *f, uint8_t result, bool overflow) {
  f[S_V] = overflow;
  f[S_Z] = result == 0;
  flags_negative(f, result >> 7);
  return result;
}

static inline void add_word(uint8_t *f, uint8_t *pair, int number) {
  unsigned before = word_at(pair, 0), after = (before + (unsigned)number) & 0xFFFF;
  put_word(pair, 0, after);
  unsigned rises = after & ~before, falls = before & ~after;
  f[S_V] = (number >= 0 ? rises : falls) >> 15 & 1;
  f[S_C] = (number >= 0 ? falls : rises) >> 15 & 1;
  f[S_Z] = after == 0;
  flags_negative(f, after >> 15);
}

/* ---- one by simavr ---- */

static inline uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

/* False: the core is to stop behind it. `until` may come nearer by it. */
static bool uncommon(avr_board *b, uint32_t *pc, uint64_t *until) {
  avr_t *avr = b->avr;
  avr->run_cycle_count = 1; /* one instruction; what wants the core to stop makes it 0 */
  *pc = (uint32_t)avr_run_one(avr);
  *until = earlier(earlier(*until, b->next_due), next_of_simavr(avr));
  return avr->run_cycle_count && avr->state == cpu_Running && !avr->interrupt_state;
}

/* ---- many ---- */

#define D (opcode >> 4 & 0x1Fu)
#define R ((opcode >> 5 & 0x10u) | (opcode & 0xFu))
#define H ((opcode >> 4 & 0xFu) + 16u)
#define K ((uint8_t)((opcode >> 4 & 0xF0u) | (opcode & 0xFu)))
#define SP 0x5Du

static inline __attribute__((always_inline)) uint32_t run(avr_board *b, uint64_t until,
                                                          const instruction_stops *stops) {
  avr_t *avr = b->avr;
  uint8_t *const data = avr->data, *const f = avr->sreg;
  const uint8_t *const flash = avr->flash;
  uint64_t cycle = avr->cycle;
  uint32_t at, pc = (uint32_t)avr->pc;
  if (avr->interrupt_state) until = cycle + 1;
  do {
    unsigned opcode = 0, kind = UNCOMMON, pointer = 0, takes = 1;
    bool moves_stack = false;
    at = pc;
    if (at < AVR_BOARD_FLASH_SIZE) {
      opcode = word_at(flash, at);
      kind = kinds[opcode];
    }
    pc += 2;
    switch (kind) {
      case NOP:
        break;
      case MOVW:
        put_word(data, (opcode >> 3 & 0x1Eu), word_at(data, opcode << 1 & 0x1Eu));
        break;
      case CPC:
        subtract(f, data[D], data[R], f[S_C], true);
        break;
      case SBC:
        data[D] = subtract(f, data[D], data[R], f[S_C], true);
        break;
      case ADD:
        data[D] = add(f, data[D], data[R], 0);
        break;
      case CP:
        subtract(f, data[D], data[R], 0, false);
        break;
      case SUB:
        data[D] = subtract(f, data[D], data[R], 0, false);
        break;
      case ADC:
        data[D] = add(f, data[D], data[R], f[S_C]);
        break;
      case AND:
        flags_logic(f, data[D] &= data[R]);
        break;
      case EOR:
        flags_logic(f, data[D] ^= data[R]);
        break;
      case OR:
        flags_logic(f, data[D] |= data[R]);
        break;
      case MOV:
        data[D] = data[R];
        break;
      case CPI:
        subtract(f, data[H], K, 0, false);
        break;
      case SBCI:
        data[H] = subtract(f, data[H], K, f[S_C], true);
        break;
      case SUBI:
        data[H] = subtract(f, data[H], K, 0, false);
        break;
      case ORI:
        flags_logic(f, data[H] |= K);
        break;
      case ANDI:
        flags_logic(f, data[H] &= K);
        break;
      case LDI:
        data[H] = K;
        break;

      case LDD_Y:
      case LDD_Z: {
        uint16_t address = (uint16_t)(word_at(data, kind == LDD_Y ? Y : Z) + displacement(opcode));
        if (!in_ram(address)) goto simavr;
        data[D] = data[address];
        takes = 2;
        break;
      }
      case STD_Y:
      case STD_Z: {
        uint16_t address = (uint16_t)(word_at(data, kind == STD_Y ? Y : Z) + displacement(opcode));
        if (!in_ram(address)) goto simavr;
        data[address] = data[D];
        takes = 2;
        break;
      }
      case LD_X_UP:
      case LD_Y_UP:
      case LD_Z_UP:
      case LD_X_DOWN:
      case LD_Y_DOWN:
      case LD_Z_DOWN:
      case LD_X: {
        pointer = kind <= LD_X_DOWN ? X : kind <= LD_Y_DOWN ? Y : Z;
        uint16_t address = (uint16_t)(word_at(data, pointer) - (opcode & 3u) / 2u);
        if (!in_ram(address)) goto simavr;
        uint8_t value = data[address];
        put_word(data, pointer, address + (opcode & 1u));
        data[D] = value;
        takes = 2;
        break;
      }
      case ST_X_UP:
      case ST_Y_UP:
      case ST_Z_UP:
      case ST_X_DOWN:
      case ST_Y_DOWN:
      case ST_Z_DOWN:
      case ST_X: {
        pointer = kind <= ST_X_DOWN ? X : kind <= ST_Y_DOWN ? Y : Z;
        uint16_t address = (uint16_t)(word_at(data, pointer) - (opcode & 3u) / 2u);
        if (!in_ram(address)) goto simavr;
        data[address] = data[D];
        put_word(data, pointer, address + (opcode & 1u));
        takes = 2;
        break;
      }
      case LDS:
      case STS: {
        uint16_t address = (uint16_t)word_at(flash, pc);
        if (!in_ram(address)) goto simavr;
        if (kind == LDS) {
          data[D] = data[address];
        } else {
          data[address] = data[D];
        }
        pc += 2;
        takes = 2;
        break;
      }
      case LPM:
      case LPM_UP: {
        unsigned address = word_at(data, Z);
        if (data[REG_SPMCSR]) goto simavr; /* it may read fuses */
        data[D] = flash[address];
        if (kind == LPM_UP) put_word(data, Z, address + 1u);
        takes = 3;
        break;
      }

      case PUSH: {
        uint16_t stack = (uint16_t)word_at(data, SP);
        if (!in_ram(stack)) goto simavr;
        data[stack] = data[D];
        put_word(data, SP, stack - 1u);
        moves_stack = true;
        takes = 2;
        break;
      }
      case POP: {
        uint16_t stack = (uint16_t)(word_at(data, SP) + 1u);
        if (!in_ram(stack)) goto simavr;
        data[D] = data[stack];
        put_word(data, SP, stack);
        moves_stack = true;
        takes = 2;
        break;
      }
      case CALL:
      case RCALL:
      case ICALL: {
        uint16_t stack = (uint16_t)word_at(data, SP);
        if (!in_ram(stack) || !in_ram(stack - 1u)) goto simavr;
        uint32_t to;
        if (kind == CALL) {
          if (opcode & 1u) goto simavr; /* beyond 128 KB */
          to = word_at(flash, pc) << 1;
          pc += 2;
        } else if (kind == RCALL) {
          to = (pc + (uint32_t)((int16_t)(opcode << 4) >> 3)) % AVR_BOARD_FLASH_SIZE;
        } else {
          to = word_at(data, Z) << 1;
        }
        data[stack] = (uint8_t)(pc >> 1);
        data[stack - 1u] = (uint8_t)(pc >> 9);
        put_word(data, SP, stack - 2u);
        pc = to;
        moves_stack = true;
        takes = kind == CALL ? 4 : 3;
        break;
      }
      case RET: {
        uint16_t stack = (uint16_t)word_at(data, SP);
        if (!in_ram(stack + 1u) || !in_ram(stack + 2u)) goto simavr;
        pc = (data[stack + 1u] << 8 | data[stack + 2u]) << 1;
        put_word(data, SP, stack + 2u);
        moves_stack = true;
        takes = 4;
        break;
      }

      case COM:
        flags_logic(f, data[D] = (uint8_t)~data[D]);
        f[S_C] = 1;
        break;
      case NEG:
        data[D] = subtract(f, 0, data[D], 0, false);
        break;
      case SWAP:
        data[D] = (uint8_t)(data[D] << 4 | data[D] >> 4);
        break;
      case INC:
        data[D]++;
        count(f, data[D], data[D] == 0x80);
        break;
      case DEC:
        data[D]--;
        count(f, data[D], data[D] == 0x7F);
        break;
      case ASR:
        data[D] = shift_right(f, data[D], data[D] & 0x80);
        break;
      case LSR:
        data[D] = shift_right(f, data[D], 0);
        break;
      case ROR:
        data[D] = shift_right(f, data[D], (uint8_t)(f[S_C] << 7));
        break;
      case ADIW:
      case SBIW: {
        int number = (int)((opcode >> 2 & 0x30u) | (opcode & 0xFu));
        add_word(f, data + 24 + (opcode >> 3 & 6u), kind == ADIW ? number : -number);
        takes = 2;
        break;
      }
      case MUL: {
        unsigned product = (unsigned)data[D] * data[R];
        put_word(data, 0, product);
        f[S_Z] = product == 0;
        f[S_C] = (uint8_t)(product >> 15);
        takes = 2;
        break;
      }
      case BLD:
        data[D] = (uint8_t)((data[D] & ~(1u << (opcode & 7u))) | (unsigned)f[S_T] << (opcode & 7u));
        break;
      case BST:
        f[S_T] = data[D] >> (opcode & 7u) & 1;
        break;
      case IN_SREG:
        data[R_SREG] = 0;
        for (unsigned bit = 0; bit < 8; bit++) data[R_SREG] |= (uint8_t)(f[bit] << bit);
        data[D] = data[R_SREG];
        break;
      case IN_STACK:
        data[D] = data[32u + ((opcode >> 5 & 0x30u) | (opcode & 0xFu))];
        break;

      case JMP:
        if (opcode & 1u) goto simavr;
        pc = word_at(flash, pc) << 1;
        takes = 3;
        break;
      case RJMP:
        pc = (pc + (uint32_t)((int16_t)(opcode << 4) >> 3)) % AVR_BOARD_FLASH_SIZE;
        takes = 2;
        break;
      case IJMP:
        pc = word_at(data, Z) << 1;
        takes = 2;
        break;
      case BRANCH_SET:
      case BRANCH_CLEAR:
        if (f[opcode & 7u] == (kind == BRANCH_SET)) {
          pc += (uint32_t)((int16_t)(opcode << 6) >> 9 << 1);
          takes = 2;
        }
        break;
      case CPSE:
      case SKIP_CLEAR:
      case SKIP_SET: {
        bool skips = kind == CPSE ? data[D] == data[R] : (data[D] >> (opcode & 7u) & 1u) == (kind == SKIP_SET);
        if (skips) {
          takes = is_two_words(word_at(flash, pc)) ? 3 : 2;
          pc += 2 * (takes - 1);
        }
        break;
      }

      simavr:
      default:
        avr->pc = at;
        avr->cycle = cycle;
        if (!uncommon(b, &pc, &until)) until = 0;
        cycle = avr->cycle;
        moves_stack = true;
        takes = 0;
        break;
    }
    cycle += takes;
    if (stops) {
      if (moves_stack) {
        uint16_t above = (uint16_t)(word_at(data, SP) - stops->lowest);
        if (above > (uint16_t)(stops->highest - stops->lowest)) break;
      }
      if (pc >= AVR_BOARD_FLASH_SIZE || stops->marked[pc / 2u]) break;
    }
  } while (cycle < until);
  avr->pc = pc;
  avr->cycle = cycle;
  return at;
}

uint32_t execute_instructions(avr_board *b, uint64_t until, const instruction_stops *stops) {
  return stops ? run(b, until, stops) : run(b, until, NULL);
}
