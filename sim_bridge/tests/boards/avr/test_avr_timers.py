"""Timers of the emulated ATmega328P: counts, compare edges, captures, flags, at their true cycles."""

from __future__ import annotations

import pytest

from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.avr.avr_program import Machine, edges_of, gaps, pairs

CAPTURE_PIN = 8
INPUT_LATENCY = 3  # synchronizer and edge detector: 2.5 to 3.5 cycles


def word(machine: Machine, address: int) -> int:
    """A 16-bit value in RAM."""
    return int.from_bytes(machine.board.read_memory(address, 2), "little")


def words(machine: Machine, address: int, count: int) -> list[int]:
    """16-bit values in RAM."""
    return [word(machine, address + 2 * i) for i in range(count)]


# ---- normal and clear-on-match ----


@pytest.mark.parametrize("compare", [2, 300, 40_000, 65_535])
def test_compare_edge_at_its_true_cycle(compare: int) -> None:
    machine = Machine(
        f"""
        main:
          sbi DDRB, 5
          sbi DDRB, 1
          ldi r24, {compare} >> 8
          sts OCR1AH, r24
          ldi r24, {compare} & 255
          sts OCR1AL, r24
          ldi r24, 1 << COM1A0
          sts TCCR1A, r24
          ldi r24, 1
          sbi PINB, 5
          sts TCCR1B, r24
        1: rjmp 1b
        """
    )
    machine.board.run(300_000)
    log = machine.board.log()
    started = edges_of(log, 13)[1] + 2
    toggles = edges_of(log, 9)[1:]
    # the pin moves one count after the match (16.7.1), then once a lap
    assert toggles == [started + compare + 1 + lap * 65_536 for lap in range(len(toggles))]
    assert len(toggles) >= 3


@pytest.mark.parametrize(("clock_select", "divider"), [(1, 1), (2, 8), (3, 64)])
def test_compare_edges_with_prescaler_keep_its_phase(clock_select: int, divider: int) -> None:
    machine = Machine(
        f"""
        main:
          sbi DDRD, 6
          ldi r24, 99
          out OCR0A, r24
          ldi r24, 1 << COM0A0 | 1 << WGM01
          out TCCR0A, r24
          nop
          ldi r24, {clock_select}
          out TCCR0B, r24
        1: rjmp 1b
        """
    )
    machine.board.run(divider * 1000 + 200)
    edges = edges_of(machine.board.log(), 6)[1:]
    # the prescaler runs since the reset: every edge falls on a multiple of its divider
    assert all(edge % divider == 0 for edge in edges)
    assert set(gaps(edges)) == {100 * divider}
    assert len(edges) >= 9


def test_a_reset_of_the_prescaler_starts_a_count_of_each_timer_that_it_serves_anew() -> None:
    machine = Machine(
        """
        main:
          sbi DDRD, 6           ; timers 0 and 1 toggle pins 6 and 9 every 10 counts of 64 cycles
          sbi DDRB, 1
          sbi DDRB, 5
          ldi r24, 9
          out OCR0A, r24
          sts OCR1AH, r1
          sts OCR1AL, r24
          ldi r24, 1 << COM0A0 | 1 << WGM01
          out TCCR0A, r24
          ldi r24, 1 << COM1A0
          sts TCCR1A, r24
          ldi r24, 3
          out TCCR0B, r24
          ldi r24, 1 << WGM12 | 3
          sts TCCR1B, r24
          ldi r24, 250
        1: dec r24
          brne 1b
          ldi r24, 1 << PSRSYNC
          out GTCCR, r24
          sbi PINB, 5
        2: rjmp 2b
        """
    )
    machine.board.run(5000)
    log = machine.board.log()
    started = edges_of(log, 13)[1] - 2  # SBI behind OUT
    for pin in (6, 9):
        before, behind = (
            [edge for edge in edges_of(log, pin)[1:] if (edge < started) == is_so] for is_so in (True, False)
        )
        assert before and {edge % 64 for edge in before} == {0}
        assert {(edge - started) % 64 for edge in behind} == {0}
        assert 10 * 64 < behind[0] - before[-1] < 11 * 64
        assert set(gaps(behind)) == {10 * 64}


