"""The recorder of the emulated ATmega328P: spans, latencies and stack of programs whose times follow from the data
sheet (12.4, 7) and the instruction set manual; and that a recorded machine does the same as before."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boebot.errors import BoardError
from sim_bridge.boards.avr import FUNCTION_IDS, Watch
from sim_bridge.boards.board import Level, ResetCause
from sim_bridge.tests.boards.avr.avr_program import Machine, assemble, edges_of
from sim_bridge.tests.boards.symbols import entry_of

ENTRY, VECTOR_JUMP, RETURN, WAKE_UP = 4, 3, 4, 4  # cycles
COMPARE_A, COMPARE_B, INT0 = 11, 12, 1  # vectors

# Timer 1 counts cycles; compare A at 600 toggles pin 9, compare B at 607.
TIMERS = """
  sbi DDRB, 1
  sbi DDRB, 5
  ldi r24, hi8(600)
  sts OCR1AH, r24
  ldi r24, lo8(600)
  sts OCR1AL, r24
  ldi r24, hi8(607)
  sts OCR1BH, r24
  ldi r24, lo8(607)
  sts OCR1BL, r24
  ldi r24, 1 << COM1A0
  sts TCCR1A, r24
  ldi r24, {mask}
  sts TIMSK1, r24
  ldi r24, 1
  sts TCCR1B, r24
