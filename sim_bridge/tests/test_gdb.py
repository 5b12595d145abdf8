"""A program under a debugger: the real avr-gdb, and clients that misbehave."""

from __future__ import annotations

import re
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import BoardError, CallError
from sim_bridge.gdb import Gdb
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import AVR, NATIVE, Pace, open_on
from sim_bridge.tests.boards.avr.avr_program import compiled

SOURCE = """
#include <avr/io.h>
#include <stdint.h>
struct state { uint16_t rounds; uint8_t level; } state = {3, 0};
volatile uint8_t shown;
static void __attribute__((noinline)) print(char c) {
  while (!(UCSR0A & 1 << UDRE0)) {
  }
  UDR0 = c;
}
static uint8_t __attribute__((noinline)) squared(uint8_t x) {
  uint8_t y = x * x;
  shown = y; /* line 13 */
  return y;
}
int main(void) {
  UBRR0 = 16;
  UCSR0A = 1 << U2X0;
  UCSR0B = 1 << TXEN0;
  DDRB = 1 << PB5;
  for (uint8_t i = 0;; i++) {
    PINB = 1 << PB5;
    state.level = squared(i & 7); /* line 23 */
    state.rounds++;
    print('a' + (i & 7));
  }
}
"""


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(SOURCE, tmp_path_factory.mktemp("gdb") / "rounds.elf", "-Og")


def opened(image: Path, *, gdb: int | None, realtime: bool = False) -> SimSession:
    asked = BoardRequest(robot=load_robot("shieldbot"), arena="empty", image=str(image), realtime=realtime)
    session = open_on(AVR, replace(asked, gdb=gdb))
    session.transport.follow()
    return session


class Run:
    """A session in another thread, for 30 ms."""

    def __init__(self, session: SimSession, seconds: float = 0.03) -> None:
        self.session, self.seconds = session, seconds
        self.heard: list[tuple[float, bytes]] = []
        self.error: BaseException | None = None
        self.thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        try:
            self.heard = self.session.transport.read_stamped(self.seconds, self.seconds)
        except BoardError as error:
            self.error = error

    @property
    def traces(self) -> tuple[object, ...]:
        """All that a run leaves."""
        return self.heard, self.session.sim.hash(), self.session.counters(), self.session.board.pin_log().tolist()


@contextmanager
def running(image: Path, seconds: float = 0.03, *, realtime: bool = False) -> Iterator[tuple[Run, int]]:
    """A run that waits for a debugger, and its port."""
    session = opened(image, gdb=0, realtime=realtime)
    run = Run(session, seconds)
    gdb = session.robot.board.debugger
    assert isinstance(gdb, Gdb)
    run.thread.start()
    try:
        yield run, gdb.port
    finally:
        gdb.close()
        run.thread.join(10)
        session.close()


def debugged(image: Path, port: int, *commands: str) -> str:
    """What avr-gdb says to these commands."""
    texts = ["set pagination off", f"target remote :{port}", *commands]
    call = ["avr-gdb", "--batch", "-nx", *(part for text in texts for part in ("-ex", text)), str(image)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=30, check=False)
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def alone(image: Path) -> Run:
    run = Run(opened(image, gdb=None))
    run._run()
    return run


