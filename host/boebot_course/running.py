"""Runs experiments, in this process or each in its own, and says what came of each.

An experiment is a function of its seed, so what comes out does not depend on how many run at the same time. What draws
its figure cannot leave its process: files are made where it runs, and handed over as bytes.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from pkgutil import resolve_name

from boebot.errors import BoebotError
from boebot.running import interrupts
from boebot_course.experiment import Experiment, Measured
from boebot_course.experiments import all_experiments

LOOK_S = 0.02  # between two looks at whether a process has ended
_ALONE = "import sys; from boebot_course import running; running.hand_over(*sys.argv[1:])"


@dataclass(frozen=True)
class Verdict:
    """What came of an experiment, without what only its process knows."""

    name: str
    measured: tuple[Measured, ...] = ()
    error: str = ""
    """why there is nothing measured; "" where there is"""
    files: dict[str, bytes] = field(default_factory=dict)

    @property
    def is_met(self) -> bool:
        """It ran, and all its criteria are met."""
        return not self.error and all(one.is_met for one in self.measured)

    @property
    def word(self) -> str:
        """The verdict in a word."""
        return "failed" if self.error else "met" if self.is_met else "missed"


def run(
    experiments: Sequence[Experiment], seed: int, jobs: int, watch: Callable[[float], None], files: str
) -> Generator[Verdict, None, None]:
    """Runs them, up to that many processes beside each other; the verdicts, as they come. An experiment that raises, or
    whose process dies, has failed; the others go on. Processes end when what is returned is closed.

    Args:
        watch: is called with how many are done.
        files: "module:function"; the function makes files (name -> content) of an experiment, its outcome and the seed.
    """
    if jobs == 1 or len(experiments) == 1:
        for number, one in enumerate(experiments, 1):
            yield _run(one, seed, files)
            watch(number)
        return
    waiting = [one.name for one in sorted(experiments, key=lambda one: not one.slow)]
    going: dict[str, subprocess.Popen[bytes]] = {}
    with tempfile.TemporaryDirectory(prefix="boebot-") as folder:
        try:
            while waiting or going:
                while waiting and len(going) < jobs:
                    name = waiting.pop(0)
                    with interrupts.uncut():
                        command = [sys.executable, "-c", _ALONE, name, str(seed), files, str(Path(folder, name))]
                        going[name] = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                time.sleep(LOOK_S)
                for name in [name for name, process in going.items() if process.poll() is not None]:
                    code = going.pop(name).returncode
                    watch(len(experiments) - len(waiting) - len(going))
                    if code:
                        yield Verdict(name, error="its process has died")
                    else:
                        yield pickle.loads(Path(folder, name).read_bytes())
        finally:
            for process in going.values():
                process.kill()
                process.wait()


def hand_over(name: str, seed: str, files: str, path: str) -> None:
    """In its own process: runs an experiment and writes its verdict to a file."""
    Path(path).write_bytes(pickle.dumps(_run(all_experiments()[name], int(seed), files)))


def _run(experiment: Experiment, seed: int, files: str) -> Verdict:
    try:
        outcome = experiment.run(seed)
        if not outcome.measured:
            raise ValueError("nothing was measured")
        return Verdict(experiment.name, tuple(outcome.measured), "", resolve_name(files)(experiment, outcome, seed))
    except BoebotError as error:
        return Verdict(experiment.name, error=str(error))
    except Exception as error:  # a mistake in an experiment is not the end of the others
        return Verdict(experiment.name, error=_place(error))


def _place(error: Exception) -> str:
    """What was raised, and where, in one line."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    what = str(error).strip().partition("\n")[0]
    return f"{type(error).__name__}{what and f': {what}'} ({os.path.basename(last.filename)}, line {last.lineno})"  # noqa: PTH119
