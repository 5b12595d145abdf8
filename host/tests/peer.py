"""A model of the board, written from PROTOCOL.md alone: the protocol's other end, and a point that drives about a
square room.

The host's own tests use it, which need no simulator. `InProcess` lets it live in simulated time behind a line that may
lose, double, delay and damage what it carries (channel.py); `Pty` puts it on a real pseudo-terminal, in a thread. Each
of its protections can be switched off, so that a test can show what it is good for.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import math
import os
import random
import select
import struct
import threading
import time
import tty
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from channel import Channel

from boebot.arenas.arena import Arena
from boebot.arenas.description import ArenaDescription, Polygon, Start
from boebot.boards import TruthNow, WatchdogReset
from boebot.description.board_parameters import parameters_of
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.frame import NO_SESSION, SEED, Decoder, encode
from boebot.link.messages import AnswerStatus, Devices, EventKind, Latch, Status
from boebot.record.blocks import Block, Group

TICK_S = 0.01
BYTE_S = 2e-5  # 500,000 baud
ROOM_M = 1.5
CORNERS = [(0.0, 0.0), (ROOM_M, 0.0), (ROOM_M, ROOM_M), (0.0, ROOM_M)]
ROOM = Arena(
    ArenaDescription(name="square", outline=[Polygon(corners_m=CORNERS)], start=Start(x_m=ROOM_M / 2, y_m=ROOM_M / 2))
)
NONCES = 1 << 21
SLOW_DEVICES = (
    Devices.BATTERY | Devices.LIGHT | Devices.ANALOG_INFRARED | Devices.COMPASS | Devices.TURRET | Devices.BUZZER
)
FIELD_COUNTS = 200  # of the earth's field along the floor
HELLO_TICKS, HELLO_SESSION_TICKS = 10, 20
OWN_TICKS = 4  # from one task's time to the next, or to the counters
QUEUE = 4
EEPROM_S = 0.2  # for all parameters
Setpoint = messages.SetpointSignal | messages.SetpointSpeed | messages.SetpointCoast


@dataclass(frozen=True)
class Protections:
    """What keeps the board from doing what it should not."""

    numbers: bool = True  # requests that come again are not carried out again
    seed: bool = True  # frames of other sessions have another checksum
    age: bool = True  # set-points that answer an old tick are refused
    latches: bool = True  # an arm that knows nothing of the latest latching is refused
    nonce: bool = True  # an open with a nonce of earlier times is dropped


def name_of(parameter: int) -> str:
    """The parameter's name by its number."""
    return next(name for name, spec in messages.PARAMETERS.items() if spec.id == parameter)


