/* storage.c: see storage.h. A record begins with a mark and ends with a CRC-16 of what lies between. It is written in
 * three steps: the mark to void, the rest, the mark to valid; each is read back before the next. So a record is void
 * while its rest is written, whatever the CRC would say, and its rest is whole while its mark is written. */
#include "storage.h"

#include <string.h>

#include "clock.h"
#include "generated/values.h"
#include "hal/hal.h"
#include "parameters.h"
#include "supply.h"
#include "tasks.h"

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
#define COPY_ADDRESS 0x080u
#define BOOT_ADDRESS 0x100u
#define COPY_DISTANCE 0x100u /* the boot counter's ring lies between them */
#define BOOT_RECORDS 16u
#define RUN_SLOTS (10u * CLOCK_TICK_RATE * CLOCK_SLOTS_PER_TICK) /* of a start that counts */
#define SLOTS_PER_CALL 2u

_Static_assert(sizeof(copy_record) <= COPY_ROOM && sizeof(copy_record) == 6u + 2u * PARAMETER_COUNT, "a copy has room");
_Static_assert(sizeof(boot_record) == 8u, "no gaps");
_Static_assert(COPY_ADDRESS + COPY_ROOM <= BOOT_ADDRESS &&
                   BOOT_ADDRESS + BOOT_RECORDS * sizeof(boot_record) <= COPY_ADDRESS + COPY_DISTANCE,
               "the ring lies between the copies");
_Static_assert(COPY_ADDRESS + COPY_DISTANCE + COPY_ROOM <= HAL_EEPROM_SIZE, "the EEPROM has room");

enum { IDLE, TO_VOID, REST, TO_VALID };

