"""Drives a robot over the link to its board, emulated or real.

The brain's period is a whole number n of the board's control ticks; the brain steps on the first telemetry whose tick
has reached the next multiple of n, and its command goes out at once. On a live board the newest telemetry counts. On a
board in this process time stands still while the brain thinks; but where such a run is paced, a step that took longer
than the period was late, as it would be on a live board: that time passes before its command goes out.

A board that was reset is configured and armed again, and the run goes on; so it does after a session that the line, or
a long step of the brain, has cost. But a host that slept ends its run when it wakes: who knows where the robot is then.
"""

from __future__ import annotations

import contextlib
import math
import time as wall
from collections.abc import Iterator
from typing import Any

from boebot.boards import BoardSession
from boebot.description.board_parameters import configure
from boebot.description.equipment import Equipment
from boebot.devices.latest import NO_MESSAGES, Latest
from boebot.devices.turret import PositionServo
from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import finding, messages
from boebot.link.bad_line import BadLine
from boebot.link.delivery import StampedTelemetry as Received
from boebot.link.errors import LatchedAgainError, SessionLostError
from boebot.link.frame import FRAME_OVERHEAD, reader, text
from boebot.link.link import Link
from boebot.record import figures
from boebot.robot import Observation, Robot
from boebot.running.driver import Driver, Status, check_time_to_live, step_limit, whole_ticks
from boebot.running.stepping import AT_LEISURE, StepLimit
from boebot.running.tasks import Task
from boebot.system import host_clock

SILENCE_S = 3.0  # a board silent for longer is lost; after a reset its boot loader waits for up to 2 s
SILENCE_SIMULATED_S = 1.0  # a board in this process has no boot loader
STOP_LIMIT_S = 0.5  # how long the end of a run waits for the board to confirm its stop
_READY_TRIES = 10  # sessions that may end, one after another, before the board is configured and armed
_ARM_TRIES = 5  # latchings that may come between telemetry and arming: late copies of an earlier stop
_PERIODS_TO_LIVE = 3  # telemetry periods that a set-point lives at least (PROTOCOL.md, "Delivery")
_BYTES_TO_LIVE = 300
_NAPS = 4  # in a session's time-out: no wait is longer. Who stands still for less than 3 of them keeps the session
_LINE_SHARE = 4  # messages of slow devices fill a quarter of the line at most (PROTOCOL.md, "Delivery")
# How long before telemetry is expected to look for it. Live, in ticks: one reading that came late does not make all
# later ones late. On a simulated line of known rate a look that finds earlier bytes ends at once where the line is
# idle; so the look begins when this many bytes of the telemetry are still to come, and ends with the last one.
_LOOK_EARLY = 0.5
_LOOK_EARLY_BYTES = 30
_Telemetry = messages.Telemetry
_LATCH = reader(messages.Telemetry, "latch")
_SUPPLY = reader(messages.Telemetry, "supply")
_TICK = reader(messages.Telemetry, "tick")
_UNASKED = (messages.EventKind.DEAD_MAN, messages.EventKind.FALLBACK)
_SUPPLY_LOW = (messages.EventKind.LATCH, messages.Latch.SUPPLY_LOW)
_NOT_YET = 1 << 32  # no tick is later


def message_ticks(devices_period: int, byte_s: float, tick_s: float) -> int:
    """Ticks from one message of slow devices to the next: as the parameter says, or more where the line is slow.

    `byte_s`: time that a byte needs on the line (s); 0 where that is not known.
    """
    needed_s = _LINE_SHARE * (messages.DevicesTelemetry.LENGTH + FRAME_OVERHEAD) * byte_s
    return max(devices_period, math.ceil(needed_s / tick_s - 1e-6))


