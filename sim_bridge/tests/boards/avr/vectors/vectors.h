/* vectors.h: the parts of the program that prints the vectors (vectors.c). */
#ifndef VECTORS_H
#define VECTORS_H

#include "machine.h"

void print_cases(void);
/* The lines behind the checksum that is the `chunk`th of an instruction. */
void print_chunk(const char *name, int chunk);
void print_programs(void);
void print_program(uint64_t seed, uint32_t stops);

/* For a machine that has neither cycles nor GPIOR0 to 2 (qemu_machine.c): without them. */
extern bool for_witness;
void print_witness_cases(void);
void print_witness_program(uint64_t seed, uint32_t rounds);

#endif
