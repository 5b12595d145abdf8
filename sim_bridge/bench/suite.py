"""The kit's own tests of boards, the package `boebot_hil`, as a command runs them: by pytest, in a process by itself,
to which neither the settings of the folder's own tests nor this process's handlers of signals apply."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from boebot import missing
from boebot.errors import BoebotError, CallError

SUITE = "boebot_hil"
PASSED, FAILED, NOTHING_RAN, INTERRUPTED = 0, 1, 2, 130
_CODES = {0: PASSED, 1: FAILED, 2: FAILED, 5: NOTHING_RAN}  # by pytest's; 2: a file of tests cannot be read
_USAGE = 4  # pytest's


def run_suite(boards: Sequence[str], arguments: Sequence[str], *, motors: bool = False) -> int:
    """Runs the tests on these boards, with further arguments of pytest's. The exit code: PASSED, FAILED, NOTHING_RAN or
    INTERRUPTED.

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

    options = [
        f"--rootdir={Path(found.origin).parent}",
        f"--uno-keep={Path('.uno').absolute()}",
        "-m",
        "not soak",
    ]
    options += [*(f"--uno-on={board}" for board in boards), *["--uno-motors"] * motors]
    if find_spec("xdist") is not None and not any(map(is_live, boards)):
        options.append("--numprocesses=auto")
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, "pytest.ini")
        settings.write_text(f"[pytest]\ncache_dir = {cache() / 'tests'}\n", "utf-8")
        command = [sys.executable, "-P", "-m", "pytest", "--pyargs", SUITE, "-c", str(settings), *options, *arguments]
        with subprocess.Popen(command) as process:
            interrupted = False
            while process.returncode is None:
                try:
                    process.wait()
                except KeyboardInterrupt:  # it has come to pytest, too, which says what was done so far
                    interrupted = True
    if interrupted:
        return INTERRUPTED
    if process.returncode == _USAGE:
        raise CallError("no test can run, as pytest says above")
    if process.returncode not in _CODES:
        raise BoebotError(f"pytest has failed with exit code {process.returncode}, as it says above")
    return _CODES[process.returncode]