class BoardDriver(Driver):
    """Drives one robot over the link (see `boebot.running.driver.Driver`)."""

    def __init__(self, session: BoardSession, task: Task) -> None:
        """Opens the link, and finds out who is there; nothing moves yet.

        Raises:
            BoebotError: no board, or one that does not fit the robot.
        """
        self.session = session
        self.task = task
        description = task.board.robot
        self.record = task.record
        self.link = Link(session.transport, self.record.append)
        hello = self.link.open()
        self.tick_s = 1.0 / hello.tick_rate
        self.notices = self.link.notices
        self.period_ticks = self._fitting_period(task.period_s, hello.telemetry_period)
        self.telemetry_ticks = hello.telemetry_period
        self.period_s = self.period_ticks * self.tick_s
        self.time_to_live_ms = check_time_to_live(self.period_s, self._time_to_live_least())
        self.step_limit = step_limit(task.request.step_timeout, self._limit())
        self.identity = self.link.identity()
        pin_map = text(self.identity.pin_map)
        if pin_map != description.pin_map:
            raise ProtocolError(
                f"the board at {session.transport.name} runs firmware for pin map {pin_map!r}, but robot "
                f"{description.name!r} needs {description.pin_map!r}"
            )
        self.description = description
        self.layout = None
        self.equipment = Equipment(description, self.tick_s)
        self.robot = Robot(description.name, self.period_s, task.seed)
        self.resets = 0
        self.late_steps = 0
        self._last_s = -1.0  # time of the newest telemetry of the run
        self.clock_offset_s = 0.0  # transport's clock at the run's time 0
        self._session = 0  # of the link that was configured and armed
        self._first_session = 0
        self._armed_tick = -1
        self._halted = False  # by the brain's emergency stop
        self._payloads: dict[type[messages.Message], bytes] = {}  # the newest of the slow devices
        self._messages: dict[type, Any] = {}  # the newest of each kind

    def begin(self) -> None:
        """Configures and arms the board."""
        self._make_ready()
        self._first_session = self._session
        self._take_events()
        self.link.telemetry.fetch()

    # ---- before the first step, and after each new session ---------------------------------------------------

    def _fitting_period(self, period_s: float, telemetry_ticks: int) -> int:
        """The brain's period in ticks, such that each step has the telemetry of its tick."""
        ticks = whole_ticks(period_s, self.tick_s)
        fitting = -(-ticks // telemetry_ticks) * telemetry_ticks
        if fitting != ticks:
            self.notices.append(
                f"the brain steps every {fitting * self.tick_s * 1000:g} ms, not every {period_s * 1000:g} ms: "
                f"the board sends telemetry every {telemetry_ticks * self.tick_s * 1000:g} ms"
            )
        return fitting

    def _time_to_live_least(self) -> float:
        return _PERIODS_TO_LIVE * self.telemetry_ticks * self.tick_s + _BYTES_TO_LIVE * self.link.line.byte_s

    def _limit(self) -> StepLimit:
        """In real time the motors stop by the dead-man during a step that outlasts its set-points: that is an error of
        the brain. Steps that are late by less are counted."""
        if not (self.task.request.realtime or self.session.transport.realtime):
            return AT_LEISURE
        return StepLimit(
            self.time_to_live_ms / 1000,
            "the dead-man stops the motors then (step_timeout, --step-timeout: how long to wait all the same)",
        )

    def _make_ready(self) -> None:
        """Configures and arms the board in the session that is open, or in the next one if that ends meanwhile.

        Raises:
            BoardError: each session ends meanwhile, or the board refuses something.
        """
        link = self.link
        first = link.counts.sessions
        while self._session != link.counts.sessions:
            link.open()
            if link.counts.sessions - first >= _READY_TRIES:
                raise self._never_ready()
            session = link.counts.sessions
            try:
                self.description = configure(link, self.task.board.robot)
                self.equipment = self._equipment()
                if not self._halted:
                    self._arm()
            except SessionLostError:
                continue
            self._session = session

    def _never_ready(self) -> BoardError:
        hello, where = self.link.session.hello, self.session.transport.name
        why = ""
        if hello is not None and finding.by_watchdog(hello.reset_cause):
            why = f"; its last reset was by {finding.hang_in_words(hello.reset_cause)}"
        return BoardError(
            f"the board at {where} ended {_READY_TRIES} sessions in a row before it was configured and armed{why}"
        )

    def _equipment(self) -> Equipment:
        """The devices as the board has them, with its own period for messages of slow ones."""
        equipment = Equipment(self.description, self.tick_s)
        if not equipment.needs_messages:
            return equipment
        period = int(self.link.parameters.get("devices_period"))
        ticks = message_ticks(period, self.link.line.byte_s, self.tick_s)
        return Equipment(self.description, self.tick_s, message_ticks=ticks)

    def _arm(self) -> None:
        for _ in range(_ARM_TRIES - 1):
            with contextlib.suppress(LatchedAgainError):
                self.link.arm()
                break
        else:
            self.link.arm()
        if self.link.telemetry.latest is not None:
            (self._armed_tick,) = _TICK(self.link.telemetry.latest)

    def _apply_emergency_stop(self) -> None:
        """The brain has latched the motors off, or armed them again."""
        if self.robot.latched and not self._halted:
            self._halted = True
            self.link.stop()
        elif self._halted and not self.robot.latched:
            with contextlib.suppress(SessionLostError):  # the new session is made ready in its turn
                if self.link.session.is_open:
                    self._arm()
            self._halted = False

    def _send_slow_command(self) -> None:
        """The brain has asked something of turret or buzzer."""
        asked, self.robot.slow_command = self.robot.slow_command, None
        assert asked is not None
        if asked.turret is not None:
            servo = self.description.device["turret"]
            assert isinstance(servo, PositionServo)
            self.link.set_turret(asked.turret, servo.pulse_of(asked.turret))
        if asked.tone is not None:
            self.link.play_tone(asked.tone)

    def _slow(self, tick: int) -> Latest:
        """The newest messages of the slow devices, as of that tick."""
        newest = self.link.devices.latest
        if newest != self._payloads:
            self._payloads = dict(newest)
            self._messages = {kind: kind.unpack(payload) for kind, payload in newest.items()}
            self._put_devices_aside()
        return Latest(self._messages, tick)

    def _put_devices_aside(self) -> None:
        if self._last_s >= 0.0:
            for kind, payload in self.link.devices.fetch():
                self.record.append(kind.NAME, self._last_s, payload)

    def _check_latch(self, payloads: list[bytes]) -> None:
        """The board has latched its motors off: a reason to end the run, unless a new session mends it. `payloads`: of
        the telemetry since it was last looked at: a low supply may have risen again by now.

        Raises:
            BoardError: the supply is low, or somebody else has stopped the robot.
        """
        telemetry, where = _Telemetry.unpack(payloads[-1]), self.link.transport.name
        if telemetry.latch == messages.Latch.SUPPLY_LOW:
            lowest_mv = min(_SUPPLY(payload)[0] or telemetry.supply for payload in payloads)
            raise BoardError(
                f"the board at {where} has stopped its motors: its supply is low, {lowest_mv / 1000:.2f} V; "
                "charge or change the batteries"
            )
        if telemetry.latch == messages.Latch.STOP_COMMAND and not self._halted:
            raise BoardError(f"the board at {where} has stopped its motors: a stop command came from elsewhere")

    # ---- the run -----------------------------------------------------------------------------------------------------

    def steps(self) -> Iterator[float]:
        """See `boebot.running.driver.Driver`."""
        link, robot, transport = self.link, self.robot, self.session.transport
        poll, unpack, tick_of = link.poll_until, _Telemetry.STRUCT.unpack, _TICK
        make, waiting_events = _Telemetry._make, link.events.waiting
        put_aside, command_given = self.record.append_telemetry, self.record.append_command
        equipment, tick_s, n = self.equipment, self.tick_s, self.period_ticks
        paced = self.task.request.realtime and not transport.realtime
        time_to_live_ms, seconds = self.time_to_live_ms, self.task.request.seconds

        period = self.telemetry_ticks
        last = due = -1
        time_s = time_zero = 0.0  # run time, and that at tick 0 of the board's present count
        end_s = seconds - tick_s / 2
        on_time = not transport.realtime and link.line.known_byte_s > 0
        early_s = _LOOK_EARLY_BYTES * link.line.known_byte_s if on_time else _LOOK_EARLY * tick_s
        awaited = -1  # the tick that was looked for
        started_s = received_s = now_s = look_s = transport.now()
        nap_s = link.session.time_out_s / _NAPS if transport.realtime else math.inf
        awake_s, took_s = host_clock(), 0.0  # as of `now_s`; the brain's step since then
        wait_until_s = received_s + (period + 1) * tick_s
        started = wall.perf_counter()
        meanwhile: list[Received] = []  # what came during a late step of a paced run
        while True:
            received = meanwhile + poll(look_s, min(wait_until_s, now_s + nap_s))
            meanwhile = []
            if (bad := link.line.bad) is not None and bad.is_killed:
                break
            stood_s = host_clock() - awake_s - (took_s if took_s <= self.step_limit.seconds else 0.0)
            if stood_s > (_NAPS - 1) * nap_s:
                raise BoardError(
                    f"this program stood still for {stood_s:.1f} s, as when a computer sleeps; expected "
                    f"{(_NAPS - 1) * nap_s:g} s at most: the board at {transport.name} had no host, its motors are off"
                )
            now_s, took_s = link.polled_s, 0.0
            if link.counts.sessions != self._session:
                try:
                    received = self._in_new_session(received)
                except BoardError:
                    if bad is not None and bad.is_killed:  # in the midst of it
                        break
                    raise
                equipment = self.equipment
                now_s = transport.now()
            awake_s = host_clock()
            restarted = link.counts.board_resets != self.resets
            if not received:
                silence_s = SILENCE_S if transport.realtime or self.has_faults else SILENCE_SIMULATED_S
                if now_s - received_s > silence_s + period * tick_s:
                    raise BoardError(f"the board at {transport.name} fell silent: no telemetry for {silence_s:g} s")
                look_s, wait_until_s = now_s, now_s + (period + 1) * tick_s
                continue
            (newest,) = tick_of(received[-1][0])
            if self._last_s < 0.0 and newest - due >= n:
                due = -1  # a first step that is late by more than a period begins with the present one
            for payload, board_s, host_s, bound_s in received:  # noqa: B007
                (tick,) = tick_of(payload)
                if due < 0:
                    due = max(newest - newest % n, tick + -tick % n)
                    time_zero = -due * tick_s
                    self.clock_offset_s = host_s + (due - tick) * tick_s
                    self.record.append_clock(self.clock_offset_s)
                elif restarted or tick <= last:  # the board was reset: its ticks begin afresh
                    restarted = False
                    due = tick + -tick % n
                    time_zero = self._time_after_reset(host_s) - tick * tick_s
                    self.resets = link.counts.board_resets
                last = tick
                if tick >= due or self._last_s >= 0.0:
                    self._last_s = time_s = tick * tick_s + time_zero
                    put_aside(time_s, payload, host_s, bound_s)
            if last > self._armed_tick and _LATCH(payload)[0]:
                self._check_latch([one for one, *_ in received])
            if waiting_events:
                self._take_events()
            received_s = now_s
            if time_s >= end_s:
                break
            if last >= due:
                if last - due >= n:
                    self.late_steps += (last - due) // n
                if paced:
                    ahead = (received_s - started_s) - (wall.perf_counter() - started)
                    if ahead > 0:
                        wall.sleep(ahead)
                slow = self._slow(last) if equipment.needs_messages else NO_MESSAGES
                sample = make(unpack(payload))
                robot.observation = Observation(sample, equipment, time_s, board_s, host_s, bound_s, slow)
                shown = wall.perf_counter()
                yield time_s
                took_s = wall.perf_counter() - shown  # if more than the limit, this program stood still, too
                slow_s = 0.0 if bad is None else bad.slow_s()
                if slow_s or (paced and took_s > self.period_s):
                    late_s = received_s + slow_s + (took_s if paced else 0.0)
                    meanwhile = poll(late_s, late_s)
                if robot.latched or self._halted:
                    self._apply_emergency_stop()
                if robot.slow_command is not None:
                    self._send_slow_command()
                kind, left, right = robot.command
                if kind == "signal":
                    link.send_signal(left, right, time_to_live_ms, last)
                elif kind == "speed":
                    link.send_speed(left, right, time_to_live_ms, last)
                else:
                    link.send_coast(time_to_live_ms, last)
                command_given(time_s, kind, left, right)
                due = last - last % n + n
            ahead_ticks = min(due - last, (seconds - time_s) / tick_s)
            # looked for too early: it is about to come
            look_s = received_s if on_time and due == awaited else received_s + ahead_ticks * tick_s - early_s
            awaited = due
            wait_until_s = received_s + (ahead_ticks + period + 1) * tick_s

    def _in_new_session(self, received: list[Received]) -> list[Received]:
        """Makes the board ready again; returns the telemetry of the new session."""
        self._armed_tick = _NOT_YET
        self._make_ready()
        if self._halted:
            self._armed_tick = -1
        return [*received, *self.link.telemetry.fetch()]

    def _take_events(self) -> None:
        """Puts events aside. Stops of the motors before the run are not of it: they become notices."""
        for event in self.link.events.fetch():
            if not event.earlier or self.link.counts.sessions != self._first_session:
                self.record.append_event(event)
            elif event.kind in _UNASKED or (event.kind, event.value) == _SUPPLY_LOW:
                self.notices.append(
                    f"before this run, by the clock of the board at {self.link.transport.name}: {event}"
                )

    def _time_after_reset(self, host_s: float) -> float:
        """The run's time of a tick that began then: whole ticks; the board's outage by the transport's clock."""
        passed_s = round((host_s - self.clock_offset_s) / self.tick_s) * self.tick_s
        return max(passed_s, self._last_s + self.tick_s) if self._last_s >= 0.0 else 0.0

    def bad_line(self, seed: int) -> BadLine:
        """See `boebot.running.driver.Driver`."""
        return self.link.line.make_bad(seed)

    def end(self) -> None:
        """Stops the board, waits until it confirms, and leaves it to others; one that has gone stops by its
        dead-man."""
        self._put_devices_aside()
        with contextlib.suppress(BoebotError):
            self.link.stop_and_confirm(STOP_LIMIT_S)
            self._take_events()
            self.link.close()

    def status(self) -> Status:
        """See `boebot.running.driver.Driver`."""
        link, watchdog_resets = self.link, self.session.watchdog_resets()
        return Status(
            run_time=max(self._last_s, 0.0),
            clock_offset=self.clock_offset_s,
            late_steps=self.late_steps,
            resets=self.resets,
            lost_frames=link.line.decoder.lost,
            bad_frames=link.line.decoder.bad,
            sessions_lost=link.counts.sessions_lost,
            link={"host": link.counters().as_dict(), "board": dict(link.board_counters.values)},
            notices=[*self.notices, *self.session.notes(), *figures.hang_sentences(watchdog_resets)],
            watchdog_resets=watchdog_resets,
        )
