"""The plugin as a user has it: pytest runs files of tests in a folder that is not the kit's."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import google.protobuf.descriptor_pb2  # noqa: F401 (first within a run of pytester it would be there twice)
import pytest

from boebot.result import RunResult, read_run
from sim_bridge.tests.boards.avr.avr_program import compiled

pytest_plugins = ["pytester"]
pytestmark = pytest.mark.unsanitized  # runs of pytest, some of them in processes: their C is that of the other benches

SERVO = """
/* Pulses of 1500 us every 20 ms on pin 9 (OC1A, fast PWM, data sheet 16.9.3), "ready" at 9600 bit/s; '+' and '-' make
   them 200 us longer, shorter, and are sent back. */
#include <avr/io.h>
static void put(char letter) {
  while (!(UCSR0A & 1 << UDRE0)) {
  }
  UDR0 = letter;
}
int main(void) {
  DDRB = 1 << 1;
  TCCR1A = 1 << COM1A1 | 1 << WGM11;
  TCCR1B = 1 << WGM13 | 1 << WGM12 | 1 << CS11;
  ICR1 = 39999;
  OCR1A = 2999;
  UBRR0 = 103;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
  for (const char *text = "ready\\r\\n"; *text; text++) put(*text);
  for (;;) {
    if (!(UCSR0A & 1 << RXC0)) continue;
    char letter = UDR0;
    if (letter == '+') OCR1A += 400;
    if (letter == '-') OCR1A -= 400;
    put(letter);
  }
}
"""


@pytest.fixture(scope="session")
def servo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(SERVO, tmp_path_factory.mktemp("servo") / "own.elf")


@pytest.fixture
def users(pytester: pytest.Pytester, servo: Path) -> pytest.Pytester:
    """A user's folder with own.elf in it."""
    shutil.copy(servo, pytester.path)
    return pytester


def run(users: pytest.Pytester, tests: str, *options: str) -> pytest.RunResult:
    users.makepyfile("import pytest\n\n" + tests)
    return users.runpytest_inprocess("-p", "no:randomly", *options)


def test_bytes_go_and_come_and_a_failure_leaves_its_files(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf")
def test_answers(uno):
    uno.serial.expect(b"ready", within=1)
    uno.serial.send(b"+")
    assert uno.serial.expect(b"+", within=0.01)
    assert 0.0083 < uno.now < 0.0094  # eight bytes of 1.04 ms

@pytest.mark.uno(image="own.elf")
def test_waits_in_vain(uno):
    uno.serial.expect(b"steady", within=0.1)
""",
    )
    result.assert_outcomes(passed=1, failed=1)
    text = result.stdout.str()
    assert "WaitError: waited 0.1 s for b'steady' from the board: saw b'ready\\r\\n'" in text
    assert "bench/serial.py" not in text  # it ends at the user's own line
    (kept,) = (users.path / ".uno").iterdir()
    assert (kept / "again.txt").read_text() in text and f"kept in .uno/{kept.name}" in text
    assert (kept / "serial.txt").read_bytes() == b"ready\r\n"
    vcd = (kept / "pins.vcd").read_text()
    assert "D9" in vcd and "#" in vcd and not (kept / "run").exists()


def test_a_failure_in_a_world_leaves_a_record(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf", robot="shieldbot-basic", arena="room")
def test_it(uno):
    uno.run(0.2)
    assert False

@pytest.mark.uno(robot="shieldbot-basic", arena="room")
def test_firmware(uno):
    uno.run(0.2)
    assert False
""",
        *("--uno-on=avr", "--uno-on=native"),
    )
    result.assert_outcomes(failed=3, skipped=1)
    kept = [*(users.path / ".uno").iterdir()]
    assert len(kept) == 3 and "without " not in result.stdout.str()
    for folder in kept:
        assert f"again: {(folder / 'again.txt').read_text()}" in result.stdout.str()
        read = read_run(folder / "run")
        assert isinstance(read, RunResult) and read.record.count("readings") == 20
        assert len(read.record.block("truth")) > 15
        assert read.run_time == pytest.approx(0.2) and read.record.count("pins") > 0


