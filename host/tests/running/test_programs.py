"""Any program for the Uno drives the emulated robot: its text, what is typed, how its run ends and is repeated."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import pytest
from live.test_live_view import Page, Run
from typer.testing import CliRunner

import boebot
from boebot.boards import BoardRequest, open_board
from boebot.cli.app import app
from boebot.description.robots import load_robot
from boebot.errors import BoardError, BoebotError, CallError
from boebot.record.interventions import Deed, Typed
from boebot.record.run_folder import locked
from boebot.result import RunResult, read_run
from boebot.running.again import again as repeat
from boebot.running.again import recorded
from boebot.running.hands import Onlooker
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot.view.replay import content
from sim_bridge.tests.boards.avr.avr_program import compiled

# Prints "ready", then what it was told in capitals; "!" makes it go wild, "s" turns the left servo for a second.
SOURCE = """
#include <avr/io.h>
#include <util/delay.h>
static void put(char byte) { while (!(UCSR0A & 1 << UDRE0)) {} UDR0 = byte; }
static void wild(void) { ((void (*)(void))0x3F00)(); }
int main(void) {
  UBRR0 = 16000000 / 16 / BAUD - 1;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
  DDRB = 1 << 5;
#ifdef RATES
  for (const char *c = "slow "; *c; c++) put(*c);
  UCSR0A |= 1 << TXC0;
  while (!(UCSR0A & 1 << TXC0)) {}
  UBRR0 = 0;
  for (const char *c = "fast "; *c; c++) put(*c);
#else
  for (const char *c = "ready\\r\\n"; *c; c++) put(*c);
#endif
  for (;;) {
    while (!(UCSR0A & 1 << RXC0)) {}
    char byte = UDR0;
    if (byte == '!') wild();
    for (int i = 0; byte == 's' && i < 50; i++) {
      PORTB = 1 << 5;
      _delay_us(1700);
      PORTB = 0;
      _delay_ms(18.3);
    }
    put(byte >= 'a' && byte <= 'z' ? byte - 32 : byte);
  }
}
"""


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Builds the program at a bit rate: an ELF file, and beside it a HEX file."""

    def built(baud: int, *more: str) -> Path:
        elf = compiled(SOURCE, tmp_path_factory.mktemp("program") / "talk.elf", f"-DBAUD={baud}L", *more)
        subprocess.run(["avr-objcopy", "-O", "ihex", elf, elf.with_suffix(".hex")], check=True)
        return elf

    return built


@pytest.fixture(scope="module")
def program(build: Callable[..., Path]) -> Path:
    return build(9600)


