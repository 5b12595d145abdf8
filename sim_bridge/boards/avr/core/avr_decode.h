/* avr_decode.h: the kinds of instructions, by the names of the AVR instruction set manual; those that differ in what takes
 * time to tell when they are executed are kinds by themselves.
 */
#ifndef AVR_DECODE_H
#define AVR_DECODE_H

#include <stdbool.h>

#include "avr_core.h"

/* clang-format off */
enum {
  OUTSIDE, /* no code is here: it is not executed */
  INVALID, /* no instruction of this core */
  NOP, /* and BREAK: nothing is joined to debugWIRE */
  MOV, MOVW, LDI, ADD, ADC, SUB, SUBI, SBC, SBCI, AND, ANDI, OR, ORI, EOR, CP, CPC, CPI, COM, NEG, INC, DEC, SWAP, ASR, LSR, ROR,
  ADIW, SBIW, MUL, MULS, MULSU, FMUL, FMULS, FMULSU,
  LDD, STD,         /* by X, Y or Z, whose number is the high byte of k, with displacement, the low one; it may be 0 */
  LD_UP, ST_UP,     /* one more behind; the pointer is k */
  LD_DOWN, ST_DOWN, /* one less before */
  PUSH, POP, LPM, LPM_UP, SPM,
  LDS, STS, LDS_RAM, STS_RAM, LONG_JUMP, CALL, /* these have two words; LONG_JUMP is JMP */
  JUMP, IJMP, RCALL, ICALL, RET, RETI, /* JUMP is RJMP */
  IN, IN_SREG, OUT, OUT_SREG, OUT_SPL, SBI, CBI,
  BLD, BST, BSET, BCLR, SEI, CLI,
  BRCS, BRCC, BREQ, BRNE, BRMI, BRPL, BRLT, BRGE, BRBS, BRBC,
  CPSE, SBRC, SBRS, SBIC, SBIS,
  ERASED, /* 0xFFFF, as in erased flash: SBRS r31, 7 */
  SLEEP, WDR
};
/* clang-format on */

static inline bool avr_has_two_words(unsigned kind) { return kind >= LDS && kind <= CALL; }

static inline bool avr_is_stack_half(const avr_instruction *i) { return i->k == REG_SPL || i->k == REG_SPH; }

#endif