def test_a_chip_and_a_fixture_that_fail_show_the_users_lines_and_leave_files(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
from sim_bridge.bench.buses import SpiDevice

class Chip(SpiDevice):
    select = 9  # where the pulses are

    def begin(self):
        assert False, "selected"

@pytest.mark.uno(image="own.elf")
def test_chip(uno):
    uno.spi.add(Chip())
    uno.run(0.1)

@pytest.fixture
def parked(uno):
    yield
    uno.serial.expect(b"parked", within=0.1)

@pytest.mark.uno(image="own.elf")
def test_parks(parked):
    pass
""",
    )
    result.assert_outcomes(passed=1, failed=1, errors=1)
    text = result.stdout.str()
    assert "AssertionError: selected" in text and "waited 0.1 s for b'parked'" in text
    assert "sim_bridge/" not in text.replace("rootdir", "") and "raised in repr" not in text
    assert text.count("again: pytest") == len([*users.path.glob(".uno/*/pins.vcd")]) == 2


def test_what_cannot_be_kept_leaves_the_rest(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf")
def test_it(uno, monkeypatch):
    def full(path):
        raise OSError("no space left on device")
    uno.save_pins = full
    assert False
""",
    )
    result.stdout.fnmatch_lines(["kept in .uno/*", "again: pytest *::test_it", "without pins.vcd: no space left *"])
    assert {file.name for file in users.path.glob(".uno/*/*")} == {"again.txt", "serial.txt"}


def test_what_is_measured_is_in_all_reports(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf")
@pytest.mark.parametrize(("value", "marginal"), [(1700, 2), (1709, 2), (1711, 0)])
def test_width(uno, value, marginal):
    uno.measure("width", value, "us", low=1690, high=1710, marginal=marginal)

@pytest.fixture
def late(uno):
    yield
    uno.measure("late", 5, "V", high=1)

@pytest.mark.uno(image="own.elf")
def test_late(late):
    pass

@pytest.mark.uno(image="own.elf")
@pytest.mark.parametrize("name", ["", "a\\nb", "a\\0b", 3])
def test_names(uno, name):
    with pytest.raises(Exception, match="measure: the name is .*; expected a text of one line"):
        uno.measure(name, 1)
""",
        "--junitxml=found.xml",
    )
    result.assert_outcomes(passed=7, failed=1, errors=1)
    lines = ["uno: late is 5 V; expected <= 1 V", "kept in .uno/*", "again: pytest *::test_late"]
    lines += ["width is 1711 us; expected 1690 to 1710 us", "  marginal  width is 1709 us; *"]
    result.stdout.fnmatch_lines(lines)
    measured = json.loads((users.path / ".uno" / "measured.json").read_text())
    verdicts = [row["verdict"] for rows in measured.values() for row in rows]
    assert verdicts == ["pass", "marginal", "fail", "fail"]
    properties = ElementTree.parse(users.path / "found.xml").findall(".//property")
    assert [json.loads(one.attrib["value"]) for one in properties] == [
        row for rows in measured.values() for row in rows
    ]
    users.runpytest_inprocess("-p", "no:randomly", "-k", "test_names").assert_outcomes(passed=4, deselected=4)
    assert not (users.path / ".uno" / "measured.json").exists()


def test_what_a_board_cannot_do_is_skipped_with_its_reason(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf")
def test_foreign(uno):
    pass

@pytest.mark.uno(robot="shieldbot", arena="room")
def test_robot(uno):
    uno.run(0.1)
    assert uno.world.contacts == 0
""",
        "--uno-on=native",
        "--uno-on=avr",
    )
    result.assert_outcomes(passed=3, skipped=1)
    result.stdout.fnmatch_lines(["1 x the native board is the kit's own firmware; it cannot run own.elf"])


BAD_MARKS = {
    "": "there is nothing to test; expected image= or robot= in @pytest.mark.uno(...), or both",
    "image='no.elf'": "there is no no.elf, neither in * nor in *",
    "image='text.elf'": "*text.elf*",
    "imgae='own.elf'": "*uno(imgae=...): expected one of image, robot, *; did you mean 'image'?",
    "'own.elf'": "*uno('own.elf'): expected a keyword, such as image='own.elf'",
    "robot=['shieldbot']": "robot=['shieldbot']; expected its name or its .toml file",
    "robot='shieldbotx'": "*shieldbotx*did you mean*",
    "image='own.elf', faults=3": "*uno(faults=3): expected a text, or several",
    "image='own.elf', cycles=['']": "*uno(cycles=['']): expected a text, or several",
    "robot='shieldbot', baud=0": "line_rate: the rate is 0; expected *",
}


