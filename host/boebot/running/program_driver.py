"""Drives a robot by the program on its board: it does not speak the kit's protocol, what it prints is text.

The host only lets time pass, keeps what comes with the time of each byte, and sends what a person types
(`boebot.running.hands`). The run is over when its time is up, or when the program has printed what was looked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from boebot.boards import BoardSession
from boebot.devices.readings import Readings
from boebot.errors import BoardError, MissingTextError, printable
from boebot.link.bad_line import BadLine
from boebot.link.messages import Status as StatusBits
from boebot.link.transport import Following
from boebot.record.monitor import Monitor
from boebot.record.record import Record
from boebot.robot import Robot
from boebot.running.driver import TICK_S, Driver, Status, step_limit
from boebot.running.tasks import Task
from boebot.showing import Showing


def append_parts(record: Record, showing: Showing, session: BoardSession, time_s: float, tick: int) -> None:
    """Puts aside what parts at the board of a program show at that time."""
    values = session.readings()
    readings = Readings(tick, int(StatusBits.MOTORS_ENABLED), (0.0,) * len(values), values)
    record.append_readings(time_s, readings, 0.0, 0.0)
    for name, text in session.texts().items():
        showing.show(time_s, name, text)


class ProgramDriver(Driver):
    """See `boebot.running.driver.Driver`. Its readings are those of parts at the board."""

    def __init__(self, session: BoardSession, task: Task) -> None:
        """Raises BoardError where the board's line cannot be listened to at its own bit rate."""
        line = session.transport
        if not isinstance(line, Following):
            raise BoardError(f"{line.name} runs only the kit's firmware; expected the emulated ATmega328P (--on avr)")
        line.follow()
        self.session, self.task = session, task
        self._line: Following | BadLine = line
        self.description = task.board.robot
        self.robot = Robot(self.description.name, TICK_S, task.seed)
        self.step_limit = step_limit(task.request.step_timeout)
        self.period_s = self.tick_s = TICK_S
        self.link = self.identity = None
        self.layout = session.layout
        self._monitor = Monitor(self._show, task.request.expect_text, task.request.fail_text)

    is_program = True

    def begin(self) -> None:
        """The program has begun by itself."""

    def steps(self) -> Iterator[float]:
        """See `boebot.running.driver.Driver`.

        Raises:
            BoardError: the program has crashed, or has printed what it must not or what cannot be shown.
            MissingTextError: it has not printed what was expected.
        """
        request, line, tick = self.task.request, self._line, 0
        self._put_aside(time_s := line.now(), tick)
        while not self._monitor.found and time_s < request.seconds:
            yield time_s
            self._hear(min(TICK_S, request.seconds - time_s))
            tick += 1
            self._put_aside(time_s := line.now(), tick)
            if self._monitor.failed:
                raise BoardError(f"the program printed {printable(request.fail_text)!r}; expected that it does not")
        if request.expect_text and not self._monitor.found:
            expected = f"{printable(request.expect_text)!r}, within {request.seconds:g} s"
            raise MissingTextError(f"the program did not print what was expected, {expected}")

    def _hear(self, wait_s: float) -> None:
        for time_s, data in self._line.read_stamped(wait_s, wait_s):
            self.task.record.append("to_host", time_s, data)
            self._monitor.hear(time_s, data)
        self._monitor.wait(self._line.now())

    def _put_aside(self, time_s: float, tick: int) -> None:
        append_parts(self.task.record, self.robot.showing, self.session, time_s, tick)

    def type(self, text: str) -> None:
        """See `boebot.running.driver.Driver`."""
        self.task.record.append("to_board", self._line.now(), text.encode())
        self._line.write(text.encode())

    def bad_line(self, seed: int) -> BadLine:
        """See `boebot.running.driver.Driver`."""
        self._line = line = BadLine.around(self._line, seed)
        return line

    def end(self) -> None:
        """What is still on the line; the program goes on while others do."""
        self._hear(0.0)
        self._monitor.close()

    def status(self) -> Status:
        """See `boebot.running.driver.Driver`."""
        unknown: dict[str, Any] = dict.fromkeys(("late_steps", "resets", "lost_frames", "bad_frames"))
        return Status(run_time=self._line.now(), clock_offset=0.0, **unknown, notices=list(self.session.notes()))

    def _show(self, time_s: float, line: str) -> None:
        who = f"robot {self.task.number}: " if len(self.task.request.members) > 1 else ""
        try:
            print(f"{time_s:10.4f}  {who}{printable(line.expandtabs())}", flush=True)
        except OSError as error:  # its reader has gone, or the disk is full
            raise BoardError(f"what the program prints cannot be shown: {error.strerror}") from None
