/* avr_execute.c: the interpreter, after the AVR instruction set manual; cycles are those of AVRe+ with a 16-bit program
 * counter. What each instruction does is in avr_instructions.def.
 *
 * What touches registers, RAM and flash is done there. Whatever reaches an I/O register, leaves RAM, or takes
 * the stack below its floor goes through `avr_load` and `avr_store`, and hands the core over to its owner meanwhile.
 */
#include <string.h>

#include "avr_arithmetic.h"
#include "avr_decode.h"

#define ALWAYS_INLINE inline __attribute__((always_inline))
#define NOT_INLINE __attribute__((noinline))

enum { Z = 30 };

/* ---- from outside ---- */

uint8_t avr_core_flags(const avr_core *core) { return all_flags(&core->flags); }

void avr_core_set_flags(avr_core *core, uint8_t sreg) { core->flags = flags_of(sreg); }

void avr_core_reset(avr_core *core, uint32_t pc) {
  memset(core->data + AVR_IO_BEGIN, 0, AVR_RAM_BEGIN - AVR_IO_BEGIN);
  put_word(core->data, REG_SPL, AVR_DATA_SIZE - 1u);
  avr_core_set_flags(core, 0);
  core->pc = pc;
  core->raised = core->enabled = 0;
  core->one_more = core->sleeping = false;
}

/* ---- data memory ---- */

static inline bool in_ram(uint16_t address) {
  return (uint16_t)(address - AVR_RAM_BEGIN) < AVR_DATA_SIZE - AVR_RAM_BEGIN;
}

static inline bool in_io(uint16_t address) { return (uint16_t)(address - AVR_IO_BEGIN) < AVR_RAM_BEGIN - AVR_IO_BEGIN; }

/* Everything that is due until `cycle` happens, and it is then. */
static void reach(avr_core *core, uint64_t cycle) {
  if (core->next_due <= cycle) core->calls->happen(core->owner, cycle);
  if (cycle > core->clock) core->clock = cycle;
}

/* Behind the end of memory is nothing; here it is RAM again. */
static uint16_t within_memory(avr_core *core, uint16_t address) {
  if (address < AVR_DATA_SIZE) return address;
  if (core->calls->beyond_memory) core->calls->beyond_memory(core->owner);
  return (uint16_t)(AVR_RAM_BEGIN + (address - AVR_RAM_BEGIN) % (AVR_DATA_SIZE - AVR_RAM_BEGIN));
}

/* I was clear, or RETI has set it: one instruction is executed before an interrupt. Where none can come before that has
 * ended, there is no need to stop. */
static void let_interrupts_in(avr_core *core, uint64_t end) {
  if (!(core->raised & core->enabled) && core->next_due > end) return;
  core->one_more = true;
  avr_stop(core);
}

static void store_flags(avr_core *core, uint8_t sreg, uint64_t end) {
  const bool before = core->flags.i;
  core->data[REG_SREG] = sreg;
  core->flags = flags_of(sreg);
  if (core->flags.i && !before) let_interrupts_in(core, end);
}

static NOT_INLINE uint8_t avr_load(avr_core *core, uint16_t address, uint64_t cycle) {
  address = within_memory(core, address);
  if (in_io(address)) {
    if (address == REG_SREG) return core->data[address] = all_flags(&core->flags);
    avr_register_read *read = core->reads[address];
    if (!read) return core->data[address];
    reach(core, cycle);
    return core->data[address] = read(core->owner, address, cycle);
  }
  if (core->written && in_ram(address) && !core->written[address]) {
    core->calls->never_written(core->owner);
    core->written[address] = 1;
  }
  return core->data[address];
}

static NOT_INLINE void avr_store(avr_core *core, uint16_t address, uint8_t value, uint64_t cycle) {
  address = within_memory(core, address);
  if (in_io(address)) {
    avr_register_write *write = core->writes[address];
    if (address == REG_SREG) {
      store_flags(core, value, cycle + 1u);
    } else if (write) {
      reach(core, cycle);
      write(core->owner, address, value, cycle + 1u);
    } else {
      core->data[address] = value;
    }
    return;
  }
  if (core->written) core->written[address] = 1;
  core->data[address] = value;
}

/* Instructions of one bit of an I/O register read it and write all of it, but where a written one alone acts. */
static NOT_INLINE void store_bit(avr_core *core, avr_instruction i, uint64_t cycle) {
  const uint16_t address = i.k;
  const bool acts_on_ones = core->ones >> (address - AVR_IO_BEGIN) & 1u;
  if (acts_on_ones && i.kind == CBI) return;
  const uint8_t before = acts_on_ones ? 0 : avr_load(core, address, cycle);
  avr_store(core, address, (uint8_t)(i.kind == SBI ? before | i.d : before & ~i.d), cycle);
}

