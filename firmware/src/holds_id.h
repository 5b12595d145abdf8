/* holds_id.h: tells the static analysis of the image where a register holds the id of the message that is being worked off,
 * so that it can tell what each message costs.
 *
 *   HOLDS_ID(id)      `id` is a variable of 8 bits that has just got it
 *
 * On the AVR each place is a row of the section .boebot.ids, which is not loaded, as those of bounds.h: two little-endian
 * words of 32 bits, the byte address behind the instruction that brought the id and the register's number. Elsewhere it is
 * nothing. */
#ifndef HOLDS_ID_H
#define HOLDS_ID_H

#if defined(__AVR__) && !defined(__cppcheck__)

/* Once, where the whole program is one text for the assembler. Of a register it knows the name only. */
__asm__(
    ".ifndef .Lboebot_id_macro                                            \n"
    ".set .Lboebot_id_macro, 1                                            \n"
    ".macro boebot_id register                                            \n"
    ".Lboebot_id\\@:                                                      \n"
    ".reloc .Lboebot_id\\@, R_AVR_NONE, .Lboebot_id_row\\@               \n"
    ".pushsection .boebot.ids, \"G\", @progbits, .Lboebot_id_group\\@     \n"
    ".Lboebot_id_row\\@:                                                  \n"
    ".long .Lboebot_id\\@                                                 \n"
    ".irp number, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, "
    "27, "
    "28, 29, 30, 31                                                       \n"
    ".ifc \\register, r\\number                                           \n"
    ".long \\number                                                       \n"
    ".endif                                                               \n"
    ".endr                                                                \n"
    ".popsection                                                          \n"
    ".endm                                                                \n"
    ".endif                                                               \n");

/* The compiler takes it to be changed there, so that it uses no other copy. */
#define HOLDS_ID(id) __asm__("boebot_id %0" : "+r"(id))

#else

#define HOLDS_ID(id) ((void)0)

#endif

#endif
