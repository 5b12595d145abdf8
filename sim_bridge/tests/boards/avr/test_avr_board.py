"""The emulated board as a whole: images, resets, watchdog, and runs that do not depend on how they are cut."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest

from boebot.errors import BoardError
from sim_bridge.boards.avr import Watch, create
from sim_bridge.boards.board import Edge, Level, ResetCause
from sim_bridge.tests.boards.access import BoardAccess, SentByte
from sim_bridge.tests.boards.avr.avr_program import Machine, assemble, edges_of, gaps
from sim_bridge.tests.boards.symbols import entry_of

# ---- images ----


def test_missing_image(tmp_path: Path) -> None:
    with pytest.raises(BoardError, match=r"the firmware image .*nothing\.elf cannot be read: No such file"):
        create(tmp_path / "nothing.elf")


def test_image_that_is_none(tmp_path: Path) -> None:
    image = tmp_path / "image.elf"
    image.write_text("not an image", encoding="ascii")
    with pytest.raises(BoardError, match="not an ELF file for an AVR"):
        create(image)


def test_image_cut_short_or_changed_is_refused_or_runs(tmp_path: Path) -> None:
    whole = assemble("main: rjmp main")
    image = tmp_path / "image.elf"
    rng = random.Random(1)
    refused = 0
    for _ in range(300):
        damaged = bytearray(whole[: rng.randrange(len(whole))] if rng.random() < 0.5 else whole)
        for _ in range(rng.randrange(1, 8)):
            if damaged:
                damaged[rng.randrange(min(len(damaged), 0x100))] = rng.randrange(256)
        image.write_bytes(damaged)
        try:
            create(image).close()
        except BoardError:
            refused += 1
    assert refused > 100


def test_image_for_another_microcontroller(tmp_path: Path) -> None:
    whole = bytearray(assemble("main: rjmp main"))
    whole[36] = 25  # of small AVRs
    image = tmp_path / "image.elf"
    image.write_bytes(whole)
    with pytest.raises(BoardError, match=r"is for the core avr:?25.*; expected avr:?5, the ATmega328P's"):
        create(image)


def test_closed_board_has_no_address() -> None:
    machine = Machine("main: rjmp main")
    assert machine.avr.address != 0
    machine.board.close()
    machine.avr.close()
    with pytest.raises(BoardError, match="closed"):
        _ = machine.avr.address


def test_session_that_nobody_closes(tmp_path: Path) -> None:
    image = tmp_path / "program.elf"
    image.write_bytes(assemble("main: rjmp main"))
    program = f"""
from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from sim_bridge.sessions.world import AVR, open_on
session = open_on(AVR, BoardRequest(robot=load_robot("shieldbot"), image={str(image)!r}))
session.transport.read(0.1)
"""
    subprocess.run([sys.executable, "-c", program], check=True)


WILD = (
    "invalid instruction 0x",
    "the program goes to 0x",
    "returns to its start",
    "the stack overflows: it reaches 0x",
    "the stack pointer leaves the memory: 0x",
)


def test_random_programs_stay_in_their_box(tmp_path: Path) -> None:
    # under the sanitizers this finds what a wild program could reach
    size = 30_000
    frame = assemble(f"main:\n .fill {size}, 1, 0x5A")
    start = frame.index(b"\x5a" * size)
    image = tmp_path / "image.elf"
    crashes = 0
    for seed in range(60):
        program = random.Random(seed).randbytes(size)
        image.write_bytes(frame[:start] + program + frame[start + size :])
        machine = create(image)
        board = BoardAccess(machine)
        board.send(range(100), at=100)
        for pin in range(20):
            board.drive(pin, Level.HIGH, at=100 * pin)
        try:
            board.advance(200_000)
        except BoardError as error:
            crashes += 1
            assert any(what in str(error) for what in WILD), error  # noqa: PT017
        board.close()
        machine.close()
    assert crashes > 10


# ---- resets and watchdog ----

WATCHDOG_CYCLES = 2048 * 125  # the shortest: 2048 cycles of 128 kHz

# Stores MCUSR when it starts, then lets the watchdog bite.
WATCHDOG = """
main:
  in r24, MCUSR
  out MCUSR, r1
  sts 0x0200, r24
  ldi r24, 1 << WDCE | 1 << WDE
  sts WDTCSR, r24
  ldi r24, 1 << WDE
  wdr
  sbi DDRB, 5
  sbi PORTB, 5
  sbi PORTD, 7
  ldi r24, 1 << WDE
  sts WDTCSR, r24
