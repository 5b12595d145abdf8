/* hal.h: what a board must offer. The same firmware runs on the ATmega328P (hal/avr) and in a PC process (hal/native).
 *
 * Time is counted in CPU cycles of 16 MHz. hal_time() is a free-running count of 16 bits, which starts at 0 in
 * hal_start_timers(). What the firmware shares with its interrupts (interrupts.h) it reads and writes within
 * HAL_ATOMIC { ... }; single bytes need none. Only main() switches interrupts off otherwise, before it sleeps.
 *
 * Pins are named by device, as in the generated pins header: HAL_PIN_HIGH(SERVO_LEFT).
 *   HAL_PIN_OUTPUT HAL_PIN_INPUT HAL_PIN_PULL_UP      direction; INPUT leaves the pull-up off
 *   HAL_PIN_HIGH HAL_PIN_LOW HAL_PIN_TOGGLE           single instructions, safe beside interrupts
 *   HAL_PIN_READ(NAME)                                0 or 1
 *   HAL_PIN_BIT(NAME)                                 its bit in its port
 *   HAL_PORT_C()                                      the pins of port C (A0..A5)
 */
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "pins.h"

#define HAL_SLOT_CYCLES 40000u
#define HAL_CYCLES_PER_US 16u

#define HAL_INLINE static inline __attribute__((always_inline))

#ifdef __AVR__
#include "hal/avr/hal_avr.h"
#else
#include "hal/native/hal_native.h"
#endif

/* ---- pins ---- */

/* HAL_PIN_...(name), of a pin of pins.h: HIGH, LOW, TOGGLE; OUTPUT, INPUT (without pull-up), PULL_UP; READ. */
#define HAL_PIN_OUTPUT_LOW(name) (HAL_PIN_LOW(name), HAL_PIN_OUTPUT(name))
#define HAL_PIN_OUTPUT_HIGH(name) (HAL_PIN_HIGH(name), HAL_PIN_OUTPUT(name))

/* ---- start and reset ---- */

/* Starts time and slots: the first slot begins at HAL_SLOT_CYCLES. Interrupts are on from here. */
void hal_start_timers(void);

/* Why the chip says that it started, RESET_CAUSE_...; unknown behind a bootloader that has cleared the cause. Of several
 * causes the one that loses most: power, brown-out, watchdog, external. */
uint8_t hal_reset_cause(void);

/* Memory of HAL_NOINIT_SIZE bytes that a reset leaves alone and power-on fills with anything. */
#define HAL_NOINIT_SIZE 32u
void *hal_noinit(void);

/* A hash of the memory above the variables, whose content is by chance after power-on. */
uint32_t hal_memory_noise(void);

/* The chip resets itself unless kicked every 120 ms: then reset_on_watchdog() runs, and 16 ms later comes the reset. */
void hal_start_watchdog(void);
void hal_kick_watchdog(void);
void hal_watchdog_reset(void); /* kicks count no more */

/* The flash image without the bootloader: its size in bytes, and its CRC-32 as of zlib. */
uint32_t hal_image_size(void);
uint32_t hal_image_hash(void);

/* ---- time and edges: Timer1 ---- */

/* bool hal_sleeps(void): whether the chip can sleep; where it cannot, the main loop goes round without.
 * void hal_sleep(void): with interrupts off: sleeps, lets one that waits run, and returns with interrupts off again.
 * uint16_t hal_time(void): the count. In an interrupt or HAL_ATOMIC.
 * void hal_wait(uint16_t cycles): waits, a constant; interrupts come on top.
 * void hal_slot_arm(uint16_t time): when the next slot begins.
 * void hal_edge_arm(uint16_t time): servo_on_edge() comes HAL_EDGE_LEAD cycles before `time`.
 * void hal_edge_disarm(void): it comes no more.
 * uint16_t hal_edge_wait(uint16_t time): in servo_on_edge(): returns up to 8 cycles after `time`, and takes received bytes
 *   meanwhile. Its value: the cycles by which it was called too late, 0 if it was not.
 * void hal_capture_start(void), hal_capture_start_falling(void): ping_on_edge() comes with each rising edge of pin 8 from now
 *   on; with each falling one. On a map whose left light sensor is there light_on_left_fall() comes instead.
 * void hal_capture_falling(void): from now on with each falling edge. void hal_capture_stop(void): no more. */

/* ---- pins that interrupt when they change ---- */

/* The pins of port C (A0..A5) whose changes call pin_changes_on_change(): bits of the port. What changed while none was
 * watched is forgotten. */
void hal_watch_port_c(uint8_t bits);

/* The pins of port D (0..7) whose changes call port_d_on_change(), of the one device of the map that watches them. */
void hal_watch_port_d(uint8_t bits);

