"""Sketches and projects are built by the real PlatformIO and compiler."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from boebot.errors import BoebotError, CallError, SketchError
from boebot.image.elf import read_image
from boebot.sketch import build, cache, servo
from boebot.sketch.build import built

PARTS = {
    "robot.ino": "#include <EEPROM.h>\n#include <Foo.h>\nvoid setup() { turn(foo()); }\nvoid loop() {}\n",
    # the comment must not hide that this needs a prototype
    "turn.ino": "\nvoid turn(int angle) // in degrees\n{\n  PORTB = angle;\n  EEPROM.write(0, 1);\n}\n",
    "src/deep.cpp": "int deep() { return 1; }\n",
    "libraries/Foo/Foo.h": "int foo();\n",
    "libraries/Foo/Foo.cpp": '#include "Foo.h"\nint foo() { return 42; }\n',
}
INI = "[env:a]\nplatform = atmelavr\nboard = {}\nframework = arduino\n"


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_a_sketch_is_built_once_and_its_lines_are_the_users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write(tmp_path / "my bots" / "robot", PARTS)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    made = built(folder)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    assert (made.name, made.elf.name) == ("robot.ino", "robot.elf")
    assert set(made.sources) == {"robot.ino", "turn.ino", "src/deep.cpp"}
    assert "turn.ino:4" in read_image(made.elf).lines.values()
    command = ["avr-objdump", "--dwarf=rawline", str(made.elf)]
    folders = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert str(folder) in folders and str(cache() / "builds") not in folders

    with monkeypatch.context() as patched:
        patched.setattr(build, "_PlatformIO", None)
        assert built(folder / "robot.ino").elf == made.elf
    write(folder, {"turn.ino": PARTS["turn.ino"].replace("(0, 1)", "(0, 2)")})
    assert built(folder).elf.read_bytes() != made.elf.read_bytes()


@pytest.mark.parametrize(
    ("text", "sentence", "note"),
    [
        (
            "void setup() {\n  x = 1;\n  y();\n}\nvoid loop() {}",
            "a.ino does not compile: {0}/a.ino:2: 'x' was",
            "a.ino:3:",
        ),
        pytest.param(
            "void loop() {}",
            "a.ino does not compile: undefined reference to `setup'",
            "all that was said is in",
            marks=pytest.mark.soak,
        ),
        (
            "#include <No.h>\nvoid setup() {}\nvoid loop() {}",
            "a.ino does not compile: {0}/a.ino:1: there is no No.h; expected its library in {0}/libraries",
            "all that was said is in",
        ),
        (
            "const byte a[20000] PROGMEM = {1}, b[20000] PROGMEM = {1};\n"
            "void setup() { PORTB = pgm_read_byte(a + PINC) + pgm_read_byte(b + PINC); }\nvoid loop() {}",
            "a.ino does not fit into the 32,256 bytes of flash that are for programs",
            "all that was said is in",
        ),
        pytest.param(
            "byte a[2040];\nvoid setup() { a[PINC * 8] = PINB; PORTB = a[PIND * 8]; }\nvoid loop() {}",
            "a.ino does not fit into the 2,048 bytes of RAM, with its variables alone",
            "all that was said is in",
            marks=pytest.mark.soak,
        ),
    ],
)
def test_what_does_not_compile_is_a_sentence(tmp_path: Path, text: str, sentence: str, note: str) -> None:
    write(tmp_path, {"a.ino": text})
    with pytest.raises(SketchError) as raised:
        built(tmp_path / "a.ino")
    assert str(raised.value).startswith(sentence.format(tmp_path))
    assert any(note in one for one in raised.value.__notes__)
    assert Path(raised.value.__notes__[-1].removeprefix("all that was said is in ")).is_file()


@pytest.mark.parametrize(
    ("ini", "kind", "sentence"),
    [
        (INI.format("uno") + INI.format("nanoatmega328").replace(":a", ":b"), CallError, "several environments, a, b"),
        (INI.format("megaatmega2560"), CallError, r"has the environments a \(board megaatmega2560\); expected"),
        pytest.param(
            INI.format("uno\nboard_build.f_cpu = 8000000L"),
            CallError,
            "expected one for nano.* or uno, whose clock is 16000000L",
            marks=pytest.mark.soak,
        ),
        ("", CallError, "car/platformio.ini has the environments none; expected one for"),
        pytest.param("[env:a", CallError, "is no project of PlatformIO's", marks=pytest.mark.soak),
        (
            INI.format("uno") + "extra_scripts = pre:wait.py\n",
            BoebotError,
            "says nothing more for 0.7 s after .*; see /",
        ),
    ],
)
def test_a_project_that_cannot_be_built_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ini: str, kind: type[BoebotError], sentence: str
) -> None:
    if "wait" in ini:
        monkeypatch.setattr(build, "SILENCE_S", 0.7)
    wait = "import time\ntime.sleep(60)\n"
    folder = write(tmp_path / "car", {"platformio.ini": ini, "src/main.cpp": "nothing\n", "wait.py": wait})
    with pytest.raises(kind, match=sentence.format(folder)):
        built(folder)


def test_a_project_is_built_where_it_is_with_its_own_options(tmp_path: Path) -> None:
    ini = INI.format("nanoatmega328") + "build_flags = -DA=1 -DB=2\n" + INI.format("megaatmega2560").replace(":a", ":b")
    folder = write(tmp_path / "car", {"platformio.ini": ini, "src/main.cpp": "nothing\n"})
    with pytest.raises(SketchError, match=f"car does not compile: {folder}/src/main.cpp:1: 'nothing' does not name a"):
        built(folder)
    write(folder, {"src/main.cpp": "#include <Arduino.h>\nvoid setup() { PORTB = A + B; }\nvoid loop() {}\n"})
    made = built(folder)
    assert made.elf.name == "car.elf" and "main.cpp:2" in read_image(made.elf).lines.values()
    assert {path.name for path in folder.rglob("*")} == {"platformio.ini", "src", "main.cpp"}


BUILD = (
    "import sys; from pathlib import Path; from boebot.sketch.build import built; print(built(Path(sys.argv[1])).elf)"
)


def test_two_at_once_and_one_that_is_interrupted_leave_nothing_half(tmp_path: Path) -> None:
    folder = write(tmp_path / "robot", PARTS)
    command = [sys.executable, "-c", BUILD, str(folder)]
    programs = set(cache().glob("programs/*/robot*"))  # other tests build at the same time
    first = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    work = cache() / "builds"
    while not any("Scanning" in log.read_text() for log in work.glob("*/build.log") if _is_of(log, folder)):
        assert first.poll() is None
        time.sleep(0.01)
    first.send_signal(signal.SIGINT)
    first.communicate(timeout=20)
    assert set(cache().glob("programs/*/robot*")) == programs
    other = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    elf = built(folder).elf
    assert other.communicate(timeout=60)[0].strip() == str(elf) and elf.is_file()


def _is_of(log: Path, folder: Path) -> bool:
    return log.parent.name == build._work(build._Tools.found().versions, folder.resolve(), "robot.ino").name


def test_servo_comes_by_pip_or_is_missed_in_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert servo.is_needed({"a.ino": b" # include <Servo.h>\n"})
    assert not servo.is_needed({"a.ino": b'#include "Servo.h"', "lib/Servo.h": b""})
    assert not servo.is_needed({"a.ino": b"// #include <Servo.h>\n"})
    assert "Michael Margolis" in (servo.libraries() / "Servo" / "Servo.cpp").read_text()
    monkeypatch.setenv("BOEBOT_CACHE", str(tmp_path))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.delenv("PIP_FIND_LINKS", raising=False)
    with pytest.raises(
        BoebotError, match=r"the library Servo, package arduino-servo==0.1, cannot be had: .*; expected"
    ):
        servo.libraries()
    assert not (tmp_path / "libraries" / "Servo").exists()


def test_without_platformio_there_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, {"a.ino": ""})
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))
    with pytest.raises(BoebotError, match=r"PlatformIO, which is not installed: pip install 'boebot\[firmware\]'"):
        built(tmp_path / "a.ino")


def test_a_core_directory_deleted_under_a_build_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BOEBOT_CACHE", str(tmp_path))
    tools = build._Tools("0", True)
    core = build._core(tools)
    shutil.rmtree(core)
    write(core, {"appstate.json": "{}"})  # as PlatformIO, still at work, leaves it
    assert (build._core(tools) / "platforms" / "atmelavr" / "platform.json").is_file()


def test_a_full_disk_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BOEBOT_CACHE", str(tmp_path / "cache"))
    folder = write(tmp_path / "a", {"a.ino": "void setup() {}\nvoid loop() {}"})
    said = "ar: libFrameworkArduino.a: No space left on device\n*** Error 1"
    monkeypatch.setattr(build._PlatformIO, "run", lambda *_, **__: (1, said))
    with pytest.raises(BoebotError, match=r"^a.ino cannot be built: .*cache: No space left on device$"):
        built(folder)
    assert not list(tmp_path.rglob("*.elf"))


def test_the_cache_is_where_the_user_wants_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("BOEBOT_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache() == tmp_path / "boebot"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache() == tmp_path / ".cache" / "boebot"
