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

static void skip(uint8_t count) {
  while (count-- > 0) (void)receive();
}

/* The end of a command. */
static void agree(void) {
  if (receive() != END_OF_PACKET) {
    for (;;) { /* out of step: the watchdog ends this, and the program starts */
    }
  }
  send(IN_SYNC);
}

static void write_page(uint16_t address) {
  (void)receive();
  const uint8_t size = receive();
  (void)receive(); /* the kind of memory: flash */
  for (uint8_t i = 0; i < size; i++) page[i] = receive();
  boot_page_erase(address);
  boot_spm_busy_wait();
  for (uint8_t i = 0; i < size; i += 2) boot_page_fill(address + i, (uint16_t)(page[i] | page[i + 1] << 8));
  boot_page_write(address);
  boot_spm_busy_wait();
  boot_rww_enable();
  agree();
}

static void read_page(uint16_t address) {
  (void)receive();
  uint8_t size = receive();
  (void)receive();
  agree();
  while (size-- > 0) send(pgm_read_byte(address++));
}

static void serve(void) {
  uint16_t address = 0;
  for (;;) {
    switch (receive()) {
      case GET_PARAMETER:
        skip(1);
        agree();
        send(3);
        break;
      case SET_DEVICE:
        skip(20);
        agree();
        break;
      case SET_DEVICE_MORE:
        skip(5);
        agree();
        break;
      case LOAD_ADDRESS: /* in words */
        address = receive();
        address = (uint16_t)((address | (uint16_t)receive() << 8) * 2u);
        agree();
        break;
      case UNIVERSAL:
        skip(4);
        agree();
        send(0);
        break;
      case PROGRAM_PAGE:
        write_page(address);
        break;
      case READ_PAGE:
        read_page(address);
        break;
      case READ_SIGNATURE:
        agree();
        send((uint8_t)(SIGNATURE >> 16));
        send((uint8_t)(SIGNATURE >> 8));
        send((uint8_t)SIGNATURE);
        break;
      case LEAVE:
        wdt_enable(WDTO_15MS);
        agree();
        break;
      default:
        agree();
        break;
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
