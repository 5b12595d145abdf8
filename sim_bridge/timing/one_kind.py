"""A line full of one kind of message, in the emulator: how many frames are worked off, what is lost, how long a poll of
the link takes at most, and how many bytes wait in the receive ring.

The rest of the load is that of the scenario "saturated". Messages are made so that they are carried out, each with
other numbers than the one before; but an open and a close, which would end the session, are refused ones, and only the
first request to save finds nothing being saved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from boebot import robots
from boebot.errors import BoardError
from boebot.link import messages
from boebot.robots import RobotDescription
from boebot.timing.elf import read_image
from sim_bridge.boards import avr
from sim_bridge.timing.line import Line
from sim_bridge.timing.loads import TICK_CYCLES, Bench, Ping
from sim_bridge.timing.losses import losses
from sim_bridge.timing.measure import CLOCK_HZ
from sim_bridge.timing.scenarios import built, numbers_of, prepare, turn
from sim_bridge.timing.watched import watched

SCENARIO = "saturated"
COUNTED_WITHIN = 80 * TICK_CYCLES  # the board's counters come so often
DRAIN = 3 * TICK_CYCLES
ALIVE = 2 * TICK_CYCLES
NO_EVENT = 0  # number of an event that there never is
RECEIVE_HEAD, RECEIVE_TAIL = 0x4A, 0x48  # GPIOR1 and OCR0B in data space: indices of the receive ring (hal_avr.h)
SPEED_MAXIMA = (1_700, 1_701)
TO_BOARD = tuple(kind for kind in messages.MESSAGES.values() if kind.ID < messages.Hello.ID)
DEVICES = messages.Devices
SWITCHED_ON = DEVICES.SERVOS | DEVICES.ENCODERS | DEVICES.WHISKERS | DEVICES.INFRARED | DEVICES.PING
SWITCHED_ON |= DEVICES.TURRET | DEVICES.BUZZER

Make = Callable[[Line, int], Any]
_MAKE: dict[type[Any], Make] = {
    messages.Open: lambda line, n: messages.Open(messages.PROTOCOL_VERSION, n, 1),
    messages.Identify: lambda line, n: messages.Identify(),
    messages.Describe: lambda line, n: messages.Describe(n % 28, _nonce(line)),
    messages.Stop: lambda line, n: messages.Stop(n % 256),
    messages.Close: lambda line, n: messages.Close(0),
    messages.SetpointSignal: lambda line, n: messages.SetpointSignal(-_signal(n), _signal(n), 250, line.tick),
    messages.SetpointSpeed: lambda line, n: messages.SetpointSpeed(-_signal(n) // 6, _signal(n) // 6, 250, line.tick),
    messages.SetpointCoast: lambda line, n: messages.SetpointCoast(250, line.tick),
    messages.Turret: lambda line, n: messages.Turret(_signal(n), 1),
    messages.Buzzer: lambda line, n: messages.Buzzer(40 + n * 97 % 7_961, 100, n % 255 + 1),
    messages.GetParameter: lambda line, n: line.numbered(messages.GetParameter, n % 24),
    messages.SetParameter: lambda line, n: line.numbered(
        messages.SetParameter, messages.PARAMETERS["wheel_speed_maximum"].id, SPEED_MAXIMA[n % 2]
    ),
    messages.SaveParameters: lambda line, n: line.numbered(messages.SaveParameters),
    messages.ResetParameters: lambda line, n: line.numbered(messages.ResetParameters),
    messages.Arm: lambda line, n: line.numbered(messages.Arm, line.newest.latches if line.newest else 0),
    messages.Acknowledge: lambda line, n: messages.Acknowledge(n % 65_536),
    messages.ClockProbe: lambda line, n: messages.ClockProbe(n % 65_536),
}


def _nonce(line: Line) -> int:
    """The board's, as its last hello named it."""
    return next(
        heard.message.board_nonce for heard in reversed(line.heard) if isinstance(heard.message, messages.Hello)
    )


def _signal(n: int) -> int:
    """One after another of -10,000 to 10,000."""
    return n * 7_919 % 20_001 - 10_000


