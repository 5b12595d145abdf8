"""The control-flow graph of an image's machine code: its functions, their blocks, and who calls whom.

Functions are followed from the reset vector, the interrupt vectors in use and `main`. Every way is followed as the
instructions say, so nothing depends on the compiler:

* A jump to a symbol that is a function is a tail call; a jump to anything else stays in the function, whose graph then
  has blocks of code that other functions have too (libgcc's `__prologue_saves__`, for instance).
* `rcall .+0` makes room for two bytes on the stack and is no call: an instruction like others, which ends no block.
* Behind a call of a function that never returns nothing is followed: the block of such a call has no edge.
* What writes registers, the stack pointer or SREG by their data addresses is refused.
* Where the `ijmp` of a `switch` leads is found by `jumps`. A function with another one or with an `icall` has no bound
  (Program.unproven): it is followed as if its `icall` returned and its `ijmp` left it.
* Neither has a function with an instruction that is refused, or that leads out of the code, and it is followed up to
  there, as if it returned there; one whose calls go too deep has none either. All others are judged.

The vectors are functions too: that of interrupt N is at address 4·N, with the jump to `__vector_N` as its tail call, so
that its time is that of the interrupt from the end of the entry's four cycles.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path

from avr_timing.flow.instructions import BRANCHES, CALLS, JUMPS, RETURNS, SKIPS, decode
from avr_timing.flow.jumps import NotProvenError, Step, targets_of
from avr_timing.flow.loops import reverse_postorder
from avr_timing.flow.registers import CALL_CLOBBERED, REGISTERS, is_call, written
from avr_timing.program import REFUSED, Block, Edge, Function, Instruction, Program
from boebot.errors import AnalysisError
from boebot.image.elf import Image, Symbol, read_image

VECTORS = 26  # the reset's and 25 interrupts'
VECTOR_SIZE = 4  # bytes
CALLS_MAXIMUM = 60  # functions that call one another; each has two bytes at least on a stack of less than 2,048
CORE = {0x5D: "the stack pointer", 0x5E: "the stack pointer", 0x5F: "SREG"}  # data addresses


def load_program(path: Path) -> Program:
    """The program of an ELF file. Raises AnalysisError: not an image, or code that cannot be followed."""
    return program_of(read_image(path))


def program_of(image: Image) -> Program:
    """The program of an image. Raises AnalysisError where the code cannot be followed."""
    names = _Names(image)
    program = Program(str(image.path), {}, {}, image.bounds, image.lines)
    explorer = _Explorer(image, names, program)
    explorer.follow()
    for entry, draft in sorted(explorer.drafts.items()):
        program.functions[entry] = Function(names.of(entry), entry, _blocks(draft))
    _check_depths(program)
    for entry, function in program.functions.items():
        program.functions[entry] = replace(function, clobbers=_clobbers(program, entry))
    # Of several functions with one name, those of no file's own come first, then the first in flash.
    for symbol in sorted(image.symbols, key=lambda symbol: symbol.strength):
        if symbol.kind != "STT_OBJECT" and symbol.address in program.functions:
            program.by_name.setdefault(symbol.name, symbol.address)
    return program


def _check_depths(program: Program) -> None:
    """Refuses functions below which calls go too deep; what calls itself counts once."""
    callees = {
        entry: sorted({block.callee for block in function.blocks.values() if block.callee is not None})
        for entry, function in program.functions.items()
    }
    depths: dict[int, int] = {}
    for start in callees:
        for entry in reversed(reverse_postorder(start, callees.__getitem__)):
            if entry not in depths:
                depths[entry] = 1 + max((depths.get(callee, 0) for callee in callees[entry]), default=0)
    for entry in (entry for entry, depth in depths.items() if depth > CALLS_MAXIMUM):
        program.unproven[entry] = (
            f"{program.where(entry)}: calls go deeper than {CALLS_MAXIMUM} functions; expected no deeper call"
        )
        refused = Block(entry, (_refused(entry),), ())
        program.functions[entry] = replace(program.functions[entry], blocks={entry: refused})


def _clobbers(program: Program, entry: int) -> frozenset[int]:
    """What a call of a function changes: the compiler knows of its library's routines that they leave some registers
    alone which others need not keep."""
    below = program.below(entry)
    if not below.isdisjoint(program.unproven):
        return CALL_CLOBBERED
    own = (each for each in program.instructions(below) if not is_call(each))
    return CALL_CLOBBERED.intersection(register for each in own for register in written(each))


class _Names:
    """The symbols of an image, by address."""

    def __init__(self, image: Image) -> None:
        self.at: dict[int, list[Symbol]] = defaultdict(list)
        self.data: set[int] = set()  # addresses of constants in flash
        for symbol in image.symbols:
            if not any(symbol.address in area for area in image.executable):
                continue
            if symbol.kind == "STT_OBJECT":
                self.data.update(range(symbol.address, min(symbol.address + symbol.size, len(image.code))))
            else:
                self.at[symbol.address].append(symbol)
        self.functions = {address for address, at in self.at.items() if any(s.kind == "STT_FUNC" for s in at)}
        self._named = sorted(self.at)

    def of(self, address: int) -> str:
        """The name of a function: its own, or "PCINT1+0x9A" after the last symbol before it."""
        place = bisect_right(self._named, address) - 1
        if place < 0:
            return f"0x{address:04X}"
        before = self._named[place]
        best = min(self.at[before], key=lambda s: (s.kind != "STT_FUNC", s.strength, s.name))
        return best.name if before == address else f"{best.name}+0x{address - before:X}"


@dataclass(slots=True)
class _Flow:
    """Where an instruction leads. `ends`: its block ends with it."""

    instruction: Instruction
    edges: list[Edge]
    callee: int | None = None
    ends: bool = True


@dataclass(slots=True)
class _Draft:
    """A function while it is followed."""

    entry: int
    flows: dict[int, _Flow] = field(default_factory=dict)
    computed: dict[int, frozenset[int]] = field(default_factory=dict)  # targets so far of each ijmp


class _Explorer:
    """Follows the code until nothing new is found."""

    def __init__(self, image: Image, names: _Names, program: Program) -> None:
        self.image = image
        self.where = program.where
        self.names = names
        self.drafts: dict[int, _Draft] = {}
        self.returning: set[int] = set()  # functions known to return
        self.waiting: dict[int, list[tuple[_Draft, int]]] = defaultdict(list)  # calls and tail calls of the others
        self.work: list[tuple[_Draft, int]] = []  # addresses to follow
        self.entries = set(names.functions)
        self.unproven = program.unproven

    def follow(self) -> None:
        self._begin(self.image.entry)
        for address in self._vectors():
            self._begin(address)
        for symbol in self.image.symbols:
            if symbol.name == "main" and symbol.kind != "STT_OBJECT":
                self._begin(symbol.address)
        while self.work:
            self._follow_work()
            # Only with all other ways followed is it known which ways lead to a computed jump.
            for draft in list(self.drafts.values()):
                for address in list(draft.computed):
                    self._compute(draft, address)

    def _follow_work(self) -> None:
        while self.work:
            draft, address = self.work.pop()
            while address not in draft.flows:
                try:
                    flow = draft.flows[address] = self._flow(draft, address)
                    if flow.ends:
                        self._leave(draft, flow)
                        break
                    address = flow.edges[0].to
                except AnalysisError as error:
                    self._give_up(draft, address, error)

    def _begin(self, entry: int) -> None:
        if entry not in self.drafts:
            draft = _Draft(entry)
            self.drafts[entry] = draft
            self.work.append((draft, entry))

    def _vectors(self) -> list[int]:
        """The interrupt vectors in use, as byte addresses. Others restart the program, as avr-libc fills them."""
        first = decode(self.image.code, 0)
        if self.image.entry != 0 or first is None or first.mnemonic not in JUMPS:
            return []
        if first.operands[0] < VECTORS * VECTOR_SIZE:
            return []  # a program without a table of vectors
        used = []
        for address in range(VECTOR_SIZE, VECTORS * VECTOR_SIZE, VECTOR_SIZE):
            jump = decode(self.image.code, address)
            if jump is None or not self._restarts(jump):
                used.append(address)
                if jump is not None and jump.mnemonic in JUMPS:
                    self.entries.add(jump.operands[0])
        return used

    def _restarts(self, instruction: Instruction) -> bool:
        """Whether it jumps to address 0, at once or by one more jump."""
        for _ in range(2):
            if instruction.mnemonic not in JUMPS:
                return False
            if instruction.operands[0] == 0:
                return True
            after = decode(self.image.code, instruction.operands[0])
            if after is None:
                return False
            instruction = after
        return instruction.mnemonic in JUMPS and instruction.operands[0] == 0

    def _flow(self, draft: _Draft, address: int) -> _Flow:
        """The instruction at an address and the ways that it has."""
        instruction = self._decode(draft, address)
        name, behind = instruction.mnemonic, address + instruction.size
        if name in BRANCHES:
            return _Flow(instruction, [Edge(behind, 1), Edge(instruction.operands[0], 2)])
        if name in SKIPS:
            size = self._decode(draft, behind).size
            return _Flow(instruction, [Edge(behind, 1), Edge(behind + size, 1 + size // 2)])
        if name in JUMPS:
            target = instruction.operands[0]
            if target in self.entries and target != draft.entry:
                return _Flow(instruction, [], target)
            return _Flow(instruction, [Edge(target, instruction.cycles)])
        if name in CALLS and not (name == "rcall" and instruction.operands[0] == behind):
            return _Flow(instruction, [], instruction.operands[0])
        if name in RETURNS:
            return _Flow(instruction, [])
        if name == "ijmp":
            draft.computed[address] = frozenset()
            return _Flow(instruction, [])
        if name == "icall":
            self._leads_anywhere(draft, instruction, "it is a pointer")
            return _Flow(instruction, [Edge(behind, instruction.cycles)])
        if name == "spm":
            raise self._refusal(address, "`spm` writes the flash, which takes no fixed time")
        if name == "sts" and (instruction.operands[0] < REGISTERS or instruction.operands[0] in CORE):
            what = CORE.get(instruction.operands[0], f"register r{instruction.operands[0]}")
            raise self._refusal(address, f"`sts` writes {what}, which cannot be followed; expected `out` or `mov`")
        return _Flow(instruction, [Edge(behind, instruction.cycles)], ends=False)

    def _leave(self, draft: _Draft, flow: _Flow) -> None:
        """Goes on where an instruction leads."""
        address = flow.instruction.address
        if flow.instruction.mnemonic in RETURNS:
            self._returns(draft.entry)
        for edge in flow.edges:
            self._check(address, edge.to)
            self.work.append((draft, edge.to))
        if flow.callee is not None:
            self._check(address, flow.callee)
            self._begin(flow.callee)
            if flow.callee in self.returning:
                self._come_back(draft, address)
            else:
                self.waiting[flow.callee].append((draft, address))

    def _returns(self, entry: int) -> None:
        """A function is known to return: what called it goes on."""
        pending = [entry]
        while pending:
            callee = pending.pop()
            if callee in self.returning:
                continue
            self.returning.add(callee)
            for draft, address in self.waiting.pop(callee, ()):
                if draft.flows[address].instruction.mnemonic in JUMPS:
                    pending.append(draft.entry)
                else:
                    self._come_back(draft, address)

    def _come_back(self, draft: _Draft, address: int) -> None:
        """A call returns: its function goes on behind it; a tail call's returns itself."""
        flow = draft.flows[address]
        if flow.instruction.mnemonic in JUMPS:
            self._returns(draft.entry)
        elif not flow.edges:
            behind = address + flow.instruction.size
            flow.edges.append(Edge(behind, flow.instruction.cycles))
            self.work.append((draft, behind))

    def _compute(self, draft: _Draft, address: int) -> None:
        """Finds where an `ijmp` leads, and goes on there where that is new."""
        instruction = draft.flows[address].instruction
        try:
            targets = targets_of(self.image.code, self._way_to(draft, address))
            if wild := [target for target in targets if not self._is_code(target)]:
                raise NotProvenError(f"one way leads out of the code, to 0x{wild[0]:04X}")
        except NotProvenError as error:
            self._leads_anywhere(draft, instruction, str(error))
            del draft.computed[address]
            self._returns(draft.entry)
            return
        if targets != draft.computed[address]:
            draft.computed[address] = targets
            draft.flows[address] = _Flow(instruction, [Edge(to, instruction.cycles) for to in sorted(targets)])
            self._leave(draft, draft.flows[address])

    def _leads_anywhere(self, draft: _Draft, instruction: Instruction, why: str) -> None:
        """Notes that it is not known where a computed jump or call leads."""
        text = f"where `{instruction.mnemonic}` leads cannot be proven: {why}; expected a call by name"
        self.unproven[draft.entry] = str(self._refusal(instruction.address, f"{text}, or a table with a limited index"))

    def _way_to(self, draft: _Draft, address: int) -> list[Step]:
        """The instructions that always run before the one at `address`, as far back as there is only one way."""
        before: dict[int, set[int]] = defaultdict(set)
        for place, flow in draft.flows.items():
            for edge in flow.edges:
                before[edge.to].add(place)
        way: list[Step] = []
        seen = {address}
        at = address
        while at != draft.entry and len(before[at]) == 1:
            (previous,) = before[at]
            if previous in seen:
                break
            way.append(Step(draft.flows[previous].instruction, at))
            seen.add(previous)
            at = previous
        return way[::-1]

    def _give_up(self, draft: _Draft, address: int, why: AnalysisError) -> None:
        """Ends a function in front of an instruction that is refused, and notes it."""
        self.unproven.setdefault(draft.entry, str(why))
        draft.flows[address] = _Flow(_refused(address), [])
        self._returns(draft.entry)

    def _decode(self, draft: _Draft, address: int) -> Instruction:
        instruction = decode(self.image.code, address)
        if instruction is None or not self._is_code(address):
            text = self.image.code[address : address + 2]
            what = f"0x{int.from_bytes(text, 'little'):04X} is no instruction" if len(text) == 2 else "there is no code"
            raise self._refusal(address, f"{what}, but {self.names.of(draft.entry)} leads there")
        if address in self.names.data:
            raise self._refusal(address, f"a constant lies there, but {self.names.of(draft.entry)} leads there")
        return instruction

    def _is_code(self, address: int) -> bool:
        return any(address in area for area in self.image.executable)

    def _check(self, address: int, target: int) -> None:
        if not self._is_code(target):
            raise self._refusal(address, f"leads out of the code, to 0x{target:04X}")

    def _refusal(self, address: int, text: str) -> AnalysisError:
        known = address in self.image.lines
        place = self.where(address) if known else f"0x{address:04X} (in {self.names.of(address)})"
        return AnalysisError(f"{self.image.path}: {place}: {text}")


def _refused(address: int) -> Instruction:
    return Instruction(address, 2, REFUSED, (), 0)


def _blocks(draft: _Draft) -> dict[int, Block]:
    """Cuts what was followed where ways meet or part."""
    starts = {draft.entry}
    for flow in draft.flows.values():
        if flow.ends:
            starts.update(edge.to for edge in flow.edges)
    blocks = {}
    for start in sorted(starts):
        flow = draft.flows[start]
        instructions = [flow.instruction]
        while not flow.ends and flow.edges[0].to not in starts:
            flow = draft.flows[flow.edges[0].to]
            instructions.append(flow.instruction)
        last_cycles = 0 if flow.edges else flow.instruction.cycles
        blocks[start] = Block(start, tuple(instructions), tuple(flow.edges), flow.callee, last_cycles)
    return blocks
