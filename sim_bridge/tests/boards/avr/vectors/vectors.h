/* vectors.h: the parts of the program that prints the vectors (vectors.c). */
#ifndef VECTORS_H
#define VECTORS_H

#include "machine.h"

void print_cases(void);
/* The lines behind the checksum that is the `chunk`th of an instruction. */
void print_chunk(const char *name, int chunk);
void print_programs(void);
void print_program(uint64_t seed, uint32_t stops);

#endif