1: rjmp 1b
"""


def test_watchdog_reset_keeps_time_and_levels() -> None:
    machine = Machine(WATCHDOG)
    board = machine.board
    board.drive(7, Level.LOW)
    board.run(1000)
    assert machine.board.read_memory(0x200, 1)[0] == 1  # power-on
    started = edges_of(board.log(), 13)[1]
    board.advance(3 * WATCHDOG_CYCLES + 3000)
    log = board.log()
    released = [edge.cycle for edge in log if edge.pin == 13 and edge.level == Level.RELEASED]
    assert len(released) == 3
    assert abs(released[0] - started - WATCHDOG_CYCLES) < 20
    period = released[1] - released[0]
    assert WATCHDOG_CYCLES < period < WATCHDOG_CYCLES + 100  # and the program up to the WDR
    assert released[2] - released[1] == period
    assert machine.board.read_memory(0x200, 1)[0] == 8  # watchdog, and only that: the program cleared the rest
    assert board.counters()["resets"] == 3
    assert [edge.level for edge in log if edge.pin == 7][:2] == [Level.RELEASED, Level.PULLED_UP]


def test_watchdog_that_is_kicked_does_not_bite() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 1 << WDE
          sts WDTCSR, r24
        1: wdr
          rjmp 1b
        """
    )
    machine.board.advance(10 * WATCHDOG_CYCLES)
    assert machine.board.counters()["resets"] == 0


def test_watchdog_survives_its_own_reset_until_it_is_turned_off() -> None:
    # after a watchdog reset WDE stays set with the shortest time; a program that does not know bites its tail
    machine = Machine(
        """
        main:
          in r24, MCUSR
          sbrc r24, WDRF
        1: rjmp 1b                      ; does nothing about it
          ldi r24, 1 << WDCE | 1 << WDE
          sts WDTCSR, r24
          ldi r24, 1 << WDE | 1 << WDP2 ; 16 times as long
          sts WDTCSR, r24
        2: rjmp 2b
        """
    )
    machine.board.advance(16 * WATCHDOG_CYCLES + 1000)
    assert machine.board.counters()["resets"] == 1
    machine.board.advance(16 * WATCHDOG_CYCLES + 1000 + 4 * WATCHDOG_CYCLES)
    assert machine.board.counters()["resets"] == 5


def test_watchdog_interrupt_comes_before_the_reset() -> None:
    machine = Machine(
        """
        .global __vector_6
        __vector_6:
          sbi PINB, 5
          reti
        main:
          sbi DDRB, 5
          ldi r24, 1 << WDCE | 1 << WDE
          sts WDTCSR, r24
          ldi r24, 1 << WDIE | 1 << WDE
          sts WDTCSR, r24
          sei
        1: rjmp 1b
        """
    )
    machine.board.advance(2 * WATCHDOG_CYCLES + 500)
    log = machine.board.log()
    warned, bitten = edges_of(log, 13)[1:3]
    assert log[1].level == Level.HIGH
    assert abs(warned - WATCHDOG_CYCLES) < 100
    assert abs(bitten - 2 * WATCHDOG_CYCLES) < 100
    assert machine.board.counters()["resets"] == 1


# The interrupt keeps WDTCSR as it was while it ran at 0x0200, and what follows it at 0x0201; pin 13 changes with each.
WARNED = """
.global __vector_6
__vector_6:
  sbi PINB, 5
  lds r24, WDTCSR
  sts 0x0200, r24
  {again}
  reti
main:
  in r16, MCUSR
  out MCUSR, r1
  sbrc r16, WDRF
1: rjmp 1b
  sbi DDRB, 5
  ldi r24, 1 << WDCE | 1 << WDE
  sts WDTCSR, r24
  ldi r24, {mode}
  sts WDTCSR, r24
  {enable}
2: lds r25, WDTCSR
  sts 0x0201, r25
  rjmp 2b
"""
BOTH = "1 << WDIE | 1 << WDE"
SET_AGAIN = "ldi r25, 1 << WDIE | 1 << WDE\n sts WDTCSR, r25"
WDIF, WDIE, WDE = 0x80, 0x40, 0x08


