"""Frames out and in, each with its stamp, of one session."""

from __future__ import annotations

from wire import Wire

from boebot.link import messages
from boebot.link.frame import NO_SESSION, Decoder, encode
from boebot.link.line import Line


def test_line_sends_and_accepts_frames_of_its_session_only() -> None:
    wire, kept = Wire(time=3.0), []
    line = Line(wire, lambda *row: kept.append(row))
    line.use_session(0x12345)
    line.send(messages.Stop(7))
    board = Decoder(0x12345, to_board=True)
    assert board.feed(wire.written) == [(messages.Stop.ID, 0, b"\7")]
    stopped = [encode(messages.Stopped.ID, number, b"\7", seed) for number, seed in enumerate((0x12345, 0x54321))]
    listened: list[bytes] = []
    line.listener = listened.append
    wire.coming = [(1.0, b"\0" + stopped[0]), (2.0, stopped[1])]
    found = [(stamp, line.decoder.feed(data)) for stamp, data in line.read(0.1)]
    assert found == [(1.0, [(messages.Stopped.ID, 0, b"\7")]), (2.0, [])]
    assert (line.decoder.good, line.decoder.bad) == (1, 1)
    assert listened == [b"\0" + stopped[0], stopped[1]]
    assert kept == [("to_board", 3.0, wire.written), ("to_host", 1.0, listened[0]), ("to_host", 2.0, listened[1])]
    line.use_session(0)
    assert line.decoder.seed == NO_SESSION
