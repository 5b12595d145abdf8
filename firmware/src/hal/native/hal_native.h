/* hal_native.h: the board in a PC process; see hal/hal.h for what each of these means. */
#ifndef HAL_NATIVE_H
#define HAL_NATIVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "bounds.h"

/* Interrupts come between calls, never inside one. */
#define HAL_ATOMIC

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
#define HAL_PORT_C() (PINC)
#define HAL_PIN_BIT(name) ((uint8_t)(1u << name##_BIT))
#define HAL_PIN_READ(name) ((uint8_t)((unsigned)name##_PINR >> name##_BIT & 1u))

uint16_t hal_time(void);
void hal_wait(uint16_t cycles);
void hal_slot_arm(uint16_t time);
void hal_edge_arm(uint16_t time);
void hal_edge_disarm(void);
static inline uint16_t hal_edge_wait(uint16_t time) {
  (void)time;
  return 0; /* the event comes at its very cycle */
}
void hal_capture_start(void);
void hal_capture_start_falling(void);
void hal_capture_falling(void);
void hal_capture_stop(void);

#define HAL_TABLE static const
static inline uint16_t hal_table_word(const uint16_t *word) { return *word; }
static inline void hal_table_copy(void *to, const void *from, uint8_t size) { memcpy(to, from, size); }

#endif