/* ---- serial line ---- */

/* Opens the line at that rate (96 ... 10000, in 100 bit/s; as near as the clock allows), 8N1. Once, before the timers. */
void hal_start_serial(uint16_t baud);

/* Not 0: the main loop should read bytes: after a zero byte (the end of a frame), while half of the ring waits, and when
 * reception has stopped. */
uint8_t hal_serial_due(void);
void hal_serial_clear_due(void); /* forgets the zero bytes that were received until now */
void hal_serial_set_due(void);   /* due until cleared */

/* Takes the oldest byte that waits; false if none does. */
bool hal_serial_receive(uint8_t *byte);
bool hal_serial_waiting(void);

/* Reception stops by itself when its ring of HAL_RECEIVE_MAX bytes is full: bytes are lost from then on. */
#define HAL_RECEIVE_MAX 127u
bool hal_serial_stopped(void);
void hal_serial_resume(void);

/* Whether the chip has lost bytes because nobody took them in time, since the last call. */
bool hal_serial_overrun(void);

/* Whether `count` more bytes can be queued for sending; queues them. The caller has asked for room. */
bool hal_serial_room(uint8_t count);
void hal_serial_send(const uint8_t *bytes, uint8_t count);

/* ---- devices ---- */

/* Sends a carrier by the IR LED of one side: `toggles` toggles, an even number, half a period (at most 256 cycles) apart. In an
 * interrupt. hal_burst_seen(): whether the receiver of that side saw it (its output was low) at its end. */
void hal_burst_start(uint8_t side, uint8_t half_period, uint8_t toggles);
bool hal_burst_seen(uint8_t side);

/* A tone on the pin named BUZZER: it is toggled every `count` (1..255) periods of a clock of 16 MHz by 8, ... Off leaves
 * the pin low. */
enum { HAL_TONE_BY_8 = 2, HAL_TONE_BY_64, HAL_TONE_BY_256, HAL_TONE_BY_1024 };
void hal_tone_start(uint8_t clock, uint8_t count);
void hal_tone_stop(void);

/* The analog converter: selects channel 0..5 (A0..A5) or the chip's bandgap, converts (104 us, the first time 200); the last
 * complete result is voltage * 1024 / supply, rounded down, at most 1023. No channel is selected while it is busy. */
#define HAL_ANALOG_BANDGAP 14u
void hal_analog_select(uint8_t channel);
void hal_analog_convert(void);
bool hal_analog_busy(void);
uint16_t hal_analog_result(void);

/* The EEPROM. A write takes 3.4 ms and goes on through a reset; hal_eeprom_wait() waits for its end, before the timers are
 * started. Neither read nor write while it is busy. */
#define HAL_EEPROM_SIZE 1024u
bool hal_eeprom_busy(void);
void hal_eeprom_wait(void);
uint8_t hal_eeprom_read(uint16_t address);
void hal_eeprom_write_start(uint16_t address, uint8_t value);

/* ---- two-wire bus, pins A4 and A5, 100 kHz ---- */

/* Status codes (data sheet, tables 22-2 and 22-3). */
enum {
  HAL_TWO_WIRE_STARTED = 0x08,
  HAL_TWO_WIRE_STARTED_AGAIN = 0x10,
  HAL_TWO_WIRE_ADDRESS_TAKEN = 0x18, /* to write */
  HAL_TWO_WIRE_ADDRESS_REFUSED = 0x20,
  HAL_TWO_WIRE_BYTE_TAKEN = 0x28,
  HAL_TWO_WIRE_BYTE_REFUSED = 0x30,
  HAL_TWO_WIRE_ARBITRATION_LOST = 0x38,
  HAL_TWO_WIRE_READ_TAKEN = 0x40, /* the address, to read */
  HAL_TWO_WIRE_READ_REFUSED = 0x48,
  HAL_TWO_WIRE_BYTE_READ = 0x50, /* and acknowledged: more follow */
  HAL_TWO_WIRE_LAST_READ = 0x58,
};

void hal_two_wire_on(void); /* gives it the pins */
void hal_two_wire_off(void);

/* The next step; after each but a stop two_wire_on_step() comes. The bus waits meanwhile. */
void hal_two_wire_begin(void); /* a start, or a repeated one */
void hal_two_wire_send(uint8_t byte);
void hal_two_wire_receive(bool more); /* a byte, acknowledged if more shall follow */
void hal_two_wire_end(void);          /* a stop */

uint8_t hal_two_wire_status(void); /* HAL_TWO_WIRE_... */
uint8_t hal_two_wire_byte(void);   /* the byte received */

#endif
