/* bootloader.c: the boot loader of an Uno, for the last 512 bytes of the ATmega328P's flash, where a reset begins (fuses
 * BOOTRST and BOOTSZ 11; data sheet 27.6). After an external reset, and after no other, it writes the program that
 * avrdude sends (Atmel, application note AVR061, "STK500 Communication Protocol"; 115200 baud), for one second after the
 * last byte; then, or at once, the program begins.
 *
 * It treats the program as Optiboot 4.4 does, which an Uno comes with: it takes MCUSR and leaves it empty, and uses RAM
 * from 0x100 on and the stack. It does not write into its section, as the Uno's lock bits have it.
 */
#include <avr/boot.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>

#ifndef SIGNATURE
#define SIGNATURE (SIGNATURE_0 * 0x10000ul + SIGNATURE_1 * 0x100u + SIGNATURE_2)
#endif

#define BEGIN 0x7E00u /* of the boot section, and of this; platformio.ini says so to the linker */

enum { IN_SYNC = 0x14, OK = 0x10, END_OF_PACKET = 0x20 };
enum {
  GET_PARAMETER = 0x41,
  SET_DEVICE = 0x42,
  SET_DEVICE_MORE = 0x45,
  LEAVE = 0x51,
  LOAD_ADDRESS = 0x55,
  UNIVERSAL = 0x56,
  PROGRAM_PAGE = 0x64,
  READ_PAGE = 0x74,
  READ_SIGNATURE = 0x75
};

#define VERSION 4 /* of this; avrdude shows it, and asks for nothing by it */

static uint8_t *const page = (uint8_t *)0x100;

static void send(uint8_t byte) {
  while (!(UCSR0A & _BV(UDRE0))) {
  }
  UDR0 = byte;
}

static uint8_t receive(void) {
  while (!(UCSR0A & _BV(RXC0))) {
  }
  if (!(UCSR0A & _BV(FE0))) { /* somebody at another rate speaks to the program: the watchdog shall start it */
    wdt_reset();
  }
  return UDR0;
}

/* The end of a command. */
static void agree(void) {
  if (receive() != END_OF_PACKET) {
    for (;;) { /* out of step: the watchdog ends this, and the program starts */
    }
  }
  send(IN_SYNC);
}

/* The end of a command behind that many bytes that nothing depends on. */
static void skip(uint8_t count) {
  while (count--) receive();
  agree();
}

static void write_page(uint16_t address) {
  boot_page_erase(address);
  boot_spm_busy_wait();
  for (uint8_t i = 0; i < SPM_PAGESIZE / 2; i++) {
    boot_page_fill(address + 2u * i, ((const uint16_t *)page)[i]); /* low byte first, as the page has them, too */
  }
  boot_page_write(address);
  boot_spm_busy_wait();
  boot_rww_enable();
}

/* By itself, as start() has no place on the stack for what it keeps. */
static __attribute__((noinline, noreturn)) void serve(void) {
  uint16_t address = 0; /* in bytes */
  for (;;) {
    const uint8_t command = receive();
    if (command == GET_PARAMETER) {
      skip(1);
      send(VERSION);
    } else if (command == SET_DEVICE) {
      skip(20);
    } else if (command == SET_DEVICE_MORE) {
      skip(5);
    } else if (command == UNIVERSAL) {
      skip(4);
      send(0);
    } else if (command == LOAD_ADDRESS) { /* in words, low byte first */
      const uint8_t low = receive();
      address = (uint16_t)((low | (uint16_t)receive() << 8) * 2u);
      agree();
    } else if (command == PROGRAM_PAGE || command == READ_PAGE) {
      receive(); /* size, high byte first; a page has 128 bytes */
      const uint8_t size = receive();
      receive(); /* the kind of memory: flash */
      if (command == PROGRAM_PAGE) {
        for (uint8_t i = 0; i < size; i++) page[i] = receive();
        agree();
        if (address < BEGIN) write_page(address);
      } else {
        agree();
        for (uint8_t i = size; i; i--) send(pgm_read_byte(address++));
      }
    } else if (command == READ_SIGNATURE) {
      agree();
      send((uint8_t)(SIGNATURE >> 16));
      send((uint8_t)(SIGNATURE >> 8));
      send((uint8_t)SIGNATURE);
    } else {
      if (command == LEAVE) wdt_enable(WDTO_15MS);
      agree();
    }
    send(OK);
  }
}

void start(void) __attribute__((naked, section(".vectors")));
void start(void) {
  __asm__ volatile("clr __zero_reg__");
  SP = RAMEND;
  const uint8_t cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  if (cause & _BV(EXTRF)) {
    UCSR0A = _BV(U2X0);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    UBRR0L = 16;
    wdt_enable(WDTO_1S);
    serve();
  }
  __asm__ volatile("jmp 0");
}
