"""Finding the board at a port: its baud rate, and what answers there if it is none of ours."""

from __future__ import annotations

from collections.abc import Callable

from boebot.errors import BoardError, BoebotError, ProtocolError
from boebot.link import messages
from boebot.link.frame import SEED, checksum
from boebot.link.transport import BaudSelectable, Transport

RATES = (500_000, 115_200, 250_000, 1_000_000, 57_600, 38_400, 19_200, 9_600)
_LISTEN_S = 0.15  # at each rate; a board without a session says hello every 0.1 s
_LOOK_S = 0.02
_SAMPLE = 2048  # bytes kept
_CHECK_BYTES = 3
_SHORTEST = 3 + _CHECK_BYTES  # code byte, id, sequence number
_TEXT_LEAST = 8  # characters that make a text
_TEXT_SHARE = 0.9
_QUOTED = 40
_LONGEST_SENTENCE = 200  # characters of a refusal
_SPOILT_SHARE = 0.2  # of the frames damaged: then that is why there is no session


class BoardSearch:
    """Listens to a port until there is a session: at which rate next, so that each has its turn before the time is
    over, and what answers there if it is no board of ours.

    Attributes:
        end_s: when the search is over (the transport's clock).
        asked: the rate that the port was opened with; None: it has none.
        baud: the rate in use.
    """

    def __init__(self, transport: Transport, limit_s: float) -> None:
        now = transport.now()
        self.end_s = now + limit_s
        self.asked = self.baud = transport.baud if isinstance(transport, BaudSelectable) else None
        self._where = transport.name
        self._limit_s = limit_s
        self._count = 0  # bytes, at all rates together
        self._sample = bytearray()  # at the present rate
        self._samples: list[tuple[int | None, bytes]] = []  # at earlier rates
        others = [rate for rate in RATES if rate != self.asked]
        self._order = others if self.asked is not None else []
        self._next = 0
        # silence is waited for at the rate that was asked for, as long as the others leave time
        self._change_s = max(self.end_s - len(others) * _LISTEN_S - _LOOK_S, now + _LISTEN_S)
        self._first_byte_s: float | None = None  # when the first came at this rate

    @property
    def changed(self) -> bool:
        """Whether the board was found at another rate than asked for."""
        return self.baud != self.asked

    def listen(self, data: bytes) -> None:
        """Takes bytes as they come."""
        self._count += len(data)
        self._sample += data[: _SAMPLE - len(self._sample)]

    def next_baud(self, now_s: float) -> int | None:
        """The rate to change to, or None: stay."""
        if not self._order or any(map(_looks_like_frame, _pieces(self._sample))):
            return None
        if self._first_byte_s is None and self._sample:
            self._first_byte_s = now_s  # perhaps the beginning of a hello
        garbage = self._first_byte_s is not None and now_s - self._first_byte_s >= _LISTEN_S
        if now_s < self._change_s and not garbage:
            return None
        self._put_sample_aside()
        self.baud = self._order[self._next % len(self._order)]
        self._next += 1
        if self._next == len(self._order):
            self._order = [*self._order, self.asked] if self.asked is not None else self._order
        self._first_byte_s = None
        self._change_s = now_s + _LISTEN_S
        return self.baud

    def failure(self, hello: messages.Hello | None, whole: int, damaged: int) -> BoebotError:
        """Why there is no session: one sentence.

        Args:
            hello: the board's last.
            whole, damaged: frames that came so at the last rate.
        """
        where, limit_s = self._where, self._limit_s
        self._put_sample_aside()
        if hello is not None and by_watchdog(hello.reset_cause):
            return BoardError(
                f"the board at {where} says hello, but there is no session within {limit_s:g} s; its last reset was by "
                f"{hang_in_words(hello.reset_cause)}"
            )
        if hello is not None and damaged > _SPOILT_SHARE * (whole + damaged):
            return _spoilt(where, limit_s, damaged, whole + damaged)
        if hello is not None:
            return BoardError(f"the board at {where} says hello, but does not hear us: no session within {limit_s:g} s")
        if not self._count:
            return BoardError(f"nothing answers at {where} within {limit_s:g} s: is the robot on and flashed?")
        for rate, sample in self._samples:
            pieces = _pieces(sample)
            spoilt = sum(_is_damaged_frame(piece) for piece in pieces)
            if spoilt > _SPOILT_SHARE * len(pieces):
                return _spoilt(where, limit_s, spoilt, len(pieces))
            if any(_is_frame(piece) for piece in pieces):
                return ProtocolError(f"the board at {where} sends frames but does not say hello within {limit_s:g} s")
            if any(_has_checksum(piece) for piece in pieces):
                return ProtocolError(
                    f"the board at {where} speaks another version of this protocol{_at(rate)}, this kit speaks version "
                    f"{version_name()}; flash the firmware that came with this kit"
                )
        for rate, sample in self._samples:
            if said := _text(sample):
                return ProtocolError(
                    f"what answers at {where} does not speak this kit's protocol: other firmware, which says "
                    f"{said!r}{_at(rate)}"
                )
        tried = "at no usual baud rate" if self.baud is not None else "or another baud rate"
        return ProtocolError(
            f"what answers at {where} does not speak this kit's protocol ({self._count} bytes, no valid frame): "
            f"other firmware, {tried}"
        )

    def explained(self, error: BoardError, held: bytes) -> BoardError:
        """Why the search ended by that error: where the other side has closed with a sentence, as `boebot serve` does
        that has a client, by that sentence. `held`: what came before the search."""
        said = _text(held + self._sample, _LONGEST_SENTENCE)
        return BoardError(f"{self._where} was closed by the other side, which says {said!r}") if said else error

    def _put_sample_aside(self) -> None:
        if self._sample:
            self._samples.append((self.baud, bytes(self._sample)))
        self._sample.clear()