def test_the_warning_clears_its_own_enable() -> None:
    machine = Machine(WARNED.format(mode=BOTH, again="", enable="sei"))
    machine.board.advance(WATCHDOG_CYCLES + 1000)
    assert machine.board.read_memory(0x200, 2) == bytes([WDE, WDE])  # WDIE and WDIF cleared by hardware (11.8.2)
    machine.board.advance(2 * WATCHDOG_CYCLES - 100)
    assert machine.board.counters()["resets"] == 0
    machine.board.run(1000)
    assert machine.board.counters()["resets"] == 1
    assert machine.board.read_memory(16, 1)[0] == 8  # MCUSR after it: WDRF


def test_a_warning_that_is_set_again_warns_again() -> None:
    machine = Machine(WARNED.format(mode=BOTH, again=SET_AGAIN, enable="sei"))
    machine.board.advance(5 * WATCHDOG_CYCLES + 1000)
    assert machine.board.counters()["resets"] == 0
    warnings = edges_of(machine.board.log(), 13)[1:]
    assert gaps(warnings) == pytest.approx([WATCHDOG_CYCLES] * 4, abs=20)


def test_a_program_that_hears_no_warning_is_reset() -> None:
    # interrupts off for ever: the flag stands at the second time-out
    machine = Machine(WARNED.format(mode=BOTH, again="", enable=""))
    machine.board.advance(WATCHDOG_CYCLES + 1000)
    assert machine.board.read_memory(0x201, 1)[0] == WDIF | WDIE | WDE
    assert machine.board.counters()["resets"] == 0
    machine.board.advance(2 * WATCHDOG_CYCLES + 1000)
    assert machine.board.counters()["resets"] == 1
    assert machine.board.read_memory(16, 1)[0] == 8


@pytest.mark.parametrize("enable", ["sei", ""])
def test_interrupt_mode_alone_never_resets(enable: str) -> None:
    machine = Machine(WARNED.format(mode="1 << WDIE", again="", enable=enable))
    machine.board.advance(5 * WATCHDOG_CYCLES + 1000)
    assert machine.board.counters()["resets"] == 0
    assert len(edges_of(machine.board.log(), 13)) == (1 + 5 if enable else 1)


RAM, RAM_SIZE = 0x100, 0x700  # below it the stack of the programs here


@pytest.mark.parametrize("cause", [ResetCause.EXTERNAL, ResetCause.BROWN_OUT, ResetCause.WATCHDOG])
def test_memory_outlives_a_reset(cause: ResetCause) -> None:
    board = Machine("main: rjmp main").board
    board.run(100)
    kept = bytes(random.Random(1).randbytes(RAM_SIZE))
    board.write_memory(RAM, kept)
    board.reset(cause)
    board.run(100)
    assert board.read_memory(RAM, RAM_SIZE) == kept


def test_memory_holds_anything_after_power_on() -> None:
    board, other = Machine("main: rjmp main").board, Machine("main: rjmp main").board
    board.run(100)
    other.run(5000)
    first = board.read_memory(RAM, RAM_SIZE)
    assert len(set(first)) > 200, "not zeros"
    assert other.read_memory(RAM, RAM_SIZE) == first, "the same each time"
    board.write_memory(RAM, bytes(RAM_SIZE))
    board.reset(ResetCause.POWER)
    board.run(100)
    assert board.read_memory(RAM, RAM_SIZE) == first


@pytest.mark.parametrize(
    ("cause", "flags"),
    [(ResetCause.POWER, 1), (ResetCause.EXTERNAL, 3), (ResetCause.BROWN_OUT, 5), (ResetCause.WATCHDOG, 9)],
)
def test_reset_causes(cause: ResetCause, flags: int) -> None:
    machine = Machine(
        """
        main:
          in r16, MCUSR                 ; left as it is
          lds r17, 0x0300
          ldi r24, 0x77
          sts 0x0300, r24
        1: rjmp 1b
        """
    )
    board = machine.board
    board.run(1000)
    before = board.now
    board.reset(cause)
    board.run(1000)
    assert board.now == before + 1000 or before + 1000 <= board.now < before + 1008
    status, memory = machine.board.read_memory(16, 2)
    assert status == flags
    assert (memory == 0x77) == (cause != ResetCause.POWER)