class Peer:
    """The board's side. Feed it bytes with `receive`; `tick()` makes one control tick; `take()` gives its frames.

    Attributes:
        now: what its clock is made from (s); set by the harness.
        drift, first_us, first_tick: of its clock, and where time and ticks begin after a reset.
        parameters: in force, by number, in counts.
        carried_out: requests carried out, in order, as (session, message).
        setpoints: those that arrived, and `setpoint_ticks`, when; `accepted`, those that count.
        tones: (frequency in Hz, length in s) of those that were begun, in order.
        task_times: the longest of each task in this session, in cycles, at its opening `usual_task_times`; not sent for
            `silent_tasks`.
        starts: how often it was started. openings: sessions that were opened.
    """

    def __init__(self, robot: RobotDescription | None = None, protections: Protections | None = None) -> None:
        self.robot = robot or load_robot("shieldbot")
        self.protections = protections or Protections()
        self.protocol_version = messages.PROTOCOL_VERSION
        self.schema_hash = messages.SCHEMA_HASH
        self.described: dict[int, tuple[int, int]] = {
            number: (kind.LENGTH, messages.HASHES[number]) for number, kind in messages.MESSAGES.items()
        }
        self.pin_map = self.robot.pin_map
        self.tick_rate = 100
        self.answers = True
        self.now: Callable[[], float] = lambda: 0.0
        self.drift = 0.0
        self.first_us = 0
        self.first_tick = 0
        self.first_edges = (0, 0)  # of the encoders, 32 bits with sign
        self.overruns = 0  # modulo 256
        self.first_number = 0  # of requests and events in each session: to start near their roll-over
        self.supply_mv = 5000
        self.battery_mv = 3600  # at the pin, behind the divider
        self.light_us = (800, 1600)
        self.telemetry_period = 1
        self.usual_task_times = [0] * len(messages.Task)
        self.silent_tasks: set[int] = set()
        self.saved: dict[int, int] | None = None
        self.carried_out: list[tuple[int, messages.Message]] = []
        self.setpoints: list[Setpoint] = []
        self.setpoint_ticks: list[int] = []
        self.accepted: list[Setpoint] = []
        self.tones: list[tuple[int, float]] = []
        self.stops = 0
        self.openings: list[int] = []
        self.x = self.y = ROOM_M / 2
        self.heading = 0.3
        self.path: list[tuple[float, float, float, float, bool]] = []
        self.starts = 0
        self._random = random.Random("peer")
        self._frames: list[bytes] = []
        self.reset()

    # ---- starts and sessions -----------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Power on."""
        self.starts += 1
        self.ticks = self.first_tick
        self._reset_s = self.now()
        self.decoder = Decoder(NO_SESSION, to_board=True)
        self.session = 0
        self.parameters = dict(self.saved) if self.saved is not None else self.defaults()
        self._sequence = self._random.randrange(256)
        self._frames = []
        self._edges = [0.0, 0.0]
        self.turret_pulse = 0
        self.sounding_until: float | None = None
        self._tone_token = 0
        self._touching = False
        self.latch, self.latches = Latch.START, 1
        self.supply_measured = False
        self.supply_is_low = False
        self.status = Status(0)
        self.command = (0.0, 0.0)
        self._coasting = True
        self._in_force: tuple[int, int, int] | None = None  # tick that it answers, sequence, last tick of its life
        self._armed_tick = self.ticks
        self._setpoint_sequence = 0
        self._saving_until: float | None = None
        self._save_answer: int | None = None
        self.counts = dict.fromkeys(messages.Counters._fields, 0)
        self._next_task = 0
        self._new_nonce()
        self._event: messages.Event | None = None
        self._events: deque[tuple[int, int, int]] = deque()
        self._merged: dict[int, tuple[int, int, int]] = {}  # by kind: the latest that found no room in the queue
        self._begin_numbers()
        if self.answers:
            self._hello()

    def defaults(self) -> dict[int, int]:
        """The image's parameters."""
        values = {spec.id: spec.minimum for spec in messages.PARAMETERS.values()}
        ordinary = {
            "time_to_live": 250,
            "encoder_limit": 80,
            "telemetry_period": 1,
            "devices_period": 2,
            "session_time_out": 1000,
            "retry_time": 0,
            "supply_minimum": 4200,
            "bandgap": 1100,
        }
        for name, value in (parameters_of(self.robot) | ordinary).items():
            spec = messages.PARAMETERS[name]
            values[spec.id] = round(value / spec.scale) if name not in ordinary else int(value)
        return values

    def parameter(self, name: str) -> int:
        """A parameter in force, in counts."""
        return self.parameters[messages.PARAMETERS[name].id]

    def _new_nonce(self) -> None:
        self.nonce = self._random.randrange(1, NONCES)

    def _begin_numbers(self) -> None:
        self._request_number = self.first_number
        self._last_answer: messages.Answer | None = None
        self._event_number = self.first_number
        waiting = [self._event[1:]] if self._event is not None else []
        waiting += [*self._events, *sorted(self._merged.values(), key=lambda event: event[2])]
        self._event, self._merged = None, {}
        self._event_sent_s = 0.0
        self._events = deque((kind, value, us) for kind, value, us in waiting if kind != EventKind.WHISKERS)

    def _open(self, message: messages.Open) -> None:
        seed = message.board_nonce ^ message.host_nonce
        if seed == self.session and seed:
            self._hello()
            return
        if message.protocol_version // 16 != self.protocol_version // 16 or seed in (0, SEED):
            return
        if self.protections.nonce and message.board_nonce != self.nonce:
            return
        self._latch(Latch.SESSION_ENDED)
        self.session = seed
        self.openings.append(seed)
        self.decoder.seed = seed if self.protections.seed else SEED
        self._begin_numbers()
        self.task_times = list(self.usual_task_times)
        self._tone_token = 0
        if self._save_answer is not None:
            self._save_answer = None
        self._new_nonce()
        self._heard_s = self.now()
        self._hello()

    def _end_session(self) -> None:
        self.session = 0
        self.decoder.seed = NO_SESSION
        self._latch(Latch.SESSION_ENDED)
        self._new_nonce()
        self._hello()

    # ---- what comes --------------------------------------------------------------------------------------------------

    def receive(self, data: bytes) -> None:
        """Takes bytes from the host."""
        for message_id, sequence, payload in self.decoder.feed(data):
            message = messages.MESSAGES[message_id].unpack(payload)
            if not self.answers:
                continue
            if isinstance(message, messages.Open | messages.Identify | messages.Describe):
                self._handshake(message)
            elif self.session:
                self._heard_s = self.now()
                self._take(message, sequence)

    def _handshake(self, message: messages.Open | messages.Identify | messages.Describe) -> None:
        if isinstance(message, messages.Open):
            self._open(message)
        elif isinstance(message, messages.Identify):
            self._send(messages.Identity(b"0.1.0", b"peer", self.pin_map.encode(), 0, 0))
        elif message.board_nonce == self.nonce:
            numbers = sorted(self.described)
            number = numbers[message.index] if message.index < len(numbers) else 0
            length, digest = self.described.get(number, (0, 0))
            self._send(messages.Description(message.index, len(numbers), number, length, digest))

    def _take(self, message: messages.Message, sequence: int) -> None:
        if isinstance(message, messages.Stop):
            self.stops += 1
            self._latch(Latch.STOP_COMMAND)
            self._send(messages.Stopped(message.token))
        elif isinstance(message, messages.Close):
            if message.session == self.session:
                self._end_session()
        elif isinstance(message, Setpoint):
            self.setpoints.append(message)
            self.setpoint_ticks.append(self.ticks)
            self._setpoint(message, sequence)
        elif isinstance(message, messages.Turret):
            self._turn(message)
        elif isinstance(message, messages.Buzzer):
            self._sound(message)
        elif isinstance(message, messages.Acknowledge):
            if self._event is not None and message.number == self._event.number:
                self._event = None
                self._send_event()
        elif isinstance(message, messages.ClockProbe):
            self._send(messages.ClockAnswer(message.token, self.board_us()))
        else:
            self._request(message)

    def _request(self, message: messages.Message) -> None:
        number: int = message.number  # type: ignore[union-attr]
        if number == self._request_number and self.protections.numbers:
            self.counts["duplicate"] += 1
            if self._last_answer is not None:
                self._send(self._last_answer)
        elif number == (self._request_number + 1) % 65536 or (
            number == self._request_number and not self.protections.numbers
        ):
            self._request_number = number
            self._last_answer = None
            self.carried_out.append((self.session, message))
            status, value = self._carry_out(message)
            if status is not None:
                self._answer(number, status, value)
        else:
            self.counts["refused"] += 1

    def _answer(self, number: int, status: int, value: int = 0) -> None:
        self._last_answer = messages.Answer(number, status, value)
        self._send(self._last_answer)

    def _carry_out(self, message: messages.Message) -> tuple[int | None, int]:
        """Status (None: the answer comes later) and value."""
        saving = self._saving_until is not None
        if isinstance(message, messages.GetParameter):
            if message.parameter not in self.parameters:
                return AnswerStatus.UNKNOWN_PARAMETER, 0
            return AnswerStatus.OK, self.parameters[message.parameter]
        if isinstance(message, messages.SetParameter):
            return self._set(message, saving)
        if isinstance(message, messages.ResetParameters):
            if saving:
                return AnswerStatus.BUSY, 0
            self.parameters = self.defaults()
            return AnswerStatus.OK, 0
        if isinstance(message, messages.SaveParameters):
            if saving:
                return AnswerStatus.BUSY, 0
            if self.supply_is_low or not self.supply_measured:
                return AnswerStatus.SUPPLY_LOW, 0
            self._saving_until = self.now() + EEPROM_S
            self._save_answer = message.number
            return None, 0
        assert isinstance(message, messages.Arm)
        if self.supply_is_low or not self.supply_measured:
            return AnswerStatus.SUPPLY_LOW, 0
        if message.latches != self.latches and self.protections.latches:
            return AnswerStatus.LATCHED_AGAIN, 0
        if self.latch != Latch.NONE:
            self.latch = Latch.NONE
            self._happened(EventKind.LATCH, Latch.NONE)
        self._armed_tick = self.ticks
        return AnswerStatus.OK, 0

    def _set(self, message: messages.SetParameter, saving: bool) -> tuple[int, int]:
        if message.parameter not in self.parameters:
            return AnswerStatus.UNKNOWN_PARAMETER, 0
        spec = messages.PARAMETERS[name_of(message.parameter)]
        if saving:
            return AnswerStatus.BUSY, self.parameters[message.parameter]
        if not spec.minimum <= message.value <= spec.maximum:
            return AnswerStatus.OUT_OF_RANGE, self.parameters[message.parameter]
        self.parameters[message.parameter] = message.value
        return AnswerStatus.OK, message.value

    # ---- motion ------------------------------------------------------------------------------------------------------

    def _latch(self, cause: Latch) -> None:
        self.latches = (self.latches + 1) & 0xFF
        if self.latch == Latch.NONE:
            self.latch = cause
            self._happened(EventKind.LATCH, cause)
        self._rest()
        self.status &= ~Status.DEAD_MAN

    def _turn(self, message: messages.Turret) -> None:
        if not message.hold:
            self.turret_pulse = 0
        elif self.latch != Latch.NONE or not self._is_on(Devices.TURRET) or abs(message.angle) > 16000:
            self.counts["refused"] += 1
        else:
            pulse = self.parameter("turret_centre") + self.parameter("turret_gain") * message.angle / 10000
            self.turret_pulse = round(min(max(pulse, 600 * 16), 2400 * 16))

    def _sound(self, message: messages.Buzzer) -> None:
        if not self._is_on(Devices.BUZZER) or (message.frequency and not 40 <= message.frequency <= 8000):
            self.counts["refused"] += 1
        elif message.token != self._tone_token:
            self._tone_token = message.token
            self.sounding_until = self.now() + message.duration / 100 if message.frequency else None
            self.tones.append((message.frequency, message.duration / 100))

    def _is_on(self, devices: Devices) -> bool:
        return bool(Devices(self.parameter("devices")) & devices)

    def _rest(self) -> None:
        self.turret_pulse, self.sounding_until = 0, None
        self.command, self._coasting, self._in_force = (0.0, 0.0), True, None
        self.status &= ~Status.MOTORS_ENABLED

    def _setpoint(self, message: Setpoint, sequence: int) -> None:
        limit = 10000 if isinstance(message, messages.SetpointSignal) else 5000
        wheels = () if isinstance(message, messages.SetpointCoast) else (message.left, message.right)
        if self.latch != Latch.NONE or message.time_to_live > 2000 or any(abs(wheel) > limit for wheel in wheels):
            self.counts["refused"] += 1
            return
        tick = self.ticks - 1  # the one that is being lived
        age = (tick - message.answers_tick) & 0xFFFF
        life = math.ceil((message.time_to_live or self.parameter("time_to_live")) / 1000 / TICK_S)
        late = age >= life or (message.answers_tick - self._armed_tick) & 0xFFFF in (0, *range(0x8000, 0x10000))
        if self._in_force is not None:
            newer = (message.answers_tick - self._in_force[0] + 0x8000) % 0x10000 - 0x8000
            later = (sequence - self._in_force[1] + 0x80) % 0x100 - 0x80
            late = late or newer < 0 or (newer == 0 and later <= 0)
        if late and self.protections.age:
            self.counts["late"] += 1
            return
        self.accepted.append(message)
        self._setpoint_sequence = sequence
        self._in_force = (message.answers_tick, sequence, tick - age + life)
        if not self.protections.age:
            self._in_force = (message.answers_tick, sequence, tick + life)
        self._coasting = not wheels
        full = 10000 if isinstance(message, messages.SetpointSignal) else self.parameter("wheel_speed_maximum")
        self.command = (wheels[0] / full, wheels[1] / full) if wheels else (0.0, 0.0)
        self.status = self.status & ~Status.DEAD_MAN | Status.MOTORS_ENABLED

    @property
    def moving(self) -> bool:
        """Whether a wheel is driven."""
        return self.command != (0.0, 0.0)

    # ---- time --------------------------------------------------------------------------------------------------------

    def board_us(self) -> int:
        """Its clock, as it goes over the wire."""
        return (self.first_us + int((self.now() - self._reset_s) * (1 + self.drift) * 1e6)) & 0xFFFFFFFF

    def tick(self) -> None:
        """One control tick."""
        if not self.answers:
            self.ticks += 1
            return
        self._tick_us = self.board_us()
        self._watch_supply()
        if self._in_force is not None and self.ticks > self._in_force[2]:
            answered = self._in_force[0]
            self._rest()
            self.status |= Status.DEAD_MAN
            self._happened(EventKind.DEAD_MAN, answered)
        if self.session and self.now() - self._heard_s > self.parameter("session_time_out") / 1000:
            self._end_session()
        self._end_saving()
        self._move_and_feel()
        self._send_periodic()
        self.ticks = (self.ticks + 1) & 0xFFFFFFFF

    def _watch_supply(self) -> None:
        minimum = self.parameter("supply_minimum")
        if self.supply_measured and self.supply_mv < minimum and not self.supply_is_low:
            self.supply_is_low = True
            self._latch(Latch.SUPPLY_LOW)
        elif self.supply_mv >= minimum + 100:
            self.supply_is_low = False
        self.supply_measured = True

    def _end_saving(self) -> None:
        if self._saving_until is not None and self.now() >= self._saving_until:
            self._saving_until = None
            self.saved = dict(self.parameters)
            if self._save_answer is not None:
                self._answer(self._save_answer, AnswerStatus.OK)
                self._save_answer = None

    def _send_periodic(self) -> None:
        period = max(self.telemetry_period, self.parameter("telemetry_period"))
        if self.ticks % (max(HELLO_SESSION_TICKS, 4 * period) if self.session else HELLO_TICKS) == 0:
            self._hello()
        if not self.session:
            return
        if self._event is None:
            self._send_event()
        elif self.now() - self._event_sent_s >= (self.parameter("retry_time") / 1000 or 2 * TICK_S + 200 * BYTE_S):
            self.counts["retransmitted"] += 1
            self._event_sent_s = self.now()
            self._send(self._event)
        if self.ticks % period == 0:
            self._send(self._telemetry())
        if self._is_on(SLOW_DEVICES) and self.ticks % self.parameter("devices_period") == 0:
            self._send(self._devices_telemetry())
        if self.ticks % (OWN_TICKS * self.telemetry_period) == 0:
            self._send_task_time()

    def _send_task_time(self) -> None:
        if self._next_task < len(messages.Task):
            if self._next_task not in self.silent_tasks:
                self._send(messages.TaskTime(self._next_task, self.task_times[self._next_task]))
        else:
            self.counts["good"], self.counts["bad"] = self.decoder.good, self.decoder.bad
            self._send(messages.Counters(*(value & 0xFFFF for value in self.counts.values())))
        self._next_task = (self._next_task + 1) % (len(messages.Task) + 1)

    def _telemetry(self) -> messages.Telemetry:
        ahead = self._ahead()
        status = self.status
        if self.latch != Latch.NONE:
            status |= Status.LATCHED
        if self.supply_is_low:
            status |= Status.SUPPLY_LOW
        if self._saving_until is not None:
            status |= Status.SAVING
        return messages.Telemetry(
            tick=self.ticks,
            time=self._tick_us,
            encoder_left=_signed(self.first_edges[0] + int(self._edges[0])),
            encoder_right=_signed(self.first_edges[1] + int(self._edges[1])),
            edge_period_left=0,
            edge_period_right=0,
            whiskers=3 if self._touching else 0,
            infrared=3 if ahead < 0.2 else 0,
            infrared_age=self.ticks % 5,
            ping_echo=round(ahead * 2 / 343.5 * 1e6) if ahead < 3.0 else 0,
            ping_age=self.ticks % 5,
            ping_status=messages.PingStatus.OK if ahead < 3.0 else messages.PingStatus.NOTHING_NEAR,
            pulse_left=self._pulse(self.command[0], 200),
            pulse_right=self._pulse(self.command[1], -200),
            supply=self.supply_mv if self.supply_measured else 0,
            status=int(status),
            latch=self.latch,
            latches=self.latches,
            setpoint_sequence=self._setpoint_sequence,
            overruns=self.overruns % 256,
        )

    def _devices_telemetry(self) -> messages.DevicesTelemetry:
        converted = round(self.battery_mv / self.supply_mv * 1024)
        age = self.ticks % 4  # each is measured every fourth tick
        return messages.DevicesTelemetry(
            tick=self.ticks,
            supply=self.supply_mv,
            infrared_zone_left=0,
            infrared_zone_right=0,
            infrared_zone_age=255,
            battery=converted if self._is_on(Devices.BATTERY) else 0,
            battery_age=age if self._is_on(Devices.BATTERY) else 255,
            analog_infrared=0,
            analog_infrared_age=255,
            light_left=self.light_us[0] if self._is_on(Devices.LIGHT) else 0,
            light_right=self.light_us[1] if self._is_on(Devices.LIGHT) else 0,
            light_age=age if self._is_on(Devices.LIGHT) else 255,
            compass_x=round(FIELD_COUNTS * math.cos(self.heading)),
            compass_y=round(-FIELD_COUNTS * math.sin(self.heading)),
            compass_z=-400,
            compass_age=age if self._is_on(Devices.COMPASS) else 255,
            compass_status=messages.CompassStatus.OK if self._is_on(Devices.COMPASS) else messages.CompassStatus.OFF,
            turret_pulse=self.turret_pulse,
            buzzer_token=self._tone_token,
        )

    # ---- events ------------------------------------------------------------------------------------------------------

    def _happened(self, kind: int, value: int) -> None:
        """Something to be delivered exactly once."""
        us = self.board_us()
        if len(self._events) + (self._event is not None) < QUEUE and not self._merged:
            self._events.append((kind, value, us))
        else:
            self.counts["deferred"] += 1
            closed = self._merged[kind][1] & 0xFF00 if kind == EventKind.WHISKERS and kind in self._merged else 0
            self._merged[kind] = (kind, value | closed, us)
        if self._event is None and self.session:
            self._send_event()

    def _send_event(self) -> None:
        if self._merged and len(self._events) + (self._event is not None) < QUEUE:
            oldest = min(self._merged, key=lambda kind: self._merged[kind][2])
            self._events.append(self._merged.pop(oldest))
        if self._events and self._event is None:
            self._event_number = (self._event_number + 1) % 65536
            self._event = messages.Event(self._event_number, *self._events.popleft())
            self._event_sent_s = self.now()
            self._send(self._event)

    # ---- world -------------------------------------------------------------------------------------------------------

    def drain(self) -> Group:
        """Where the robot was since the last time."""
        rows = [
            (time_s, struct.pack("<8d", x, y, heading, 0, 0, 0, 0, contact))
            for time_s, x, y, heading, contact in self.path or [(0.0, self.x, self.y, self.heading, False)]
        ]
        self.path = []
        return {"truth": Block.of(rows)}

    def _pulse(self, signal: float, gain_us: float) -> int:
        return 0 if self._coasting else round((1500 + gain_us * signal) * 16)

    def _ahead(self) -> float:
        """Distance to the wall ahead (m)."""
        dx, dy = math.cos(self.heading), math.sin(self.heading)
        reach_x = ((ROOM_M if dx > 0 else 0.0) - self.x) / dx if dx else math.inf
        reach_y = ((ROOM_M if dy > 0 else 0.0) - self.y) / dy if dy else math.inf
        return min(reach_x, reach_y)

    def _move_and_feel(self) -> None:
        """Advances the robot by a tick."""
        left, right = (0.16 * signal * TICK_S for signal in self.command)
        self._edges = [edges + abs(way) / 0.00325 for edges, way in zip(self._edges, (left, right), strict=True)]
        self.heading += (right - left) / 0.105
        x = self.x + (left + right) / 2 * math.cos(self.heading)
        y = self.y + (left + right) / 2 * math.sin(self.heading)
        self.x, self.y = min(max(x, 0.07), ROOM_M - 0.07), min(max(y, 0.07), ROOM_M - 0.07)
        touching = (self.x, self.y) != (x, y)
        if touching != self._touching:
            self._happened(EventKind.WHISKERS, 0x0303 if touching else 0)
        self._touching = touching
        self.path.append((self.now(), self.x, self.y, self.heading, touching))

    # ---- what goes ---------------------------------------------------------------------------------------------------

    def take(self) -> list[bytes]:
        """The frames that it sends, since last time."""
        frames, self._frames = self._frames, []
        return frames

    def _hello(self) -> None:
        period = max(self.telemetry_period, self.parameter("telemetry_period"))
        devices = self.parameter("devices")
        self._send(
            messages.Hello(
                self.protocol_version,
                self.schema_hash,
                self.nonce,
                self.session,
                self.tick_rate,
                self.parameter("session_time_out"),
                period,
                self.starts,
                messages.ResetCause.POWER,
                int(self.saved is not None),
                devices,
                self.robot.name.encode(),
            )
        )

    def _send(self, message: messages.Message) -> None:
        seed = self.session if self.protections.seed else SEED
        self._frames.append(encode(message.ID, self._sequence, message.pack(), seed))
        self._sequence = (self._sequence + 1) & 0xFF


