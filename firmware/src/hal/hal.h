/* hal.h: what a board must offer. The same firmware runs on the ATmega328P (hal/avr) and in a PC process (hal/native).
 *
 * Time is counted in CPU cycles of 16 MHz. hal_time() is a free-running 16-bit count (Timer1 at clk/1); it starts at 0
 * in hal_start_timers(); the first slot interrupt comes at HAL_SLOT_CYCLES, and arms the next.
 *
 * Interrupts are defined where their device lives, by these words in front of a body:
 *   HAL_INTERRUPT_SLOT        a new slot has begun                                  schedule.c
 *   HAL_INTERRUPT_EDGE        the time given to hal_edge_arm() is HAL_EDGE_LEAD off  schedule.c
 *   HAL_INTERRUPT_CAPTURE     an edge on the Ping pin; hal_capture_time() has when  ping.c
 *   HAL_INTERRUPT_EEPROM      the EEPROM is ready; others may interrupt it          storage.c
 *   HAL_INTERRUPT_TWO_WIRE    the two-wire bus has done a step; others may too      two_wire.c
 *   HAL_INTERRUPT_WATCHDOG    the watchdog was not kicked: a reset comes            reset.c
 * They stamp and store. What they share with the rest is read and written inside HAL_ATOMIC { ... }, the only way that
 * this firmware turns interrupts off outside an interrupt.
 *
 * Pins are named by device, as in the generated pins header: HAL_PIN_HIGH(SERVO_LEFT).
 *   HAL_PIN_OUTPUT HAL_PIN_INPUT HAL_PIN_PULL_UP      direction; INPUT leaves the pull-up off
 *   HAL_PIN_HIGH HAL_PIN_LOW HAL_PIN_TOGGLE           single instructions, safe beside interrupts
 *   HAL_PIN_READ(NAME)                                0 or 1
 *   HAL_PORT_READ(NAME)                               the eight pins of NAME's port, NAME at bit NAME_BIT
 *   HAL_PORT_C()                                      those of port C (A0..A5)
 *   HAL_PIN_BIT(NAME)                                 NAME's bit of its port
 */
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_SLOT_CYCLES 40000u
#define HAL_CYCLES_PER_US 16u

/* Changes of the encoders' port, stamped by the pin-change interrupt and worked off by the main loop: a ring whose
 * indices are bytes into it, so that they wrap by themselves.
 *
 * The interrupt outranks all others, so it must not come back to back for long. When HAL_CHANGES_STORM changes in a row
 * came at most HAL_CHANGES_CLOSE cycles after the one before, or when the ring is full, it masks all lines, which
 * hal_changes_stopped() tells. Wheels that turn never do that: among four lines of which each changes once in 2300 cycles
 * or slower (69 edges in a tick), four gaps add up to more than four close ones, even if other interrupts took 1269 cycles
 * of them. */
#define HAL_CHANGES_CLOSE 256u
#define HAL_CHANGES_STORM 4u
#define HAL_CHANGES 64u
typedef struct {
  uint16_t time; /* hal_time() */
  uint8_t bits;  /* of the port */
  uint8_t close; /* changes up to this one that were close to the one before */
} hal_change;
#define HAL_CHANGE_BYTES 4u /* the size of one; its index is a multiple */

#ifdef __cplusplus
extern "C" {
#endif
extern hal_change hal_changes[HAL_CHANGES];
extern volatile uint8_t hal_changes_head; /* the last change stamped */
extern volatile uint8_t hal_changes_tail; /* the last change worked off */
#ifdef __cplusplus
}
#endif

#ifdef __AVR__
#include "hal/avr/hal_avr.h"
#else
#include "hal/native/hal_native.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

static inline __attribute__((always_inline)) volatile hal_change *hal_change_after(uint8_t index) {
  return hal_change_at((uint8_t)(index + HAL_CHANGE_BYTES));
}

/* Why the chip says that it started, RESET_CAUSE_... of generated/messages.h; unknown behind a bootloader that took the
 * cause. Of several the one that loses most: power, brown-out, watchdog, external. */
uint8_t hal_reset_cause(void);

