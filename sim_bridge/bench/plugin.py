"""The pytest plugin: the fixture `uno`, an Uno with the program that a test's mark names, and what it measured.

    @pytest.mark.uno(image="own.elf")
    def test_servo(uno): ...

A test that fails leaves a folder with its name: pins.vcd for GTKWave and PulseView, serial.txt, run with its record
where there is a robot, and again.txt, the command that repeats it.

pytest loads this file in every session wherever the kit is installed, so that it imports nothing but pytest and the
standard library until the fixture is used.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import re
import shlex
import shutil
import sys
from collections import Counter
from collections.abc import Collection, Generator, Iterator
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_bridge.bench.cycles import Baseline
    from sim_bridge.bench.uno import Uno, Wanted

MARK = "uno"
JUDGED = pytest.StashKey[int]()  # of a test that passed so far: how many of its measurements were looked at
# Names of the properties of a test's report, which reach JUnit's file.
MEASURED, CANNOT, CYCLES = "uno.measured.", "uno.cannot", "uno.cycles"
BASELINE, UPDATE, KEEP = "uno-baseline.json", "update", ".uno"
MEASURED_FILE, COVER_FILE = "measured.json", "cover.info"
LONGEST_NAME = 80  # letters of a folder's name, before its hash
KIT = ("boebot", "sim_bridge")  # packages
UNO: pytest.StashKey[Uno] = pytest.StashKey()
SESSION: pytest.StashKey[Session] = pytest.StashKey()
KEYWORDS = ("image", "robot", "arena", "seed", "noise", "baud", "motors", "cycles", "faults")


# ---- options and marks -----------------------------------------------------------------------------------------------


def pytest_addoption(parser: pytest.Parser) -> None:
    """See `pytest --help`."""
    group = parser.getgroup("uno", "tests of an Uno, emulated or at a port (boebot)")
    group.addoption(
        "--uno-on", action="append", metavar="BOARD", help="avr (default), native or a port; may be given again"
    )
    group.addoption("--uno-flash", action="store_true", help="write the tests' programs into the board at the port")
    group.addoption("--uno-motors", action="store_true", help="the motors at a board behind a port may turn")
    group.addoption(
        "--uno-baseline",
        metavar="FILE|update",
        help="cycles of functions as they were: a change fails (uno-baseline.json, if it is there); update writes that",
    )
    group.addoption("--uno-cover", action="store_true", help="lines and conditional jumps that the tests have executed")
    keep_help = "where what failing tests leave goes, and measured.json (.uno)"
    group.addoption("--uno-keep", metavar="DIR", default=KEEP, help=keep_help)


def pytest_configure(config: pytest.Config) -> None:
    """Its mark; and refuses a board that is none, a port that several processes would open, and a file that is no
    baseline."""
    config.addinivalue_line("markers", f"uno({'=, '.join(KEYWORDS)}=): what the fixture `uno` has in it")
    config.stash[SESSION] = session = Session(config)
    config.pluginmanager.register(session, "uno-session")
    for board in {*boards(config)} - {"avr", "native"}:
        from boebot.boards import is_live

        if not is_live(board):
            raise pytest.UsageError(f"there is no board {board!r}; expected avr, native or a port such as /dev/ttyACM0")
        if getattr(config.option, "numprocesses", None) or hasattr(config, "workerinput"):
            raise pytest.UsageError(f"--uno-on={board}: one process at a time can have it open; expected no -n")
    if config.getoption("--uno-baseline") is not None:
        from boebot.errors import CallError

        try:
            _ = session.baseline
        except CallError as error:
            raise pytest.UsageError(str(error)) from None


def boards(config: pytest.Config) -> list[str]:
    """Those under test."""
    return config.getoption("--uno-on") or ["avr"]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Each test on each board, where several are given."""
    if MARK in metafunc.fixturenames and len(given := boards(metafunc.config)) > 1:
        metafunc.parametrize(MARK, given, indirect=True)


# ---- the fixture -----------------------------------------------------------------------------------------------------


