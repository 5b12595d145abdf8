/* avr_instructions.c: see avr_instructions.h. After the AVR instruction set manual; cycles are those of AVRe+ with a
 * 16-bit program counter. sim_bridge/tests/boards/avr/test_avr_common_instructions.py has all of them executed here and by simavr.
 *
 * Left to simavr is whatever reaches an I/O register or the interrupt system, or leaves flash or RAM, or would take the
 * stack into the variables: so the check of the stack costs the others nothing.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#include "avr_instructions.h"

#include "avr_arithmetic.h"
#include "avr_opcodes.h"
#include "avr_parts.h"
#include "sim_core.h"

#define REG_SPMCSR 0x57u
#define SP 0x5Du
#define ERASED 0xFFFFu
#define SPM 0x95E8u
#define FRAME_WORDS 12u /* from IN to OUT where a function makes room for its variables */

enum { Y = 28, Z = 30 };

/* Operands, by the letters of the manual. */
#define D (opcode >> 4 & 0x1Fu)
#define R ((opcode >> 5 & 0x10u) | (opcode & 0xFu))
#define H ((opcode >> 4 & 0xFu) + 16u) /* d of an instruction with a constant */
#define K ((uint8_t)((opcode >> 4 & 0xF0u) | (opcode & 0xFu)))

/* ---- RAM; false: the address is not there, or `written`, where the program is checked, says that nothing wrote there ---- */

static inline bool in_ram(uint16_t address) { return (uint16_t)(address - RAM_BEGIN) < BOARD_DATA_SIZE - RAM_BEGIN; }

static inline bool may_load(const uint8_t *written, uint16_t address) {
  return in_ram(address) && (!written || written[address]);
}

static inline bool load(uint8_t *data, const uint8_t *written, unsigned opcode, uint16_t address) {
  if (!may_load(written, address)) return false;
  data[D] = data[address];
  return true;
}

static inline bool store(uint8_t *data, uint8_t *written, unsigned opcode, uint16_t address) {
  if (!in_ram(address)) return false;
  data[address] = data[D];
  if (written) written[address] = 1;
  return true;
}

/* Y or Z, and q. */
static inline uint16_t displaced(const uint8_t *data, unsigned opcode) {
  unsigned q = (opcode & 0x2000u) >> 8 | (opcode & 0x0C00u) >> 7 | (opcode & 7u);
  return (uint16_t)(word_at(data, opcode & 8u ? Y : Z) + q);
}

/* X, Y or Z: 26, 28 or 30 for 0b11, 0b10 or 0b00 in front of the mode. */
static inline unsigned pointer_of(unsigned opcode) { return Z - (opcode >> 2 & 2u) - (opcode >> 1 & 2u); }

/* X, Y or Z, as it is, one less before or one more behind. */
static inline bool load_moving(uint8_t *data, const uint8_t *written, unsigned opcode) {
  unsigned pointer = pointer_of(opcode);
  uint16_t address = (uint16_t)(word_at(data, pointer) - (opcode >> 1 & 1u));
  if (!may_load(written, address)) return false;
  put_word(data, pointer, address + (opcode & 1u));
  data[D] = data[address];
  return true;
}

static inline bool store_moving(uint8_t *data, uint8_t *written, unsigned opcode) {
  unsigned pointer = pointer_of(opcode);
  uint16_t address = (uint16_t)(word_at(data, pointer) - (opcode >> 1 & 1u));
  if (!store(data, written, opcode, address)) return false;
  put_word(data, pointer, address + (opcode & 1u));
  return true;
}

/* So many bytes, the first of them at `address`, the others below. */
static inline bool may_push(unsigned address, unsigned bytes, unsigned lowest) {
  return address - lowest - (bytes - 1u) < BOARD_DATA_SIZE - lowest - (bytes - 1u);
}

static inline bool push(uint8_t *data, uint8_t *written, unsigned opcode, unsigned lowest) {
  uint16_t stack = (uint16_t)word_at(data, SP);
  if (!may_push(stack, 1, lowest)) return false;
  data[stack] = data[D];
  if (written) written[stack] = 1;
  put_word(data, SP, stack - 1u);
  return true;
}

