/* bounds.h: the most passes of a loop, for the loops in whose code the analysis of the image cannot see it.
 *
 *   LOOP_BOUND(passes);     in a loop's body: the most passes each time that the loop is entered
 *   LOOP_CYCLES(cycles);    in the body of a loop that waits for a time: it takes at most these cycles, and then the pass
 *                           that is under way; interrupts come on top. In one that sleeps the time asleep is among them
 *
 * On the AVR each is a row of the section .boebot.loops, which is not loaded: three little-endian words of 32 bits, the
 * address in the body, passes, cycles; all ones: not said. Elsewhere they are nothing. `boebot timing` holds what the
 * emulator measures against what follows from them. */
#ifndef BOUNDS_H
#define BOUNDS_H

#include <stdint.h>

#if defined(__AVR__) && !defined(__cppcheck__)
/* The code refers to its row, so that the linker, which drops what nobody refers to, keeps it. */
#define LOOP_ROW(passes, cycles)                                 \
  __asm__ volatile(                                              \
      ".Lloop%=:                                             \n" \
      ".reloc .Lloop%=, R_AVR_NONE, .Lrow%=                  \n" \
      ".pushsection .boebot.loops, \"\", @progbits           \n" \
      ".Lrow%=: .long .Lloop%=, %0, %1                       \n" \
      ".popsection                                           \n" \
      :                                                          \
      : "n"((uint32_t)(passes)), "n"((uint32_t)(cycles)))
#define LOOP_BOUND(passes) LOOP_ROW(passes, 0xFFFFFFFFul)
#define LOOP_CYCLES(cycles) LOOP_ROW(0xFFFFFFFFul, cycles)
#else
#define LOOP_BOUND(passes) ((void)0)
#define LOOP_CYCLES(cycles) ((void)0)
#endif

#endif
