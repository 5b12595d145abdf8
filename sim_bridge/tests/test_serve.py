"""An emulated robot on a pty and on a TCP port, as other programs meet it."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
import serial

from boebot.boards import BoardRequest, BoardSession, TruthNow, Visit, open_port
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import frame, messages
from boebot.link.transport import Transport
from sim_bridge.serve import Look, serve
from sim_bridge.tests.boards.avr.avr_program import assemble

pytestmark = pytest.mark.wall_clock

PORTS = [0] + ([None] if os.name == "posix" else [])


def request() -> BoardRequest:
    return BoardRequest(robot=load_robot("shieldbot"), arena="empty", record=False)


@contextmanager
def served(tcp: int | None, visit: Callable[[Visit], None] = lambda _: None, look: Look | None = None) -> Iterator[str]:
    """The URL of a served native board; `visit` hears who comes and goes, `look` where the robot is."""
    urls: list[str] = []
    announced, stop = threading.Event(), threading.Event()

    def announce(url: str) -> None:
        urls.append(url)
        announced.set()

    def work() -> None:
        serve(
            "native",
            request(),
            tcp=tcp,
            announce=announce,
            visit=visit,
            running=lambda: not stop.is_set(),
            look=look,
        )

    thread = threading.Thread(target=work)
    thread.start()
    try:
        assert announced.wait(5)
        yield urls[0]
    finally:
        stop.set()
        thread.join(5)
        assert not thread.is_alive()


def listen(transport: Transport, seconds: float) -> list[tuple[int, int, bytes]]:
    """The messages that come in that time."""
    decoder, heard = frame.Decoder(), []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        heard += decoder.feed(transport.read(0.01))
    return heard


@pytest.mark.parametrize("tcp", PORTS)
def test_client_meets_a_robot_that_just_started(tcp: int | None) -> None:
    nonces: set[int] = set()
    with served(tcp) as url:
        for _ in range(2):  # a second client finds it as the first one did
            time.sleep(0.1)
            client = open_port(url, 500_000)
            hellos = [messages.Hello.unpack(payload) for kind, _, payload in listen(client, 1.0)]
            assert 7 <= len(hellos) <= 12  # real time: one after the start, then ten a second
            assert {(hello.reset_cause, hello.session) for hello in hellos} == {(messages.ResetCause.EXTERNAL, 0)}
            nonces |= {hello.board_nonce for hello in hellos}
            client.write(frame.encode(messages.Identify.ID, 0, b""))
            assert any(kind == messages.Identity.ID for kind, _, _ in listen(client, 0.2))
            client.close()
    assert len(nonces) == 2


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals")
def test_the_client_sets_the_bit_rate_of_a_pty() -> None:
    with served(None) as url:
        for baud in (115_200, 460_800, 250_000):  # the last one has no name among a terminal's rates
            client = open_port(url, baud)
            time.sleep(0.05)
            assert listen(client, 0.3) == []
            client.write(frame.encode(messages.Identify.ID, 0, b""))
            assert listen(client, 0.2) == []
            client.close()
            time.sleep(0.05)
        client = open_port(url, 500_000)
        heard = listen(client, 0.5)
        assert {kind for kind, _, _ in heard} == {messages.Hello.ID}
        assert len(heard) >= 3
        client.close()


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals")
def test_the_bit_rate_may_change_while_the_port_is_open() -> None:
    with served(None) as url, serial.Serial(url, 500_000, timeout=0.05) as port:

        def hear() -> int:
            """Messages in 0.5 s, the first one perhaps cut."""
            port.reset_input_buffer()
            decoder, end, count = frame.Decoder(), time.perf_counter() + 0.5, 0
            while time.perf_counter() < end:
                count += len(decoder.feed(port.read(64)))
            return count

        assert hear() >= 3
        port.baudrate = 115_200
        time.sleep(0.05)
        assert hear() == 0
        port.baudrate = 500_000
        time.sleep(0.05)
        assert hear() >= 3


def test_client_that_does_not_read_stops_nobody() -> None:
    with served(0) as url:
        host, port = url.removeprefix("socket://").split(":")
        with socket.create_connection((host, int(port))) as silent:
            silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
            time.sleep(0.3)
        client = open_port(url, 500_000)
        assert listen(client, 0.3)
        client.close()


def test_what_cannot_be_served_is_told() -> None:
    with served(0) as url:
        taken = int(url.rpartition(":")[2])
        with pytest.raises(BoardError, match=f"^TCP port {taken} cannot be opened: it is in use; expected a free one"):
            serve("native", request(), tcp=taken, announce=print, visit=print, running=lambda: False)
    with pytest.raises(BoardError, match="no emulated board 'toaster'"):
        serve("toaster", request(), tcp=0, announce=print, visit=print, running=lambda: False)


def serve_program(folder: Path, then: str, visits: list[Visit], running: Callable[[], bool]) -> None:
    """Serves a board whose program asks for the comparator, which is not built, and goes on with `then`."""
    image = folder / "program.elf"
    image.write_bytes(assemble(f"main: ldi r24, 0x43\n out ACSR, r24\n{then}"))
    asked = replace(request(), image=str(image))
    serve("avr", asked, tcp=0, announce=lambda _: None, visit=visits.append, running=running)


def test_what_the_board_notes_is_heard_while_it_is_served(tmp_path: Path) -> None:
    visits: list[Visit] = []
    until = time.perf_counter() + 5
    serve_program(tmp_path, "1: rjmp 1b", visits, lambda: not visits and time.perf_counter() < until)
    (note,) = visits
    assert (note.what, note.client) == ("notes", "the board")
    assert note.why.startswith("the program writes to ACSR at address 0x")


def test_a_program_that_crashes_stands_still_until_the_next_reset(tmp_path: Path) -> None:
    """What it notes just before is heard, too."""
    visits: list[Visit] = []
    until = time.perf_counter() + 5
    serve_program(tmp_path, "jmp 0x7000", visits, lambda: len(visits) < 2 and time.perf_counter() < until)
    assert [visit.what for visit in visits] == ["notes", "notes"]
    assert "goes to 0x7000" in visits[1].why and visits[1].why.endswith(" It stands still until it is reset.")


def test_somebody_looks_where_the_robot_is() -> None:
    """With a client or without, twenty times a second and in order of time."""
    seen: list[tuple[TruthNow, float]] = []
    said = bytearray()

    def look(session: BoardSession, data: bytes) -> None:
        truth = session.truth_now()
        assert truth is not None
        seen.append((truth, session.counters()["time_s"]))
        said.extend(data)

    with served(0, look=look) as url:
        time.sleep(0.5)
        client = open_port(url, 500_000)
        heard = client.read(0.5)
        client.close()
        time.sleep(0.5)
    assert heard in bytes(said)
    times = [time_s for _, time_s in seen]
    assert times == sorted(times)
    assert 0.8 * 20 <= (len(times) - 1) / (times[-1] - times[0]) <= 20.5
    assert all(truth.pose == seen[0][0].pose and truth.contacts == 0 for truth, _ in seen)
