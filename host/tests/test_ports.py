"""Ports and who may have them: locks, DTR, bit rates, sockets, RFC 2217; and one sentence for each way to fail."""

from __future__ import annotations

import contextlib
import fcntl
import grp
import os
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
from boebot.link.ports import lock_file, serial_port
from boebot.link.ports.lock_file import LockFile, PortBusyError, lock_name
from boebot.link.ports.rfc2217 import Rfc2217Transport
from boebot.link.ports.serial_port import SerialTransport
from boebot.link.transport import BaudSelectable, CountsOverruns, Stamping
from lines import Line, line, rfc2217_server

pytestmark = [
    pytest.mark.wall_clock,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]

RATES = [9600, 19200, 38400, 57600, 115200, 250000, 500000, 1000000]
DEAD = 2**22 + 1  # beyond the highest process number of Linux


@pytest.fixture
def board() -> Iterator[Line]:
    with line() as made:
        yield made


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of all locks in this test."""
    monkeypatch.setattr(lock_file, "USUAL_FOLDERS", ())
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    return tmp_path


@contextlib.contextmanager
def refused(sentence: str, within_s: float = 10.0) -> Iterator[None]:
    """The block fails with a BoardError of one such sentence, in time."""
    begun = time.monotonic()
    with pytest.raises(BoardError, match=sentence) as caught:
        yield
    assert time.monotonic() - begun < within_s
    assert "\n" not in str(caught.value) and ". " not in str(caught.value), "one sentence"


# ---- lock files -----------------------------------------------------------------------------------------------------


def test_lock_is_named_as_other_programs_name_it(tmp_path: Path) -> None:
    assert lock_name("/dev/ttyACM0") == "LCK..ttyACM0"
    assert lock_name("/dev/pts/3") == "LCK..pts_3"
    link = tmp_path / "robot"
    link.symlink_to("/dev/ttyUSB7")
    assert lock_name(str(link)) == "LCK..ttyUSB7"


def test_lock_holds_the_process_number_as_ten_characters_and_a_newline(folder: Path) -> None:
    lock = LockFile("/dev/ttyACM0")
    assert (folder / "LCK..ttyACM0").read_bytes() == b"%10d\n" % os.getpid()
    assert [path.name for path in folder.iterdir()] == ["LCK..ttyACM0"], "nothing else is left"
    with pytest.raises(PortBusyError) as busy:
        LockFile("/dev/ttyACM0")
    assert busy.value.owner == os.getpid()
    lock.release()
    lock.release()
    assert not list(folder.iterdir())


@pytest.mark.parametrize("content", [b"%10d\n" % DEAD, struct.pack("<I", DEAD), b"nonsense", b"", b"-1\n"])
def test_lock_of_a_dead_process_is_taken_over(folder: Path, content: bytes) -> None:
    (folder / "LCK..ttyACM0").write_bytes(content)
    lock = LockFile("/dev/ttyACM0")
    assert (folder / "LCK..ttyACM0").read_bytes() == b"%10d\n" % os.getpid()
    lock.release()
    assert not list(folder.iterdir())


def test_lock_that_an_earlier_process_of_this_number_left_is_taken_over(folder: Path) -> None:
    """As in a container, where numbers begin at 1."""
    (folder / "LCK..ttyACM0").write_bytes(b"%10d\n" % os.getpid())
    lock = LockFile("/dev/ttyACM0")
    with pytest.raises(PortBusyError) as busy:
        LockFile("/dev/ttyACM0")
    assert busy.value.owner == os.getpid()
    lock.release()
    assert not list(folder.iterdir())
    LockFile("/dev/ttyACM0").release()


def test_one_of_two_threads_gets_the_lock_and_nothing_is_left(folder: Path) -> None:
    both = threading.Barrier(2)
    for _ in range(200):
        got: list[LockFile] = []
        failed: list[type[BaseException]] = []

        def take(got: list[LockFile] = got, failed: list[type[BaseException]] = failed) -> None:
            both.wait()
            try:
                got.append(LockFile("/dev/ttyACM0"))
            except BaseException as error:
                failed.append(type(error))

        threads = [threading.Thread(target=take) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(got) == 1 and failed == [PortBusyError]
        assert [path.name for path in folder.iterdir()] == ["LCK..ttyACM0"]
        got[0].release()
        assert not list(folder.iterdir())


def test_lock_of_a_living_process_in_old_binary_form_counts(folder: Path) -> None:
    (folder / "LCK..ttyACM0").write_bytes(struct.pack("<I", os.getppid()))
    with pytest.raises(PortBusyError) as busy:
        LockFile("/dev/ttyACM0")
    assert busy.value.owner == os.getppid()


def test_lock_lies_where_it_may_and_counts_wherever_it_lies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing, usual, temporary = (tmp_path / name for name in ("missing", "usual", "temporary"))
    usual.mkdir()
    temporary.mkdir()
    monkeypatch.setattr(lock_file, "USUAL_FOLDERS", (missing, usual))
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(temporary))
    lock = LockFile("/dev/ttyACM0")
    assert (usual / "LCK..ttyACM0").exists() and not list(temporary.iterdir())
    lock.release()
    monkeypatch.setattr(lock_file, "USUAL_FOLDERS", (missing,))
    lock = LockFile("/dev/ttyACM0")
    assert (temporary / "LCK..ttyACM0").exists()
    monkeypatch.setattr(lock_file, "USUAL_FOLDERS", (missing, usual))
    with pytest.raises(PortBusyError):
        LockFile("/dev/ttyACM0")
    lock.release()


def test_only_one_of_many_gets_a_stale_lock(folder: Path) -> None:
    script = (
        "import sys, tempfile\n"
        "from boebot.link.ports import lock_file\n"
        "lock_file.USUAL_FOLDERS = ()\n"
        f"tempfile.tempdir = {str(folder)!r}\n"
        "sys.stdin.readline()\n"
        "try:\n"
        "    lock_file.LockFile('/dev/ttyACM0'); print('got it', flush=True)\n"
        "except lock_file.PortBusyError:\n"
        "    print('busy', flush=True)\n"
        "sys.stdin.readline()\n"
    )
    for _ in range(3):
        (folder / "LCK..ttyACM0").write_bytes(b"%10d\n" % DEAD)
        crowd = [
            subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            for _ in range(4)
        ]
        for step in ("go", "end"):
            for child in crowd:
                assert child.stdin is not None
                child.stdin.write("\n")
                child.stdin.flush()
            if step == "go":
                said = [child.stdout.readline().strip() for child in crowd if child.stdout is not None]
        assert sorted(said) == ["busy", "busy", "busy", "got it"]
        for child in crowd:
            child.communicate(timeout=10)


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
    name = lock_name(board.path)
    child = hold(board.path, ending)
    locks = [folder / name for folder in lock_file.USUAL_FOLDERS if (folder / name).exists()]
    child.communicate("\n")
    if "kill" not in ending:
        assert not any(path.exists() for path in locks), "removed at exit"
    open_port(board.path, 500_000).close()


def test_program_without_a_lock_file_that_has_locked_the_port_keeps_it(board: Line) -> None:
    other = os.open(board.path, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(other, fcntl.LOCK_EX)
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

    transport = SerialTransport(board.path)
    assert not marked()
    transport.close()
    monkeypatch.setattr("os.ttyname", lambda _: "/dev/ttyACM0")
    transport = SerialTransport(board.path)
    assert marked()
    transport.close()


# ---- DTR ------------------------------------------------------------------------------------------------------------


def hangs_up(board: Line) -> bool:
    flags: int = termios.tcgetattr(board.slave)[2]
    return bool(flags & termios.HUPCL)


def test_without_reset_dtr_outlasts_the_closing_and_with_it_not(board: Line) -> None:
    for reset in (False, True, False):
        SerialTransport(board.path, 250_000, reset=reset).close()
        assert hangs_up(board) is reset
    open_port(f"serial:{board.path}?reset=yes", 500_000).close()
    assert hangs_up(board)
    open_port(f"serial:{board.path}?baud=115200&reset=no", 500_000).close()
    assert not hangs_up(board)


def test_reset_switches_dtr_off_and_on_in_case_it_was_left_on(board: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    switched: list[bool] = []
    update = lambda port: switched.append(bool(port._dtr_state))  # noqa: E731
    monkeypatch.setattr(serial.Serial, "_update_dtr_state", update)
    transport = SerialTransport(board.path)
    transport.close()
    assert switched[-2:] == [False, True] and transport.resets_board
    switched.clear()
    transport = SerialTransport(board.path, reset=False)
    transport.close()
    assert not transport.resets_board, "a pty has no DTR"
    assert False not in switched, "Linux switches DTR on at opening; off and on again would be a reset"


@pytest.mark.parametrize("when", ["pulse_dtr", "_keep_dtr_at_close"])
def test_ctrl_c_while_a_port_is_opened_leaves_it_free(board: Line, monkeypatch: pytest.MonkeyPatch, when: str) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(serial_port, when, interrupted)
        with pytest.raises(KeyboardInterrupt):
            open_port(board.path, 500_000)
    assert not any((place / lock_name(board.path)).exists() for place in lock_file.USUAL_FOLDERS)
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
        transport = SerialTransport(board.path, rate, baud_given=True, reset=reset)
        assert transport.baud == line_rate(board) == rate and transport.baud_given
        transport.close()
    transport = SerialTransport(board.path)
    assert not transport.baud_given
    for rate in (*RATES, *reversed(RATES), 123_456):
        transport.set_baud(rate)
        assert transport.baud == line_rate(board) == rate
    board.send(b"still there")
    assert transport.read(1.0) == b"still there"
    transport.close()


def test_what_came_at_another_rate_is_forgotten(board: Line) -> None:
    transport = SerialTransport(board.path)
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
    transport = SerialTransport(board.path)
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
        SerialTransport(board.path, 250_000)
    monkeypatch.undo()
    SerialTransport(board.path, 250_000).close()


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")
def test_bytes_that_a_driver_lost_are_counted_from_the_opening(board: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    transport = SerialTransport(board.path)
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
    transport = SerialTransport(board.path)
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
        assert isinstance(transport, Stamping) and not isinstance(transport, BaudSelectable)
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
@pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
def test_host_that_does_not_answer_is_given_up_in_time(scheme: str) -> None:
    with socket.socket() as server, contextlib.ExitStack() as waiting:
        server.bind(("127.0.0.1", 0))
        server.listen(0)
        address = server.getsockname()
        for _ in range(4):  # a full queue: further connections get no answer
            client = waiting.enter_context(socket.socket())
            client.setblocking(False)
            client.connect_ex(address)
        with refused(r"cannot be opened: no answer within 1\.8 s"):
            open_port(f"{scheme}://127.0.0.1:{address[1]}", 500_000)


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
        assert isinstance(transport, Rfc2217Transport) and isinstance(transport, BaudSelectable)
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
        begun = time.monotonic()
        assert transport.read(0.2) == b"" and time.monotonic() - begun > 0.19
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
            transport = Rfc2217Transport("127.0.0.1", server.port, reset=reset)
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
        transport = Rfc2217Transport("127.0.0.1", server.port)
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
