"""Offers an emulated robot to other programs, at real-time pace: on a pseudo-terminal or on a TCP port of loopback.

To a client it is a robot on a port: `boebot run BRAIN --on /dev/pts/N`. Time also passes while no client is there. As
on a real Uno, the board is reset when a client opens the port, or switches DTR on by RFC 2217, and the client sets the
bit rate of its side of the line: at a wrong one both sides read garbage. A bare TCP port has no bit rate: it has the
robot's, or, of an Uno with a boot loader, always that of the board's registers.

The line takes bytes at its bit rate and not faster, whatever a client sends: the rest waits in a backlog of fixed size
and then at the client. A reset empties the backlog. A program that crashes stands still until the next reset.

An upload must not fail because this computer is busy: see `BootTime`.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from boebot.boards import BoardRequest, BoardSession, Visit
from boebot.errors import BoardError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.pins import RXEN0
from sim_bridge.served_ports import Port, PtyPort, TcpPort
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import KINDS, Pace, open_on

IDLE_S = 0.002  # how long the loop sleeps when no byte comes
BRISK_S = 0.0002  # and for a while after one came, so that its answer is not late
BRISK_FOR_S = 0.004
AHEAD_CYCLES = CLOCK_HZ // 100  # bytes for this time are put on the line at most
BITS_PER_BYTE = 10
LOOK_S = 0.05  # between two looks at where the robot is

LOADER_TURN_S = 0.01  # of a boot loader's time, at most, between two looks at what its client sends

Look = Callable[[BoardSession, bytes], None]


class BootTime:
    """The time of a boot loader that a client talks to: it waits a second for the next byte and starts the program
    then, but a busy computer may let the client wait longer. So it stands still as soon as the loader waits: no byte
    has gone either way for longer than it writes a page. But not for ever: before its first answer for `FIRST_S` by the
    wall clock from the reset, for that may be a serial monitor, which only listens, and then for `NEXT_S` from its last
    one; and not where the client speaks at another rate.
    """

    FIRST_S, NEXT_S = 2.0, 10.0
    QUIET = CLOCK_HZ // 50

    def __init__(self, session: SimSession) -> None:
        self._session = session
        board = session.robot.board
        self._begin, self._counter = board.begin, board.extension("program counter", "uint32_t")
        self._quiet_from = 0
        self._until_s = 0.0

    def reset(self) -> None:
        """Somebody has reset the board, and may want to write a program."""
        self._quiet_from, self._until_s = self._session.sim.cycle, time.perf_counter() + self.FIRST_S

    def went(self) -> None:
        """There is no client any more."""
        self._until_s = 0.0

    def heard(self, *, answer: bool) -> None:
        """Bytes have gone from the client, or an answer of the board's."""
        self._quiet_from = self._session.sim.cycle
        if answer and self._until_s:
            self._until_s = max(self._until_s, time.perf_counter() + self.NEXT_S)

    def is_loading(self) -> bool:
        """A client may be talking to the boot loader."""
        return time.perf_counter() < self._until_s and self._counter[0] >= self._begin

    def stands_still(self) -> bool:
        """Whether it does while that is so."""
        return self._session.sim.cycle - self._quiet_from > self.QUIET