def test_break_step_print_watch(image: Path, alone: Run) -> None:
    """And the run is the one without a debugger, bit for bit."""
    with running(image) as (run, port):
        said = debugged(
            image,
            port,
            *("break squared", "continue", "print x", "backtrace", "continue", "print x", "next", "print y", "finish"),
            *("delete", "next", "print state", "watch state.rounds", "continue", "continue", "delete"),
            *("rwatch state.rounds", "continue", "delete", "awatch shown", "continue", "delete"),
            *("break rounds.c:23", "continue", "step", "info frame", "stepi"),
            *("x/2xb 0x800900", "x/4xb 0", "x/2xb 0x810000", "print/x $SREG & 0", "print $SP"),
            *("print DDRB", "x/xb 0x800024", "delete", "detach"),
        )
        run.thread.join(10)
        assert run.traces == alone.traces
        assert not run.session.notes()
    found = iter(said.splitlines())
    for expected in (
        r"0x00000000 in __vectors \(\)",
        r"Breakpoint 1, squared \(x=.*0 .*\) at .*rounds.c:1[23]",
        r"\$1 = 0 .*",
        r"#0 .*squared \(x=.*",
        r"#1 .*in main \(\) at .*rounds.c:23",
        r"Breakpoint 1, squared \(x=.*1 .*",
        r"\$2 = 1 .*",
        r"13\s+shown = y.*",
        r"\$3 = 1 .*",
        r"Value returned is \$4 = 1 .*",
        r"24\s+state.rounds.*",
        r"\$5 = \{rounds = 4, level = 1 .*\}",
        r"Old value = 4",
        r"New value = 5",
        r"Old value = 5",
        r"New value = 6",
        r"Hardware read watchpoint 3: state.rounds",
        r"Value = 6",
        r"Hardware access \(read/write\) watchpoint 4: shown",
        r"(Old value|Value) = .*",
        r"Breakpoint 5, main \(\) at .*rounds.c:23",
        r"squared \(x=.*",
        r"Stack level 0, frame at .*",
    ):
        assert any(re.fullmatch(expected, line) for line in found), f"{expected} is not in:\n{said}"
    assert "Cannot access memory at address 0x800900" in said


def test_memory_and_reset(image: Path) -> None:
    """Beyond the memories is an error; what the debugger changes is noted."""
    session = opened(image, gdb=0)
    gdb = session.robot.board.debugger
    assert isinstance(gdb, Gdb)
    run = Run(session)
    run.thread.start()
    said = debugged(
        image,
        gdb.port,
        *("x/4xb 0", "x/2xb 0x8103FE", "set var {char}0x810001 = 7", "tbreak main", "continue", "next", "next"),
        *("print state.rounds", "set var state.rounds = 300", "print state.rounds", "monitor reset", "monitor jump"),
        *("maintenance flush register-cache", "print/x $pc", "tbreak squared", "continue", "print state.rounds"),
        *("x/xb 0x800908", "kill"),
    )
    run.thread.join(10)
    flash = image.read_bytes()
    assert b"\x0c\x94" in flash and "0x0 <__vectors>:\t0x0c\t0x94" in said
    assert re.findall(r"\$\d+ = (.*)", said) == ["3", "300", "0x0", "3"]  # the start-up code sets it anew
    assert "no command 'jump'; expected one of: init" in said
    assert "Cannot access memory at address 0x800908" in said
    assert session.board.read_eeprom()[:3] == b"\xff\x07\xff"
    assert str(run.error) == "the debugger has ended the run"
    assert ["is changed by the debugger" in note for note in session.notes()] == [True]
    session.close()


# ---- clients that are no gdb, or vanish ----


def packet(text: str) -> bytes:
    return f"${text}#{sum(text.encode()) % 256:02x}".encode()


def ask(client: socket.socket, text: str) -> str:
    """The answer to a packet; both are acknowledged."""
    client.sendall(packet(text))
    return hear(client)


def hear(client: socket.socket) -> str:
    data = b""
    while not (found := re.search(rb"\$([^#]*)#..", data)):
        more = client.recv(4096)
        assert more
        data += more
    client.sendall(b"+")
    return found[1].decode()


def is_sent_away(client: socket.socket) -> bool:
    try:
        return client.recv(100) == b""
    except ConnectionResetError:
        return True


def connected(port: int) -> socket.socket:
    client = socket.create_connection(("127.0.0.1", port), timeout=5)
    client.sendall(b"+")
    return client


def test_a_program_that_runs_is_interrupted(image: Path) -> None:
    with running(image, 1000.0) as (run, port), connected(port) as client:
        assert ask(client, "?") == "S02"
        client.sendall(packet("c"))
        time.sleep(0.1)
        client.sendall(b"\3")
        assert hear(client) == "S02"
        cycle = run.session.sim.cycle
        time.sleep(0.05)
        assert cycle == run.session.sim.cycle > 0
        client.sendall(packet("k"))
        run.thread.join(10)
        assert str(run.error) == "the debugger has ended the run"