def command(*arguments: object, typed: str = "") -> subprocess.CompletedProcess[str]:
    """The command, with that on its standard input."""
    words = [sys.executable, "-m", "boebot", *map(str, arguments)]
    return subprocess.run(words, input=typed, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("baud", [2400, 38400])
def test_the_monitor_has_the_rate_of_the_program(build: Callable[..., Path], baud: int, tmp_path: Path) -> None:
    run = boebot.run(build(baud), seconds=0.1, out=tmp_path)
    rows = run.record.rows("to_host")
    assert b"".join(data for _, data in rows) == b"ready\r\n"
    bit_s = (16_000_000 // 16 // baud) / 1e6  # as UBRR0 gives it
    times = [time for time, _ in rows]
    assert times[1] - times[0] == pytest.approx(10 * bit_s, rel=1e-3)


@pytest.mark.parametrize(
    ("options", "code", "sentence"),
    [
        (("--expect-text", "ready"), 0, ""),
        (("--timeout", "100"), 0, ""),
        (
            ("--expect-text", "no such", "--timeout", "100"),
            42,
            "did not print what was expected, 'no such', within",
        ),
        (("--expect-text", "no such", "--timeout", "100", "--timeout-exit-code", "7"), 7, "did not print"),
        (("--fail-text", "ead"), 1, "the program printed 'ead'; expected that it does not"),
        (("--timeout", "0"), 2, "--timeout"),
        (("--timeout", "100", "--seconds", "1"), 2, "--seconds and --timeout both say how long the run is"),
        (("--on", "native"), 2, "a program runs on the emulated ATmega328P, 'avr'; got 'native'"),
        (("--on", "/dev/ttyACM0"), 2, "a program runs on the emulated ATmega328P, 'avr'; got '/dev/ttyACM0'"),
        (("--robot", "roller"), 2, "talk.hex is a program for a board, and robot 'roller' has none"),
    ],
)
def test_exit_codes_say_what_was_printed(program: Path, options: tuple[str, ...], code: int, sentence: str) -> None:
    done = command("run", program.with_suffix(".hex"), *options)
    assert (done.returncode, sentence in done.stderr) == (code, True)
    assert code == 2 or re.search(r"0\.00\d\d  ready\n", done.stdout)


def printed(result: RunResult) -> bytes:
    return b"".join(data for _, data in result.record.rows("to_host"))


class Typing(Onlooker):
    """Types those texts, each once the run is that old (s)."""

    def __init__(self, **texts: str) -> None:
        self.texts = {float(time.removeprefix("at_").replace("_", ".")): text for time, text in texts.items()}

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        for due_s in [due_s for due_s in self.texts if due_s <= time_s + 1e-9]:
            yield Typed(self.texts.pop(due_s))


def run(program: Path, folder: Path, seconds: float, typed: Typing) -> RunResult:
    request = Request.single(brain=program, arena="empty", seconds=seconds, without=["slip"])
    with locked(folder) as kept:
        result: RunResult = execute(request, None, kept, typed)
    return result


def test_what_is_typed_reaches_the_program_and_its_run_is_repeated_bit_by_bit(program: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copy(program, tmp_path))
    result = run(copy, tmp_path / "run", 0.3, Typing(at_0="w", at_0_1="hello"))  # "w" waits until the program listens
    assert printed(result) == b"ready\r\nWHELLO"
    assert result.error is None and result.touched == 2
    copy.unlink()  # the record has it
    again = command("replay", tmp_path / "run", "--again")
    assert again.returncode == 0 and "bit-equal" in again.stdout, again.stderr
    read = read_run(tmp_path / "run").robots[0]
    assert (read.program, read.hash) == (result.program, result.hash)
    kept = recorded(tmp_path / "run")
    other = {"brain/talk.elf": kept.attached["brain/talk.elf"][:-1] + b"x"}  # in its symbols: it would run the same way
    with pytest.raises(BoebotError, match=f"brain/talk.elf has SHA-256 .*; expected {result.program}"):
        repeat(replace(kept, attached=other))


def test_a_script_types_and_is_no_person(program: Path, tmp_path: Path) -> None:
    typed = ("--type", r"h\x69@0.2", "--type", "ok@100ms", "--expect-text", "OKHI")
    done = command("run", program, "--out", tmp_path, "--json", *typed, "--seconds", "1")
    assert json.loads(done.stdout)["touched"] == 0 and json.loads(done.stdout)["steps"] is None
    assert re.search(r"0\.00\d\d  ready\n", done.stderr)  # standard output is left to the answer
    assert repeat(recorded(tmp_path)).is_equal
    assert CliRunner().invoke(app, ["run", str(program), "-q", "--seconds", "0.1"]).stdout == ""


def test_a_reader_that_goes_ends_the_run_and_its_record_is_whole(program: Path, tmp_path: Path) -> None:
    call = f"{sys.executable} -m boebot run {program} --seconds 60 --out {tmp_path} | true"
    subprocess.run(call, shell=True, check=True)
    result = read_run(tmp_path).robots[0]
    assert (
        str(result.error) == "what the program prints cannot be shown: Broken pipe" and printed(result) == b"ready\r\n"
    )


def test_standard_input_and_a_script_type_beside_each_other(program: Path) -> None:
    done = command("run", program, "--seconds", "0.3", "--type", "on@0.2", typed="go")  # more is lost while it prints
    assert re.search("ready\n.*GOON\n", done.stdout), done.stdout


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("--period 0.1", "--period is of a brain; talk.elf is a program, which has none"),
        ("--set a.b=1", "--set is of a brain"),
        ("--step-timeout 1", "--step-timeout is of a brain"),
        ("--force-timing", "--force-timing is of a brain"),
        ("--robots 2 --expect-text x", "--expect-text goes to the one program of a run; there are 2 in this one"),
        ("--type x", "--type 'x' cannot be typed: there is no @; expected TEXT@TIME"),
        (r"--type \x@1", "cannot be typed: 'unicodeescape'"),
        ("--type x@-1", "'x' at -1 s is never; expected a time from 0 s on"),
        ("--type x@2 --seconds 1", "'x' at 2 s is never; expected a time from 0 s on, and before the run's end at 1 s"),
        ("--expect-text=", "--expect-text or --fail-text is empty; expected a text"),
        ("--fault host.slow@1", "host.slow=0.1@1s is of a brain's link; talk.elf is a program, which has no host"),
        ("--fault serial.rate@1", "talk.elf is a program, which has the bit rate that it sets"),
    ],
)
def test_what_a_program_cannot_have_is_refused(program: Path, options: str, sentence: str) -> None:
    refused = CliRunner().invoke(app, ["run", str(program), *options.split()])
    assert isinstance(refused.exception, CallError) and sentence in str(refused.exception)


