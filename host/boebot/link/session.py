"""The link to one board: handshake, requests, set-points out, telemetry in.

The host first listens, then asks until the board says hello; a board of another protocol version or schema is
refused. Telemetry stays packed until somebody looks at it. Everything that crossed the wire is kept with its
stamp when `record` is true.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import messages
from boebot.link.frame import Decoder, encode
from boebot.link.transport import Transport

_M = TypeVar("_M")
_LISTEN_S = 0.05  # how long the host listens before it asks
_ASK_AGAIN_S = 0.2
_REPEAT_S = 0.1  # a request that stays unanswered is sent again after this
_REPEATS = 5
_SHORTEST_S = 1e-4  # a wait that rounds to nothing would never end on a clock that only waits advance
_TELEMETRY = messages.Telemetry.ID
_SIGNAL = messages.SetpointSignal
_SPEED = messages.SetpointSpeed

# An Uno resets when its port is opened and is back after about 1.5 s; an emulated board answers at once.
HANDSHAKE_LIVE_S = 4.0
HANDSHAKE_S = 1.0


def text(field: bytes) -> str:
    """A text field of a message without its padding."""
    return field.split(b"\0", 1)[0].decode("utf-8", errors="replace")


class Link:
    """One board's end of the protocol on the host.

    Attributes:
        transport: where the bytes go.
        decoder: counts good, bad and lost frames.
        hello: what the board said of itself, after `handshake`.
        sent, received: (time in s on the transport's clock, bytes), oldest first, if recorded.
    """

    def __init__(self, transport: Transport, record: bool = True) -> None:
        self.transport = transport
        self.decoder = Decoder()
        self.hello: messages.Hello | None = None
        self.sent: list[tuple[float, bytes]] = []
        self.received: list[tuple[float, bytes]] = []
        self._record = record
        self._sequence = 0
        self._telemetry: list[bytes] = []  # arrived while somebody waited for an answer
        self._answers: list[messages.Message] = []

    # ---- telemetry and set-points --------------------------------------------------------------------------

    def poll(self, wait_s: float, quiet_s: float = 0.0) -> list[bytes]:
        """The telemetry payloads that arrived, oldest first; waits as `Transport.read` does."""
        self._receive(wait_s, quiet_s)
        telemetry = self._telemetry
        self._telemetry = []
        return telemetry

    def forget_telemetry(self) -> None:
        """Drops the telemetry that arrived while somebody waited for an answer."""
        self._telemetry = []

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

    def send_stop(self) -> None:
        """Stops the motors at once, until the next set-point."""
        self._send(messages.Stop.ID, b"")

    # ---- handshake and requests ----------------------------------------------------------------------------

    def handshake(self, timeout_s: float | None = None) -> messages.Hello:
        """Waits for the board's hello, asking for it, and checks that both speak the same protocol.

        Args:
            timeout_s: by the transport's clock; None: long enough for an Uno's start.

        Raises:
            BoardError: nobody answers, or the board has gone.
            ProtocolError: something else speaks, or another version of this protocol.
        """
        if timeout_s is None:
            timeout_s = HANDSHAKE_LIVE_S if self.transport.realtime else HANDSHAKE_S
        now = self.transport.now
        start = now()
        ask_at = start + _LISTEN_S
        heard = 0
        while (time := now()) < start + timeout_s:
            if time >= ask_at:
                self._ask_hello()
                ask_at = time + _ASK_AGAIN_S
            heard += self._receive(max(min(ask_at, start + timeout_s) - time, _SHORTEST_S), 0.0)
            for answer in self._take_answers():
                if isinstance(answer, messages.Hello):
                    self._check(answer)
                    self.hello = answer
                    self._fresh_start()
                    return answer
        raise self._no_hello(heard, timeout_s)

    def identity(self) -> messages.Identity:
        """Which image runs on the board."""
        return self.request(messages.Identify(), messages.Identity, lambda _: True, "say which image it runs")

    def get_parameter(self, name: str) -> float:
        """The value of a parameter, in its unit."""
        spec = parameter_spec(name)
        return self._parameter(messages.GetParameter(spec.id), name) * spec.scale

    def set_parameter(self, name: str, value: float) -> float:
        """Sets a parameter until the board's next reset; returns the value now in force, in its unit."""
        spec = parameter_spec(name)
        counts = round(value / spec.scale)
        if not spec.minimum <= counts <= spec.maximum:
            raise BoebotError(
                f"parameter {name} cannot be {value:g} {spec.unit}; "
                f"expected {spec.minimum * spec.scale:g} to {spec.maximum * spec.scale:g}"
            )
        return self._parameter(messages.SetParameter(spec.id, counts), name) * spec.scale

    def request(self, question: messages.Message, kind: type[_M], accept: Callable[[_M], bool], what: str) -> _M:
        """Sends `question`, again and again while it stays unanswered; returns the answer of type `kind` that
        `accept`s.

        Raises:
            BoardError: no answer after five tries; `what` says what was asked of the board.
        """
        payload = question.pack()
        for _ in range(_REPEATS):
            self._send(question.ID, payload)
            until = self.transport.now() + _REPEAT_S
            while (left := until - self.transport.now()) > 0:
                self._receive(max(left, _SHORTEST_S), 0.0)
                for answer in self._take_answers():
                    if isinstance(answer, kind) and accept(answer):
                        return answer
        raise BoardError(f"the board at {self.transport.name} did not {what}, though asked {_REPEATS} times")

    # ---- inside --------------------------------------------------------------------------------------------

    def _parameter(self, question: messages.GetParameter | messages.SetParameter, name: str) -> int:
        answer = self.request(
            question,
            messages.Parameter,
            lambda parameter: parameter.parameter == question.parameter,
            f"answer for parameter {name}",
        )
        if answer.status != messages.ParameterStatus.OK:
            raise BoardError(f"the board at {self.transport.name} refuses parameter {name}: {_reason(answer.status)}")
        return answer.value

    def _send(self, message_id: int, payload: bytes) -> None:
        frame = encode(message_id, self._sequence, payload, self.decoder.seed)
        self._sequence = (self._sequence + 1) & 0xFF
        self.transport.write(frame)
        if self._record:
            self.sent.append((self.transport.now(), frame))

    def _receive(self, wait_s: float, quiet_s: float) -> int:
        """Reads and sorts what arrived; returns how many bytes."""
        data = self.transport.read(wait_s, quiet_s)
        if not data:
            return 0
        if self._record:
            self.received.append((self.transport.now(), data))
        for message_id, _, payload in self.decoder.feed(data):
            if message_id == _TELEMETRY:
                self._telemetry.append(payload)
            else:
                self._answers.append(messages.MESSAGES[message_id].unpack(payload))
        return len(data)

    def _take_answers(self) -> list[messages.Message]:
        answers = self._answers
        self._answers = []
        return answers

    def _ask_hello(self) -> None:
        self._send(messages.HelloRequest.ID, messages.HelloRequest(messages.PROTOCOL_VERSION).pack())

    def _fresh_start(self) -> None:
        """Forgets what was heard before the hello: it belongs to an earlier session."""
        self._telemetry = []
        self.decoder.bad = self.decoder.lost = 0

    def _check(self, hello: messages.Hello) -> None:
        where = self.transport.name
        if hello.protocol_version != messages.PROTOCOL_VERSION:
            raise ProtocolError(
                f"the board at {where} speaks protocol version {hello.protocol_version}, this kit speaks version "
                f"{messages.PROTOCOL_VERSION}; flash the firmware that came with this kit"
            )
        if hello.schema_hash != messages.SCHEMA_HASH:
            raise ProtocolError(
                f"the board at {where} was built with message schema {hello.schema_hash:08x}, this kit with "
                f"{messages.SCHEMA_HASH:08x}; flash the firmware that came with this kit"
            )
        if hello.tick_rate == 0:
            raise ProtocolError(f"the board at {where} says that it makes 0 control ticks in a second; expected more")

    def _no_hello(self, heard: int, timeout_s: float) -> BoebotError:
        where = self.transport.name
        if self.decoder.good:
            return ProtocolError(f"the board at {where} sends frames but does not say hello within {timeout_s:g} s")
        if heard:
            return ProtocolError(
                f"what answers at {where} does not speak this kit's protocol ({heard} bytes, no valid frame): "
                "other firmware, or another baud rate"
            )
        return BoardError(f"nothing answers at {where} within {timeout_s:g} s: is the robot on and flashed?")


def _reason(status: int) -> str:
    """Why a board refuses a parameter; a status that this kit does not know is told by its number."""
    try:
        return messages.ParameterStatus(status).name.lower().replace("_", " ")
    except ValueError:
        return f"status {status}"


def parameter_spec(name: str) -> messages.ParameterSpec:
    """The parameter of that name.

    Raises:
        BoebotError: there is none.
    """
    spec = messages.PARAMETERS.get(name)
    if spec is None:
        raise BoebotError(f"there is no parameter {name!r}; expected one of {', '.join(messages.PARAMETERS)}")
    return spec
