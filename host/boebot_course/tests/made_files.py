"""What tests have made of experiments in other processes, which find it here by name."""

from __future__ import annotations

import os

from boebot_course.experiments import Experiment, Outcome

ONE = "E30"


def few_files(experiment: Experiment, outcome: Outcome, seed: int) -> dict[str, bytes]:
    """All files of `ONE`; of others, which would only take longer, the data."""
    from boebot_course import output_files  # here: `fatal` shall not wait for it

    if experiment.name == ONE:
        return output_files.files(experiment, outcome, seed)
    return {f"{experiment.name}.csv": output_files.as_csv(outcome)}


def fatal(experiment: Experiment, outcome: Outcome, seed: int) -> dict[str, bytes]:
    """None; ends the process at once where the experiment is `ONE`, as a crash of compiled code does."""
    if experiment.name == ONE:
        os._exit(3)
    return {}