def test_what_is_on_a_programs_line_may_be_lost_late_or_twice(program: Path) -> None:
    def heard(*faults: str) -> bytes:
        return printed(boebot.run(program, seconds=0.4, typed=[("ab", 0.2)], faults=list(faults)))

    assert heard() == b"ready\r\nAB"
    assert heard("serial.doubled=1@0..0.1") == b"rreeaaddyy\r\r\n\nAB"
    assert heard("cable.out@0.1..0.3") == b"ready\r\n"
    late = boebot.run(program, seconds=0.4, typed=[("ab", 0.2)], faults=["serial.delayed=0.05@0.1..0.3"])
    (first, _), *_ = [row for row in late.record.rows("to_host") if row[1] == b"A"]
    assert first == pytest.approx(0.2 + 2 * 0.05 + 2 * 10 / 9600, abs=0.01)


def test_a_program_has_no_commands_to_replay(program: Path, tmp_path: Path) -> None:
    run(program, tmp_path, 0.1, Typing())
    done = command("replay", tmp_path, "--brain", "wander")
    assert (done.returncode, "a program that sensed for itself; expected --again" in done.stderr) == (2, True)


def test_an_outside_that_follows_reads_each_frame_at_its_own_rate(build: Callable[..., Path]) -> None:
    assert printed(boebot.run(build(1200, "-DRATES"), seconds=0.2, typed=[("go", 0.1)])) == b"slow fast GO"


def test_page_and_script_type_in_one_run_and_the_page_has_its_pins(program: Path) -> None:
    run = Run("run", str(program), "--view", "--seconds", "inf", "--type", "file\n@0.1")
    try:
        with run.stream() as stream:
            page = Page(stream)
            begun = page.until("run")
            assert "type" in begun["live"]["can"] and begun["live"]["robots"][0]["pins"][1] == "1 uart"
            page.do("typed", text="page\n")
            page.until("chunk", where=lambda chunk: "PAGE" in chunk["printed"])
            state = page.state(lambda state: state["touched"] == 1 and state["robots"][0]["pins"])
            assert state["robots"][0]["pins"][1][:2] == [1, 1]  # an output, and high: its line rests
            page.do("stop")
            refused = page.until("refused")["sentence"]
            assert refused.startswith("a program drives this robot, no brain")
    finally:
        run.process.send_signal(signal.SIGINT)
        code, printed, error = run.end()
    assert (code, "Traceback" in error) == (130, False)
    assert re.search(r"  FILE\n", printed) and re.search(r"  PAGE\n", printed), printed


def test_its_pulses_turn_the_wheel_on_that_pin(program: Path, tmp_path: Path) -> None:
    """The left servo alone goes forward for a second: the robot turns right about its right wheel."""
    result = run(program, tmp_path, 2.0, Typing(at_0_1="s"))
    assert result.truth is not None
    angle = result.truth.heading[-1] - result.truth.heading[0]
    assert angle < -0.5
    assert result.true_distance == pytest.approx(-angle * 0.105 / 2, rel=0.05)


