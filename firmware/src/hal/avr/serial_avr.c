/* serial_avr.c: the UART by interrupts, a ring each way. Both interrupts are written out: 47 cycles for a byte received (48
 * for a zero), 43 for a byte sent (45 for the last), with entry, vector and return; a byte lasts 320 at 500,000 baud. */
#include "bounds.h"
#include "hal/hal.h"

#define DOUBLE_SPEED 8u /* clock cycles per sample with U2X0: at 16 MHz nearer to all rates than 16 are */
#define SENDER_IDLE (_BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0))
#define SENDER_BUSY (SENDER_IDLE | _BV(UDRIE0))

/* In sections of their own, so that the linker can put them at the start of RAM, where aligning them wastes nothing
 * (platformio.ini). The end of the name is for the assembler: no bytes in flash, and a comment after it. */
#define SECTION(name) __attribute__((section(name ",\"aw\",@nobits;")))
HAL_NAMED uint8_t hal_receive_ring[256] __attribute__((aligned(256))) SECTION(".ring_receive");
HAL_NAMED uint8_t hal_send_ring[HAL_SEND_RING] __attribute__((aligned(HAL_SEND_RING))) SECTION(".ring_send");
HAL_NAMED volatile uint8_t hal_send_head;

void hal_start_serial(uint16_t baud) {
  GPIOR0 = 0; /* flags and indices: whoever started us may have used them */
  HAL_RECEIVE_HEAD = HAL_RECEIVE_TAIL = 0;
  HAL_SEND_TAIL = hal_send_head = (uint8_t)(uintptr_t)hal_send_ring;
  UBRR0 = (uint16_t)((uint16_t)(F_CPU / DOUBLE_SPEED / 100u + baud / 2u) / baud - 1u);
  UCSR0A = _BV(U2X0);
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = SENDER_IDLE;
}

ISR(USART_RX_vect, ISR_NAKED) {
  __asm__ volatile(
      "push r24                          \n"
      "in r24, %[sreg]                   \n"
      "push r24                          \n"
      "push r30                          \n"
      "push r31                          \n"
      "lds r24, %[status]                \n"
      "sbrc r24, %[overrun]              \n"
      "sbi %[flags], %[lost]             \n"
      "in r30, %[head]                   \n"
      "ldi r31, hi8(hal_receive_ring)    \n"
      "lds r24, %[data]                  \n"
      "st Z, r24                         \n" /* the place at the head is always free */
      "tst r24                           \n"
      "brne 3f                           \n"
      "sbi %[flags], %[zero]             \n"
      "3:                                \n"
      "inc r30                           \n"
      "in r24, %[tail]                   \n"
      "cp r30, r24                       \n"
      "breq 1f                           \n"
      "out %[head], r30                  \n"
      "2: pop r31                        \n"
      "pop r30                           \n"
      "pop r24                           \n"
      "out %[sreg], r24                  \n"
      "pop r24                           \n"
      "reti                              \n"
      "1: sbi %[flags], %[lost]          \n"
      "rjmp 2b                           \n"
      :
      : [sreg] "I"(_SFR_IO_ADDR(SREG)), [status] "n"(_SFR_MEM_ADDR(UCSR0A)), [data] "n"(_SFR_MEM_ADDR(UDR0)),
        [head] "I"(_SFR_IO_ADDR(HAL_RECEIVE_HEAD)), [tail] "I"(_SFR_IO_ADDR(HAL_RECEIVE_TAIL)),
        [flags] "I"(_SFR_IO_ADDR(GPIOR0)), [overrun] "I"(DOR0), [lost] "I"(HAL_LOST_BIT), [zero] "I"(HAL_ZERO_BIT));
}

ISR(USART_UDRE_vect, ISR_NAKED) {
  __asm__ volatile(
      "push r24                          \n"
      "in r24, %[sreg]                   \n"
      "push r24                          \n"
      "push r30                          \n"
      "push r31                          \n"
      "in r30, %[tail]                   \n"
      "ldi r31, hi8(hal_send_ring)       \n"
      "ld r24, Z                         \n"
      "sts %[data], r24                  \n"
      "inc r30                           \n"
      "andi r30, %[mask]                 \n"
      "ori r30, lo8(hal_send_ring)       \n"
      "out %[tail], r30                  \n"
      "lds r24, hal_send_head            \n"
      "cp r30, r24                       \n"
      "breq 1f                           \n"
      "2: pop r31                        \n"
      "pop r30                           \n"
      "pop r24                           \n"
      "out %[sreg], r24                  \n"
      "pop r24                           \n"
      "reti                              \n"
      "1: ldi r24, %[idle]               \n" /* nothing more to send */
      "sts %[control], r24               \n"
      "rjmp 2b                           \n"
      :
      : [sreg] "I"(_SFR_IO_ADDR(SREG)), [data] "n"(_SFR_MEM_ADDR(UDR0)), [control] "n"(_SFR_MEM_ADDR(UCSR0B)),
        [tail] "I"(_SFR_IO_ADDR(HAL_SEND_TAIL)), [mask] "M"(HAL_SEND_MASK), [idle] "M"(SENDER_IDLE));
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
