/* changes_avr.c: the pin-change interrupt of the encoders, written out: 50 cycles with entry, vector and return, 60 for a
 * close change. A byte that the UART has received meanwhile is taken at its end, for the receive interrupt may have to wait
 * for several of these: 19 cycles, less than by an interrupt of its own. */
#include "hal/hal.h"
#include "pins.h"

/* At a multiple of 256, as the UART's rings (serial_avr.c). */
HAL_NAMED hal_change hal_changes[HAL_CHANGES] __attribute__((aligned(256), section(".ring_changes,\"aw\",@nobits;")));
HAL_NAMED volatile uint8_t hal_changes_head, hal_changes_tail;

_Static_assert(sizeof(hal_change) == HAL_CHANGE_BYTES && sizeof(hal_changes) == 256, "indices are bytes");
_Static_assert(HAL_CHANGES_CLOSE == 256, "what is close shows in the high byte: time before - time is -1 ... -256");
_Static_assert(HAL_CHANGES_STORM == 4, "bit 2 of a count that rises by one");

HAL_ISR(PCINT1_vect) {
  __asm__ volatile(
      "in r6, %[sreg]                  \n"
      "movw r4, r30                    \n"
      "lds r30, hal_changes_head       \n"
      "ldi r31, hi8(hal_changes)       \n"
      "ld r3, Z                        \n" /* time of the change before */
      "ldd r2, Z+1                     \n"
      "subi r30, -4                    \n"
      "lds r7, %[low]                  \n"
      "st Z, r7                        \n"
      "sub r3, r7                      \n"
      "lds r7, %[high]                 \n"
      "std Z+1, r7                     \n"
      "sbc r2, r7                      \n"
      "in r7, %[port]                  \n"
      "std Z+2, r7                     \n"
      "inc r2                          \n"
      "breq 4f                         \n" /* close */
      "clr r2                          \n"
      "std Z+3, r2                     \n"
      "1: lds r7, hal_changes_tail     \n"
      "cp r30, r7                      \n"
      "breq 5f                         \n" /* full: this change is lost */
      "sts hal_changes_head, r30       \n"
      "2: out %[sreg], r6              \n"
      "lds r3, %[status]               \n"
      "sbrc r3, %[received]            \n"
      "rjmp hal_receive_rest           \n"
      "movw r30, r4                    \n"
      "reti                            \n"
      "4: dec r30                      \n"
      "ld r2, Z                        \n" /* how many before it were close */
      "inc r30                         \n"
      "inc r2                          \n"
      "std Z+3, r2                     \n"
      "sbrc r2, 2                      \n"
      "rjmp 6f                         \n"
      "clr r2                          \n"
      "rjmp 1b                         \n"
      "5: rcall hal_changes_stop       \n"
      "rjmp 2b                         \n"
      "6: rcall hal_changes_stop       \n" /* a storm */
      "lds r7, hal_changes_tail        \n"
      "cpse r30, r7                    \n"
      "sts hal_changes_head, r30       \n"
      "rjmp 2b                         \n"
      :
      : [sreg] "I"(_SFR_IO_ADDR(SREG)), [low] "n"(_SFR_MEM_ADDR(TCNT1L)), [high] "n"(_SFR_MEM_ADDR(TCNT1H)),
        [port] "I"(_SFR_IO_ADDR(PINC)), [status] "n"(_SFR_MEM_ADDR(UCSR0A)), [received] "I"(RXC0));
}

/* Masks all lines. */
HAL_NAMED HAL_BY_VECTORS void hal_changes_stop(void);
HAL_NAMED HAL_BY_VECTORS __attribute__((naked)) void hal_changes_stop(void) {
  __asm__ volatile(
      "clr r2                          \n"
      "sts %[mask], r2                 \n"
      "sbi %[general], %[stopped]      \n"
      "sbi %[flags], %[flag]           \n"
      "ret                             \n"
      :
      : [mask] "n"(_SFR_MEM_ADDR(PCMSK1)), [flags] "I"(_SFR_IO_ADDR(PCIFR)), [flag] "I"(PCIF1),
        [general] "I"(_SFR_IO_ADDR(GPIOR0)), [stopped] "I"(HAL_STOPPED_BIT));
}