@dataclass(frozen=True, slots=True)
class Carried:
    """What became of a line full of one message, and of the few that a host cannot leave out.

    `poll`: cycles of the longest poll of the link, without interrupts; `waiting`: most bytes that were seen in the
    receive ring, looked at each half millisecond.
    """

    message: str
    per_tick: float  # frames that came
    sent: int
    good: int  # taken as whole frames
    frames_lost: int
    bytes_lost: int
    poll: int
    waiting: int


class _Host:
    """See Source: frames of one kind back to back, until `last`; and by all that time now and then another one, without
    which the session would end."""

    def __init__(self, line: Line, make: Make, first: int, last: int) -> None:
        self._line, self._make, self._first, self._last = line, make, first, last
        self._alive = first
        self._numbers = count()

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        while (at := max(self._first, self._line.free, bench.now)) < until:
            if at >= self._alive:
                self._alive += ALIVE
                self._line.send(messages.Acknowledge(NO_EVENT), at)
            elif at < self._last:
                self._line.send(self._make(self._line, next(self._numbers)), at)
            else:
                return


def carry(image: Path, robot: RobotDescription, kind: type[Any], seconds: float, seed: int = 1) -> Carried:
    """A line full of a message for that long, of the board's time, after the preparations.

    Raises:
        BoardError: it is no message to the board; the program crashed or hung; its link has no poll to look at.
        TimingError: the image is no ELF file of a program.
    """
    if kind not in _MAKE:
        raise BoardError(f"{kind.__name__} is no message to the board")
    what = watched(read_image(image))
    if what.poll_id is None:
        raise BoardError(f"{image.name} has no function link_poll, so its polls cannot be timed")
    board = avr.create(image)
    board.record(what.watch)
    with Bench(image, board.access()) as bench:
        line = prepare(bench, robot, SCENARIO)
        line.set("devices", int(built(robot) & SWITCHED_ON))
        line.set("session_time_out", messages.PARAMETERS["session_time_out"].maximum)  # most frames may get lost
        numbers = numbers_of(seed)
        before, sent = _counted(line).good, line.sent
        start = bench.now + 2_000
        wheels = turn(bench, robot, SCENARIO, numbers, start)
        for device in robot.device.values():
            if isinstance(device, robots.Ping):
                bench.sources.append(Ping(robots.pin_number(device.pin), step=23_459 + numbers.echo))
        first = start + numbers.line
        last = first + round(seconds * CLOCK_HZ)
        bench.sources.append(_Host(line, _MAKE[kind], first, last))
        seen = _Seen(bench)
        bench.run_until(last)
        per_tick = (line.sent - sent) * TICK_CYCLES / (last - first)
        bench.sources[:] = [source for source in bench.sources if isinstance(source, Ping | _Host)]
        bench.run(DRAIN)
        polls = board.spans()
        board.stop_recording()
        lost = losses(line, wheels, SCENARIO)
        bench.sources[:] = [source for source in bench.sources if isinstance(source, Ping)]
        of_poll = polls[(polls["id"] == what.poll_id) & (polls["begin"] >= start)]
        return Carried(
            message=kind.__name__,
            per_tick=per_tick,
            sent=line.sent - sent,
            good=(_counted(line).good - before) % 65_536,
            frames_lost=lost.frames,
            bytes_lost=lost.bytes,
            poll=int(of_poll["net"].max(initial=0)),
            waiting=seen.most,
        )


class _Seen:
    """The most bytes in the receive ring, seen after each slice of time."""

    def __init__(self, bench: Bench) -> None:
        self._access, self.most = bench.access, 0
        bench.after_slice.append(self._look)

    def _look(self) -> None:
        head, tail = (self._access.read_memory(address, 1)[0] for address in (RECEIVE_HEAD, RECEIVE_TAIL))
        self.most = max(self.most, (head - tail) % 256)


def _counted(line: Line) -> messages.Counters:
    """What the board has counted, when nothing has come for a while. Raises BoardError: it does not say it."""
    since = len(line.heard)
    line.bench.run(COUNTED_WITHIN)
    line.wait(messages.Counters, since)
    return [heard.message for heard in line.heard if isinstance(heard.message, messages.Counters)][-1]
