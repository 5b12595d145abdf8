/* storage.c: see storage.h. A record begins with a mark and ends with a CRC-16 of what lies between. It is written in
 * three steps: the mark to void, the rest, the mark to valid; each is read back before the next. So a record is void
 * while its rest is written, whatever the CRC would say, and its rest is whole while its mark is written. */
#include "storage.h"

#include <string.h>

#include "bounds.h"
#include "generated/messages.h"
#include "hal/hal.h"
#include "link/parameters.h"
#include "pins.h"
#include "schedule.h"
#include "supply.h"

#define INLINE static inline __attribute__((always_inline))
#define OUTLINE static __attribute__((noinline)) /* several times in line it would be much flash */

enum { MARK_VALID = 0xA5, MARK_VOID = 0x5A };

/* One of the two copies of all parameters. */
typedef struct {
  uint8_t mark;
  uint8_t generation; /* one more than that of the copy before it, modulo 256 */
  uint16_t table;     /* which parameters these are */
  uint16_t values[PARAMETER_COUNT];
  uint16_t crc;
} copy_record;

/* One entry of the ring of boot counters. */
typedef struct {
  uint8_t mark;
  uint8_t spare;
  uint16_t count[2]; /* low half first */
  uint16_t crc;
} boot_record;

#define COPIES 2u
#define COPY_ROOM 128u
#define BOOT_ADDRESS (COPIES * COPY_ROOM)
#define BOOT_RECORDS 16u
#define READ_BACK 10u                        /* cells in a tick */
#define RUN_TICKS (10u * SCHEDULE_TICK_RATE) /* of a start that counts */

_Static_assert(sizeof(copy_record) <= COPY_ROOM && sizeof(copy_record) == 6u + 2u * PARAMETER_COUNT, "a copy has room");
_Static_assert(sizeof(boot_record) == 8u, "no gaps");
_Static_assert(BOOT_ADDRESS + BOOT_RECORDS * sizeof(boot_record) <= HAL_EEPROM_SIZE, "the EEPROM has room");

/* The record at hand, and what is done with it. */
static union {
  copy_record copy;
  boot_record boot;
  uint8_t bytes[sizeof(copy_record)];
} record;
static uint16_t record_address;
static uint8_t record_size;
enum { IDLE, TO_VOID, REST, TO_VALID };
static uint8_t step;
static bool is_save;                   /* or a boot counter's */
static uint8_t step_first, step_count; /* bytes of the record that the step has written or not read back */

/* Of the interrupt: the next byte, how many are left, CRC of those written. */
static volatile uint8_t write_next, write_left;
static uint16_t write_crc;

static bool save_wanted;
static uint8_t save_result;
static bool loaded;
static uint8_t copy_in_force; /* COPIES: none */
static uint8_t generation;    /* of the newest copy */

static uint32_t boots;      /* before this start */
static uint8_t boot_newest; /* entry of the ring that says so */
static uint8_t boot_next;   /* entry to write */
static uint16_t run_ticks;  /* of this start, at most RUN_TICKS */
static bool counted;        /* this start is in the ring, or no entry takes it */

/* ---- records ---- */

/* One byte more of a CRC-16/CCITT: polynomial 0x1021, reflected, from CRC_START. */
#define CRC_START 0xFFFFu
static uint16_t crc16(uint16_t crc, uint8_t byte) {
  uint8_t x = (uint8_t)(crc ^ byte);
  x = (uint8_t)(x ^ (uint8_t)(x << 4));
  return (uint16_t)((uint16_t)((uint16_t)x << 8 | crc >> 8) ^ (uint8_t)(x >> 4) ^ (uint16_t)((uint16_t)x << 3));
}

/* Reads a record; whether it is whole. */
static bool read_record(uint16_t address, uint8_t size) {
  hal_eeprom_wait(); /* for a write from before the reset */
  uint16_t expected = CRC_START;
  BOUNDED(sizeof record.bytes, for (uint8_t i = 0; i < size; i++)) {
    record.bytes[i] = hal_eeprom_read((uint16_t)(address + i));
    if (i > 0 && i < size - 2u) {
      expected = crc16(expected, record.bytes[i]);
    }
  }
  uint16_t crc = 0;
  memcpy(&crc, &record.bytes[size - 2u], sizeof crc);
  return record.bytes[0] == MARK_VALID && crc == expected;
}

