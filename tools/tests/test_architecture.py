"""Who may know whom (README, "How it works"): read from the sources, so that the circle stays one."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import boebot
import boebot.behaviors
import boebot.brain
import boebot.cognition
import boebot.navigation
from boebot.robot import Observation
from tools.tests import imports
from tools.tests.imports import c_code, imported, included

ROOT = Path(__file__).resolve().parents[2]


def test_the_core_knows_no_guest() -> None:
    """It neither imports one nor names it: guests join by entry points. And the library does not know the simulator."""
    guests = re.compile(rf"\b({'|'.join(imports.guests(ROOT))})\b")
    guilty = [
        f"{source.relative_to(ROOT)}: {name}"
        for folder in ("host/boebot", "sim_bridge")
        for source in (ROOT / folder).rglob("*.py")
        if "tests" not in source.parts
        for name in guests.findall(source.read_text(encoding="utf-8"))
    ]
    guilty += [
        f"{source.relative_to(ROOT)}: {name}"
        for source in (ROOT / "host" / "boebot").rglob("*.py")
        for name in imported(source)
        if name.split(".")[0] == "sim_bridge"
    ]
    assert not guilty


def test_the_analysis_of_machine_code_knows_no_robot() -> None:
    """Of the library it knows the reader of images and the errors."""
    guilty = [
        f"{source.relative_to(ROOT)}: {name}"
        for source in (ROOT / "host" / "avr_timing").rglob("*.py")
        if "tests" not in source.parts
        for name in imported(source)
        if name.split(".")[0] in ("boebot", "boebot_timing", "sim_bridge", "boebot_hil", "tools")
        and not name.startswith(("boebot.image", "boebot.errors"))
    ]
    assert not guilty


def test_pytest_is_known_to_the_plugin_alone() -> None:
    """It is no requirement: whoever has no tests has no pytest."""
    knows = [
        str(source.relative_to(ROOT))
        for folder in ("host/boebot", "sim_bridge")
        for source in (ROOT / folder).rglob("*.py")
        if "tests" not in source.parts and "pytest" in {name.split(".")[0] for name in imported(source)}
    ]
    assert knows == ["sim_bridge/bench/plugin.py"]


def test_running_a_brain_analyses_no_machine_code_and_draws_nothing() -> None:
    run = """
import sys
from boebot.cli import main
sys.argv = ["boebot", "run", "wander", "--on", "avr", "--seconds", "0.5"]
try:
    main()
except SystemExit as ended:
    assert not ended.code, ended
print(*sys.modules)
"""
    ended = subprocess.run([sys.executable, "-c", run], cwd=ROOT / "build", capture_output=True, text=True, check=True)
    loaded = set(ended.stdout.splitlines()[-1].split())
    assert "sim_bridge" in loaded and not loaded & {"elftools", "matplotlib", "pydantic"}
    assert not any(name.startswith("avr_timing") for name in loaded)
    assert "boebot.image.chip" in loaded and "boebot.image.elf" not in loaded


def test_brains_touch_only_what_is_meant_for_them() -> None:
    """What a brain's author may import: names that these packages offer, and nothing from the files below them."""
    allowed = {"boebot.Robot", "boebot.Observation", "boebot.Command", "boebot"}
    for package in (boebot.brain, boebot.behaviors, boebot.cognition, boebot.navigation):
        allowed |= {package.__name__, *(f"{package.__name__}.{name}" for name in package.__all__)}
    for source in (ROOT / "host" / "boebot" / "brains").glob("*.py"):
        if source.name != "__init__.py":
            own = {name for name in imported(source) if name.split(".")[0] == "boebot"}
            assert own <= allowed, source.name


@pytest.mark.parametrize(
    ("folder", "forbidden"),
    [
        ("firmware/src", ("sim_bridge/", "sim_")),
        ("sim_bridge/world", ("sim_bridge/boards/", "sim_bridge/parts/", "firmware/", "sim_bridge/loop")),
        ("sim_bridge/boards", ("sim_bridge/world/", "sim_bridge/parts/", "sim_bridge/loop")),
        ("sim_bridge/parts", ("firmware/", "sim_bridge/loop")),
        ("host/boebot/arenas", ("sim_bridge/", "firmware/")),
    ],
)
def test_c_room_includes_only_what_it_may_know(folder: str, forbidden: tuple[str, ...]) -> None:
    guilty = [
        f"{source.relative_to(ROOT)} includes {name}"
        for source, name in included(ROOT, folder)
        if name.startswith(forbidden)
    ]
    assert not guilty


