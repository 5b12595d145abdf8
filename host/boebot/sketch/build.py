"""Builds a sketch or a project, by PlatformIO: the ELF file, kept in the user's cache.

PlatformIO turns .ino files into C++ in the folder of the sources, so a sketch is built as a copy; what the compiler
says, and the debugging information, name the user's own files. The ELF file of a sketch is kept under a hash of all
that it is made of: its files and the tools. With the same ones it is there at once, and PlatformIO is not even loaded.
A project may be made of anything; PlatformIO looks each time at what has changed, in the project's own folder.

    cache/core-HASH/            a core directory for PlatformIO, without its registry
    cache/libraries/            libraries that were downloaded
    cache/objects-HASH/         compiled files, for all builds
    cache/builds/HASH/          of a user's folder: the copy, and PlatformIO's files; build.log: all that it said
    cache/programs/HASH/        finished ELF files

One build at a time. What is finished gets its name in one go, so that it is whole or not there.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from boebot import missing, system
from boebot.errors import BoebotError, CallError, SketchError
from boebot.sketch import cache, core_directory, servo
from boebot.sketch.find import LIBRARIES, PROJECT, Sketch, below, find

Progress = Callable[[float], object]  # is called with the seconds that a build has taken

HERE = Path(__file__).resolve().parent
BOARDS = sorted(path.stem for path in HERE.glob("platforms/atmelavr/boards/*.json"))  # with the chip that is emulated
CLOCK = "16000000L"  # Hz, of that chip
SILENCE_S = 30.0  # of PlatformIO, after which it waits for what cannot be reached
DEBIAN = "arduino-core-avr gcc-avr avr-libc"  # its packages: Arduino's framework and the compiler
FULL = "No space left on device"  # what tools say of a disk, in the language that they are set to here
FURTHER_ERRORS = 3  # that are shown after the first one
SKETCH_INI = """\
[platformio]
src_dir = sketch

