"""Our own CAN bus as its clients meet it: stock ones of python-can, slow ones, and such that send rubbish."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterator

import can
import pytest

from boebot.errors import BoardError
from boebot_can.frames import CanFrame
from boebot_can.socketcand_server import MOST_CLIENTS, QUEUE_BYTES, SocketcandBus

pytestmark = [pytest.mark.wall_clock, pytest.mark.unsanitized]


@pytest.fixture
def bus() -> Iterator[SocketcandBus]:
    """It works whenever the test calls `receive`."""
    made = SocketcandBus(0, time.perf_counter)
    yield made
    made.close()


@contextlib.contextmanager
def working(bus: SocketcandBus) -> Iterator[list[CanFrame]]:
    """It works in a thread; what clients have sent."""
    taken: list[CanFrame] = []
    done = threading.Event()

    def work() -> None:
        while not done.is_set():
            taken.extend(bus.receive(0.005))

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield taken
    finally:
        done.set()
        thread.join()


def stock(bus: SocketcandBus) -> can.BusABC:
    return can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=bus.port)


def joined(bus: SocketcandBus) -> socket.socket:
    """A client by hand, in raw mode and past the pause behind it."""
    client = socket.create_connection(("127.0.0.1", bus.port))
    for command in (b"", b"< open can0 >", b"< rawmode >"):
        client.sendall(command)
        bus.receive(0.05)
        bus.receive(0.0)
        client.recv(100)
    time.sleep(0.11)
    return client


def told(client: socket.socket) -> bytes:
    client.settimeout(0.2)
    with contextlib.suppress(TimeoutError):
        return client.recv(100_000)
    return b""


def test_frames_reach_all_but_their_sender(bus: SocketcandBus) -> None:
    with working(bus) as taken, stock(bus) as first, stock(bus) as second:
        time.sleep(0.12)
        for size in range(9):
            first.send(can.Message(arbitration_id=0x7F0 + size, data=bytes(range(size)), is_extended_id=False))
        first.send(can.Message(arbitration_id=0x12345678, data=b"\xff", is_extended_id=True))
        received = [second.recv(1.0) for _ in range(10)]
        assert first.recv(0.05) is None
    assert all(message is not None for message in received)
    assert taken == [CanFrame(0x7F0 + size, bytes(range(size))) for size in range(9)]
    assert [(message.arbitration_id, bytes(message.data)) for message in received[:9] if message] == taken
    assert received[9] is not None and received[9].is_extended_id and received[9].arbitration_id == 0x12345678


def test_stock_clients_join_under_full_traffic(bus: SocketcandBus) -> None:
    """They read the answer to `rawmode` and whatever follows at once as one piece."""
    done = threading.Event()

    def flood() -> None:
        while not done.is_set():
            bus.send([CanFrame(0x321, bytes(8))] * 20, 1.5)
            bus.receive(0.001)

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        for _ in range(5):
            with stock(bus) as client:
                message = client.recv(1.0)
                assert message is not None and message.timestamp == 1.5 and bytes(message.data) == bytes(8)
    finally:
        done.set()
        thread.join()


@pytest.mark.parametrize(
    "rubbish",
    [
        b"< send 800 0 >",
        b"< send 1 9 1 2 3 4 5 6 7 8 9 >",
        b"< send 1 2 1 >",
        b"< send 1 1 100 >",
        b"< send -1 1 1 >",
        b"< send 20000000 0 >",
        b"< open can0 >",
        b"<>",
        b"> < >",
        bytes(range(128, 256)) + b"<" + bytes(32) + b">",
    ],
)
def test_rubbish_is_counted_and_passes_by(bus: SocketcandBus, rubbish: bytes) -> None:
    with contextlib.closing(joined(bus)) as client:
        client.sendall(rubbish + b"< send 7 2 a b >")
        assert bus.receive(0.5) == [CanFrame(7, b"\x0a\x0b")]
        assert bus.rubbish >= 1
        assert told(client) == b"", "python-can would take an answer for an error of the bus"


def test_commands_out_of_turn_are_answered(bus: SocketcandBus) -> None:
    with contextlib.closing(socket.create_connection(("127.0.0.1", bus.port))) as client, working(bus):
        assert told(client) == b"< hi >"
        for command, answer in (
            (b"< rawmode >", b"< error expected open can0 >"),
            (b"< open vcan7 >", b"< error expected open can0 >"),
            (b"< echo >", b"< echo >"),
            (b"< open can0 >", b"< ok >"),
            (b"< bcmmode >", b"< error expected rawmode >"),
            (b"< rawmode >", b"< ok >"),
        ):
            client.sendall(command)
            assert told(client) == answer


def test_text_without_end_costs_the_client_its_place(bus: SocketcandBus) -> None:
    with contextlib.closing(joined(bus)) as client:
        client.sendall(b"< send " + b"1" * 2000)
        bus.receive(0.5)
        assert bus.clients == 0 and told(client) == b""


def test_client_that_fetches_nothing_loses_frames_and_they_are_counted(bus: SocketcandBus) -> None:
    with contextlib.closing(joined(bus)) as slow:
        sent = 0
        frame = CanFrame(0x321, bytes(8))
        began = time.perf_counter()
        while bus.dropped < 1000:
            bus.send([frame] * 1000, 1.0)
            sent += 1000
        assert time.perf_counter() - began < 10, "the sender did not wait for it"
        received = b""
        with working(bus):
            while data := told(slow):
                received += data
        assert received.count(b"< frame 321 1.000000 0000000000000000 >") == sent - bus.dropped
        assert len(received) > QUEUE_BYTES


def test_client_that_leaves_with_a_full_queue_harms_nobody(bus: SocketcandBus) -> None:
    with contextlib.closing(joined(bus)):
        while not bus.dropped:
            bus.send([CanFrame(0x321, bytes(8))] * 1000, 1.0)
    bus.receive(0.5)
    assert bus.clients == 0


def test_flood_delays_itself_and_nobody_else(bus: SocketcandBus) -> None:
    with contextlib.closing(joined(bus)) as flooding, contextlib.closing(joined(bus)) as quiet:
        flooding.sendall(b"< send 123 8 1 2 3 4 5 6 7 8 >" * 2000)
        began, taken = time.perf_counter(), 0
        while time.perf_counter() < began + 0.1:
            taken += len(bus.receive(0.0))
        assert 0 < taken < 500 + 5000 * (time.perf_counter() - began), "no more than 5,000 a second for long"
        quiet.sendall(b"< send 7 0 >")
        while CanFrame(7, b"") not in (now := bus.receive(0.0)):
            taken += len(now)
            assert taken < 2000, "before the flood has passed"
        while taken + len(now) - 1 < 2000 and time.perf_counter() < began + 30.0:
            now += bus.receive(0.001)
        assert taken + len(now) - 1 == 2000, "none is lost"


def test_as_many_clients_as_it_takes_and_no_more(bus: SocketcandBus) -> None:
    with contextlib.ExitStack() as stack:
        clients = []
        for _ in range(MOST_CLIENTS + 1):
            clients.append(stack.enter_context(socket.create_connection(("127.0.0.1", bus.port))))
            bus.receive(0.05)
        assert bus.clients == MOST_CLIENTS
        assert told(clients[0]) == b"< hi >" and told(clients[-1]) == b""
        clients[0].close()
        bus.receive(0.05)
        assert bus.clients == MOST_CLIENTS - 1


def test_port_that_is_taken_is_one_sentence(bus: SocketcandBus) -> None:
    with pytest.raises(BoardError) as refused:
        SocketcandBus(bus.port, time.perf_counter)
    assert str(refused.value) == f"a CAN bus cannot be served on TCP port {bus.port}: address already in use"
