"""The pytest plugin: the fixture `uno`, an Uno with the program that a test's mark names; what it measured, and what is
left of it where it fails.

    @pytest.mark.uno(image="own.elf")
    def test_servo(uno): ...

pytest loads this file in every session wherever the kit is installed, so that it imports nothing but pytest and the
standard library until the fixture is used.
"""

from __future__ import annotations

import dataclasses
import json
import os
import shlex
import shutil
import sys
from collections import Counter
from collections.abc import Generator, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_bridge.bench.cover import Coverage
    from sim_bridge.bench.cycles import Baseline
    from sim_bridge.bench.uno import Uno, Wanted

MARK = "uno"
PASSED = pytest.StashKey[bool]()
MEASURED, CANNOT, CYCLES = (
    "uno.measured.",
    "uno.cannot",
    "uno.cycles",
)  # of the properties of a test's report, which reach JUnit's file
DEFAULT_BOARD = "avr"
BASELINE, UPDATE = "uno-baseline.json", "update"
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
    group.addoption(
        "--uno-keep",
        metavar="DIR",
        default=".uno",
        help="where what failing tests leave goes, and measured.json (.uno)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Its mark; and refuses a port that several processes would open."""
    config.addinivalue_line("markers", f"uno({'=, '.join(KEYWORDS)}=): what the fixture `uno` has in it")
    config.stash[SESSION] = Session(config)
    config.pluginmanager.register(config.stash[SESSION], "uno-session")
    ports = [board for board in boards(config) if board not in ("avr", "native")]
    if ports and (getattr(config.option, "numprocesses", None) or hasattr(config, "workerinput")):
        raise pytest.UsageError(f"--uno-on={ports[0]}: one process at a time can have it open; expected no -n")


def boards(config: pytest.Config) -> list[str]:
    """Those under test."""
    given: list[str] | None = config.getoption("--uno-on")
    return given or [DEFAULT_BOARD]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Each test on each board, where several are given."""
    if MARK in metafunc.fixturenames and len(given := boards(metafunc.config)) > 1:
        metafunc.parametrize(MARK, given, indirect=True)


# ---- the fixture -----------------------------------------------------------------------------------------------------


@pytest.fixture
def uno(request: pytest.FixtureRequest) -> Iterator[Uno]:
    """An Uno with the program that the test's mark `uno` names, just powered on."""
    from boebot.errors import BoebotError
    from sim_bridge.bench.uno import open_uno

    board = getattr(request, "param", None) or boards(request.config)[0]
    failure = ""
    try:
        flash, motors = (request.config.getoption(name) for name in ("--uno-flash", "--uno-motors"))
        opened = open_uno(board, _wanted(request.node), flash=flash, motors=motors)
    except BoebotError as error:
        if _cannot(error):
            raise
        failure = "\n".join([f"uno: {error}", *getattr(error, "__notes__", ())])
    if failure:  # here, or the text of the error would be shown twice
        pytest.fail(failure, pytrace=False)
    request.node.stash[UNO] = opened
    yield opened
    try:
        request.config.stash[SESSION].take_cover(opened)
        failure = opened.unfired() if request.node.stash.get(PASSED, False) else ""
    finally:
        opened.close()
    if failure:
        pytest.fail(f"uno: {failure}", pytrace=False)


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
        asked[name] = (given,) if isinstance(given := asked.get(name, ()), str) else tuple(given)
    session = item.config.stash[SESSION]
    asked |= {"cover": session.covers, "cycles": tuple(dict.fromkeys((*asked["cycles"], *session.functions(item))))}
    if asked.get("image") is None and asked.get("robot") is None:
        raise CallError(
            f"{item.name} says nothing of what is tested; expected @pytest.mark.uno(image='own.elf'), or robot="
        )
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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """What the board cannot do is skipped; values beyond their limits, and cycles that are not as they were, fail the
    test when it has ended."""
    result = yield from _judged(item)
    if (opened := item.stash.get(UNO, None)) is not None:
        wrong = [str(one) for one in opened.measured if one.verdict == "fail"]
        if wrong := wrong + item.config.stash[SESSION].changes(item, opened):
            pytest.fail("\n".join(wrong), pytrace=False)
    item.stash[PASSED] = True
    return result


def _judged(item: pytest.Item) -> Generator[None, object, object]:
    try:
        return (yield)
    except Exception as error:
        if _cannot(error):
            item.user_properties.append((CANNOT, str(error)))
            raise pytest.skip.Exception(str(error), _use_item_location=True) from None
        if (errors := sys.modules.get("boebot.errors")) and isinstance(error, AssertionError | errors.BoebotError):
            _end_at_the_test(item, error.__traceback__)
        raise


def _end_at_the_test(item: pytest.Item, trace: TracebackType | None) -> None:
    """Cuts what the kit did off a traceback: it ends by the line of the test's own folder, which has called it."""
    last = None
    while trace is not None:
        if Path(trace.tb_frame.f_code.co_filename).is_relative_to(item.path.parent):
            last = trace
        trace = trace.tb_next
    if last is not None:
        last.tb_next = None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """What a test measured goes into its report, and to files what there was at the board where it fails."""
    opened = item.stash.get(UNO, None)
    if opened is not None and call.when == "call":
        item.user_properties += [(MEASURED + one.name, json.dumps(one.as_dict())) for one in opened.measured]
        if opened.recorded is not None and (seen := opened.recorded.seen()):
            item.user_properties.append((CYCLES, json.dumps([dataclasses.asdict(one) for one in seen])))
    report = yield
    if opened is not None and call.when != "teardown":
        _keep(item, opened, report)
    return report


def _keep(item: pytest.Item, opened: Uno, report: pytest.TestReport) -> None:
    """Of a test that failed its files, of one that passed none of an earlier time."""
    from sim_bridge.bench import evidence

    folder = evidence.folder_of(item.config.rootpath / item.config.getoption("--uno-keep"), item.nodeid)
    if not report.failed:
        shutil.rmtree(folder, ignore_errors=True)
        return
    again = _command(item.config, item.nodeid)
    try:
        evidence.keep(opened, folder, again)
        shown = os.path.relpath(folder) if folder.is_relative_to(Path.cwd()) else folder
        report.sections.append(("uno", f"kept in {shown}\nagain: {again}"))
    except Exception as error:  # whatever is wrong with it, the test's own failure is what counts
        report.sections.append(("uno", f"nothing is kept: {type(error).__name__}: {error}"))


def _command(config: pytest.Config, name: str) -> str:
    """What repeats one test."""
    options = [f"--uno-on={board}" for board in config.getoption("--uno-on") or ()]
    options += [f"--uno-{name}" for name in ("flash", "motors") if config.getoption(f"--uno-{name}")]
    there = "" if Path.cwd() == config.rootpath else f"cd {shlex.quote(str(config.rootpath))} && "
    return there + shlex.join(["pytest", *options, name])


class Session:
    """What the tests of a session have found, from the reports of all processes, and what is said of it at the end."""

    def __init__(self, config: pytest.Config) -> None:
        self._config, self._root = config, config.rootpath
        self._folder = Path(config.rootpath, config.getoption("--uno-keep"))
        self._programs: dict[Path, Path | Exception] = {}
        self._measured: dict[str, list[dict[str, Any]]] = {}
        self._cannot: Counter[str] = Counter()
        self._cycles: dict[str, list[dict[str, Any]]] = {}
        self.covers: bool = config.getoption("--uno-cover")
        self._coverage: Coverage | None = None
        self._not_covered: set[str] = set()

    def program(self, file: Path) -> Path:
        """The ELF or HEX file, which is built once; what is wrong with it is said of each test. Raises BoebotError."""
        from boebot.brains import load_program
        from boebot.errors import BoebotError, CallError

        if file not in self._programs:
            try:
                program = load_program(file)
                if program is None or program.path is None:
                    raise CallError(f"{file} is no program; expected an ELF or HEX file, a sketch or a folder of one")
                self._programs[file] = program.path
            except BoebotError as error:
                self._programs[file] = error
        if isinstance(found := self._programs[file], Exception):
            raise found
        return found

    # ---- cycles, as they were before -----------------------------------------------------------------------------

    @property
    def _updates(self) -> bool:
        return bool(self._config.getoption("--uno-baseline") == UPDATE)

    def _baseline(self) -> Baseline:
        from sim_bridge.bench.cycles import Baseline

        given = self._config.getoption("--uno-baseline")
        return Baseline(self._root / (BASELINE if given in (None, UPDATE) else given), new=self._updates)

    def functions(self, item: pytest.Item) -> list[str]:
        """Those that the baseline has for a test."""
        return [] if self._updates or not self._has_baseline() else self._baseline().functions(item.nodeid)

    def _has_baseline(self) -> bool:
        given = self._config.getoption("--uno-baseline")
        return given is not None or (self._root / BASELINE).exists()

    def changes(self, item: pytest.Item, opened: Uno) -> list[str]:
        """What took other cycles than before, in sentences."""
        if opened.recorded is None or self._updates or not self._has_baseline():
            return []
        return self._baseline().changes(item.nodeid, opened.recorded.rows())

    # ---- coverage ------------------------------------------------------------------------------------------------

    def take_cover(self, opened: Uno) -> None:
        """What a test's program has executed."""
        if not self.covers:
            return
        from boebot.errors import BoebotError
        from sim_bridge.bench.cover import Coverage

        self._coverage = self._coverage or Coverage()
        try:
            self._coverage.add(opened.elf(), opened.avr("coverage").cover())
        except BoebotError as error:
            self._not_covered.add(str(error))

    def pytest_sessionfinish(self) -> None:
        """A process of xdist's sends what it has."""
        if hasattr(self._config, "workeroutput"):
            covered = self._coverage.as_dict() if self._coverage else {}
            self._config.workeroutput["uno_cover"] = [covered, sorted(self._not_covered)]

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Takes it."""
        covered, not_covered = getattr(node, "workeroutput", {}).get("uno_cover", ({}, ()))
        self._not_covered.update(not_covered)
        if covered:
            from sim_bridge.bench.cover import Coverage

            self._coverage = self._coverage or Coverage()
            self._coverage.merge(covered)

    # ---- reports -------------------------------------------------------------------------------------------------

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collects, of each test once."""
        for name, value in report.user_properties if report.when == "teardown" else ():
            if name == CANNOT:
                self._cannot[str(value)] += 1
            elif name == CYCLES:
                self._cycles[report.nodeid] = json.loads(str(value))
            elif name.startswith(MEASURED):
                self._measured.setdefault(report.nodeid, []).append(json.loads(str(value)))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Prints it, and writes its files."""
        say = terminalreporter.write_line
        if self._measured:
            terminalreporter.section("measured")
            for name, values in self._measured.items():
                say(name)
                for row in values:
                    say(f"  {_in_words(row)}")
            say(f"also in {self._write('measured.json', json.dumps(self._measured, indent=1))}")
        if self._cycles:
            from sim_bridge.bench.cycles import FunctionCycles, table_of

            terminalreporter.section("cycles of functions")
            seen = {name: [FunctionCycles(**row) for row in rows] for name, rows in self._cycles.items()}
            say(table_of(seen))
            if self._updates:
                baseline = self._baseline()
                for name, found in seen.items():
                    baseline.put(name, {one.name: (one.shortest, one.longest) for one in found})
                baseline.write()
                say(f"written to {baseline.path}")
        if self._coverage is not None:
            terminalreporter.section("executed")
            say(self._coverage.table(self._root))
            say(f"also in {self._write('cover.info', self._coverage.lcov(self._root))}")
        for sentence in sorted(self._not_covered):
            say(f"not counted: {sentence}")
        if self._cannot:
            terminalreporter.section(f"skipped, as the board cannot do it: {self._cannot.total()}")
            for reason, count in self._cannot.items():
                say(f"{count} x {reason}")

    def _write(self, name: str, text: str) -> Path:
        self._folder.mkdir(parents=True, exist_ok=True)
        file = self._folder / name
        file.write_text(f"{text.rstrip()}\n", encoding="utf-8")
        return file


def _in_words(row: dict[str, Any]) -> str:
    from sim_bridge.bench.measured import Measurement

    measured = Measurement(**{name: value for name, value in row.items() if name != "verdict"})
    return f"{measured.verdict:8}  {measured}"
