"""An emulated board with a program, and nothing around it or the world of a robot: it runs to a cycle or to an edge,
its pins are driven and looked at, and what reacts to an edge does so at the edge's own cycle.

Times are cycles of the board's clock (62.5 ns) since power-on, pins Arduino numbers (A0 is 14). A run is a function of
what the bench is made of and of what is done to it. How it is cut into calls does not matter where edges are driven and
bytes are sent at a cycle (`at`) that lies 64 cycles ahead, or in a reaction.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Protocol, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.boards import BoardRequest
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import CallError
from boebot.record.blocks import Group, merged
from boebot.record.record import Record
from sim_bridge.boards.board import EDGE, FRAME, LEVELS, Edge, EmulatedBoard, Reaction
from sim_bridge.pins import EDGES_KEPT, streams_of
from sim_bridge.sessions.world import KINDS, open_on

SLICE_CYCLES = 8_000  # 0.5 ms, between two chances for sources
BARE = "bare"
AHEAD_CYCLES = 512  # what is queued for the next slice is queued so much before (BOARD_GUARD_CYCLES at least)
LONGEST_CYCLES = 160_000  # of a slice: all edges in it are fewer than the simulator keeps


class Source(Protocol):
    """What acts on a board from outside, time and again."""

    def queue(self, bench: Bench, until: int) -> None:
        """Queues what it does up to that cycle; what happened up to now is known."""


class EdgeLog:
    """All edges of a bench, oldest first, and those of each pin, sorted out where somebody asks for it: each once, so
    that a wait that looks again and again takes no longer in a long run."""

    def __init__(self, new: Callable[[], NDArray[Any]]) -> None:
        """`new`: takes the edges (dtype EDGE) since it was last called."""
        self._new = new
        self._pieces: list[NDArray[Any]] = []
        self._found: dict[int, tuple[int, list[Edge]]] = {}

    def take(self) -> None:
        """Takes what is new."""
        if len(piece := self._new()):
            self._pieces.append(piece)

    def all(self) -> NDArray[Any]:
        """Of all pins (dtype EDGE)."""
        self.take()
        return np.concatenate([np.empty(0, EDGE), *self._pieces])

    def __getitem__(self, pin: int) -> list[Edge]:
        self.take()
        seen, found = self._found.get(pin, (0, []))
        for piece in self._pieces[seen:]:
            of_pin = piece[piece["pin"] == pin]
            found += [Edge(cycle, pin, LEVELS[level]) for cycle, _, level in of_pin.tolist()]
        self._found[pin] = (len(self._pieces), found)
        return found


@cache
def bare(robot: str) -> RobotDescription:
    """A robot of which there is only the board: nothing is at its pins, it has 5 V, and nothing drives it anywhere."""
    own = {"name": BARE, "title": "a board by itself"}
    return msgspec.structs.replace(load_robot(robot), **own, device={}, supply=None, imperfections={})


class Bench:
    """A board, powered on.

    Attributes:
        session: what the host opens (BoardSession), with its serial line, `session.transport`: while somebody waits
            there, whatever is on the bench goes on.
        board, robot, pins: the board itself, the robot that it is on, and what a test reaches for (sim_bridge/pins.py).
        edges: what the firmware did to each pin, from the beginning: `edges[13]`.
        driven: what the outside did, likewise; empty of a native board, which cannot be seen into.
        mark: the cycle of the last event that was waited for, or that the test itself made.
        sources: what acts on the board from outside: each queues what it does before each slice of time.
        after_slice: who is called whenever time has passed.
        forget: is called where the test has done something: what the board has said until then is no answer to it.
    """

    def __init__(
        self,
        image: Path | str | None = None,
        *,
        on: str = "avr",
        robot: RobotDescription | str | None = None,
        arena: str = "empty",
        noise: bool = False,
        **request: Any,
    ) -> None:
        """Powers on a board.

        Args:
            image: ELF or HEX file of its program; None: the kit's firmware.
            on: avr or native; the native board runs the kit's firmware only.
            robot: on which it is, in the world; None: it is alone.
            request: what else a BoardRequest has: seed, bootloader, imperfections, strict and so on.

        Raises:
            CallError: there is no such board.
            BoardError, RobotError, ArenaError: as of a run.
        """
        if on not in KINDS:
            raise CallError(f"there is no board {on!r} for a bench; expected {' or '.join(KINDS)}")
        described = load_robot(robot) if isinstance(robot, str) else robot or bare("shieldbot")
        program = None if image is None else str(image)
        asked = BoardRequest(robot=described, image=program, arena=arena, noise=noise, **request)
        self.session = open_on(KINDS[on], asked)
        self.session.transport.stamp()
        self.session.transport.wait = lambda robot, cycles, quiet: self.run_until(self.now + cycles)
        self.pins, self.robot, self.mark = self.session.board, self.session.robot, 0
        self.robot.touched = self.acted
        self.board: EmulatedBoard = self.pins.board
        self.edges, self.driven = EdgeLog(self._new_edges), EdgeLog(self._new_driven)
        self.after_slice: list[Callable[[], None]] = []
        self.forget: Callable[[], object] = int
        self.sources: list[Source] = []
        self.pins.log_outside()
        self._frames: dict[str, list[NDArray[Any]]] = {"to_board": [], "from_board": []}
        self._edge_count = self._queued = 0
        self._record = Record()  # but for what is in the logs

    @property
    def name(self) -> str:
        """Of its program's file."""
        return self.board.elf.name if self.board.elf else self.board.description

    # ---- time --------------------------------------------------------------------------------------------------------

    @property
    def now(self) -> int:
        """The cycle up to which the board has run; in a reaction that of the edge."""
        board = self.board.handle
        return int(board.op.now(board)) if self.board.reacts_at is None else self.board.reacts_at

    def run_until(self, cycle: int, *, edge_of: Collection[int] = ()) -> bool:
        """Lets time pass up to that cycle, or to an edge of one of these pins, by firmware or outside: True then.
        Time stands behind the instruction that it meets, at most 3 cycles later; its cycle is in the log. What is
        to answer at once is a reaction (`on_edge`).

        Raises:
            BoardError: the program crashed, or a reaction lets time pass.
        """
        while (now := self.now) < cycle:
            self.session.sim.do_due()
            longest = SLICE_CYCLES if self.sources or self.after_slice else LONGEST_CYCLES
            end = min(cycle, now + longest, self.session.sim.next_due)
            if end + AHEAD_CYCLES > self._queued:
                self._queued = end + AHEAD_CYCLES
                for source in self.sources:
                    source.queue(self, self._queued)
            met = self.robot.run_to_edge(end, edge_of)
            if self.pins.edge_count - self._edge_count > EDGES_KEPT // 4:  # before the simulator forgets them
                self.edges.take()
            for look in self.after_slice:
                look()
            if met:
                return True
        self.session.sim.do_due()
        return False

    def run(self, cycles: int) -> None:
        """Lets `cycles` pass."""
        self.mark = self.now + cycles
        self.run_until(self.mark)

    def at(self, cycle: int, action: Callable[[], object]) -> None:
        """Calls `action` when that cycle has come; it may let no time pass."""
        self.session.sim.at(cycle, action)

    # ---- what the outside does ---------------------------------------------------------------------------------------

    def acted(self) -> None:
        """The test has done something to the board: the mark. In a reaction it was a part that did."""
        if self.board.reacts_at is None:
            self.mark = self.now
            self.forget()

    def on_edge(self, pin: int, react: Reaction) -> None:
        """Calls `react(cycle, level)` at each edge that the firmware makes at a pin, at its cycle."""
        self.board.on_edge(pin, react)

    def drive(self, pin: int, level: int, at: int = 0) -> None:
        """From cycle `at` (or now) on the outside drives a pin to LOW 0, HIGH 1, or RELEASED 2, and no part does any
        more; replaces what was queued for it from then on."""
        self.pins.drive(pin, level, at)

    def wave(self, pin: int, cycles: Sequence[int] | NDArray[Any], level: int) -> None:
        """Drives a pin to `level` (LOW, HIGH) at the first of these cycles, to the other one at the next, and so on."""
        levels = (np.arange(len(cycles)) + int(level)) % 2
        self.pins.drive_edges(pin, np.array(cycles, np.uint64), levels.astype(np.uint8))

    def send(self, data: bytes, at: int = 0) -> None:
        """Puts bytes on the line towards the board, back to back, not before cycle `at`."""
        board = self.board.handle
        board.op.send(board, at, data, len(data))

    # ---- what the board does -----------------------------------------------------------------------------------------

    def streams(self) -> Group:
        """The streams of a record that tell of its pins, its line and its robot, from the beginning."""
        log = {"pins": self.edges.all(), "driven": self.driven.all()}
        log |= {name: np.concatenate([np.empty(0, FRAME), *frames]) for name, frames in self._frames.items()}
        self._record.put(self.session.drain())
        return {**merged(list(self._record.groups())), **streams_of(log)}

    def _new_edges(self) -> NDArray[Any]:
        before, self._edge_count = self._edge_count, self.pins.edge_count
        return self.pins.pin_log(self._edge_count - before)

    def _new_driven(self) -> NDArray[Any]:
        found = self.pins.outside_log()
        for name, pieces in self._frames.items():
            pieces += [found[name]] if len(found.get(name, ())) else []
        return found.get("driven", np.empty(0, EDGE))

    def close(self) -> None:
        """Frees board and world. May be called twice."""
        self.session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
