"""How long a received byte waits where several interrupts take bytes: counted by hand, against a machine that runs
small programs cycle by cycle, and with a place where bytes are taken left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_latency import Machine

from avr_image import assembled, compiled
from avr_timing.bounds.wcet import WorstCase
from avr_timing.interrupts.byte_reads import DATA, LOAD, RECEIVE, STATUS, ByteReads
from avr_timing.interrupts.interrupts_off import ENTRY, InterruptsOff
from avr_timing.interrupts.latency import HORIZON, Latencies
from avr_timing.interrupts.response import Source
from avr_timing.interrupts.steps import Steps
from avr_timing.program import Instruction, Program

VECTORS = "\n.global __vector_1\n.global __vector_2\n.global __vector_18\n.global __vector_19\n"
LOOK = f" lds r3, {STATUS}\n sbrc r3, 7\n rcall take\n"
NO_LOOK = " nop\n nop\n"
TAKE = f"take: lds r3, {DATA}\n nop\n ret\n"
OWN = f"__vector_18: lds r3, {DATA}\n reti\n"
PCINT1 = 4  # vector (data sheet, table 12-6)
JUMP, RETI = 3, 4  # of a vector, where the linker does not relax; and of a return from an interrupt
OWN_REST = LOAD + RETI  # of the receive interrupt, when the byte comes as it reads the one before
READ = ENTRY + JUMP + LOAD  # from the receive interrupt's acceptance to the end of its load
TAKES = LOAD + 1 + 3 + LOAD + 1 + 4  # a look that finds a byte
NOP = " nop\n"
ONCE = 1 << 20
BYTE = 320


def taken(program: Program, vector: int) -> ByteReads:
    return ByteReads(WorstCase(program), 4 * vector)


def wait(program: Program, intervals: Sequence[int], byte: int = BYTE) -> int:
    """Of a byte; the interrupts 1, 2 ... come so far apart, 19 once."""
    requests = {n: [Source("i", 1, each)] for n, each in enumerate(intervals, 1)}
    requests |= {RECEIVE: [Source("bytes", 1, byte)], RECEIVE + 1: [Source("i", 1, ONCE)]}
    return Latencies(InterruptsOff(program)).of(RECEIVE, requests)


# ---- in C --------------------------------------------------------------------------------------------------------

IN_C = """
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>
volatile uint8_t ring[128], head, tail;
static inline void take(void) {{
  const uint8_t byte = UDR0, at = head;
  ring[at] = byte;
  if ((uint8_t)(at + 1u) % 128u == tail) {{
    UCSR0B = (uint8_t)(UCSR0B & (uint8_t)~_BV(RXCIE0));
  }} else {{
    head = (uint8_t)(at + 1u) % 128u;
  }}
}}
ISR(USART_RX_vect) {{ take(); }}
ISR(PCINT1_vect) {{ PORTB ^= 1; {look} }}
int main(void) {{ sei(); for (;;) {{ PORTB ^= 2; }} }}
"""
LOOKS = {
    "bit": "if ((UCSR0A & _BV(RXC0)) != 0 && (UCSR0B & _BV(RXCIE0)) != 0) { take(); }",
    "sign": "if ((int8_t)UCSR0A < 0 && (int8_t)UCSR0B < 0) { take(); }",
    "switch first": "if (bit_is_set(UCSR0B, RXCIE0)) { if (bit_is_clear(UCSR0A, RXC0)) { return; } take(); }",
    "unasked": "if ((UCSR0A & _BV(RXC0)) != 0) { take(); }",
}


@pytest.mark.parametrize("look", LOOKS)
def test_look_in_c(tmp_path: Path, look: str) -> None:
    """Of a byte that waits it takes one, in the same time whatever it is written like; and only one of these does so
    while the receive interrupt is off."""
    found = taken(compiled(tmp_path, IN_C.format(look=LOOKS[look]), "-flto"), PCINT1)
    assert found.takes and found.heeds_switch == (look != "unasked")
    if look != "switch first":  # else the receive interrupt may be off
        assert found.run(0) is None, "it must take it"
    run, until = found.run(1), found.until(0)
    assert run is not None and until is not None and until + 30 < run < until + 80


# ---- by hand -------------------------------------------------------------------------------------------------------


def test_times_of_a_run(tmp_path: Path) -> None:
    body = f"{NOP * 5}{LOOK}{NOP * 20}{LOOK}{NOP * 7}"
    program = assembled(tmp_path, f"{VECTORS}main: rjmp main\n__vector_1: {body} reti\n{OWN}{TAKE}")
    one = taken(program, 1)
    to_load = LOAD + 1 + 3 + LOAD  # from a look's beginning to the end of its load
    first = ENTRY + JUMP + 5
    assert one.takes
    assert (one.run(0), one.run(1)) == (None, None)  # while bytes wait, it takes two
    assert one.run(2) == one.run(9) == first + TAKES + 20 + TAKES + 7 + RETI
    assert one.until(0) == first + to_load
    assert one.until(1) == first + TAKES + 20 + to_load
    assert one.until(2) is None
    assert one.rest(0) == max(LOAD + 2 + 7 + RETI, LOAD + 1 + 4 + 7 + RETI)  # the second look found none, or the last
    assert one.rest(1) == max(LOAD + 2, LOAD + 1 + 4) + 20 + TAKES + 7 + RETI
    assert one.next(0) == max(LOAD + 2, LOAD + 1 + 4) + 20 + to_load
    nothing = LOAD + 2
    assert one.charged(0) == first + TAKES + 20 + TAKES + 7 + RETI
    assert one.charged(100) == first + nothing + 20 + nothing + 7 + RETI  # a byte is paid for elsewhere


def test_loop_that_looks_until_a_time(tmp_path: Path) -> None:
    """Each pass takes a byte, if any waits: with few taken there are few passes, whatever time the loop may take."""
    row = '.pushsection .boebot.loops, ""\n .long 1b, 0xFFFFFFFF, 500\n .popsection\n'
    body = f" 1: {LOOK} sbis 5, 0\n rjmp 1b\n{row}"
    program = assembled(tmp_path, f"{VECTORS}main: rjmp main\n__vector_1: {body} reti\n{OWN}{TAKE}")
    one, check = taken(program, 1), 2  # sbis that skips one word
    assert one.run(0) is None
    assert [one.run(n) for n in (1, 2, 3)] == [
        ENTRY + JUMP + n * TAKES + (n - 1) * (1 + 2) + check + RETI for n in (1, 2, 3)
    ]
    assert one.charged(1000) == ENTRY + WorstCase(program).bound(4).cycles  # who takes in a loop is charged whole


def test_only_a_test_of_rxc_goes_one_way(tmp_path: Path) -> None:
    for look, runs in (
        (f" lds r3, {STATUS}\n sbrc r3, 7\n rjmp 1f\n nop\n 1:", 2 + 1 + 2),
        (f" lds r3, {STATUS}\n sbrs r3, 7\n nop\n nop\n 1:", 2 + 2 + 1),
        (f" lds r3, {STATUS}\n sbrs r3, 3\n nop\n nop\n 1:", 2 + 1 + 2),  # another bit
        (f" lds r3, {STATUS}\n clr r3\n sbrs r3, 7\n nop\n nop\n 1:", 2 + 1 + 1 + 2),  # another value
        (" lds r3, 256\n sbrs r3, 7\n nop\n nop\n 1:", 2 + 1 + 2),  # another register
    ):
        program = assembled(tmp_path, f"{VECTORS}main: rjmp main\n__vector_1: {look} reti\n{OWN}")
        assert taken(program, 1).run(0) == ENTRY + JUMP + runs + RETI, look


def test_who_takes_no_bytes_keeps_them_waiting_as_others(tmp_path: Path) -> None:
    source = f"{VECTORS}main: rjmp main\n__vector_1: {NOP * 50} reti\n{OWN}__vector_19: {NOP * 20} reti\n"
    lower, higher, step = ENTRY + JUMP + 20 + RETI, ENTRY + JUMP + 50 + RETI, 2
    # What is lower has begun; a step, the one of higher priority, a step.
    assert wait(assembled(tmp_path, source), [ONCE]) == lower + step + higher + step


def test_who_takes_a_byte_at_its_end_ends_the_wait(tmp_path: Path) -> None:
    source = f"{VECTORS}main: rjmp main\n__vector_1: {NOP * 50}{LOOK} reti\n{OWN}{TAKE}"
    to_load = ENTRY + JUMP + 50 + LOAD + 1 + 3 + LOAD
    program = assembled(tmp_path, source)
    assert wait(program, [ONCE]) == OWN_REST + Steps(InterruptsOff(program)).most(1) + to_load - READ


def test_bytes_that_queue_wait_for_those_before_them(tmp_path: Path) -> None:
    """None is taken in 911 cycles; then one in each 15, with its step."""
    program = assembled(tmp_path, f"{VECTORS}main: rjmp main\n__vector_1: {NOP * 900} reti\n{OWN}")
    own, whole, step = READ + RETI, ENTRY + JUMP + 900 + RETI, 2
    assert wait(program, [ONCE], whole) == OWN_REST + whole + 2 * step
    # The first one waits longest where they come slower than they are taken, and for ever where they do not.
    assert wait(program, [ONCE], 150) == OWN_REST + whole + 2 * step
    assert wait(program, [ONCE], own) == HORIZON


@pytest.mark.parametrize("left_out", ["first", "second"])
def test_a_place_left_out_raises_the_bound(tmp_path: Path, left_out: str) -> None:
    looks = {"first": LOOK, "second": LOOK}
    source = "{}main: rjmp main\n__vector_1: {}{}{}{} reti\n{}{}"

    def bound() -> int:
        text = source.format(VECTORS, NOP * 60, looks["first"], NOP * 60, looks["second"], OWN, TAKE)
        return wait(assembled(tmp_path, text), [150])

    before = bound()
    looks[left_out] = NO_LOOK
    assert bound() > before


# ---- a machine -----------------------------------------------------------------------------------------------------


@dataclass
class Receiver(Machine):
    """With a UART whose receiver never overflows, to which bytes come at given times."""

    arrivals: list[int] = field(default_factory=list)
    registers: dict[int, int] = field(default_factory=dict)
    byte_waited: int = 0

    def _due(self) -> int | None:
        others = super()._due()
        waits = bool(self.arrivals) and self.arrivals[0] <= self.now
        return others if not waits or (others is not None and others < RECEIVE) else RECEIVE

    def _accept(self, vector: int) -> None:
        self.requests.setdefault(vector, [self.now])
        super()._accept(vector)
        if vector == RECEIVE:
            del self.requests[vector]

    def _execute(self, instruction: Instruction) -> None:
        name, behind = instruction.mnemonic, instruction.address + instruction.size
        if name == "lds":
            register, address = instruction.operands
            waits = bool(self.arrivals) and self.arrivals[0] <= self.now + 1
            self.now, self.at = self.now + LOAD, behind
            self.registers[register] = 0x80 * waits if address == STATUS else 0
            if address == DATA and waits:
                self.byte_waited = max(self.byte_waited, self.now - READ - self.arrivals.pop(0))
        elif name == "sbrc":
            register, bit = instruction.operands
            skips = not self.registers[register] >> bit & 1
            self.now += 2 if skips else 1
            self.at = behind + 2 * skips  # what may be skipped is one word
        else:
            super()._execute(instruction)


piece = st.one_of(st.integers(0, 30).map(lambda n: NOP * n), st.just(LOOK))
body = st.lists(piece, max_size=4).map("".join)
main = st.lists(st.sampled_from([NOP, NOP * 3, " cli\n" + NOP * 8 + " sei\n"]), min_size=1, max_size=4).map("".join)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(main, st.lists(body, min_size=3, max_size=3), st.lists(st.integers(120, 700), min_size=3, max_size=3),
       st.integers(60, 200), st.integers(0, 1 << 30))  # fmt: skip
def test_no_byte_waits_longer(
    tmp_path: Path, program_of_main: str, bodies: list[str], intervals: list[int], byte: int, seed: int
) -> None:
    first, second, lower = bodies
    program = assembled(
        tmp_path,
        f"{VECTORS}main:\n{program_of_main} rjmp main\n__vector_1: {first} reti\n__vector_2: {second} reti\n"
        f"{OWN}__vector_19: {lower.replace(LOOK, NOP)} reti\n{TAKE}",
    )
    vectors = (1, 2, RECEIVE + 1)
    requests = {n: [Source("i", 1, each)] for n, each in zip(vectors, intervals, strict=True)}
    limit = Latencies(InterruptsOff(program)).of(RECEIVE, requests | {RECEIVE: [Source("bytes", 1, byte)]})
    draw = Random(seed)
    for _ in range(10):
        times = {
            n: [150 + draw.randrange(60) + k * each for k in range(4_000 // each)]
            for n, each in zip(vectors, intervals, strict=True)
        }
        start = 150 + draw.randrange(80)
        machine = Receiver(program, times, arrivals=[start + k * byte for k in range(4_000 // byte)])
        machine.run(4_500)
        assert machine.byte_waited <= limit