/* Writes `count` bytes of the record from `first` on. */
OUTLINE void begin_step(uint8_t next_step, uint8_t first, uint8_t count) {
  step = next_step;
  step_first = first;
  step_count = count;
  write_next = first;
  write_left = count;
  write_crc = CRC_START;
  hal_eeprom_interrupt(true);
}

/* With the EEPROM ready: the next byte. At the end of the rest comes its CRC, which is known by then. */
HAL_INTERRUPT_EEPROM {
  const uint8_t i = write_next;
  if (i == record_size - 2u) {
    memcpy(&record.bytes[i], &write_crc, sizeof write_crc);
  }
  write_crc = crc16(write_crc, record.bytes[i]);
  hal_eeprom_write_start((uint16_t)(record_address + i), record.bytes[i]);
  write_next = (uint8_t)(i + 1u);
  write_left--;
  hal_eeprom_interrupt(write_left != 0);
}

static bool is_written(void) { return write_left == 0 && !hal_eeprom_busy(); }

/* Reads a few of the step's bytes back and takes them off `step_count`; false if one is not as it should be. */
static bool reads_back(void) {
  BOUNDED(READ_BACK, for (uint8_t n = 0; n < READ_BACK && step_count > 0; n++)) {
    if (hal_eeprom_read((uint16_t)(record_address + step_first)) != record.bytes[step_first]) {
      return false;
    }
    step_first++;
    step_count--;
  }
  return true;
}

/* Begins to write the record at hand. */
OUTLINE void begin_record(uint16_t address, uint8_t size) {
  record_address = address;
  record_size = size;
  record.bytes[0] = MARK_VOID;
  begin_step(TO_VOID, 0, 1);
}

/* ---- parameters ---- */

static uint16_t copy_address(uint8_t copy) { return (uint16_t)(copy * COPY_ROOM); }

INLINE uint32_t mixed(uint32_t hash, uint32_t x) { return (hash ^ x) * 0x01000193ul; }
INLINE uint32_t entry_hash(uint8_t number, int32_t minimum, int32_t maximum, const char *name, uint8_t length) {
  const uint32_t letters =
      (uint8_t)name[0] | (uint32_t)(uint8_t)name[length / 2u] << 8 | (uint32_t)(uint8_t)name[length - 1u] << 16;
  return mixed(mixed(mixed(mixed(0x811C9DC5ul + number, (uint32_t)minimum), (uint32_t)maximum), length), letters);
}

