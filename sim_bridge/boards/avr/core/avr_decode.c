/* avr_decode.c: from words of flash to records. Which instruction an opcode is: PATTERNS, with the bits of the AVR
 * instruction set manual; where its operands are: one case for each way in which the manual places them.
 */
#include <stdlib.h>
#include <string.h>

#include "avr_decode.h"

#define X 26u
#define Y 28u
#define Z 30u

/* How the operands lie in an opcode. */
typedef enum {
  NONE,
  D5,      /* ---- ---d dddd ---- */
  D5_R5,   /* ---- --rd dddd rrrr */
  D4_R4,   /* ---- ---- dddd rrrr, of r16 to r31 */
  D3_R3,   /* ---- ---- -ddd -rrr, of r16 to r23 */
  PAIRS,   /* ---- ---- dddd rrrr, of even registers */
  D4_K8,   /* ---- KKKK dddd KKKK */
  PAIR_K6, /* ---- ---- KKdd KKKK, of r24, r26, r28, r30 */
  D5_Q6,   /* --q- qq-d dddd -qqq, with Z or Y */
  D5_XQ,   /* ---- ---d dddd ----, with X and no displacement */
  D5_X,    /* ---- ---d dddd 11-- */
  D5_Y,    /* ---- ---d dddd 10-- */
  D5_Z,    /* ---- ---d dddd 00-- */
  D5_K16,  /* ---- ---d dddd ---- and a word */
  D5_A6,   /* ---- -AAd dddd AAAA */
  A5_BIT,  /* ---- ---- AAAA Abbb */
  D5_BIT,  /* ---- ---d dddd -bbb */
  FLAG,    /* ---- ---- -sss ---- */
  FLAG_K7, /* ---- --kk kkkk ksss, from the next instruction on */
  K12,     /* ---- kkkk kkkk kkkk, from the next instruction on */
  K22      /* ---- ---k kkkk ---k and a word */
} operands;

