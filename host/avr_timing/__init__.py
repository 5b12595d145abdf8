"""Worst-case timing of machine code for the ATmega328P: of any image, built by any compiler.

Four rooms, each of which knows only those before it:

* `image`: the ELF file, its symbols and source lines, and the instructions;
* `flow`: functions as graphs, where jumps lead, which values registers hold, loops and the longest walk through them;
* `bounds`: worst-case execution time of a function, where its cycles go, and the depth of the stack;
* `interrupts`: stretches without interrupts, latencies, and response times of work that interrupts come on top of.

`program` has the types that they share. Errors are `errors.AnalysisError`. Nothing in here runs an image.
"""