def test_toggle_interrupt_makes_an_even_carrier() -> None:
    # Timer 2 as the firmware uses it for infrared: clear on match, a short interrupt that toggles an output.
    machine = Machine(
        """
        .global __vector_7
        __vector_7:
          sbi PIND, 2
          reti
        main:
          sbi DDRD, 2
          ldi r24, 1
          out SMCR, r24
          ldi r24, 210
          sts OCR2A, r24
          ldi r24, 1 << WGM21
          sts TCCR2A, r24
          ldi r24, 1 << OCIE2A
          sts TIMSK2, r24
          ldi r24, 1
          sts TCCR2B, r24
          sei
        1: sleep
          rjmp 1b
        """
    )
    machine.board.run(211 * 500)
    edges = edges_of(machine.board.log(), 2)[2:]
    assert set(gaps(edges)) == {211}
    assert len(edges) > 490


def test_count_and_stopped_timer() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 1
          sts TCCR1B, r24
          lds r16, TCNT1L
          lds r17, TCNT1H
          .rept 1000
          nop
          .endr
          lds r18, TCNT1L
          lds r19, TCNT1H
          sts TCCR1B, r1
          lds r20, TCNT1L
          lds r21, TCNT1H
          .rept 100
          nop
          .endr
          lds r22, TCNT1L
          lds r23, TCNT1H
        1: rjmp 1b
        """
    )
    machine.board.run(2000)
    first, second, stopped, later = words(machine, 16, 4)
    assert second - first == 1000 + 2 + 2
    assert stopped - second == 2 + 2 + 1  # to the end of the store that stops it; a read is in its second cycle
    assert later == stopped


def test_sixteen_bit_reads_go_through_the_temporary_register() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 0x01
          sts TCNT1H, r24
          ldi r24, 0xF8
          sts TCNT1L, r24
          ldi r24, 1
          sts TCCR1B, r24
          lds r16, TCNT1L       ; 0x01F9
          .rept 20
          nop
          .endr
          lds r17, TCNT1H       ; the count is beyond 0x0200 by now
        1: rjmp 1b
        """
    )
    machine.board.run(200)
    assert word(machine, 16) == 0x01F9


def test_writing_the_count_holds_the_match_off() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 5
          out OCR0A, r24
          out TCNT0, r24        ; equal: no match at the next count
          ldi r24, 1
          out TCCR0B, r24
          nop
          nop
          in r16, TIFR0
          .rept 256
          nop
          .endr
          in r17, TIFR0
        1: rjmp 1b
        """
    )
    machine.board.run(500)
    before, after = machine.board.read_memory(16, 2)
    assert not before & 2
    assert after & 2


def test_clear_on_match_beyond_its_top_overflows_once() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 200
          out TCNT0, r24
          ldi r24, 99
          out OCR0A, r24
          ldi r24, 1 << WGM01
          out TCCR0A, r24
          ldi r24, 1
          out TCCR0B, r24
          .rept 55
          nop
          .endr
          in r16, TIFR0         ; count 255
          in r17, TIFR0         ; 0
          .rept 98
          nop
          .endr
          in r18, TIFR0         ; count 99
          in r19, TIFR0
        1: rjmp 1b
        """
    )
    machine.board.run(500)
    assert [flags & 3 for flags in machine.board.read_memory(16, 4)] == [0, 1, 1, 3]


def test_one_flag_is_cleared_at_a_time() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 3
          out OCR0A, r24
          out OCR0B, r24
          ldi r24, 1
          out TCCR0B, r24
          .rept 300
          nop
          .endr
          out TCCR0B, r1
          in r16, TIFR0
          sbi TIFR0, OCF0A
          in r17, TIFR0
          ldi r24, 1 << OCF0B
          out TIFR0, r24
          in r18, TIFR0
        1: rjmp 1b
        """
    )
    machine.board.run(500)
    assert list(machine.board.read_memory(16, 3)) == [0b111, 0b101, 0b001]


# ---- PWM ----

PWM = """
main:
  sbi DDRB, 1
  sbi DDRB, 2
  {settings}
  ldi r24, {control_a}
  sts TCCR1A, r24
  ldi r24, {control_b}
  sts TCCR1B, r24