def _pieces(sample: bytes | bytearray) -> list[bytes]:
    """What stands between two delimiters."""
    return [piece for piece in bytes(sample).split(b"\0")[1:-1] if len(piece) >= _SHORTEST]


def _looks_like_frame(piece: bytes) -> bool:
    """Whether it is a frame, whole or damaged."""
    return _is_frame(piece) or _has_checksum(piece) or _is_damaged_frame(piece)


def _checks(piece: bytes) -> int:
    """How many of its three check bytes look like some, where id and length are those of a message to the host; else
    0. Such a frame is one block of COBS: the id stands behind its code byte."""
    kind = messages.MESSAGES.get(piece[1])
    if kind is None or kind.ID < 0x80 or len(piece) != kind.LENGTH + _SHORTEST:
        return 0
    return sum(byte >= 0x80 for byte in piece[-_CHECK_BYTES:])


def _is_frame(piece: bytes) -> bool:
    """Whether id, length and check bytes are a message's to the host, whatever the session's seed."""
    if _checks(piece) < _CHECK_BYTES:
        return False
    return messages.MESSAGES[piece[1]].DELIVERY != "handshake" or _has_checksum(piece)


def _is_damaged_frame(piece: bytes) -> bool:
    """The same but for one byte of the check: so it looks where a line spoils some bytes, and hardly ever where the
    rate is wrong."""
    return _checks(piece) >= _CHECK_BYTES - 1 and not _is_frame(piece)


def _spoilt(where: str, limit_s: float, damaged: int, frames: int) -> BoardError:
    return BoardError(
        f"the line to the board at {where} spoils what it carries: {damaged} of {frames} frames came damaged, and "
        f"there is no session within {limit_s:g} s; expected a sound cable, or a lower baud rate"
    )


def _has_checksum(piece: bytes) -> bool:
    """Whether it carries a checksum with the handshake's seed: a frame of some version."""
    if len(piece) > 255:
        return False
    return checksum(piece[:-_CHECK_BYTES], SEED) == int.from_bytes(piece[-_CHECK_BYTES:], "big")


def _text(sample: bytes | bytearray, longest: int = _QUOTED) -> str:
    """What people could read of it, cut to `longest` characters; empty if that is little."""
    readable = [byte for byte in sample if 32 <= byte < 127 or byte in b"\r\n\t"]
    if len(sample) < _TEXT_LEAST or len(readable) < _TEXT_SHARE * len(sample):
        return ""
    lines = bytes(readable).decode("ascii").split()
    return " ".join(lines)[:longest]


