/* instructions.c: see instructions.h. */
#include "instructions.h"

#include <string.h>

/* clang-format off */
const instruction INSTRUCTIONS[] = {
  {"NOP",    "0000000000000000", PLAIN, 0, 0}, {"MOVW",   "00000001eeeeffff", PLAIN, 0, 0},
  {"MULS",   "00000010hhhhiiii", PLAIN, 0, 0}, {"MULSU",  "000000110hhh0iii", PLAIN, 0, 0},
  {"FMUL",   "000000110hhh1iii", PLAIN, 0, 0}, {"FMULS",  "000000111hhh0iii", PLAIN, 0, 0},
  {"FMULSU", "000000111hhh1iii", PLAIN, 0, 0}, {"CPC",    "000001rdddddrrrr", PLAIN, 0, 0},
  {"SBC",    "000010rdddddrrrr", PLAIN, 0, 0}, {"ADD",    "000011rdddddrrrr", PLAIN, 0, 0},
  {"CPSE",   "000100rdddddrrrr", SKIP,  0, 0}, {"CP",     "000101rdddddrrrr", PLAIN, 0, 0},
  {"SUB",    "000110rdddddrrrr", PLAIN, 0, 0}, {"ADC",    "000111rdddddrrrr", PLAIN, 0, 0},
  {"AND",    "001000rdddddrrrr", PLAIN, 0, 0}, {"EOR",    "001001rdddddrrrr", PLAIN, 0, 0},
  {"OR",     "001010rdddddrrrr", PLAIN, 0, 0}, {"MOV",    "001011rdddddrrrr", PLAIN, 0, 0},
  {"CPI",    "0011KKKKhhhhKKKK", PLAIN, 0, 0}, {"SBCI",   "0100KKKKhhhhKKKK", PLAIN, 0, 0},
  {"SUBI",   "0101KKKKhhhhKKKK", PLAIN, 0, 0}, {"ORI",    "0110KKKKhhhhKKKK", PLAIN, 0, 0},
  {"ANDI",   "0111KKKKhhhhKKKK", PLAIN, 0, 0}, {"LDI",    "1110KKKKhhhhKKKK", PLAIN, 0, 0},
  {"LDD Z",  "10q0qq0ddddd0qqq", POINTER, 30, 0}, {"LDD Y", "10q0qq0ddddd1qqq", POINTER, 28, 0},
  {"STD Z",  "10q0qq1rrrrr0qqq", POINTER, 30, 0}, {"STD Y", "10q0qq1rrrrr1qqq", POINTER, 28, 0},
  {"LDS",    "1001000ddddd0000", DIRECT,  0,  0}, {"STS",   "1001001rrrrr0000", DIRECT,  0,  0},
  {"LD Z+",  "1001000ddddd0001", POINTER, 30, 1}, {"LD -Z", "1001000ddddd0010", POINTER, 30, -1},
  {"LD Y+",  "1001000ddddd1001", POINTER, 28, 1}, {"LD -Y", "1001000ddddd1010", POINTER, 28, -1},
  {"LD X+",  "1001000ddddd1101", POINTER, 26, 1}, {"LD -X", "1001000ddddd1110", POINTER, 26, -1},
  {"LD X",   "1001000ddddd1100", POINTER, 26, 0}, {"ST X",  "1001001rrrrr1100", POINTER, 26, 0},
  {"ST Z+",  "1001001rrrrr0001", POINTER, 30, 1}, {"ST -Z", "1001001rrrrr0010", POINTER, 30, -1},
  {"ST Y+",  "1001001rrrrr1001", POINTER, 28, 1}, {"ST -Y", "1001001rrrrr1010", POINTER, 28, -1},
  {"ST X+",  "1001001rrrrr1101", POINTER, 26, 1}, {"ST -X", "1001001rrrrr1110", POINTER, 26, -1},
  {"LPM Z",  "1001000ddddd0100", PROGRAM, 30, 0}, {"LPM Z+", "1001000ddddd0101", PROGRAM, 30, 1},
  {"LPM",    "1001010111001000", PROGRAM, 30, 0}, {"SPM",   "1001010111101000", PROGRAM, 30, 0},
  {"PUSH",   "1001001rrrrr1111", PUSH,  0, 0}, {"POP",    "1001000ddddd1111", POP,   0, 0},
  {"COM",    "1001010ddddd0000", PLAIN, 0, 0}, {"NEG",    "1001010ddddd0001", PLAIN, 0, 0},
  {"SWAP",   "1001010ddddd0010", PLAIN, 0, 0}, {"INC",    "1001010ddddd0011", PLAIN, 0, 0},
  {"ASR",    "1001010ddddd0101", PLAIN, 0, 0}, {"LSR",    "1001010ddddd0110", PLAIN, 0, 0},
  {"ROR",    "1001010ddddd0111", PLAIN, 0, 0}, {"DEC",    "1001010ddddd1010", PLAIN, 0, 0},
  {"BSET",   "100101000sss1000", PLAIN, 0, 0}, {"BCLR",   "100101001sss1000", PLAIN, 0, 0},
  {"ADIW",   "10010110KKwwKKKK", PLAIN, 0, 0}, {"SBIW",   "10010111KKwwKKKK", PLAIN, 0, 0},
  {"MUL",    "100111rdddddrrrr", PLAIN, 0, 0}, {"BLD",    "1111100ddddd0bbb", PLAIN, 0, 0},
  {"BST",    "1111101ddddd0bbb", PLAIN, 0, 0}, {"SLEEP",  "1001010110001000", PLAIN, 0, 0},
  {"BREAK",  "1001010110011000", PLAIN, 0, 0}, {"WDR",    "1001010110101000", PLAIN, 0, 0},
  {"IN",     "10110AAdddddAAAA", PORT,  0, 0}, {"OUT",    "10111AArrrrrAAAA", PORT,  0, 0},
  {"CBI",    "10011000AAAAAbbb", PORT,  0, 0}, {"SBI",    "10011010AAAAAbbb", PORT,  0, 0},
  {"SBIC",   "10011001AAAAAbbb", PORT_SKIP, 0, 0}, {"SBIS", "10011011AAAAAbbb", PORT_SKIP, 0, 0},
  {"SBRC",   "1111110rrrrr0bbb", SKIP,  0, 0}, {"SBRS",   "1111111rrrrr0bbb", SKIP,  0, 0},
  {"BRBS",   "111100kkkkkkksss", BRANCH, 0, 0}, {"BRBC",  "111101kkkkkkksss", BRANCH, 0, 0},
  {"RJMP",   "1100kkkkkkkkkkkk", NEAR,  0, 0}, {"RCALL",  "1101kkkkkkkkkkkk", NEAR_CALL, 0, 0},
  {"JMP",    "1001010kkkkk110k", FAR,   0, 0}, {"CALL",   "1001010kkkkk111k", FAR_CALL, 0, 0},
  {"IJMP",   "1001010000001001", INDIRECT, 0, 0}, {"ICALL", "1001010100001001", INDIRECT_CALL, 0, 0},
  {"RET",    "1001010100001000", RETURN, 0, 0}, {"RETI",  "1001010100011000", RETURN, 0, 0},
  {"SBRS r31,7", "1111111111111111", SKIP, 0, 0}, /* erased flash: reserved, but the chip executes it so */
};
/* clang-format on */
const size_t INSTRUCTION_COUNT = sizeof INSTRUCTIONS / sizeof *INSTRUCTIONS;