/* Of two that fit the first. BLD, BST, SBRC and SBRS do not look at bit 3: erased flash, 0xFFFF, is SBRS r31, 7. */
/* clang-format off */
static const struct { uint16_t mask, value; uint8_t kind, operands; } PATTERNS[] = {
  {0xFFFF, 0x0000, NOP, NONE},     {0xFF00, 0x0100, MOVW, PAIRS},   {0xFF00, 0x0200, MULS, D4_R4},
  {0xFF88, 0x0300, MULSU, D3_R3},  {0xFF88, 0x0308, FMUL, D3_R3},   {0xFF88, 0x0380, FMULS, D3_R3},
  {0xFF88, 0x0388, FMULSU, D3_R3},
  {0xFC00, 0x0400, CPC, D5_R5},    {0xFC00, 0x0800, SBC, D5_R5},    {0xFC00, 0x0C00, ADD, D5_R5},
  {0xFC00, 0x1000, CPSE, D5_R5},   {0xFC00, 0x1400, CP, D5_R5},     {0xFC00, 0x1800, SUB, D5_R5},
  {0xFC00, 0x1C00, ADC, D5_R5},    {0xFC00, 0x2000, AND, D5_R5},    {0xFC00, 0x2400, EOR, D5_R5},
  {0xFC00, 0x2800, OR, D5_R5},     {0xFC00, 0x2C00, MOV, D5_R5},
  {0xF000, 0x3000, CPI, D4_K8},    {0xF000, 0x4000, SBCI, D4_K8},   {0xF000, 0x5000, SUBI, D4_K8},
  {0xF000, 0x6000, ORI, D4_K8},    {0xF000, 0x7000, ANDI, D4_K8},   {0xF000, 0xE000, LDI, D4_K8},
  {0xD200, 0x8000, LDD, D5_Q6},    {0xD200, 0x8200, STD, D5_Q6},
  {0xFE0F, 0x9000, LDS, D5_K16},   {0xFE0F, 0x9200, STS, D5_K16},
  {0xFE0F, 0x9001, LD_UP, D5_Z},   {0xFE0F, 0x9002, LD_DOWN, D5_Z}, {0xFE0F, 0x9009, LD_UP, D5_Y},
  {0xFE0F, 0x900A, LD_DOWN, D5_Y}, {0xFE0F, 0x900C, LDD, D5_XQ},     {0xFE0F, 0x900D, LD_UP, D5_X},
  {0xFE0F, 0x900E, LD_DOWN, D5_X},
  {0xFE0F, 0x9201, ST_UP, D5_Z},   {0xFE0F, 0x9202, ST_DOWN, D5_Z}, {0xFE0F, 0x9209, ST_UP, D5_Y},
  {0xFE0F, 0x920A, ST_DOWN, D5_Y}, {0xFE0F, 0x920C, STD, D5_XQ},     {0xFE0F, 0x920D, ST_UP, D5_X},
  {0xFE0F, 0x920E, ST_DOWN, D5_X},
  {0xFFFF, 0x95C8, LPM, NONE},     {0xFE0F, 0x9004, LPM, D5},       {0xFE0F, 0x9005, LPM_UP, D5},
  {0xFFFF, 0x95E8, SPM, NONE},
  {0xFE0F, 0x920F, PUSH, D5},      {0xFE0F, 0x900F, POP, D5},
  {0xFE0F, 0x9400, COM, D5},       {0xFE0F, 0x9401, NEG, D5},       {0xFE0F, 0x9402, SWAP, D5},
  {0xFE0F, 0x9403, INC, D5},       {0xFE0F, 0x940A, DEC, D5},       {0xFE0F, 0x9405, ASR, D5},
  {0xFE0F, 0x9406, LSR, D5},       {0xFE0F, 0x9407, ROR, D5},
  {0xFFFF, 0x9478, SEI, NONE},     {0xFFFF, 0x94F8, CLI, NONE},
  {0xFF8F, 0x9408, BSET, FLAG},    {0xFF8F, 0x9488, BCLR, FLAG},
  {0xFFFF, 0x9409, IJMP, NONE},    {0xFFFF, 0x9509, ICALL, NONE},   {0xFFFF, 0x9508, RET, NONE},
  {0xFFFF, 0x9518, RETI, NONE},    {0xFFFF, 0x9588, SLEEP, NONE},   {0xFFFF, 0x9598, NOP, NONE},
  {0xFFFF, 0x95A8, WDR, NONE},
  {0xFE0E, 0x940C, LONG_JUMP, K22}, {0xFE0E, 0x940E, CALL, K22},
  {0xFF00, 0x9600, ADIW, PAIR_K6}, {0xFF00, 0x9700, SBIW, PAIR_K6},
  {0xFF00, 0x9800, CBI, A5_BIT},   {0xFF00, 0x9900, SBIC, A5_BIT},  {0xFF00, 0x9A00, SBI, A5_BIT},
  {0xFF00, 0x9B00, SBIS, A5_BIT},  {0xFC00, 0x9C00, MUL, D5_R5},
  {0xFE0F, 0xB60F, IN_SREG, D5_A6}, {0xF800, 0xB000, IN, D5_A6},
  {0xFE0F, 0xBE0F, OUT_SREG, D5_A6}, {0xFE0F, 0xBE0D, OUT_SPL, D5_A6}, {0xF800, 0xB800, OUT, D5_A6},
  {0xF000, 0xC000, JUMP, K12},     {0xF000, 0xD000, RCALL, K12},
  {0xFC07, 0xF000, BRCS, FLAG_K7}, {0xFC07, 0xF400, BRCC, FLAG_K7}, {0xFC07, 0xF001, BREQ, FLAG_K7},
  {0xFC07, 0xF401, BRNE, FLAG_K7}, {0xFC07, 0xF002, BRMI, FLAG_K7}, {0xFC07, 0xF402, BRPL, FLAG_K7},
  {0xFC07, 0xF004, BRLT, FLAG_K7}, {0xFC07, 0xF404, BRGE, FLAG_K7},
  {0xFC00, 0xF000, BRBS, FLAG_K7}, {0xFC00, 0xF400, BRBC, FLAG_K7},
  {0xFE00, 0xF800, BLD, D5_BIT},   {0xFE00, 0xFA00, BST, D5_BIT},
  {0xFFFF, 0xFFFF, ERASED, D5_BIT},
  {0xFE00, 0xFC00, SBRC, D5_BIT},  {0xFE00, 0xFE00, SBRS, D5_BIT},
};
/* clang-format on */

#define ADDRESSES (0x10000u + 3u) /* of words, as far as RET, and a two-word instruction or a skip there, may lead */

enum { PATTERN_COUNT = sizeof PATTERNS / sizeof *PATTERNS, NO_PATTERN = PATTERN_COUNT };

static uint8_t pattern_of[0x10000]; /* by opcode: index into PATTERNS */

__attribute__((constructor)) static void find_patterns(void) {
  memset(pattern_of, NO_PATTERN, sizeof pattern_of);
  for (unsigned p = PATTERN_COUNT; p-- > 0;) { /* the first that fits comes last, and stays */
    const unsigned rest = (uint16_t)~PATTERNS[p].mask;
    unsigned free_bits = 0;
    do {
      pattern_of[PATTERNS[p].value | free_bits] = (uint8_t)p;
      free_bits = (free_bits - rest) & rest; /* the next number in the bits that the pattern leaves */
    } while (free_bits);
  }
}

static unsigned word_at(const avr_core *core, uint32_t address) {
  return core->flash[address] | (unsigned)core->flash[address + 1] << 8;
}

/* The program address that is `words` behind the next instruction; flash is a ring. */
static uint16_t relative(uint32_t word, int offset) {
  return (uint16_t)((word + 1u + (uint32_t)offset) % (AVR_FLASH_SIZE / 2u));
}