/* By Y + 5 and the like. */
static inline uint16_t displaced(const uint8_t *data, avr_instruction i) {
  return (uint16_t)(word_at(data, i.k >> 8) + (i.k & 0xFFu));
}

/* ---- what the interpreter keeps to itself ---- */

typedef struct {
  uint64_t cycle;
  const avr_instruction *at, *next;
  uint32_t takes; /* cycles */
  bool moves_stack;
} state;

static ALWAYS_INLINE uint32_t address_of(const avr_core *core, const avr_instruction *i) {
  return (uint32_t)(i - core->code) * 2u;
}

/* Around whatever may look at the core or change it. */
static ALWAYS_INLINE void hand_over(avr_core *core, const state *s) {
  core->pc = address_of(core, s->at);
  core->cycle = s->cycle;
}

static ALWAYS_INLINE void take_back(const avr_core *core, state *s) {
  s->cycle = core->cycle;
  s->moves_stack = true; /* for all that is known */
}

static ALWAYS_INLINE uint8_t load(avr_core *core, state *s, const uint8_t *written, uint16_t address, unsigned later) {
  if (in_ram(address) && (!written || written[address])) return core->data[address];
  hand_over(core, s);
  const uint8_t value = avr_load(core, address, s->cycle + later);
  take_back(core, s);
  return value;
}

static ALWAYS_INLINE void store(avr_core *core, state *s, uint8_t *written, uint16_t address, uint8_t value,
                                unsigned later) {
  if (in_ram(address)) {
    core->data[address] = value;
    if (written) written[address] = 1;
    return;
  }
  hand_over(core, s);
  avr_store(core, address, value, s->cycle + later);
  take_back(core, s);
}

/* From an address that is in RAM for sure. */
static ALWAYS_INLINE uint8_t load_ram(avr_core *core, state *s, const uint8_t *written, uint16_t address) {
  return written ? load(core, s, written, address, 1) : core->data[address];
}

static ALWAYS_INLINE void store_ram(avr_core *core, state *s, uint8_t *written, uint16_t address, uint8_t value) {
  if (written) store(core, s, written, address, value, 1);
  if (!written) core->data[address] = value;
}

/* By X, Y or Z, which then is `change` above `address`. What it loads may be half of the pointer; what it stores is what the
 * register had before. */
static ALWAYS_INLINE void load_moving(avr_core *core, state *s, const uint8_t *written, avr_instruction i,
                                      uint16_t address, unsigned change) {
  const uint8_t value = load(core, s, written, address, 1);
  put_word(core->data, i.k, address + change);
  core->data[i.d] = value;
}

static ALWAYS_INLINE void store_moving(avr_core *core, state *s, uint8_t *written, avr_instruction i, uint16_t address,
                                       unsigned change) {
  store(core, s, written, address, core->data[i.d], 1);
  put_word(core->data, i.k, address + change);
}

/* ---- the stack ---- */

/* The owner sees where the stack pointer is once it is whole, at the end of the instruction. */
static void tell_of_stack(avr_core *core, uint16_t before, uint32_t takes) {
  if (!core->calls->left_stack) return;
  core->cycle += takes;
  core->calls->left_stack(core->owner, core->pc, before);
  core->cycle -= takes;
}

static NOT_INLINE void push_anywhere(avr_core *core, unsigned value, unsigned bytes, uint32_t takes) {
  const uint16_t stack = avr_stack(core);
  for (unsigned n = 0; n < bytes; n++)
    avr_store(core, (uint16_t)(stack - n), (uint8_t)(value >> 8 * n), core->cycle + 1u);
  put_word(core->data, REG_SPL, stack - bytes);
  tell_of_stack(core, stack, takes);
}

static NOT_INLINE unsigned pop_anywhere(avr_core *core, unsigned bytes, uint32_t takes) {
  const uint16_t stack = avr_stack(core);
  unsigned value = 0;
  for (unsigned n = 1; n <= bytes; n++) value = value << 8 | avr_load(core, (uint16_t)(stack + n), core->cycle + 1u);
  put_word(core->data, REG_SPL, stack + bytes);
  tell_of_stack(core, stack, takes);
  return value;
}