"""


def recorded(source: str, cycles: int, *functions: str, patience: int = 0) -> tuple[Machine, Any]:
    """A machine that has run for some cycles, and what was recorded of it."""
    machine = Machine(source)
    entries = [entry_of(assemble(source), name) for name in functions]
    machine.avr.record(Watch(functions=entries, patience=patience))
    machine.board.run(cycles)
    return machine, machine.avr.spans()


def of(spans: Any, number: int) -> Any:
    return spans[spans["id"] == number]


def test_a_function_takes_what_its_instructions_take() -> None:
    source = """
        work:
          nop
          ldi r24, 10
        1: dec r24
          brne 1b
          ret
        main: rcall work
          rjmp main
    """
    _, spans = recorded(source, 2000, "work")
    takes = 1 + 1 + 10 * 1 + 9 * 2 + 1 + RETURN
    assert len(spans) > 10
    assert set(spans["net"]) == set(spans["gross"]) == {takes}
    assert set(np.diff(spans["begin"])) == {takes + 3 + 2}  # RCALL, RJMP


def test_a_loop_to_the_first_instruction_is_one_span_and_a_recursion_are_several() -> None:
    source = """
        loops: dec r24
          brne loops
          ret
        deeper: dec r24
          breq 1f
          rcall deeper
        1: ret
        main: ldi r24, 5
          rcall loops
          ldi r24, 3
          rcall deeper
        1: rjmp 1b
    """
    _, spans = recorded(source, 300, "loops", "deeper")
    assert list(of(spans, FUNCTION_IDS)["net"]) == [5 * 1 + 4 * 2 + 1 + RETURN]
    last = 1 + 2 + RETURN
    second = 1 + 1 + 3 + last + RETURN
    assert list(of(spans, FUNCTION_IDS + 1)["net"]) == [1 + 1 + 3 + second + RETURN, second, last]
    assert list(of(spans, FUNCTION_IDS + 1)["depth"]) == [0, 1, 2]


def test_a_tail_call_belongs_to_the_function_that_was_called() -> None:
    source = """
        other: nop
          ret
        work: nop
          rjmp other
        main: rcall work
        1: rjmp 1b
    """
    _, spans = recorded(source, 200, "work", "other")
    assert list(of(spans, FUNCTION_IDS)["net"]) == [1 + 2 + 1 + RETURN]
    assert list(of(spans, FUNCTION_IDS + 1)["net"]) == [1 + RETURN]


def test_an_interrupt_is_taken_out_of_the_function_that_it_comes_into() -> None:
    body = 700
    source = f"""
        .global __vector_11
        __vector_11:
          nop
          nop
          reti
        work:
          .rept {body}
          nop
          .endr
          ret
        main: {TIMERS.format(mask="1 << OCIE1A")}
          sei
          rcall work
        1: rjmp 1b
    """
    machine, spans = recorded(source, 3000, "work")
    (interrupt,), (work,) = of(spans, COMPARE_A), of(spans, FUNCTION_IDS)
    assert interrupt["net"] == interrupt["gross"] == ENTRY + VECTOR_JUMP + 2 + RETURN
    assert interrupt["latency"] == 0  # instructions of one cycle
    assert interrupt["begin"] == edges_of(machine.board.log(), 9)[1]
    assert work["net"] == body + RETURN
    assert work["gross"] == body + RETURN + interrupt["gross"]


def test_nested_interrupts() -> None:
    source = f"""
        .global __vector_11
        __vector_11:
          sei
          .rept 20
          nop
          .endr
          reti
        .global __vector_12
        __vector_12:
          nop
          reti
        work:
          .rept 700
          nop
          .endr
          ret
        main: {TIMERS.format(mask="1 << OCIE1A | 1 << OCIE1B")}
          sei
          rcall work
        1: rjmp 1b
    """
    _, spans = recorded(source, 3000, "work")
    (outer,), (inner,), (work,) = of(spans, COMPARE_A), of(spans, COMPARE_B), of(spans, FUNCTION_IDS)
    assert inner["net"] == inner["gross"] == ENTRY + VECTOR_JUMP + 1 + RETURN
    # B matches 7 cycles after A: when SEI begins, and NOP runs before it is accepted
    assert inner["latency"] == 1 + 1
    assert inner["begin"] == outer["begin"] + ENTRY + VECTOR_JUMP + 2
    assert outer["net"] == ENTRY + VECTOR_JUMP + 1 + 20 + RETURN
    assert outer["gross"] == outer["net"] + inner["gross"]
    assert work["net"] == 700 + RETURN
    assert work["gross"] == work["net"] + outer["gross"]
    assert list(spans["depth"]) == [0, 1, 2]


def test_latency_counts_while_interrupts_are_off() -> None:
    source = f"""
        .global __vector_11
        __vector_11: reti
        main: {TIMERS.format(mask="1 << OCIE1A")}
          .rept 800
          nop
          .endr
          sei
          sbi PINB, 5   ; runs before the interrupt is accepted
        1: rjmp 1b
    """
    machine, spans = recorded(source, 3000)
    (interrupt,), log = of(spans, COMPARE_A), machine.board.log()
    accepted, match = edges_of(log, 13)[1], edges_of(log, 9)[1]
    assert interrupt["begin"] == accepted
    assert interrupt["latency"] == accepted - match > 100


def test_latency_counts_from_when_the_interrupt_is_enabled() -> None:
    source = f"""
        .global __vector_11
        __vector_11: reti
        main: {TIMERS.format(mask="0")}
          sei
          .rept 800
          nop
          .endr
          ldi r24, 1 << OCIE1A
          sts TIMSK1, r24
        1: rjmp 1b
    """
    _, spans = recorded(source, 3000)
    assert list(of(spans, COMPARE_A)["latency"]) == [0]


def test_waking_up_is_latency() -> None:
    source = f"""
        .global __vector_11
        __vector_11: reti
        main: {TIMERS.format(mask="1 << OCIE1A")}
          ldi r24, 1
          out SMCR, r24
          sei
        1: sleep
          rjmp 1b
    """
    machine, spans = recorded(source, 3000)
    (interrupt,) = of(spans, COMPARE_A)
    assert interrupt["latency"] == WAKE_UP
    assert interrupt["begin"] - WAKE_UP == edges_of(machine.board.log(), 9)[1]
    assert interrupt["net"] == ENTRY + VECTOR_JUMP + RETURN


def test_two_received_bytes_have_each_its_own_latency() -> None:
    source = """
        .global __vector_18
        __vector_18:
          lds r24, UDR0
          reti
        main:
          ldi r24, 1
          sts UBRR0L, r24
          ldi r24, 1 << U2X0
          sts UCSR0A, r24
          ldi r24, 1 << RXEN0 | 1 << RXCIE0
          sts UCSR0B, r24
          ldi r26, 0
          ldi r27, 0
        1: nop
          adiw r26, 1   ; 5 cycles a round; ends when both bytes are there
          cpi r27, 4
          brne 1b
          sei
        2: rjmp 2b
    """
    machine = Machine(source)
    machine.board.line_rate(1_000_000)
    machine.avr.record(Watch())
    machine.board.send(b"ab", at=100)
    machine.board.run(20_000)
    first, second = of(machine.avr.spans(), 18)["latency"]
    span = ENTRY + VECTOR_JUMP + 2 + RETURN
    # a byte takes 160 cycles on the line; one instruction (RJMP, 2 cycles) runs between two interrupts
    assert first - second == 160 - span - 2


def test_lowest_stack_is_seen_and_half_written_pointers_are_not() -> None:
    source = """
        deep: push r24
          push r24
          pop r24
          pop r24
          ret
        main: ldi r28, lo8(0x0805)
          ldi r29, hi8(0x0805)
          out SPH, r29
          out SPL, r28
          sbiw r28, 0x10      ; 0x07F5, of which the upper half alone would be 0x0705
          out SPH, r29
          out SREG, r1
          out SPL, r28
          rcall deep
          adiw r28, 0x10      ; 0x0805, 0x08F5 in between
          out SPH, r29
          out SREG, r1
          out SPL, r28
        1: rjmp 1b
    """
    machine, spans = recorded(f"{source}\n .lcomm variables, {0x07F2 - 0x100}", 500, "deep")
    assert machine.avr.lowest_stack == 0x07F5 - 2 - 2
    assert list(spans["net"]) == [2 + 2 + 2 + 2 + RETURN]


# The stack begins at 0x08FF, each return address takes 2 bytes: the first that lies below 0x0200 begins at 0x01FE.
RECURSES = "main: rcall main\n rjmp main\n .lcomm variables, 0x100"
HANGS = "main: nop\n1: rjmp 1b"
JUMPS = "main: ldi r30, 0\n ldi r31, 0x30\n ijmp"


@pytest.mark.parametrize(
    ("source", "watch", "fault"),
    [
        (RECURSES, {}, "the stack overflows: it reaches 0x01FE"),
        (JUMPS, {}, "the program goes to 0x6000, but ends at 0x"),
        ("main: pop r24\n rjmp main", {}, "the stack pointer leaves the memory: 0x0900"),
        (HANGS, {"patience": 1000}, "the program hangs: it has not slept for 1000 cycles"),
        ("main: nop\n .word 0x0001", {}, "the invalid instruction 0x0001"),
    ],
)
def test_faults(source: str, watch: dict[str, int], fault: str) -> None:
    last = {RECURSES: 0, HANGS: 2}.get(source)
    with pytest.raises(BoardError, match=fault) as caught:
        recorded(source, 100_000, **watch)
    main = entry_of(assemble(source), "main")
    length = {"ldi": 4, "pop": 0, "nop": 2}.get(source.split()[1], 0) if last is None else last
    assert f"at address 0x{main + length:04X}" in str(caught.value)


def test_who_sleeps_does_not_hang() -> None:
    source = "main: ldi r24, 1\n out SMCR, r24\n1: sleep\n rjmp 1b"
    recorded(source, 100_000, patience=1000)


def test_where_the_watchdog_found_the_program() -> None:
    source = """
        main: ldi r24, 1 << WDCE | 1 << WDE
          ldi r25, 1 << WDE
          wdr
          sts WDTCSR, r24
          sts WDTCSR, r25
        stuck: rjmp stuck
    """
    machine, _ = recorded(source, 300_000)
    ((cycle, address),) = machine.board.watchdog_log()
    assert address == entry_of(assemble(source), "stuck")
    assert abs(cycle - 2048 * 125) < 50  # 16 ms and what runs before WDR
    assert machine.board.counters()["resets"] == 1


@pytest.mark.parametrize("source", [RECURSES, JUMPS, "main: pop r24\n rjmp main"])
def test_without_a_recorder_the_faults_are_the_same(source: str) -> None:
    faults = []
    for is_recorded in (True, False):
        machine = Machine(source)
        machine.board.send(b"x" * 100)  # something happens now and then
        if is_recorded:
            machine.avr.record(Watch())
        with pytest.raises(BoardError) as caught:
            machine.board.run(100_000)
        faults.append(str(caught.value))
    assert faults[0] == faults[1]


def test_recording_changes_nothing() -> None:
    source = f"""
        .global __vector_11
        __vector_11: sbi PINB, 5
          reti
        .global __vector_1
        __vector_1: sbi PINB, 4
          reti
        main: {TIMERS.format(mask="1 << OCIE1A")}
          sbi DDRB, 4
          sbi EIMSK, 0
          ldi r24, 1
          sts EICRA, r24      ; any change
          out SMCR, r24
          sei
        1: sleep
          rjmp 1b
    """
    logs = []
    for watch in (None, Watch()):
        machine = Machine(source)
        if watch:
            machine.avr.record(watch)
        for at in range(1000, 90_000, 777):
            machine.board.drive(2, Level(at % 2), at)
            machine.board.run(777)
        machine.board.reset(ResetCause.EXTERNAL)
        machine.board.run(100_000)
        logs.append((machine.board.log(), machine.board.counters(), machine.board.now))
    assert logs[0] == logs[1]
    assert len(logs[0][0]) > 100


def test_too_many_functions_are_refused() -> None:
    machine = Machine(HANGS)
    for functions in ([1], [0x8000], list(range(0, 258, 2))):
        with pytest.raises(BoardError, match="expected even addresses"):
            machine.avr.record(Watch(functions=functions))
