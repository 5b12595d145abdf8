/* avr_decode.h: the kinds of instructions, by the names of the AVR instruction set manual; those that differ in what takes
 * time to tell when they are executed are kinds by themselves.
 */
#ifndef AVR_DECODE_H
#define AVR_DECODE_H

#include <stdbool.h>

#include "avr_core.h"

/* clang-format off */
enum {
  INVALID, /* no instruction of this core */
  OUTSIDE, /* no code is here: it is not executed */
  NOP, /* and BREAK: nothing is joined to debugWIRE */
  MOV, MOVW, LDI, ADD, ADC, SUB, SUBI, SBC, SBCI, AND, ANDI, OR, ORI, EOR, CP, CPC, CPI, COM, NEG, INC, DEC, SWAP, ASR, LSR, ROR,
  ADIW, SBIW, MUL, MULS, MULSU, FMUL, FMULS, FMULSU,
  LDD, STD,                   /* by X, Y or Z with displacement, which may be 0; r is the pointer */
  LD_UP, ST_UP,               /* one more behind; r is the pointer */
  LD_DOWN, ST_DOWN,           /* one less before */
  LDS, STS, PUSH, POP,
  LPM, LPM_UP, SPM,
  IN, IN_SREG, OUT, OUT_SREG, OUT_SPL, SBI, CBI,
  BLD, BST, BSET, BCLR, SEI, CLI,
  JUMP, LONG_JUMP, IJMP, RCALL, CALL, ICALL, RET, RETI, /* RJMP is JUMP, JMP a LONG_JUMP */
  BRCS, BRCC, BREQ, BRNE, BRMI, BRPL, BRLT, BRGE, BRBS, BRBC,
  CPSE, SBRC, SBRS, ERASED, /* 0xFFFF: SBRS r31, 7 */ SBIC, SBIS,
  SLEEP, WDR
};
/* clang-format on */

/* What it takes off the stack, or puts there, is whole: not half of a pointer that a program sets in two steps. */
static inline bool avr_moves_stack(unsigned kind) {
  return kind == PUSH || kind == POP || kind == OUT_SPL || (kind >= RCALL && kind <= RETI);
}

static inline bool avr_is_stack_half(const avr_instruction *i) { return i->k == REG_SPL || i->k == REG_SPH; }

#endif
