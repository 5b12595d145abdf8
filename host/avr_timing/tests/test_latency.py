"""Bounds of interrupts' latencies: counted by hand, and against machines that run small programs cycle by cycle."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from avr_image import assembled
from avr_timing.bounds.wcet import WorstCase
from avr_timing.interrupts import interrupts_off
from avr_timing.interrupts.interrupts_off import ENTRY, WAKE, InterruptsOff
from avr_timing.interrupts.latency import HORIZON, Latencies
from avr_timing.interrupts.response import Source
from avr_timing.interrupts.steps import KEPT, Steps
from avr_timing.program import Instruction, Program
from boebot.errors import AnalysisError

VECTORS = "\n.global __vector_1\n.global __vector_2\n.global __vector_3\n"
JUMP = 3  # of a vector, where the linker does not relax
RETI = ENTRY + JUMP + 4  # an interrupt that does nothing
ONCE = 1 << 20
NOP = " nop\n"


def latency(program: Program, vector: int, *intervals: int) -> int:
    """Of an interrupt; vectors 1, 2 and so on are asked for so far apart."""
    requests = {n: [Source("i", 1, each)] for n, each in enumerate(intervals, 1)}
    return Latencies(InterruptsOff(program)).of(vector, requests)


# ---- by hand -------------------------------------------------------------------------------------------------------


def test_those_of_higher_priority_and_what_has_begun(tmp_path: Path) -> None:
    source = VECTORS + (
        "main: cli\n nop\n nop\n sei\n nop\n 1: rjmp 1b\n __vector_1: nop\n reti\n"
        "__vector_2: nop\n nop\n reti\n __vector_3: push r0\n pop r0\n reti"
    )
    main, rjmp = 1 + 1 + 1 + 1 + 1, 2
    first, second, third = RETI + 1, RETI + 2, RETI + 4
    program = assembled(tmp_path, source)
    # The longest of lower priority has just begun and returns to `cli`; then those of higher, each with a step.
    assert latency(program, 1, ONCE, ONCE, ONCE) == third + main
    assert latency(program, 2, ONCE, ONCE, ONCE) == third + main + (first + rjmp)
    # Nothing is lower: it waits for those of higher priority, and for the stretch that has just begun.
    assert latency(program, 3, ONCE, ONCE, ONCE) == main + (first + rjmp) + (second + rjmp)


def test_each_return_may_reach_a_further_stretch(tmp_path: Path) -> None:
    """Round after round: stretches of 3 and 6 cycles, `rjmp` of 2, and between the stretches nothing or a `nop`."""
    source = VECTORS + "main: cli\n sei\n nop\n {} cli\n nop\n nop\n nop\n sei\n nop\n rjmp main\n __vector_1: reti"
    for between, times in (("", [6, 3 + 6, 3 + 6 + 2, 6 + 2 + 3 + 6]), ("nop\n", [6, 6 + 2, 6 + 2 + 3, 3 + 1 + 6 + 2])):
        found = Steps(InterruptsOff(assembled(tmp_path, source.format(between))))
        assert [found.most(n) for n in (1, 2, 3, 4)] == times


def test_cli_as_first_instruction_of_a_function_called_at_once(tmp_path: Path) -> None:
    """`sei; rcall`: the call is what still runs, and the callee switches interrupts off again."""
    source = VECTORS + "main: cli\n nop\n sei\n rcall f\n rjmp main\n f: cli\n nop\n nop\n sei\n ret\n __vector_1: reti"
    found = Steps(InterruptsOff(assembled(tmp_path, source)))
    outer, inner, rjmp = 1 + 1 + 1 + 3, 1 + 2 + 1 + 4, 2
    assert found.most(1) == inner
    assert found.most(2) == outer + inner
    assert found.most(3) == outer + inner + rjmp
    assert found.most(4) == 2 * inner + outer + rjmp


def test_sleep_wakes_in_four_cycles(tmp_path: Path) -> None:
    source = VECTORS + "main: cli\n sei\n sleep\n rjmp main\n __vector_1: reti"
    assert Steps(InterruptsOff(assembled(tmp_path, source))).most(1) == 1 + 1 + 1 + WAKE


def test_steps_beyond_those_kept_are_not_below_them(tmp_path: Path) -> None:
    source = VECTORS + "main: cli\n sei\n nop\n nop\n rjmp main\n __vector_1: reti"
    found = Steps(InterruptsOff(assembled(tmp_path, source)))
    times = [found.most(n) for n in range(2 * KEPT + 2)]
    assert all(a <= b for a, b in itertools.pairwise(times))
    assert times[2 * KEPT] == 2 * times[KEPT] and times[KEPT + 1] == times[KEPT] + times[1]


def test_ways_that_break_off_are_worked_out_once(tmp_path: Path) -> None:
    source = VECTORS + "main: cli\n sei\n nop\n cli\n nop\n nop\n nop\n sei\n nop\n rjmp main\n __vector_1: reti"
    found = Steps(InterruptsOff(assembled(tmp_path, source)))

    def plainly(steps: int, jumps: int) -> int:
        if jumps == 0:
            return found.most(steps)
        return max(found.most(n) + plainly(steps - n, jumps - 1) for n in range(steps + 1))

    for jumps in range(4):
        assert [found.most(steps, jumps) for steps in range(8)] == [plainly(steps, jumps) for steps in range(8)]
    assert found.most(2 * KEPT + 1, 10**6) == (2 * KEPT + 1) * found.most(1)


@pytest.mark.parametrize(
    "body",
    [
        "1: push r0\n rjmp 1b",
        " ".join(f"sbrs r20, {bit % 8}\n in r{bit}, 0x3f\n" for bit in range(17)) + " sei\n rjmp main",
    ],
    ids=["a push in a loop without end", "copies of the flag that double at each branch"],
)
def test_states_without_end_are_refused(tmp_path: Path, body: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts_off, "STATES_MAXIMUM", 5000)
    program = assembled(tmp_path, VECTORS + f"main: cli\n {body}\n __vector_1: reti")
    for judge in (lambda: Steps(InterruptsOff(program)), lambda: InterruptsOff(program).image()):
        with pytest.raises(AnalysisError, match=r"\(in main\): there are more than 5,000 states of the interrupt flag"):
            judge()


def test_calls_that_are_too_deep_are_refused(tmp_path: Path) -> None:
    def chained(count: int) -> str:
        calls = "".join(f" f{i}: rcall f{i + 1}\n ret\n" for i in range(1, count))
        return VECTORS + f"main: rcall f1\n 1: rjmp 1b\n{calls} f{count}: cli\n sei\n ret\n __vector_1: reti"

    assert InterruptsOff(assembled(tmp_path, chained(50))).image().cycles > 0
    for count in (60, 1500):
        program = assembled(tmp_path, chained(count))
        for judge in (WorstCase(program), InterruptsOff(program)):
            with pytest.raises(AnalysisError, match="calls go deeper than 60 functions; expected no deeper call"):
                judge.of("main")
        assert WorstCase(program).of(f"f{count - 1}").cycles == 3 + (1 + 1 + 4) + 4  # judged all the same


def test_stretch_that_ends_in_another_function_makes_every_step_the_longest(tmp_path: Path) -> None:
    source = VECTORS + "main: rcall f\n nop\n sei\n nop\n nop\n rjmp main\n f: cli\n ret\n __vector_1: reti"
    found = Steps(InterruptsOff(assembled(tmp_path, source)))
    assert found.most(3) == 3 * (1 + 4 + 1 + 1 + 1)


def test_those_of_higher_priority_may_take_all_the_time(tmp_path: Path) -> None:
    program = assembled(tmp_path, VECTORS + "main: nop\n nop\n rjmp main\n __vector_1: nop\n reti\n __vector_2: reti")
    assert latency(program, 2, RETI, ONCE) == HORIZON
    assert latency(program, 2, 2 * RETI + 8, ONCE) < HORIZON


def test_how_often_one_of_higher_priority_comes_must_be_said(tmp_path: Path) -> None:
    program = assembled(tmp_path, VECTORS + "main: rjmp main\n __vector_1: reti\n __vector_2: reti")
    with pytest.raises(AnalysisError, match="interrupt 1 goes before interrupt 2"):
        Latencies(InterruptsOff(program)).of(2, {2: [Source("i", 1, 100)]})


# ---- a machine -----------------------------------------------------------------------------------------------------


@dataclass
class Machine:
    """Runs the few instructions of the programs below, one after another; requests come at given times."""

    program: Program
    requests: dict[int, list[int]]  # by vector, cycles in rising order
    now: int = 0
    at: int = 0
    on: bool = True
    one_more: bool = False
    returns: list[int] = field(default_factory=list)
    waited: dict[int, int] = field(default_factory=dict)

    def run(self, until: int) -> dict[int, int]:
        """The longest from request to acceptance, by vector; a request that waits already is no new one."""
        code = {
            instruction.address: instruction
            for function in self.program.functions.values()
            for block in function.blocks.values()
            for instruction in block.instructions
        }
        self.at = self.program.by_name["main"]
        while self.now < until:
            if self.on and not self.one_more and (due := self._due()) is not None:
                self._accept(due)
                continue
            self.one_more = False
            self._execute(code[self.at])
        return self.waited

    def _due(self) -> int | None:
        return min((n for n, times in self.requests.items() if times and times[0] <= self.now), default=None)

    def _accept(self, vector: int) -> None:
        times = self.requests[vector]
        self.waited[vector] = max(self.waited.get(vector, 0), self.now - times[0])
        while times and times[0] <= self.now:
            times.pop(0)
        self.returns.append(self.at)
        self.now, self.at, self.on = self.now + ENTRY, 4 * vector, False

    def _execute(self, instruction: Instruction) -> None:
        name, behind = instruction.mnemonic, instruction.address + instruction.size
        self.now += {"rjmp": 2, "jmp": 3, "rcall": 3, "call": 4, "ret": 4, "reti": 4, "push": 2, "pop": 2}.get(name, 1)
        if name in ("rjmp", "jmp", "rcall", "call"):
            if name in ("rcall", "call"):
                self.returns.append(behind)
            self.at = instruction.operands[0]
            return
        if name == "cli":
            self.on = False
        elif name == "sei":
            self.one_more, self.on = not self.on, True
        elif name == "reti":
            self.one_more = self.on = True
        else:
            assert name in ("nop", "ret"), name
        self.at = self.returns.pop() if name in ("ret", "reti") else behind


def section(nops: int) -> str:
    return " cli\n" + NOP * nops + " sei\n"


piece = st.one_of(
    st.integers(0, 3).map(lambda n: NOP * n),
    st.integers(0, 12).map(section),
    st.sampled_from([" rcall f\n", " rcall g\n", " sei\n"]),
)
handler = st.tuples(st.integers(0, 15), st.booleans())


def text(main: Sequence[str], f: Sequence[str], handlers: Sequence[tuple[int, bool]]) -> str:
    """The last interrupt may let others in and end as those of the EEPROM and the bus do, with interrupts off."""
    bodies = [f"__vector_{n}:\n" + NOP * nops + " reti\n" for n, (nops, _) in enumerate(handlers[:-1], 1)]
    nops, lets_in = handlers[-1]
    last = " nop\n sei\n" + NOP * nops + section(2) + " nop\n cli\n nop\n reti\n" if lets_in else NOP * nops + " reti\n"
    functions = f"f:\n{''.join(f)} ret\ng: cli\n nop\n sei\n ret\n"
    return f"{VECTORS}main:\n{''.join(main)} rjmp main\n{functions}{''.join(bodies)}__vector_{len(handlers)}:\n{last}"


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(piece, min_size=1, max_size=7),
    st.lists(piece.filter(lambda each: " f\n" not in each), max_size=3),
    st.lists(handler, min_size=3, max_size=3),
    st.lists(st.integers(60, 400), min_size=3, max_size=3),
    st.sampled_from([0, 50]),
    st.integers(0, 1 << 30),
)
def test_no_machine_waits_longer(
    tmp_path: Path,
    main: list[str],
    f: list[str],
    handlers: list[tuple[int, bool]],
    intervals: list[int],
    late: int,
    seed: int,
) -> None:
    program = assembled(tmp_path, text(main, f, handlers))
    if handlers[-1][1]:
        intervals = [*intervals[:-1], 4_000]  # it does not ask again before its body has returned
    sources = {n: [Source("i", 1, each, late)] for n, each in enumerate(intervals, 1)}
    found = Latencies(InterruptsOff(program))
    limits = {vector: found.of(vector, sources) for vector in sources}
    draw = Random(seed)
    for _ in range(12):
        requests = {}
        for n, interval in enumerate(intervals, 1):
            first = 200 + draw.randrange(40)
            requests[n] = sorted(first + k * interval + draw.randrange(late + 1) for k in range(5_000 // interval))
        waited = Machine(program, requests).run(6_000)
        assert all(cycles <= limits[vector] for vector, cycles in waited.items()), (waited, limits)
