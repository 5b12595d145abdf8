/* bounds.h: how often a loop runs at most, said where the loop stands. The static analysis of the image reads it, and the
 * builds for a PC check it while they run.
 *
 *   BOUNDED(most, for (uint8_t i = 0; i < n; i++)) { ... }      at most `most` passes of the body each time that the loop
 *                                                               is entered; `for` and `while` alike
 *   BOUNDED_TIME(cycles, while (is_busy())) { ... }             waits for a time: the loop takes at most so many cycles
 *                                                               (interrupts come on top), and the pass then under way
 *   "1: ... \n" BOUNDED_ASM("%[most]") "... brne 1b \n"         in the body of a loop in assembly; the argument is a number
 *                                                               or an operand [most] "n"(...)
 *
 * On the AVR a bound is a row of the section .boebot.loops, which is not loaded: in the images as they are built it takes no
 * flash, no RAM and no time (but for the one instruction that a loop with an empty body could otherwise have skipped).
 * A row is three little-endian words of 32 bits: byte address in the loop's body, passes, cycles; all ones: not said.
 * What the compiler copies (a loop unrolled or inlined) has a row for each copy. Each row is a group of its own and the
 * code refers to it, so that the linker keeps the rows of what it keeps and drops the others.
 *
 * Optimised for speed, or by a compiler newer than the kit's (GCC 7), one loop may become two, one within the other, or be
 * unrolled. Then a `nop` in front of the loop and one in its body stand where it is entered and where its row is, and
 * nowhere else, and the section .boebot.entries tells of both: byte address, line of the source.
 *
 * Elsewhere the passes of each entry are counted; one too many ends the run with file, line and bound. BOUNDS_UNCHECKED
 * leaves that out, for code that is used outside the firmware. */
#ifndef BOUNDS_H
#define BOUNDS_H

#include <stdint.h>

#ifdef __cppcheck__ /* takes the loops to be what they are without bounds */

#define BOUNDED(most, loop) loop
#define BOUNDED_TIME(cycles, loop) loop
#define BOUNDED_ASM(most) ""

#elif defined(__AVR__)

/* Once, where the whole program is one text for the assembler. A line of 0: the loop's entries are not told. */
__asm__(
    ".ifndef .Lboebot_macro                                               \n"
    ".set .Lboebot_macro, 1                                               \n"
    ".macro boebot_loop passes, cycles, line                              \n"
    ".Lboebot_loop\\@:                                                    \n"
    ".reloc .Lboebot_loop\\@, R_AVR_NONE, .Lboebot_row\\@                 \n"
    ".pushsection .boebot.loops, \"G\", @progbits, .Lboebot_group\\@      \n"
    ".Lboebot_row\\@:                                                     \n"
    ".long .Lboebot_loop\\@, \\passes, \\cycles                           \n"
    ".popsection                                                          \n"
    ".if \\line                                                           \n"
    "boebot_entry \\line                                                  \n"
    ".endif                                                               \n"
    ".endm                                                                \n"
    ".macro boebot_entry line                                             \n"
    ".Lboebot_place\\@:                                                   \n"
    ".reloc .Lboebot_place\\@, R_AVR_NONE, .Lboebot_entry\\@              \n"
    ".pushsection .boebot.entries, \"G\", @progbits, .Lboebot_entries\\@  \n"
    ".Lboebot_entry\\@:                                                   \n"
    ".long .Lboebot_place\\@, \\line                                      \n"
    ".popsection                                                          \n"
    "nop                                                                  \n"
    ".endm                                                                \n"
    ".endif                                                               \n");

#define BOUNDED_ASM(most) "boebot_loop " most ", 0xFFFFFFFF, 0 \n"

/* An expression, for its place; its value is 0. */
#define BOUNDED_TOLD(text, ...)                     \
  ({                                                \
    __asm__ volatile("boebot_" text ::__VA_ARGS__); \
    0;                                              \
  })

/* In the body and in front of what the user writes there, so that `break` and `continue` stay his. */
#if defined(__OPTIMIZE_SIZE__) && __GNUC__ <= 7
#define BOUNDED_BY(loop, row, number)                                   \
  loop if (BOUNDED_TOLD("loop " row ", 0", "n"((uint32_t)(number)))) {} \
  else
#else
#define BOUNDED_BY(loop, row, number)                                                     \
  if (BOUNDED_TOLD("entry %0", "n"(__LINE__))) {                                          \
  } else                                                                                  \
    loop if (BOUNDED_TOLD("loop " row ", %1", "n"((uint32_t)(number)), "n"(__LINE__))) {} \
  else
#endif
#define BOUNDED(most, loop) BOUNDED_BY(loop, "%0, 0xFFFFFFFF", most)
#define BOUNDED_TIME(cycles, loop) BOUNDED_BY(loop, "0xFFFFFFFF, %0", cycles)

#elif defined(BOUNDS_UNCHECKED)

#define BOUNDED(most, loop)      \
  loop if (((void)(most), 0)) {} \
  else
#define BOUNDED_TIME(cycles, loop) loop

#else

#ifdef __cplusplus
extern "C" {
#endif

/* A loop has run more than `most` times: ends the run. In a native machine its owner gets the sentence (machine.h). */
#ifdef __GNUC__
__attribute__((noreturn))
#endif
void bounds_broken(const char *file, int line, uint32_t most);

#ifdef __cplusplus
}
#endif

#define BOUNDED(most, loop) BOUNDED_AT(most, loop, __LINE__)
#define BOUNDED_AT(most, loop, line) BOUNDED_COUNTED(most, loop, BOUNDED_NAME(line))
#define BOUNDED_NAME(line) bounds_passes_##line
#define BOUNDED_COUNTED(most, loop, passes)                                                    \
  for (uint32_t passes = 0; passes != UINT32_MAX; passes = UINT32_MAX)                         \
    loop if (++passes > (uint32_t)(most)) bounds_broken(__FILE__, __LINE__, (uint32_t)(most)); \
  else
#define BOUNDED_TIME(cycles, loop) loop

#endif

#endif
