/* avr_chip.h: facts of the ATmega328P: its memories, interrupt vectors and I/O registers. Section numbers, here and in the
 * files beside the core, are those of the ATmega48A/PA/88A/PA/168A/PA/328/P data sheet.
 */
#ifndef AVR_CHIP_H
#define AVR_CHIP_H

/* Memories (8.2 to 8.4), in bytes. */
#define AVR_FLASH_SIZE 0x8000u
#define AVR_DATA_SIZE 0x0900u /* registers, I/O registers, RAM */
#define AVR_IO_BEGIN 0x20u
#define AVR_RAM_BEGIN 0x100u
#define AVR_PAGE_SIZE 128u     /* of flash, as self-programming writes it (27.8.14) */
#define AVR_NRWW_BEGIN 0x7000u /* from here on flash can be read while it is written below (27.4) */

/* The high fuse byte (28.2): where the boot section begins, in which alone SPM works (BOOTSZ, table 27-13), and whether a
 * reset leads there (BOOTRST is 0). */
#define AVR_BOOT_BEGIN(high_fuse) (AVR_FLASH_SIZE - (0x1000u >> ((high_fuse) >> 1 & 3u)))
#define AVR_RESET_BEGIN(high_fuse) ((high_fuse) % 2u ? 0u : AVR_BOOT_BEGIN(high_fuse))

/* Interrupt vectors (12.4). */
enum {
  VECTOR_INT0 = 1,
  VECTOR_INT1,
  VECTOR_PCINT0,
  VECTOR_PCINT1,
  VECTOR_PCINT2,
  VECTOR_WDT,
  VECTOR_TIMER2_COMPA,
  VECTOR_TIMER2_COMPB,
  VECTOR_TIMER2_OVF,
  VECTOR_TIMER1_CAPT,
  VECTOR_TIMER1_COMPA,
  VECTOR_TIMER1_COMPB,
  VECTOR_TIMER1_OVF,
  VECTOR_TIMER0_COMPA,
  VECTOR_TIMER0_COMPB,
  VECTOR_TIMER0_OVF,
  VECTOR_SPI,
  VECTOR_USART_RX,
  VECTOR_USART_UDRE,
  VECTOR_USART_TX,
  VECTOR_ADC,
  VECTOR_EE_READY,
  VECTOR_ANALOG_COMP,
  VECTOR_TWI,
  VECTOR_SPM_READY,
  VECTOR_COUNT
};

/* I/O registers, by their address in the data space (36). */
enum {
  REG_PINB = 0x23,
  REG_PINC = 0x26,
  REG_PIND = 0x29,
  REG_TIFR0 = 0x35,
  REG_TIFR1 = 0x36,
  REG_TIFR2 = 0x37,
  REG_PCIFR = 0x3B,
  REG_EIFR = 0x3C,
  REG_EIMSK = 0x3D,
  REG_EECR = 0x3F,
  REG_EEDR = 0x40,
  REG_EEARL = 0x41,
  REG_EEARH = 0x42,
  REG_GTCCR = 0x43,
  REG_SPCR = 0x4C,
  REG_SPSR = 0x4D,
  REG_SPDR = 0x4E,
  REG_SMCR = 0x53,
  REG_MCUSR = 0x54,
  REG_MCUCR = 0x55,
  REG_SPMCSR = 0x57,
  REG_SPL = 0x5D,
  REG_SPH = 0x5E,
  REG_SREG = 0x5F,
  REG_WDTCSR = 0x60,
  REG_PCICR = 0x68,
  REG_EICRA = 0x69,
  REG_PCMSK0 = 0x6B,
  REG_TIMSK0 = 0x6E,
  REG_ADCL = 0x78,
  REG_ADCH = 0x79,
  REG_ADCSRA = 0x7A,
  REG_ADCSRB = 0x7B,
  REG_ADMUX = 0x7C,
  REG_TWBR = 0xB8,
  REG_TWSR = 0xB9,
  REG_TWAR = 0xBA,
  REG_TWDR = 0xBB,
  REG_TWCR = 0xBC,
  REG_UCSR0A = 0xC0,
  REG_UCSR0B = 0xC1,
  REG_UCSR0C = 0xC2,
  REG_UBRR0L = 0xC4,
  REG_UBRR0H = 0xC5,
  REG_UDR0 = 0xC6,
};

#endif
