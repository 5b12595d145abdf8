"""A run as a log of CAN frames that stock tools open, and such a log as a run.

A run's record holds the bytes of its line; the frames are made from them as a bridge makes them, whether the run went
over CAN or not. A log has no host times, no seed and no interventions: a brain that goes by them cannot be replayed.
"""

from __future__ import annotations

import heapq
import logging
import re
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from boebot.description.board_parameters import adapted, parameters_of
from boebot.description.robots import RobotDescription, load_robot, robot_names
from boebot.errors import BoebotError
from boebot.files import regular
from boebot.link import finding, messages
from boebot.link.frame import text
from boebot.record.reading import CutError
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.record.run_folder import write_whole
from boebot.robot import Command
from boebot_can.extra import import_extra
from boebot_can.frames import NODE_MASK, PARTS, Assembler, CanFrame, CanMessage, ForeignFrameError
from boebot_can.iso_tp import LongMessages
from boebot_can.layout import LAYOUTS, NODE_SHIFT
from boebot_can.translator import BoardEnd, HostEnd

KINDS = ("blf", "asc", "log")
"""Formats, by suffix: Vector's binary and text, candump's. python-can's others lose data."""

_PER_UNIT = 10_000  # counts of a set-point per unit
_SET_POINTS = {messages.SetpointSignal.ID: "signal", messages.SetpointSpeed.ID: "speed"}
_SILENCE_TICKS = 100  # end a session
_TELEMETRY_BEGINS = LAYOUTS[messages.Telemetry.ID].identifiers[0]  # with `tick` and `time`
_PARAMETER = {spec.id: name for name, spec in messages.PARAMETERS.items()}


class Sent(NamedTuple):
    """A frame of a log."""

    time_s: float
    frame: CanFrame


# ---- a run as a log --------------------------------------------------------------------------------------------------


def frames_of(result: Run, node: int = 1) -> Iterator[Sent]:
    """The CAN frames of a run on a board, oldest first; times from the first byte on.

    Telemetry has the time of its tick, also where the host has read that of several ticks at once.

    Raises:
        BoebotError: the robot has no board.
    """
    record = result.record
    if not record.count("to_host"):
        raise BoebotError(f"robot {result.robot.name!r} has no line in this run, so no CAN frames")
    waiting: list[CanFrame] = []  # of long messages
    long_from_board = LongMessages(node, waiting.append, at_board=True)
    long_from_host = LongMessages(node, waiting.append, at_board=False)
    board = BoardEnd(node, long_from_board.send)
    host = HostEnd(node, long_from_host.send)
    rows = heapq.merge(
        ((time_s, 0, data) for time_s, data in record.each_row("to_host")),
        ((time_s, 1, data) for time_s, data in record.each_row("to_board")),
    )
    sending = _Sending()
    begin_s = last_s = None
    for read_s, to_board, data in rows:
        if to_board:
            pending = deque(Sent(read_s, frame) for frame in host.frames(data))
        else:
            pending = deque(sending.stamped(board.frames(data), read_s))
        while pending or waiting:
            pending.extend(Sent(read_s, frame) for frame in waiting)
            waiting.clear()
            time_s, frame = pending.popleft()
            begin_s = time_s if begin_s is None else begin_s
            last_s = time_s if last_s is None else max(last_s, time_s)
            yield Sent(last_s - begin_s, frame)
            for end in (long_from_board, long_from_host):
                if frame.identifier == end.listens_to:
                    end.receive(frame)  # it answers by flow control


class _Sending:
    """When the board sent what the host has read: the time that its telemetry names, and the shortest lag of the last
    reads behind that time."""

    def __init__(self) -> None:
        self._lags: deque[float] = deque(maxlen=100)
        self._newest_s = 0.0  # by the board's clock

    def stamped(self, frames: list[CanFrame], read_s: float) -> list[Sent]:
        """The frames of one read."""
        board_s = [
            int.from_bytes(frame.data[4:8], "little") * 1e-6
            for frame in frames
            if frame.identifier & ~NODE_MASK == _TELEMETRY_BEGINS
        ]
        if not board_s:
            return [Sent(read_s, frame) for frame in frames]
        if board_s[-1] < self._newest_s:  # the board's clock has begun anew
            self._lags.clear()
        self._newest_s = board_s[-1]
        self._lags.append(read_s - board_s[-1])
        lag_s = min(self._lags)
        sent, place = [], -1
        for frame in frames:
            place += frame.identifier & ~NODE_MASK == _TELEMETRY_BEGINS
            sent.append(Sent(min(board_s[max(place, 0)] + lag_s, read_s), frame))
        return sent