typedef struct {
  uint16_t record_address;
  uint8_t record_size;
  uint8_t step;
  bool is_save;       /* or a boot counter's */
  uint8_t next, left; /* the step's next byte to write, and how many there are with it */
  bool is_writing;    /* the byte before it: it is read back when its cell is done */
  uint16_t crc;       /* of the bytes that the step has written */

  bool save_wanted;
  uint8_t save_result;
  bool loaded;
  uint8_t copy_in_force; /* COPIES: none */
  uint8_t generation;    /* of the newest copy */

  uint32_t boots;      /* before this start */
  uint8_t boot_newest; /* entry of the ring that says so */
  uint8_t boot_next;   /* entry to write */
  uint16_t run_slots;  /* of this start, at most RUN_SLOTS */
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
static bool read_record(uint16_t address, uint8_t size) {
  hal_eeprom_wait(); /* for a write from before the reset */
  uint16_t expected = CRC_START;
  for (uint8_t i = 0; i < size; i++) {
    own.record.bytes[i] = hal_eeprom_read((uint16_t)(address + i));
    if (i > 0 && i < size - 2u) {
      expected = crc16(expected, own.record.bytes[i]);
    }
  }
  uint16_t crc = 0;
  memcpy(&crc, &own.record.bytes[size - 2u], sizeof crc);
  return own.record.bytes[0] == MARK_VALID && crc == expected;
}

/* Writes `count` bytes of the record from `first` on. */
static void begin_step(uint8_t step, uint8_t first, uint8_t count) {
  own.step = step;
  own.next = first;
  own.left = count;
  own.is_writing = false;
  own.crc = CRC_START;
}

static uint16_t cell(uint8_t i) { return (uint16_t)(own.record_address + i); }

/* At the end of the rest comes its CRC, which is known by then. */
static void write_next(void) {
  const uint8_t i = own.next;
  if (i == (uint8_t)(own.record_size - 2u)) {
    memcpy(&own.record.bytes[i], &own.crc, sizeof own.crc);
  }
  own.crc = crc16(own.crc, own.record.bytes[i]);
  hal_eeprom_write_start(cell(i), own.record.bytes[i]);
  own.next++;
  own.left--;
  own.is_writing = true;
}

/* Whether the byte just written is in its cell. */
static bool reads_back(void) {
  const uint8_t i = (uint8_t)(own.next - 1u);
  return hal_eeprom_read(cell(i)) == own.record.bytes[i];
}

/* Begins to write the record at hand. */
static void begin_record(uint16_t address, uint8_t size) {
  own.record_address = address;
  own.record_size = size;
  own.record.bytes[0] = MARK_VOID;
  begin_step(TO_VOID, 0, 1);
}

/* ---- parameters ---- */

static uint16_t copy_address(uint8_t copy) { return (uint16_t)(COPY_ADDRESS + copy * COPY_DISTANCE); }

static bool read_copy(uint8_t copy) {
  return read_record(copy_address(copy), sizeof(copy_record)) && own.record.copy.table == PARAMETER_TABLE;
}

void storage_load_parameters(void) {
  bool whole[COPIES];
  uint8_t generations[COPIES];
  for (uint8_t copy = 0; copy < COPIES; copy++) {
    whole[copy] = read_copy(copy);
    generations[copy] = own.record.copy.generation;
  }
  const uint8_t newer = whole[1] && (!whole[0] || (int8_t)(uint8_t)(generations[1] - generations[0]) > 0);
  own.generation = whole[newer] ? generations[newer] : 0u;
  own.loaded = true;
  for (uint8_t i = 0; i < COPIES; i++) {
    own.copy_in_force = newer ^ i;
    if (whole[own.copy_in_force] && read_copy(own.copy_in_force) && parameters_restore(own.record.copy.values)) {
      return;
    }
  }
  own.copy_in_force = COPIES;
  own.loaded = false;
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

static uint8_t other_copy(void) { return own.copy_in_force == 0 ? 1u : 0u; }

static void begin_save(void) {
  own.save_wanted = false;
  own.is_save = true;
  own.record.copy.generation = (uint8_t)(own.generation + 1u);
  own.record.copy.table = PARAMETER_TABLE;
  memcpy(own.record.copy.values, parameters_values(), sizeof own.record.copy.values);
  begin_record(copy_address(other_copy()), sizeof(copy_record));
}

static void end_save(uint8_t result) {
  own.save_result = result;
  if (result == ANSWER_STATUS_OK) {
    own.copy_in_force = other_copy();
    own.generation++;
  }
}

/* ---- boot counter ---- */

static uint16_t boot_address(uint8_t entry) { return (uint16_t)(BOOT_ADDRESS + entry * sizeof(boot_record)); }

static void find_boots(void) {
  own.boots = 0;
  own.boot_newest = BOOT_RECORDS - 1u;
  for (uint8_t entry = 0; entry < BOOT_RECORDS; entry++) {
    if (read_record(boot_address(entry), sizeof(boot_record))) {
      const uint32_t count = (uint32_t)own.record.boot.count[1] << 16 | own.record.boot.count[0];
      if (count > own.boots) {
        own.boots = count;
        own.boot_newest = entry;
      }
    }
  }
  own.boot_next = (own.boot_newest + 1u) % BOOT_RECORDS;
}

uint32_t storage_boot_counter(void) { return own.boots + 1u; }

static void begin_count(void) {
  own.is_save = false;
  own.record.boot.spare = 0;
  own.record.boot.count[0] = (uint16_t)storage_boot_counter();
  own.record.boot.count[1] = (uint16_t)(storage_boot_counter() >> 16);
  begin_record(boot_address(own.boot_next), sizeof(boot_record));
}

/* A cell that does not take it is passed over; the newest entry is never touched. */
static void end_count(uint8_t result) {
  if (result == ANSWER_STATUS_OK) {
    own.counted = true;
  } else if (result == ANSWER_STATUS_STORAGE_FAILED) {
    own.boot_next = (own.boot_next + 1u) % BOOT_RECORDS;
    own.counted = own.boot_next == own.boot_newest;
  }
}

/* ---- the task ---- */

void storage_start(void) {
  own.step = IDLE;
  own.save_wanted = false;
  own.save_result = ANSWER_STATUS_OK;
  own.run_slots = 0;
  own.counted = false;
  find_boots();
}

static void end_record(uint8_t result) {
  own.step = IDLE;
  if (own.is_save) {
    end_save(result);
  } else {
    end_count(result);
  }
}

/* With the EEPROM ready: the next byte of a step, or the next step. */
static void go_on(void) {
  if (own.is_writing && !reads_back()) {
    end_record(ANSWER_STATUS_STORAGE_FAILED);
  } else if (own.left > 0) {
    write_next();
  } else if (own.step == TO_VOID) {
    begin_step(REST, 1, (uint8_t)(own.record_size - 1u));
  } else if (own.step == REST) {
    own.record.bytes[0] = MARK_VALID;
    begin_step(TO_VALID, 0, 1);
  } else {
    end_record(ANSWER_STATUS_OK);
  }
}

/* The supply fails: the cell under way ends by itself, no other begins. */
static void give_up(void) {
  if (own.save_wanted) {
    own.save_wanted = false;
    own.save_result = ANSWER_STATUS_SUPPLY_LOW;
  }
  if (own.step != IDLE) {
    end_record(ANSWER_STATUS_SUPPLY_LOW);
  }
}

/* Every other slot: goes on with the record under way; writes the boot counter when this start has run for 10 s. */
void storage_task(void) {
  if (own.run_slots < RUN_SLOTS) {
    own.run_slots = (uint16_t)(own.run_slots + SLOTS_PER_CALL);
  }
  if (supply_low()) {
    give_up();
  } else if (hal_eeprom_busy()) {
    return; /* a byte of ours, or a write from before the reset */
  } else if (own.step != IDLE) {
    go_on();
  } else if (own.save_wanted) {
    begin_save();
  } else if (own.run_slots == RUN_SLOTS && !own.counted) {
    begin_count();
  }
}