def _signed(count: int) -> int:
    """As a counter of 32 bits with sign has it."""
    return (count + 2**31) % 2**32 - 2**31


class InProcess:
    """A board session in simulated time: world, transport and session in one, with the line's time and what the channel
    does to it."""

    name = "peer"
    realtime = False
    description = "stand-in board"

    def __init__(self, peer: Peer, channel: Channel | None = None) -> None:
        self.peer = peer
        self.closed = False
        self.before_tick: Callable[[int], None] = lambda _: None
        self.channel = channel or Channel()
        self._now = 0.0
        self._buffer: list[tuple[float, bytes]] = []
        self._order = itertools.count()
        self._coming: list[tuple[float, int, str, bytes]] = []  # heap of pieces under way
        self._free = {"board": 0.0, "host": 0.0}  # when the line in that direction is free
        self._calls: dict[int, Callable[[], None]] = {}
        peer.now = self.now
        self._schedule(0.0, "tick", b"")

    @property
    def transport(self) -> InProcess:
        return self

    @property
    def sessions(self) -> list[InProcess]:
        return [self]

    def on_wait(self, pause: Callable[[int], None]) -> None:
        pass

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        end = self._now + wait_s
        look = self._now + min(quiet_s, wait_s)
        self._collect()
        while True:
            due = self._coming[0][0]
            if self._buffer and (self._now >= look or due > look):
                self._now = max(self._now, look)
                pieces, self._buffer = self._buffer, []
                return pieces
            if due > end:
                self._now = max(end, self._now)
                return []
            self._now = max(self._now, due)
            self._happen(*heapq.heappop(self._coming)[2:])

    def write(self, data: bytes) -> None:
        if self.closed:
            raise BoardError("peer has gone")
        self._carry("board", data)

    def now(self) -> float:
        return self._now

    arena = ROOM

    def drain(self, *, ended: bool = False) -> Group:
        return self.peer.drain()

    def truth_now(self) -> TruthNow | None:
        return None

    def place(self, x: float, y: float, heading: float) -> None:
        raise BoardError("it stands where it is")

    def place_shape(self, index: int, x: float, y: float, heading: float) -> None:
        raise BoardError("it stands where it is")

    def counters(self) -> Mapping[str, float]:
        return {}

    def watchdog_resets(self) -> list[WatchdogReset]:
        return []

    def notes(self) -> list[str]:
        return []

    def close(self) -> None:
        self.closed = True

    def _schedule(self, at: float, what: str, data: bytes) -> None:
        heapq.heappush(self._coming, (at, next(self._order), what, data))

    def at(self, when_s: float, call: Callable[[], None]) -> None:
        """Calls that at that time, in the midst of whatever goes on."""
        number = next(self._order)
        self._calls[number] = call
        heapq.heappush(self._coming, (when_s, number, "call", number.to_bytes(8, "big")))

    def _happen(self, what: str, data: bytes) -> None:
        if what == "board":
            self.peer.receive(data)
        elif what == "host":
            self._buffer.append((self._now, data))
        elif what == "call":
            self._calls.pop(int.from_bytes(data, "big"))()
        else:
            self.before_tick(self.peer.ticks)
            self.peer.tick()
            self._schedule(self._now + TICK_S / (1 + self.peer.drift), "tick", b"")
        self._collect()

    def _collect(self) -> None:
        for frame in self.peer.take():
            self._carry("host", frame)

    def _carry(self, way: str, frame: bytes) -> None:
        """Puts a frame on the line; the channel says what becomes of it."""
        self._free[way] = max(self._free[way], self._now) + len(frame) * BYTE_S
        for at, data in self.channel.carry(way, frame, self._free[way]):
            self._schedule(at, way, data)


class Pty:
    """The peer behind a pseudo-terminal, ticking by the wall clock in a thread."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        peer.now = time.perf_counter
        peer.reset()
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
        next_tick = time.perf_counter()
        while self._running:
            wait = next_tick - time.perf_counter()
            if wait > 0 and select.select([self._master], [], [], wait)[0]:
                self.peer.receive(os.read(self._master, 4096))
                self._write()
            if time.perf_counter() >= next_tick:
                self.peer.tick()
                self._write()
                next_tick += TICK_S

    def _write(self) -> None:
        data = b"".join(self.peer.take())
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


def without(**protections: bool) -> Protections:
    """All protections but those named, as in without(numbers=False)."""
    return replace(Protections(), **protections)
