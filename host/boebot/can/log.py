"""A run as a log of CAN frames that stock tools open, and such a log as a run.

A run's record holds the bytes of its line; the frames are made from them as a bridge makes them, whether the run went
over CAN or not. A log has no host times, no seed and no interventions: a brain that goes by them cannot be replayed.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from boebot.can.extra import import_extra
from boebot.can.frames import PARTS, Assembler, CanFrame, CanMessage, ForeignFrameError, whole_tick
from boebot.can.iso_tp import LongMessages
from boebot.can.layout import NODE_SHIFT
from boebot.can.translator import BoardEnd, HostEnd
from boebot.description.board_parameters import adapted
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import BoebotError
from boebot.link import messages
from boebot.link.fields import text
from boebot.record.record import Record
from boebot.record.result import RunResult
from boebot.robot import Command

KINDS = ("blf", "asc", "log")
"""Formats, by suffix: Vector's binary and text, candump's. python-can's others lose data."""

_PER_UNIT = 10_000  # counts of a set-point per unit
_SET_POINTS = {messages.SetpointSignal.ID: "signal", messages.SetpointSpeed.ID: "speed"}
_PARAMETER = {spec.id: (name, spec.scale) for name, spec in messages.PARAMETERS.items()}


class Sent(NamedTuple):
    """A frame of a log."""

    time_s: float
    frame: CanFrame


# ---- a run as a log --------------------------------------------------------------------------------------------------


def frames_of(result: RunResult, node: int = 1) -> Iterator[Sent]:
    """The CAN frames of a run on a board, oldest first; times from the first byte on.

    Raises:
        BoebotError: the robot has no board.
    """
    record = result.record
    if not record.count("to_host"):
        raise BoebotError(f"robot {result.robot.name!r} has no line in this run, so no CAN frames")
    pending: list[CanFrame] = []
    long_from_board = LongMessages(node, pending.append, at_board=True)
    long_from_host = LongMessages(node, pending.append, at_board=False)
    board = BoardEnd(node, long_from_board.send)
    host = HostEnd(node, long_from_host.send)
    rows = heapq.merge(
        ((time_s, 0, data) for time_s, data in record.each_row("to_host")),
        ((time_s, 1, data) for time_s, data in record.each_row("to_board")),
    )
    begin_s = None
    for time_s, to_board, data in rows:
        begin_s = time_s if begin_s is None else begin_s
        pending += host.from_link(data) if to_board else board.from_board(data)
        while pending:
            frame = pending.pop(0)
            yield Sent(time_s - begin_s, frame)
            for end in (long_from_board, long_from_host):
                if frame.identifier == end.listens_to:
                    end.receive(frame)  # it answers by flow control


def save_log(result: RunResult, path: Path, node: int = 1) -> Path:
    """Writes a run's CAN frames; the format is by the suffix, one of `KINDS`.

    Raises:
        BoebotError: there are none, or the file cannot be written.
    """
    can = import_extra("can")
    partial = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        with can.Logger(str(partial)) as log:
            for time_s, frame in frames_of(result, node):
                log.on_message_received(
                    can.Message(
                        timestamp=time_s,
                        arbitration_id=frame.identifier,
                        is_extended_id=False,
                        data=frame.data,
                        channel=0,
                        is_rx=bool(frame.identifier & 1),
                    )
                )
        partial.replace(path)
    except OSError as error:
        raise BoebotError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
    finally:
        partial.unlink(missing_ok=True)
    return path


# ---- a log as a run --------------------------------------------------------------------------------------------------


def is_log(path: Path) -> bool:
    """Whether a file is such a log, by its name."""
    return path.suffix[1:].lower() in KINDS


def read_log(path: Path, robot: str | None = None, node: int | None = None, seed: int = 1) -> RunResult:
    """The run in a log of CAN frames, as far as it shows there.

    Args:
        path: of the log.
        robot: its name or file; None: as the board's hello says.
        node: the board's; None: the only one of the log.
        seed: of the brain's chance, which no log shows.

    Raises:
        BoebotError: it cannot be read, has no hello of a board or no set-points, or several boards and no `node`.
    """
    sent = _read(path)
    node = _only_node(path, sent) if node is None else node
    reader = _LogReader(node)
    for one in sent:
        reader.take(one)
    if reader.hello is None:
        raise BoebotError(f"{path} has no hello of a board as node {node}; expected a log from before the run began")
    if not reader.commands:
        raise BoebotError(f"{path} has no set-points for node {node}: nobody drove the robot")
    described = load_robot(robot or text(reader.hello.robot))
    return reader.result(path, adapted(described, _known(described, reader.parameters)), seed)


def as_on_the_wire(command: Command) -> Command:
    """A command as its set-point carries it: in counts of 0.0001."""
    return Command(command.kind, *(round(value * _PER_UNIT) / _PER_UNIT for value in command[1:]))


