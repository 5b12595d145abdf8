/* memory_native.c: the EEPROM, whose writes go on through a reset, and memory that a reset leaves alone. */
#include "hal/hal.h"
#include "hal/native/events.h"

static void plan_eeprom(void) {
  native_next[EVENT_EEPROM] = native->eeprom_writing ? native->eeprom_done : NATIVE_NEVER;
}

void native_memory_reset(void) { plan_eeprom(); /* a write goes on */ }

bool hal_eeprom_busy(void) { return native->eeprom_writing != 0; }

static void end_eeprom_write(void) {
  native->eeprom[native->eeprom_address] = native->eeprom_value;
  native->eeprom_writing = 0;
}

void hal_eeprom_wait(void) {
  if (hal_eeprom_busy()) {
    native->now = native->now > native->eeprom_done ? native->now : native->eeprom_done;
    end_eeprom_write();
    plan_eeprom();
  }
}

uint8_t hal_eeprom_read(uint16_t address) {
  if (hal_eeprom_busy()) {
    return native->eeprom_value; /* as on the chip: nothing is read, the data register stays */
  }
  return native->eeprom[address % NATIVE_EEPROM_SIZE];
}

void hal_eeprom_write_start(uint16_t address, uint8_t value) {
  if (hal_eeprom_busy()) {
    return;
  }
  native->eeprom_writing = 1;
  native->eeprom_address = address % NATIVE_EEPROM_SIZE;
  native->eeprom_value = value;
  native->eeprom_done = native->now + NATIVE_EEPROM_CYCLES;
  plan_eeprom();
}

void native_eeprom_event(void) {
  end_eeprom_write();
  plan_eeprom();
}

void *hal_noinit(void) { return native->noinit; }

/* FNV-1a of it: the rest of the memory is this process's. */
uint32_t hal_memory_noise(void) {
  uint32_t hash = 0x811C9DC5u;
  for (size_t i = 0; i < sizeof native->noinit; i++) {
    hash = (hash ^ native->noinit[i]) * 0x01000193u;
  }
  return hash;
}