static inline bool pop(uint8_t *data, const uint8_t *written, unsigned opcode) {
  uint16_t stack = (uint16_t)(word_at(data, SP) + 1u);
  if (!load(data, written, opcode, stack)) return false;
  put_word(data, SP, stack);
  return true;
}

static inline bool push_address(uint8_t *data, uint8_t *written, uint32_t address, unsigned lowest) {
  uint16_t stack = (uint16_t)word_at(data, SP);
  if (!may_push(stack, 2, lowest)) return false;
  data[stack] = (uint8_t)(address >> 1);
  data[stack - 1u] = (uint8_t)(address >> 9);
  if (written) written[stack] = written[stack - 1u] = 1;
  put_word(data, SP, stack - 2u);
  return true;
}

static inline bool pop_address(uint8_t *data, const uint8_t *written, uint32_t *address) {
  uint16_t stack = (uint16_t)word_at(data, SP);
  if (!may_load(written, (uint16_t)(stack + 1u)) || !may_load(written, (uint16_t)(stack + 2u))) return false;
  *address = (uint32_t)(data[stack + 1u] << 8 | data[stack + 2u]) << 1;
  put_word(data, SP, stack + 2u);
  return true;
}

/* ---- program memory ---- */

static inline uint32_t relative(uint32_t behind, unsigned opcode) {
  int offset = (int16_t)(opcode << 4) >> 3;
  return (uint32_t)((int)behind + offset) % AVR_BOARD_FLASH_SIZE;
}

static inline bool load_program(uint8_t *data, const uint8_t *flash, unsigned opcode) {
  unsigned address = word_at(data, Z);
  if (data[REG_SPMCSR]) return false; /* then it may read fuses */
  data[D] = flash[address];
  if (opcode & 1u) put_word(data, Z, address + 1u);
  return true;
}

static inline bool skips(const uint8_t *data, unsigned opcode, unsigned kind) {
  if (kind == CPSE) return data[D] == data[R];
  return (data[D] >> (opcode & 7u) & 1u) == (kind == SKIP_SET);
}

/* ---- one by simavr ---- */

static inline uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

/* Whether OUT SPL at `at` makes the stack grow, as the functions of gcc do for their variables (IN Rd, SPL; a
 * subtraction; OUT SPL, Rd), and does not choose another one, whose pointer is loaded. */
static bool grows_stack(const uint8_t *flash, uint32_t at) {
  unsigned opcode = word_at(flash, at), source = D;
  for (unsigned words = 1; words <= FRAME_WORDS && 2 * words <= at; words++) {
    opcode = word_at(flash, at - 2 * words);
    unsigned kind = avr_kinds[opcode];
    bool loads = kind == LDI || kind == LD || kind == LDD || kind == LDS || kind == POP;
    if ((loads || kind == IN_STACK) && (kind == LDI ? H : D) == source) return kind == IN_STACK;
  }
  return false;
}

/* A stack pointer that is not where it may be has gone wrong only behind an instruction that leaves it whole: a program
 * writes it in two halves, the upper one first (avr-libc, gcc), and what is between them says nothing. */
static void check_stack_behind(avr_board *b, uint32_t at, uint32_t before) {
  uint32_t pointer = word_at(b->avr->data, SP);
  bool may_be_there = pointer + 1u >= b->lowest_stack && pointer < BOARD_DATA_SIZE;
  if (may_be_there && b->lowest_stack == b->variables_end) return;
  unsigned opcode = at < AVR_BOARD_FLASH_SIZE ? word_at(b->avr->flash, at) : 0;
  if (may_be_there) { /* and was elsewhere */
    if (sets_stack(opcode) && pointer + 1u >= b->variables_end) b->lowest_stack = b->variables_end;
  } else if (moves_whole_stack(opcode)) {
    check_stack(b, at, sets_stack(opcode) ? !grows_stack(b->avr->flash, at) : before + 1u < b->lowest_stack);
  }
}

