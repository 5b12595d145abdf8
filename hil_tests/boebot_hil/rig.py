"""One raw end of the protocol at an Uno under test: it sends and hears frames, also wrong ones.

All else of the board is the fixture `uno`'s. Every wait is in the board's own time and says what it waits for.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, ClassVar, TypeVar

from boebot.link import frame, messages
from boebot.link.transport import Transport
from sim_bridge.bench.uno import Uno
from sim_bridge.bench.waiting import Cannot
from sim_bridge.pins import BoardPins

_M = TypeVar("_M")  # a message

CYCLES_PER_S = 16_000_000
CYCLES_PER_US = 16
TICK_S = 0.010
FRAME_CYCLES = 320_000  # 20 ms servo frame


MOVING = (messages.Arm, messages.SetpointSignal, messages.SetpointSpeed, messages.Turret)
KEPT = (messages.SaveParameters, messages.ResetParameters)
FALLBACK = tuple(messages.PARAMETERS[name].id for name in ("fallback_after", "fallback_at_start"))
LINE_BYTES_PER_TICK = 500  # at 500,000 baud
PROBE_S = 0.15  # a session lives as long as it hears of us; the least patience of a board is 0.2 s
HOST_NONCE = 0x0A5A5A


class Rig:
    """Exchanges frames with the board, one message at a time, without the kit's session layer: a lost frame is not sent
    again. While `alive` it keeps the session open, and while `acknowledges` it acknowledges events."""

    may_move: ClassVar[bool] = False
    """Whether the motors of a board behind a port may turn."""

    def __init__(self, uno: Uno) -> None:
        self.uno = uno
        self._taken = 0  # of the bytes that came
        self.decoder = frame.Decoder(frame.NO_SESSION)
        self.telemetry: list[messages.Telemetry] = []
        self.answers: list[Any] = []
        self.events: list[messages.Event] = []
        self.heard: list[Any] = []  # all messages
        self.hello: messages.Hello | None = None
        self.seed = 0
        self.alive = self.acknowledges = True
        self._may_move = self.may_move or not self.transport.realtime
        self._sequence = 0
        self._number = 0
        self._probed = 0.0

    @property
    def board(self) -> BoardPins:
        """What lies below the fixture's pins. Raises Cannot where the board is behind a port."""
        return self.uno.bench("pins").pins

    @property
    def transport(self) -> Transport:
        """The raw line; its clock is the board's."""
        return self.uno.serial.line.transport

    # ---- line --------------------------------------------------------------------------------------------------------

    def send(self, message: Any) -> int:
        """Sends one message; returns its sequence number."""
        sequence = self._sequence
        self.transport.write(self.encode(message))
        return sequence

    def encode(self, message: Any) -> bytes:
        """The message's frame, with the next sequence number and the session's seed.

        Raises:
            Cannot: it would move a real robot that has to stand still, let it drive by itself, or change the parameters
                that it keeps.
        """
        drives = isinstance(message, messages.SetParameter) and message.parameter in FALLBACK
        if self.transport.realtime and (drives or isinstance(message, KEPT)):
            raise Cannot("it changes what a real robot does by itself or keeps; expected an emulated board")
        if not self._may_move and isinstance(message, MOVING):
            raise Cannot("it may move the robot; expected --motors, with the robot on blocks")
        wire = frame.encode(message.ID, self._sequence, message.pack(), self.seed)
        self._sequence = (self._sequence + 1) & 0xFF
        return wire

    def listen(self, seconds: float) -> list[messages.Telemetry]:
        """Lets time pass; returns the telemetry that came meanwhile."""
        before = len(self.telemetry)
        end = self.transport.now() + seconds
        while (left := end - self.transport.now()) > 1e-9:
            if self.alive and self.seed and self.transport.now() >= self._probed + PROBE_S:
                self._probed = self.transport.now()
                self.send(messages.ClockProbe(0))
            self.uno.run(min(left, PROBE_S) if self.alive else left)
            self._take()
        return self.telemetry[before:]

    def _take(self) -> None:
        heard = self.uno.serial.heard
        data, self._taken = bytes(heard[self._taken :]), len(heard)
        for message_id, _, payload in self.decoder.feed(data):
            message = messages.MESSAGES[message_id].unpack(payload)
            self.heard.append(message)
            if isinstance(message, messages.Telemetry):
                self.telemetry.append(message)
            elif isinstance(message, messages.Event):
                self.events.append(message)
                if self.acknowledges:
                    self.send(messages.Acknowledge(message.number))
            else:
                if isinstance(message, messages.Hello):
                    self.hello = message
                self.answers.append(message)

    def ask(self, question: Any, answer: type[_M], within_s: float = 0.1) -> _M:
        """Asks a question of the handshake, or sends a stop, and returns the answer."""
        self.answers.clear()
        self.send(question)
        return self.next(answer, within_s)

    def next(self, kind: type[_M], within_s: float = 0.1) -> _M:
        """The next message of that kind, or one that has come since the last question."""
        return self.wait_for(
            lambda: next((a for a in reversed(self.answers) if isinstance(a, kind)), None), within_s, kind.__name__
        )

    def next_hello(self, within_s: float = 1.0) -> messages.Hello:
        """The board's next hello."""
        self.answers.clear()
        return self.next(messages.Hello, within_s)

    def first(
        self, kind: type[_M], such: Callable[[_M], bool], within_s: float, what: str, since: int | None = None
    ) -> _M:
        """The first message of that kind that is such a one, from now on or behind the first `since` of `heard`."""
        begin = len(self.heard) if since is None else since
        return self.wait_for(
            lambda: next((m for m in self.heard[begin:] if isinstance(m, kind) and such(m)), None),
            within_s,
            what,
        )

    def request(self, kind: Any, *fields: int, within_s: float = 0.1) -> messages.Answer:
        """Sends the next numbered request, again if it or its answer is lost, and returns the answer. Each repetition
        comes at another phase of the tick: what the board misses in one phase of each tick it hears in another."""
        self.answers.clear()
        request, begin = self.numbered(kind, *fields), len(self.heard)
        for _ in range(4):
            self.send(request)
            with contextlib.suppress(AssertionError):
                return self.first(messages.Answer, lambda answer: answer.number == request.number, within_s, "", begin)
            self.listen(0.37 * TICK_S)
        raise AssertionError(f"waited in vain for the answer to {kind.__name__}")

    def numbered(self, kind: Any, *fields: int) -> Any:
        """The next request of the session."""
        self._number = (self._number + 1) & 0xFFFF
        return kind(self._number, *fields)

    def wait_for(self, condition: Callable[[], _M | None], within_s: float, what: str) -> _M:
        """Listens until `condition()` is true; fails after `within_s` of the board's time."""
        end = self.transport.now() + within_s
        while not (value := condition()):
            assert self.transport.now() < end, f"waited {within_s} s in vain for {what}"
            self.listen(TICK_S / 10)
        return value

    def latest(self) -> messages.Telemetry:
        """The telemetry of a tick that begins from now on."""
        count = len(self.telemetry)
        self.wait_for(lambda: len(self.telemetry) > count + 1, 5 * TICK_S, "telemetry")
        return self.telemetry[-1]

    def devices(self, after_s: float = 0.0) -> messages.DevicesTelemetry:
        """The next message of the slow devices after that time."""
        self.listen(after_s)
        self.answers.clear()
        return self.next(messages.DevicesTelemetry, 0.2)

    def set(self, parameter: str, value: int) -> None:
        """Sets a parameter, in counts."""
        answer = self.request(messages.SetParameter, messages.PARAMETERS[parameter].id, value)
        assert answer.status == messages.AnswerStatus.OK, messages.AnswerStatus(answer.status)

    @property
    def tick(self) -> int:
        """The tick of the newest telemetry, as a set-point names it."""
        return self.telemetry[-1].tick & 0xFFFF if self.telemetry else 0

    def signal(self, left: float, right: float, time_to_live_ms: int = 250) -> messages.SetpointSignal:
        """Motor signals in [-1, 1], in answer to the newest telemetry."""
        return messages.SetpointSignal(round(left * 1e4), round(right * 1e4), time_to_live_ms, self.tick)

    def drive(self, left: float, right: float, time_to_live_ms: int = 250) -> int:
        """Sends motor signals in [-1, 1]; returns the sequence number."""
        return self.send(self.signal(left, right, time_to_live_ms))

    def drive_for(self, left: float, right: float, seconds: float) -> None:
        """Sends motor signals every 50 ms for that long."""
        end = self.transport.now() + seconds
        while self.transport.now() < end - 1e-9:
            self.drive(left, right)
            self.listen(min(0.05, end - self.transport.now()))

    def flood(self, setpoint: messages.SetpointSignal, seconds: float) -> None:
        """Saturates the line both ways for that long: set-points and a request, again and again without a gap, 50,000
        bytes/s, so that answers and telemetry fill the other direction too. Each set-point answers the newest tick."""
        wire = bytearray()
        request = self.numbered(messages.GetParameter, 0)
        for _ in range(round(seconds / TICK_S)):
            while len(wire) < LINE_BYTES_PER_TICK:
                wire += self.encode(setpoint._replace(answers_tick=self.tick))
                wire += b"".join(self.encode(request) for _ in range(3))
            self.transport.write(bytes(wire[:LINE_BYTES_PER_TICK]))
            del wire[:LINE_BYTES_PER_TICK]
            self.listen(TICK_S)
        self.transport.write(bytes(wire))

    def start(self, arm: bool = True) -> messages.Hello:
        """Waits for the board to be up, opens a session and arms the motors, where they may move."""
        self.alive = True
        hello = self.open_session()
        if arm and self._may_move:
            self.arm()
        return hello

    def open_session(self) -> messages.Hello:
        """Opens a session; another's has to end first. A lost frame is sent again, at another phase of the tick."""
        self.answers.clear()
        self.seed = 0
        self.decoder.seed = frame.NO_SESSION
        hello = self.first(messages.Hello, lambda hello: hello.session == 0, 4.0, "a hello without a session")
        seed = hello.board_nonce ^ HOST_NONCE
        for attempt in range(5):
            self.send(messages.Open(messages.PROTOCOL_VERSION, hello.board_nonce, HOST_NONCE))
            self.decoder.seed = self.seed = seed
            self.listen((2 + 4 * attempt) * TICK_S)  # a slow line takes longer
            if self.hello is not None and self.hello.session == seed:
                self._number = 0
                return self.hello
            self.listen(0.37 * TICK_S)
        raise AssertionError("the board opens no session")

    def arm(self) -> None:
        """Ends the latches in the newest telemetry, and waits until a set-point would count."""
        answer = self.request(messages.Arm, self.latest().latches)
        assert answer.status == messages.AnswerStatus.OK, messages.AnswerStatus(answer.status)
        self.latest()

    def stop(self) -> None:
        """Stops the motors until they are armed again."""
        self.ask(messages.Stop(7), messages.Stopped)
