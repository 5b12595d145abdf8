"""Runs experiments, in this process or in several, and says what came of each.

An experiment is a function of its seed, so what comes out does not depend on how many processes there are. What draws
its figure cannot leave its process: files are made where it runs, and handed over as bytes.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field

from boebot.errors import BoebotError
from boebot.running.interrupts import SIGNALS
from boebot_course.experiment import Experiment, Measured, Outcome
from boebot_course.experiments import all_experiments

Files = Callable[[Experiment, Outcome, int], dict[str, bytes]]
"""Makes files of what came of an experiment with that seed: name -> content. A function of a module, for processes."""
BOARDS = ("avr", "native", "direct", "arsim")  # from slow to fast, as named in `Experiment.robot`


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
    experiments: Sequence[Experiment], seed: int, jobs: int, watch: Callable[[float], None], files: Files
) -> Generator[Verdict, None, None]:
    """Runs them, with up to that many processes beside each other; the verdicts, as they come. `watch` is told how many
    are done.

    An experiment that raises, or whose process dies, has failed; the others go on. Processes end when what is returned
    is closed.
    """
    if jobs == 1 or len(experiments) == 1:
        for number, one in enumerate(experiments, 1):
            yield _run(one, seed, files)
            watch(number)
        return
    waiting = {one.name: one for one in sorted(experiments, key=_length)}
    with contextlib.closing(_in_processes(list(waiting), seed, jobs, files)) as verdicts:
        for number, verdict in enumerate(verdicts, 1):
            del waiting[verdict.name]
            watch(number)
            yield verdict
    for name in waiting:  # a process died, and with it the others: each now gets its own
        alone = list(_in_processes([name], seed, 1, files))
        yield alone[0] if alone else Verdict(name, error="its process has died")


def _length(experiment: Experiment) -> tuple[bool, int]:
    """Sorts those that are likely to take longest to the front."""
    board = next((index for index, board in enumerate(BOARDS) if board in experiment.robot), len(BOARDS))
    return not experiment.slow, board


def _run(experiment: Experiment, seed: int, files: Files) -> Verdict:
    try:
        outcome = experiment.run(seed)
        if not outcome.measured:
            raise ValueError("nothing was measured")
        return Verdict(experiment.name, tuple(outcome.measured), "", files(experiment, outcome, seed))
    except BoebotError as error:
        return Verdict(experiment.name, error=str(error))
    except Exception as error:  # a mistake in an experiment is not the end of the others
        return Verdict(experiment.name, error=_place(error))


def _place(error: Exception) -> str:
    """What was raised, and where, in one line."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    what = str(error).strip().partition("\n")[0]
    return f"{type(error).__name__}{what and f': {what}'} ({os.path.basename(last.filename)}, line {last.lineno})"  # noqa: PTH119


def _in_processes(names: Sequence[str], seed: int, jobs: int, files: Files) -> Generator[Verdict, None, None]:
    """The verdicts of those whose process lived."""
    before = set(multiprocessing.active_children())
    spawned = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(names)), spawned, _end_with_parent)
    try:
        # Processes start with the signals ignored that ask to end, and keep to it: it is this one that ends them.
        with _ignored():
            futures = {pool.submit(_run_there, name, seed, files): name for name in names}
        for future in as_completed(futures):
            try:
                yield future.result()
            except (BrokenProcessPool, CancelledError):
                continue  # the caller sees that it is missing
            except Exception as error:  # what came of it could not be handed over
                yield Verdict(futures[future], error=_place(error))
    finally:
        with _ignored():
            for child in set(multiprocessing.active_children()) - before:
                child.kill()
            pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _ignored() -> Iterator[None]:
    """Signals that ask to end do nothing in the block."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _end_with_parent() -> None:
    """Once in each process: it ends with the one that started it, however that ended."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _run_there(name: str, seed: int, files: Files) -> Verdict:
    """One experiment, by name, in one of the processes."""
    return _run(all_experiments()[name], seed, files)
