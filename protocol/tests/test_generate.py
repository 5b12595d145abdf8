"""The generator: it runs on a Python without packages; what it makes of robots is what the library reads; the golden
frames agree with independent libraries."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import sys
import venv
from pathlib import Path
from typing import Any

import pytest
from cobs import cobs

from boebot.description.board_parameters import parameters_of
from boebot.description.robots import load_robot, robot_names

PROTOCOL = Path(__file__).resolve().parents[1]
ROOT = PROTOCOL.parent
sys.path.insert(0, str(PROTOCOL))

import pin_headers  # noqa: E402
import reference_frame  # noqa: E402
import robot_files  # noqa: E402
import schema  # noqa: E402

GOLDEN = json.loads((PROTOCOL / "vectors" / "frames.json").read_text())


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Python in an empty environment."""
    folder = tmp_path_factory.mktemp("bare")
    venv.create(folder)
    python = folder / "bin" / "python"
    assert subprocess.run([python, "-c", "import msgspec"], capture_output=True).returncode == 1
    return python


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """What git holds of the generator and of what it reads."""
    made = shutil.ignore_patterns("generated", "messages.py", "attributes.pyi", "__pycache__", "*.so")
    for folder in ("protocol", "firmware/src", "host/boebot/devices"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=made)
    (tmp_path / "host" / "boebot" / "link").mkdir()
    return tmp_path


def run_generator(python: Path | str, clone: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [python, clone / "protocol" / "generate.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_python_without_packages_makes_the_same_files(bare: Path, clone: Path) -> None:
    done = run_generator(bare, clone)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    names = [path.relative_to(clone) for path in (clone / "firmware" / "src" / "generated").iterdir()]
    assert {"messages.h", "pins_shieldbot.h"} < {name.name for name in names}
    for name in (*names, Path("host/boebot/link/messages.py"), Path("host/boebot/devices/attributes.pyi")):
        assert (clone / name).read_bytes() == (ROOT / name).read_bytes(), name


def test_only_what_changes_is_written_and_the_pins_of_a_robot_that_is_gone_go(clone: Path) -> None:
    lab = clone / "protocol" / "robots" / "lab.toml"
    lab.write_text('extends = "shieldbot"\nname = "lab"\npin_map = "lab"\n')
    generated = clone / "firmware" / "src" / "generated"
    assert run_generator(sys.executable, clone).returncode == 0
    assert "PIN_MAP_LAB" in (generated / "pin_map.h").read_text() and (generated / "pins_lab.h").exists()
    before = {path.name: path.stat().st_mtime_ns for path in generated.iterdir()}
    lab.unlink()
    assert run_generator(sys.executable, clone).returncode == 0
    after = {path.name: path.stat().st_mtime_ns for path in generated.iterdir()}
    assert after.keys() == before.keys() - {"pins_lab.h"}
    assert [name for name in after if after[name] != before[name]] == ["pin_map.h"]


def test_a_stale_file_in_git_is_named(clone: Path) -> None:
    assert run_generator(sys.executable, clone, "--check").returncode == 0
    page = clone / "protocol" / "PROTOCOL.md"
    page.write_text(page.read_text().replace("| `stop` |", "| `halt` |"))
    done = run_generator(sys.executable, clone, "--check")
    assert (done.returncode, done.stdout) == (
        1,
        "protocol/PROTOCOL.md is stale; run: python protocol/generate.py --pages\n",
    )
    assert run_generator(sys.executable, clone, "--pages").returncode == 0
    assert page.read_bytes() == (PROTOCOL / "PROTOCOL.md").read_bytes()


def test_an_older_python_gets_one_sentence() -> None:
    """Written so that Python 3.7 reads as far as the sentence: all of the file must parse there."""
    script = PROTOCOL / "generate.py"
    ast.parse(script.read_text(), feature_version=(3, 7))
    pretend = f"import runpy, sys; sys.version_info = (3, 10, 4); runpy.run_path({str(script)!r}, run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", pretend], capture_output=True, text=True, check=False)
    sentence = f"protocol/generate.py: expected Python 3.11 or newer; {sys.executable} is 3.10\n"
    assert (done.returncode, done.stderr) == (1, sentence)


