"""Worst-case timing of machine code for the ATmega328P: of any image, built by any compiler.

Three rooms, each of which knows only those before it:

* `flow`: the instructions, functions as graphs, where jumps lead, which values registers hold, loops and the longest
  walk through them;
* `bounds`: worst-case execution time of a function, where its cycles go, and the depth of the stack;
* `interrupts`: stretches without interrupts, latencies, and response times of work that interrupts come on top of.

`program` has the types that they share. `boebot.image` reads the file. Errors are `boebot.errors.AnalysisError`.
Nothing in here runs an image.
"""