FIRMWARE = ROOT / "firmware" / "src"


def firmware_code() -> dict[str, str]:
    """The firmware's own C by path from firmware/src; what protocol/generate.py makes is not among it."""
    found = {source.relative_to(FIRMWARE).as_posix(): c_code(source) for source in FIRMWARE.rglob("*.[ch]")}
    return {name: text for name, text in found.items() if not name.startswith("generated/")}


@pytest.mark.parametrize("folder", imports.C_ROOMS)
def test_modules_in_c_make_no_circle(folder: str) -> None:
    knows = imports.c_modules(ROOT, folder)
    assert knows
    assert not imports.circles(knows)


C_CALLS = (
    *("host/boebot/arenas/geometry", "sim_bridge/world", "sim_bridge/world/sensors", "sim_bridge/parts"),
    *("sim_bridge/vehicles", "sim_bridge/loop", "sim_bridge/boards/native"),
    *("firmware/src", "firmware/src/link", "firmware/src/hal/avr", "firmware/src/hal/native"),
)


@pytest.mark.parametrize("folder", C_CALLS)
def test_files_in_c_do_not_call_in_circles(folder: str) -> None:
    assert not set(imports.circles(imports.c_calls(ROOT / folder)))


def test_python_modules_make_no_circle() -> None:
    """Imports for type checkers count."""
    assert not imports.circles(imports.python_imports(imports.python_modules(ROOT)))


@pytest.fixture(scope="module")
def firmware_includes() -> dict[str, set[str]]:
    """What each C file of the firmware includes directly."""
    found: dict[str, set[str]] = {}
    for source, name in included(ROOT, "firmware/src"):
        found.setdefault(source.relative_to(ROOT).as_posix(), set()).add(name)
    return found


def test_below_the_link_nothing_knows_it(firmware_includes: dict[str, set[str]]) -> None:
    """Devices fill in the messages' layout, which is generated; what calls them and sends it belongs to the link."""
    link = ("firmware/src/link/", "firmware/src/generated/devices.h")
    above = (*link, "firmware/src/firmware.c")
    guilty = [
        f"{source} includes {name}"
        for source, names in firmware_includes.items()
        for name in names
        if name.startswith(link) and not source.startswith(above)
    ]
    assert not guilty


@pytest.mark.parametrize("source", ["link/frame.c", "link/frame.h", "link/crc21.h"])
def test_frames_are_made_without_a_board(source: str, firmware_includes: dict[str, set[str]]) -> None:
    allowed = ("link/frame.h", "link/crc21.h", "bounds.h", "generated/")
    own = {
        name for name in imports.closure(f"firmware/src/{source}", firmware_includes) if name.startswith("firmware/")
    }
    assert own
    assert all(name.removeprefix("firmware/src/").startswith(allowed) for name in own), own


def test_who_owns_an_interrupt_stands_in_one_place() -> None:
    """hal/interrupts.h declares the handlers, hal/avr/interrupts.c has their vectors and names the board's own ones."""
    handlers = set(re.findall(r"\bvoid (\w+)\(", c_code(FIRMWARE / "hal" / "interrupts.h")))
    vectors = FIRMWARE / "hal" / "avr" / "interrupts.c"
    assert handlers
    assert handlers == {name for name in handlers if re.search(rf"\b{name}\(", c_code(vectors))}
    for name, text in firmware_code().items():
        if not name.startswith("hal/"):
            called = {handler for handler in handlers if re.search(rf"(?<!void )\b{handler}\(", text)}
            assert not called, f"{name}: only the board calls {called}"
    head = vectors.read_text(encoding="utf-8").split("*/")[0]
    elsewhere = {name for name, text in firmware_code().items() if "ISR(" in text} - {"hal/avr/interrupts.c"}
    assert all(name.startswith("hal/avr/") and Path(name).name in head for name in elsewhere), elsewhere


def test_the_firmware_is_plain_c() -> None:
    """No assembly but notes that are not loaded, no naked function but the first of the start, no reserved registers
    or addresses, no state in registers of the chip that are free."""
    assert not list(FIRMWARE.rglob("*.[sS]"))
    for name, text in firmware_code().items():
        for statement in re.findall(r"\b(?:__)?asm(?:__)?\b[^;]*;?", text):
            assert name in ("bounds.h", "schedule.c") and ".pushsection .boebot." in statement, f"{name}: {statement}"
        for line in text.splitlines():
            assert "naked" not in line or 'section(".init3")' in line, f"{name}: {line}"
            for section in re.findall(r'section\("(.+?)"\)', line):
                assert section in (".init3", ".noinit"), f"{name}: {line}"
            assert not re.search(r"\b(GPIOR\d|OCR0B|register)\b", line), f"{name}: {line}"