def test_a_client_that_vanishes_leaves_the_program_to_itself(image: Path, alone: Run) -> None:
    """With its breakpoints gone; a second client is refused while one is there, and welcome after it."""
    with running(image) as (run, port):
        with connected(port) as client:
            assert ask(client, "?") == "S02"
            assert ask(client, "Z0,0,2") == ask(client, "Z2,800100,800") == "OK"
            with connected(port) as second:
                assert is_sent_away(second)
        run.thread.join(10)
        assert run.traces == alone.traces


def test_closed_while_the_program_is_halted(image: Path, alone: Run) -> None:
    """By another thread: the program goes on."""
    with running(image) as (run, port), connected(port) as client:
        assert ask(client, "?") == "S02"
        debugger = run.session.robot.board.debugger
        assert debugger is not None
        debugger.close()
        run.thread.join(10)
        assert run.traces == alone.traces


def test_a_browser_is_sent_away(image: Path) -> None:
    with running(image) as (run, port):
        with socket.create_connection(("127.0.0.1", port), timeout=5) as client:
            client.sendall(b"POST / HTTP/1.1\r\n\r\n" + packet("M800100,1:55"))
            assert is_sent_away(client)
        run.thread.join(10)
        assert run.error is None and not run.session.notes()


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        *(("m800000,", "E01"), ("m900000,1", "E01"), ("mzz,1", "E01"), ("M800100,1", "E01"), ("M800900,1:55", "E01")),
        *(("Z0,8000,2", "E01"), ("Z2,800010,1", "E01"), ("Z9,0,2", "E01"), ("Z", "E01"), ("G0", "E01"), ("", "")),
        *(("qRcmd,7", "E01"), ("vCont?", ""), ("x", ""), ("m8008ff,2", "E01"), ("qAttached", "1"), ("Hg0", "OK")),
        *(("cxyz", "E01"), ("m800101,ffffffff", "E01")),
    ],
)
def test_bad_packets_have_an_answer(hold: Callable[[str], str], text: str, answer: str) -> None:
    assert hold(text) == answer


@pytest.fixture(scope="module")
def hold(image: Path) -> Iterator[Callable[[str], str]]:
    with running(image) as (_, port), connected(port) as client:
        yield lambda text: ask(client, text)


def test_a_packet_that_is_damaged_is_asked_for_again(image: Path) -> None:
    with running(image) as (_, port), connected(port) as client:
        client.sendall(b"$?#00")
        assert client.recv(1) == b"-"
        assert ask(client, "?") == "S02"


def test_a_crash_can_be_looked_at(image: Path, tmp_path: Path) -> None:
    """And ends the run when the debugger lets it go on."""
    wild = compiled("int main(void) { ((void (*)(void))0x3F00)(); }", tmp_path / "wild.elf", "-O0")
    with running(wild) as (run, port), connected(port) as client:
        client.sendall(packet("c"))
        assert hear(client) == "S0B"
        client.sendall(packet("c"))
        run.thread.join(10)
        assert "the program goes to 0x7E00" in str(run.error)


# ---- the world ----


def test_a_paced_world_does_not_catch_up(image: Path) -> None:
    with running(image, 0.02, realtime=True) as (run, port), connected(port) as client:
        pace = Pace(run.session.sim)
        time.sleep(0.2)
        client.sendall(packet("D"))
        run.thread.join(10)
        assert pace.due() / 16e6 < 0.15


def test_only_the_emulated_chip_has_a_debugger() -> None:
    with pytest.raises(CallError, match="a debugger looks into the emulated ATmega328P"):
        open_on(NATIVE, BoardRequest(robot=load_robot("shieldbot"), arena="empty", gdb=0))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(BoardError, match=f"^TCP port {port} cannot be opened: it is in use"):
            open_on(AVR, BoardRequest(robot=load_robot("shieldbot"), arena="empty", gdb=port))