def test_reset_loses_bytes_in_flight() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 3
          sts UBRR0L, r24
          ldi r24, 1 << U2X0
          sts UCSR0A, r24
          ldi r24, 1 << TXEN0
          sts UCSR0B, r24
          ldi r24, 'x'
          sts UDR0, r24
        1: rjmp 1b
        """
    )
    machine.board.run(200)
    machine.board.reset()
    machine.board.run(1000)
    assert [byte for _, byte in machine.board.receive()] == [ord("x")]


# ---- independence of steps ----

# Echoes bytes plus one, counts pin changes of port C on port B, captures, carries 38 kHz on pin 2, bites itself.
BUSY = """
.global __vector_4, __vector_7, __vector_10, __vector_11, __vector_18
__vector_4:
  sbi PINB, 4
  reti
__vector_7:
  sbi PIND, 2
  reti
__vector_10:
  lds r24, ICR1L
  sts UDR0, r24
  reti
__vector_11:
  sbi PINB, 5
  lds r24, OCR1AL
  lds r25, OCR1AH
  subi r24, lo8(-1000)
  sbci r25, hi8(-1000)
  sts OCR1AH, r25
  sts OCR1AL, r24
  reti
__vector_18:
  lds r24, UCSR0A
  lds r25, UDR0
  inc r25
  sts UDR0, r25
  reti
main:
  ldi r24, 0x36
  out DDRB, r24
  sbi DDRD, 2
  ldi r24, 1
  out SMCR, r24
  ldi r24, 3
  sts UBRR0L, r24
  ldi r24, 1 << U2X0
  sts UCSR0A, r24
  ldi r24, 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0
  sts UCSR0B, r24
  ldi r24, 1 << PCIE1
  sts PCICR, r24
  ldi r24, 0x3f
  sts PCMSK1, r24
  ldi r24, 210
  sts OCR2A, r24
  ldi r24, 1 << WGM21
  sts TCCR2A, r24
  ldi r24, 1 << OCIE2A
  sts TIMSK2, r24
  ldi r24, 1
  sts TCCR2B, r24
  ldi r24, 1 << COM1B0
  sts TCCR1A, r24
  ldi r24, 1 << OCIE1A | 1 << ICIE1
  sts TIMSK1, r24
  ldi r24, 1 << ICNC1 | 1
  sts TCCR1B, r24
  ldi r24, 1 << WDE
  sts WDTCSR, r24
  sei
1: sleep
  rjmp 1b
