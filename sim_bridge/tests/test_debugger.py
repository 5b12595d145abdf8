"""A run under avr-gdb leaves the same record as one without it; a debugger where none can be is refused."""

from __future__ import annotations

import socket
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from boebot.cli.app import app
from boebot.result import RunResult
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.tests.boards.avr.avr_program import compiled

pytestmark = pytest.mark.unsanitized

SOURCE = """
#include <avr/io.h>
#include <util/delay.h>
static void say(char byte) { while (!(UCSR0A & 1 << UDRE0)) {} UDR0 = byte; }
int main(void) {
  UBRR0 = 103;
  UCSR0B = 1 << TXEN0;
  DDRB = 1 << 5;
  for (char round = 'a';; round++) {
    PORTB = 1 << 5;
    _delay_us(1700);
    PORTB = 0;
    _delay_ms(18.3);
    say(round);
  }
}
"""


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(SOURCE, tmp_path_factory.mktemp("program") / "turn.elf", "-Og")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return int(taken.getsockname()[1])


def test_the_record_is_that_of_the_run_without(image: Path) -> None:
    """A program, and the kit's firmware under a brain, whose line must not time out."""
    for brain, commands in (
        (str(image), ("tbreak say", "continue", "print byte", "finish", "next", "stepi", "detach")),
        ("wander", ("tbreak *0x100", "stepi", "stepi", "info registers", "tbreak *0", "detach")),
    ):
        results = []
        for port in (None, free_port()):
            script = ["-ex", "set tcp connect-timeout 20", "-ex", f"target remote :{port}"]
            script += [part for command in commands for part in ("-ex", command)]
            gdb = None
            if port is not None:
                gdb = subprocess.Popen(["avr-gdb", "--batch", "-nx", *script, str(image)], stdout=subprocess.PIPE)
            request = Request.single(brain=brain, arena="room", on="avr", seconds=0.5, pins=True, gdb=port)
            result = execute(request, None, None)
            assert isinstance(result, RunResult) and result.error is None
            results.append(result)
            if gdb is not None:
                said = gdb.communicate(timeout=30)[0].decode()
                assert gdb.returncode == 0 and ("$1 = 97 'a'" in said) == (brain != "wander")
        alone, debugged = (one.record for one in results)
        assert alone.streams() == debugged.streams() >= {"pins", "truth"}
        assert alone.digest(*sorted(alone.streams())) == debugged.digest(*sorted(debugged.streams()))


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["wander"], "--gdb is of one robot on the emulated ATmega328P (--on avr); got 'native'"),
        (["wander", "--robots", "2", "--on", "avr"], "(--on avr); got 2 robots"),
        (["wander", "--on", "/dev/ttyACM0"], "(--on avr); got '/dev/ttyACM0'"),
    ],
)
def test_who_cannot_have_a_debugger_is_told_so(words: list[str], why: str) -> None:
    shown = CliRunner().invoke(app, ["run", *words, "--gdb", "4711"])
    assert shown.exit_code == 2 or getattr(shown.exception, "exit_code", 0) == 2
    assert why in shown.output + str(shown.exception)
