"""The link to one board: a session that opens itself, delivery of what must arrive, telemetry and set-points
(protocol/PROTOCOL.md).

When the board was reset, or has not heard the host for too long, its next hello tells, and the link opens a new session
by itself: `sessions` counts them, and who configured and armed the board does it again. All of that happens inside
whatever call waits for the board (boebot.link.opening says how).

Everything that crossed the wire is kept with its stamp when `record` is true.
"""

from __future__ import annotations

from collections.abc import Callable, Collection

from boebot.devices.buzzer import next_token
from boebot.errors import BoardError
from boebot.link import messages, mismatch
from boebot.link.delivery import BoardEvent, LatchedAgainError, LinkTimes, RequestKind
from boebot.link.line import SHORTEST_S, Append
from boebot.link.parameter_values import parameter_counts, parameter_spec
from boebot.link.traffic import Telemetry, Traffic
from boebot.link.transport import Transport

__all__ = ["Link", "Telemetry", "text"]

_SIGNAL = messages.SetpointSignal
_SPEED = messages.SetpointSpeed
_COAST = messages.SetpointCoast
_BUSY_AGAIN_S = 0.05  # while the EEPROM is being written
_ROUND_PERIODS = 4 * (len(messages.Task) + 1)  # of telemetry: each task's time and the counters, a message in four
_ROUNDS = 4  # in which each task was told at least once, or something is wrong
_LOOK_S = 0.05
_ROUNDING_S = 0.5e-6  # a clock of whole cycles may stop so much before what was waited for

_SUPPLY = messages.Telemetry.OFFSETS["supply"]
_LATCHES = messages.Telemetry.OFFSETS["latches"]


def text(field: bytes) -> str:
    """A text field of a message without its padding."""
    return field.split(b"\0", 1)[0].decode("utf-8", errors="replace")


