"""Runs a brain on a board: `boebot.run(...)` does from a script or a notebook what the command `boebot run`
does.

One loop serves every board. The brain's period is a whole number n of the board's control ticks; the brain
steps on the first telemetry whose tick has reached the next multiple of n, and its command goes out at once.
On a board in this process time stands still while the brain thinks, so that a run is a function of brain,
robot, arena and seed; on a live board the newest telemetry counts.

A board that was reset, or that has not heard the host for too long, is configured and armed again, and the run goes
on. However a run ends (time up, an error in the brain, Ctrl-C, a port that vanishes, a low supply, a stop from
elsewhere), the motors are stopped and the record is complete up to there.
"""

from __future__ import annotations

import contextlib
import math
import time as wall
from collections.abc import Callable
from numbers import Integral, Real
from pathlib import Path

from boebot import brains, interrupts, report
from boebot.boards import BoardRequest, BoardSession, open_board
from boebot.brains import LoadedBrain
from boebot.errors import BoardError, BoebotError, BrainError, ProtocolError
from boebot.link import messages
from boebot.link.delivery import LatchedAgainError, SessionLostError
from boebot.link.session import Link, text
from boebot.link.session import Telemetry as Received
from boebot.parameters import configure
from boebot.record import Record
from boebot.result import RunResult
from boebot.robot import Equipment, Observation, Robot
from boebot.robots import RobotDescription, load_robot

DEFAULT_PERIOD = 0.05  # s
TIME_TO_LIVE_MS = 250  # at least; longer brain periods live 2.5 periods
TIME_TO_LIVE_LIMIT_MS = 2000
SILENCE_S = 3.0  # a board that says nothing for so long is lost; after a reset its boot loader waits for up to 2 s
SILENCE_SIMULATED_S = 1.0  # a board in this process has no boot loader
STOP_LIMIT_S = 0.5  # how long the end of a run waits for the board to confirm its stop
_ARM_TRIES = 5  # latchings that may come between telemetry and arming: late copies of an earlier stop
_PROGRESS_S = 0.1  # wall time between two reports of progress
_PERIODS_TO_LIVE = 3  # telemetry periods that a set-point lives at least (PROTOCOL.md, "Delivery")
_BYTES_TO_LIVE = 300
_Telemetry = messages.Telemetry
_LATCH = 34  # offset in telemetry
_NOT_YET = 1 << 32  # no tick is later

Progress = Callable[[float], None]
"""Called now and then with the seconds of the run that have passed."""