/* That at `pc`, which then is the next one's address. False: the core is to stop behind it. `until` may come nearer by it. */
static bool uncommon(avr_board *b, uint32_t *pc, uint64_t *until, bool checked) {
  avr_t *avr = b->avr;
  avr->run_cycle_count = 1; /* one instruction; what wants the core to stop makes it 0 */
  const uint32_t at = *pc, before = word_at(avr->data, SP);
  const uint16_t lowest = b->lowest_stack;
  if (checked) check_access(b);
  const unsigned opcode = at < BOOT_BEGIN ? word_at(avr->flash, at) : 0;
  const bool is_erased = opcode == ERASED && at < avr->reset_pc;
  if (is_erased || opcode == SPM) { /* nothing, as the chip does, in a cycle */
    if (is_erased) note(b, at, "runs through", "erased flash", "no program is there: it goes on into the boot section");
    if (opcode == SPM) note(b, at, "executes", "SPM", "it is dropped: it works in the boot section only (27.3.2)");
    *pc = at + 2;
    avr->cycle++;
  } else {
    *pc = (uint32_t)avr_run_one(avr);
  }
  check_stack_behind(b, at, before);
  *until = earlier(earlier(*until, b->next_due), next_of_simavr(avr));
  return lowest == b->lowest_stack && avr->run_cycle_count && avr->state == cpu_Running && !avr->interrupt_state &&
         !b->crashed;
}

/* ---- looked at before it is executed ---- */

data_access next_access(const avr_board *b) {
  const uint8_t *data = b->avr->data;
  const uint32_t pc = (uint32_t)b->avr->pc;
  const unsigned opcode = pc < AVR_BOARD_FLASH_SIZE ? word_at(b->avr->flash, pc) : 0;
  const uint16_t stack = (uint16_t)word_at(data, SP);
  switch (avr_kinds[opcode]) {
    case LDD:
    case STD:
      return (data_access){displaced(data, opcode), 1, avr_kinds[opcode] == STD};
    case LD:
    case ST:
      return (data_access){(uint16_t)(word_at(data, pointer_of(opcode)) - (opcode >> 1 & 1u)), 1,
                           avr_kinds[opcode] == ST};
    case LDS:
    case STS:
      return (data_access){(uint16_t)word_at(b->avr->flash, pc + 2), 1, avr_kinds[opcode] == STS};
    case PUSH:
      return (data_access){stack, 1, true};
    case POP:
      return (data_access){(uint16_t)(stack + 1u), 1, false};
    case CALL:
    case RCALL:
    case ICALL:
      return (data_access){(uint16_t)(stack - 1u), 2, true};
    default:
      break;
  }
  if (is_return(opcode)) return (data_access){(uint16_t)(stack + 1u), 2, false};
  if ((opcode & 0xF000u) == 0xB000u) { /* IN, OUT */
    return (data_access){(uint16_t)(0x20u + ((opcode >> 5 & 0x30u) | (opcode & 0xFu))), 1, opcode & 0x0800u};
  }
  if ((opcode & 0xFC00u) == 0x9800u) { /* CBI, SBIC, SBI, SBIS */
    return (data_access){(uint16_t)(0x20u + (opcode >> 3 & 0x1Fu)), 1, !(opcode & 0x0100u)};
  }
  return (data_access){0, 0, false};
}

/* ---- many ---- */

