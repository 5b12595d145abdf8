"""The wheels of `make wheels`: what is in them, and what they do where they are installed: this Linux without a
compiler, Windows as Wine is it, Linux on aarch64 by QEMU (tools/tests/other_systems.py). That all of them compute the
same is said by `boebot replay --again`, which repeats here, bit by bit, what ran there. macOS is built and not run."""

from __future__ import annotations

import json
import os
import re
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZipFile

import pytest
from elftools.elf.dynamic import DynamicSection
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection

from boebot import sketches
from boebot.sketch.build import built
from tools.tests import other_systems
from tools.tests.other_systems import PROJECT, System, on_windows
from tools.wheels import SYSTEMS, WHEELS

pytestmark = [pytest.mark.soak, pytest.mark.unsanitized]

NATIVE = re.compile(r"\.(abi3\.so|pyd|so|dll|dylib)$")
SECONDS = "5"
DICE = '''"""Drives by numbers that follow from the one before, and asks no library of mathematics."""

PERIOD = 0.05
number = 1


def step(robot):
    global number
    number = (number * 1103515245 + 12345) % 2**31
    robot.drive((number >> 8) % 201 / 100 - 1, (number >> 16) % 201 / 100 - 1)
'''
UNO = """import pytest


@pytest.mark.uno(robot="shieldbot")
def test_says_hello(uno):
    uno.serial.expect(b"\\x00", within=0.5)


@pytest.mark.uno(image="sketch.hex")
def test_waits_in_vain(uno):
    uno.serial.expect(b"never said", within=0.1)
"""


@pytest.fixture(scope="module")
def wheels() -> dict[str, Path]:
    """All wheels by their tags, made anew."""
    subprocess.run(["make", "wheels"], cwd=PROJECT, check=True, stdout=subprocess.DEVNULL)
    found = {}
    for tag in SYSTEMS:
        (found[tag],) = WHEELS.glob(f"boebot-*-cp311-abi3-{tag}.whl")
    return found