def _read(path: Path) -> list[Sent]:
    can = import_extra("can")
    try:
        with can.LogReader(str(path)) as log:
            return [
                Sent(message.timestamp, CanFrame(message.arbitration_id, bytes(message.data)))
                for message in log
                if not (message.is_error_frame or message.is_extended_id or message.is_remote_frame or message.is_fd)
            ]
    except OSError as error:
        raise BoebotError(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except Exception as error:  # each format has its own
        reason = str(error).strip().splitlines() or [type(error).__name__]
        raise BoebotError(f"{path} is no log of CAN frames: {reason[0]}") from None


def _only_node(path: Path, sent: list[Sent]) -> int:
    (hello,) = (
        identifier for identifier, part in PARTS.items() if (part.message_id, part.place) == (messages.Hello.ID, 0)
    )
    seen = {frame.identifier >> NODE_SHIFT & 7 for _, frame in sent if frame.identifier & ~(7 << NODE_SHIFT) == hello}
    if len(seen) != 1:
        boards = ", ".join(map(str, sorted(seen))) or "none"
        raise BoebotError(f"{path} has the hello of these boards: {boards}; expected one, or --node")
    (node,) = seen
    return node


def _known(robot: RobotDescription, values: dict[str, float]) -> dict[str, float]:
    """Those parameters that are keys of this robot's description."""
    return {
        name: value
        for name, value in values.items()
        if name == "devices"
        or robot.has(messages.PARAMETERS[name].default_from.partition(".")[0])
        or messages.PARAMETERS[name].default_from.startswith("body.")
    }


class _LogReader:
    """Follows what a host and the board of a node said to each other.

    Attributes:
        hello: the board's last before the first set-point.
        parameters: values in force that the board has answered, in their units.
        commands: (tick, command) of each set-point.
    """

    def __init__(self, node: int) -> None:
        self.hello: messages.Hello | None = None
        self.parameters: dict[str, float] = {}
        self.commands: list[tuple[int, Command]] = []
        self._ends = [Assembler(to_board, frozenset({node})) for to_board in (True, False)]
        self._asked: dict[int, int] = {}  # number of a request -> parameter
        self._telemetry: list[tuple[float, messages.Telemetry]] = []
        self._slow: list[tuple[int, type[messages.Message], bytes]] = []  # how much telemetry had come before

    def take(self, sent: Sent) -> None:
        """The next frame of the log."""
        for end in self._ends:
            if end.takes(sent.frame.identifier) and sent.frame.identifier & ~(7 << NODE_SHIFT) in PARTS:
                try:
                    message = end.add(sent.frame)
                except ForeignFrameError:
                    continue
                if message is not None:
                    self._message(sent.time_s, message)

    def _message(self, time_s: float, came: CanMessage) -> None:
        kind = messages.MESSAGES[came.id]
        if came.sequence is not None:
            self._set_point(came)
        elif kind is messages.Telemetry:
            self._telemetry.append((time_s, messages.Telemetry.unpack(came.payload)))
        elif kind in messages.DEVICE_MESSAGES:
            self._slow.append((len(self._telemetry), kind, came.payload))
        elif kind is messages.Hello and not self.commands:
            self.hello = messages.Hello.unpack(came.payload)
        elif kind in (messages.GetParameter, messages.SetParameter):
            request: Any = kind.unpack(came.payload)
            self._asked[request.number] = request.parameter
        elif kind is messages.Answer:
            answer = messages.Answer.unpack(came.payload)
            name, scale = _PARAMETER.get(self._asked.get(answer.number, -1), ("", 0.0))
            if name and answer.status == messages.AnswerStatus.OK and not self.commands:
                self.parameters[name] = answer.value * scale

    def _set_point(self, came: CanMessage) -> None:
        if not self._telemetry:
            return
        newest = self._telemetry[-1][1].tick
        payload = whole_tick(came.payload, newest)
        point: Any = messages.MESSAGES[came.id].unpack(payload)
        tick = newest - ((newest - point.answers_tick) & 0xFFFF)
        name = _SET_POINTS.get(came.id)
        signals = (0.0, 0.0) if name is None else (point.left / _PER_UNIT, point.right / _PER_UNIT)
        if not self.commands or tick > self.commands[-1][0]:
            self.commands.append((tick, Command(name or "stop", *signals)))

    def result(self, path: Path, robot: RobotDescription, seed: int) -> RunResult:
        """The run. Its time 0 is the tick that the first set-point answers."""
        assert self.hello is not None
        tick_s = 1.0 / self.hello.tick_rate
        first, last = self.commands[0][0], self.commands[-1][0]
        record = Record()
        places = {}
        rows = [(stamp, one) for stamp, one in self._telemetry if first <= one.tick <= last]
        for stamp, telemetry in rows:
            places[telemetry.tick] = (telemetry.tick - first) * tick_s
            record.append_telemetry(places[telemetry.tick], telemetry.pack(), stamp, 0.0)
        for place, kind, payload in self._slow:
            if place < len(self._telemetry):  # the brain saw it with the next telemetry
                time_s = (self._telemetry[place][1].tick - first) * tick_s
                record.append(kind.NAME, time_s, payload)
        for tick, command in self.commands:
            if tick not in places:
                raise BoebotError(f"{path} lacks the telemetry of tick {tick}, which a set-point answers")
            record.append_command(places[tick], *command)
        gaps = Counter(after[0] - before[0] for before, after in zip(self.commands, self.commands[1:], strict=False))
        return RunResult(
            brain="unknown",
            robot=robot,
            board=str(path),
            description="a log of CAN frames",
            arena=None,
            seed=seed,
            period=(gaps.most_common(1)[0][0] if gaps else 1) * tick_s,
            tick=tick_s,
            error=None,
            record=record,
            world=None,
            clock_offset=0.0,
            steps=len(self.commands),
            late_steps=0,
            resets=0,
            lost_frames=sum(end.lost for end in self._ends),
            bad_frames=0,
            run_time=(last - first) * tick_s,
            wall_time=0.0,
        )