@pytest.fixture
def uno(request: pytest.FixtureRequest) -> Iterator[Uno]:
    """An Uno with the program that the test's mark `uno` names, just powered on."""
    from boebot.errors import BoebotError

    board = getattr(request, "param", None) or boards(request.config)[0]
    try:
        from sim_bridge.bench.uno import open_uno

        flash, motors = (request.config.getoption(name) for name in ("--uno-flash", "--uno-motors"))
        opened = open_uno(board, _wanted(request.node), flash=flash, motors=motors)
    except BoebotError as error:
        if _cannot(error):
            raise
        sentence = "\n".join([f"uno: {error}", *getattr(error, "__notes__", ())])
        raise pytest.fail.Exception(sentence, pytrace=False) from None
    request.node.stash[UNO] = opened
    yield opened
    request.config.stash[SESSION].take_cover(opened)
    request.node.user_properties += [(MEASURED + one.name, json.dumps(vars(one))) for one in opened.measured]
    judged = request.node.stash.get(JUDGED, None)
    wrong = [] if judged is None else [*_beyond(opened, judged), *filter(None, [opened.unfired()])]
    if wrong:
        pytest.fail("uno: " + "\n".join(wrong), pytrace=False)


def _wanted(item: pytest.Item) -> Wanted:
    """What the marks of a test ask for, the nearest one first. Raises CallError where they make no sense."""
    from boebot.errors import CallError, did_you_mean
    from sim_bridge.bench.uno import Wanted

    marks = list(item.iter_markers(MARK))
    asked: dict[str, Any] = {}
    for mark in reversed(marks):
        if mark.args:
            raise CallError(f"@pytest.mark.uno({mark.args[0]!r}): expected a keyword, such as image={mark.args[0]!r}")
        if unknown := next((name for name in mark.kwargs if name not in KEYWORDS), None):
            hint = did_you_mean(unknown, KEYWORDS)
            raise CallError(f"@pytest.mark.uno({unknown}=...): expected one of {', '.join(KEYWORDS)}{hint}")
        asked |= mark.kwargs
    for name in ("cycles", "faults"):
        given = asked.get(name, ())
        several = (given,) if isinstance(given, str) else given
        if not isinstance(several, Collection) or not all(isinstance(one, str) and one for one in several):
            raise CallError(f"@pytest.mark.uno({name}={given!r}): expected a text, or several")
        asked[name] = tuple(several)
    session = item.config.stash[SESSION]
    known = session.baseline.functions(item.nodeid) if session.baseline else ()
    asked |= {"cover": session.coverage is not None, "cycles": tuple(dict.fromkeys((*asked["cycles"], *known)))}
    if not isinstance(robot := asked.get("robot"), str | None):
        raise CallError(f"robot={robot!r}; expected its name or its .toml file")
    if (image := asked.get("image")) is not None:
        asked["image"] = session.program(_file(item, image))
    return Wanted(**asked)


def _file(item: pytest.Item, image: object) -> Path:
    """Of that name beside the test, or else in the root of all."""
    from boebot.errors import CallError

    if not isinstance(image, str | Path):
        raise CallError(f"image={image!r}; expected the name of a file")
    places = [item.path.parent / image, item.config.rootpath / image]
    for place in places:
        if place.exists():
            return place
    raise CallError(f"there is no {image}, neither in {places[0].parent} nor in {places[1].parent}")


# ---- how a test ends -------------------------------------------------------------------------------------------------


def _cannot(error: BaseException) -> bool:
    """The board cannot be asked that."""
    waiting = sys.modules.get("sim_bridge.bench.waiting")
    return waiting is not None and isinstance(error, waiting.Cannot)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, object, object]:
    """What the board cannot do is skipped."""
    return (yield from _judged(item))


pytest_runtest_teardown = pytest_runtest_setup


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """What the board cannot do is skipped; values beyond their limits, and cycles that are not as they were, fail the
    test when it has ended."""
    result = yield from _judged(item)
    if (opened := item.stash.get(UNO, None)) is not None:
        wrong = _beyond(opened)
        if opened.recorded is not None and (baseline := item.config.stash[SESSION].baseline):
            wrong += baseline.changes(item.nodeid, opened.recorded.seen())
        if wrong:
            pytest.fail("\n".join(wrong), pytrace=False)
        item.stash[JUDGED] = len(opened.measured)
    elif any(mark.name == MARK for mark in item.own_markers):
        pytest.fail(f"uno: {item.name} has the mark, and no board; expected the fixture: def test(uno)", pytrace=False)
    return result


def _beyond(opened: Uno, begin: int = 0) -> list[str]:
    """What was measured beyond its limits, in sentences, without the first `begin` measurements."""
    return [one.text for one in opened.measured[begin:] if one.verdict == "fail"]