[env:uno]
platform = atmelavr
board = uno
framework = arduino
build_src_filter = +<*> -<libraries/>
lib_extra_dirs = sketch/libraries
"""
_ERROR = re.compile(r"^(?P<file>[^\s:][^:\n]*):(?P<line>\d+):(?:\d+:)? (?:fatal )?error: (?P<what>.+)$", re.MULTILINE)
_MISSING = re.compile(r"(\S+): No such file or directory$")
_TOO_LARGE = {
    re.compile(r"region `text'|The program size"): "the 32,256 bytes of flash that are for programs",
    re.compile(r"region `data'|The data size"): "the 2,048 bytes of RAM, with its variables alone",
}
_NO_PLACE = re.compile(r"undefined reference to .+|multiple definition of [^:\n]+|^\w*Error: .+", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Built:
    """What came of a build.

    Attributes:
        name: of the sketch or project, as people know it.
        elf: the file.
        sources: the sketch's own files by their names in its folder.
    """

    name: str
    elf: Path
    sources: Mapping[str, bytes] = field(default_factory=dict)


def built(path: Path, progress: Progress | None = None) -> Built:
    """The program of a sketch or project.

    Raises:
        CallError: the path is none, it means several, or it is for another board.
        SketchError: it does not compile, or is too large.
        BoebotError: a tool is missing, or a file cannot be read or written.
    """
    found = find(path)
    try:
        return _sketch(found, progress) if found.files else _project(found, progress)
    except shutil.Error as error:  # of a folder's copy: a list of what went wrong
        raise BoebotError(f"{found.name} cannot be built: {error.args[0][0][-1]}") from None
    except OSError as error:
        what = f"{error.filename or cache()}: {error.strerror or error}"
        raise BoebotError(f"{found.name} cannot be built: {what}") from None


def _sketch(sketch: Sketch, progress: Progress | None) -> Built:
    tools = _Tools.found()
    key = _hash(tools.versions, sketch.folder, sketch.name, sorted(sketch.files.items()))
    elf = cache() / "programs" / key / f"{Path(sketch.name).stem}.elf"
    if not _is_whole(elf):
        with _alone():
            if not _is_whole(elf):
                _keep(_build_sketch(tools, sketch, progress), elf)
    own = {name: data for name, data in sketch.files.items() if not name.startswith(f"{LIBRARIES}/")}
    return Built(name=sketch.name, elf=elf, sources=own)


def _build_sketch(tools: _Tools, sketch: Sketch, progress: Progress | None) -> Path:
    work = _work(tools.versions, sketch.folder, sketch.name)
    copy = work / "sketch"
    shutil.rmtree(copy, ignore_errors=True)
    for name, data in sketch.files.items():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        (copy / name).write_bytes(data.removeprefix(b"\xef\xbb\xbf"))  # UTF-8's mark, which joined files have inside
    (work / PROJECT).write_text(SKETCH_INI, encoding="utf-8")
    return _PlatformIO(tools, work, progress, servo.is_needed(sketch.files)).build(sketch, "uno", work, copy)


def _project(project: Sketch, progress: Progress | None) -> Built:
    tools = _Tools.found()
    with _alone():
        process = _PlatformIO(tools, _work(tools.versions, project.folder), progress)
        code, said = process.run("project", "config", "--json-output", "-d", str(project.folder))
        if code:
            raise CallError(f"{project.shown / PROJECT} is no project of PlatformIO's: {' '.join(said.split())}")
        sections = {name: dict(options) for name, options in json.loads(said.strip().rpartition("\n")[2])}
        src = project.folder / sections.get("platformio", {}).get("src_dir", "src")
        process.needs_servo = "servo" not in str(sections).lower() and servo.is_needed(
            {one.name: one.read_bytes() for folder in (src, project.folder / "lib") for one in below(folder)}
        )
        made = process.build(project, _environment(project, sections), project.folder, project.folder)
        elf = cache() / "programs" / _hash(made.read_bytes()) / f"{project.name}.elf"
        _keep(made, elf)
    return Built(name=project.name, elf=elf)


def _environment(project: Sketch, sections: Mapping[str, Mapping[str, Any]]) -> str:
    """The one environment of a project that is for a board with the chip that is emulated."""
    environments = {name.removeprefix("env:"): of for name, of in sections.items() if name.startswith("env:")}
    default = sections.get("platformio", {}).get("default_envs") or environments
    boards = {name: of.get("board") for name, of in environments.items() if name in default}
    clocks = {name: environments[name].get("board_build.f_cpu", CLOCK) for name in boards}
    fitting = [name for name, board in boards.items() if board in BOARDS and clocks[name] == CLOCK]
    ini = project.shown / PROJECT
    if not fitting:
        there = [f"{name} (board {board})" for name, board in boards.items()] or ["none"]
        expected = f"one for {', '.join(BOARDS[:-1])} or {BOARDS[-1]}, whose clock is {CLOCK}"
        raise CallError(f"{ini} has the environments {', '.join(there)}; expected {expected}")
    if len(fitting) > 1:
        names = ", ".join(fitting)
        raise CallError(f"{ini} has several environments, {names}; expected default_envs = {fitting[0]}, say, in it")
    return fitting[0]


# ---- PlatformIO ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Tools:
    """On what PlatformIO's builds depend, and whether the distribution's packages do it."""

    versions: str
    is_prepared: bool

    @property
    def expected(self) -> str:
        """Where PlatformIO can have compiler and framework from."""
        here = "" if self.is_prepared else missing.installer(apt_get=DEBIAN)
        return f"expected its registry within reach{here and ', or here: '}{here}"

    @classmethod
    def found(cls) -> _Tools:
        """With the distribution's packages where all of them are there, else with PlatformIO's registry.

        Raises:
            BoebotError: there is no PlatformIO.
        """
        kits = [one.read_bytes() for one in sorted(HERE.rglob("*.*")) if one.suffix in (".py", ".json")]
        compiler, framework = shutil.which("avr-gcc"), core_directory.ARDUINO / "platform.txt"
        if importlib.util.find_spec("platformio") is None:
            raise BoebotError(missing.package("building sketches", "PlatformIO", "firmware"))
        if importlib.util.find_spec("SCons") and compiler and framework.is_file():
            files = [one.stat() for one in (Path(compiler).resolve(), framework)]
            told = [version("platformio"), version("scons"), *((one.st_size, one.st_mtime_ns) for one in files)]
            return cls(_hash(kits, told), True)
        return cls(_hash(kits), False)


@dataclass
class _PlatformIO:
    """PlatformIO for one folder of the user's; `work`: the folder for its files."""

    tools: _Tools
    work: Path
    progress: Progress | None
    needs_servo: bool = False

    def build(self, found: Sketch, environment: str, folder: Path, base: Path) -> Path:
        """Builds an environment of the project in `folder`: the ELF file. `base`: what is the user's folder there.

        Raises:
            OSError: the disk is full.
            SketchError: it does not compile, or is too large.
        """
        folders = {base: found.folder, base.relative_to(folder): found.folder}
        code, said = self.run("run", "-d", str(folder), "-e", environment, folders=folders)
        if code and FULL in said:
            raise OSError(errno.ENOSPC, FULL, cache())
        made = sorted((self.work / "build" / environment).glob("*.elf"), key=lambda one: one.stat().st_mtime)
        if code or not made or "The data size " in said:
            raise self._fault(found, said, folder, base)
        return made[-1]

    def run(self, *arguments: str, folders: Mapping[Path, Path] | None = None) -> tuple[int, str]:
        """Calls it: its exit code, and all that it said, which is in build.log, too. `folders`: the user's, which
        debugging information names, for those where files are compiled.

        Raises:
            BoebotError: it says nothing more, as where it waits for a network.
        """
        settings = {
            "WORKSPACE_DIR": self.work / "workspace",
            "BUILD_DIR": self.work / "build",
            "BUILD_CACHE_DIR": cache() / f"objects-{self.tools.versions}",
            "BUILD_FLAGS": "-gdwarf-4",
            "EXTRA_SCRIPTS": f"post:{HERE / 'link_flags.py'}",
            "SETTING_ENABLE_TELEMETRY": "no",
            "DISABLE_UPGRADE_CHECK": "true",
            "NO_ANSI": "true",
        }
        if self.tools.is_prepared:
            settings["CORE_DIR"] = _core(self.tools)
        if self.needs_servo:
            settings["GLOBALLIB_DIR"] = servo.libraries()
        mapped = [f"{one}={users}" for one, users in (folders or {}).items() if one not in (Path(), users)]
        own = {"LC_ALL": "C", "BOEBOT_FOLDERS": json.dumps(mapped)}
        environment = {f"PLATFORMIO_{name}": str(value) for name, value in settings.items()} | own
        log, begin_s = self.work / "build.log", time.perf_counter()
        heard_s, size = begin_s, 0
        with (
            log.open("wb") as words,
            ended(
                subprocess.Popen(
                    [sys.executable, "-m", "platformio", *arguments],
                    cwd=self.work,
                    env=os.environ | environment,
                    stdin=subprocess.DEVNULL,
                    stdout=words,
                    stderr=subprocess.STDOUT,
                    **system.NEW_GROUP,  # Ctrl-C comes to it from here
                )
            ) as process,
        ):
            while process.poll() is None:
                time.sleep(0.02)
                now_s = time.perf_counter()
                if size != (size := log.stat().st_size):
                    heard_s = now_s
                if now_s - heard_s > SILENCE_S:
                    last = log.read_text("utf-8", "replace").strip().rpartition("\n")[2]
                    silent = f"PlatformIO says nothing more for {SILENCE_S:g} s after {last!r}"
                    raise BoebotError(f"{silent}; {self.tools.expected}; see {log}")
                if self.progress is not None:
                    self.progress(now_s - begin_s)
        return process.returncode, log.read_text("utf-8", "replace")

    def _fault(self, found: Sketch, said: str, folder: Path, base: Path) -> SketchError:
        """What the compiler says, with the user's own paths."""
        too_large = [what for sign, what in _TOO_LARGE.items() if sign.search(said)]
        errors = []
        for one in _ERROR.finditer(said):
            path, what = Path(folder, one["file"]), one["what"]
            place = found.shown / path.relative_to(base) if path.is_relative_to(base) else path
            if header := _MISSING.search(what):
                there = LIBRARIES if found.files else f"lib, or named by lib_deps in {PROJECT}"
                what = f"there is no {header[1]}; expected its library in {found.shown / there}"
            errors.append(f"{place}:{one['line']}: {what}")
        errors = list(dict.fromkeys(errors or _NO_PLACE.findall(said))) or [f"PlatformIO failed; {self.tools.expected}"]
        sentence = f"does not fit into {too_large[0]}" if too_large else f"does not compile: {errors[0]}"
        error = SketchError(f"{found.name} {sentence}")
        for note in (*errors[1 : 1 + FURTHER_ERRORS], f"all that was said is in {self.work / 'build.log'}"):
            error.add_note(note)
        return error


