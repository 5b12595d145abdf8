"""Offers an emulated robot to other programs, at real-time pace: on a pseudo-terminal or on a TCP port of loopback.

To a client it is a robot on a port: `boebot run BRAIN --on /dev/pts/N`. Time also passes while no client is there. As
on a real Uno, the board is reset when a client opens the port, and on a pseudo-terminal the client sets the bit rate of
its side of the line: at a wrong one both sides read garbage. A TCP port has no bit rate.

The line takes bytes at its bit rate and not faster, whatever a client sends: the rest waits in a backlog of fixed size
and then at the client. A reset empties the backlog.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from boebot.boards import BoardRequest, BoardSession, Visit
from boebot.errors import BoardError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.served_ports import Port, PtyPort, TcpPort
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import AVR, NATIVE, Pace, open_on

IDLE_S = 0.002  # how long the loop sleeps when no byte comes
BRISK_S = 0.0002  # and for a while after one came, so that its answer is not late
BRISK_FOR_S = 0.004
AHEAD_CYCLES = CLOCK_HZ // 100  # bytes for this time are put on the line at most
BITS_PER_BYTE = 10
LOOK_S = 0.05  # between two looks at where the robot is

Look = Callable[[BoardSession, bytes], None]


def carry(
    session: SimSession,
    port: Port,
    running: Callable[[], bool],
    visit: Callable[[Visit], None],
    look: Look | None = None,
) -> None:
    """Carries bytes between `session` and `port` at real-time pace until `running()` is false; `look` as of `serve`.

    Raises:
        BoardError: the board's program crashed.
    """
    sim = session.sim
    pace = Pace(sim)
    line_free = 0  # cycle from which on the line towards the board is idle
    baud = None
    brisk_until = look_at = 0.0
    noted = 0
    said = bytearray()  # by the board, since somebody looked last
    while running():
        for event in port.look():
            if event.what == "came":
                sim.run(max(0, line_free - sim.cycle))
                session.board.reset("external")
            visit(event)
        if (now := port.baud()) is not None and now != baud:
            session.transport.set_baud(now)
            baud = now
        try:
            sim.run(pace.due())  # first: bytes that came meanwhile reach the board at the end of that time
        finally:  # also what was noted just before a crash
            for sentence in (notes := session.notes())[noted:]:
                visit(Visit("notes", "the board", sentence))
            noted = len(notes)
        byte = BITS_PER_BYTE * CLOCK_HZ // session.transport.baud
        start = max(sim.cycle, line_free)
        if data := port.take(max((sim.cycle + AHEAD_CYCLES - start) // byte, 1 if start == sim.cycle else 0)):
            session.robot.send(data)
            line_free = start + len(data) * byte
            brisk_until = time.monotonic() + BRISK_FOR_S
        if data := session.robot.receive():
            port.write(data)
            if look is not None:
                said += data
        if look is not None and time.monotonic() >= look_at:
            look_at = time.monotonic() + LOOK_S
            look(session, bytes(said))
            said.clear()
        port.wait(BRISK_S if time.monotonic() < brisk_until else IDLE_S)


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
        BoebotError: no such board or port, or the board's program crashed.
    """
    kinds = {board.name: board for board in (NATIVE, AVR)}
    if kind not in kinds:
        raise BoardError(f"there is no emulated board {kind!r} to serve; expected one of: {', '.join(kinds)}")
    with contextlib.ExitStack() as stack:
        session = open_on(kinds[kind], request)
        stack.callback(session.close)
        port: Port = PtyPort(session.transport.baud) if tcp is None else TcpPort(tcp)
        stack.callback(port.close)
        announce(port.url)
        with contextlib.suppress(KeyboardInterrupt):
            carry(session, port, running, visit, look)
