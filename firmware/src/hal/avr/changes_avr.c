/* changes_avr.c: the pin-change interrupt of the encoders, written out: 75 cycles with entry and return, 79 for a close
 * change. */
#include "hal/hal.h"
#include "pins.h"

HAL_NAMED hal_change hal_changes[HAL_CHANGES + 1u];
HAL_NAMED volatile uint8_t hal_changes_head, hal_changes_tail;

_Static_assert(sizeof(hal_change) == HAL_CHANGE_BYTES && HAL_CHANGES * HAL_CHANGE_BYTES == 256, "indices are bytes");
_Static_assert(HAL_CHANGES_CLOSE == 256, "what is close shows in the high byte");

ISR(PCINT1_vect, ISR_NAKED) {
  __asm__ volatile(
      "push r24                        \n"
      "in r24, %[sreg]                 \n"
      "push r24                        \n"
      "push r23                        \n"
      "push r25                        \n"
      "push r30                        \n"
      "push r31                        \n"
      "lds r30, hal_changes_head       \n"
      "ldi r31, 0                      \n"
      "subi r30, lo8(-(hal_changes))   \n"
      "sbci r31, hi8(-(hal_changes))   \n" /* Z: the change before */
      "lds r24, %[low]                 \n"
      "lds r25, %[high]                \n"
      "in r23, %[port]                 \n"
      "std Z+4, r24                    \n"
      "std Z+5, r25                    \n"
      "std Z+6, r23                    \n"
      "ld r23, Z                       \n"
      "sub r24, r23                    \n"
      "ldd r23, Z+1                    \n"
      "sbc r25, r23                    \n"
      "tst r25                         \n"
      "brne 1f                         \n"
      "ldd r24, Z+3                    \n"
      "inc r24                         \n"
      "std Z+7, r24                    \n"
      "cpi r24, %[storm]               \n"
      "brlo 2f                         \n"
      "rcall 5f                        \n" /* a storm */
      "rjmp 2f                         \n"
      "1: ldi r24, 0                   \n"
      "std Z+7, r24                    \n"
      "2: lds r24, hal_changes_head    \n"
      "subi r24, -4                    \n"
      "breq 4f                         \n"
      "lds r25, hal_changes_tail       \n"
      "cp r24, r25                     \n"
      "breq 6f                         \n"
      "sts hal_changes_head, r24       \n"
      "3: pop r31                      \n"
      "pop r30                         \n"
      "pop r25                         \n"
      "pop r23                         \n"
      "pop r24                         \n"
      "out %[sreg], r24                \n"
      "pop r24                         \n"
      "reti                            \n"
      "4: lds r25, hal_changes_tail    \n" /* the last place: it becomes the first too */
      "cp r24, r25                     \n"
      "breq 6f                         \n"
      "sts hal_changes_head, r24       \n"
      "ldd r24, Z+4                    \n"
      "sts hal_changes, r24            \n"
      "ldd r24, Z+5                    \n"
      "sts hal_changes+1, r24          \n"
      "ldd r24, Z+6                    \n"
      "sts hal_changes+2, r24          \n"
      "ldd r24, Z+7                    \n"
      "sts hal_changes+3, r24          \n"
      "rjmp 3b                         \n"
      "6: rcall 5f                     \n" /* full: this change is lost */
      "rjmp 3b                         \n"
      "5: ldi r24, 0                   \n"
      "sts %[mask], r24                \n"
      "sbi %[general], %[stopped]      \n"
      "sbi %[flags], %[flag]           \n"
      "ret                             \n"
      :
      : [sreg] "I"(_SFR_IO_ADDR(SREG)), [low] "n"(_SFR_MEM_ADDR(TCNT1L)), [high] "n"(_SFR_MEM_ADDR(TCNT1H)),
        [port] "I"(_SFR_IO_ADDR(PINC)), [storm] "M"(HAL_CHANGES_STORM), [mask] "n"(_SFR_MEM_ADDR(PCMSK1)),
        [flags] "I"(_SFR_IO_ADDR(PCIFR)), [flag] "I"(PCIF1), [general] "I"(_SFR_IO_ADDR(GPIOR0)),
        [stopped] "I"(HAL_STOPPED_BIT));
}
