/* avr_opcodes.h: which instruction an opcode is, among those that avr_instructions.c executes itself.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later (linked with simavr)
 */
#ifndef AVR_OPCODES_H
#define AVR_OPCODES_H

#include <stdbool.h>
#include <stdint.h>

/* clang-format off */
enum {
  UNCOMMON, /* any other: simavr's */
  NOP, MOVW, CPC, SBC, ADD, CPSE, CP, SUB, ADC, AND, EOR, OR, MOV, CPI, SBCI, SUBI, ORI, ANDI, LDI,
  LDD, STD, /* by Y or Z, also without displacement */
  LD, ST,   /* by X, and by what moves before or behind */
  LDS, STS, LPM, LPM_UP, PUSH, POP,
  COM, NEG, SWAP, INC, DEC, ASR, LSR, ROR, ADIW, SBIW, MUL, BLD, BST,
  IN_SREG, IN_STACK, /* SPL or SPH */
  JMP, RJMP, IJMP, CALL, RCALL, ICALL, RET, BRANCH_SET, BRANCH_CLEAR, SKIP_CLEAR, SKIP_SET
};
/* clang-format on */

extern uint8_t avr_kinds[0x10000]; /* by opcode */

static inline bool is_two_words(unsigned opcode) {
  unsigned kind = avr_kinds[opcode & 0xFFFFu];
  return kind == LDS || kind == STS || (opcode & 0xFE0Cu) == 0x940Cu /* JMP, CALL */;
}

static inline bool is_return(unsigned opcode) { return (opcode & 0xFFEFu) == 0x9508u; /* RET, RETI */ }

static inline bool sets_stack(unsigned opcode) { return (opcode & 0xFE0Fu) == 0xBE0Du; /* OUT SPL, the second half */ }

/* It leaves a stack pointer that is whole: not half of an old and half of a new one. */
static inline bool moves_whole_stack(unsigned opcode) {
  unsigned kind = avr_kinds[opcode & 0xFFFFu];
  return kind == PUSH || kind == POP || kind == CALL || kind == RCALL || kind == ICALL || is_return(opcode) ||
         sets_stack(opcode);
}

#endif