/* Tells tables of parameters apart: by numbers and ranges, of the names by the length and three letters. A constant. */
INLINE uint16_t table_hash(void) {
#define ENTRY(name, type, minimum, maximum, initial) \
  ^entry_hash(PARAMETER_##name, (minimum), (maximum), #name, sizeof #name - 1u)
  const uint32_t hash = PARAMETER_COUNT PARAMETER_LIST(ENTRY);
#undef ENTRY
  return (uint16_t)(hash >> 16 ^ hash);
}

OUTLINE bool read_copy(uint8_t copy) {
  return read_record(copy_address(copy), sizeof(copy_record)) && record.copy.table == table_hash();
}

void storage_load_parameters(void) {
  bool whole[COPIES];
  uint8_t generations[COPIES];
  BOUNDED(COPIES, for (uint8_t copy = 0; copy < COPIES; copy++)) {
    whole[copy] = read_copy(copy);
    generations[copy] = record.copy.generation;
  }
  const uint8_t newer = whole[1] && (!whole[0] || (int8_t)(uint8_t)(generations[1] - generations[0]) > 0);
  generation = whole[newer] ? generations[newer] : 0u;
  loaded = true;
  BOUNDED(COPIES, for (uint8_t i = 0; i < COPIES; i++)) {
    copy_in_force = newer ^ i;
    if (whole[copy_in_force] && read_copy(copy_in_force) && parameters_restore(record.copy.values)) {
      return;
    }
  }
  copy_in_force = COPIES;
  loaded = false;
}

bool storage_parameters_loaded(void) { return loaded; }

uint8_t storage_save(void) {
  if (supply_low()) {
    return ANSWER_STATUS_SUPPLY_LOW;
  }
  save_wanted = true;
  return ANSWER_STATUS_OK;
}

bool storage_busy(void) { return save_wanted || (step != IDLE && is_save); }

uint8_t storage_result(void) { return save_result; }

static uint8_t other_copy(void) { return copy_in_force == 0 ? 1u : 0u; }

static void begin_save(void) {
  save_wanted = false;
  is_save = true;
  record.copy.generation = (uint8_t)(generation + 1u);
  record.copy.table = table_hash();
  memcpy(record.copy.values, parameters_values(), sizeof record.copy.values);
  begin_record(copy_address(other_copy()), sizeof(copy_record));
}

static void end_save(uint8_t result) {
  save_result = result;
  if (result == ANSWER_STATUS_OK) {
    copy_in_force = other_copy();
    generation++;
  }
}

/* ---- boot counter ---- */

static uint16_t boot_address(uint8_t entry) { return (uint16_t)(BOOT_ADDRESS + entry * sizeof(boot_record)); }

static void find_boots(void) {
  boots = 0;
  boot_newest = BOOT_RECORDS - 1u;
  BOUNDED(BOOT_RECORDS, for (uint8_t entry = 0; entry < BOOT_RECORDS; entry++)) {
    if (read_record(boot_address(entry), sizeof(boot_record))) {
      const uint32_t count = (uint32_t)record.boot.count[1] << 16 | record.boot.count[0];
      if (count > boots) {
        boots = count;
        boot_newest = entry;
      }
    }
  }
  boot_next = (boot_newest + 1u) % BOOT_RECORDS;
}

uint32_t storage_boot_counter(void) { return boots + 1u; }

static void begin_count(void) {
  is_save = false;
  record.boot.spare = 0;
  record.boot.count[0] = (uint16_t)storage_boot_counter();
  record.boot.count[1] = (uint16_t)(storage_boot_counter() >> 16);
  begin_record(boot_address(boot_next), sizeof(boot_record));
}

/* A cell that does not take it is passed over; the newest entry is never touched. */
static void end_count(uint8_t result) {
  if (result == ANSWER_STATUS_OK) {
    counted = true;
  } else if (result == ANSWER_STATUS_STORAGE_FAILED) {
    boot_next = (boot_next + 1u) % BOOT_RECORDS;
    counted = boot_next == boot_newest;
  }
}

/* ---- the task ---- */

void storage_start(void) {
  hal_eeprom_interrupt(false);
  HAL_ZERO(step);
  HAL_ZERO(write_left);
  HAL_ZERO(save_wanted);
  save_result = ANSWER_STATUS_OK;
  HAL_ZERO(run_ticks);
  HAL_ZERO(counted);
  find_boots();
}

OUTLINE void end_record(uint8_t result) {
  step = IDLE;
  if (is_save) {
    end_save(result);
  } else {
    end_count(result);
  }
}

static void go_on(void) {
  if (!reads_back()) {
    end_record(ANSWER_STATUS_STORAGE_FAILED);
  } else if (step_count > 0) {
    return; /* the others in the next tick */
  } else if (step == TO_VOID) {
    begin_step(REST, 1, (uint8_t)(record_size - 1u));
  } else if (step == REST) {
    record.bytes[0] = MARK_VALID;
    begin_step(TO_VALID, 0, 1);
  } else {
    end_record(ANSWER_STATUS_OK);
  }
}

/* The supply fails: the cell under way ends by itself, no other begins. */
static void give_up(void) {
  hal_eeprom_interrupt(false);
  write_left = 0;
  if (save_wanted) {
    save_wanted = false;
    save_result = ANSWER_STATUS_SUPPLY_LOW;
  }
  if (step != IDLE) {
    end_record(ANSWER_STATUS_SUPPLY_LOW);
  }
}

void storage_task(void) {
  if (run_ticks < RUN_TICKS) {
    run_ticks++;
  }
  if (supply_low()) {
    give_up();
  } else if (step != IDLE) {
    if (is_written()) {
      go_on();
    }
  } else if (hal_eeprom_busy()) {
    return; /* a write from before the reset, or one that was given up */
  } else if (save_wanted) {
    begin_save();
  } else if (run_ticks == RUN_TICKS && !counted) {
    begin_count();
  }
}