def test_a_bad_mark_is_one_sentence(users: pytest.Pytester) -> None:
    users.path.joinpath("text.elf").write_text("no program")
    tests = [f"class Test{i}:\n    @pytest.mark.uno({mark})\n    def test_it(self, uno):\n        pass\n"
             for i, mark in enumerate(BAD_MARKS)]  # fmt: skip
    tests.append("@pytest.mark.uno(image='own.elf')\ndef test_without():\n    pass\n")
    result = run(users, "\n".join(tests))
    result.assert_outcomes(errors=len(BAD_MARKS), failed=1)
    result.stdout.fnmatch_lines([f"uno: {sentence.replace('[', '[[]')}" for sentence in BAD_MARKS.values()])
    result.stdout.fnmatch_lines(["uno: test_without has the mark, and no board; expected the fixture: *"])
    assert "Traceback" not in result.stdout.str() and "sim_bridge" not in result.stdout.str()


def test_nothing_is_imported_before_the_fixture_is_used() -> None:
    code = "import sys, sim_bridge.bench.plugin; print([name for name in sys.modules if name in ('numpy', 'boebot')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


# ---- pins, variables, cycles, coverage, faults -----------------------------------------------------------------------

WORK = r"""
#include <avr/io.h>
volatile int count;
static void put(char letter) {
  while (!(UCSR0A & 1 << UDRE0)) {
  }
  UDR0 = letter;
}
/* Four cycles a turn (SBIW 2, BRNE 2, the last one 1 less): instruction set manual. */
__attribute__((noinline)) void work(void) {
  __asm__ volatile("ldi r24, lo8(TURNS)\n ldi r25, hi8(TURNS)\n 1: sbiw r24, 1\n brne 1b" : : : "r24", "r25");
}
int main(void) {
  UBRR0 = 103;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
  put('>');
  for (;;) {
    if (!(UCSR0A & 1 << RXC0)) continue;
    if (UDR0 == 'a') {
      work();
      count++;
    }
    put('.');
  }
}
"""
TURNS = 100
WORK_CYCLES = 2 + 4 * TURNS - 1 + 4  # LDI twice, the turns, RET


def worker(folder: Path, turns: int = TURNS) -> Path:
    return compiled(WORK.replace("TURNS", str(turns)), folder / "work.elf")


def test_the_example_of_the_docs(users: pytest.Pytester) -> None:
    subprocess.run(["avr-objcopy", "-O", "ihex", "own.elf", "own.hex"], cwd=users.path, check=True)
    of = """
@pytest.mark.uno(image="own.SUFFIX")
def test_servo_SUFFIX(uno):
    uno.serial.expect(b"ready", within=1)
    uno.serial.send(b"+")
    uno.serial.expect(b"+", within=0.01)
    assert uno.pin(9).pulse().us == 1700
"""
    bad = """
@pytest.mark.uno(image="own.hex")
def test_no_pin(uno):
    uno.pin(20)

@pytest.mark.uno(image="own.hex")
def test_no_symbols(uno):
    uno.symbol("count")
"""
    result = run(users, of.replace("SUFFIX", "elf") + of.replace("SUFFIX", "hex") + bad)
    result.assert_outcomes(passed=2, failed=2)
    result.stdout.fnmatch_lines_random([
        "E * there is no pin 20; expected 0..13 or 'A0'..'A5'",
        "E * own.hex has no symbols; expected the ELF file that it was made from",
    ])  # fmt: skip


def test_a_sketch_is_built_and_tested_in_a_world(users: pytest.Pytester) -> None:
    """The bundled sketch, whose servos turn back where a whisker touches: 1500 us less 200."""
    from boebot.sketches import FOLDER

    shutil.copytree(FOLDER / "whiskers", users.path / "whiskers")
    result = run(
        users,
        """
@pytest.mark.uno(image="whiskers", robot="shieldbot-basic", arena="room")
def test_backs_off(uno):
    uno.pin(13).pulses(3)
    assert abs(uno.pin(13).pulse().us - 1700) < 5
    uno.pin(5).drive(0)
    uno.run(0.1)
    assert abs(uno.pin(13).pulse().us - 1300) < 5
    assert uno.world.pose is not None
""",
    )
    result.assert_outcomes(passed=1)


