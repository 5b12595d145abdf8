"""`boebot test`: the kit's own tests of boards, the package `boebot_hil`, by pytest in a process by itself, to which
neither the settings of the folder's own tests nor this process's handlers of signals apply."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from boebot import missing
from boebot.cli import options
from boebot.errors import BoebotError, CallError

SUITE = "boebot_hil"
PASSED, FAILED, NOTHING_RAN = 0, 1, 2
_CODES = {0: PASSED, 1: FAILED, 2: FAILED, 5: NOTHING_RAN}  # by pytest's; 2: a file of tests cannot be read
_USAGE = 4  # pytest's

test = typer.Typer(add_completion=False, **options.SETTINGS)


@test.command(context_settings={**options.SETTINGS["context_settings"], "ignore_unknown_options": True})
def prove(
    arguments: Annotated[
        list[str] | None, typer.Argument(metavar="ARGUMENT", help="Arguments of pytest's, such as -k hello or --lf.")
    ] = None,
    on: Annotated[
        list[str] | None,
        typer.Option("--on", metavar="BOARD", help="native, avr or a port; may be given again. Else native and avr."),
    ] = None,
    motors: Annotated[
        bool, typer.Option("--motors", help="The motors of a real robot may turn: it stands on blocks, or has room.")
    ] = False,
) -> None:
    """Prove a board, emulated or at a port: what the protocol promises, one test each.

    On a port motors turn with --motors only.

    Exit code: 0 all passed; 1 a test failed; 2 bad input, or no test ran; 130 after Ctrl-C."""
    raise typer.Exit(run_suite(on or (), arguments or (), motors=motors))


def run_suite(boards: Sequence[str], arguments: Sequence[str], *, motors: bool = False) -> int:
    """Runs the tests on these boards, or on those of the suite's choice, with further arguments of pytest's. The exit
    code: PASSED, FAILED or NOTHING_RAN. At Ctrl-C, or its like, the tests end, and say how far they were.

    Args:
        motors: those of a real robot may turn.

    Raises:
        CallError: there is no pytest, or it does not understand its arguments.
        BoebotError: pytest itself has failed.
    """
    found = find_spec(SUITE)
    if find_spec("pytest") is None or found is None or found.origin is None:
        raise CallError(missing.package("boebot test", "pytest", "hil"))
    from boebot.boards import is_live
    from boebot.sketch import cache
    from boebot.sketch.build import ended

    missing.compiled("sim_bridge._core")  # where it cannot be loaded, each test would say so
    own = [f"--rootdir={Path(found.origin).parent}", f"--uno-keep={Path('.uno').absolute()}"]
    own += [*(f"--uno-on={board}" for board in boards), *["--uno-motors"] * motors]
    if find_spec("xdist") is not None and not any(map(is_live, boards)):
        own.append("--numprocesses=auto")
    suite = [] if any(".py" in one and Path(one.partition("::")[0]).is_file() for one in arguments) else [SUITE]
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, "pytest.ini")
        settings.write_text(f"[pytest]\ncache_dir = {cache() / 'tests'}\n", "utf-8")
        command = [sys.executable, "-P", "-m", "pytest", "--pyargs", *suite, "-c", str(settings), *own, *arguments]
        with ended(subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)) as process:
            code = process.wait()
    if code == _USAGE:
        raise CallError("no test can run, as pytest says above")
    if code not in _CODES:
        raise BoebotError(f"pytest has failed with exit code {code}, as it says above")
    return _CODES[code]
