/* program.S: the frame of the calibration program; the measurements themselves come from rows.inc, which program.py
 * writes from the rows of this folder.
 *
 * The program waits for a '?', then sends its name, and of each row its number and the result, in hexadecimal:
 * "=0012 0004". With ">3" it asks for three bytes. At the end it says "end" and waits again.
 *
 * A measurement lies between two stamps of Timer 1, which runs at clk/1. A stamp takes 6 cycles; it reads the count in
 * its second one, and at its end it toggles pin 13, so that a listener at the pin measures the same distance. Registers
 * r2 to r7 belong to this file, r8 counts interrupts, r9 to r11 belong to interrupts; a row may use all others.
 */
#define __SFR_OFFSET 0
#include <avr/io.h>

#define SCRATCH 0x0200 /* RAM that rows may write */

.macro stamp low, high
  lds \low, TCNT1L
  lds \high, TCNT1H
  sbi PINB, 5
.endm

.macro begin
  stamp r2, r3
.endm

.macro finish
  stamp r4, r5
.endm

/* Pointers into the scratch RAM, and one value for the operands. */
.macro operands
  ldi r26, lo8(SCRATCH)
  ldi r27, hi8(SCRATCH)
  movw r28, r26
  movw r30, r26
  ldi r16, 0
  ldi r17, 0xFF
.endm

/* A compare unit of Timer 1 is to match \after counts behind the stamp that began: match_after UNIT_A, 100. */
#define UNIT_A OCR1AH, OCR1AL, OCF1A
#define UNIT_B OCR1BH, OCR1BL, OCF1B
.macro match_after high, low, flag, after
  movw r24, r2
  subi r24, lo8(-(\after))
  sbci r25, hi8(-(\after))
  sts \high, r25
  sts \low, r24
  ldi r24, 1 << \flag
  out TIFR1, r24
.endm

/* Sleeps until \count interrupts have come since r8 was cleared. */
.macro sleep_until count
  ldi r18, \count
9:
  cli
  cp r8, r18
  brsh 8f
  sei
  sleep
  rjmp 9b
8:
.endm

.macro store register, value:vararg
  ldi r24, \value
  sts \register, r24
.endm

.macro ask count
9:
  lds r24, UDR0                     /* what came before it was asked for */
  lds r24, UCSR0A
  sbrc r24, RXC0
  rjmp 9b
  ldi r25, '>'
  call send
  ldi r25, '0' + \count
  call send
  call end_line
.endm

/* ---- interrupts: each stamps and counts; those that last as long as their cause take it away ---- */

.macro handler vector
.global __vector_\vector
__vector_\vector:
.endm

handler 1  /* INT0 */
handler 4  /* pin change of port C */
handler 5  /* of port D */
handler 6  /* watchdog */
handler 7  /* Timer 2, compare A */
handler 10 /* Timer 1, capture */
handler 11 /* Timer 1, compare A */
handler 12 /* Timer 1, compare B */
handler 13 /* Timer 1, overflow */
handler 14 /* Timer 0, compare A */
handler 20 /* UART, transmission complete */
handler 21 /* ADC */
  finish
  inc r8
  reti

handler 2 /* INT1: another stamp */
  stamp r10, r11
  reti

handler 18 /* UART, byte received */
  finish
  inc r8
  lds r9, UDR0
  reti

handler 19 /* UART, data register empty: sends the next */
  finish
  inc r8
  sts UDR0, r9
  reti

handler 22 /* EEPROM ready */
  finish
  inc r8
  cbi EECR, EERIE
  reti

handler 24 /* two-wire interface: its flag stays, its interrupt goes */
  finish
  inc r8
  ldi r24, 1 << TWEN
  sts TWCR, r24
  reti

/* ---- sending ---- */

/* Sends r25. */
send:
  lds r24, UCSR0A
  sbrs r24, UDRE0
  rjmp send
  sts UDR0, r25
  ret

/* The low half of r25 as a hexadecimal digit. */
send_digit:
  andi r25, 0x0F
  subi r25, -'0'
  cpi r25, '9' + 1
  brlo send
  subi r25, '0' + 10 - 'A'
  rjmp send

send_hex: /* r25 */
  mov r16, r25
  swap r25
  rcall send_digit
  mov r25, r16
  rjmp send_digit

/* Returns when the line is idle, so that nothing is under way in the next measurement. */
end_line:
  lds r24, UCSR0A
  sbrs r24, UDRE0
  rjmp end_line
  store UCSR0A, 1 << TXC0 | 1 << U2X0
  ldi r25, '\n'
  sts UDR0, r25
1:
  lds r24, UCSR0A
  sbrs r24, TXC0
  rjmp 1b
  ret

/* The distance of the two stamps. */
report:
  movw r24, r4
  sub r24, r2
  sbc r25, r3
/* The number r25:r24. */
report_number:
  cli
  movw r18, r24
  rcall fresh_line
  mov r25, r7
  rcall send_hex
  mov r25, r6
  rcall send_hex
  ldi r25, ' '
  rcall send
  mov r25, r19
  rcall send_hex
  mov r25, r18
  rcall send_hex
  movw r24, r6
  adiw r24, 1
  movw r6, r24
  clr r8
  clr r1 /* a product may be there */
  rjmp end_line

fresh_line: /* a measurement may have sent anything */
  ldi r25, '\n'
  rcall send
  ldi r25, '='
  rjmp send

/* ---- the whole ---- */

.global main
main:
  cli
  wdr
  out MCUSR, r1
  store WDTCSR, 1 << WDCE | 1 << WDE
  sts WDTCSR, r1
  sbi DDRB, 5
  store UBRR0L, 3                     /* 500,000 baud */
  store UCSR0A, 1 << U2X0
  store UCSR0B, 1 << RXEN0 | 1 << TXEN0
  store TCCR1B, 1 << CS10
wait:
  ldi r24, 1 << SE                  /* idle */
  out SMCR, r24
  lds r24, UCSR0A
  sbrs r24, RXC0
  rjmp wait
  lds r24, UDR0
  cpi r24, '?'
  brne wait
  ldi r24, 0
  mov r6, r24
  mov r7, r24
  mov r8, r24
  ldi r30, lo8(name)
  ldi r31, hi8(name)
1:
  lpm r25, Z+
  tst r25
  breq 2f
  rcall send
  rjmp 1b
2:
  call end_line
#include "rows.inc"
  ldi r25, 'e'
  call send
  ldi r25, 'n'
  call send
  ldi r25, 'd'
  call send
  call end_line
  jmp wait
name:
  .asciz PROGRAM_NAME
  .balign 2