"""
LENGTH = 300_000


def busy_run(step: int) -> tuple[list[Edge], list[SentByte], dict[str, int]]:
    """The same inputs each time, the run cut into steps; with input queued only just ahead of each step."""
    board = Machine(BUSY).board
    rng = random.Random(7)
    inputs = sorted(
        (rng.randrange(500, LENGTH), rng.choice((8, 14, 15, 16)), Level(rng.randrange(3))) for _ in range(400)
    )
    sends = sorted((rng.randrange(500, LENGTH), rng.randrange(256)) for _ in range(200))
    board.board.on_edge(13, lambda cycle, level: board.drive(17, level, cycle + 40))
    edges: list[Edge] = []
    sent: list[SentByte] = []
    while board.now < LENGTH:
        until = min(board.now + step, LENGTH)
        while inputs and inputs[0][0] < until + 64:
            at, pin, level = inputs.pop(0)
            board.drive(pin, level, at=at)
        while sends and sends[0][0] < until + 64:
            at, byte = sends.pop(0)
            board.send([byte], at=at)
        board.advance(until)
        edges += board.log()
        sent += board.receive()
    board.advance(LENGTH + 5000)
    return edges + board.log(), sent + board.receive(), board.counters()


@pytest.fixture(scope="module")
def one_piece() -> tuple[list[Edge], list[SentByte], dict[str, int]]:
    return busy_run(16_000_000)


def test_busy_run_is_busy(one_piece: tuple[list[Edge], list[SentByte], dict[str, int]]) -> None:
    edges, sent, counters = one_piece
    assert {edge.pin for edge in edges} >= {1, 2, 10, 12, 13}
    assert len(edges) > 2000
    assert len(sent) > 100
    assert counters["resets"] == 1
    assert min(gaps(edge.cycle for edge in edges)) >= 0


@pytest.mark.unsanitized
@pytest.mark.parametrize("step", [1, 7, 100, 1000, 16_000, 65_537])
def test_runs_do_not_depend_on_steps(step: int, one_piece: tuple[list[Edge], list[SentByte], dict[str, int]]) -> None:
    edges, sent, counters = busy_run(step)
    assert edges == one_piece[0]
    assert sent == one_piece[1]
    assert counters == one_piece[2]


# The watchdog warns, then resets. The warning ends the first loop.
TWO_LOOPS = """
  .global __vector_6
  __vector_6: ldi r17, 1
    {in_interrupt}
    reti
  main: ldi r24, 1 << WDCE | 1 << WDE
    ldi r25, 1 << WDE | 1 << WDIE
    wdr
    sts WDTCSR, r24
    sts WDTCSR, r25
    ldi r17, 0
    sei
  first: tst r17
    breq first
    {then}
  second: rjmp second
"""


@pytest.mark.parametrize(
    ("in_interrupt", "then", "loop", "time_outs"),
    [("", "", "first", 1), ("wdr", "", "first", 1), ("", "wdr", "second", 2), ("", "cli\n wdr", "first", 1)],
    ids=["warned", "its interrupt kicks", "comes to itself", "kicks with interrupts off"],
)
def test_the_place_is_where_the_warning_found_the_program(
    in_interrupt: str, then: str, loop: str, time_outs: int
) -> None:
    source = TWO_LOOPS.format(in_interrupt=in_interrupt, then=then)
    machine = Machine(source)
    machine.board.advance(2 * WATCHDOG_CYCLES + 1000)
    ((cycle, address),) = machine.board.watchdog_log()
    assert entry_of(assemble(source), loop) <= address <= entry_of(assemble(source), loop) + 2
    assert abs(cycle - time_outs * WATCHDOG_CYCLES) < 100


def test_a_reset_in_the_watchdogs_name_is_not_logged() -> None:
    machine = Machine("main: rjmp main")
    machine.board.reset(ResetCause.WATCHDOG)
    machine.board.run(1000)
    assert machine.board.counters()["resets"] == 1
    assert machine.board.watchdog_log() == []


# ---- runs that end at edges, and what reacts to them ----

# Pins 13 and 12 by OUT, every 5 cycles; pin 9 by timer 1 every {top} cycles, in mid-instruction now and then.
EDGES = """
main:
  sbi DDRB, 1
  ldi r24, {top} - 1
  sts OCR1AL, r24
  ldi r24, 1 << COM1A0
  sts TCCR1A, r24
  ldi r24, 1 << WGM12 | 1 << CS10
  sts TCCR1B, r24
  ldi r24, 0x32
  out DDRB, r24
  ldi r25, 0x30
1: out PINB, r25
  nop
  nop
  rjmp 1b