def test_variables_and_cycles_against_a_baseline(users: pytest.Pytester) -> None:
    worker(users.path)
    tests = """
@pytest.mark.uno(image="work.elf", cycles="work")
def test_work(uno):
    uno.serial.expect(b">")
    uno.symbol("count").value = 41
    uno.serial.send(b"a")
    uno.serial.expect(b".")
    assert uno.symbol("count").value == 42
    assert uno.cycles("work").longest {comparison}

@pytest.mark.uno(image="work.elf", cycles="work")
def test_fails(uno):
    uno.serial.expect(b">")
    uno.serial.send(b"a")
    uno.serial.expect(b"?")
"""
    update = "--uno-baseline=update"
    result = run(users, tests.format(comparison=f"== {WORK_CYCLES}"), update)
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["not written: *::test_fails, which failed"])
    (users.path / "sub").mkdir()
    file = (users.path / "uno-baseline.json").rename(users.path / "sub" / "old.json")
    saved = json.loads(file.read_text())["cycles"]
    assert list(saved.values()) == [{"work": [WORK_CYCLES, WORK_CYCLES]}]
    worker(users.path, TURNS + 1)
    os.chdir(users.path / "sub")
    (users.path / "pytest.ini").write_text("[pytest]")
    users.makepyfile("import pytest\n\n" + tests.format(comparison="> 0"))
    result = users.runpytest_inprocess("-k", "work", "--uno-baseline=old.json", "..")
    result.assert_outcomes(failed=1, deselected=1)
    result.stdout.fnmatch_lines([
        f"work took {WORK_CYCLES + 4} cycles; in *old.json {WORK_CYCLES} cycles",
        f"again: cd {users.path} && pytest --uno-baseline=sub/old.json *::test_work",
    ])  # fmt: skip
    file.rename(users.path / "uno-baseline.json").write_text("{")
    result = users.runpytest_inprocess(update, "..")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: *uno-baseline.json is no baseline of cycles: *; expected a file as an *"])


def test_coverage_from_a_process_of_xdist(users: pytest.Pytester) -> None:
    worker(users.path)
    result = run(
        users,
        """
@pytest.mark.uno(image="work.elf")
@pytest.mark.parametrize("letter", [b"a", b"b"])
def test_work(uno, letter):
    uno.serial.expect(b">")
    uno.serial.send(letter)
    uno.serial.expect(b".")
""",
        *("--uno-cover", "-n", "1"),
    )
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["work.c * 100.0 %*"])
    assert "SF:work.c" in (users.path / ".uno" / "cover.info").read_text()


def test_a_fault_that_did_not_fire_is_an_error_of_its_test(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf", faults="board.reset@10ms")
def test_reset(uno):
    uno.serial.expect(b"ready")
    uno.serial.expect(b"ready")

@pytest.mark.uno(robot="shieldbot", faults="whisker_left.stuck=open@0s")
def test_nothing_touches(uno):
    uno.run(0.1)

@pytest.mark.uno(image="own.elf", faults="ping.missing@0s")
def test_no_ping(uno):
    pass
""",
    )
    result.assert_outcomes(passed=2, errors=2)
    assert [path.parent.name[:30] for path in users.path.glob(".uno/*/run")] == ["test_a_fault_that_did_not_fire"]
    result.stdout.fnmatch_lines_random([
        "uno: fault whisker_left.stuck=open@0s did not fire*",
        "uno: fault 'ping.missing@0s': the board is on no robot; expected one in the mark: robot='shieldbot'",
    ])  # fmt: skip


METER = """
#include <avr/io.h>
int main(void) {
  UBRR0 = 1;
  UCSR0B = 1 << TXEN0;
  ADMUX = 1 << REFS0 | 1 << ADLAR | 2;
  for (;;) {
    ADCSRA = 1 << ADEN | 1 << ADSC | 4;
    while (ADCSRA & 1 << ADSC) {
    }
    while (!(UCSR0A & 1 << UDRE0)) {
    }
    UDR0 = ADCH;
  }
}
"""


def test_a_voltage_is_what_the_converter_reads(users: pytest.Pytester) -> None:
    """256 V / Vref, the left-adjusted upper byte (data sheet 24.7): 2.5 V of 5 V are 128."""
    compiled(METER, users.path / "meter.elf")
    result = run(
        users,
        """
@pytest.mark.uno(image="meter.elf")
def test_meter(uno):
    uno.analog(2).set(2.51)
    uno.serial.expect(bytes([128]) * 3)
    uno.analog(2).set(1.26)
    uno.serial.expect(bytes([64]) * 3)
    with pytest.raises(Exception, match="expected a whole number from 0 to 5"):
        uno.analog(6).set(1)
""",
    )
    result.assert_outcomes(passed=1)
