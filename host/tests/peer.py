"""A stand-in for a board: speaks the protocol from the other end and drives a point about a square room.

It is written from PROTOCOL.md for the host's own tests, which need no simulator. `InProcess` lets it live in
simulated time; `Pty` puts it on a real pseudo-terminal, in a thread.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import threading
import time
import tty
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from boebot.boards import Truth
from boebot.errors import BoardError
from boebot.link import frame, messages
from boebot.robots import RobotDescription, load_robot

TICK_S = 0.01
TELEMETRY_AFTER_S = 0.001  # from a tick's start to the end of its telemetry on the wire
ROOM_M = 1.5


class Peer:
    """The board's side. Feed it bytes with `receive`; `tick()` makes one control tick and returns what it
    sends.
    """

    def __init__(self, robot: RobotDescription | None = None) -> None:
        self.robot = robot or load_robot("shieldbot")
        self.protocol_version = messages.PROTOCOL_VERSION
        self.schema_hash = messages.SCHEMA_HASH
        self.pin_map = self.robot.pin_map
        self.tick_rate = 100
        self.answers = True
        self.parameters: dict[int, int] = {}
        self.setpoints: list[messages.SetpointSignal | messages.SetpointSpeed | messages.Stop] = []
        self.setpoint_ticks: list[int] = []
        self.x = self.y = ROOM_M / 2
        self.heading = 0.3
        self.path: list[tuple[float, float, float, float, bool]] = []
        self.starts = 0
        self.reset()

    def reset(self) -> None:
        """Power on."""
        self.ticks = 0
        self.starts += 1
        self.decoder = frame.Decoder(frame.TO_BOARD)
        self._sequence = 0
        self._out = b""
        self._edges = [0.0, 0.0]
        self.command = (0.0, 0.0)
        self.live_until = 0
        self.status = messages.Status.STOPPED
        self._setpoint_sequence = 0
        if self.answers:
            self._hello()

    def receive(self, data: bytes) -> None:
        """Takes bytes from the host."""
        for message_id, sequence, payload in self.decoder.feed(data):
            message = messages.MESSAGES[message_id].unpack(payload)
            if not self.answers:
                continue
            if isinstance(message, messages.HelloRequest):
                self._hello()
            elif isinstance(message, messages.Identify):
                self._send(messages.Identity(b"0.1.0", b"peer", 0, 0))
            elif isinstance(message, messages.SetParameter):
                self.parameters[message.parameter] = message.value
                self._send(messages.Parameter(message.parameter, message.value, 0))
            elif isinstance(message, messages.GetParameter):
                self._send(messages.Parameter(message.parameter, self.parameters.get(message.parameter, 0), 0))
            elif isinstance(message, messages.SetpointSignal | messages.SetpointSpeed | messages.Stop):
                self.setpoints.append(message)
                self.setpoint_ticks.append(self.ticks)
                self._setpoint_sequence = sequence
                if isinstance(message, messages.Stop):
                    self.command, self.status = (0.0, 0.0), messages.Status.STOPPED
                else:
                    full = 10000 if isinstance(message, messages.SetpointSignal) else 1700
                    self.command = (message.left / full, message.right / full)
                    self.live_until = self.ticks + math.ceil(message.time_to_live / 10)
                    self.status = messages.Status.MOTORS_ENABLED

    def answer(self) -> bytes:
        """What was asked for since last time."""
        out, self._out = self._out, b""
        return out

    def tick(self) -> bytes:
        """One control tick: moves the robot and returns its telemetry."""
        if self.status == messages.Status.MOTORS_ENABLED and self.ticks > self.live_until:
            self.command, self.status = (0.0, 0.0), messages.Status.DEAD_MAN
        touching = self._move()
        self.path.append((self.ticks * TICK_S, self.x, self.y, self.heading, touching))
        ahead = self._ahead()
        seen = 3 if ahead < 0.2 else 0
        self._send(
            messages.Telemetry(
                tick=self.ticks,
                time=self.ticks * 10_000 & 0xFFFFFFFF,
                encoder_left=int(self._edges[0]),
                encoder_right=int(self._edges[1]),
                edge_period_left=0,
                edge_period_right=0,
                whiskers=3 if touching else 0,
                infrared=seen,
                infrared_age=self.ticks % 5,
                ping_echo=round(ahead * 2 / 343.5 * 1e6) if ahead < 3.0 else 0,
                ping_age=self.ticks % 5,
                pulse_left=self._pulse(self.command[0], 200),
                pulse_right=self._pulse(self.command[1], -200),
                status=int(self.status),
                setpoint_sequence=self._setpoint_sequence,
                frames_bad=self.decoder.bad & 0xFF,
                overruns=0,
            )
        )
        self.ticks += 1
        return self.answer()

    def truth(self) -> Truth:
        """Where the robot was."""
        time_s, x, y, heading, contact = np.array(self.path or [(0, self.x, self.y, self.heading, False)]).T
        corners = np.array([(0, 0), (ROOM_M, 0), (ROOM_M, ROOM_M), (0, ROOM_M)], dtype=np.float64)
        return Truth(
            time=time_s,
            x=x,
            y=y,
            heading=heading,
            contact=contact.astype(bool),
            arena_name="square",
            outlines=[corners],
        )

    def _pulse(self, signal: float, gain_us: float) -> int:
        return round((1500 + gain_us * signal) * 16) if self.status == messages.Status.MOTORS_ENABLED else 0

    def _ahead(self) -> float:
        """Distance to the wall ahead (m)."""
        dx, dy = math.cos(self.heading), math.sin(self.heading)
        reach_x = ((ROOM_M if dx > 0 else 0.0) - self.x) / dx if dx else math.inf
        reach_y = ((ROOM_M if dy > 0 else 0.0) - self.y) / dy if dy else math.inf
        return min(reach_x, reach_y)

    def _move(self) -> bool:
        """Advances the robot by a tick; returns whether it touches the wall."""
        left, right = (0.16 * signal * TICK_S for signal in self.command)
        self._edges = [edges + abs(way) / 0.00325 for edges, way in zip(self._edges, (left, right), strict=True)]
        self.heading += (right - left) / 0.105
        x = self.x + (left + right) / 2 * math.cos(self.heading)
        y = self.y + (left + right) / 2 * math.sin(self.heading)
        self.x, self.y = min(max(x, 0.07), ROOM_M - 0.07), min(max(y, 0.07), ROOM_M - 0.07)
        return (self.x, self.y) != (x, y)

    def _hello(self) -> None:
        self._send(
            messages.Hello(
                self.protocol_version,
                self.schema_hash,
                self.tick_rate,
                31,
                messages.ResetCause.POWER,
                self.pin_map.encode(),
            )
        )

    def _send(self, message: messages.Message) -> None:
        self._out += frame.encode(message.ID, self._sequence, message.pack())
        self._sequence = (self._sequence + 1) & 0xFF


class InProcess:
    """A board session in simulated time: transport and session in one."""

    name = "peer"
    realtime = False
    description = "stand-in board"

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.closed = False
        self.before_tick: Callable[[int], None] = lambda _: None
        self._now = 0.0
        self._buffer = b""
        self._next_tick_s = 0.0

    @property
    def transport(self) -> InProcess:
        return self

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        end = self._now + wait_s
        look = self._now + quiet_s
        self._buffer += self.peer.answer()
        while True:
            if self._buffer and self._now >= look:
                data, self._buffer = self._buffer, b""
                return data
            event = self._next_tick_s + TELEMETRY_AFTER_S
            if event > end and not (self._buffer and look <= end):
                self._now = end
                return b""
            if self._buffer and look <= event:
                self._now = max(self._now, look)
                continue
            self._now = max(self._now, event)
            self.before_tick(self.peer.ticks)
            self._buffer += self.peer.tick()
            self._next_tick_s += TICK_S

    def write(self, data: bytes) -> None:
        if self.closed:
            raise BoardError("peer has gone")
        self.peer.receive(data)

    def now(self) -> float:
        return self._now

    def truth(self) -> Truth | None:
        return self.peer.truth()

    def counters(self) -> Mapping[str, float]:
        return {}

    def close(self) -> None:
        self.closed = True


class Pty:
    """The peer behind a pseudo-terminal, ticking by the wall clock in a thread."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._running = True
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Ends the board's side, as when a cable is pulled."""
        if self._running:
            self._running = False
            self._thread.join()
            os.close(self._master)
            os.close(self._slave)

    def _serve(self) -> None:
        next_tick = time.monotonic()
        while self._running:
            wait = next_tick - time.monotonic()
            if wait > 0 and select.select([self._master], [], [], wait)[0]:
                self.peer.receive(os.read(self._master, 4096))
                self._write(self.peer.answer())
            if time.monotonic() >= next_tick:
                self._write(self.peer.tick())
                next_tick += TICK_S

    def _write(self, data: bytes) -> None:
        if data and select.select([], [self._master], [], 0)[1]:  # nobody listens: the line's buffer is full
            os.write(self._master, data)


@contextlib.contextmanager
def pty(peer: Peer) -> Iterator[Pty]:
    """A peer on a pseudo-terminal for as long as the block lasts."""
    served = Pty(peer)
    try:
        yield served
    finally:
        served.unplug()
