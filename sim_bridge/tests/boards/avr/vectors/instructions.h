/* instructions.h: the instructions of the ATmega328P as the AVR instruction set manual (DS40002198) writes them, and random
 * numbers that depend on nothing but their names. The data sheet's section 31 says which of them the chip has. */
#ifndef INSTRUCTIONS_H
#define INSTRUCTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What an instruction needs besides its registers. */
typedef enum {
  PLAIN,         /* nothing */
  BRANCH,        /* on a flag */
  SKIP,          /* a next instruction, of one or two words */
  NEAR,          /* RJMP */
  NEAR_CALL,     /* RCALL */
  FAR,           /* JMP: a second word, of program memory */
  FAR_CALL,      /* CALL */
  INDIRECT,      /* IJMP: an address in Z */
  INDIRECT_CALL, /* ICALL */
  RETURN,        /* an address on the stack */
  PUSH,
  POP,
  POINTER, /* X, Y or Z into data memory */
  DIRECT,  /* LDS, STS: a second word, of data memory */
  PORT,    /* I/O register A */
  PORT_SKIP,
  PROGRAM /* Z into program memory */
} need;

/* Letters of `bits` are operands: d, r any register; h, i one of r16 and up; e, f a pair r1:r0 and up by its half; w
 * r25:r24 and up by its half; A an I/O register; K, k constants; q a displacement; b, s a bit. */
typedef struct {
  const char *name, *bits;
  need needs;
  uint8_t pointer; /* POINTER: 26, 28 or 30 */
  int8_t moves;    /* the pointer: -1 before, 1 behind */
} instruction;

extern const instruction INSTRUCTIONS[];
extern const size_t INSTRUCTION_COUNT;

uint16_t instruction_mask(const instruction *which);  /* the bits that are no operand's */
uint16_t instruction_value(const instruction *which); /* and what they are */
/* Operand `letter` of an opcode; -1: it has none. */
int instruction_field(const instruction *which, uint16_t opcode, char letter);
/* The register that a letter among d, r, h, i, e, f, w stands for, the lower one of a pair; -1: it has none. */
int instruction_register(const instruction *which, uint16_t opcode, char letter);
/* The instruction that an opcode is; NULL: none. */
const instruction *instruction_of(uint16_t opcode);
bool is_two_words(uint16_t opcode);
/* The manual leaves open what it does: the register that it loads or stores is half of the pointer that it moves. */
bool is_undefined(const instruction *which, uint16_t opcode);

/* ---- random numbers: SplitMix64 (Steele, Lea, Flood 2014) ---- */

typedef struct {
  uint64_t state;
} numbers;

numbers numbers_of(uint64_t stream, uint64_t number);
uint64_t draw(numbers *from);
uint32_t below(numbers *from, uint32_t limit);           /* 0 to limit - 1 */
uint32_t between(numbers *from, uint32_t a, uint32_t b); /* a to b */
bool one_in(numbers *from, uint32_t count);

/* CRC-32 (IEEE 802.3, as zlib computes it) of more bytes. */
uint32_t crc32_of(uint32_t crc, const void *bytes, size_t count);

#endif
