"""Spoilt streams (channel.h) into the image in the emulated board, at 500,000 bit/s after a real handshake.

What is sent are clock probes: the board answers each one that it accepts, with the probe's token, so the answers say
which frames it accepted. It counts the accepted ones as well (the message `counters`): one that was accepted but not
answered would show there. The library's decoder for the board's end, which is the same C, gets all that the board gets,
and must count the same good and bad frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Self

from boebot.link import messages
from boebot.link.frame import NO_SESSION, SEED, Decoder, encode
from sim_bridge.boards import avr
from sim_bridge.tests.boards.access import BoardAccess
from tools.tests.error_rates.library import ROOT, ffi, library, new
from tools.tests.error_rates.streams import FAULTS, Tally, seed_of

CYCLES_PER_MS = 16_000
BATCH = 2000  # rounds between two looks at the counters
KEEP_ALIVE = 30  # steps of 10 ms after which the host says something
# A probe is answered by 14 bytes, and telemetry takes a tenth of the line: probes must not come faster than answers go.
BYTE_CYCLES = 320
ROUND_BYTES = 70  # time of a round at least
FREE = 8  # bytes, after which the line is free for one: a tick with bursts reads more slowly than a full line fills
STEP = 50  # rounds between two looks at what the board sends


class Image:
    """A board that runs the image, in a session."""

    def __init__(self, pin_map: str = "shieldbot") -> None:
        self._board = avr.create(ROOT / "build" / "images" / f"{pin_map}.elf")
        self._access = BoardAccess(self._board, logs=False)
        self._receiver, self._twin = Decoder(), Decoder(NO_SESSION, to_board=True)
        for decoder in (self._receiver, self._twin):
            decoder.feed(b"\0")
        self._tokens: list[int] = []
        self._kept_alive = 0
        self._sequence = 0
        self.seed = self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._access.close()
        self._board.close()

    # ---- session ----

    def _send(self, message: messages.Message, seed: int) -> None:
        self._sequence = (self._sequence + 1) & 0xFF
        self._give(encode(message.ID, self._sequence, message.pack(), seed), self._access.now)

    def _give(self, data: bytes, at: int) -> None:
        """The same bytes to the board, from cycle `at` on, and to its twin."""
        self._access.send(data, at=at)
        self._twin.feed(data)

    def _expected(self) -> tuple[int, int]:
        """Good and bad frames by the twin, without those that keep the session open."""
        return self._twin.good - self._kept_alive, self._twin.bad

    def _messages(self) -> Iterator[messages.Message]:
        """What the board has sent since the last call."""
        for number, _, payload in self._receiver.feed(bytes(sent.byte for sent in self._access.receive())):
            yield messages.MESSAGES[number].unpack(payload)

    def _hello(self) -> messages.Hello:
        for _ in range(100):
            self._access.run(10 * CYCLES_PER_MS)
            for message in self._messages():
                if isinstance(message, messages.Hello):
                    return message
        raise AssertionError("the board has said no hello for a second")

    def _open(self) -> int:
        nonce = self._hello().board_nonce
        seed = 0x0F1E2D ^ nonce & 1
        self._send(messages.Open(messages.PROTOCOL_VERSION, nonce, nonce ^ seed), SEED)
        for _ in range(10):
            if self._hello().session == seed:
                self._receiver.seed = self._twin.seed = seed
                return seed
        raise AssertionError("the board has opened no session")

    # ---- streams ----

    def _advance(self, until: int) -> messages.Counters | None:
        """Runs the board, keeps the tokens of the probes that it answers, and returns its counters if it sent them."""
        self._access.advance(until)
        fresh = None
        for message in self._messages():
            if isinstance(message, messages.ClockAnswer):
                self._tokens.append(message.token)
            elif isinstance(message, messages.Counters):
                fresh = message
            elif isinstance(message, messages.Hello) and message.session != self.seed:
                raise AssertionError("the board has ended the session")
        return fresh

    def _settle(self) -> tuple[int, int, int]:
        """Waits for counters that were sent on an idle line; returns good and bad frames, and overruns. The frames that
        keep the session open meanwhile are not counted.
        """
        for step in range(400):
            keeps_alive = step % KEEP_ALIVE == 1
            if keeps_alive:
                self._send(messages.Acknowledge(0), self.seed)
                self._kept_alive += 1
            fresh = self._advance(self._access.now + 10 * CYCLES_PER_MS)
            if fresh is not None and not keeps_alive and step > 0:
                return fresh.good - self._kept_alive, fresh.bad, fresh.overrun
        raise AssertionError("the board has sent no counters for four seconds")

    def run(self, fault: int, rounds: int, part: int = 0) -> Tally:
        """Rounds with that fault (streams.FAULTS)."""
        tally = Tally("AVR image", FAULTS[fault])
        lib, line = library("board"), new("channel *")
        lib.channel_start(line, seed_of(tally.receiver, fault, part))
        lib.channel_only(line, messages.ClockProbe.ID)
        lib.channel_session(line, self.seed)
        before = self._settle()
        left = rounds
        while left > 0:
            before = self._batch(line, fault, min(left, BATCH), before, tally)
            left -= BATCH
        return tally

    def _batch(
        self, line: Any, fault: int, rounds: int, before: tuple[int, int, int], tally: Tally
    ) -> tuple[int, int, int]:
        """Some rounds, judged; returns the counts after them."""
        lib = library("board")
        sent = [new("channel_round *") for _ in range(rounds)]
        expected_before = self._expected()
        self._tokens = []
        at = self._access.now
        for number, spoilt in enumerate(sent):
            lib.channel_send(line, fault, spoilt)
            data = ffi().buffer(spoilt.wire, spoilt.size)[:]
            self._give(data, at)
            at += max(spoilt.size + spoilt.size // FREE, ROUND_BYTES) * BYTE_CYCLES
            if number % STEP == STEP - 1:
                self._advance(at)
        self._advance(at)
        after = self._settle()
        good, bad, overrun = ((new - old) & 0xFFFF for new, old in zip(after, before, strict=True))
        expected = tuple((new - old) & 0xFFFF for new, old in zip(self._expected(), expected_before, strict=True))
        if overrun:
            raise AssertionError("the board has lost received bytes: the line was too busy")
        if (good, bad) != expected:
            raise AssertionError(f"the image counts {(good, bad)} good and bad frames, the same C here {expected}")
        self._judge(sent, self._tokens)
        sent[-1].wrong += max(0, good - len(self._tokens))  # accepted, but nothing that a probe brings about
        counts = new("channel_tally *")
        for spoilt in sent:
            lib.channel_count(spoilt, counts)
        tally.add(counts)
        return after

    def _judge(self, sent: list[Any], tokens: list[int]) -> None:
        """Finds the frame behind each answer, in order."""
        lib = library("board")
        frames = [(spoilt, frame) for spoilt in sent for frame in spoilt.sent]
        payloads = [int.from_bytes(bytes(frame.payload[0:2]), "little") for _, frame in frames]
        place = 0
        for token in tokens:
            try:
                place = payloads.index(token, place, place + 40) + 1
            except ValueError:
                sent[0].wrong += 1
                continue
            spoilt, frame = frames[place - 1]
            lib.channel_accept(spoilt, frame.id, frame.sequence, frame.payload, frame.length)
