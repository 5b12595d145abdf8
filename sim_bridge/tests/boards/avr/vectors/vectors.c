/* vectors.c: prints what a machine does (machine.h), to be compared with what another one did.
 *
 *   vectors                 all: single instructions (cases.c), random programs (programs.c)
 *   vectors NAME NUMBER     the cases behind one checksum of an instruction, counted from 0
 *   vectors program SEED STOPS    one random program, of any seed
 *   vectors witness               single instructions, for a machine without cycles (qemu_machine.c)
 *   vectors witness SEED ROUNDS   one random program for such a machine */
#include "vectors.h"

#include <stdlib.h>
#include <string.h>

int main(int count, char **arguments) {
  machine_create();
  if (count == 1) {
    print_cases();
    print_programs();
  } else if (count == 4 && !strcmp(arguments[1], "program")) {
    print_program(strtoull(arguments[2], NULL, 10), (uint32_t)atoi(arguments[3]));
  } else if (count == 4 && !strcmp(arguments[1], "witness")) {
    print_witness_program(strtoull(arguments[2], NULL, 10), (uint32_t)atoi(arguments[3]));
  } else if (count == 2 && !strcmp(arguments[1], "witness")) {
    print_witness_cases();
  } else if (count == 3) {
    print_chunk(arguments[1], atoi(arguments[2]));
  } else {
    return 2;
  }
  return 0;
}
