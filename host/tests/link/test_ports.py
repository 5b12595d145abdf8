"""Ports: who may have them, what they do with bytes, DTR, bit rates, sockets, RFC 2217; one sentence for each way to
fail."""

from __future__ import annotations

import contextlib
import fcntl
import grp
import os
import signal
import socket
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import serial
from serial import rfc2217

from boebot.boards import open_port
from boebot.errors import BoardError
from boebot.link import line as link_line
from boebot.link import ports
from boebot.link.transport import BaudSelectable, CountsOverruns
from lines import Line, line, rfc2217_server

pytestmark = [
    pytest.mark.wall_clock,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]

RATES = [9600, 19200, 38400, 57600, 115200, 250000, 500000, 1000000]


@pytest.fixture
def board() -> Iterator[Line]:
    with line() as made:
        yield made


@contextlib.contextmanager
def refused(sentence: str, within_s: float = 10.0) -> Iterator[None]:
    """The block fails with a BoardError of one such sentence, in time."""
    begun = time.perf_counter()
    with pytest.raises(BoardError, match=sentence) as caught:
        yield
    assert time.perf_counter() - begun < within_s
    assert "\n" not in str(caught.value) and ". " not in str(caught.value), "one sentence"


# ---- whose a port is ------------------------------------------------------------------------------------------------


def hold(path: str, then: str) -> subprocess.Popen[str]:
    """A process that has the port open."""
    script = (
        "import sys, os\n"
        "from boebot.boards import open_port\n"
        f"port = open_port({path!r}, 500000)\n"
        "print('open', flush=True)\n"
        f"sys.stdin.readline()\n{then}\n"
    )
    child = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "open\n"
    return child


def test_port_is_this_programs_alone_and_the_refusal_names_the_process(board: Line) -> None:
    child = hold(board.path, "")
    with refused(rf"{board.path} is busy: process {child.pid} \(python.*\) has it open"):
        open_port(board.path, 500_000)
    child.communicate("\n")
    first = open_port(board.path, 500_000)
    with refused(rf"is busy: this program itself \(process {os.getpid()}\) has it open"):
        open_port(f"serial:{board.path}", 500_000)
    first.close()
    open_port(board.path, 500_000).close()


@pytest.mark.parametrize("ending", ["", "raise SystemExit(3)", "os.kill(os.getpid(), 9)"])
def test_port_is_free_again_however_its_program_ended(board: Line, ending: str) -> None:
    hold(board.path, ending).communicate("\n")
    open_port(board.path, 500_000).close()


