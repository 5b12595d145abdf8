/* memory_native.c: the EEPROM, whose writes go on through a reset, and memory that a reset leaves alone. */
#include "hal/hal.h"
#include "hal/native/events.h"

static bool eeprom_interrupt;

/* Entry, a handler of a few instructions, return, and the one instruction of the main loop in between. */
#define READY_AGAIN_CYCLES 32u

/* For programs that do not write. */
__attribute__((weak)) HAL_INTERRUPT_EEPROM {}

static void plan_eeprom(uint64_t ready) {
  native_next[EVENT_EEPROM] = native->eeprom_writing ? native->eeprom_done : eeprom_interrupt ? ready : NATIVE_NEVER;
}

void native_memory_reset(void) {
  eeprom_interrupt = false;
  plan_eeprom(native->now); /* a write goes on */
}

bool hal_eeprom_busy(void) { return native->eeprom_writing != 0; }

static void end_eeprom_write(void) {
  native->eeprom[native->eeprom_address] = native->eeprom_value;
  native->eeprom_writing = 0;
}

void hal_eeprom_wait(void) {
  if (hal_eeprom_busy()) {
    native->now = native->now > native->eeprom_done ? native->now : native->eeprom_done;
    end_eeprom_write();
    plan_eeprom(native->now);
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
  plan_eeprom(native->now);
}

void hal_eeprom_interrupt(bool on) {
  eeprom_interrupt = on;
  plan_eeprom(native->now);
}

/* The end of a write, at which the interrupt is due too, or the interrupt. */
void native_eeprom_event(void) {
  if (native->eeprom_writing) {
    end_eeprom_write();
    plan_eeprom(native->now);
    return;
  }
  native->interrupts++;
  hal_native_eeprom();
  plan_eeprom(native->now + READY_AGAIN_CYCLES);
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
