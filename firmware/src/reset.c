/* reset.c: see reset.h. */
#include "reset.h"

#include <stdbool.h>
#include <string.h>

#include "generated/values.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
#include "storage.h"
#include "tasks.h"

#define MAGIC 0x626Fu
#define NONCE_MASK 0x1FFFFFul
#define WATCHDOG_MARK 0xB17Eu
#define BOOT_SHIFT 11 /* the counts of two boot counters lie 2048 apart */

/* In memory that a reset leaves alone; RAM holds something else when the power comes, and `check` is then wrong. */
typedef struct {
  uint16_t magic;
  uint16_t mark;  /* WATCHDOG_MARK: the watchdog is about to reset the chip */
  uint32_t count; /* one more for each nonce; begins anywhere */
  uint32_t check;
  uint8_t running; /* 1 + number of the task that runs; 0: none */
} reset_record;

_Static_assert(sizeof(reset_record) <= HAL_NOINIT_SIZE, "the record fits");

static uint8_t cause; /* of a watchdog reset with the task */

static reset_record *record(void) { return (reset_record *)hal_noinit(); }

/* The constant makes a record of zeros a broken one. */
static uint32_t check_of(const reset_record *of) { return of->count ^ ((uint32_t)MAGIC << 16 | MAGIC) ^ 0x5A0FF05Aul; }

static bool is_whole(const reset_record *of) { return of->magic == MAGIC && of->check == check_of(of); }

static void set_count(uint32_t count) {
  record()->count = count;
  record()->check = check_of(record());
}

/* Behind a bootloader that has cleared the chip's own answer. */
static uint8_t cause_by_record(const reset_record *of, bool whole) {
  if (!whole) {
    return RESET_CAUSE_POWER;
  }
  return of->mark == WATCHDOG_MARK ? RESET_CAUSE_WATCHDOG : RESET_CAUSE_EXTERNAL;
}

void reset_start(void) {
  reset_record *own = record();
  const bool whole = is_whole(own);
  cause = hal_reset_cause();
  if (cause == RESET_CAUSE_UNKNOWN) {
    cause = cause_by_record(own, whole);
  }
  if (cause == RESET_CAUSE_WATCHDOG && whole && own->running <= TASK_COUNT) {
    cause = (uint8_t)(RESET_CAUSE_WATCHDOG + own->running);
  }
  own->running = 0;
  own->magic = MAGIC;
  own->mark = 0;
  set_count(whole ? own->count : hal_memory_noise());
}

void reset_on_watchdog(void) {
  record()->mark = WATCHDOG_MARK;
  hal_watchdog_reset();
}

uint8_t reset_cause(void) { return cause; }

_Static_assert(RESET_CAUSE_WATCHDOG_IN_WHISKER == RESET_CAUSE_WATCHDOG + 1u + TASK_whisker, "as in tasks.def");

void reset_note_running(uint8_t task) { record()->running = task; }

/* A permutation of the numbers of 21 bits that leaves 0 where it is: an odd factor and a shifted exclusive-or can both be
 * undone: the factor is odd, and otherwise any. Close numbers come out far apart. */
static uint32_t mixed(uint32_t x) {
  for (uint8_t round = 0; round < 3u; round++) {
    x = x * 0x0B352Dul & NONCE_MASK;
    x ^= x >> 11;
  }
  return x;
}

uint32_t reset_nonce(void) {
  set_count(record()->count + 1u);
  uint32_t count = (record()->count + (storage_boot_counter() << BOOT_SHIFT)) & NONCE_MASK;
  if (count == 0) {
    count = NONCE_MASK / 2u; /* far from the counts of the starts before and after */
  }
  return mixed(count);
}