class Server:
    """Carries bytes between a board and a port."""

    def __init__(
        self, session: SimSession, port: Port, visit: Callable[[Visit], None], *, has_bootloader: bool
    ) -> None:
        self._session, self._port, self._visit = session, port, visit
        self._sim = session.sim
        self._pace = Pace(self._sim)
        self._boot = BootTime(session) if has_bootloader else None
        self._line_free = 0  # cycle from which on the line towards the board is idle
        self._baud: int | None = 0  # of the client; None: always the board's
        self._noted = 0
        self._crashed = False

    def turn(self) -> tuple[bool, bytes]:
        """Carries what has come by now: whether the client has sent something, and what the board has."""
        for event in self._port.look():
            if event.what in ("came", "reset"):
                self._reset()
            if event.what == "went" and self._boot is not None:
                self._boot.went()
            self._visit(event)
        self._set_rate()
        boot = self._boot
        if boot is None or not (boot.is_loading() and self._is_heard()):
            self._run()
            given = self._give()
        else:  # what the client has sent comes first
            given = self._give()
            if boot.stands_still():
                self._pace.forget()
            else:
                self._pace.forget(LOADER_TURN_S)
                self._run()
        if said := self._session.robot.receive():
            self._port.write(said)
        if boot is not None and (given or said):
            boot.heard(answer=bool(said))
        return given, said

    def _reset(self) -> None:
        if not self._crashed:
            self._advance(max(0, self._line_free - self._sim.cycle))
        self._session.board.reset("external")
        self._crashed, self._line_free = False, self._sim.cycle
        if self._boot is not None:
            self._boot.reset()

    def _set_rate(self) -> None:
        baud = self._port.baud()
        if baud == self._baud or (baud is None and self._boot is None):
            return
        self._baud = baud
        if baud is None:
            self._session.transport.follow()
        else:
            self._session.transport.set_baud(baud)

    def _run(self) -> None:
        """Up to now."""
        due = self._pace.due()
        if not self._crashed:
            self._advance(due)

    def _advance(self, cycles: int) -> None:
        try:
            self._sim.run(cycles)
        except BoardError as error:
            if self._session.robot.board.fault() is None:
                raise
            self._crashed = True
            self._note()
            self._visit(Visit("notes", "the board", f"{error} It stands still until it is reset."))
        self._note()

    def _note(self) -> None:
        for sentence in (notes := self._session.notes())[self._noted :]:
            self._visit(Visit("notes", "the board", sentence))
        self._noted = len(notes)

    def _is_heard(self) -> bool:
        """The client's rate is the board's, as far as receivers can tell."""
        return self._baud is None or abs(self._session.board.bit_cycles() * self._baud / CLOCK_HZ - 1) < 0.05

    def _give(self) -> bool:
        """Puts onto the line what it takes of what the client has sent; while an Uno does not listen it waits."""
        if self._boot is not None and not self._session.board.uses_line(RXEN0):
            return False
        bit = self._session.board.bit_cycles() if self._baud is None else CLOCK_HZ // self._session.transport.baud
        byte, now = BITS_PER_BYTE * bit, self._sim.cycle
        start = max(now, self._line_free)
        data = self._port.take(max((now + AHEAD_CYCLES - start) // byte, 1 if start == now else 0))
        if data:
            self._session.robot.send(data)
            self._line_free = start + len(data) * byte
        return bool(data)


def carry(
    session: SimSession,
    port: Port,
    running: Callable[[], bool],
    visit: Callable[[Visit], None],
    look: Look | None = None,
    *,
    has_bootloader: bool = False,
) -> None:
    """Carries bytes between `session` and `port` at real-time pace until `running()` is false; `look` as of `serve`."""
    server = Server(session, port, visit, has_bootloader=has_bootloader)
    brisk_until = look_at = 0.0
    said = bytearray()  # by the board, since somebody looked last
    while running():
        is_asked, sent = server.turn()
        if is_asked:
            brisk_until = time.perf_counter() + BRISK_FOR_S
        if look is not None:
            said += sent
            if time.perf_counter() >= look_at:
                look_at = time.perf_counter() + LOOK_S
                look(session, bytes(said))
                said.clear()
        port.wait(BRISK_S if time.perf_counter() < brisk_until else IDLE_S)


def serve(
    kind: str,
    request: BoardRequest,
    *,
    tcp: int | None,
    announce: Callable[[str], None],
    visit: Callable[[Visit], None],
    running: Callable[[], bool],
    look: Look | None = None,
) -> None:
    """Serves the board of that kind ("native" or "avr") until `running()` is false or Ctrl-C (boebot.boards.Server).

    Raises:
        BoebotError: no such board or port.
    """
    if kind not in KINDS:
        raise BoardError(f"there is no emulated board {kind!r} to serve; expected one of: {', '.join(KINDS)}")
    with contextlib.ExitStack() as stack:
        session = open_on(KINDS[kind], request)
        stack.callback(session.close)
        port: Port = PtyPort(session.transport.baud) if tcp is None else TcpPort(tcp)
        stack.callback(port.close)
        announce(port.url)
        with contextlib.suppress(KeyboardInterrupt):
            carry(session, port, running, visit, look, has_bootloader=request.bootloader is not None)