1: rjmp 1b
"""


def store(register: str, value: int) -> str:
    """Code that writes a 16-bit register."""
    return f"""
      ldi r24, {value >> 8}
      sts {register}H, r24
      ldi r24, {value & 255}
      sts {register}L, r24
    """


def high_times_and_periods(edges: list[int]) -> tuple[set[int], set[int]]:
    """Of a pin that starts low: how long it is high, and from rise to rise."""
    rises_and_falls = list(pairs(edges[: len(edges) // 2 * 2]))
    rises = [rise for rise, _ in rises_and_falls]
    highs = {fall - rise for rise, fall in rises_and_falls}
    return highs, set(gaps(rises))


@pytest.mark.parametrize(
    ("mode", "settings", "top"),
    [(5, "", 255), (7, "", 1023), (14, store("ICR1", 1999), 1999), (15, store("OCR1A", 1499), 1499)],
)
def test_fast_pwm(mode: int, settings: str, top: int) -> None:
    machine = Machine(
        PWM.format(
            settings="ldi r24, 0x10\n sts TCCR1B, r24\n" * (mode == 14) + settings + store("OCR1B", 99),
            control_a=0x20 | mode & 3,  # clear pin 10 on match, set it at the bottom
            control_b=(mode & 12) << 1 | 1,
        )
    )
    machine.board.run(20 * (top + 1))
    highs, periods = high_times_and_periods(edges_of(machine.board.log(), 10)[3:])
    assert highs == {100}
    assert periods == {top + 1}


def test_phase_correct_pwm() -> None:
    machine = Machine(PWM.format(settings=store("OCR1B", 99), control_a=0x20 | 1, control_b=1))
    machine.board.run(20 * 510)
    highs, periods = high_times_and_periods(edges_of(machine.board.log(), 10)[3:])
    assert highs == {2 * 99}
    assert periods == {2 * 255}


@pytest.mark.parametrize(("compare", "level"), [(0, Level.LOW), (255, Level.HIGH)])
def test_phase_correct_pwm_at_its_extremes_is_steady(compare: int, level: Level) -> None:
    machine = Machine(PWM.format(settings=store("OCR1B", compare), control_a=0x20 | 1, control_b=1))
    machine.board.run(2000)
    machine.board.log()
    machine.board.run(20_000)
    assert edges_of(machine.board.log(), 10) == []
    assert machine.board.output(10) == level


def test_fast_pwm_takes_a_new_compare_value_at_the_bottom() -> None:
    machine = Machine(
        """
        main:
          sbi DDRD, 6
          ldi r24, 99
          out OCR0A, r24
          ldi r24, 1 << COM0A1 | 3
          out TCCR0A, r24
          ldi r24, 1
          out TCCR0B, r24
          .rept 300
          nop
          .endr
          ldi r24, 49
          out OCR0A, r24
        1: rjmp 1b
        """
    )
    machine.board.run(256 * 8)
    edges = edges_of(machine.board.log(), 6)[1:]
    highs = [fall - rise for rise, fall in pairs(edges[: len(edges) // 2 * 2])]
    # the first lap is low; the second begins with 99 in force; what is written during it counts from the third on
    assert highs == [100] + [50] * (len(highs) - 1)
    assert len(highs) >= 5


# ---- capture ----

CAPTURE = """
; every capture: its count and the count at which the interrupt read the timer, stored from 0x0200 on
.global __vector_10
__vector_10:
  lds r24, ICR1L
  st X+, r24
  lds r24, ICR1H
  st X+, r24
  lds r24, TCCR1B
  ldi r25, 1 << ICES1
  eor r24, r25                  ; the other edge next
  sts TCCR1B, r24
  ldi r24, 1 << ICF1
  out TIFR1, r24
  reti
main:
  ldi r26, 0x00
  ldi r27, 0x02
  sbi DDRB, 5
  ldi r24, 1 << ICIE1
  sts TIMSK1, r24
  ldi r24, 1 << ICES1 | {noise_filter} << ICNC1 | 1
  sbi PINB, 5
  sts TCCR1B, r24
  sei