def test_program_that_cannot_be_named_keeps_the_port_that_it_has_locked(
    board: Line, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = os.open(board.path, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(other, fcntl.LOCK_EX)
    monkeypatch.setattr(ports, "holder_of", lambda _: None)
    with refused("is busy: another program has it open"):
        open_port(board.path, 500_000)
    os.close(other)
    open_port(board.path, 500_000).close()


def test_real_port_refuses_others_and_a_pty_keeps_no_mark(board: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    """TIOCEXCL. Here a pty plays the real port; root may open a marked one, so the mark itself is read."""
    exclusive_mark = 0x80045440  # TIOCGEXCL

    def marked() -> bool:
        answer = bytearray(4)
        fcntl.ioctl(board.slave, exclusive_mark, answer)
        return bool(struct.unpack("i", answer)[0])

    transport = ports.open_serial(board.path, 500_000)
    assert not marked()
    transport.close()
    monkeypatch.setattr("os.ttyname", lambda _: "/dev/ttyACM0")
    transport = ports.open_serial(board.path, 500_000)
    assert marked()
    transport.close()


# ---- bytes and stamps -----------------------------------------------------------------------------------------------


def read_all(transport: ports.SerialPort, count: int) -> bytes:
    got = b""
    while len(got) < count:
        more = transport.read(5.0)
        assert more, "nothing came for five seconds"
        got += more
    return got


def test_bytes_go_both_ways(board: Line) -> None:
    transport = ports.open_serial(board.path, 500_000)
    assert transport.realtime and transport.name == board.path
    transport.write(b"\0there\n\xff")
    assert board.receive(8) == b"\0there\n\xff"
    assert transport.read(0.0) == b"" == transport.read(0.01)
    for content in (b"\0one\r\n", bytes(range(256))):
        board.send(content)
        assert read_all(transport, len(content)) == content
    transport.close()


def test_wait_ends_with_the_first_bytes_or_when_it_is_over(board: Line) -> None:
    """And a stamp is of the reading, as a link sees it: after the arrival of all that it holds."""
    transport = ports.open_serial(board.path, 500_000)
    received = link_line.Line(transport)
    begun = time.perf_counter()
    threading.Timer(0.05, board.send, [b"now"]).start()
    [(stamp, data)] = received.read(5.0)
    assert data == b"now" and begun + 0.05 < stamp < begun + 4.5 and stamp <= time.perf_counter()
    begun = time.perf_counter()
    assert received.read(0.1) == [] and 0.1 <= time.perf_counter() - begun < 5.0
    transport.close()


def test_nothing_is_lost_while_nobody_reads(board: Line) -> None:
    """More than all buffers hold: the sender has to wait, and everything comes in order."""
    transport = ports.open_serial(board.path, 500_000)
    content = os.urandom(100_000)
    sender = threading.Thread(target=board.send, args=[content])
    sender.start()
    time.sleep(0.1)
    assert sender.is_alive(), "the buffers were too large for this test"
    assert read_all(transport, len(content)) == content
    sender.join()
    transport.close()


def test_end_is_an_error_after_the_bytes_before_it() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = ports.SocketPort("127.0.0.1", server.getsockname()[1])
        connection, _ = server.accept()
        connection.sendall(b"last words")
        connection.close()
        assert transport.read(1.0) == b"last words"
        with refused("has gone: closed by the other side"):
            transport.read(1.0)
        transport.close()


@pytest.mark.parametrize("use", ["read", "write"])
def test_unplugging_is_noticed_at_once_by_reader_and_writer(board: Line, use: str) -> None:
    transport = ports.open_serial(board.path, 500_000)
    threading.Timer(0.1, board.unplug).start()
    with refused("has gone: unplugged, or closed by the other side", within_s=2.9):
        while True:
            if use == "read":
                transport.read(5.0)
            else:
                transport.write(b"hello")
                time.sleep(0.01)
    transport.close()


def test_a_sleep_in_the_midst_of_sending_is_no_fault_of_the_other_side(
    board: Line, monkeypatch: pytest.MonkeyPatch
) -> None:
    transport = ports.open_serial(board.path, 500_000)
    write, slept = os.write, threading.Event()

    def sleepy(file: int, data: bytes) -> int:
        if file == transport._device.fileno() and not slept.is_set():
            slept.set()
            time.sleep(1.1)
        return write(file, data)

    monkeypatch.setattr(os, "write", sleepy)
    transport.write(b"hello")
    assert slept.is_set() and board.receive(5) == b"hello"
    transport.close()


def test_other_side_that_does_not_read_is_an_error_in_time(board: Line) -> None:
    transport = ports.open_serial(board.path, 500_000)
    with refused("takes no bytes: its other side does not read"):
        transport.write(bytes(1_000_000))
    transport.close()


def test_closed_port_refuses_and_may_be_closed_again(board: Line) -> None:
    transport = ports.open_serial(board.path, 500_000)
    transport.close()
    transport.close()
    with refused("has gone"):
        transport.read(1.0)
    with refused("has gone"):
        transport.write(b"x")


def test_ctrl_c_ends_a_long_wait(board: Line) -> None:
    child = hold(board.path, "print('reads', flush=True)\nport.read(30.0)")
    assert child.stdin is not None and child.stdout is not None
    child.stdin.write("\n")
    child.stdin.flush()
    assert child.stdout.readline() == "reads\n"
    child.send_signal(signal.SIGINT)
    child.communicate(timeout=10)
    assert child.returncode


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_forked_child_leaves_its_parents_port_alone(board: Line) -> None:
    transport = ports.open_serial(board.path, 500_000)
    child = os.fork()
    if child == 0:
        signal.alarm(5)  # one that hangs is killed
        transport.close()
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    board.send(b"two")
    assert transport.read(5.0) == b"two"
    with refused("is busy: this program itself"):
        ports.open_serial(board.path, 500_000)
    transport.close()


def test_no_descriptor_is_left_behind(board: Line) -> None:
    def count() -> int:
        return len(os.listdir("/dev/fd"))  # noqa: PTH208

    ports.open_serial(board.path, 500_000).close()
    before = count()
    for _ in range(5):
        ports.open_serial(board.path, 500_000).close()
    assert count() == before


# ---- DTR ------------------------------------------------------------------------------------------------------------


def hangs_up(board: Line) -> bool:
    flags: int = termios.tcgetattr(board.slave)[2]
    return bool(flags & termios.HUPCL)


def test_without_reset_dtr_outlasts_the_closing_and_with_it_not(board: Line) -> None:
    for reset in (False, True, False):
        ports.open_serial(board.path, 250_000, reset=reset).close()
        assert hangs_up(board) is reset
    open_port(f"serial:{board.path}?reset=yes", 500_000).close()
    assert hangs_up(board)
    open_port(f"serial:{board.path}?baud=115200&reset=no", 500_000).close()
    assert not hangs_up(board)


def test_reset_switches_dtr_off_and_on_in_case_it_was_left_on(board: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    switched: list[bool] = []
    update = lambda port: switched.append(bool(port._dtr_state))  # noqa: E731
    monkeypatch.setattr(serial.Serial, "_update_dtr_state", update)
    transport = ports.open_serial(board.path, 500_000)
    transport.close()
    assert switched[-2:] == [False, True] and transport.resets_board
    switched.clear()
    transport = ports.open_serial(board.path, 500_000, reset=False)
    transport.close()
    assert not transport.resets_board, "a pty has no DTR"
    assert False not in switched, "Linux switches DTR on at opening; off and on again would be a reset"


@pytest.mark.parametrize("when", ["pulse_dtr", "_keep_dtr_at_close"])
def test_ctrl_c_while_a_port_is_opened_leaves_it_free(board: Line, monkeypatch: pytest.MonkeyPatch, when: str) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(ports, when, interrupted)
        with pytest.raises(KeyboardInterrupt):
            open_port(board.path, 500_000)
    open_port(board.path, 500_000).close()


# ---- bit rates ------------------------------------------------------------------------------------------------------


def line_rate(board: Line) -> int:
    """The rate of the line as the kernel has it (struct termios2)."""
    settings = bytearray(44)
    fcntl.ioctl(board.slave, 0x802C542A, settings)
    rate: int = struct.unpack_from("I", settings, 40)[0]
    return rate


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")
@pytest.mark.parametrize("reset", [False, True])
def test_every_rate_is_set_at_opening_and_later(board: Line, reset: bool) -> None:
    for rate in RATES:
        transport = ports.open_serial(board.path, rate, baud_given=True, reset=reset)
        assert transport.baud == line_rate(board) == rate and transport.baud_given
        transport.close()
    transport = ports.open_serial(board.path, 500_000)
    assert not transport.baud_given
    for rate in (*RATES, *reversed(RATES), 123_456):
        transport.set_baud(rate)
        assert transport.baud == line_rate(board) == rate
    board.send(b"still there")
    assert transport.read(1.0) == b"still there"
    transport.close()


def test_what_came_at_another_rate_is_forgotten(board: Line) -> None:
    transport = ports.open_serial(board.path, 500_000)
    board.send(b"garbled")
    time.sleep(0.1)
    transport.set_baud(115_200)
    assert transport.read(0.05) == b""
    board.send(b"clear")
    assert transport.read(1.0) == b"clear"
    transport.close()


def test_rates_that_do_not_go_are_named(board: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    for rate in (9_599, 1_000_001):
        with refused(f"{board.path} cannot be opened at {rate} baud; expected 9600 to 1000000"):
            open_port(f"serial:{board.path}?baud={rate}", 500_000)
    transport = ports.open_serial(board.path, 500_000)
    with refused("at 300 baud"):
        transport.set_baud(300)

    def refuse(port: serial.Serial, rate: int) -> None:
        raise ValueError(f"Failed to set custom baud rate ({rate}): [Errno 22] Invalid argument")  # as pyserial does

    monkeypatch.setattr(serial.Serial, "_set_special_baudrate", refuse)
    with refused(f"{board.path} does not run at 250000 baud"):
        transport.set_baud(250_000)
    assert transport.baud == 500_000, "the rate is as before"
    transport.close()
    with refused(f"{board.path} does not run at 250000 baud"):
        ports.open_serial(board.path, 250_000)
    monkeypatch.undo()
    ports.open_serial(board.path, 250_000).close()


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")
def test_bytes_that_a_driver_lost_are_counted_from_the_opening(board: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    transport = ports.open_serial(board.path, 500_000)
    assert isinstance(transport, CountsOverruns) and transport.overruns == 0, "a pty does not count"
    transport.close()
    counts = {"overrun": 3, "buf_overrun": 4}
    real = fcntl.ioctl

    def ioctl(descriptor: int, request: int, *arguments: Any) -> object:
        if request != 0x545D:  # TIOCGICOUNT: cts dsr rng dcd rx tx frame overrun parity brk buf_overrun ...
            return real(descriptor, request, *arguments)
        struct.pack_into("20i", arguments[0], 0, *[1] * 7, counts["overrun"], 1, 1, counts["buf_overrun"], *[1] * 9)
        return 0

    monkeypatch.setattr(fcntl, "ioctl", ioctl)
    transport = ports.open_serial(board.path, 500_000)
    assert transport.overruns == 0
    counts["overrun"] += 20
    counts["buf_overrun"] += 1
    assert transport.overruns == 21
    transport.close()
    assert transport.overruns == 0


# ---- ports that cannot be opened ------------------------------------------------------------------------------------


def test_missing_port_is_named_with_those_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [type("Port", (), {"device": name}) for name in ("/dev/ttyUSB1", "/dev/ttyACM0")]
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: found)
    with refused("there is no port /dev/ttyACM9; those there are: /dev/ttyACM0, /dev/ttyUSB1$"):
        open_port("/dev/ttyACM9", 500_000)
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    with refused("there is no port /dev/ttyACM9; there is none at all: is the board plugged in"):
        open_port("/dev/ttyACM9", 500_000)


def test_a_path_that_is_no_serial_port_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in ("/dev/null", str(tmp_path), str(tmp_path / "file")):
        with refused(f"{path} is no serial port"):
            open_port(path, 500_000)


SOMEBODY = 65534  # nobody's numbers


def refusal_for_somebody(path: str) -> str:
    """The error for a user without rights: from a copy of this process that has given up its rights."""
    if os.getuid() != 0:
        pytest.skip("only root can give the port to others, and ask as another user")
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setgroups([])
            os.setgid(SOMEBODY)
            os.setuid(SOMEBODY)
            open_port(path, 500_000)
        except BaseException as error:
            os.write(writing, str(error).encode())
        finally:
            os._exit(0)
    os.close(writing)
    os.waitpid(child, 0)
    with os.fdopen(reading) as answer:
        return answer.read()


def test_forbidden_port_says_what_to_do(board: Line) -> None:
    dialout = grp.getgrnam("dialout").gr_gid
    for mode, group, remedy in (
        (0o660, dialout, "join its group with: sudo usermod -aG dialout $USER, and log in again"),
        (0o600, dialout, "its owner is another user"),
        (0o660, 0, "its owner is another user"),
    ):
        if os.getuid() == 0:
            os.chown(board.path, 0, group)
        Path(board.path).chmod(mode)
        assert refusal_for_somebody(board.path) == (
            f"{board.path} may not be opened by this user: permission denied; {remedy}"
        )


@pytest.mark.skipif(os.getuid() == 0, reason="for root nothing is forbidden; the test above asks as another user")
def test_forbidden_file_says_so(tmp_path: Path) -> None:
    port = tmp_path / "port"
    port.touch(mode=0o000)
    with refused("permission denied; its owner is another user"):
        open_port(str(port), 500_000)


# ---- TCP ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("host", "family"), [("127.0.0.1", socket.AF_INET), ("[::1]", socket.AF_INET6)])
def test_socket_carries_bytes_both_ways(host: str, family: socket.AddressFamily) -> None:
    try:
        server = socket.create_server((host.strip("[]"), 0), family=family)
    except OSError:
        assert family == socket.AF_INET6
        pytest.skip("this machine has no IPv6")
    with server:
        transport = open_port(f"socket://{host}:{server.getsockname()[1]}", 500_000)
        connection, _ = server.accept()
        transport.write(b"there\0\xff")
        assert connection.recv(100) == b"there\0\xff"
        connection.sendall(b"back")
        assert transport.read(1.0) == b"back"
        assert transport.read(0.01) == b""
        assert not isinstance(transport, BaudSelectable)
        transport.close()
        assert connection.recv(100) == b""
        connection.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
    return port


@pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
def test_connection_that_fails_is_an_error_in_time(scheme: str) -> None:
    port = free_port()
    with refused(rf"^{scheme}://127\.0\.0\.1:{port} cannot be opened: nobody listens there$"):
        open_port(f"{scheme}://127.0.0.1:{port}", 500_000)
    with refused(rf"^{scheme}://there\.invalid:1 cannot be opened: no host is called there\.invalid$"):
        open_port(f"{scheme}://there.invalid:1", 500_000)


@pytest.mark.skipif(sys.platform != "linux", reason="fills Linux's queue of connections")
def test_host_that_does_not_answer_is_given_up_in_time() -> None:
    with socket.socket() as server, contextlib.ExitStack() as waiting:
        server.bind(("127.0.0.1", 0))
        server.listen(0)
        address = server.getsockname()
        for _ in range(4):  # a full queue: further connections get no answer
            client = waiting.enter_context(socket.socket())
            client.setblocking(False)
            client.connect_ex(address)
        with refused(r"cannot be opened: no answer in time"):
            open_port(f"socket://127.0.0.1:{address[1]}", 500_000)


def test_socket_whose_other_side_does_not_read_is_an_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = open_port(f"socket://127.0.0.1:{server.getsockname()[1]}", 500_000)
        connection, _ = server.accept()
        with refused("takes no bytes: its other side does not read"):
            transport.write(bytes(30_000_000))
        transport.close()
        connection.close()


# ---- RFC 2217 -------------------------------------------------------------------------------------------------------


def test_shared_port_carries_all_bytes_and_its_rate() -> None:
    with rfc2217_server() as (server, board):
        transport = open_port(f"rfc2217://127.0.0.1:{server.port}?baud=115200", 500_000)
        assert isinstance(transport, BaudSelectable)
        assert transport.baud == server.serial.baudrate == 115_200 and transport.baud_given
        everything = bytes(range(256)) * 4
        transport.write(everything)
        assert board.receive(len(everything)) == everything, "255 is an escape of Telnet's"
        board.send(everything)
        got = b""
        while len(got) < len(everything):
            more = transport.read(2.0)
            assert more
            got += more
        assert got == everything
        begun = time.perf_counter()
        assert transport.read(0.2) == b"" and time.perf_counter() - begun > 0.19
        transport.set_baud(250_000)
        assert server.serial.baudrate == transport.baud == 250_000
        with refused("at 50 baud"):
            transport.set_baud(50)
        transport.close()
        transport.close()


def test_shared_port_is_reset_or_not() -> None:
    for reset, expected in ((True, [True, False, True]), (False, [False])):
        with rfc2217_server() as (server, _):
            del server.serial.dtr_was[:]
            transport = ports.open_rfc2217("127.0.0.1", server.port, 500_000, reset=reset)
            transport.close()
            assert transport.resets_board is reset
            assert server.serial.dtr_was[: len(expected)] == expected


def test_server_that_refuses_to_switch_dtr_shares_its_port_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    real = rfc2217.PortManager._telnet_process_subnegotiation  # type: ignore[attr-defined]
    off = rfc2217.COM_PORT_OPTION + rfc2217.SET_CONTROL + rfc2217.SET_CONTROL_DTR_OFF

    def refusing(manager: rfc2217.PortManager, asked: bytes) -> None:
        if asked == off:
            manager.rfc2217_send_subnegotiation(rfc2217.SERVER_SET_CONTROL, rfc2217.SET_CONTROL_DTR_ON)
        else:
            real(manager, asked)

    monkeypatch.setattr(rfc2217.PortManager, "_telnet_process_subnegotiation", refusing)
    with rfc2217_server() as (server, board):
        transport = ports.open_rfc2217("127.0.0.1", server.port, 500_000)
        assert not transport.resets_board
        board.send(b"!")
        assert transport.read(2.0) == b"!"
        transport.close()


def test_shared_port_that_goes_away_is_noticed() -> None:
    with rfc2217_server() as (server, _):
        transport = open_port(f"rfc2217://127.0.0.1:{server.port}", 500_000)
        threading.Timer(0.1, server.hang_up).start()
        with refused(r"rfc2217://127\.0\.0\.1:\d+ has gone: closed by the other side"):
            transport.read(5.0)
        transport.close()
        with refused("has gone"):
            transport.write(b"x")


def test_server_without_rfc2217_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, refused("is no RFC 2217 server: something else listens"):
        open_port(f"rfc2217://127.0.0.1:{server.getsockname()[1]}", 500_000)
