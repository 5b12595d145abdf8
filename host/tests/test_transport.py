"""What ports do with bytes: nothing lost or out of order, stamped when it came, and an end that is noticed."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boebot.errors import BoardError
from boebot.link.ports import descriptor
from boebot.link.ports.descriptor import HAS_THREAD, DescriptorTransport
from boebot.link.ports.serial_port import SerialTransport
from boebot.link.ports.tcp import SocketTransport
from boebot.link.transport import BaudSelectable, Stamping
from lines import Line, line

pytestmark = [
    pytest.mark.wall_clock,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]

THREADS = [
    pytest.param(True, id="C thread", marks=pytest.mark.skipif(not HAS_THREAD, reason="not built on this system")),
    pytest.param(False, id="calling thread"),
]


@pytest.fixture
def board() -> Iterator[Line]:
    with line() as made:
        yield made


def read_all(transport: DescriptorTransport, count: int) -> list[tuple[float, bytes]]:
    pieces: list[tuple[float, bytes]] = []
    while sum(len(data) for _, data in pieces) < count:
        more = transport.read_stamped(5.0)
        assert more, "nothing came for five seconds"
        pieces += more
    return pieces


def test_what_a_transport_offers(board: Line) -> None:
    transport = SerialTransport(board.path)
    assert isinstance(transport, Stamping) and isinstance(transport, BaudSelectable)
    assert transport.realtime and transport.name == board.path
    transport.close()


@pytest.mark.parametrize("thread", THREADS)
def test_bytes_go_both_ways_with_stamps_that_fit(board: Line, thread: bool) -> None:
    transport = SerialTransport(board.path, thread=thread)
    transport.write(b"\0there\n\xff")
    assert board.receive(8) == b"\0there\n\xff"
    assert transport.read(0.0) == b"" and transport.read_stamped(0.01) == []
    for content in (b"\0one\r\n", bytes(range(256))):
        before = transport.now()
        board.send(content)
        pieces = read_all(transport, len(content))
        assert b"".join(data for _, data in pieces) == content
        assert all(before <= stamp <= transport.now() for stamp, _ in pieces)
    board.send(b"joined")
    assert transport.read(1.0) == b"joined"
    transport.close()


@pytest.mark.skipif(not HAS_THREAD, reason="not built on this system")
def test_stamp_is_of_the_arrival_not_of_the_fetching(board: Line) -> None:
    transport = SerialTransport(board.path)
    sent = []
    for number in range(5):
        sent.append(transport.now())
        board.send(bytes([number]))
        time.sleep(0.05)
    pieces = transport.read_stamped(0.0)
    assert [data for _, data in pieces] == [bytes([number]) for number in range(5)]
    for instant, (stamp, _) in zip(sent, pieces, strict=True):
        assert instant <= stamp < instant + 0.04
    transport.close()


@pytest.mark.parametrize("thread", THREADS)
def test_nothing_is_lost_while_nobody_reads(board: Line, thread: bool) -> None:
    """More than all buffers hold: the sender has to wait, and everything comes in order."""
    transport = SerialTransport(board.path, thread=thread)
    content = os.urandom(600_000)
    sender = threading.Thread(target=board.send, args=[content])
    sender.start()
    time.sleep(0.2)
    assert sender.is_alive(), "the buffers were too large for this test"
    pieces = read_all(transport, len(content))
    sender.join()
    assert b"".join(data for _, data in pieces) == content
    stamps = [stamp for stamp, _ in pieces]
    assert stamps == sorted(stamps)
    transport.close()


@given(st.lists(st.binary(min_size=1, max_size=3000), min_size=1, max_size=20), st.lists(st.booleans(), max_size=20))
@settings(max_examples=30)
def test_any_pattern_of_sending_and_reading_keeps_every_byte(sent: list[bytes], reads: list[bool]) -> None:
    with line() as board:
        transport = SerialTransport(board.path)
        got = b""
        for number, data in enumerate(sent):
            board.send(data)
            if number < len(reads) and reads[number]:
                got += transport.read(0.0)
        whole = b"".join(sent)
        while len(got) < len(whole):
            more = transport.read(5.0)
            assert more
            got += more
        assert got == whole
        transport.close()


@pytest.mark.parametrize("thread", THREADS)
def test_end_is_an_error_after_the_bytes_before_it(board: Line, thread: bool) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = SocketTransport("127.0.0.1", server.getsockname()[1], thread=thread)
        connection, _ = server.accept()
        connection.sendall(b"last words")
        connection.close()
        time.sleep(0.05)
        assert transport.read(1.0) == b"last words"
        with pytest.raises(BoardError, match="has gone: closed by the other side"):
            transport.read(1.0)
        transport.close()


def again_and_again(
    use: Callable[[DescriptorTransport], object], transport: DescriptorTransport, seconds: float
) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        use(transport)
        time.sleep(0.01)


@pytest.mark.parametrize("thread", THREADS)
def test_unplugging_is_noticed_at_once_by_reader_and_writer(thread: bool) -> None:
    for use in (lambda port: port.read(5.0), lambda port: port.write(b"hello")):
        with line() as board:
            transport = SerialTransport(board.path, thread=thread)
            transport.read(0.0)
            timer = threading.Timer(0.1, board.unplug)
            timer.start()
            begun = time.monotonic()
            with pytest.raises(BoardError, match="has gone: unplugged, or closed by the other side"):
                again_and_again(use, transport, 3.0)
            assert time.monotonic() - begun < 2.9, "not only when the wait has ended"
            timer.join()
            transport.close()


@pytest.mark.parametrize("thread", THREADS)
def test_other_side_that_does_not_read_is_an_error_within_two_seconds(board: Line, thread: bool) -> None:
    transport = SerialTransport(board.path, thread=thread)
    begun = time.monotonic()
    with pytest.raises(BoardError, match="takes no bytes: its other side does not read"):
        transport.write(bytes(1_000_000))
    assert 0.9 < time.monotonic() - begun < 10
    transport.close()


@pytest.mark.parametrize("thread", THREADS)
def test_closed_port_refuses_and_may_be_closed_again(board: Line, thread: bool) -> None:
    transport = SerialTransport(board.path, thread=thread)
    transport.close()
    transport.close()
    for use in (lambda: transport.read(1.0), lambda: transport.write(b"x")):
        with pytest.raises(BoardError, match="has gone"):
            use()


@pytest.mark.skipif(not HAS_THREAD, reason="not built on this system")
def test_reader_in_another_thread_survives_the_closing(board: Line) -> None:
    transport = SerialTransport(board.path)
    ended: list[BaseException] = []

    def read() -> None:
        try:
            transport.read(5.0)
        except BoardError as error:
            ended.append(error)

    reader = threading.Thread(target=read)
    reader.start()
    time.sleep(0.1)
    transport.close()
    reader.join(2.0)
    assert not reader.is_alive() and len(ended) == 1


def test_ctrl_c_ends_a_long_wait(board: Line) -> None:
    script = (
        "from boebot.link.ports.serial_port import SerialTransport\n"
        f"port = SerialTransport({board.path!r})\n"
        "print('waiting', flush=True)\n"
        "port.read(30.0)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.readline()
    time.sleep(0.1)
    begun = time.monotonic()
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=10)
    assert time.monotonic() - begun < 10
    assert b"KeyboardInterrupt" in errors


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.parametrize("thread", THREADS)
@pytest.mark.parametrize("ending", ["ends", "closes", "forgets"])
def test_forked_child_leaves_its_parents_port_alone(board: Line, thread: bool, ending: str) -> None:
    transport = SerialTransport(board.path, thread=thread)
    board.send(b"one")
    assert transport.read(5.0) == b"one"
    child = os.fork()
    if child == 0:
        signal.alarm(5)  # one that hangs is killed
        if ending == "ends":
            transport._close_once()  # as Python does at its end
        elif ending == "closes":
            transport.close()
        else:
            transport._close_once.detach()
            transport._reader = None  # its memory is freed
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    board.send(b"two")
    assert transport.read(5.0) == b"two"
    with pytest.raises(BoardError, match="busy"):
        SerialTransport(board.path)
    transport.close()


def test_no_thread_or_descriptor_is_left_behind() -> None:
    def count() -> tuple[int, int]:
        return len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))  # noqa: PTH208

    with line() as board:
        SerialTransport(board.path).close()
        before = count()
        for _ in range(50):
            SerialTransport(board.path).close()
        deadline = time.monotonic() + 10.0  # the kernel lists a thread for a moment after its end
        while count() != before and time.monotonic() < deadline:
            time.sleep(0.01)
        assert count() == before


@pytest.mark.skipif(not HAS_THREAD, reason="not built on this system")
def test_port_that_gets_no_thread_is_one_sentence_and_no_crash() -> None:
    """In another process: this has crashed it. There is room for the port, not for the pipe."""
    script = (
        "import gc, os, resource\n"
        "from boebot.errors import BoardError\n"
        "from boebot.link.ports.descriptor import DescriptorTransport\n"
        "master, slave = os.openpty()\n"
        "used = max(int(name) for name in os.listdir('/dev/fd'))\n"
        "resource.setrlimit(resource.RLIMIT_NOFILE, (used, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))\n"
        "released = []\n"
        "try:\n"
        "    DescriptorTransport('port', slave, lambda: released.append(1))\n"
        "except BoardError as error:\n"
        "    print(error)\n"
        "gc.collect()\n"
        "print(released)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "port cannot be read: no memory, no file or no thread for it\n[1]\n"


def test_switch_interval_is_short_while_a_port_is_open_and_then_as_before() -> None:
    before = sys.getswitchinterval()
    try:
        sys.setswitchinterval(0.007)
        with line() as one, line() as two:
            first, second = SerialTransport(one.path), SerialTransport(two.path)
            assert sys.getswitchinterval() == pytest.approx(0.001)
            first.close()
            assert sys.getswitchinterval() == pytest.approx(0.001)
            second.close()
            second.close()
            assert sys.getswitchinterval() == pytest.approx(0.007)
            third = SerialTransport(one.path)
            sys.setswitchinterval(0.002)
            third.close()
            assert sys.getswitchinterval() == pytest.approx(0.002), "somebody else's wish is kept"
    finally:
        sys.setswitchinterval(before)


def test_opening_that_takes_too_long_is_given_up_and_cleaned_up_later() -> None:
    given_back: list[str] = []
    go_on = threading.Event()

    def slow() -> str:
        go_on.wait(5)
        return "late"

    with pytest.raises(TimeoutError):
        descriptor.within(0.1, slow, given_back.append)
    go_on.set()
    deadline = time.monotonic() + 2
    while not given_back and time.monotonic() < deadline:
        time.sleep(0.01)
    assert given_back == ["late"]
    assert descriptor.within(1.0, lambda: "in time", given_back.append) == "in time"
    with pytest.raises(ZeroDivisionError):
        descriptor.within(1.0, _fail, given_back.append)
    assert given_back == ["late"]


_fail: Callable[[], object] = lambda: 1 // 0  # noqa: E731