"""


def test_a_run_ends_at_the_very_edge_that_the_program_makes() -> None:
    machine, whole = Machine(EDGES.format(top=97)), Machine(EDGES.format(top=97))
    machine.avr.stop_at([13])
    found = []
    while machine.board.now < 5000:
        machine.board.advance(5000)
        if (edges := edges_of(machine.board.log(), 13)) and machine.board.now < 5000:
            assert edges == [machine.board.now]
        found += edges
    whole.board.advance(5000)
    assert found == edges_of(whole.board.log(), 13) and len(found) > 900
    machine.avr.stop_at([])
    machine.board.advance(10_000)
    assert machine.board.now >= 10_000


@pytest.mark.parametrize("top", [96, 97])
def test_a_timers_edge_ends_the_run_behind_the_instruction_that_it_meets(top: int) -> None:
    machine = Machine(EDGES.format(top=top))
    machine.avr.stop_at({9})
    edges, late = [], set()
    while machine.board.now < 20_000:
        machine.board.advance(20_000)
        if new := edges_of(machine.board.log(), 9):
            edges += new
            late.add(machine.board.now - new[-1])
    assert set(gaps(edges)[1:]) == {top} and late <= {0, 1}


def test_an_edge_that_a_reset_or_the_outside_makes_ends_the_run() -> None:
    machine = Machine(EDGES.format(top=97))
    machine.board.advance(1000)
    machine.avr.stop_at([12, 7])
    machine.board.reset()
    at = machine.board.now
    machine.board.advance(2000)
    assert machine.board.now == at and machine.board.output(12) == Level.RELEASED
    machine.board.advance(1_000_000)
    assert machine.board.output(12) != Level.RELEASED  # its direction, then its level
    machine.avr.stop_at([7])
    machine.board.drive(7, Level.HIGH, 5000)
    machine.board.advance(1_000_000)
    assert 5000 <= machine.board.now <= 5001


@pytest.mark.parametrize("delay", [1, 40])
@pytest.mark.parametrize("step", [7, 4000, 100_000])
def test_what_reacts_to_an_edge_drives_at_its_cycle_however_a_run_is_cut(step: int, delay: int) -> None:
    machine = Machine(EDGES.format(top=97))
    machine.board.log_outside()
    seen = []

    def react(cycle: int, level: Level) -> None:
        assert machine.avr.reacts_at == cycle
        seen.append(cycle)
        machine.board.drive(7, level, cycle + delay)

    machine.avr.on_edge(9, react)
    while machine.board.now < 20_000:
        machine.board.run(step)
    driven = machine.board.outside_log()["driven"]["cycle"].tolist()
    answered = [cycle for cycle in seen if cycle + delay <= driven[-1]]
    assert driven == [cycle + delay for cycle in answered] and len(answered) > 190
    assert machine.avr.reacts_at is None


@pytest.mark.parametrize("error", [KeyError("x"), KeyboardInterrupt()])
def test_what_a_reaction_raises_ends_the_run_there_and_is_raised(error: BaseException) -> None:
    machine = Machine(EDGES.format(top=97))
    calls = []

    def react(cycle: int, level: Level) -> None:
        calls.append(cycle)
        if len(calls) == 3:
            raise error

    for pin in (12, 13):  # both move in one instruction: the other is not called any more
        machine.avr.on_edge(pin, react)
    with pytest.raises(type(error)) as raised:
        machine.board.advance(1_000_000)
    assert raised.value is error and len(calls) == 3 and machine.board.now == calls[-1]
    error.__traceback__ = None
    machine.board.advance(machine.board.now + 5)
    assert len(calls) == 5


# ---- coverage ----


def test_coverage_is_what_was_executed_and_where_it_went_on() -> None:
    source = """
    main:
      ldi r24, 3
    1: dec r24
      brne 1b              ; both ways
      sbic PIND, 7         ; low: skips
      rjmp 2f
      sbrs r24, 0          ; does not skip
      lds r24, 0x0200      ; two words
      breq 3f              ; the flag is still set: jumps
    2: nop                 ; never
    3: rjmp 3b
    """
    machine, off = Machine(source), Machine(source)
    first = entry_of(assemble(source), "main") // 2
    for board in (machine, off):
        board.board.drive(7, Level.LOW)
    assert not machine.avr.cover().any()
    for board in (machine, off):
        board.board.advance(1000)
    covered = machine.avr.cover()
    assert covered[first : first + 11].tolist() == [1, 1, 3, 2, 0, 1, 2, 0, 2, 0, 2]
    assert machine.board.counters() == off.board.counters() and machine.board.now == off.board.now


def test_coverage_beside_the_recorder_and_the_notes_is_the_same() -> None:
    found = []
    for prepare in (lambda one: None, lambda one: one.record(Watch()), lambda one: one.check(strict=False)):
        machine = Machine(EDGES.format(top=97))
        prepare(machine.avr)
        machine.avr.cover()
        machine.board.advance(2000)
        found.append(bytes(machine.avr.cover()))
    assert found[0] == found[1] == found[2] and any(found[0])