/* One byte, or an address: two, the low one first, so that it lies above. */
static ALWAYS_INLINE void push(avr_core *core, state *s, uint8_t *written, unsigned value, unsigned bytes) {
  const uint16_t stack = avr_stack(core);
  s->moves_stack = true;
  if (stack + 1u < core->stack_floor + bytes || stack >= AVR_DATA_SIZE) {
    hand_over(core, s);
    push_anywhere(core, value, bytes, s->takes);
    take_back(core, s);
    return;
  }
  for (unsigned n = 0; n < bytes; n++) {
    core->data[stack - n] = (uint8_t)(value >> 8 * n);
    if (written) written[stack - n] = 1;
  }
  put_word(core->data, REG_SPL, stack - bytes);
}

static ALWAYS_INLINE unsigned pop(avr_core *core, state *s, const uint8_t *written, unsigned bytes) {
  const uint16_t stack = avr_stack(core), first = (uint16_t)(stack + 1u), last = (uint16_t)(stack + bytes);
  s->moves_stack = true;
  if (!in_ram(first) || !in_ram(last) || (written && (!written[first] || !written[last]))) {
    hand_over(core, s);
    const unsigned value = pop_anywhere(core, bytes, s->takes);
    take_back(core, s);
    return value;
  }
  put_word(core->data, REG_SPL, last);
  return bytes == 1u ? core->data[first] : (unsigned)core->data[first] << 8 | core->data[last];
}

void avr_enter_interrupt(avr_core *core, unsigned vector) {
  const uint16_t stack = avr_stack(core);
  avr_store(core, stack, (uint8_t)(core->pc >> 1), core->cycle + 1u);
  avr_store(core, (uint16_t)(stack - 1u), (uint8_t)(core->pc >> 9), core->cycle + 1u);
  put_word(core->data, REG_SPL, stack - 2u);
  core->flags.i = 0;
  core->pc = vector * 4u;
}

/* ---- jumps ---- */

/* Where no code is it stops. */
static ALWAYS_INLINE void jump(avr_core *core, state *s, uint32_t word) {
  s->next = core->code + word;
  if (!avr_is_code(core, word * 2u)) avr_stop(core);
}

static ALWAYS_INLINE void branch(const avr_core *core, state *s, avr_instruction i, bool taken) {
  if (!taken) return;
  s->next = core->code + i.k;
  s->takes = 2;
}

/* A word of the next instruction takes a cycle. */
static ALWAYS_INLINE void skip(state *s, bool skips) {
  if (!skips) return;
  const uint32_t words = avr_has_two_words(s->next->kind) ? 2 : 1;
  s->next += words;
  s->takes = 1 + words;
}

/* ---- the rest of the state ---- */

static NOT_INLINE uint8_t load_program(avr_core *core, uint16_t address) {
  const avr_owner_calls *calls = core->calls;
  if (core->data[REG_SPMCSR] && calls->load_program) return calls->load_program(core->owner, address);
  return address < AVR_FLASH_SIZE ? core->flash[address] : 0xFF;
}

static ALWAYS_INLINE uint8_t program_byte(avr_core *core, state *s) {
  const uint16_t address = word_at(core->data, Z);
  if (address < AVR_FLASH_SIZE && !core->data[REG_SPMCSR]) return core->flash[address];
  hand_over(core, s);
  const uint8_t value = load_program(core, address);
  take_back(core, s);
  return value;
}

/* By its number in SREG. */
static NOT_INLINE bool has_flag(const avr_core *core, unsigned number) {
  return all_flags(&core->flags) >> number & 1u;
}

static void set_flag(avr_core *core, unsigned number, bool set) {
  const unsigned bit = 1u << number, before = all_flags(&core->flags);
  core->flags = flags_of((uint8_t)(set ? before | bit : before & ~bit));
}

/* What is left of the instructions; the core is handed over. Without an owner WDR and SPM do nothing. */
static NOT_INLINE void do_rare(avr_core *core, avr_instruction i, uint32_t takes) {
  const avr_owner_calls *calls = core->calls;
  const uint8_t value = core->data[i.d];
  const uint16_t stack = avr_stack(core);
  /* clang-format off */
  switch (i.kind) {
    case SBI: case CBI: store_bit(core, i, core->cycle + 1u); break;
    case BSET: case BCLR: set_flag(core, i.d, i.kind == BSET); break;
    case WDR: if (calls->watchdog_reset) calls->watchdog_reset(core->owner); break;
    case SPM: if (calls->store_program) calls->store_program(core->owner); break;
    case ERASED: if (calls->runs_erased) calls->runs_erased(core->owner); break;
    case OUT_SPL:
      core->data[REG_SPL] = value;
      tell_of_stack(core, stack, takes);
      break;
    case SLEEP:
      core->sleeping = core->data[REG_SMCR] & 1u; /* SE */
      avr_stop(core);
      break;
    default: /* INVALID */
      if (calls->cannot_go_on) calls->cannot_go_on(core->owner, word_at(core->flash, core->pc));
      avr_stop(core);
  }
  /* clang-format on */
}

