/* bootloader.c: a bootloader for the emulated Uno that treats the program as Optiboot does (Optiboot 4.4, as on the Uno):
 * it takes MCUSR and leaves it empty, uses RAM from 0x100 on and the stack, starts the program at once after a reset of
 * any kind but an external one, and after that one writes the program that avrdude sends (Atmel, application note AVR061,
 * "STK500 Communication Protocol"; 115200 baud), for one second after the last byte.
 */
#include <avr/boot.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>

#ifndef SIGNATURE
#define SIGNATURE (SIGNATURE_0 * 0x10000ul + SIGNATURE_1 * 0x100u + SIGNATURE_2)
#endif

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

/* Bytes between a command and its end, without a page; in flash, as nothing fills RAM here. */
static const uint8_t ARGUMENTS[0x100] PROGMEM = {
    [GET_PARAMETER] = 1,
    [LOAD_ADDRESS] = 2,
    [PROGRAM_PAGE] = 3, /* size, high byte first, and the kind of memory: flash */
    [READ_PAGE] = 3,
    [UNIVERSAL] = 4,
    [SET_DEVICE_MORE] = 5,
    [SET_DEVICE] = 20,
};

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

static void write_page(uint16_t address, uint8_t size) {
  boot_page_erase(address);
  boot_spm_busy_wait();
  for (uint8_t i = 0; i < size; i += 2) boot_page_fill(address + i, (uint16_t)(page[i] | page[i + 1] << 8));
  boot_page_write(address);
  boot_spm_busy_wait();
  boot_rww_enable();
}

/* By itself, as start() has no place on the stack for what it keeps. */
static __attribute__((noinline)) void serve(void) {
  uint16_t address = 0;
  uint8_t given[20]; /* with a command */
  for (;;) {
    const uint8_t command = receive();
    for (uint8_t i = 0; i < pgm_read_byte(&ARGUMENTS[command]); i++) given[i] = receive();
    if (command == PROGRAM_PAGE) {
      for (uint8_t i = 0; i < given[1]; i++) page[i] = receive();
    }
    agree();
    if (command == GET_PARAMETER) send(3);
    if (command == UNIVERSAL) send(0);
    if (command == LOAD_ADDRESS) address = (uint16_t)((given[0] | (uint16_t)given[1] << 8) * 2u); /* in words */
    if (command == PROGRAM_PAGE) write_page(address, given[1]);
    if (command == READ_PAGE) {
      while (given[1]-- > 0) send(pgm_read_byte(address++));
    }
    if (command == READ_SIGNATURE) {
      send((uint8_t)(SIGNATURE >> 16));
      send((uint8_t)(SIGNATURE >> 8));
      send((uint8_t)SIGNATURE);
    }
    if (command == LEAVE) wdt_enable(WDTO_15MS);
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
