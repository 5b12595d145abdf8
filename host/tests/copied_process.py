"""Runs code and commands each in a copy of this process, which has imported the kit: hundreds of processes that start
Python and import it take a minute longer."""

from __future__ import annotations

import os
import runpy
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import matplotlib.backends.backend_agg  # noqa: F401

import boebot.cli.app  # noqa: F401
import sim_bridge.sessions.world  # noqa: F401
from boebot import cli

LONGEST_S = 120


class Done(NamedTuple):
    """How a copy ended, and what it printed."""

    returncode: int
    stdout: str
    stderr: str


def python(code: str, folder: Path) -> Done:
    """As `python -c CODE` in that folder."""

    def work() -> None:
        sys.argv, sys.path[0:0] = ["-c"], [""]
        sys.modules["__main__"] = main = ModuleType("__main__")
        exec(compile(code, "<string>", "exec"), vars(main))

    return copied(work, folder)


def module(name: str, arguments: Sequence[str], folder: Path) -> Done:
    """As `python -m NAME ARGUMENTS` in that folder."""

    def work() -> None:
        sys.argv = [name, *arguments]
        runpy.run_module(name, run_name="__main__", alter_sys=True)

    return copied(work, folder)


def command(arguments: Sequence[str], folder: Path, environment: Mapping[str, str] | None = None) -> Done:
    """As the command `boebot ARGUMENTS` in that folder, with more variables in its environment."""

    def work() -> None:
        os.environ.update(environment or {})
        sys.argv = ["boebot", *arguments]
        cli.main()

    return copied(work, folder)


def copied(work: Callable[[], None], folder: Path) -> Done:
    """Does the work in a copy of this process with that working folder, its output in files; kills it when it hangs."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        child = os.fork()
        if child == 0:
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(LONGEST_S)
            os._exit(ended(work, folder, out.fileno(), err.fileno()))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        out.seek(0)
        err.seek(0)
        return Done(code, out.read(), err.read())


def ended(work: Callable[[], None], folder: Path, out: int, err: int) -> int:
    """The exit code of the work, as Python would end with it."""
    os.chdir(folder)
    os.dup2(out, 1)
    os.dup2(err, 2)
    sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
    code = 1
    try:
        work()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    return code