def save_log(result: Run, path: Path, node: int = 1) -> Path:
    """Writes a run's CAN frames, whole or not at all; the format is by the suffix, one of `KINDS`.

    Args:
        result: the run.
        path: of the log.
        node: the board's, where the run did not go over CAN.

    Raises:
        BoebotError: there are no frames, or the file cannot be written.
    """
    can = import_extra("can")
    over_can = re.match(r"can:.*[?&]node=([1-7])(&|$)", result.board)
    sent = frames_of(result, int(over_can[1]) if over_can else node)

    def write(part: Path) -> None:
        with can.Logger(str(part)) as log:
            for time_s, frame in sent:
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

    return write_whole(path, write)


def save_logs(kind: str, robots: Mapping[int, Run], folder: Path) -> list[Path]:
    """A format of `boebot report`: a log for each robot that has a board, each another node.

    Raises:
        BoebotError: none has one, or a file cannot be written.
    """
    if len(robots) == 1:
        return [save_log(robot, folder / f"can.{kind}") for robot in robots.values()]
    boards = {number: robot for number, robot in robots.items() if robot.layout is None}
    if not boards:
        raise BoebotError("no robot of the run has a board, so there are no CAN frames")
    return [
        save_log(robot, folder / f"robot-{number}" / f"can.{kind}", (number - 1) % 7 + 1)
        for number, robot in boards.items()
    ]


save_blf, save_asc, save_candump = (partial(save_logs, kind) for kind in KINDS)


# ---- a log as a run --------------------------------------------------------------------------------------------------


def read_log(path: Path, robot: str | None = None, node: str | None = None, seed: int = 1) -> Run:
    """The run in a log of CAN frames, as far as it shows there: the first session in which somebody drove the robot.

    Args:
        path: of the log.
        robot: its name or file; None: as the board's hello says.
        node: the board's; in a log of several buses as in "can1:2", the bus as the log names it, in Vector's formats by
            a number from 1 on. None: the only one of the log.
        seed: of the brain's chance, which no log shows.

    Returns:
        The run. Of a log that breaks off it has ended there, with a `CutError` that says so; of one that lacks frames
        before the last set-point it has ended at that gap, with a `CutError` that says what is lost.

    Raises:
        BoebotError: it cannot be read, has no hello of a board or no set-points, or several boards and no `node`.
    """
    readers: dict[tuple[str, int], _LogReader] = {}
    cut: CutError | None = None
    try:
        for name, sent in _sent(path):
            board = name, (sent.frame.identifier & NODE_MASK) >> NODE_SHIFT
            if board not in readers:
                readers[board] = _LogReader(board[1])
            readers[board].take(sent)
    except CutError as error:
        cut = error
    reader = _chosen(path, readers, node)
    result = reader.result(path, _robot(path, reader, robot), seed)
    result.error = result.error or cut
    return result