class Link(Traffic):
    """The host's end of the link to one board: what programs call. Its attributes are those of `Traffic`, `Opening`
    and `Line`."""

    def __init__(
        self,
        transport: Transport,
        record: Append | None = None,
        times: LinkTimes | None = None,
        take_over: bool = False,
    ) -> None:
        """Nothing is sent yet: see `open`.

        Args:
            transport: where the board is.
            record: keep all that crosses the wire.
            times: time-outs, if not the usual ones.
            take_over: take the board even if another host has it.
        """
        super().__init__(transport, record, times or LinkTimes(), take_over)
        self.polled_s = 0.0

    # ---- telemetry, events, set-points -------------------------------------------------------------------------------

    def poll(self, wait_s: float, quiet_s: float = 0.0) -> list[Telemetry]:
        """The telemetry that arrived, oldest first; waits for some as `Transport.read` does, and keeps the session
        alive meanwhile. Opens a new session if need be: see `sessions`.

        Raises:
            BoardError: the board has gone, or another program keeps taking it.
            ProtocolError: a board of another protocol has come in its place.
        """
        now = self._now()
        return self.poll_until(now + quiet_s, now + wait_s)

    def poll_until(self, look_s: float, end_s: float) -> list[Telemetry]:
        """As `poll`, by the transport's clock: looks for telemetry from `look_s` on, and waits until `end_s` at most.
        `polled_s` is then the time at which it returned."""
        now = self._now()
        while True:
            if now + _ROUNDING_S >= self._due:
                self._service(now + _ROUNDING_S)
            wait = (end_s if end_s < self._due else self._due) - now
            if wait < SHORTEST_S:
                wait = SHORTEST_S
            quiet = look_s - now
            self._receive(wait, 0.0 if quiet <= 0.0 else quiet if quiet < wait else wait)
            now = self._now()
            if (self._telemetry and now >= look_s) or now >= end_s:
                self.polled_s = now
                telemetry, self._telemetry = self._telemetry, []
                return telemetry

    def fetch_telemetry(self) -> list[Telemetry]:
        """The telemetry that arrived while somebody waited for an answer; does not wait."""
        telemetry, self._telemetry = self._telemetry, []
        return telemetry

    def forget_telemetry(self) -> None:
        """Drops the telemetry that arrived while somebody waited for an answer."""
        self._telemetry = []

    @property
    def waiting_events(self) -> Collection[BoardEvent]:
        """What `events` would return: the same object as long as the link lives."""
        return self._events.waiting

    def events(self) -> list[BoardEvent]:
        """What happened on the board since the last call, in order; stops of the motors that nobody was told of before
        this session come first (`earlier`). Events that nobody fetches are, after some, no longer acknowledged, so that
        the board keeps them."""
        return list(self._events.fetch()) if self._events.waiting else []

    def send_signal(self, left: float, right: float, time_to_live_ms: int, tick: int) -> None:
        """Motor signals -1..1, in answer to the observation of `tick`."""
        self._send(
            _SIGNAL.ID,
            _SIGNAL.STRUCT.pack(round(left * 10000), round(right * 10000), time_to_live_ms, tick & 0xFFFF),
        )

    def send_speed(self, left_m_s: float, right_m_s: float, time_to_live_ms: int, tick: int) -> None:
        """Wheel speeds along the ground (m/s), in answer to the observation of `tick`."""
        self._send(
            _SPEED.ID,
            _SPEED.STRUCT.pack(round(left_m_s * 10000), round(right_m_s * 10000), time_to_live_ms, tick & 0xFFFF),
        )

    def send_coast(self, time_to_live_ms: int, tick: int) -> None:
        """No pulses, in answer to the observation of `tick`; nothing is latched."""
        self._send(_COAST.ID, _COAST.STRUCT.pack(time_to_live_ms, tick & 0xFFFF))

    # ---- slow devices --------------------------------------------------------------------------------------------

    def fetch_devices(self) -> list[bytes]:
        """Payloads of the devices_telemetry that arrived since the last call, oldest first; does not wait."""
        devices, self._devices = self._devices, []
        return devices

    def want_turret(self, turret: messages.Turret, pulse: int) -> None:
        """Has the turret so until a stop: told until devices_telemetry shows `pulse` (counts; 0: none), and again when
        a dead-man stop or a new session has released it. While the motors are latched it does not move."""
        self._wants.turn(turret, pulse if turret.hold else 0)
        self._tell_wanted(self._now())

    def want_tone(self, tone: messages.Buzzer) -> None:
        """Has a tone sound once, in place of the one before; its token is given here. Told until the board has begun
        it or the session ends."""
        self._wants.sound(tone._replace(token=next_token(self._wants.token)))
        self._tell_wanted(self._now())

    # ---- stop --------------------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Stops the motors and latches them off until `arm`. Sent again, while anybody waits for the board, until it
        is confirmed. The turret is free and the buzzer silent from then on, too."""
        self._wants.stopped()
        self._stopping.begin()
        self._service(self._now())

    @property
    def stop_under_way(self) -> bool:
        """Whether a stop was not yet confirmed."""
        return self._stopping.wanted

    def stop_and_confirm(self, limit_s: float | None = None) -> bool:
        """Stops the motors and waits until the board says so. A session that ends meanwhile latches them, too.

        Returns:
            Whether it was confirmed within `limit_s` (None: `LinkTimes.stop_limit_s`).
        """
        self.stop()
        end = self._now() + (self.times.stop_limit_s if limit_s is None else limit_s)
        while self._stopping.wanted and self._now() < end:
            self._turn(end)
        return not self._stopping.wanted

    # ---- motors and parameters ---------------------------------------------------------------------------------------

    def arm(self) -> None:
        """Ends the latch: set-points that answer a later tick move the motors.

        Ends the latching that the newest telemetry tells of; a stop that comes meanwhile is not undone.

        Raises:
            LatchedAgainError: there has been another since.
            BoardError: refused while the supply is low; or as `request`.
        """
        limit_s = self.times.request_limit_s
        end = self._now() + limit_s
        latest = self.latest or self._fresh_telemetry(end)
        while True:
            answer = self.request(messages.Arm, latest[_LATCHES], what="arm")
            if answer.status == messages.AnswerStatus.OK:
                return
            supply_v = int.from_bytes(latest[_SUPPLY : _SUPPLY + 2], "little") / 1000
            if answer.status != messages.AnswerStatus.SUPPLY_LOW or supply_v > 0 or self._now() >= end:
                break
            latest = self._fresh_telemetry(end)  # the supply was not yet measured
        where = self.transport.name
        if answer.status == messages.AnswerStatus.LATCHED_AGAIN:
            self._fresh_telemetry(end)  # who tries again knows of it
            raise LatchedAgainError(f"the motors of the board at {where} were latched off once more before they armed")
        if answer.status == messages.AnswerStatus.SUPPLY_LOW:
            known = f" ({supply_v:.2f} V)" if supply_v else ""
            raise BoardError(f"the board at {where} does not arm its motors: its supply is low{known}")
        raise BoardError(f"the board at {where} does not arm its motors: {_reason(answer.status)}")

    def _fresh_telemetry(self, end: float) -> bytes:
        """Telemetry of this session that comes from now on."""
        before, sessions = self.latest, self.sessions
        while self.latest is None or self.latest is before:
            if self._now() >= end:
                raise BoardError(f"the board at {self.transport.name} sends no telemetry")
            if self.sessions != sessions:
                before, sessions = None, self.sessions
            self._turn(end)
        return self.latest

    @property
    def parameters(self) -> list[str]:
        """Names of the parameters that the board knows: those of its minor version."""
        assert self.hello is not None, "a session is open"
        minor = mismatch.minor_of(self.hello)
        return [name for name, spec in messages.PARAMETERS.items() if spec.since <= minor]

    def get_parameter(self, name: str) -> float:
        """The value of a parameter, in its unit."""
        spec = parameter_spec(name)
        answer = self.request(messages.GetParameter, spec.id, what=f"tell parameter {name}")
        return self._parameter(answer, name) * spec.scale

    def set_parameter(self, name: str, value: float) -> float:
        """Sets a parameter until the board's next reset; returns the value now in force, in its unit."""
        counts = parameter_counts(name, value)
        spec = parameter_spec(name)
        answer = self._request_when_free(messages.SetParameter, spec.id, counts, what=f"set parameter {name}")
        return self._parameter(answer, name) * spec.scale

    def save_parameters(self) -> None:
        """Writes all parameters to the board's EEPROM, so that they outlast resets and power cuts.

        Raises:
            BoardError: the supply is low, what was written does not read back; or as `request`.
        """
        what = "save its parameters"
        answer = self._request_when_free(messages.SaveParameters, what=what, limit_s=self.times.save_limit_s)
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"the board at {self.transport.name} did not {what}: {_reason(answer.status)}")

    def reset_parameters(self) -> None:
        """All parameters to the image's defaults; what is saved stays."""
        what = "reset its parameters"
        answer = self._request_when_free(messages.ResetParameters, what=what)
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"the board at {self.transport.name} did not {what}: {_reason(answer.status)}")

    # ---- the board's own timing --------------------------------------------------------------------------------------

    def measure_task_times(
        self, seconds: float, progress: Callable[[float], object] = lambda _: None
    ) -> dict[str, int]:
        """Lets the board work for so long and returns `task_times` then: of all since the session was opened. Telemetry
        and events that come meanwhile are left aside.

        Args:
            seconds: by the transport's clock. The board tells one task after another, so that some are told up to 0.8 s
                later, or more where the line is slow.
            progress: told how much of it is over, 0 to 1.

        Raises:
            BoardError: the board has not told all of them, in four times the time that it needs; or as `poll`.
        """
        assert self.hello is not None, "a session is open"
        round_s = _ROUND_PERIODS * self.hello.telemetry_period * self._tick_s
        begun = self._now()
        least, most = seconds + round_s, seconds + _ROUNDS * round_s
        while (passed := self._now() - begun) < least or (None in self.task_times.values() and passed < most):
            progress(min(passed / least, 1.0))
            self.poll(_LOOK_S)
            self.events()
        missing = [name for name, cycles in self.task_times.items() if cycles is None]
        if missing:
            raise BoardError(
                f"the board at {self.transport.name} did not tell the times of its tasks {', '.join(missing)} within "
                f"{most:.1f} s; expected one task after another"
            )
        return {name: cycles for name, cycles in self.task_times.items() if cycles is not None}

    def _request_when_free(
        self, kind: RequestKind, *arguments: int, what: str, limit_s: float | None = None
    ) -> messages.Answer:
        """As `request`; asks again while the board writes its EEPROM."""
        end = self._now() + self.times.save_limit_s
        while True:
            answer = self.request(kind, *arguments, what=what, limit_s=limit_s)
            now = self._now()
            if answer.status != messages.AnswerStatus.BUSY or now >= end:
                return answer
            again = now + _BUSY_AGAIN_S
            while self._now() < again:
                self._turn(again)

    def _parameter(self, answer: messages.Answer, name: str) -> int:
        if answer.status != messages.AnswerStatus.OK:
            raise BoardError(f"the board at {self.transport.name} refuses parameter {name}: {_reason(answer.status)}")
        return answer.value


def _reason(status: int) -> str:
    """Why a board refuses."""
    return messages.AnswerStatus(status).name.lower().replace("_", " ")
