/* avr_decode.h: the kinds of instructions, by the names of the AVR instruction set manual; those that differ in what takes
 * time to tell when they are executed are kinds by themselves.
 */
#ifndef AVR_DECODE_H
#define AVR_DECODE_H

#include <stdbool.h>

#include "avr_core.h"

/* clang-format off */
#define AVR_KINDS(K) \
  K(OUTSIDE) /* no code is here: it is not executed */ \
  K(INVALID) /* no instruction of this core */ \
  K(NOP)     /* and BREAK: nothing is joined to debugWIRE */ \
  K(MOV) K(MOVW) K(LDI) K(ADD) K(ADC) K(SUB) K(SUBI) K(SBC) K(SBCI) K(AND) K(ANDI) K(OR) K(ORI) K(EOR) \
  K(CP) K(CPC) K(CPI) K(COM) K(NEG) K(INC) K(DEC) K(SWAP) K(ASR) K(LSR) K(ROR) K(ADIW) K(SBIW) \
  K(MUL) K(MULS) K(MULSU) K(FMUL) K(FMULS) K(FMULSU) \
  K(LDD) K(STD)         /* by X, Y or Z, whose number is the high byte of k, and displacement, the low one */ \
  K(LD_UP) K(ST_UP)     /* one more behind; the pointer is k */ \
  K(LD_DOWN) K(ST_DOWN) /* one less before */ \
  K(PUSH) K(POP) K(LPM) K(LPM_UP) K(SPM) \
  K(LDS) K(STS) K(LDS_RAM) K(STS_RAM) K(LONG_JUMP) K(CALL) /* these have two words; LONG_JUMP is JMP */ \
  K(JUMP) K(IJMP) K(RCALL) K(ICALL) K(RET) K(RETI)         /* JUMP is RJMP */ \
  K(IN) K(IN_SREG) K(OUT) K(OUT_SREG) K(OUT_SPL) K(SBI) K(CBI) K(BLD) K(BST) K(BSET) K(BCLR) K(SEI) K(CLI) \
  K(BRCS) K(BRCC) K(BREQ) K(BRNE) K(BRMI) K(BRPL) K(BRLT) K(BRGE) K(BRBS) K(BRBC) \
  K(CPSE) K(SBRC) K(SBRS) K(SBIC) K(SBIS) \
  K(ERASED)  /* 0xFFFF, as in erased flash: SBRS r31, 7 */ \
  K(SLEEP) K(WDR)

#define AVR_ENUMERATOR(kind) kind,
enum { AVR_KINDS(AVR_ENUMERATOR) };
/* clang-format on */

static inline bool avr_has_two_words(unsigned kind) { return kind >= LDS && kind <= CALL; }

/* It stops if it leads to no code. What leads there otherwise, such as running on, stops at the record there, OUTSIDE. */
static inline bool avr_looks_where_it_goes(unsigned kind) {
  return (kind >= LONG_JUMP && kind <= RETI) || kind == BRBS || kind == BRBC || kind == OUTSIDE;
}

#endif