def _sent(path: Path) -> Iterator[tuple[str, Sent]]:
    """The frames of a log, each with the name of its bus. Their order is the log's: a clock may have been set.

    Raises:
        BoebotError: it cannot be read.
        CutError: it breaks off after some frames.
    """
    can = import_extra("can")
    logging.getLogger("can").addHandler(logging.NullHandler())  # else its remarks go to standard error
    numbered = path.suffix.lower() != ".log"  # from 1 on; python-can counts from 0
    count = 0
    try:
        with can.LogReader(str(regular(path))) as log:
            for message in log:
                count += 1
                if not (message.is_error_frame or message.is_extended_id or message.is_remote_frame or message.is_fd):
                    bus = message.channel + 1 if numbered and message.channel is not None else message.channel
                    yield str(bus), Sent(message.timestamp, CanFrame(message.arbitration_id, bytes(message.data)))
            if getattr(log, "file_size", 0) > path.stat().st_size:  # of a BLF: as its header says
                raise EOFError("it is shorter than it says")
    except OSError as error:
        raise BoebotError(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except Exception as error:  # each format has its own, in words of Python's
        expected = f"expected a *{path.suffix.lower()} log as python-can writes it"
        if count:
            raise CutError(f"{path} breaks off after {count:,} frames; {expected}, to its end") from error
        raise BoebotError(f"{path} is no log of CAN frames; {expected}") from error


def _chosen(path: Path, readers: dict[tuple[str, int], _LogReader], node: str | None) -> _LogReader:
    """The reader of a board that was driven."""
    heard = {board: reader for board, reader in readers.items() if reader.hello is not None}
    if not heard:
        raise BoebotError(f"{path} has no hello of a board; expected a log from before the run began")
    is_one_bus = len({bus for bus, _ in heard}) == 1
    boards = {str(number) if is_one_bus else f"{bus}:{number}": heard[bus, number] for bus, number in sorted(heard)}
    if node is None and len(boards) > 1:
        raise BoebotError(f"{path} has boards of several nodes; expected --node {' or '.join(boards)}")
    node = next(iter(boards)) if node is None else node
    if node not in boards:
        raise BoebotError(f"{path} has no hello of a board of node {node}; expected {' or '.join(boards)}")
    reader = boards[node]
    hello = reader.hello
    assert hello is not None
    if not finding.speaks_alike(hello):
        raise finding.refusal(hello, str(path), _no_description)
    if reader.is_shared:
        raise BoebotError(f"{path} has two boards of node {node} on one bus; expected each to have another")
    if not reader.commands:
        raise BoebotError(f"{path} has no set-points for node {node}: nobody drove the robot")
    return reader


def _no_description(_: int) -> messages.Description:
    raise BoebotError("a log answers nothing")


def _robot(path: Path, reader: _LogReader, robot: str | None) -> RobotDescription:
    """The robot of a log, with the parameters of its board in place of those that its description has otherwise."""
    assert reader.hello is not None
    name = text(reader.hello.robot)
    if robot is None and name not in robot_names():
        raise BoebotError(f"the board in {path} says that it is {name!r}, which is no bundled robot; expected --kind")
    described = load_robot(robot or name)
    described.expect_kit()
    if not described.has_board:
        raise BoebotError(f"robot {described.name!r} has no board; expected one like that in {path}, {name!r}")
    other = {}
    for parameter, own in parameters_of(described).items():
        scale = messages.PARAMETERS[parameter].scale
        count = reader.parameters.get(parameter)
        if count is not None and count != round(own / scale):
            other[parameter] = count * scale
    return adapted(described, other)


class _LogReader:
    """Follows what a host and the board of a node said to each other, until the first session with set-points ends.

    Attributes:
        hello: the board's last before the first set-point.
        parameters: counts in force then, as the board has answered them.
        commands: (tick, command, whether none before it is missing, as far as numbers say) of each set-point.
        is_shared: two boards use the node at a time.
    """

    def __init__(self, node: int) -> None:
        self.hello: messages.Hello | None = None
        self.parameters: dict[str, int] = {}
        self.commands: list[tuple[int, Command, bool]] = []
        self.is_shared = False
        self._is_over = False
        self._sequence = 0  # of the host's newest message: set-points have it, each other message counts one
        self._accepted = 0  # set-point that the board had accepted last when the session began
        self._newest: dict[int | None, int] = {}  # tick of each session
        self._session: int | None = None  # of the newest telemetry
        self._ends = [Assembler(to_board, frozenset({node})) for to_board in (True, False)]
        self._asked: dict[int, int] = {}  # number of a request -> parameter
        self._telemetry: list[tuple[float, messages.Telemetry]] = []
        self._slow: list[tuple[int, type[messages.Message], bytes]] = []  # how many set-points had come before

    def take(self, sent: Sent) -> None:
        """The next frame of this node."""
        if sent.frame.identifier & ~NODE_MASK not in PARTS:
            return
        for end in self._ends:
            if end.takes(sent.frame.identifier):
                try:
                    message = end.add(sent.frame)
                except ForeignFrameError:
                    continue
                if message is not None:
                    self._take(sent.time_s, message)

    def _take(self, time_s: float, came: CanMessage) -> None:
        kind = messages.MESSAGES[came.id]
        self._sequence += came.id < messages.Hello.ID and came.sequence is None
        if kind is messages.Telemetry:
            self._take_telemetry(time_s, came)
        elif self._is_over:
            return
        elif came.sequence is not None:
            self._take_set_point(came, came.sequence)
        elif kind in messages.DEVICE_MESSAGES:
            self._slow.append((len(self.commands), kind, came.payload))
        elif self.commands:
            self._is_over = kind is messages.Close
        elif kind is messages.Hello:
            self.hello = messages.Hello.unpack(came.payload)
        elif kind in (messages.GetParameter, messages.SetParameter):
            request: Any = kind.unpack(came.payload)
            self._asked[request.number] = request.parameter
        elif kind is messages.Answer:
            answer = messages.Answer.unpack(came.payload)
            name = _PARAMETER.get(self._asked.get(answer.number, -1))
            if name is not None and answer.status == messages.AnswerStatus.OK:
                self.parameters[name] = answer.value

    def _take_telemetry(self, time_s: float, came: CanMessage) -> None:
        telemetry = messages.Telemetry.unpack(came.payload)
        if is_other := came.session != self._session:  # has it gone on beside the one before?
            self.is_shared |= 0 < telemetry.tick - self._newest.get(came.session, telemetry.tick) < _SILENCE_TICKS
            self._session, self._accepted = came.session, telemetry.setpoint_sequence
        newest = self._telemetry[-1][1].tick if self._telemetry else -1
        if not is_other and 0 <= newest - telemetry.tick < _SILENCE_TICKS:
            return  # some of the log is there twice
        self._newest[came.session] = telemetry.tick
        was_reset = telemetry.tick <= newest
        self._is_over |= bool(self.commands) and (was_reset or is_other)
        if self._is_over:
            return
        if was_reset:
            self._telemetry.clear()
            self._slow.clear()
        self._telemetry.append((time_s, telemetry))

    def _take_set_point(self, came: CanMessage, sequence: int) -> None:
        if not self._telemetry or came.session != self._session:
            return
        point: Any = messages.MESSAGES[came.id].unpack(came.payload)
        newest = self._telemetry[-1][1]
        tick = newest.tick - 128 + ((point.answers_tick - newest.tick + 128) & 0xFF)  # the nearest one with that byte
        kind = _SET_POINTS.get(came.id)
        signals = (0.0, 0.0) if kind is None else (point.left / _PER_UNIT, point.right / _PER_UNIT)
        follows = (
            (self._sequence + 1) & 0xFF == sequence if self.commands else newest.setpoint_sequence == self._accepted
        )
        self._sequence = sequence
        if not self.commands or tick > self.commands[-1][0]:
            self.commands.append((tick, Command(kind or "stop", *signals), follows))

    def result(self, path: Path, robot: RobotDescription, seed: int) -> Run:
        """The run, up to its first gap. Its time 0 is as of a driver: the brain's period begins with the ticks that
        the period divides, and a first step may be late. The sums are a driver's, too: a brain that compares times
        sees the last bit."""
        assert self.hello is not None
        tick_s = 1.0 / self.hello.tick_rate
        ticks = [tick for tick, *_ in self.commands]
        gaps = Counter(after - before for before, after in pairwise(ticks))
        period = gaps.most_common(1)[0][0] if gaps else 1
        first = ticks[0]
        time_zero = -(first - first % period) * tick_s
        times = {telemetry.tick: telemetry.tick * tick_s + time_zero for _, telemetry in self._telemetry}
        count, gap = len(ticks), None
        for place, (tick, _, follows) in enumerate(self.commands):
            before = ticks[place - 1] if place else first - 2 * period
            if tick not in times or (not follows and tick - before > period):  # nearer ones have none between them
                lacks = "set-points" if tick in times else f"the telemetry of tick {tick}, which a set-point answers"
                if place == 0:
                    raise BoebotError(f"{path} begins with a gap: it lacks {lacks}")
                where = f"{path} has a gap after tick {before} ({times[before]:.2f} s)"
                gap = CutError(f"{where}: it lacks {lacks}; {count - place} of {count} commands are behind it", [lacks])
                count = place
                break
        last = ticks[count - 1]
        record = Record()
        for stamp_s, telemetry in self._telemetry:
            if first <= telemetry.tick <= last:
                record.append_telemetry(times[telemetry.tick], telemetry.pack(), stamp_s, 0.0)
        for place, slow, payload in self._slow:
            if place < count:  # a host reads all that has come before it answers
                record.append(slow.NAME, times[ticks[place]], payload)
        for tick, command, _ in self.commands[:count]:
            record.append_command(times[tick], *command)
        return Run(
            brain="unknown",
            robot=robot,
            board=str(path),
            description="a log of CAN frames",
            arena=None,
            seed=seed,
            period=period * tick_s,
            tick=tick_s,
            error=gap,
            record=record,
            world=None,
            clock_offset=0.0,
            steps=count,
            lost_frames=sum(end.lost for end in self._ends),
            run_time=times[last],
        )