static avr_instruction with_operands(uint8_t kind, operands where, unsigned opcode, unsigned next, uint32_t word) {
  const unsigned d = opcode >> 4 & 0x1Fu, r = (opcode >> 5 & 0x10u) | (opcode & 0xFu), low = opcode & 0xFu;
  avr_instruction i = {kind, (uint8_t)d, 0};
  const uint8_t mask = (uint8_t)(1u << (opcode & 7u));
  /* clang-format off */
  switch (where) {
    case NONE: i.d = 0; break; /* LPM is LPM r0, Z */
    case D5: break;
    case D5_R5: i.k = (uint16_t)r; break;
    case D4_R4: i.d = (uint8_t)(16u + (d & 0xFu)); i.k = (uint16_t)(16u + low); break;
    case D3_R3: i.d = (uint8_t)(16u + (d & 7u)); i.k = (uint16_t)(16u + (low & 7u)); break;
    case PAIRS: i.d = (uint8_t)(2u * (d & 0xFu)); i.k = (uint16_t)(2u * low); break;
    case D4_K8: i.d = (uint8_t)(16u + (d & 0xFu)); i.k = (uint16_t)((opcode >> 4 & 0xF0u) | low); break;
    case PAIR_K6: i.d = (uint8_t)(24u + 2u * (d & 3u)); i.k = (uint16_t)((opcode >> 2 & 0x30u) | low); break;
    case D5_Q6:
      i.k = (uint16_t)((opcode & 8u ? Y << 8 : Z << 8) | (opcode >> 8 & 0x20u) | (opcode >> 7 & 0x18u) | (opcode & 7u));
      break;
    case D5_XQ: i.k = X << 8; break;
    case D5_X: i.k = X; break;
    case D5_Y: i.k = Y; break;
    case D5_Z: i.k = Z; break;
    case D5_K16: i.k = (uint16_t)next; break;
    case D5_A6: i.k = (uint16_t)(AVR_IO_BEGIN + ((opcode >> 5 & 0x30u) | low)); break;
    case A5_BIT: i.d = mask; i.k = (uint16_t)(AVR_IO_BEGIN + (opcode >> 3 & 0x1Fu)); break;
    case D5_BIT: i.k = mask; break;
    case FLAG: i.d = d & 7u; break;
    case FLAG_K7:
      i.d = opcode & 7u;
      i.k = relative(word, (int)(opcode >> 3 & 0x3Fu) - (int)(opcode >> 3 & 0x40u));
      break;
    case K12: i.k = relative(word, (int)(opcode & 0x7FFu) - (int)(opcode & 0x800u)); break;
    case K22: i.k = opcode & 0x01F1u ? 0xFFFF : (uint16_t)next; break; /* no flash is that large */
  }
  /* clang-format on */
  return i;
}

static avr_instruction decode(const avr_core *core, uint32_t address) {
  if (address + 2u <= core->code_begin || address >= core->code_end) return (avr_instruction){OUTSIDE, 0, 0};
  const unsigned opcode = word_at(core, address), p = pattern_of[opcode];
  const unsigned next = address + 2u < AVR_FLASH_SIZE ? word_at(core, address + 2u) : 0xFFFFu;
  if (p == NO_PATTERN) return (avr_instruction){INVALID, 0, 0};
  uint8_t kind = PATTERNS[p].kind;
  const bool in_ram = next >= AVR_RAM_BEGIN && next < AVR_DATA_SIZE;
  if (kind == LDS && in_ram) kind = LDS_RAM;
  if (kind == STS && in_ram) kind = STS_RAM;
  avr_instruction i = with_operands(kind, (operands)PATTERNS[p].operands, opcode, next, address / 2u);
  const bool is_branch = PATTERNS[p].operands == FLAG_K7;
  if (is_branch && !avr_is_code(core, i.k * 2u)) i.kind = opcode & 0x0400u ? BRBC : BRBS; /* these look where they go */
  return i;
}

void avr_core_flash_changed(avr_core *core, uint32_t address, uint32_t bytes) {
  const uint32_t end = address + bytes < AVR_FLASH_SIZE ? address + bytes : AVR_FLASH_SIZE;
  address &= ~1u;
  if (address >= 2u) address -= 2u; /* that before may have its second word here */
  for (; address < end; address += 2u) core->code[address / 2u] = decode(core, address);
}

void avr_core_set_code(avr_core *core, uint32_t begin, uint32_t end) {
  if (begin == core->code_begin && end == core->code_end) return;
  core->code_begin = begin;
  core->code_end = end;
  avr_core_flash_changed(core, 0, AVR_FLASH_SIZE);
}

bool avr_core_create(avr_core *core) {
  static const avr_owner_calls NO_CALLS = {0};
  memset(core, 0, sizeof *core);
  core->flash = malloc(AVR_FLASH_SIZE);
  core->code = calloc(ADDRESSES, sizeof *core->code); /* OUTSIDE */
  if (!core->flash || !core->code) {
    avr_core_free(core);
    return false;
  }
  memset(core->flash, 0xFF, AVR_FLASH_SIZE);
  core->code_end = AVR_FLASH_SIZE;
  core->stack_floor = AVR_RAM_BEGIN;
  core->next_due = UINT64_MAX;
  core->calls = &NO_CALLS;
  avr_core_flash_changed(core, 0, AVR_FLASH_SIZE);
  avr_core_reset(core, 0);
  return true;
}

void avr_core_free(avr_core *core) {
  free(core->flash);
  free(core->code);
  core->flash = NULL;
  core->code = NULL;
}