def _judged(item: pytest.Item) -> Generator[None, object, object]:
    try:
        return (yield)
    except Exception as error:
        if _cannot(error):
            item.user_properties.append((CANNOT, str(error)))
            raise pytest.skip.Exception(str(error), _use_item_location=True) from None
        if (errors := sys.modules.get("boebot.errors")) and isinstance(error, AssertionError | errors.BoebotError):
            _leave_out_the_kit(item, error.__traceback__)
        raise


def _leave_out_the_kit(item: pytest.Item, first: TracebackType | None) -> None:
    """Of a traceback: it ends by the line of the test's own folder that has called the kit, or that the kit has."""
    frames: list[TracebackType] = []
    own = 0  # up to the last of the folder
    while first is not None:
        name = first.tb_frame.f_globals.get("__name__", "").partition(".")[0]
        is_own = Path(first.tb_frame.f_code.co_filename).is_relative_to(item.path.parent)
        if not frames or is_own or name not in KIT:
            frames.append(first)
            own = len(frames) if is_own else own
        first = first.tb_next
    for frame, following in zip(frames[:own], [*frames[1:own], None], strict=True) if own else ():
        frame.tb_next = following


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """The cycles of a test go into its report, and to files what there was at the board where it fails."""
    opened = item.stash.get(UNO, None)
    if opened is not None and call.when == "call" and opened.recorded is not None:
        seen = [dataclasses.asdict(one) for one in opened.recorded.seen()]
        item.user_properties.append((CYCLES, json.dumps(seen)))
    report = yield
    if opened is not None:
        if call.when == "setup" or report.failed:
            shutil.rmtree(_folder(item), ignore_errors=True)  # of an earlier time
        if report.failed:
            report.sections.append(("uno", _keep(item, opened)))
        if call.when == "teardown":
            opened.close()
    return report


def _folder(item: pytest.Item) -> Path:
    """Where what a test leaves goes."""
    short = re.sub(r"[^\w.]+", "-", item.nodeid.rpartition("/")[2])[:LONGEST_NAME].strip("-")
    name = f"{short}-{hashlib.sha256(item.nodeid.encode()).hexdigest()[:8]}"
    return Path(item.config.rootpath, item.config.getoption("--uno-keep"), name)


def _keep(item: pytest.Item, opened: Uno) -> str:
    """Writes what happened at the board; says where that is, and how to repeat the test."""
    folder, again = _folder(item), _command(item.config, item.nodeid)
    said = [f"kept in {os.path.relpath(folder) if folder.is_relative_to(Path.cwd()) else folder}", f"again: {again}"]
    for name, write in (
        ("again.txt", lambda file: file.write_text(f"{again}\n", encoding="utf-8")),
        ("serial.txt", lambda file: file.write_bytes(opened.serial.heard)),
        ("pins.vcd", opened.save_pins),
        ("run", opened.save_record),
    ):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write(folder / name)
        except Exception as error:  # the test's own failure is what counts
            said.append(f"without {name}: {error}")
    return "\n".join(said)


def _command(config: pytest.Config, name: str) -> str:
    """What repeats one test."""
    options = [f"--uno-on={board}" for board in config.getoption("--uno-on") or ()]
    options += [f"--uno-{name}" for name in ("flash", "motors") if config.getoption(f"--uno-{name}")]
    if (keep := config.getoption("--uno-keep")) != KEEP:
        options.append(f"--uno-keep={keep}")
    if (baseline := config.getoption("--uno-baseline")) not in (None, UPDATE):
        options.append(f"--uno-baseline={os.path.relpath(config.invocation_params.dir / baseline, config.rootpath)}")
    there = "" if Path.cwd() == config.rootpath else f"cd {shlex.quote(str(config.rootpath))} && "
    return there + shlex.join(["pytest", *options, name])


