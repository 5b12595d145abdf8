"""The plugin as a user has it: pytest runs files of tests in a folder that is not the kit's."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sim_bridge.tests.boards.avr.avr_program import compiled

pytest_plugins = ["pytester"]

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
    assert (kept / "again.txt").read_text() in text and f"kept in {kept}" in text
    assert (kept / "serial.txt").read_bytes() == b"ready\r\n"
    vcd = (kept / "pins.vcd").read_text()
    assert "D9" in vcd and "#" in vcd


def test_what_is_measured_is_in_all_reports(users: pytest.Pytester) -> None:
    result = run(
        users,
        """
@pytest.mark.uno(image="own.elf")
@pytest.mark.parametrize(("value", "marginal"), [(1700, 2), (1709, 2), (1711, 0)])
def test_width(uno, value, marginal):
    uno.measure("width", value, "us", low=1690, high=1710, marginal=marginal)
""",
        "--junitxml=found.xml",
    )
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(["width is 1711 us; expected 1690 to 1710 us", "  marginal  width is 1709 us; *"])
    measured = json.loads((users.path / ".uno" / "measured.json").read_text())
    verdicts = [row["verdict"] for rows in measured.values() for row in rows]
    assert verdicts == ["pass", "marginal", "fail"]
    properties = ElementTree.parse(users.path / "found.xml").findall(".//property")
    assert [json.loads(one.attrib["value"]) for one in properties] == [
        row for rows in measured.values() for row in rows
    ]


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


@pytest.mark.parametrize(
    ("mark", "sentence"),
    [
        ("", "test_it says nothing of what is tested; expected @pytest.mark.uno(image='own.elf'), or robot="),
        ("image='no.elf'", "there is no no.elf, neither in * nor in *"),
        ("image='text.elf'", "*text.elf*"),
        ("imgae='own.elf'", "*uno(imgae=...): expected one of image, robot, *; did you mean 'image'?"),
        ("'own.elf'", "*uno('own.elf'): expected a keyword, such as image='own.elf'"),
        ("robot='shieldbotx'", "*shieldbotx*did you mean*"),
        ("robot='shieldbot', baud=0", "line_rate: the rate is 0; expected *"),
    ],
)
def test_a_bad_mark_is_one_sentence(users: pytest.Pytester, mark: str, sentence: str) -> None:
    users.path.joinpath("text.elf").write_text("no program")
    result = run(users, f"@pytest.mark.uno({mark})\ndef test_it(uno):\n    pass\n")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([f"uno: {sentence}"])
    assert "Traceback" not in result.stdout.str() and "sim_bridge" not in result.stdout.str()


def test_nothing_is_imported_before_the_fixture_is_used() -> None:
    code = "import sys, sim_bridge.bench.plugin; print([name for name in sys.modules if name in ('numpy', 'boebot')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