static inline __attribute__((always_inline)) uint32_t run(avr_board *b, uint64_t until, const instruction_stops *stops,
                                                          uint8_t *written, uint8_t *covered) {
  avr_t *avr = b->avr;
  uint8_t *const data = avr->data, *const f = avr->sreg;
  const uint8_t *const flash = avr->flash;
  const unsigned lowest = b->lowest_stack;
  uint64_t cycle = avr->cycle;
  uint32_t at, pc = (uint32_t)avr->pc;
  if (avr->interrupt_state || b->one_by_one) until = cycle + 1;
  do {
    unsigned opcode = 0, kind = UNCOMMON, takes = 1;
    bool moves_stack = false, jumps = false, here = true; /* here: executed here */
    at = pc;
    if (at < AVR_BOARD_FLASH_SIZE && !b->one_by_one) {
      opcode = word_at(flash, at);
      kind = avr_kinds[opcode];
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

      case LDD:
        here = load(data, written, opcode, displaced(data, opcode));
        takes = 2;
        break;
      case STD:
        here = store(data, written, opcode, displaced(data, opcode));
        takes = 2;
        break;
      case LD:
        here = load_moving(data, written, opcode);
        takes = 2;
        break;
      case ST:
        here = store_moving(data, written, opcode);
        takes = 2;
        break;
      case LDS:
        here = load(data, written, opcode, (uint16_t)word_at(flash, pc));
        pc += 2;
        takes = 2;
        break;
      case STS:
        here = store(data, written, opcode, (uint16_t)word_at(flash, pc));
        pc += 2;
        takes = 2;
        break;
      case LPM:
      case LPM_UP:
        here = load_program(data, flash, opcode);
        takes = 3;
        break;
      case PUSH:
        here = push(data, written, opcode, lowest);
        moves_stack = true;
        takes = 2;
        break;
      case POP:
        here = pop(data, written, opcode);
        moves_stack = true;
        takes = 2;
        break;

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
        data[D] = data[R_SREG] = all_flags(f);
        break;
      case IN_STACK:
        data[D] = data[0x20u + ((opcode >> 5 & 0x30u) | (opcode & 0xFu))];
        break;

      case JMP:
        pc = word_at(flash, pc) << 1;
        jumps = true;
        takes = 3;
        break;
      case RJMP:
        pc = relative(pc, opcode);
        jumps = true;
        takes = 2;
        break;
      case IJMP:
        pc = word_at(data, Z) << 1;
        jumps = true;
        takes = 2;
        break;
      case CALL:
        here = push_address(data, written, pc + 2, lowest);
        pc = word_at(flash, pc) << 1;
        moves_stack = jumps = true;
        takes = 4;
        break;
      case RCALL:
        here = push_address(data, written, pc, lowest);
        pc = relative(pc, opcode);
        moves_stack = jumps = true;
        takes = 3;
        break;
      case ICALL:
        here = push_address(data, written, pc, lowest);
        pc = word_at(data, Z) << 1;
        moves_stack = jumps = true;
        takes = 3;
        break;
      case RET:
        here = pop_address(data, written, &pc);
        moves_stack = jumps = true;
        takes = 4;
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
      case SKIP_SET:
        if (skips(data, opcode, kind)) {
          takes = is_two_words(word_at(flash, pc)) ? 3 : 2;
          pc += 2 * (takes - 1);
        }
        break;
      default:
        here = false;
    }
    if (!here) {
      avr->pc = pc = at;
      avr->cycle = cycle;
      if (!uncommon(b, &pc, &until, written != NULL)) until = 0;
      cycle = avr->cycle;
      moves_stack = jumps = true;
      takes = 0;
    }
    if (jumps && !is_code(b, pc)) until = 0;
    cycle += takes;
    if (covered && at < AVR_BOARD_FLASH_SIZE) covered[at / 2u] |= (uint8_t)(pc == at + 2u ? 1u : 2u);
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

/* By itself: the others are as fast as they were. */
static __attribute__((noinline)) uint32_t run_checked(avr_board *b, uint64_t until, const instruction_stops *stops) {
  return stops ? run(b, until, stops, b->written, NULL) : run(b, until, NULL, b->written, NULL);
}

static __attribute__((noinline)) uint32_t run_stopping(avr_board *b, uint64_t until, const instruction_stops *stops) {
  return run(b, until, stops, NULL, NULL);
}

static __attribute__((noinline)) uint32_t run_covered(avr_board *b, uint64_t until, const instruction_stops *stops) {
  if (stops || b->written) return run(b, until, stops, b->written, b->covered);
  return run(b, until, NULL, NULL, b->covered);
}

uint32_t execute_instructions(avr_board *b, uint64_t until, const instruction_stops *stops) {
  if (b->covered) return run_covered(b, until, stops);
  if (b->written) return run_checked(b, until, stops);
  return stops ? run_stopping(b, until, stops) : run(b, until, NULL, NULL, NULL);
}
