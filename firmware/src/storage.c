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

enum { IDLE, TO_VOID, REST, TO_VALID };

typedef struct {
  uint16_t record_address;
  uint8_t record_size;
  uint8_t step;
  bool is_save;                   /* or a boot counter's */
  uint8_t step_first, step_count; /* bytes of the record that the step has written or not read back */

  /* Of the interrupt: the next byte, how many are left, CRC of those written. */
  volatile uint8_t write_next, write_left;
  uint16_t write_crc;

  bool save_wanted;
  uint8_t save_result;
  bool loaded;
  uint8_t copy_in_force; /* COPIES: none */
  uint8_t generation;    /* of the newest copy */

  uint32_t boots;      /* before this start */
  uint8_t boot_newest; /* entry of the ring that says so */
  uint8_t boot_next;   /* entry to write */
  uint16_t run_ticks;  /* of this start, at most RUN_TICKS */
  bool counted;        /* this start is in the ring, or no entry takes it */

  /* The record at hand, with which that is done. */
  union {
    copy_record copy;
    boot_record boot;
    uint8_t bytes[sizeof(copy_record)];
  } record;
} storage_state;

static storage_state own;

/* ---- records ---- */

/* One byte more of a CRC-16/CCITT: polynomial 0x1021, reflected, from CRC_START. */
#define CRC_START 0xFFFFu
static uint16_t crc16(uint16_t crc, uint8_t byte) {
  uint8_t x = (uint8_t)(crc ^ byte);
  x = (uint8_t)(x ^ (uint8_t)(x << 4));
  return (uint16_t)((uint16_t)((uint16_t)x << 8 | crc >> 8) ^ (uint8_t)(x >> 4) ^ (uint16_t)((uint16_t)x << 3));
}

/* Reads a record; whether it is whole. */
static bool read_record(storage_state *self, uint16_t address, uint8_t size) {
  hal_eeprom_wait(); /* for a write from before the reset */
  uint16_t expected = CRC_START;
  BOUNDED(sizeof self->record.bytes, for (uint8_t i = 0; i < size; i++)) {
    self->record.bytes[i] = hal_eeprom_read((uint16_t)(address + i));
    if (i > 0 && i < size - 2u) {
      expected = crc16(expected, self->record.bytes[i]);
    }
  }
  uint16_t crc = 0;
  memcpy(&crc, &self->record.bytes[size - 2u], sizeof crc);
  return self->record.bytes[0] == MARK_VALID && crc == expected;
}

/* Writes `count` bytes of the record from `first` on. */
OUTLINE void begin_step(storage_state *self, uint8_t next_step, uint8_t first, uint8_t count) {
  self->step = next_step;
  self->step_first = first;
  self->step_count = count;
  self->write_next = first;
  self->write_left = count;
  self->write_crc = CRC_START;
  hal_eeprom_interrupt(true);
}

/* With the EEPROM ready: the next byte. At the end of the rest comes its CRC, which is known by then. */
HAL_INTERRUPT_EEPROM {
  storage_state *const self = HAL_NEAR(&own);
  const uint8_t i = self->write_next;
  if (i == (uint8_t)(self->record_size - 2u)) {
    memcpy(&self->record.bytes[i], &self->write_crc, sizeof self->write_crc);
  }
  self->write_crc = crc16(self->write_crc, self->record.bytes[i]);
  hal_eeprom_write_start((uint16_t)(self->record_address + i), self->record.bytes[i]);
  self->write_next = (uint8_t)(i + 1u);
  self->write_left--;
  hal_eeprom_interrupt(self->write_left != 0);
}

static bool is_written(storage_state *self) { return self->write_left == 0 && !hal_eeprom_busy(); }

/* Reads a few of the step's bytes back and takes them off `step_count`; false if one is not as it should be. */
static bool reads_back(storage_state *self) {
  BOUNDED(READ_BACK, for (uint8_t n = 0; n < READ_BACK && self->step_count > 0; n++)) {
    if (hal_eeprom_read((uint16_t)(self->record_address + self->step_first)) != self->record.bytes[self->step_first]) {
      return false;
    }
    self->step_first++;
    self->step_count--;
  }
  return true;
}