/* Memory, HAL_NOINIT_SIZE bytes, that a reset leaves alone and power-on fills with anything. */
#define HAL_NOINIT_SIZE 32u
void *hal_noinit(void);

/* A hash of memory that nobody has written since the start: what RAM held when the power came, if it just came. */
uint32_t hal_memory_noise(void);

/* Line at that rate (96 ... 10000, in 100 bit/s; as near as the clock allows), 8N1. Call once, before the timers. */
void hal_start_serial(uint16_t baud);

/* Starts the time and the slots. Interrupts are enabled from here on. */
void hal_start_timers(void);

/* The chip resets itself unless kicked every 120 ms: after that time comes HAL_INTERRUPT_WATCHDOG, which ends in
 * hal_watchdog_reset(), and 16 ms later the reset; or 120 ms later, if interrupts are off for good. */
void hal_start_watchdog(void);
void hal_kick_watchdog(void);
void hal_watchdog_reset(void); /* kicks count no more */

/* The analog converter: joins it to channel 0..5 (A0..A5) or to the chip's bandgap, converts (104 us, the first time 200 us);
 * the last complete result is voltage * 1024 / supply, rounded down, at most 1023. Nothing is joined while it is busy. */
#define HAL_ANALOG_BANDGAP 14u
void hal_analog_select(uint8_t channel);
void hal_analog_convert(void);
bool hal_analog_busy(void);
uint16_t hal_analog_result(void);

/* A tone on the pin named BUZZER: it is toggled every `count` (1..255) periods of a clock of 16 MHz by 8, ...; interrupt of
 * 13 cycles. Off leaves the pin low. */
enum { HAL_TONE_BY_8 = 2, HAL_TONE_BY_64, HAL_TONE_BY_256, HAL_TONE_BY_1024 };
void hal_tone_start(uint8_t clock, uint8_t count);
void hal_tone_stop(void);

/* Queues bytes for sending. The caller has asked for room; as has who writes them to hal_serial_place() himself. */
void hal_serial_send(const uint8_t *bytes, uint8_t count);

/* Whether received bytes were lost, or may have been, since the last call. */
bool hal_serial_overrun(void);

/* Turns a carrier on the LED of one side on or off, half a period given in cycles (at most 256); off leaves the LED dark.
 * Interrupt context. */
void hal_carrier_start(uint8_t side, uint8_t half_period);
void hal_carrier_stop(void);

/* Makes the pin named PING give a 5 us pulse, leaves it an input and waits for the echo's rising edge. */
void hal_ping_trigger(void);

/* Status codes of the two-wire bus (data sheet, tables 22-2 and 22-3). */
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
  HAL_TWO_WIRE_BYTE_READ = 0x50, /* and acknowledged */
  HAL_TWO_WIRE_LAST_READ = 0x58,
};

/* Bytes of flash that the image fills, and their CRC-32; 0 and 0 where there is no flash. Takes some 0.1 s. */
uint32_t hal_image_size(void);
uint32_t hal_image_hash(void);

