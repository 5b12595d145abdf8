"""The pytest plugin: the fixture `uno`, an Uno with the program that a test's mark names; what it measured, and what is
left of it where it fails.

    @pytest.mark.uno(image="own.elf")
    def test_servo(uno): ...

pytest loads this file in every session wherever the kit is installed, so that it imports nothing but pytest and the
standard library until the fixture is used.
"""

from __future__ import annotations

import json
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
    from sim_bridge.bench.uno import Uno, Wanted

MARK = "uno"
MEASURED, CANNOT = "uno.measured.", "uno.cannot"  # of the properties of a test's report, which reach JUnit's file
DEFAULT_BOARD = "avr"
UNO: pytest.StashKey[Uno] = pytest.StashKey()
KEYWORDS = ("image", "robot", "arena", "seed", "noise", "baud", "motors")


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
        "--uno-keep",
        metavar="DIR",
        default=".uno",
        help="where what failing tests leave goes, and measured.json (.uno)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Its mark; and refuses a port that several processes would open."""
    config.addinivalue_line(
        "markers", "uno(image=, robot=, arena=, seed=, noise=, baud=, motors=): what the fixture `uno` has in it"
    )
    if not hasattr(config, "workerinput"):  # a process of xdist's
        config.pluginmanager.register(Session(config), "uno-session")
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
        failure = f"uno: {error}"
    if failure:  # here, or the text of the error would be shown twice
        pytest.fail(failure, pytrace=False)
    request.node.stash[UNO] = opened
    yield opened
    opened.close()


def _wanted(item: pytest.Item) -> Wanted:
    """What the marks of a test ask for, the nearest one first. Raises CallError where they make no sense."""
    from boebot.brains import load_program
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
    if asked.get("image") is None and asked.get("robot") is None:
        raise CallError(
            f"{item.name} says nothing of what is tested; expected @pytest.mark.uno(image='own.elf'), or robot="
        )
    if (image := asked.get("image")) is not None:
        program = load_program(_file(item, image))
        if program is None:
            raise CallError(
                f"image={str(image)!r} is no program; expected an ELF or HEX file, a sketch or a folder of one"
            )
        asked["image"] = program.path
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
    """What the board cannot do is skipped; values beyond their limits fail the test when it has ended."""
    result = yield from _judged(item)
    opened = item.stash.get(UNO, None)
    if opened is not None and (wrong := [str(one) for one in opened.measured if one.verdict == "fail"]):
        pytest.fail("\n".join(wrong), pytrace=False)
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
        report.sections.append(("uno", f"kept in {folder}; again: {again}"))
    except Exception as error:  # whatever is wrong with it, the test's own failure is what counts
        report.sections.append(("uno", f"nothing is kept: {type(error).__name__}: {error}"))


def _command(config: pytest.Config, name: str) -> str:
    """What repeats one test."""
    options = [f"--uno-on={board}" for board in config.getoption("--uno-on") or ()]
    options += [f"--uno-{name}" for name in ("flash", "motors") if config.getoption(f"--uno-{name}")]
    there = "" if Path.cwd() == config.rootpath else f"cd {shlex.quote(str(config.rootpath))} && "
    return there + shlex.join(["pytest", *options, name])


class Session:
    """What the tests of a session have measured and what boards could not do, from the reports of all processes."""

    def __init__(self, config: pytest.Config) -> None:
        self._folder = config.rootpath / config.getoption("--uno-keep")
        self._measured: dict[str, list[dict[str, Any]]] = {}
        self._cannot: Counter[str] = Counter()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collects, of each test once."""
        for name, value in report.user_properties if report.when == "teardown" else ():
            if name == CANNOT:
                self._cannot[str(value)] += 1
            elif name.startswith(MEASURED):
                self._measured.setdefault(report.nodeid, []).append(json.loads(str(value)))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Prints it, and writes what was measured."""
        if self._measured:
            terminalreporter.section("measured")
            for name, values in self._measured.items():
                terminalreporter.write_line(name)
                for row in values:
                    terminalreporter.write_line(f"  {_in_words(row)}")
            self._folder.mkdir(parents=True, exist_ok=True)
            file = self._folder / "measured.json"
            file.write_text(json.dumps(self._measured, indent=1) + "\n", encoding="utf-8")
            terminalreporter.write_line(f"also in {file}")
        if self._cannot:
            terminalreporter.section(f"skipped, as the board cannot do it: {self._cannot.total()}")
            for reason, count in self._cannot.items():
                terminalreporter.write_line(f"{count} x {reason}")


def _in_words(row: dict[str, Any]) -> str:
    from sim_bridge.bench.measured import Measurement

    measured = Measurement(**{name: value for name, value in row.items() if name != "verdict"})
    return f"{measured.verdict:8}  {measured}"