@pytest.mark.parametrize("name", [name for name in robot_names() if load_robot(name).has_board])
def test_the_generator_and_the_library_read_robots_alike(name: str) -> None:
    ours, library = robot_files.load(PROTOCOL / "robots" / f"{name}.toml"), load_robot(name)
    assert ours.pin_map == library.pin_map
    for device in library.device:
        assert ours.pins(device) == library.device[device].pins()
        assert ours.has(device) == library.device[device].on
    spec = schema.load()
    values = parameters_of(library)
    assert pin_headers.devices_default(spec, ours) == values.pop("devices")
    counted = {p.name: pin_headers.default_counts(p, ours) for p in spec.parameter if p.default_from}
    scales = {p.name: p.scale for p in spec.parameter}
    assert {key: counted[key] for key in values if key in counted} == {
        key: round(value / scales[key]) for key, value in values.items() if key in counted
    }


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[device.buzzer]\npin = 5", "lab.toml: whisker_left and buzzer cannot share pin 5"),
        ("[device.buzzer]\npin = 'A6'", "lab.toml: device.buzzer.pin: there is no pin 'A6'"),
        ("[body]\ntrack_width_m = 'wide'", "lab.toml: body.track_width_m: expected a number, got 'wide'"),
        ("[body]\ntrack_width_m = 9", "lab.toml: body.track_width_m is outside the range of parameter track_width"),
        ("remove = ['uart']", "lab.toml: uart.baud is missing"),
        ("extends = 'dalek'", "lab.toml extends 'dalek'; expected another robot of robots"),
        ("[body", "lab.toml: no valid TOML"),
        ("device = 5", "lab.toml: device: expected a table"),
        ("[device]\nlamp = 5", "lab.toml: device.lamp: expected a table"),
        ("remove = 5", "lab.toml: remove: expected a list"),
        ("extends = ''", "lab.toml extends ''"),
    ],
)
def test_a_robot_that_has_no_image_is_refused_in_one_sentence(clone: Path, text: str, sentence: str) -> None:
    head = "" if "extends" in text else 'extends = "shieldbot"\n'
    first, second = (text, "") if not text.startswith("[") else ("", text)
    lab = clone / "protocol" / "robots" / "lab.toml"
    lab.write_text(f'{head}{first}\nname = "lab"\npin_map = "lab"\n{second}\n')
    done = run_generator(sys.executable, clone)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"protocol/generate.py: {sentence}")


def test_every_message_has_golden_frames() -> None:
    assert {row["message"] for row in GOLDEN} == {message.name for message in schema.load().message}


@pytest.mark.parametrize("row", GOLDEN, ids=lambda row: f"{row['message']}-{row['sequence']}")
def test_golden_frame_unpacks_with_an_independent_cobs_and_polynomial_division(row: dict[str, Any]) -> None:
    frame = bytes.fromhex(row["frame"])
    assert frame[0] == frame[-1] == 0 and 0 not in frame[1:-1]
    stuffed, check = frame[1:-4], frame[-4:-1]
    assert cobs.decode(stuffed) == bytes([int(row["id"]), int(row["sequence"])]) + bytes.fromhex(row["payload"])
    # The CRC is the remainder of (seed·x^(8n) + data)·x^21 over GF(2): long division with Python's integers.
    bits = 8 * len(stuffed)
    dividend = (int.from_bytes(stuffed, "big") << 21) ^ (int(row["seed"]) << bits)
    divisor = 1 << 21 | reference_frame.POLYNOMIAL
    while dividend.bit_length() > 21:
        dividend ^= divisor << (dividend.bit_length() - 22)
    assert all(byte & 0x80 for byte in check)
    assert dividend == (check[0] & 0x7F) << 14 | (check[1] & 0x7F) << 7 | check[2] & 0x7F


def test_hash_ignores_explanations_and_sees_layout(tmp_path: Path) -> None:
    original = (PROTOCOL / "messages.toml").read_text()
    file = tmp_path / "messages.toml"
    file.write_text(original.replace('doc = "Asks for the identity."', 'doc = "Asks who it is."'))
    assert schema.load(file).hash == schema.load().hash
    file.write_text(original.replace('name = "answers_tick", type = "u16"', 'name = "answers_tick", type = "i16"', 1))
    assert schema.load(file).hash != schema.load().hash


def test_hash_ignores_what_a_minor_version_adds(tmp_path: Path) -> None:
    """A message, a parameter, flags and values at the end; without `since` each would be another version."""
    original = (PROTOCOL / "messages.toml").read_text()
    count = len(schema.load().parameter)
    added = {
        "minor = 1": "minor = 2",
        '\n[[parameter]]\nname = "devices"': '\n[[message]]\nname = "more"\nid = 0x9E\ndirection = "to_host"\n'
        'delivery = "telemetry"\ndoc = ""\nsince = 2\nfields = [{ name = "x", type = "u8" }]\n'
        '\n[[parameter]]\nname = "devices"',
        '"latched_again", "busy"]': '"latched_again", "busy", "tired"]\nsince = { tired = 2 }',
        "max = 4095": "max = 8191",
    }
    text = original
    for before, after in added.items():
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    text += f'\n[[parameter]]\nname = "mood"\nid = {count}\ntype = "u16"\nunit = ""\ndoc = ""\nmin = 0\nmax = 1\n'
    file = tmp_path / "messages.toml"
    file.write_text(text + "since = 2\n")
    spec, ours = schema.load(file), schema.load()
    assert spec.hash == ours.hash and spec.version_byte == ours.version_byte + 1
    assert [spec.message_hash(m) for m in ours.message] == [ours.message_hash(m) for m in ours.message]
    for mark in ("since = { tired = 2 }", "since = 2\nfields", "since = 2\n"):
        file.write_text((text + "since = 2\n").replace(mark, mark.partition("fields")[1]))
        assert schema.load(file).hash != ours.hash, mark