1: rjmp 1b
"""


@pytest.mark.parametrize(("noise_filter", "delay"), [(0, 0), (1, 4)])
def test_capture_holds_the_count_at_the_edge(noise_filter: int, delay: int) -> None:
    machine = Machine(CAPTURE.format(noise_filter=noise_filter))
    board = machine.board
    board.drive(CAPTURE_PIN, Level.LOW)
    edges = [1_003, 1_900, 30_001, 48_504, 60_000, 60_123]
    for i, edge in enumerate(edges):
        board.drive(CAPTURE_PIN, Level.LOW if i % 2 else Level.HIGH, at=edge)
    board.advance(61_000)
    zero = edges_of(board.log(), 13)[1] + 2
    assert words(machine, 0x200, 6) == [edge + INPUT_LATENCY + delay - zero for edge in edges]


@pytest.mark.parametrize(("noise_filter", "captures"), [(0, 1), (1, 0)])
def test_noise_filter_drops_a_glitch(noise_filter: int, captures: int) -> None:
    machine = Machine(CAPTURE.format(noise_filter=noise_filter))
    machine.board.drive(CAPTURE_PIN, Level.LOW)
    machine.board.drive(CAPTURE_PIN, Level.HIGH, at=1000)
    machine.board.drive(CAPTURE_PIN, Level.LOW, at=1003)
    machine.board.advance(1200)
    # without the filter the fall comes before the interrupt has turned the edge
    assert machine.board.read_memory(26, 1)[0] == 2 * captures


# ---- Timer 0 as a tone needs it --------------------------------------------------------------------------


@pytest.mark.parametrize(("pin", "port", "bit", "unit"), [(6, "D", 6, "A"), (5, "D", 5, "B")])
@pytest.mark.parametrize(("clock_select", "divider"), [(1, 1), (2, 8), (3, 64), (4, 256), (5, 1024)])
@pytest.mark.parametrize("top", [24, 249])
def test_timer_0_toggles_its_pin_on_match(
    pin: int, port: str, bit: int, unit: str, clock_select: int, divider: int, top: int
) -> None:
    """Clear on match: f = f_clk / (2 N (1 + OCR0A)), (15.7.2)."""
    machine = Machine(
        f"""
        main:
          sbi DDR{port}, {bit}
          ldi r24, {top}
          out OCR0A, r24
          ldi r24, {top // 2}
          out OCR0B, r24
          ldi r24, 1 << COM0{unit}0 | 1 << WGM01
          out TCCR0A, r24
          ldi r24, {clock_select}
          out TCCR0B, r24
        1: rjmp 1b
        """
    )
    half = divider * (top + 1)
    machine.board.run(12 * half)
    halves = gaps(edges_of(machine.board.log(), pin)[2:])
    assert len(halves) >= 8
    assert set(halves) == {half}


@pytest.mark.parametrize(("frequency", "clock_select", "divider"), [(440, 4, 256), (1000, 3, 64), (2500, 3, 64)])
def test_timer_0_interrupt_makes_a_tone_on_any_pin(frequency: int, clock_select: int, divider: int) -> None:
    """Toggled by the interrupt of compare A, from idle sleep; the pin is that of the piezo, 4."""
    top = round(16_000_000 / (2 * divider * frequency)) - 1
    assert top <= 255
    machine = Machine(
        f"""
        .global __vector_14
        __vector_14:
          sbi PIND, 4
          reti
        main:
          sbi DDRD, 4
          ldi r24, 1
          out SMCR, r24
          ldi r24, {top}
          out OCR0A, r24
          ldi r24, 1 << WGM01
          out TCCR0A, r24
          ldi r24, {clock_select}
          out TCCR0B, r24
          ldi r24, 1 << OCIE0A
          sts TIMSK0, r24
          sei
        1: sleep
          rjmp 1b
        """
    )
    machine.board.run(400_000)
    halves = gaps(edges_of(machine.board.log(), 4)[2:])
    assert len(halves) >= 10
    assert set(halves) == {divider * (top + 1)}


# ---- where the phase-correct modes turn (15.7.4, 16.9.4, 16.9.5) ----

Writes = list[tuple[str, int]]


def place(register: str) -> str:
    """Its address in the data space; avr_program.PREAMBLE has those of IN and OUT without the 0x20 in front of them."""
    return f"{register} + 0x20" if "0" in register or register in ("GTCCR", "TIFR1") else register


def writes(rows: Writes) -> str:
    """Code that writes registers, 3 cycles each."""
    return "".join(f" ldi r24, {value}\n sts {place(name)}, r24\n" for name, value in rows)


def turning(
    timer: int, mode: int, before: Writes, behind: Writes, changes: dict[int, Writes], *, flags: bool = False
) -> list[int]:
    """The count, or the flags, once in each count of 64 cycles, of a timer that starts at 0. Written is something
    before its mode is set and behind it, and behind the samples of some numbers."""
    sampled = f"TIFR{timer}" if flags else "TCNT0" if timer == 0 else "TCNT1L"
    clock = (mode & 12) << 1 | 3
    setting = [(f"TCCR{timer}A", mode & 3), (f"TCCR{timer}B", clock & ~3)]
    code = "main:\n ldi r26, 0\n ldi r27, 2\n" + writes([*before, *setting, *behind, ("GTCCR", 1)])
    code += writes([(f"TCCR{timer}B", clock)])
    for number in range(SAMPLES):
        change = changes.get(number, [])
        code += f" lds r24, {place(sampled)}\n st X+, r24\n" + writes(change)
        code += f" .rept {64 - 4 - 3 * len(change)}\n nop\n .endr\n"
    machine = Machine(code + "1: rjmp 1b")
    machine.board.run(64 * (SAMPLES + 2))
    return list(machine.board.read_memory(0x200, SAMPLES))


SAMPLES = 14
PHASE, PHASE_AND_FREQUENCY, PHASE_ICR = 5, 9, 10  # of timer 0, of timer 1, of timer 1


def top_1(value: int) -> Writes:
    return [("OCR1AH", 0), ("OCR1AL", value)]


COUNT_0: Writes = [("TCNT1H", 0), ("TCNT1L", 0)]
TURNS = {
    # OCR0A is taken over at TOP: the way down begins where the old top was, the way up ends at the new one (16.9.4)
    "lowered": (0, PHASE, [("OCR0A", 4)], [], {2: [("OCR0A", 3)]}, [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 3, 2, 1]),
    "raised": (0, PHASE, [("OCR0A", 4)], [], {2: [("OCR0A", 6)]}, [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5]),
    "lowered on the way down": (
        *(0, PHASE, [("OCR0A", 3)], [], {4: [("OCR0A", 2)]}),
        [0, 1, 2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1],
    ),
    # the direction changes where the count equals TOP: beyond it, it goes on to MAX
    "beyond": (0, PHASE, [("OCR0A", 4)], [], {2: [("TCNT0", 252)]}, [0, 1, 2, 253, 254, 255, 0, 1, 2, 3, 4, 3, 2, 1]),
    "beyond, on the way down": (
        *(0, PHASE, [("OCR0A", 4)], [], {5: [("TCNT0", 9)]}),
        [0, 1, 2, 3, 4, 3, 8, 7, 6, 5, 4, 3, 2, 1],
    ),
    "ICR1 missed": (1, PHASE_ICR, [], [("ICR1H", 0), ("ICR1L", 5)], {3: [("ICR1L", 2)]}, list(range(14))),
    # taken over at BOTTOM; that is also where a program puts the count
    "at rest": (1, PHASE_AND_FREQUENCY, [], [*top_1(4), *COUNT_0], {}, [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 3, 4, 3]),
    "set to 0": (
        *(1, PHASE_AND_FREQUENCY, top_1(6), [], {3: [*top_1(2), *COUNT_0]}),
        [0, 1, 2, 3, 1, 2, 1, 0, 1, 2, 1, 0, 1, 2],
    ),
    "not before BOTTOM": (
        *(1, PHASE_AND_FREQUENCY, top_1(4), [], {2: top_1(2)}),
        [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 1, 0, 1],
    ),
}


@pytest.mark.parametrize("what", TURNS)
def test_turns_of_the_phase_correct_modes(what: str) -> None:
    timer, mode, before, behind, changes, counts = TURNS[what]
    assert turning(timer, mode, before, behind, changes) == counts


def test_a_top_of_zero_that_is_raised_is_left() -> None:
    counts = turning(0, PHASE, [], [], {3: [("OCR0A", 3)]})
    assert counts[:4] == [0, 0, 0, 0]
    start = counts.index(1)
    assert start <= 5
    assert counts[start:] == [1, 2, 3, 2, 1, 0, 1, 2, 3, 2][: len(counts) - start]


ICR1_3: Writes = [("ICR1H", 0), ("ICR1L", 3)]


@pytest.mark.parametrize(
    ("mode", "toggles"), [(1, 0), (5, 0), (8, 0), (9, 1), (10, 0), (11, 1), (12, 1), (14, 1), (15, 1)]
)
def test_oc1a_toggles_in_the_modes_of_its_tables(mode: int, toggles: bool) -> None:
    """COM1A = 1: tables 16-1 to 16-3."""
    settings: Writes = [("TCCR1A", 0x40 | mode & 3), ("TCCR1B", (mode & 12) << 1 | 1), *ICR1_3, *top_1(3)]
    machine = Machine(f"main: sbi DDRB, 1\n{writes(settings)} 1: rjmp 1b")
    machine.board.run(1000)
    assert (len(edges_of(machine.board.log(), 9)) > 50) == toggles


@pytest.mark.parametrize(
    ("mode", "top"), [(5, [("OCR0A", 3)]), *((8, ICR1_3), (9, top_1(3)), (10, ICR1_3), (11, top_1(3)))]
)
def test_a_phase_correct_timer_overflows_where_it_leaves_bottom(mode: int, top: Writes) -> None:
    """Figure 16-12 with BOTTOM for TOP, as its text says: at the clock at which OCR1x is updated in modes 8 and 9
    (16.9.5). The count is 0 1 2 3 2 1 0 1 ..."""
    timer = int(mode != PHASE)
    flags = turning(timer, mode, top, [*top, *COUNT_0], {2: [(f"TIFR{timer}", 1)]}, flags=True)
    assert [flag & 1 for flag in flags[:10]] == [0, 1, 1, 0, 0, 0, 0, 1, 1, 1]


# ---- clocks from outside (17.3) ----

CLOCKED = [(0, 4, 6), (0, 4, 7), (1, 5, 6), (1, 5, 7)]  # timer, its clock pin, CSn2:0


@pytest.mark.parametrize(("timer", "pin", "clock"), CLOCKED)
def test_edges_of_the_clock_pin_are_counted(timer: int, pin: int, clock: int) -> None:
    """Of one direction; of the last one, those that come INPUT_LATENCY before the access."""
    rests = Level.LOW if clock == 7 else Level.HIGH
    active = Level.HIGH if clock == 7 else Level.LOW
    from_io = " + 0x20" if timer == 0 else ""  # its registers have I/O addresses
    for late, expected in ((0, 6), (1, 5)):
        machine = Machine(
            f"""
            main:
              ldi r24, {clock}
              sts TCCR{timer}B{from_io}, r24
              sbi DDRB, 5
              .rept 100
              nop
              .endr
              lds r24, TCNT{timer}{"L" * timer}{from_io}
              sts 0x200, r24
            1: rjmp 1b
            """
        )
        board = machine.board
        board.drive(pin, rests)
        while not (log := board.log()):
            board.run(1)
        access = log[0].cycle + 100 + 1
        for edge in range(10):
            board.drive(pin, rests if edge % 2 else active, at=log[0].cycle + 10 + 5 * edge)
        board.drive(pin, active, at=access - INPUT_LATENCY + late)
        board.run(300)
        assert board.read_memory(0x200, 1)[0] == expected


def test_a_timer_that_is_clocked_by_edges_overflows_and_matches() -> None:
    """T0, in clear-on-match mode: OC0A (pin 6) toggles with the edge behind the match. T1 is clocked by the program
    itself through an output (17.3); its overflow is a flag."""
    machine = Machine(
        """
        main:
          sbi DDRD, 6
          sbi DDRD, 5
          ldi r24, 4
          out OCR0A, r24
          ldi r24, 1 << COM0A0 | 1 << WGM01
          out TCCR0A, r24
          ldi r24, 7
          out TCCR0B, r24
          ldi r24, 0xFF
          sts TCNT1H, r24
          sts TCNT1L, r24
          ldi r24, 6
          sts TCCR1B, r24
          sbi PORTD, 5
          cbi PORTD, 5
          nop
          nop
          nop
          in r24, TIFR1
          sts 0x200, r24
        1: rjmp 1b
        """
    )
    machine.board.drive(4, Level.LOW)
    for edge in range(60):  # 30 rising ones
        machine.board.drive(4, Level.LOW if edge % 2 else Level.HIGH, at=1000 + 50 * edge)
    machine.board.run(6000)
    toggles = [cycle for cycle in edges_of(machine.board.log(), 6) if cycle >= 1000]
    assert toggles == [1000 + 100 * (5 * lap + 4) + INPUT_LATENCY for lap in range(6)]
    assert machine.board.read_memory(0x200, 1)[0] == 1  # TOV1