uint16_t instruction_mask(const instruction *which) {
  unsigned mask = 0;
  for (const char *bit = which->bits; *bit; bit++) mask = mask << 1 | (*bit == '0' || *bit == '1');
  return (uint16_t)mask;
}

uint16_t instruction_value(const instruction *which) {
  unsigned value = 0;
  for (const char *bit = which->bits; *bit; bit++) value = value << 1 | (*bit == '1');
  return (uint16_t)value;
}

int instruction_field(const instruction *which, uint16_t opcode, char letter) {
  if (!strchr(which->bits, letter)) return -1;
  unsigned field = 0;
  for (unsigned bit = 0; bit < 16; bit++) {
    if (which->bits[bit] == letter) field = field << 1 | (opcode >> (15 - bit) & 1u);
  }
  return (int)field;
}

int instruction_register(const instruction *which, uint16_t opcode, char letter) {
  const int field = instruction_field(which, opcode, letter);
  if (field < 0) return -1;
  if (letter == 'h' || letter == 'i') return 16 + field;
  if (letter == 'e' || letter == 'f') return 2 * field;
  return letter == 'w' ? 24 + 2 * field : field;
}

const instruction *instruction_of(uint16_t opcode) {
  for (size_t i = 0; i < INSTRUCTION_COUNT; i++) {
    if ((opcode & instruction_mask(&INSTRUCTIONS[i])) == instruction_value(&INSTRUCTIONS[i])) return &INSTRUCTIONS[i];
  }
  return NULL;
}

/* LDS, STS; JMP, CALL. */
bool is_two_words(uint16_t opcode) { return (opcode & 0xFC0Fu) == 0x9000u || (opcode & 0xFE0Cu) == 0x940Cu; }

bool is_undefined(const instruction *which, uint16_t opcode) {
  if (!which->moves) return false;
  const int d = instruction_register(which, opcode, 'd'), r = instruction_register(which, opcode, 'r');
  const int moved = which->pointer;
  return d == moved || d == moved + 1 || r == moved || r == moved + 1;
}

/* ---- random numbers ---- */

uint64_t draw(numbers *from) {
  uint64_t z = from->state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return z ^ z >> 31;
}

numbers numbers_of(uint64_t stream, uint64_t number) {
  numbers first = {stream};
  return (numbers){draw(&first) + number * 0xD1B54A32D192ED03u};
}

uint32_t below(numbers *from, uint32_t limit) { return (uint32_t)((draw(from) >> 32) * limit >> 32); }

uint32_t between(numbers *from, uint32_t a, uint32_t b) { return a + below(from, b - a + 1); }

bool one_in(numbers *from, uint32_t count) { return below(from, count) == 0; }

uint32_t crc32_of(uint32_t crc, const void *bytes, size_t count) {
  static uint32_t table[256];
  if (!table[1]) {
    for (uint32_t i = 0; i < 256; i++) {
      uint32_t value = i;
      for (int bit = 0; bit < 8; bit++) value = value >> 1 ^ (value & 1 ? 0xEDB88320u : 0);
      table[i] = value;
    }
  }
  crc = ~crc;
  for (const uint8_t *at = bytes, *end = at + count; at < end; at++) crc = table[(crc ^ *at) & 0xFF] ^ crc >> 8;
  return ~crc;
}