def test_a_program_that_runs_wild_is_one_sentence_with_its_place(program: Path, tmp_path: Path) -> None:
    done = command("run", program, "--seconds", "1", "--realtime", "--out", tmp_path, typed="")
    assert done.returncode == 0
    result = run(program, tmp_path, 1.0, Typing(at_0_1="!"))
    assert isinstance(result.error, BoardError)
    assert re.search(r"crashed at 0\.1\d\d s: .* goes to 0x7E00, but ends at 0x", str(result.error))
    assert result.run_time == pytest.approx(0.1, abs=0.02)
    read = read_run(tmp_path).robots[0]
    assert str(read.error) == str(result.error)


def test_elf_and_hex_do_the_same(program: Path) -> None:
    copy = shutil.copy(program.with_suffix(".hex"), program.with_name("TALK2.HEX"))
    one, other = (boebot.run(path, seconds=0.2) for path in (program, copy))
    assert one.hash == other.hash and one.program != other.program


def test_brain_and_program_share_a_world(program: Path) -> None:
    results = boebot.run_together([boebot.Member(brain=program), boebot.Member(brain="wander")], "room", 1.0, on="avr")
    program_run, brain_run = results.robots
    assert program_run.program and program_run.record.count("to_host") == 7
    assert brain_run.program is None and brain_run.steps > 10


def test_csv_has_no_columns_of_what_the_host_does_not_know(program: Path, tmp_path: Path) -> None:
    result = boebot.run(program, seconds=0.1, out=tmp_path)
    (shown,) = content([result])["runs"]
    assert shown["program"] and [line for _, line in shown["rows"]["printed"]] == ["ready"]
    assert shown["rows"]["printed"][0][0] == pytest.approx(0.001, abs=1e-3)
    assert command("report", tmp_path, "--as", "csv").returncode == 0
    heading = (tmp_path / "run.csv").read_text().splitlines()[0].split(",")
    truth = ["true_x_m", "true_y_m", "true_heading_rad", "true_contact"]
    seen = (
        "encoder_left_count encoder_right_count whisker_left_pressed whisker_right_pressed ping_distance_m ping_age_s"
    )
    parts = [*seen.split(), "L_brightness", "L_lit"]
    assert heading == ["time_s", "tick", *parts, *truth], "parts show themselves, and the board its LED"
    assert (tmp_path / "to_host.bin").read_bytes() == b"ready\r\n"
    summary = json.loads((tmp_path / "summary.json").read_text())
    unknown = "steps", "period_s", "ticks", "late_steps", "resets", "lost_frames", "whisker_touches", "odometry_source"
    assert {summary[name] for name in unknown} == {None}
    assert summary["program_hash"] == hashlib.sha256(program.read_bytes()).hexdigest()


def test_a_robot_of_programs_is_driven_by_them_alone(program: Path, tmp_path: Path) -> None:
    """Its left servo is on a pin on which the kit's firmware has none, and nothing is joined to its uart."""
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'extends = "shieldbot"\nname = "mine"\nfirmware = "none"\nremove = ["uart"]\n'
        "[device.servo_left]\npin = 4\n[device.buzzer]\npin = 13"
    )
    result = boebot.run(program, robot=mine, arena="empty", seconds=0.2, expect_text="ready")
    assert result.robot.name == "mine"
    refused = "robot 'mine' has no firmware of the kit, .*; expected .*: boebot run FILE --robot mine"
    with pytest.raises(CallError, match=refused):
        boebot.run("wander", robot=mine)
    for board in ("native", "avr", "/dev/null"):
        with pytest.raises(CallError, match=refused):
            open_board(board, BoardRequest(robot=load_robot(mine)))
    for words in (["doctor", "avr"], ["timing"], ["serve", "--tcp", "0"]):
        done = command(*words, "--robot", mine)
        assert (done.returncode, done.stdout) == (2, ""), done.stderr
        assert re.search(refused, " ".join(done.stderr.split()))
