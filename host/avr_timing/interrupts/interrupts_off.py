"""The longest time in which no interrupt is accepted, of a function and of a whole image.

A stretch begins with the first cycle of `cli`, or with the acceptance of an interrupt, whose entry takes 4 cycles
(data sheet, 7.7.1). It ends with the instruction behind the one that sets the flag; where that is `sleep`, the CPU
wakes in 4 cycles more (10.1).

Assumed: until `main` has switched interrupts on for the first time nobody waits for one, so the start-up does
not count. An interrupt whose body switches interrupts on keeps itself off meanwhile. What an interrupt waits, all in
all, is in latency.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sized
from dataclasses import dataclass, field

from avr_timing.bounds.stack import VECTORS
from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.flag import Flag, State, after
from avr_timing.flow.loops import with_parents
from avr_timing.flow.paths import Graph, Way, longest
from avr_timing.flow.registers import SREG
from avr_timing.program import REFUSED, Block, Function, Instruction, Program
from boebot.errors import AnalysisError

ENTRY = 4  # cycles from acceptance to the vector's jump
STATES_MAXIMUM = 100_000  # of a function: (block, instruction, state); the kit's have 1,284 at most
WAKE = 4  # cycles from a request in sleep to its acceptance


@dataclass(frozen=True, slots=True)
class Stretch:
    """Cycles with interrupts off, and the address of the instruction with which they begin."""

    cycles: int
    begin: int


NONE = Stretch(0, 0)


@dataclass(frozen=True, slots=True)
class Effect:
    """What a function does to the flag, when it is called with it on or off. None: cannot happen.

    Attributes:
        within: the longest stretch that begins and ends in it.
        through: cycles from entry to return without an interrupt.
        head: cycles from entry until interrupts can come.
        tail: the longest stretch that lasts from within until its return.
        on: whether it can return with interrupts on.
    """

    within: Stretch = NONE
    through: int | None = None
    head: int | None = None
    tail: Stretch | None = None
    on: bool = False
    plain: bool = False  # leaves the flag alone


Node = tuple[int, int, State]  # block, number of the instruction in it, state before it
_Ahead = tuple[Node, frozenset[int]]


@dataclass(frozen=True, slots=True)
class Begin:
    """A stretch begins: the first node in it, cycles before that, where, and the node before (None: in a callee)."""

    node: Node
    before: int
    at: Stretch
    source: Node | None


@dataclass(frozen=True, slots=True)
class Call:
    """A call, or a jump into another function (`to` None), and its cycles; `to` is what comes behind it."""

    callee: int
    cycles: int
    to: Node | None


@dataclass(frozen=True, slots=True)
class Flow:
    """All ways from (block, instruction, state) to the next: within stretches (`goes`; `ended` where interrupts can
    come again, `returned` with the function) and outside of them (`steps`, `calls`, `returns`)."""

    entry: Node
    goes: dict[Node, list[tuple[Node, int]]] = field(default_factory=dict)
    ended: dict[Node, list[int]] = field(default_factory=dict)  # cycles until interrupts can come
    returned: dict[Node, list[tuple[bool, int]]] = field(default_factory=dict)  # whether off, cycles
    begins: list[Begin] = field(default_factory=list)
    callees: list[Effect] = field(default_factory=list)
    steps: dict[Node, list[tuple[Node, int]]] = field(default_factory=dict)
    calls: dict[Node, list[Call]] = field(default_factory=dict)
    returns: dict[Node, int] = field(default_factory=dict)  # cycles, wherever interrupts can come by its end


class InterruptsOff:
    """Stretches of the functions of a program, each worked out once."""

    def __init__(self, program: Program, worst_case: WorstCase | None = None) -> None:
        self.program = program
        self.worst_case = worst_case or WorstCase(program)
        self._effects: dict[tuple[int, bool], Effect] = {}
        self._flows: dict[tuple[int, bool], Flow] = {}
        self._plain: dict[int, bool] = {}
        self._under_way: list[int] = []

    def of(self, function: str | int) -> Stretch:
        """The longest stretch that a function makes when it is called with interrupts on.

        Raises:
            AnalysisError: no such function; a loop without a bound, or sleep, while interrupts are off.
        """
        function = self.program.entry(function)
        effect = self.effect(function, on=True)
        return max(effect.within, effect.tail or NONE, key=_cycles)

    def interrupt(self, vector: int) -> tuple[int, int | None]:
        """Of an interrupt: cycles from acceptance until others can come, and, where its body lets others in, the
        longest stretch after that up to its return, or None."""
        effect = self.effect(4 * vector, on=False)
        begin = max(effect.through or 0, effect.head or 0)
        return ENTRY + begin, None if effect.head is None else max(
            effect.within, effect.tail or NONE, key=_cycles
        ).cycles

    def image(self) -> Stretch:
        """The longest of the whole image: of `main` and all that it calls, or of an interrupt."""
        stretches = [self.of("main")]
        for vector in self.vectors():
            first, second = self.interrupt(vector)
            stretches += [Stretch(first, 4 * vector), Stretch(second or 0, 4 * vector)]
        return max(stretches, key=_cycles)

    def vectors(self) -> list[int]:
        """Numbers of the interrupts in use, the highest priority first."""
        return [number for number in VECTORS if 4 * number in self.program.functions]

    def effect(self, entry: int, on: bool) -> Effect:
        """What a function does to the flag, called with interrupts on or off."""
        if (entry, on) not in self._effects:
            with self.program.entered(entry, self._under_way):
                self._effects[entry, on] = self._worked_out(entry, on)
        return self._effects[entry, on]

    def _worked_out(self, entry: int, on: bool) -> Effect:
        if not self._is_plain(entry):
            return self._effect(self.worst_case.inside(entry).function, on)
        return Effect(on=True, plain=True) if on else Effect(through=self.worst_case.bound(entry).cycles)

    def _is_plain(self, entry: int) -> bool:
        """Nothing in it or below it writes the flag, or depends on it."""
        if entry not in self._plain:
            code = self.program.instructions(self.program.below(entry))
            self._plain[entry] = not any(map(_is_about_flag, code))
        return self._plain[entry]

    def _effect(self, function: Function, on: bool) -> Effect:
        flow = self.flow(function.entry, on)
        within = [callee.within for callee in flow.callees]
        tails: list[Stretch] = []
        for begin in flow.begins:
            ended, returned = self.stretch(flow, begin)
            within += [] if ended is None else [Stretch(ended, begin.at.begin)]
            tails += [] if returned is None else [Stretch(returned, begin.at.begin)]
        returns = [off for each in flow.returned.values() for off, _ in each]
        return Effect(
            within=max(within, key=_cycles, default=NONE),
            through=None if on else self._longest(flow, flow.entry, _returned),
            head=None if on else self._longest(flow, flow.entry, _ended),
            tail=max(tails, key=_cycles, default=None),
            on=not all(returns),
        )

    def stretch(self, flow: Flow, begin: Begin) -> tuple[int | None, int | None]:
        """The most cycles of a stretch that begins there: until interrupts can come, until the function returns."""
        ended = self._longest(flow, begin.node, _ended)
        returned = self._longest(flow, begin.node, _returned)
        return tuple(None if each is None else begin.before + each for each in (ended, returned))  # type: ignore[return-value]

    def _longest(self, flow: Flow, start: Node, ends: Callable[[Flow, Node], Iterable[int]]) -> int | None:
        """The longest way from a node, with interrupts off all the way, to one kind of end.

        In the midst of a loop it begins with the rest of a pass, which is none of the passes behind the loop's header.
        So nodes go by the headers, of the loops around the first one, that have not come yet.
        """
        marks = self.worst_case.marks(flow.entry[0])
        around = self._around(flow.entry[0], start)
        first = (start, frozenset(around))
        ways: dict[_Ahead, list[Way[_Ahead]]] = {}
        work = [first]
        while work:
            place = work.pop()
            if place in ways:
                continue
            node, ahead = place
            ways[place] = [Way(place, None, cycles) for cycles in ends(flow, node)]
            for to, cycles in flow.goes.get(node, ()):
                left = frozenset(header for header in ahead if to[0] in around[header] and to[:2] != (header, 0))
                ways[place].append(Way(place, (to, left), cycles))
                work.append((to, left))
            self._bounded(ways, flow.entry[0])
        counted = {place: marks[place[0][0]] for place in ways if place[0][1] == 0 and place[0][0] in marks}
        walk = longest(Graph(first, ways, lambda place: self.program.where(place[0][0]), counted))
        return None if walk is None else walk.cycles

    def _around(self, entry: int, start: Node) -> dict[int, frozenset[int]]:
        """The loops that a node is in the midst of: headers and blocks."""
        loops = (loop for loop, _ in with_parents(self.worst_case.inside(entry).function))
        return {loop.header: loop.nodes for loop in loops if start[0] in loop.nodes and start[:2] != (loop.header, 0)}

    def flow(self, entry: int, on: bool) -> Flow:
        """All ways through a function that is called with interrupts on or off."""
        if (entry, on) not in self._flows:
            self._flows[entry, on] = self._flow(self.worst_case.inside(entry).function, on)
        return self._flows[entry, on]

    def _flow(self, function: Function, on: bool) -> Flow:
        entry = (function.entry, 0, State(Flag.ON if on else Flag.OFF))
        flow = Flow(entry)
        seen = {entry}
        work = [entry]
        while work:
            node = work.pop()
            for to in self._step(function, node, flow):
                if to not in seen:
                    seen.add(to)
                    work.append(to)
            self._bounded(seen, function.entry)
        return flow

    def _bounded(self, found: Sized, entry: int) -> None:
        """Refuses what is built so that its states double at every branch, or never end."""
        if len(found) > STATES_MAXIMUM:
            raise AnalysisError(
                f"{self.program.where(entry)}: there are more than {STATES_MAXIMUM:,} states of the interrupt flag and "
                "its copies; expected a function that restores the flag which it saved"
            )

    def _step(self, function: Function, node: Node, flow: Flow) -> list[Node]:
        """Adds the ways out of a node to the flow; the nodes that they lead to."""
        start, number, state = node
        block = function.blocks[start]
        instruction = block.instructions[number]
        if instruction.mnemonic == REFUSED:
            raise AnalysisError(self.program.unproven[function.entry])
        if instruction.mnemonic == "sleep" and state.flag is Flag.OFF:
            raise AnalysisError(
                f"{function.name} sleeps with interrupts off at {self.program.where(instruction.address)}; "
                "expected `sei` right in front of it, else nothing wakes the CPU"
            )
        clobbered = None
        if block.callee is not None and number + 1 == len(block.instructions):
            clobbered = self.program.clobbered(block)
        states = after(instruction, state, clobbered)
        found: list[Node] = []
        if number + 1 < len(block.instructions):
            for following in states:
                found.append((start, number + 1, following))
                self._go(flow, node, found[-1], instruction.cycles + _stops(instruction), instruction.address)
            return found
        callee = block.callee
        ways: list[tuple[int, int | None]] = [(edge.cycles, edge.to) for edge in block.edges]
        for edge_cycles, to in ways or [(block.last_cycles, None)]:
            edge_cycles += _stops(instruction)
            for following in states:
                if callee is not None:
                    effect = self._callee(callee, block, function, state.flag is not Flag.OFF)
                    behind = self._call(flow, node, following, effect, edge_cycles, to)
                    if state.flag is not Flag.OFF:
                        on = next((each for each in behind if each[2].flag is not Flag.OFF), None)
                        flow.calls.setdefault(node, []).append(Call(callee, edge_cycles, on))
                    found += behind
                elif to is not None:
                    found.append((to, 0, following))
                    self._go(flow, node, found[-1], edge_cycles, instruction.address)
                else:
                    self._return(flow, node, edge_cycles)
        return found

    def _go(self, flow: Flow, node: Node, to: Node, cycles: int, address: int) -> None:
        """From one instruction to the next: within a stretch, at its begin, at its end, or outside."""
        flag, following = node[2].flag, to[2].flag
        if flag is Flag.JUST_ON:
            flow.ended.setdefault(node, []).append(0)
        if flag.blocks:
            flow.goes.setdefault(node, []).append((to, cycles))
        elif following is Flag.OFF:
            flow.begins.append(Begin(to, cycles, Stretch(0, address), node))
        else:
            flow.steps.setdefault(node, []).append((to, cycles))

    def _return(self, flow: Flow, node: Node, cycles: int) -> None:
        flag = node[2].flag
        if flag in (Flag.ONE_MORE, Flag.JUST_ON):
            flow.ended.setdefault(node, []).append(cycles if flag is Flag.ONE_MORE else 0)
        flow.returned.setdefault(node, []).append((flag is Flag.OFF, cycles))
        if flag is not Flag.OFF:
            flow.returns[node] = cycles

    def _callee(self, entry: int, block: Block, function: Function, on: bool) -> Effect:
        """What a callee does to the flag; in time, where it leaves it alone, with the argument that it gets."""
        if self._is_plain(entry) and not on:
            inside = self.worst_case.inside(function.entry)
            return Effect(through=self.worst_case.callee(entry, block, inside).cycles)
        return self.effect(entry, on)

    def _call(self, flow: Flow, node: Node, state: State, effect: Effect, cycles: int, to: int | None) -> list[Node]:
        """A call, or a jump into another function (`to` None)."""
        flag = node[2].flag
        flow.callees.append(effect)
        if flag is not Flag.OFF:
            flow.ended.setdefault(node, []).append(cycles if flag is Flag.ONE_MORE else 0)
        if effect.head is not None:
            flow.ended.setdefault(node, []).append(cycles + effect.head)
        found: list[Node] = []
        tail = effect.tail
        if to is None:
            if effect.through is not None:
                flow.returned.setdefault(node, []).append((True, cycles + effect.through))
            if tail is not None:
                ret = (node[0], node[1], State(Flag.OFF, frozenset(), -1))
                flow.returned.setdefault(ret, []).append((True, 0))
                flow.begins.append(Begin(ret, tail.cycles, tail, None))
            if effect.on:
                flow.returned.setdefault(node, []).append((False, 0))
            return found
        behind_off = (to, 0, State(Flag.OFF, state.copies, state.pushed))
        if effect.through is not None:
            flow.goes.setdefault(node, []).append((behind_off, cycles + effect.through))
            found.append(behind_off)
        if tail is not None:
            flow.begins.append(Begin(behind_off, tail.cycles, tail, None))
            found.append(behind_off)
        if effect.on:
            behind = Flag.ON if effect.plain else Flag.JUST_ON
            found.append((to, 0, State(behind, state.copies, state.pushed)))
        return found


def _cycles(stretch: Stretch) -> int:
    return stretch.cycles


def _stops(instruction: Instruction) -> int:
    """Cycles for which the CPU stands after an instruction, before an interrupt that waits is accepted."""
    return WAKE if instruction.mnemonic == "sleep" else 0


def _ended(flow: Flow, node: Node) -> Iterable[int]:
    return flow.ended.get(node, ())


def _returned(flow: Flow, node: Node) -> Iterable[int]:
    return [cycles for off, cycles in flow.returned.get(node, ()) if off]


def _is_about_flag(instruction: Instruction) -> bool:
    name = instruction.mnemonic
    return name in ("cli", "sei", "reti", "sleep", REFUSED) or (name == "out" and instruction.operands[0] == SREG)
