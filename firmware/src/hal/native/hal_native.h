/* hal_native.h: the board in a PC process; see hal/hal.h for what each of these means. */
#ifndef HAL_NATIVE_H
#define HAL_NATIVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "bounds.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_INTERRUPT_SLOT void hal_native_slot(void)
#define HAL_INTERRUPT_EDGE void hal_native_edge(void)
#define HAL_INTERRUPT_CAPTURE void hal_native_capture(void)
HAL_INTERRUPT_SLOT;
HAL_INTERRUPT_EDGE;
HAL_INTERRUPT_CAPTURE;

/* There is no watchdog here; a test may run its interrupt. */
#define HAL_INTERRUPT_WATCHDOG void hal_native_watchdog(void)
HAL_INTERRUPT_WATCHDOG;

/* Runs again and again while the EEPROM is ready and its interrupt is on, as on the chip. */
#define HAL_INTERRUPT_EEPROM void hal_native_eeprom(void)
HAL_INTERRUPT_EEPROM;

#define HAL_INTERRUPT_TWO_WIRE void hal_native_two_wire(void)
HAL_INTERRUPT_TWO_WIRE;

/* Interrupts come between calls, never inside one. */
#define HAL_ATOMIC

#define HAL_EDGE_LEAD 0u

/* Levels on the pins, as in the PIN registers. */
extern uint8_t hal_native_port_b, hal_native_port_c, hal_native_port_d;
#define PINB hal_native_port_b
#define PINC hal_native_port_c
#define PIND hal_native_port_d

void hal_native_direction(uint8_t pin, bool output);
void hal_native_write(uint8_t pin, bool high);
void hal_native_toggle(uint8_t pin);

#define HAL_PIN_OUTPUT(name) hal_native_direction(PIN_##name, true)
#define HAL_PIN_INPUT(name) (hal_native_direction(PIN_##name, false), hal_native_write(PIN_##name, false))
#define HAL_PIN_PULL_UP(name) (hal_native_direction(PIN_##name, false), hal_native_write(PIN_##name, true))
#define HAL_PIN_HIGH(name) hal_native_write(PIN_##name, true)
#define HAL_PIN_LOW(name) hal_native_write(PIN_##name, false)
#define HAL_PIN_TOGGLE(name) hal_native_toggle(PIN_##name)
#define HAL_PORT_READ(name) (name##_PINR)
#define HAL_PORT_C() (PINC)
#define HAL_PIN_BIT(name) ((uint8_t)(1u << name##_BIT))
#define HAL_PIN_READ(name) ((uint8_t)((name##_PINR >> name##_BIT) & 1u))

uint16_t hal_time(void);
void hal_slot_arm(uint16_t time);
void hal_edge_arm(uint16_t time);
#define hal_edge_arm_plain hal_edge_arm
void hal_edge_disarm(void);
static inline void hal_edge_wait(uint16_t time) { (void)time; /* the event comes at its very cycle */ }
static inline uint16_t hal_edge_delay(uint16_t time) {
  (void)time;
  return 0;
}
uint16_t hal_capture_time(void);
void hal_capture_falling(void);
void hal_capture_stop(void);
static inline volatile hal_change *hal_change_at(uint8_t index) { return &hal_changes[index / sizeof(hal_change)]; }
uint8_t hal_changes_stopped(void);
void hal_changes_resume(void);
void hal_pin_change_mask(uint8_t bits);

extern uint8_t hal_stamp_slot;
extern uint16_t hal_stamp_time;
void hal_stamp_arm(uint8_t bits);
void hal_stamp_disarm(void);
bool hal_stamp_awaited(void);

void hal_two_wire_on(void);
void hal_two_wire_off(void);
void hal_two_wire_begin(void);
void hal_two_wire_send(uint8_t byte);
void hal_two_wire_receive(bool more);
void hal_two_wire_end(void);
uint8_t hal_two_wire_status(void);
uint8_t hal_two_wire_byte(void);

bool hal_serial_received(void);
uint8_t hal_serial_due(void);
void hal_serial_seen(void);
void hal_serial_again(void);
static inline void hal_serial_look(void) {}
bool hal_serial_receive(uint8_t *byte);
static inline bool hal_serial_receive_block(uint8_t *bytes, uint8_t *count, uint8_t size) {
  uint8_t byte = 0;
  BOUNDED(size, for (uint8_t room = (uint8_t)(*count < size - 1 ? size - *count : size);
                     room > 0 && hal_serial_receive(&byte); room--)) {
    if (byte == 0) {
      return true;
    }
    bytes[*count] = byte;
    if (*count < size - 1) {
      (*count)++;
    }
  }
  return false;
}
bool hal_serial_room(uint8_t count);
uint8_t *hal_serial_place(void);
static inline uint8_t *hal_serial_beyond(uint8_t *place, uint8_t count) { return place + count; }
static inline void hal_serial_put(uint8_t **place, uint8_t byte) { *(*place)++ = byte; }
static inline void hal_serial_put_before(uint8_t **place, uint8_t byte) { *--(*place) = byte; }
void hal_serial_queue(uint8_t count);

#define HAL_EEPROM_SIZE 1024u
void hal_eeprom_wait(void);
bool hal_eeprom_busy(void);
uint8_t hal_eeprom_read(uint16_t address);
void hal_eeprom_write_start(uint16_t address, uint8_t value);
void hal_eeprom_interrupt(bool on);

#define HAL_TABLE static const
#define HAL_NAMED
#define HAL_NEAR(pointer) (pointer)
#define HAL_ZERO(variable) hal_native_zero((void *)&(variable), sizeof(variable)) /* a process starts more than once */
static inline void hal_native_zero(void *at, size_t size) { memset(at, 0, size); }
static inline uint8_t hal_table_byte(const uint8_t *byte) { return *byte; }
static inline uint16_t hal_table_word(const uint16_t *word) { return *word; }
static inline void hal_table_copy(void *to, const void *from, uint8_t size) { memcpy(to, from, size); }

#ifdef __cplusplus
}
#endif

#endif