def _at(baud: int | None) -> str:
    return "" if baud is None else f" at {baud} baud"


_MINORS = 16  # versions before 3 had none, and a number below


def version_name(version: int = messages.PROTOCOL_VERSION) -> str:
    """As in "3.0", of what a hello or an open carries."""
    major, minor = divmod(version, _MINORS)
    return f"{major}.{minor}" if major else str(minor)


def minor_of(hello: messages.Hello) -> int:
    """The minor version of the board."""
    return hello.protocol_version % _MINORS


def speaks_alike(hello: messages.Hello) -> bool:
    """Whether board and kit understand each other."""
    return (
        hello.protocol_version // _MINORS == messages.PROTOCOL_VERSION // _MINORS
        and hello.schema_hash == messages.SCHEMA_HASH
        and hello.tick_rate > 0
    )


def refusal(hello: messages.Hello, where: str, describe: Callable[[int], messages.Description]) -> ProtocolError:
    """Why the board at `where` that said this cannot be spoken with. `describe` asks it for message i of its table."""
    if hello.protocol_version // _MINORS != messages.PROTOCOL_VERSION // _MINORS:
        return ProtocolError(
            f"the board at {where} speaks protocol version {version_name(hello.protocol_version)}, this kit speaks "
            f"version {version_name()}; flash the firmware that came with this kit"
        )
    if hello.tick_rate == 0:
        return ProtocolError(f"the board at {where} says that it makes 0 control ticks in a second; expected more")
    return ProtocolError(
        f"the board at {where} was built with message schema {hello.schema_hash:08x}, this kit with "
        f"{messages.SCHEMA_HASH:08x}: {_difference(describe)}; flash the firmware that came with this kit"
    )


def _difference(describe: Callable[[int], messages.Description]) -> str:
    """The first message that board and kit understand differently."""
    ours = sorted(messages.MESSAGES)
    theirs: set[int] = set()
    unknown = 0
    index = 0
    while True:
        try:
            said = describe(index)
        except BoebotError:
            return "which message differs it does not say"
        if said.id == 0 or index >= said.count:
            break
        kind = messages.MESSAGES.get(said.id)
        if kind is None:
            unknown = said.id
        elif said.length != kind.LENGTH:
            return f"message {kind.NAME} (0x{said.id:02x}) has {said.length} bytes there, {kind.LENGTH} here"
        elif said.hash != messages.HASHES[said.id]:
            return f"the fields of message {kind.NAME} (0x{said.id:02x}) differ"
        theirs.add(said.id)
        index += 1
    missing = next((number for number in ours if number not in theirs), None)
    if missing is not None:
        return f"it does not know message {messages.MESSAGES[missing].NAME} (0x{missing:02x})"
    if unknown:
        return f"its message 0x{unknown:02x} is not known here"
    return "the messages agree, but flags, values or parameters differ"


_IN_TASK = "WATCHDOG_IN_"


def by_watchdog(cause: int) -> bool:
    """Whether the watchdog reset the board: the firmware hung or fell behind for good."""
    return cause >= messages.ResetCause.WATCHDOG


def hang_in_words(cause: int) -> str:
    """Where the firmware hung, as the watchdog found it: an interrupt that hung counts as what it interrupted."""
    name = reset_in_words(cause).removeprefix("watchdog, ")
    also = "an interrupt meanwhile" if name.startswith("in task") else "the link, the main loop or an interrupt"
    return f"its watchdog, {name}: the firmware hung there, in {also}, or fell behind for good"


def reset_in_words(cause: int) -> str:
    """As in "watchdog, in task encoder"; a cause that this kit does not know has its number as its name."""
    name = messages.ResetCause(cause).name
    if name.startswith(_IN_TASK):
        return f"watchdog, in task {name.removeprefix(_IN_TASK).lower()}"
    if cause == messages.ResetCause.WATCHDOG:
        return "watchdog, outside of its tasks"
    return name.lower().replace("_", " ")
