/* machine.h: what the vectors need of an AVR core: its memories, one instruction, many instructions. Each core has a file
 * that offers this: simavr_machine.c the one that the vectors were recorded from, core_machine.c ours. */
#ifndef MACHINE_H
#define MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#define DATA_SIZE 0x900u /* r0 to r31, I/O registers, RAM of the ATmega328P */
#define FLASH_SIZE 0x8000u
#define SPL 0x5Du
#define SPH 0x5Eu
#define SREG 0x5Fu

typedef struct {
  uint32_t pc; /* byte address in flash */
  uint64_t cycle;
  uint8_t flags; /* SREG; data[SREG] is no part of the machine's data */
} machine_state;

void machine_create(void);
uint8_t *machine_data(void); /* may be changed at any time between two instructions */
void machine_write_flash(uint32_t address, uint16_t word);
void machine_set(const machine_state *state);
machine_state machine_get(void);
/* Executes instructions, one at least, until cycle `until`. False: one of them is no instruction of this chip. */
bool machine_run(uint64_t until);
/* Executes instructions, one at least, until the next one is at address 0. */
bool machine_go_round(void);

#endif
