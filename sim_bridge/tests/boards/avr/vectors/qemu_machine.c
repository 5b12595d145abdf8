/* qemu_machine.c: machine.h by QEMU's AVR (qemu-system-avr, Debian's qemu-system-misc), through its stub for gdb, which
 * talks over a pipe: "GDB Remote Serial Protocol", packets $...#checksum.
 *
 * QEMU counts no cycles; it has no GPIOR0 to 2, and WDR, BREAK and SLEEP stop it: such cases are left out for a witness. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "machine.h"

#define REGISTERS 39u     /* r0 to r31, SREG, SP (2 bytes), pc (4 bytes), as the stub has them */
#define DATA_AT 0x800000u /* data memory among the stub's addresses; flash is at 0 */
#define RAM 0x100u
#define PIECE 1024u /* bytes of memory; the stub's packets have 4096 characters */

static pid_t process;
static int to_stub, from_stub;
/* As it is to be, and as it is there. */
static uint8_t cells[DATA_SIZE], known_cells[DATA_SIZE], flash[FLASH_SIZE], known_flash[FLASH_SIZE];
static machine_state state;
static char packet[4096 + 8];

/* ---- packets ---- */

static char next_byte(void) {
  static char buffer[8192];
  static ssize_t have, at;
  if (at == have) {
    at = 0;
    have = read(from_stub, buffer, sizeof buffer);
    if (have <= 0) {
      fprintf(stderr, "QEMU has ended\n");
      exit(1);
    }
  }
  return buffer[at++];
}

/* The answer to a command is then in `packet`. */
static const char *ask(const char *command) {
  unsigned sum = 0;
  for (const char *at = command; *at; at++) sum += (unsigned char)*at;
  const int length = snprintf(packet, sizeof packet, "$%s#%02x", command, sum & 0xFF);
  if (write(to_stub, packet, (size_t)length) != length) exit(1);
  while (next_byte() != '$') {
  }
  size_t count = 0;
  for (char byte = next_byte(); byte != '#'; byte = next_byte()) packet[count++] = byte;
  packet[count] = 0;
  next_byte();
  next_byte();
  if (write(to_stub, "+", 1) != 1) exit(1);
  return packet;
}

static void must(const char *command) {
  if (strcmp(ask(command), "OK") == 0) return;
  fprintf(stderr, "QEMU answers %s to %.20s\n", packet, command);
  exit(1);
}

static char *add_bytes(char *text, const uint8_t *bytes, size_t count) {
  for (size_t i = 0; i < count; i++) text += sprintf(text, "%02x", bytes[i]);
  return text;
}

static unsigned digit(char hex) { return hex <= '9' ? (unsigned)(hex - '0') : (unsigned)(hex - 'a' + 10); }

static void take_bytes(const char *text, uint8_t *bytes, size_t count) {
  for (size_t i = 0; i < count; i++) bytes[i] = (uint8_t)(digit(text[2 * i]) << 4 | digit(text[2 * i + 1]));
}

static void write_memory(uint32_t address, const uint8_t *bytes, uint32_t count) {
  char command[2 * PIECE + 32];
  for (uint32_t done = 0; done < count; done += PIECE) {
    const uint32_t size = count - done < PIECE ? count - done : PIECE;
    add_bytes(command + sprintf(command, "M%x,%x:", address + done, size), bytes + done, size);
    must(command);
  }
}

/* Writes what has changed, in as few pieces as it takes without much between. */
static void write_changes(uint32_t at, const uint8_t *now, uint8_t *known, uint32_t count) {
  for (uint32_t first = 0; first < count; first++) {
    if (now[first] == known[first]) continue;
    uint32_t end = first + 1;
    for (uint32_t next = end; next < count && next < end + 64; next++) {
      if (now[next] != known[next]) end = next + 1;
    }
    write_memory(at + first, now + first, end - first);
    first = end;
  }
  memcpy(known, now, count);
}

/* ---- the machine ---- */

static void end_qemu(void) {
  kill(process, SIGKILL);
  waitpid(process, NULL, 0);
}

void machine_create(void) {
  int in[2], out[2];
  if (pipe(in) || pipe(out) || (process = fork()) < 0) exit(1);
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* it does not outlive this program */
    dup2(in[0], 0);
    dup2(out[1], 1);
    close(in[1]);
    close(out[0]);
    execlp("qemu-system-avr", "qemu-system-avr", "-M", "uno", "-S", "-gdb", "stdio", "-display", "none", "-serial",
           "null", "-monitor", "none", (char *)NULL);
    _exit(1);
  }
  close(in[0]);
  close(out[1]);
  atexit(end_qemu);
  to_stub = in[1];
  from_stub = out[0];
  ask("?");
  must("Z0,0,2"); /* breakpoint at the start */
}

uint8_t *machine_data(void) { return cells; }

void machine_write_flash(uint32_t address, uint16_t word) {
  flash[address] = (uint8_t)word;
  flash[address + 1] = (uint8_t)(word >> 8);
}

void machine_set(const machine_state *to) { state = *to; }

machine_state machine_get(void) { return state; }

static void hand_over(void) {
  uint8_t registers[REGISTERS];
  char command[2 * REGISTERS + 2] = "G";
  memcpy(registers, cells, 32);
  registers[32] = state.flags;
  memcpy(registers + 33, cells + SPL, 2);
  for (int i = 0; i < 4; i++) registers[35 + i] = (uint8_t)(state.pc >> 8 * i);
  add_bytes(command + 1, registers, REGISTERS);
  must(command);
  write_changes(DATA_AT + RAM, cells + RAM, known_cells + RAM, DATA_SIZE - RAM);
  write_changes(0, flash, known_flash, FLASH_SIZE);
}

static void take_back(void) {
  uint8_t registers[REGISTERS];
  char command[32];
  take_bytes(ask("g"), registers, REGISTERS);
  memcpy(cells, registers, 32);
  state.flags = registers[32];
  memcpy(cells + SPL, registers + 33, 2);
  state.pc = 0;
  for (int i = 0; i < 4; i++) state.pc |= (uint32_t)registers[35 + i] << 8 * i;
  for (uint32_t first = RAM; first < DATA_SIZE; first += PIECE) {
    sprintf(command, "m%x,%x", DATA_AT + first, PIECE);
    take_bytes(ask(command), cells + first, PIECE);
  }
  memcpy(known_cells, cells, DATA_SIZE);
}

bool machine_run(uint64_t until) {
  (void)until; /* one instruction */
  hand_over();
  ask("s");
  take_back();
  return true;
}

bool machine_go_round(void) {
  hand_over();
  ask("s"); /* from the breakpoint */
  ask("c");
  take_back();
  return state.pc == 0;
}
