"""Runs experiments, in this process or in several, and says what came of each.

An experiment is a function of its seed, so what comes out does not depend on how many processes there are. What draws
its figure cannot leave its process: files are made where it runs, and handed over as bytes.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Any

from boebot.errors import BoebotError
from boebot.running import interrupts
from boebot_course.experiment import Experiment, Measured, Outcome
from boebot_course.experiments import all_experiments

Files = Callable[[Experiment, Outcome, int], dict[str, bytes]]
"""Makes files of what came of an experiment with that seed: name -> content. A function of a module, for processes."""
Watch = Callable[[Mapping[str, float]], None]
"""Called now and then with the share that is done, 0 to 1, of each experiment that is running."""

LOOK_S = 0.1  # how often shares are looked at
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
    experiments: Sequence[Experiment], seed: int, jobs: int, watch: Watch, files: Files
) -> Generator[Verdict, None, None]:
    """Runs them, with up to that many processes beside each other; the verdicts, as they come.

    An experiment that raises, or whose process dies, has failed; the others go on. Processes end when what is returned
    is closed.
    """
    if jobs == 1 or len(experiments) == 1:
        for one in experiments:
            yield _run_here(one, seed, watch, files)
        return
    waiting = sorted(experiments, key=_length)
    with contextlib.closing(_in_processes(waiting, seed, jobs, watch, files)) as verdicts:
        for verdict in verdicts:
            waiting = [one for one in waiting if one.name != verdict.name]
            yield verdict
    for one in waiting:  # a process died, and with it the others: each now gets its own
        alone = list(_in_processes([one], seed, 1, watch, files))
        yield alone[0] if alone else Verdict(one.name, error="its process has died")


def _length(experiment: Experiment) -> tuple[bool, int]:
    """Sorts those that are likely to take longest to the front."""
    board = next((index for index, board in enumerate(BOARDS) if board in experiment.robot), len(BOARDS))
    return not experiment.slow, board


def _run_here(experiment: Experiment, seed: int, watch: Watch, files: Files) -> Verdict:
    watch({experiment.name: 0.0})
    return _run(experiment, seed, lambda share: watch({experiment.name: share}), files)


def _run(experiment: Experiment, seed: int, progress: Callable[[float], None], files: Files) -> Verdict:
    try:
        outcome = experiment.run(seed, progress)
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


def _in_processes(
    experiments: Sequence[Experiment], seed: int, jobs: int, watch: Watch, files: Files
) -> Generator[Verdict, None, None]:
    """The verdicts of those whose process lived."""
    context = multiprocessing.get_context("spawn")
    shares = context.Array("d", [math.nan] * len(experiments), lock=False)  # NaN: it has not begun
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(min(jobs, len(experiments)), context, _begin_process, (shares,))
    try:
        # Processes start with the signals ignored that ask to end, and keep to it: it is this one that ends them.
        with interrupts.ignored():
            futures = {
                pool.submit(_run_there, one.name, seed, place, files): place for place, one in enumerate(experiments)
            }
        yield from _collect(futures, experiments, shares, watch)
    finally:
        with interrupts.ignored():
            for child in set(multiprocessing.active_children()) - before:
                child.kill()
            pool.shutdown(cancel_futures=True)


def _collect(
    futures: Mapping[Future[Verdict], int], experiments: Sequence[Experiment], shares: Any, watch: Watch
) -> Iterator[Verdict]:
    left = set(futures)
    while left:
        done, left = wait(left, LOOK_S, FIRST_COMPLETED)
        for future in done:
            try:
                verdict = future.result()
            except (BrokenProcessPool, CancelledError):
                continue  # the caller sees that it is missing
            except Exception as error:  # what came of it could not be handed over
                verdict = Verdict(experiments[futures[future]].name, error=_place(error))
            yield verdict
        places = (futures[future] for future in left)
        watch({experiments[place].name: shares[place] for place in places if not math.isnan(shares[place])})


_shares: Any = None  # of all experiments, in a process that runs some


def _begin_process(shares: Any) -> None:
    """Once in each process: it ends with the one that started it, however that ended."""
    global _shares
    _shares = shares
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _run_there(name: str, seed: int, place: int, files: Files) -> Verdict:
    """One experiment, by name, in one of the processes."""

    def progress(share: float) -> None:
        _shares[place] = share

    progress(0.0)
    return _run(all_experiments()[name], seed, progress, files)
