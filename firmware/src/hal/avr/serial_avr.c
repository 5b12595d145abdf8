/* serial_avr.c: the UART by interrupts, a ring each way. Both interrupts are written out: 26 cycles for a byte received (28
 * for a zero), 25 for a byte sent (30 for the last), with entry, vector and return; a byte lasts 320 at 500,000 baud. */
#include "bounds.h"
#include "hal/hal.h"

#define DOUBLE_SPEED 8u /* clock cycles per sample with U2X0: at 16 MHz nearer to all rates than 16 are */
#define SENDER_IDLE (_BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0))
#define SENDER_BUSY (SENDER_IDLE | _BV(UDRIE0))
#define SEND_WRAP_BIT 7 /* is 0 in the low bytes of the send ring's addresses (platformio.ini), and 1 behind it */
_Static_assert(HAL_SEND_RING == 1u << SEND_WRAP_BIT, "the bit behind the send ring");

/* In sections of their own, so that the linker can put them at the start of RAM, where aligning them wastes nothing
 * (platformio.ini). The end of the name is for the assembler: no bytes in flash, and a comment after it. */
#define SECTION(name) __attribute__((section(name ",\"aw\",@nobits;")))
HAL_NAMED uint8_t hal_receive_ring[256] __attribute__((aligned(256))) SECTION(".ring_receive");
HAL_NAMED uint8_t hal_send_ring[HAL_SEND_RING] __attribute__((aligned(HAL_SEND_RING))) SECTION(".ring_send");
HAL_NAMED volatile uint8_t hal_send_head;

/* What both that take a received byte do: r3 is UCSR0A, Z is saved in r4 and r5; ends before an instruction that a zero
 * byte skips. */
#define HAL_TAKE_BYTE                                                                        \
  "sbrc r3, %[overrun]               \n"                                                     \
  "sbi %[flags], %[lost]             \n"                                                     \
  "lds r3, %[data]                   \n"                                                     \
  "in r30, %[head]                   \n"                                                     \
  "ldi r31, hi8(hal_receive_ring)    \n"                                                     \
  "st Z+, r3                         \n" /* the place at the head is always free */          \
  "in r31, %[tail]                   \n"                                                     \
  "cpse r30, r31                     \n" /* full: the byte is lost, hal_serial_received() */ \
  "out %[head], r30                  \n"                                                     \
  "movw r30, r4                      \n"                                                     \
  "cpse r3, r2                       \n"
#define HAL_TAKE_OPERANDS                                                                                           \
  [status] "n"(_SFR_MEM_ADDR(UCSR0A)), [data] "n"(_SFR_MEM_ADDR(UDR0)), [head] "I"(_SFR_IO_ADDR(HAL_RECEIVE_HEAD)), \
      [tail] "I"(_SFR_IO_ADDR(HAL_RECEIVE_TAIL)), [flags] "I"(_SFR_IO_ADDR(GPIOR0)), [overrun] "I"(DOR0),           \
      [lost] "I"(HAL_LOST_BIT), [zero] "I"(HAL_ZERO_BIT)

void hal_start_serial(uint16_t baud) {
  __asm__ volatile("clr r2");
  GPIOR0 = 0; /* flags and indices: whoever started us may have used them */
  HAL_RECEIVE_HEAD = HAL_RECEIVE_TAIL = 0;
  HAL_SEND_TAIL = hal_send_head = (uint8_t)(uintptr_t)hal_send_ring;
  UBRR0 = (uint16_t)((uint16_t)(F_CPU / DOUBLE_SPEED / 100u + baud / 2u) / baud - 1u);
  UCSR0A = _BV(U2X0);
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = SENDER_IDLE;
}

/* No flag of SREG changes: nothing is saved but Z. hal_receive_rest: Z is saved already, and a byte waits. */
HAL_ISR(USART_RX_vect) {
  __asm__ volatile(
      "movw r4, r30                      \n"
      "lds r3, %[status]                 \n"
      ".global hal_receive_rest          \n"
      "hal_receive_rest:                 \n" HAL_TAKE_BYTE
      "reti                              \n" /* but for a zero */
      "sbi %[flags], %[zero]             \n"
      "reti                              \n"
      :
      : HAL_TAKE_OPERANDS);
}

HAL_NAMED HAL_BY_VECTORS __attribute__((naked)) void hal_serial_take(void) {
  __asm__ volatile("movw r4, r30                      \n" HAL_TAKE_BYTE
                   "ret                               \n"
                   "sbi %[flags], %[zero]             \n"
                   "ret                               \n"
                   :
                   : HAL_TAKE_OPERANDS);
}

/* No flag of SREG changes. */
HAL_ISR(USART_UDRE_vect) {
  __asm__ volatile(
      "movw r4, r30                      \n"
      "in r30, %[tail]                   \n"
      "ldi r31, hi8(hal_send_ring)       \n"
      "ld r3, Z+                         \n"
      "sts %[data], r3                   \n"
      "sbrc r30, %[wrap]                 \n"
      "ldi r30, lo8(hal_send_ring)       \n"
      "out %[tail], r30                  \n"
      "mov r3, r30                       \n"
      "movw r30, r4                      \n"
      "lds r6, hal_send_head             \n"
      "cpse r3, r6                       \n"
      "reti                              \n" /* but for the last byte */
      "ldi r30, %[idle]                  \n"
      "sts %[control], r30               \n"
      "movw r30, r4                      \n"
      "reti                              \n"
      :
      : [data] "n"(_SFR_MEM_ADDR(UDR0)), [control] "n"(_SFR_MEM_ADDR(UCSR0B)), [tail] "I"(_SFR_IO_ADDR(HAL_SEND_TAIL)),
        [wrap] "I"(SEND_WRAP_BIT), [idle] "M"(SENDER_IDLE));
}

void hal_serial_queue(uint8_t count) {
  hal_send_head = (uint8_t)(uintptr_t)hal_serial_beyond(hal_serial_place(), count);
  UCSR0B = SENDER_BUSY;
}

void hal_serial_send(const uint8_t *bytes, uint8_t count) {
  if (count == 0) {
    return;
  }
  uint8_t *place = hal_serial_place();
  BOUNDED(HAL_SEND_RING - 1u, for (uint8_t i = 0; i < count; i++)) {
    *hal_serial_beyond(place, i) = bytes[i];
  }
  hal_serial_queue(count);
}

bool hal_serial_overrun(void) {
  if ((GPIOR0 & _BV(HAL_LOST_BIT)) == 0) {
    return false;
  }
  GPIOR0 = (uint8_t)(GPIOR0 & (uint8_t)~_BV(HAL_LOST_BIT));
  return true;
}