@pytest.fixture(scope="module")
def linux(wheels: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> System:
    """This Linux, which also repeats what ran elsewhere."""
    return other_systems.linux(tmp_path_factory.mktemp("linux"), wheels["manylinux_2_17_x86_64"])


@pytest.fixture(scope="module")
def windows(wheels: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Windows as Wine is it."""
    system = other_systems.windows(tmp_path_factory.mktemp("windows"), wheels["win_amd64"])
    yield system
    other_systems.end_wine(system)


@pytest.fixture(scope="module")
def aarch64(wheels: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> System:
    """Linux on another processor."""
    return other_systems.aarch64(tmp_path_factory.mktemp("aarch64"), wheels["manylinux_2_17_aarch64"])


@pytest.fixture(params=["linux", "windows", "aarch64"])
def system(request: pytest.FixtureRequest) -> System:
    """Each system that a wheel is run on."""
    found: System = request.getfixturevalue(request.param)
    return found


@pytest.fixture(scope="module")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A sketch as a program for the Uno, in the form of Intel."""
    file = tmp_path_factory.mktemp("sketch") / "sketch.hex"
    elf = built(sketches.FOLDER / "whiskers").elf
    subprocess.run(["avr-objcopy", "-O", "ihex", elf, file], check=True)
    return file.read_bytes()


# ---- what is in them -----------------------------------------------------------------------------------------------


def test_all_wheels_have_the_same_inside(wheels: dict[str, Path]) -> None:
    inside = {}
    for tag, wheel in wheels.items():
        with ZipFile(wheel) as archive:
            names = archive.namelist()
            (about,) = (archive.read(name).decode() for name in names if name.endswith("/WHEEL"))
            (metadata,) = (archive.read(name).decode() for name in names if name.endswith("/METADATA"))
        assert f"Tag: cp311-abi3-{tag}\n" in about and "Root-Is-Purelib: false" in about
        assert "License-Expression: MIT\n" in metadata and any(name.endswith("licenses/LICENSE") for name in names)
        inside[tag] = {NATIVE.sub("", name) for name in names}
    first, *others = inside.values()
    assert all(other == first for other in others)
    assert {"sim_bridge/_core", "sim_bridge/boards/avr/_avr", "boebot/arenas/_arena", "boebot/link/_codec"} < first
    images = sorted(path.name for path in (PROJECT / "build" / "images").glob("*.*") if path.suffix in (".elf", ".hex"))
    pin_maps = {Path(name).stem for name in images} - {"bootloader"}
    assert len(images) == 12 and {f"boebot/data/images/{name}" for name in images} < first
    assert {f"sim_bridge/images/firmware-{name}" for name in pin_maps} < first
    arenas = {path.name for path in (PROJECT / "host" / "boebot" / "arenas" / "bundled").glob("*.toml")}
    assert arenas and {f"boebot/arenas/bundled/{name}" for name in arenas} < first


def test_each_library_is_of_its_system(wheels: dict[str, Path], tmp_path: Path) -> None:
    """And asks for nothing but the system's own libraries, no newer than the tag says."""
    readers = {"manylinux": _elf, "win": _windows_library, "macosx": _macos_library}
    for tag, wheel in wheels.items():
        with ZipFile(wheel) as archive:
            native = [name for name in archive.namelist() if NATIVE.search(name)]
            archive.extractall(tmp_path / tag, native)
        assert len(native) == 4 + 5
        for name in native:
            readers[re.match(r"[a-z]+", tag)[0]](tmp_path / tag / name, tag)  # type: ignore[index]


def _elf(path: Path, tag: str) -> None:
    with path.open("rb") as file:
        elf = ELFFile(file)
        assert elf["e_machine"] == ("EM_AARCH64" if tag.endswith("aarch64") else "EM_X86_64")
        (dynamic,) = (section for section in elf.iter_sections() if isinstance(section, DynamicSection))
        needed = {entry.needed for entry in dynamic.iter_tags("DT_NEEDED")}  # type: ignore[attr-defined]
        needed = {name for name in needed if not name.startswith("ld-linux-")}
        assert needed <= {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0"}, path
        versions = [
            version.name
            for section in elf.iter_sections()
            if isinstance(section, GNUVerNeedSection)
            for _, found in section.iter_versions()
            for version in found
        ]
    for version in versions:
        assert tuple(map(int, version.removeprefix("GLIBC_").split("."))) <= (2, 17), (path, version)


def _windows_library(path: Path, _: str) -> None:
    data = path.read_bytes()
    (begin,) = struct.unpack_from("<I", data, 0x3C)
    assert data[begin : begin + 4] == b"PE\0\0" and struct.unpack_from("<H", data, begin + 4) == (0x8664,)
    asked = {name.decode().lower() for name in re.findall(rb"[\w.-]+\.dll(?=\0)", data, re.IGNORECASE)}
    asked -= {path.name.lower()}
    own = {"kernel32.dll", "python3.dll"} if path.suffix == ".pyd" else {"kernel32.dll"}
    assert {name for name in asked if not name.startswith("api-ms-win-crt-")} <= own, asked


def _macos_library(path: Path, tag: str) -> None:
    """The header and load commands of a Mach-O file (mach-o/loader.h)."""
    data = path.read_bytes()
    magic, processor, _, kind, count, *_ = struct.unpack_from("<8I", data)
    assert (magic, kind) == (0xFEEDFACF, 6) and processor == (0x0100000C if tag.endswith("arm64") else 0x01000007)
    commands: dict[int, list[bytes]] = {}
    at = 32
    for _ in range(count):
        command, size = struct.unpack_from("<2I", data, at)
        commands.setdefault(command & 0x7FFFFFFF, []).append(data[at : at + size])
        at += size
    libraries = {command[24:].split(b"\0")[0] for command in commands[0x0C]}  # LC_LOAD_DYLIB
    assert libraries == {b"/usr/lib/libSystem.B.dylib"}
    (build,) = commands[0x32]  # LC_BUILD_VERSION
    assert struct.unpack_from("<2I", build, 8) == (1, 11 << 16), "macOS, 11.0"
    assert tag.endswith("x86_64") or 0x1D in commands, "Apple's processors run signed code only"


def test_a_wheel_for_another_system_is_refused_by_pip(wheels: dict[str, Path], tmp_path: Path) -> None:
    for tag in ("win_amd64", "macosx_11_0_arm64", "manylinux_2_17_aarch64"):
        pip = [sys.executable, "-m", "pip", "install", "--no-deps", "--target", str(tmp_path)]
        done = subprocess.run([*pip, str(wheels[tag])], capture_output=True, text=True, check=False)
        assert done.returncode == 1 and "is not a supported wheel on this platform" in done.stderr


# ---- what they do --------------------------------------------------------------------------------------------------


def repeated(linux: System, folder: Path) -> None:
    """The run in that folder is the same here, to the last bit of world, board, bytes and commands."""
    said = linux.boebot(folder.parent, "replay", folder.name, "--again", "--trust")
    assert f"bit-equal to {folder.name}: " in said


@pytest.mark.parametrize("board", ["native", "avr"])
def test_wander_drives_on_both_boards(system: System, linux: System, tmp_path: Path, board: str) -> None:
    said = system.boebot(tmp_path, "run", "wander", "--on", board, "--seconds", SECONDS, "--out", "out")
    assert "complete" in said
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("record.mcap", "summary.json", "run.png", "replay.html")
    }
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["ticks"] > 450, "100 a second"
    repeated(linux, tmp_path / "out")


@pytest.mark.parametrize(
    "robot",
    [
        ("--robot", "shieldbot-charging", "--arena", "station", "--on", "avr"),
        ("--robot", "shieldbot-turret", "--arena", "room", "--on", "native"),
        ("--robot", "roller", "--arena", "office"),
        ("--robot", "shieldbot", "--fault", "ping.missing@1s..2s", "--on", "avr"),
    ],
    ids=lambda words: words[1],
)
def test_worlds_and_boards_compute_the_same(
    system: System, linux: System, tmp_path: Path, robot: tuple[str, ...]
) -> None:
    (tmp_path / "dice.py").write_text(DICE, encoding="utf-8")
    system.boebot(tmp_path, "run", "dice.py", *robot, "--seconds", SECONDS, "--out", "out", "--quiet")
    repeated(linux, tmp_path / "out")


def test_a_sketchs_hex_runs(system: System, linux: System, tmp_path: Path, sketch: bytes) -> None:
    (tmp_path / "sketch.hex").write_bytes(sketch)
    words = ["--robot", "shieldbot-basic", "--seconds", SECONDS]
    assert "complete" in system.boebot(tmp_path, "run", "sketch.hex", *words, "--out", "out")
    repeated(linux, tmp_path / "out")


def test_records_are_read_anew(system: System, tmp_path: Path) -> None:
    """By the system that made them; elsewhere by `repeated`."""
    system.boebot(tmp_path, "run", "wander", "--seconds", "2", "--out", "out", "--quiet")
    picture = (tmp_path / "out" / "run.png").read_bytes()
    (tmp_path / "out" / "run.png").unlink()
    assert "complete" in system.boebot(tmp_path, "report", "out", "--as", "csv")
    assert (tmp_path / "out" / "run.png").read_bytes()[:8] == picture[:8] and (tmp_path / "out" / "run.csv").exists()
    assert "bit-equal to out: 40 steps" in system.boebot(tmp_path, "replay", "out", "--again")


def test_the_plugin_tests_programs(system: System, tmp_path: Path, sketch: bytes) -> None:
    (tmp_path / "sketch.hex").write_bytes(sketch)
    (tmp_path / "test_mine.py").write_text(UNO, encoding="utf-8")
    said = system.run(tmp_path, "pytest", "-q", "test_mine.py", code=1)
    assert "1 failed, 1 passed" in said and "waited 0.1 s for b'never said' from the board" in said
    (kept,) = (tmp_path / ".uno").glob("test_mine.py-test_waits_in_vain-*")
    assert {"pins.vcd", "serial.txt", "again.txt"} <= {path.name for path in kept.iterdir()}


@pytest.mark.parametrize("name", ["linux", "windows"])
def test_the_kits_own_tests_pass(request: pytest.FixtureRequest, tmp_path: Path, name: str) -> None:
    """Not on aarch64: they start Python anew, and this processor runs that only by QEMU."""
    system: System = request.getfixturevalue(name)
    assert " 4 passed" in system.boebot(tmp_path, "test", "--on", "native", "-k", "handshake")


def test_ctrl_c_ends_a_run_with_its_record(system: System, linux: System, tmp_path: Path) -> None:
    words = ["run", "wander", "--seconds", "1e6", "--realtime", "--out", "out"]
    with system.start(tmp_path, "boebot", *words) as process:
        until = time.perf_counter() + 60
        while not _has_begun(tmp_path / "out" / "record.mcap") and time.perf_counter() < until:
            time.sleep(0.2)
        time.sleep(2)
        os.killpg(process.pid, signal.SIGINT)
        said, _ = process.communicate(timeout=120)
    assert process.returncode == 130 and said.endswith("boebot: interrupted\n") and "Traceback" not in said
    assert "interrupted" in linux.boebot(tmp_path, "report", "out")


def _has_begun(record: Path) -> bool:
    return record.exists() and record.stat().st_size > 0


def test_a_folder_is_of_one_run(system: System, tmp_path: Path) -> None:
    """Another one is refused, also after a third; once the first is gone, even killed, nothing holds the folder."""
    words = ["run", "wander", "--realtime", "--out", "out", "--seconds"]
    with system.start(tmp_path, "python", "-m", "boebot", *words, "1e6") as process:
        until = time.perf_counter() + 60
        while not _has_begun(tmp_path / "out" / "record.mcap") and time.perf_counter() < until:
            time.sleep(0.2)
        for _ in range(2):
            assert "another process writes to out now" in system.boebot(tmp_path, *words, "1", code=1)
        os.killpg(process.pid, signal.SIGKILL)
    system.boebot(tmp_path, "run", "wander", "--out", "out", "--seconds", "1", "--quiet")
    assert not (tmp_path / "out" / ".running").exists()


def test_a_robot_is_served_to_another_system(system: System, linux: System, tmp_path: Path) -> None:
    """By TCP: it is found, reset and driven in real time."""
    with system.start(tmp_path, "boebot", "serve", "--tcp", "0", "--on", "native") as server:
        try:
            assert server.stdout is not None
            (url,) = re.findall(r"socket://127\.0\.0\.1:\d+", server.stdout.readline())
            assert "complete" in linux.boebot(tmp_path, "run", "wander", "--on", url, "--seconds", "3")
            assert "complete" in system.boebot(tmp_path, "run", "wander", "--on", url, "--seconds", "3")
        finally:
            os.killpg(server.pid, signal.SIGINT)
            said, _ = server.communicate(timeout=60)
    assert said.count(" came; the board is reset\n") == 2 and server.returncode == 0 and "Traceback" not in said


def test_errors_are_sentences(system: System, tmp_path: Path) -> None:
    """Also where a console lacks a character; names of files may have any."""
    (tmp_path / "größe 日本").mkdir()
    words = ["run", "wander", "--seconds", "1", "--quiet", "--out"]
    system.boebot(tmp_path, *words, str(Path("größe 日本", "out")))
    assert (tmp_path / "größe 日本" / "out" / "record.mcap").exists()
    said = system.boebot(tmp_path, "run", "日本.py", code=1)
    shown = "日本" if system.encoding == "utf-8" else "??"
    assert f" {shown}.py" in said and len(said.splitlines()) == 1
    said = system.boebot(tmp_path, "run", "größe.hex", code=2)
    assert "größe.hex" in said and len(said.splitlines()) == 1


def test_a_library_of_another_system_is_one_sentence(system: System, wheels: dict[str, Path], tmp_path: Path) -> None:
    """A wheel of another system is unpacked over this one, or a library is cut short."""
    words = ["run", "wander", "--seconds", "0.1", "--on"]
    place = Path(system.run(tmp_path, "python", "-c", "import sim_bridge; print(sim_bridge.__path__[0])").strip())
    folder = Path(str(place).removeprefix("Z:").replace("\\", "/"))
    with ZipFile(wheels["macosx_11_0_arm64" if system.name == "aarch64" else "manylinux_2_17_aarch64"]) as archive:
        others = {NATIVE.sub("", name): archive.read(name) for name in archive.namelist() if NATIVE.search(name)}
    for name, board in (("_core", "native"), ("boards/avr/_avr", "avr"), ("images/firmware-shieldbot", "native")):
        (file,) = (path for path in folder.glob(f"{name}.*") if NATIVE.search(path.name))
        whole = file.read_bytes()
        for data in (others[f"sim_bridge/{name}"], whole[: len(whole) // 2]):
            file.unlink()
            file.write_bytes(data)
            said = system.boebot(tmp_path, *words, board, code=1)
            assert re.search(rf"{file.name} cannot be loaded.*: .+; type `pip install --force-rei", said), said
            assert len(said.splitlines()) == 1, said
        file.unlink()
        file.write_bytes(whole)
        assert "complete" in system.boebot(tmp_path, *words, board)


# ---- what only Windows has -----------------------------------------------------------------------------------------


def test_windows_prints_in_its_code_page(windows: System, tmp_path: Path) -> None:
    said = windows.run(tmp_path, "python", "-c", "import sys, boebot.system as it; print(sys.stdout.encoding, it.LOCK)")
    assert said.split() == ["cp1252", ".running"]
    for words in (["list", "imperfections"], ["show", "robot", "shieldbot"], ["run", "--help"]):
        assert len(windows.boebot(tmp_path, *words).splitlines()) > 20


def test_windows_knows_its_paths(windows: System, tmp_path: Path) -> None:
    """With drive and backslashes."""
    (tmp_path / "my brains").mkdir()
    (tmp_path / "my brains" / "dice.py").write_text(DICE, encoding="utf-8")
    brain, out = tmp_path / "my brains" / "dice.py", tmp_path / "my runs" / "out"
    windows.boebot(tmp_path, "run", on_windows(brain), "--seconds", "1", "--out", on_windows(out), "--quiet")
    assert (out / "record.mcap").exists()
    assert "wrote whiskers\\whiskers.ino" in windows.boebot(tmp_path, "new", "whiskers", "--sketch")


def test_windows_drives_a_robot_at_a_com_port(windows: System, linux: System, tmp_path: Path) -> None:
    """Wine's COM5 is a pseudo-terminal here, behind which this system serves a robot."""
    port = Path(windows.environment["WINEPREFIX"], "dosdevices", "com5")
    with linux.start(tmp_path, "boebot", "serve", "--pty", "--on", "native") as server:
        try:
            assert server.stdout is not None
            (name,) = re.findall(r"/dev/pts/\d+", server.stdout.readline())
            port.symlink_to(name)
            said = windows.boebot(tmp_path, "run", "wander", "--on", "COM5", "--seconds", "3")
            assert "(COM5" in said and "complete" in said
            assert " are well" in windows.boebot(tmp_path, "doctor", "COM5")
        finally:
            os.killpg(server.pid, signal.SIGINT)
            server.communicate(timeout=60)
    said = windows.boebot(tmp_path, "run", "wander", "--on", "COM9", code=1)
    assert said.startswith("boebot: there is no port COM9; ") and len(said.splitlines()) == 1