/* ---- the interpreter ---- */

#define D data[i.d]
#define R data[i.k]
#define K ((uint8_t)i.k)
#define POINTER word_at(data, i.k)

/* With all that may be looked at on the way. */
static uint32_t run_looking(avr_core *core, const avr_stops *stops) {
  uint8_t *const data = core->data, *const written = core->written, *const covered = core->covered;
  avr_flags *const f = &core->flags;
  state s = {.cycle = core->cycle, .next = core->code + core->pc / 2u};
  do {
    s.at = s.next++;
    const avr_instruction i = *s.at;
    s.takes = 1;
    s.moves_stack = false;
    switch (i.kind) {
#define OP(kind) case kind:
#define NEXT break;
#include "avr_instructions.def"
#undef OP
#undef NEXT
    }
    s.cycle += s.takes;
    const uint32_t at = address_of(core, s.at) / 2u, next = address_of(core, s.next) / 2u;
    if (covered && at < AVR_FLASH_SIZE / 2u) covered[at] |= (uint8_t)(next == at + 1u ? 1u : 2u);
    if (stops) {
      if (s.moves_stack) {
        const uint16_t above = (uint16_t)(avr_stack(core) - stops->lowest);
        if (above > (uint16_t)(stops->highest - stops->lowest)) break;
      }
      if (next >= AVR_FLASH_SIZE / 2u || stops->marked[next]) break;
    }
  } while (s.cycle < core->until);
  core->pc = address_of(core, s.next);
  core->cycle = s.cycle;
  return address_of(core, s.at);
}

#if defined __GNUC__ && !defined __cppcheck__
/* The same where nothing is looked at: it jumps from each instruction to the next, which a processor foresees better than
 * one jump for all (gcc's and clang's labels as values). */
static uint32_t run_plain(avr_core *core) {
#define LABEL(kind) &&L_##kind,
  static const void *const LABELS[] = {AVR_KINDS(LABEL)};
  uint8_t *const data = core->data, *const written = NULL;
  avr_flags *const f = &core->flags;
  state s = {.cycle = core->cycle, .next = core->code + core->pc / 2u};
  avr_instruction i;
#define OP(kind) L_##kind:
#define FETCH      \
  s.at = s.next++; \
  i = *s.at;       \
  s.takes = 1;     \
  goto *LABELS[i.kind];
#define NEXT                               \
  {                                        \
    s.cycle += s.takes;                    \
    if (s.cycle >= core->until) goto last; \
    FETCH                                  \
  }
  FETCH
#include "avr_instructions.def"
last:
  core->pc = address_of(core, s.next);
  core->cycle = s.cycle;
  return address_of(core, s.at);
}
#else
static uint32_t run_plain(avr_core *core) { return run_looking(core, NULL); }
#endif

uint32_t avr_run(avr_core *core, uint64_t until, const avr_stops *stops) {
  core->until = until;
  return stops || core->written || core->covered ? run_looking(core, stops) : run_plain(core);
}

/* ---- looked at before it is executed ---- */

avr_access avr_next_access(const avr_core *core) {
  const avr_instruction i = core->code[core->pc / 2u];
  const uint16_t stack = avr_stack(core), pointer = i.k < AVR_IO_BEGIN ? word_at(core->data, i.k) : 0;
  /* clang-format off */
  switch (i.kind) {
    case LDD: case STD: return (avr_access){displaced(core->data, i), 1, i.kind == STD};
    case LD_UP: case ST_UP: return (avr_access){pointer, 1, i.kind == ST_UP};
    case LD_DOWN: case ST_DOWN: return (avr_access){(uint16_t)(pointer - 1u), 1, i.kind == ST_DOWN};
    case LDS: case LDS_RAM: case IN: case IN_SREG: case SBIC: case SBIS: return (avr_access){i.k, 1, false};
    case STS: case STS_RAM: case OUT: case OUT_SREG: case OUT_SPL: case SBI: case CBI: return (avr_access){i.k, 1, true};
    case PUSH: return (avr_access){stack, 1, true};
    case POP: return (avr_access){(uint16_t)(stack + 1u), 1, false};
    case RCALL: case CALL: case ICALL: return (avr_access){(uint16_t)(stack - 1u), 2, true};
    case RET: case RETI: return (avr_access){(uint16_t)(stack + 1u), 2, false};
    default: return (avr_access){0, 0, false};
  }
  /* clang-format on */
}