/* Each target's header also gives, as macros or inline functions:
 *   uint16_t hal_time(void)                       now; interrupt context or HAL_ATOMIC
 *   void hal_slot_arm(uint16_t time)              the slot interrupt comes at `time`
 *   void hal_edge_arm(uint16_t time)              the edge interrupt comes HAL_EDGE_LEAD cycles before `time`, or sooner
 *                                                 than that if it must; one at a time, a new one replaces the last
 *   void hal_edge_arm_plain(uint16_t time)        the same without a lead: for what needs no cycle-exact time
 *   void hal_edge_disarm(void)
 *   void hal_edge_wait(uint16_t time)             in the edge interrupt: returns at a fixed distance from `time`
 *   uint16_t hal_edge_delay(uint16_t time)        right after hal_edge_wait() and the edge: by how much it came too late;
 *                                                 0 unless other interrupts took longer than HAL_EDGE_LEAD
 *   uint16_t hal_capture_time(void)               when the captured edge came
 *   void hal_capture_falling(void)                next, capture the falling edge
 *   void hal_capture_stop(void)
 *   volatile hal_change *hal_change_at(index)     the change at an index of their ring
 *   uint8_t hal_changes_stopped(void)             not 0 if the pin-change interrupt has masked all lines, and
 *   void hal_changes_resume(void)                 forgets it
 *   void hal_pin_change_mask(uint8_t bits)        encoder lines (bits of their port) that interrupt; changes of lines
 *                                                 that were all masked are forgotten
 *   void hal_stamp_arm(uint8_t bits)              the next change of one of these pins of port D (0..7) is stamped, once:
 *   bool hal_stamp_awaited(void)                  not yet; if it has come,
 *   uint8_t hal_stamp_slot, uint16_t hal_stamp_time   are schedule_slot and hal_time() then
 *   void hal_stamp_disarm(void)                   it is awaited no more
 *   void hal_two_wire_on(void), hal_two_wire_off(void)   gives the pins A4 and A5 to the two-wire bus, at 100 kHz
 *   void hal_two_wire_begin(void)                 a start, or a repeated one. This and the next three are the last thing
 *                                                 that the interrupt does, or called within HAL_ATOMIC; the bus waits
 *                                                 until then
 *   void hal_two_wire_send(uint8_t byte)
 *   void hal_two_wire_receive(bool more)          a byte, with the acknowledgement that asks for more, or without
 *   void hal_two_wire_end(void)                   a stop; no interrupt follows
 *   uint8_t hal_two_wire_status(void)             HAL_TWO_WIRE_..., the chip's code for what has just been done
 *   uint8_t hal_two_wire_byte(void)               the byte received
 *   bool hal_serial_received(void)                whether a received byte waits
 *   uint8_t hal_serial_due(void)                  not 0 if a zero byte (the end of a frame) or a quarter of the ring waits
 *   void hal_serial_seen(void)                    zero bytes that wait now make it due no more,
 *   void hal_serial_again(void)                   or do again
 *   bool hal_serial_receive(uint8_t *byte)        takes the oldest; false if there is none
 *   bool hal_serial_receive_block(uint8_t *bytes, uint8_t *count, uint8_t size)
 *                                                 takes bytes up to a zero, which it takes and leaves out, at most `size` (a
 *                                                 constant), and appends them to `bytes`; those past size - 1 are not
 *                                                 kept. False without a zero: bytes may still wait. *count < size
 *   uint8_t *hal_serial_place(void)               where the next byte to send goes,
 *   uint8_t *hal_serial_beyond(place, count)      where the one `count` (less than 128) after that,
 *   void hal_serial_put(&place, uint8_t byte)     writes there and moves on,
 *   void hal_serial_put_before(&place, byte)      moves back and writes there
 *   void hal_serial_queue(uint8_t count)          sends what was written from the first such place on
 *   bool hal_serial_room(uint8_t count)           whether `count` more bytes can be queued for sending; if not, the CPU
 *                                                 is woken when more can
 *   void hal_sleep_until(bool (*due)(void))       sleeps until something is due, asked after each interrupt. It
 *                                                 becomes due with a slot, a stamped change or a byte
 *   HAL_EEPROM_SIZE                               bytes of EEPROM. A write takes 3.4 ms and goes on through a reset. Before
 *                                                 interrupts are on hal_eeprom_wait() waits for its end; later only one
 *                                                 part of the firmware reads and writes.
 *   bool hal_eeprom_busy(void)                    a write is under way
 *   uint8_t hal_eeprom_read(uint16_t address)     not while it is busy
 *   void hal_eeprom_write_start(uint16_t address, uint8_t value)   returns at once; not while it is busy
 *   void hal_eeprom_interrupt(bool on)            whether HAL_INTERRUPT_EEPROM runs when it is ready
 *   void hal_eeprom_wait(void)
 *   HAL_TABLE, hal_table_byte(p), hal_table_word(p), hal_table_copy   constant tables in flash
 *   HAL_ZERO(variable)                            once, at the start: makes it zero, where the start-up code has not
 *   HAL_NEAR(pointer)                             the same pointer; what a function reads and writes by it is then reached
 *                                                 from there, half of the flash of an address for each
 *   HAL_NAMED                                     in front of a variable that the board's assembly names
 */

#ifdef __cplusplus
}
#endif

#endif