@contextlib.contextmanager
def ended(process: subprocess.Popen[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """Ends it afterwards, with all that it has begun, if it has not: by Ctrl-C first, for then it tidies up."""
    try:
        yield process
    finally:
        for by_force in (False, True):
            if process.poll() is None:
                with contextlib.suppress(ProcessLookupError, subprocess.TimeoutExpired):
                    system.end_group(process, by_force=by_force)
                    process.wait(timeout=5)


# ---- the cache -------------------------------------------------------------------------------------------------------


def _core(tools: _Tools) -> Path:
    """The prepared core directory; made the first time, and where it was deleted while PlatformIO was at work, which
    makes folders in it anew."""
    core = cache() / f"core-{tools.versions}"
    if not (core / core_directory.SCONS_FILE).is_file():
        part = core.with_name(".part-core")
        shutil.rmtree(part, ignore_errors=True)
        core_directory.prepare(part)
        shutil.rmtree(core, ignore_errors=True)
        part.replace(core)
    return core


def _work(*of: object) -> Path:
    """A folder for what belongs to that."""
    work = cache() / "builds" / _hash(of)
    work.mkdir(parents=True, exist_ok=True)
    return work


def _is_whole(elf: Path) -> bool:
    """It is there, and no computer has lost its power before it was on the disk."""
    return elf.is_file() and elf.stat().st_size > 0


def _keep(made: Path, elf: Path) -> None:
    """The finished file, whole or not at all."""
    elf.parent.mkdir(parents=True, exist_ok=True)
    part = elf.with_name(f".part-{elf.name}")
    shutil.copyfile(made, part)
    part.replace(elf)


@contextlib.contextmanager
def _alone() -> Iterator[None]:
    """No other process builds meanwhile."""
    cache().mkdir(parents=True, exist_ok=True)
    with (cache() / "lock").open("w") as lock:
        system.lock(lock)
        yield


def _hash(*of: object) -> str:
    return hashlib.sha256(repr(of).encode("utf-8", "surrogateescape")).hexdigest()[:32]