class Session:
    """What the tests of a session have found, from the reports of all processes, and what is said of it at the end."""

    def __init__(self, config: pytest.Config) -> None:
        self._config, self._root = config, config.rootpath
        self._folder = Path(config.rootpath, config.getoption("--uno-keep"))
        self._programs: dict[object, Path | Exception] = {}
        self._measured: dict[str, list[dict[str, Any]]] = {}
        self._cannot: Counter[str] = Counter()
        self._cycles: dict[str, list[dict[str, Any]]] = {}
        self._ran = False
        self._failed: set[str] = set()
        self.coverage = None
        if config.getoption("--uno-cover"):
            from sim_bridge.bench.cover import Coverage

            self.coverage = Coverage()

    def program(self, file: Path) -> Path:
        """The ELF or HEX file, which is built once for the same sources; what is wrong with it is said
        of each test. Raises BoebotError."""
        from boebot.brains import load_program, program_state
        from boebot.errors import BoebotError, CallError

        if (state := program_state(file)) not in self._programs:
            try:
                program = load_program(file)
                if program is None or program.path is None:
                    raise CallError(f"{file} is no program; expected an ELF or HEX file, a sketch or a folder of one")
                self._programs[state] = program.path
            except BoebotError as error:
                self._programs[state] = error
        if isinstance(found := self._programs[state], Exception):
            raise found
        return found

    @cached_property
    def baseline(self) -> Baseline | None:
        """What functions took before, to be compared with or updated; None: there is no such file. Raises CallError
        where it is none, or cannot be written."""
        given = self._config.getoption("--uno-baseline")
        own = given in (None, UPDATE)
        path = self._root / BASELINE if own else self._config.invocation_params.dir / given
        if given is None and not path.exists():
            return None
        from sim_bridge.bench.cycles import Baseline

        return Baseline(path, updates=given == UPDATE)

    # ---- coverage ------------------------------------------------------------------------------------------------

    def take_cover(self, opened: Uno) -> None:
        """What a test's program has executed."""
        if self.coverage is None:
            return
        from boebot.errors import BoebotError

        try:
            self.coverage.add(opened.elf(), opened.avr("coverage").cover())
        except BoebotError as error:
            self.coverage.not_counted.add(str(error))

    def pytest_sessionfinish(self) -> None:
        """A worker of xdist's sends what it has covered."""
        if self.coverage and hasattr(self._config, "workeroutput"):
            self._config.workeroutput["uno_cover"] = self.coverage.as_dict()

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """The controller merges what a worker has covered."""
        if self.coverage and (found := getattr(node, "workeroutput", {}).get("uno_cover")):
            self.coverage.merge(found)

    # ---- reports -------------------------------------------------------------------------------------------------

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collects, of each test once."""
        self._ran = True
        if report.failed:
            self._failed.add(report.nodeid)
        for name, value in report.user_properties if report.when == "teardown" else ():
            if name == CANNOT:
                self._cannot[str(value)] += 1
            elif name == CYCLES:
                self._cycles[report.nodeid] = json.loads(str(value))
            elif name.startswith(MEASURED):
                self._measured.setdefault(report.nodeid, []).append(json.loads(str(value)))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Prints it, and writes its files in place of those of an earlier session."""
        say = terminalreporter.write_line
        for name in (MEASURED_FILE, COVER_FILE) if self._ran else ():
            (self._folder / name).unlink(missing_ok=True)
        if self._measured:
            terminalreporter.section("measured")
            for name, values in self._measured.items():
                say(name)
                for row in values:
                    say(f"  {row['verdict']:8}  {row['text']}")
            say(f"also in {self._write(MEASURED_FILE, json.dumps(self._measured, indent=1))}")
        if self._cycles:
            from sim_bridge.bench.cycles import FunctionCycles, table_of

            terminalreporter.section("cycles of functions")
            seen = {name: [FunctionCycles(**row) for row in rows] for name, rows in self._cycles.items()}
            say(table_of(seen))
            if self.baseline and self.baseline.updates:
                for name in seen.keys() - self._failed:
                    self.baseline.put(name, seen[name])
                self.baseline.write()
                say(f"written to {self.baseline.path}")
                missing = [f"{name}, which failed" for name in seen if name in self._failed]
                missing += [
                    f"{one.name} of {name}, no call has ended" for name in seen for one in seen[name] if not one.calls
                ]
                for what in missing:
                    say(f"not written: {what}")
        if self.coverage:
            terminalreporter.section("executed")
            say(self.coverage.table(self._root))
            say(f"also in {self._write(COVER_FILE, self.coverage.lcov(self._root))}")
        if self._cannot:
            terminalreporter.section(f"skipped, as the board cannot do it: {self._cannot.total()}")
            for reason, count in self._cannot.items():
                say(f"{count} x {reason}")

    def _write(self, name: str, text: str) -> Path:
        self._folder.mkdir(parents=True, exist_ok=True)
        file = self._folder / name
        file.write_text(f"{text.rstrip()}\n", encoding="utf-8")
        return file