def run(
    brain: object = "wander",
    robot: str | Path | RobotDescription = "shieldbot",
    arena: str | Path | None = None,
    on: str = "native",
    seconds: float = 60.0,
    seed: int = 1,
    realtime: bool = False,
    out: str | Path | None = None,
    period: float | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Runs a brain and returns what happened.

    Args:
        brain: bundled name ("wander"), Python file, function `step(robot)`, or object or class with
        `step(robot)`. robot: bundled name, .toml file, or a description. arena: bundled name or .toml file;
        None: the simulator's own choice. Of no meaning on a real robot. on: "native", "avr", or a port:
        "/dev/ttyACM0", "serial:PORT", "socket://HOST:PORT". seconds: length of the run by the board's clock;
        may be infinite. seed: of the brain's chance, and of the noise of the simulated world. realtime: slow
        a simulated run down to the wall clock. out: folder for run.csv, run.png, replay.html and the raw
        bytes. period: seconds from step to step of the brain; None: the brain's PERIOD, or 0.05. progress:
        called with the seconds that have passed, about ten times a second.

    Raises:
        BoebotError: whatever the user can mend: bad input, an error in the brain (with its place), a board
        that is not
            there or that vanishes. The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; motors stopped and record written.
    """
    if out is not None:
        _expect("out", out, "a folder or None", str, Path)
        report.make_folder(Path(out))
    result = execute(brain, robot, arena, on, seconds, seed, realtime, period, progress)
    if out is not None:
        try:
            with interrupts.ignored():
                result.save(out)
        except BoebotError as unsaved:
            if result.error is None:
                raise
            result.error.add_note(str(unsaved))
    if result.error is not None:
        raise result.error
    return result


def execute(
    brain: object,
    robot: str | Path | RobotDescription = "shieldbot",
    arena: str | Path | None = None,
    on: str = "native",
    seconds: float = 60.0,
    seed: int = 1,
    realtime: bool = False,
    period: float | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """As `run`, but once the run has begun every end of it, even by an error, is a result: see
    `RunResult.error`.

    Raises:
        BoebotError: the run could not begin.
    """
    _expect("robot", robot, "a name, a .toml file or a description", str, Path, RobotDescription)
    _expect("arena", arena, "a name, a .toml file or None", str, Path, type(None))
    _expect("on", on, "the name of a board or a port", str)
    _expect("seconds", seconds, "a number", Real)
    _expect("seed", seed, "a whole number", Integral)
    _expect("period", period, "seconds or None", Real, type(None))
    if not seconds > 0:
        raise BoebotError(f"a run cannot last {seconds:g} s; expected more than 0")
    description = robot if isinstance(robot, RobotDescription) else load_robot(robot)
    loaded = brains.load_brain(brain)
    period_s = period if period is not None else loaded.period or DEFAULT_PERIOD
    check_time_to_live(period_s)
    missing = Equipment(description, tick_s=1.0).missing(loaded.needs)
    if missing:
        raise BrainError(
            f"brain {loaded.name!r} needs {' and '.join(missing)}, which robot {description.name!r} does not have"
        )
    request = BoardRequest(robot=description, arena=None if arena is None else str(arena), seed=seed, realtime=realtime)
    session = open_board(on, request)
    try:
        return _Run(session, request, loaded, on, seconds, period_s, progress).execute()
    finally:
        session.close()


def _expect(name: str, value: object, expected: str, *kinds: type) -> None:
    """Raises a BoebotError if an argument of `run` is of no such kind."""
    if not isinstance(value, kinds) or isinstance(value, bool):
        raise BoebotError(f"{name} is {value!r}; expected {expected}")


def check_time_to_live(period_s: float, least_s: float = 0.0) -> int:
    """The set-points' time to live (ms) at a brain period; at least `least_s`.

    Raises:
        BoebotError: the period is so long that the motors would stop between two steps.
    """
    if not (period_s > 0 and math.isfinite(period_s)):
        raise BoebotError(f"a brain period of {period_s * 1000:g} ms is none; expected more than 0")
    time_to_live_ms = max(TIME_TO_LIVE_MS, math.ceil(2.5 * period_s * 1000), math.ceil(least_s * 1000))
    if time_to_live_ms > TIME_TO_LIVE_LIMIT_MS:
        raise BoebotError(
            f"a brain period of {period_s * 1000:g} ms is too long; expected at most {TIME_TO_LIVE_LIMIT_MS / 2.5:g} ms"
        )
    return time_to_live_ms


class _Run:
    """One run, from handshake to result."""

    def __init__(
        self,
        session: BoardSession,
        request: BoardRequest,
        brain: LoadedBrain,
        on: str,
        seconds: float,
        period_s: float,
        progress: Progress | None,
    ) -> None:
        self.session = session
        self.request = request
        self.brain = brain
        self.on = on
        self.progress = progress
        self.link = Link(session.transport)
        hello = self.link.open()
        self.tick_s = 1.0 / hello.tick_rate
        self.notices = self.link.notices
        self.period_ticks = self._fitting_period(period_s, hello.telemetry_period)
        self.telemetry_ticks = hello.telemetry_period
        self.period_s = self.period_ticks * self.tick_s
        self.time_to_live_ms = check_time_to_live(self.period_s, self._time_to_live_least())
        self.identity = self.link.identity()
        pin_map = text(self.identity.pin_map)
        if pin_map != request.robot.pin_map:
            raise ProtocolError(
                f"the board at {session.transport.name} runs firmware for pin map {pin_map!r}, but robot "
                f"{request.robot.name!r} needs {request.robot.pin_map!r}"
            )
        self.seconds = seconds
        self.description = request.robot
        self.equipment = Equipment(request.robot, self.tick_s)
        self.robot = Robot(request.robot.name, self.period_s, request.seed)
        self.record = Record()
        self.resets = 0
        self.late_steps = 0
        self.clock_offset_s = 0.0  # transport's clock at the run's time 0
        self._session = 0  # of the link that was configured and armed
        self._armed_tick = -1
        self._halted = False  # by the brain's emergency stop

    def execute(self) -> RunResult:
        """The whole run."""
        error: BaseException | None = None
        started = wall.perf_counter()
        try:
            self._make_ready()
            self.link.forget_telemetry()
            started = wall.perf_counter()
            self._loop()
        except (BoebotError, KeyboardInterrupt) as caught:
            error = caught
        finally:
            elapsed = wall.perf_counter() - started
            with interrupts.ignored():  # a second Ctrl-C must not keep the motors running
                self._stop_motors()
        return self._result(error, elapsed)

    # ---- before the first step, and after each new session ---------------------------------------------------

    def _fitting_period(self, period_s: float, telemetry_ticks: int) -> int:
        """The brain's period in ticks, such that each step has telemetry of its own tick."""
        ticks = _whole_ticks(period_s, self.tick_s)
        fitting = -(-ticks // telemetry_ticks) * telemetry_ticks
        if fitting != ticks:
            self.notices.append(
                f"the brain steps every {fitting * self.tick_s * 1000:g} ms, not every {period_s * 1000:g} ms: "
                f"the board sends telemetry every {telemetry_ticks * self.tick_s * 1000:g} ms"
            )
        return fitting

    def _time_to_live_least(self) -> float:
        return _PERIODS_TO_LIVE * self.telemetry_ticks * self.tick_s + _BYTES_TO_LIVE * self.link.byte_s

    def _make_ready(self) -> None:
        """Configures and arms the board in the session that is open, or in the next one if that ends meanwhile."""
        link = self.link
        while self._session != link.sessions:
            link.open()
            session = link.sessions
            try:
                self.description = configure(link, self.request.robot)
                if not self._halted:
                    self._arm()
            except SessionLostError:
                continue
            self._session = session
        self.equipment = Equipment(self.description, self.tick_s)

    def _arm(self) -> None:
        for _ in range(_ARM_TRIES - 1):
            with contextlib.suppress(LatchedAgainError):
                self.link.arm()
                break
        else:
            self.link.arm()
        if self.link.latest is not None:
            self._armed_tick = int.from_bytes(self.link.latest[:4], "little")

    def _heed_emergency_stop(self) -> None:
        """The brain has latched the motors off, or armed them again."""
        if self.robot.latched and not self._halted:
            self._halted = True
            self.link.stop()
        elif self._halted and not self.robot.latched:
            with contextlib.suppress(SessionLostError):  # the new session is made ready in its turn
                if self.link.is_open:
                    self._arm()
            self._halted = False

    def _heed_latch(self, payload: bytes) -> None:
        """The board has latched its motors off: a reason to end the run, unless a new session mends it.

        Raises:
            BoardError: the supply is low, or somebody else has stopped the robot.
        """
        telemetry, where = _Telemetry.unpack(payload), self.link.transport.name
        if telemetry.latch == messages.Latch.SUPPLY_LOW:
            raise BoardError(
                f"the board at {where} has stopped its motors: its supply is low, {telemetry.supply / 1000:.2f} V; "
                "charge or change the batteries"
            )
        if telemetry.latch == messages.Latch.STOP_COMMAND and not self._halted:
            raise BoardError(f"the board at {where} has stopped its motors: a stop command came from elsewhere")

    def _loop(self) -> None:
        link, robot, transport = self.link, self.robot, self.session.transport
        poll, step, unpack = link.poll, self.brain.step, _Telemetry.STRUCT.unpack
        telemetry_log, times, steps = self.record.telemetry, self.record.times, self.record.steps
        equipment, tick_s, n = self.equipment, self.tick_s, self.period_ticks
        paced = self.request.realtime and not transport.realtime
        time_to_live_ms = self.time_to_live_ms

        period = self.telemetry_ticks
        host_stamps = self.record.stamps
        last = due = -1
        time_zero = 0.0  # run time at tick 0 of the board's present count
        end_s = self.seconds - tick_s / 2
        wait_s, quiet_s = (period + 1) * tick_s, 0.0
        silence_s = SILENCE_S if transport.realtime else SILENCE_SIMULATED_S
        heard_s = transport.now()
        started = next_progress = wall.perf_counter()
        started_s = heard_s
        while True:
            received = poll(wait_s, quiet_s)
            if link.sessions != self._session:
                received = self._in_new_session(received)
                equipment = self.equipment
            restarted = link.board_resets != self.resets
            if not received:
                if transport.now() - heard_s > silence_s + period * tick_s:
                    raise BoardError(f"the board at {transport.name} fell silent: no telemetry for {silence_s:g} s")
                wait_s, quiet_s = (period + 1) * tick_s, 0.0
                continue
            for payload, board_s, host_s, bound_s in received:  # noqa: B007
                tick = int.from_bytes(payload[:4], "little")
                if due < 0:
                    due = tick + -tick % n
                    time_zero = -due * tick_s
                    self.clock_offset_s = host_s + (due - tick) * tick_s
                elif restarted or tick <= last:  # the board was reset: its ticks begin afresh
                    restarted = False
                    due = tick + -tick % n
                    time_zero = self._time_after_reset(times, host_s) - tick * tick_s
                    self.resets = link.board_resets
                last = tick
                if tick >= due or times:
                    telemetry_log.append(payload)
                    times.append(tick * tick_s + time_zero)
                    host_stamps.append((host_s, bound_s))
            if payload[_LATCH] and last > self._armed_tick:
                self._heed_latch(payload)
            if events := link.events():
                self.record.events += events
            heard_s = transport.now()
            time_s = times[-1] if times else 0.0
            if time_s >= end_s:
                break
            if last >= due:
                if last - due >= n:
                    self.late_steps += (last - due) // n
                if paced:
                    ahead = (heard_s - started_s) - (wall.perf_counter() - started)
                    if ahead > 0:
                        wall.sleep(ahead)
                if self.progress is not None and wall.perf_counter() >= next_progress:
                    next_progress = wall.perf_counter() + _PROGRESS_S
                    self.progress(time_s)
                robot.observation = Observation(
                    _Telemetry._make(unpack(payload)), equipment, time_s, board_s, host_s, bound_s
                )
                try:
                    step(robot)
                except (Exception, SystemExit) as error:
                    raise BrainError(brains.explain(error, self.brain.path)) from error
                if robot.latched or self._halted:
                    self._heed_emergency_stop()
                kind, left, right = robot.command
                if kind == "signal":
                    link.send_signal(left, right, time_to_live_ms, last)
                elif kind == "speed":
                    link.send_speed(left, right, time_to_live_ms, last)
                else:
                    link.send_coast(time_to_live_ms, last)
                steps.append((len(times) - 1, kind, left, right))
                due = last - last % n + n
            ahead_ticks = min(due - last, (self.seconds - time_s) / tick_s)
            wait_s, quiet_s = (ahead_ticks + period + 1) * tick_s, (ahead_ticks - 0.5) * tick_s

    def _in_new_session(self, received: list[Received]) -> list[Received]:
        """Makes the board ready again; returns the telemetry of the new session."""
        self._armed_tick = _NOT_YET
        self._make_ready()
        if self._halted:
            self._armed_tick = -1
        return [*received, *self.link.fetch_telemetry()]

    def _time_after_reset(self, times: list[float], host_s: float) -> float:
        """The run's time of a tick that began then: whole ticks; the board's outage by the transport's clock."""
        passed_s = round((host_s - self.clock_offset_s) / self.tick_s) * self.tick_s
        return max(passed_s, times[-1] + self.tick_s) if times else 0.0

    def _stop_motors(self) -> None:
        """Tells the board to stop, waits until it says so, and leaves it to others; one that has gone stops by its
        dead-man."""
        with contextlib.suppress(BoebotError, KeyboardInterrupt):
            self.link.stop_and_confirm(STOP_LIMIT_S)
            self.record.events += self.link.events()
            self.link.close()

    def _result(self, error: BaseException | None, elapsed_s: float) -> RunResult:
        link = self.link
        return RunResult(
            brain=self.brain.name,
            robot=self.description,
            board=self.on,
            description=self.session.description,
            arena=self.request.arena,
            seed=self.request.seed,
            period=self.period_s,
            tick=self.tick_s,
            error=error,
            record=self.record,
            truth=self.session.truth(),
            clock_offset=self.clock_offset_s,
            steps=len(self.record.steps),
            late_steps=self.late_steps,
            resets=self.resets,
            sessions_lost=link.sessions_lost,
            lost_frames=link.decoder.lost,
            bad_frames=link.decoder.bad,
            run_time=self.record.times[-1] if self.record.times else 0.0,
            wall_time=elapsed_s,
            sent=link.sent,
            received=link.received,
            identity=self.identity,
            link={"host": link.counters().as_dict(), "board": dict(link.board_counters.values)},
            notices=self.notices,
            counters=dict(self.session.counters()),
        )


def _whole_ticks(period_s: float, tick_s: float) -> int:
    ticks = round(period_s / tick_s)
    if ticks < 1 or abs(ticks * tick_s - period_s) > 1e-6:
        raise BoebotError(
            f"a brain period of {period_s * 1000:g} ms does not fit; expected a multiple of {tick_s * 1000:g} ms"
        )
    return ticks