def test_the_firmware_is_compiled_by_the_platforms_options() -> None:
    texts = [ROOT / "platformio.ini", *(ROOT / "tools" / "platformio").glob("*.py")]
    options = {option for text in texts for option in re.findall(r"(?<![\w-])--?[fmO][\w-]+", text.read_text())}
    sanitizers = {"-fno-omit-frame-pointer", "-fsanitize", "-fno-sanitize-recover", "-O1"}
    assert options <= {"-flto", "-ffunction-sections", "-fdata-sections", *sanitizers}


def test_only_the_recorder_of_vectors_includes_simavr_and_says_its_licence() -> None:
    users = {
        source.name: source.read_text()
        for source, name in included(ROOT, "sim_bridge")
        if re.match(r"sim_\w+\.h$", Path(name).name) and not (ROOT / name).exists()
    }
    assert list(users) == ["simavr_machine.c"]
    assert "GPL-3.0-or-later" in users["simavr_machine.c"][:1500]


def test_the_core_of_the_microcontroller_knows_itself_and_the_c_library() -> None:
    core = ROOT / "sim_bridge" / "boards" / "avr" / "core"
    for source in [*core.glob("*.c"), *core.glob("*.h")]:
        named = set(re.findall(r'#include ["<](.+)[">]', source.read_text()))
        strangers = {name for name in named if not (core / name).exists()}
        assert strangers <= {"stdbool.h", "stdint.h", "stdlib.h", "string.h"}, source.name


def test_simulator_knows_no_protocol() -> None:
    for source in (ROOT / "sim_bridge").rglob("*.py"):
        if "tests" not in source.parts:
            spoken = {name for name in imported(source) if name.startswith("boebot.link.")}
            carriers = (".transport", ".ports", ".bad_line")  # of bytes
            assert not {name for name in spoken if not any(one in name for one in carriers)}, source


def test_observation_leads_to_nothing_of_the_simulator() -> None:
    """Whatever a brain can reach from its observation, by attributes however deep, is not the simulated world."""
    reached: list[object] = []

    def step(robot: boebot.Robot) -> None:
        if not reached:
            reached.extend(everything(robot.observation))

    boebot.run(step, on="native", seconds=1)
    assert any(isinstance(thing, Observation) for thing in reached)
    assert not [thing for thing in reached if type(thing).__module__.startswith("sim_bridge")]


def everything(start: object) -> list[object]:
    """All objects that public and private attributes, items and closures lead to, outside of modules and classes."""
    seen: dict[int, object] = {}
    waiting = [start]
    while waiting:
        thing = waiting.pop()
        if id(thing) in seen or isinstance(thing, type | str | bytes | int | float) or type(thing).__name__ == "module":
            continue
        seen[id(thing)] = thing
        for name in dir(thing):
            if not name.startswith("__") and not callable(getattr(type(thing), name, None)):
                with contextlib.suppress(boebot.BoebotError):  # a device that the robot does not have
                    waiting.append(getattr(thing, name))
        if isinstance(thing, dict):
            waiting += list(thing.values())
        elif isinstance(thing, list | tuple):
            waiting += list(thing)
        waiting += [cell.cell_contents for cell in getattr(thing, "__closure__", None) or ()]
    return list(seen.values())


def test_each_module_of_the_library_has_its_test() -> None:
    """A file of its path, or the files in its room's row of host/tests/README.md."""
    tests, library = ROOT / "host" / "tests", ROOT / "host" / "boebot"
    proved: dict[str, set[str]] = {}
    table = (tests / "README.md").read_text(encoding="utf-8")
    for room, files, modules in re.findall(r"^\| `(\S+)` \| (.+?) \| (.+?) \|$", table, re.MULTILINE):
        for file in re.findall(r"`(.+?)`", files):
            assert any((folder / file).is_file() for folder in (tests / room, tests, ROOT)), file
        proved.setdefault(room, set()).update(re.findall(r"`(\w+\.py)`", modules) or [modules])
    for module in library.rglob("[!_]*.py"):
        path = module.relative_to(library)
        known = proved.get(str(path.parent), set())
        assert "rest" in known or path.name in known or (tests / path.with_name(f"test_{path.name}")).is_file(), path
