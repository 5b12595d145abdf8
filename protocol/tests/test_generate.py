"""The generator: it runs on a Python without packages; what it makes of robots is what the library reads; the golden
frames agree with independent libraries."""

from __future__ import annotations

import ast
import importlib.util
import json
import shutil
import subprocess
import sys
import tomllib
import venv
from copy import deepcopy
from pathlib import Path
from typing import Any

import msgspec
import pytest
from cobs import cobs

from boebot.description.board_parameters import parameters_of
from boebot.description.robots import load_robot, robot_names

PROTOCOL = Path(__file__).resolve().parents[1]
ROOT = PROTOCOL.parent
sys.path.insert(0, str(PROTOCOL))

import c_headers  # noqa: E402
import pin_headers  # noqa: E402
import python_module  # noqa: E402
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
    for folder in (
        "protocol",
        "firmware/src",
        "host/boebot/devices",
        "host/boebot_can/generator",
        "sim_bridge/world/generator",
    ):
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


@pytest.mark.parametrize("name", ["lab.2", "lab_2", "lab 2"])
def test_a_pin_map_that_would_be_no_name_in_c_or_another_file_is_refused(name: str, tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(f'name = "lab"\ntitle = "Lab"\nboard = "uno"\npin_map = "{name}"\n[body]\n[device]\n')
    with pytest.raises(ValueError, match=rf"^lab\.toml: pin_map is '{name}'; expected letters, digits and hyphens$"):
        robot_files.load(file)


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


def test_a_robot_of_programs_has_no_image(tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text('extends = "shieldbot"\nname = "shieldbot"\nfirmware = "none"\n[device.buzzer]\npin = 5')
    lab = robot_files.load(file)
    assert (lab.pin_map, lab.has_image, lab.takes_brain) == ("", False, False)


@pytest.mark.parametrize(
    "name", [one.name for one in map(load_robot, robot_names()) if one.has_board and one.takes_brain]
)
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


def free_id(spec: schema.Schema) -> int:
    """Of a message to the host that there is not."""
    return next(number for number in range(255, 0, -1) if number not in {message.id for message in spec.message})


def test_hash_ignores_what_a_minor_version_adds() -> None:
    """A message, a parameter, flags and values at the end; without `since` each would be another version."""
    table = tomllib.loads((PROTOCOL / "messages.toml").read_text())
    table["flags"]["of_a_test"] = {"doc": "", "type": "u8", "bits": ["glad"]}
    table["enum"]["of_a_test"] = {"doc": "", "values": ["glad"]}
    ours, later = schema.checked(table, ""), deepcopy(table)
    minor = later["minor"] = ours.minor + 1
    since: list[tuple[dict[str, Any], Any]] = []
    for kind, names in (("flags", "bits"), ("enum", "values")):
        later[kind]["of_a_test"][names].append("tired")
        since.append((later[kind]["of_a_test"], {"tired": minor}))
    free = free_id(ours)
    message = {"name": "added_by_a_test", "id": free, "direction": "to_host", "delivery": "telemetry", "doc": ""}
    parameter = {"name": "added_by_a_test", "id": len(ours.parameter), "type": "u16", "unit": "", "doc": "", "max": 1}
    since += [(message | {"fields": [{"name": "x", "type": "u8"}]}, minor), (parameter, minor)]
    later["message"].append(since[-2][0])
    later["parameter"].append(since[-1][0])
    for added, value in since:
        added["since"] = value
    spec = schema.checked(later, "")
    assert spec.hash == ours.hash and spec.version_byte == ours.version_byte + 1
    assert [spec.message_hash(m) for m in ours.message] == [ours.message_hash(m) for m in ours.message]
    for added, value in since:
        del added["since"]
        assert schema.checked(later, "").hash != ours.hash, added
        added["since"] = value


def executed(path: Path) -> Any:
    """The module of a file, beside the one of its name."""
    spec = importlib.util.spec_from_file_location(f"another_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def output(clone: Path, source: str, *more: Path) -> list[str]:
    """What a program prints that is compiled for robot lab of the clone."""
    program = clone / "program.c"
    program.write_text(f"#include <stdio.h>\n{source}")
    firmware = clone / "firmware" / "src"
    command = ["gcc", "-DPIN_MAP_LAB", f"-I{firmware}", "-o", program.with_suffix(""), program, *more]
    subprocess.run([str(word) for word in command], check=True)
    return subprocess.run([program.with_suffix("")], capture_output=True, text=True, check=True).stdout.splitlines()


def grown(clone: Path, robot: str) -> Any:
    """The Python module of the messages, as the clone's generator makes it; robot lab is `robot` and a table."""
    head, _, device = robot.partition("\n")
    (clone / "protocol" / "robots" / "lab.toml").write_text(
        f'extends = "{head}"\nname = "lab"\npin_map = "lab"\n{device}'
    )
    done = run_generator(sys.executable, clone)
    assert (done.returncode, done.stderr) == (0, "")
    return executed(clone / "host" / "boebot" / "link" / "messages.py")


def test_tasks_that_only_some_images_have_are_numbered_once(clone: Path) -> None:
    """Boe-Bot has a buzzer and no line sensors. Counted in its image alone, `second` would have a lower number."""
    tasks = clone / "firmware" / "src" / "tasks.def"
    text = tasks.read_text()
    assert text.count("\n#ifdef PIN_LINE_LEFT\nTASK(line, ") == 1
    behind = text.index("#endif", text.index("TASK(line, ")) + len("#endif")
    tasks.write_text(f"{text[:behind]}\n#ifdef PIN_BUZZER\nTASK(second, 8, 5, 100)\n#endif{text[behind:]}")
    messages = grown(clone, "boebot")
    source = """
#include "generated/values.h"
#include "pins.h"
#include "tasks.h"
#define SHOW(name, number) printf("%s %d %d\\n", name, number, RESET_CAUSE_WATCHDOG + 1 + number);
#define TASK(name, period, phase, budget) SHOW(#name, TASK_##name)
int main(void) {
#include "tasks.def"
}
"""
    of_image = output(clone, source)
    cause = messages.ResetCause
    of_host = [f"{t.name.lower()} {int(t)} {int(cause[f'WATCHDOG_IN_{t.name}'])}" for t in messages.Task]
    assert of_host[-1].startswith("second ") and of_image == [row for row in of_host if not row.startswith("line ")]


def test_a_second_parameter_holds_more_devices(clone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Devices 17 and 18, of which robot lab has the last, on the board and on the host."""
    toml, flags = clone / "protocol" / "messages.toml", schema.load().flags["devices"]
    names = [f"extra{i}" for i in range(18 - len(flags.bits))]
    table = (
        f'doc = ""\ntype = "u32"\nbits = {json.dumps(flags.bits + names)}\ndevice = {json.dumps(flags.device + names)}'
    )
    old = toml.read_text().partition("[flags.devices]\n")[2].partition("\n\n")[0]
    number = len(schema.load().parameter)
    more = f'\n[[parameter]]\nname = "more_devices"\nid = {number}\ntype = "u16"\nunit = "flags"\ndoc = ""\n'
    toml.write_text(toml.read_text().replace(old, table) + more)
    messages = grown(clone, f"boebot\n[device.{names[-1]}]\n")
    others = messages.PARAMETERS["devices"]
    assert (others.id, others.maximum, messages.PARAMETERS["more_devices"].maximum) == (0, 0xFFFF, 0b11)
    source = f"""
#include "generated/values.h"
#include "parameters.h"
#define LAST DEVICES_{names[-1].upper()}
#define LAST_BUT_ONE DEVICES_{names[-2].upper()}
int main(void) {{
  parameters_start();
  const unsigned long usual = parameters_u16(PARAMETER_DEVICES);
  printf("%d %d\\n", parameters_devices() == (LAST | usual), parameters_device_on(LAST));
  printf("%d\\n", parameters_set(PARAMETER_MORE_DEVICES, LAST_BUT_ONE >> 16) == ANSWER_STATUS_OUT_OF_RANGE);
  printf("%d\\n", parameters_set(PARAMETER_MORE_DEVICES, 0) == ANSWER_STATUS_OK);
  printf("%d %d\\n", parameters_devices() == usual, parameters_device_on(LAST));
}}
"""
    assert output(clone, source, clone / "firmware" / "src" / "parameters.c") == ["1 1", "1", "1", "1 0"]
    monkeypatch.setitem(sys.modules, "boebot.link.messages", messages)
    host = executed(ROOT / "host" / "boebot" / "description" / "board_parameters.py")
    usual = load_robot("boebot")
    robot = msgspec.structs.replace(usual, device={**usual.device, names[-1]: usual.device["buzzer"]})
    values = host.parameters_of(robot)
    assert (values["devices"], values["more_devices"]) == (parameters_of(usual)["devices"], 0b10)
    boards = (values, {"devices": 0.0}, {"more_devices": 0.0})  # the second one is an older board's
    found = [(host.adapted(robot, board).has(names[-1]), host.adapted(robot, board).has("buzzer")) for board in boards]
    assert found == [(True, True), (True, False), (False, True)]


def test_a_message_as_long_as_one_of_the_handshake_is_padded_at_both_ends(tmp_path: Path) -> None:
    table = tomllib.loads((PROTOCOL / "messages.toml").read_text())
    text = {"name": "text", "type": "text[8]"}  # as long as `description`
    table["message"].append(
        {
            "name": "remark",
            "id": free_id(schema.load()),
            "direction": "to_host",
            "delivery": "telemetry",
            "doc": "",
            "fields": [text],
        }
    )
    spec = schema.checked(table, "messages.toml")
    (tmp_path / "messages.py").write_text(python_module.python_module(spec))
    remark = executed(tmp_path / "messages.py").Remark
    said = remark(b"12345678")
    assert said.pack() == b"12345678\0" and remark.unpack(said.pack()) == said
    (tmp_path / "messages.h").write_text(c_headers.messages_header(spec))
    source = '#include "messages.h"\n_Static_assert(sizeof(msg_remark) == 9 && MSG_REMARK_LENGTH == 9, "padded");\n'
    command = ["gcc", "-x", "c", "-fsyntax-only", f"-I{tmp_path}", f"-I{ROOT / 'firmware' / 'src'}", "-"]
    subprocess.run(command, input=source, text=True, check=True)


def test_every_pin_map_is_compiled_by_the_check_of_warnings(tmp_path: Path) -> None:
    """By the names that the script finds; one may have digits."""
    line = next(line for line in (ROOT / "tools" / "warnings.sh").read_text().splitlines() if "grep -o" in line)
    maps = [robot_files.Robot("", {"board": "uno", "pin_map": name}) for name in ("lab", "lab-2b", "mk3")]
    macros = [pin_headers.pin_map_macro(robot) for robot in maps]
    flags = "".join(f"build_flags = ${{avr.flags}} -D{macro} -O1\n" for macro in macros)
    (tmp_path / "platformio.ini").write_text(flags)
    command = ["sh", "-c", f'{line}\necho "$pin_maps"', "warnings.sh", "all"]
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert found.stdout.split() == macros