/* Begins to write the record at hand. */
OUTLINE void begin_record(storage_state *self, uint16_t address, uint8_t size) {
  self->record_address = address;
  self->record_size = size;
  self->record.bytes[0] = MARK_VOID;
  begin_step(self, TO_VOID, 0, 1);
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

OUTLINE bool read_copy(storage_state *self, uint8_t copy) {
  return read_record(self, copy_address(copy), sizeof(copy_record)) && self->record.copy.table == table_hash();
}

void storage_load_parameters(void) {
  storage_state *const self = HAL_NEAR(&own);
  bool whole[COPIES];
  uint8_t generations[COPIES];
  BOUNDED(COPIES, for (uint8_t copy = 0; copy < COPIES; copy++)) {
    whole[copy] = read_copy(self, copy);
    generations[copy] = self->record.copy.generation;
  }
  const uint8_t newer = whole[1] && (!whole[0] || (int8_t)(uint8_t)(generations[1] - generations[0]) > 0);
  self->generation = whole[newer] ? generations[newer] : 0u;
  self->loaded = true;
  BOUNDED(COPIES, for (uint8_t i = 0; i < COPIES; i++)) {
    self->copy_in_force = newer ^ i;
    if (whole[self->copy_in_force] && read_copy(self, self->copy_in_force) &&
        parameters_restore(self->record.copy.values)) {
      return;
    }
  }
  self->copy_in_force = COPIES;
  self->loaded = false;
}

bool storage_parameters_loaded(void) { return own.loaded; }

uint8_t storage_save(void) {
  if (supply_low()) {
    return ANSWER_STATUS_SUPPLY_LOW;
  }
  own.save_wanted = true;
  return ANSWER_STATUS_OK;
}

bool storage_busy(void) { return own.save_wanted || (own.step != IDLE && own.is_save); }

uint8_t storage_result(void) { return own.save_result; }

static uint8_t other_copy(storage_state *self) { return self->copy_in_force == 0 ? 1u : 0u; }

static void begin_save(storage_state *self) {
  self->save_wanted = false;
  self->is_save = true;
  self->record.copy.generation = (uint8_t)(self->generation + 1u);
  self->record.copy.table = table_hash();
  memcpy(self->record.copy.values, parameters_values(), sizeof self->record.copy.values);
  begin_record(self, copy_address(other_copy(self)), sizeof(copy_record));
}

static void end_save(storage_state *self, uint8_t result) {
  self->save_result = result;
  if (result == ANSWER_STATUS_OK) {
    self->copy_in_force = other_copy(self);
    self->generation++;
  }
}

/* ---- boot counter ---- */

static uint16_t boot_address(uint8_t entry) { return (uint16_t)(BOOT_ADDRESS + entry * sizeof(boot_record)); }

static void find_boots(storage_state *self) {
  self->boots = 0;
  self->boot_newest = BOOT_RECORDS - 1u;
  BOUNDED(BOOT_RECORDS, for (uint8_t entry = 0; entry < BOOT_RECORDS; entry++)) {
    if (read_record(self, boot_address(entry), sizeof(boot_record))) {
      const uint32_t count = (uint32_t)self->record.boot.count[1] << 16 | self->record.boot.count[0];
      if (count > self->boots) {
        self->boots = count;
        self->boot_newest = entry;
      }
    }
  }
  self->boot_next = (self->boot_newest + 1u) % BOOT_RECORDS;
}

uint32_t storage_boot_counter(void) { return own.boots + 1u; }

static void begin_count(storage_state *self) {
  self->is_save = false;
  self->record.boot.spare = 0;
  self->record.boot.count[0] = (uint16_t)storage_boot_counter();
  self->record.boot.count[1] = (uint16_t)(storage_boot_counter() >> 16);
  begin_record(self, boot_address(self->boot_next), sizeof(boot_record));
}

/* A cell that does not take it is passed over; the newest entry is never touched. */
static void end_count(storage_state *self, uint8_t result) {
  if (result == ANSWER_STATUS_OK) {
    self->counted = true;
  } else if (result == ANSWER_STATUS_STORAGE_FAILED) {
    self->boot_next = (self->boot_next + 1u) % BOOT_RECORDS;
    self->counted = self->boot_next == self->boot_newest;
  }
}

/* ---- the task ---- */

void storage_start(void) {
  storage_state *const self = HAL_NEAR(&own);
  hal_eeprom_interrupt(false);
  HAL_ZERO(self->step);
  HAL_ZERO(self->write_left);
  HAL_ZERO(self->save_wanted);
  self->save_result = ANSWER_STATUS_OK;
  HAL_ZERO(self->run_ticks);
  HAL_ZERO(self->counted);
  find_boots(self);
}

OUTLINE void end_record(storage_state *self, uint8_t result) {
  self->step = IDLE;
  if (self->is_save) {
    end_save(self, result);
  } else {
    end_count(self, result);
  }
}

static void go_on(storage_state *self) {
  if (!reads_back(self)) {
    end_record(self, ANSWER_STATUS_STORAGE_FAILED);
  } else if (self->step_count > 0) {
    return; /* the others in the next tick */
  } else if (self->step == TO_VOID) {
    begin_step(self, REST, 1, (uint8_t)(self->record_size - 1u));
  } else if (self->step == REST) {
    self->record.bytes[0] = MARK_VALID;
    begin_step(self, TO_VALID, 0, 1);
  } else {
    end_record(self, ANSWER_STATUS_OK);
  }
}

/* The supply fails: the cell under way ends by itself, no other begins. */
static void give_up(storage_state *self) {
  hal_eeprom_interrupt(false);
  self->write_left = 0;
  if (self->save_wanted) {
    self->save_wanted = false;
    self->save_result = ANSWER_STATUS_SUPPLY_LOW;
  }
  if (self->step != IDLE) {
    end_record(self, ANSWER_STATUS_SUPPLY_LOW);
  }
}

void storage_task(void) {
  storage_state *const self = HAL_NEAR(&own);
  if (self->run_ticks < RUN_TICKS) {
    self->run_ticks++;
  }
  if (supply_low()) {
    give_up(self);
  } else if (self->step != IDLE) {
    if (is_written(self)) {
      go_on(self);
    }
  } else if (hal_eeprom_busy()) {
    return; /* a write from before the reset, or one that was given up */
  } else if (self->save_wanted) {
    begin_save(self);
  } else if (self->run_ticks == RUN_TICKS && !self->counted) {
    begin_count(self);
  }
}
