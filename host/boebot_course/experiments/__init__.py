"""The experiments of the notes, one topic per file: each run by one command, with a figure and a verdict."""

from importlib import import_module
from pkgutil import iter_modules

from boebot_course.experiment import EXPERIMENTS, Experiment, Measured, Outcome

__all__ = ["Experiment", "Measured", "Outcome", "all_experiments"]


def all_experiments() -> dict[str, Experiment]:
    """All of them, by name, in the order of their names."""
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    return dict(sorted(EXPERIMENTS.items(), key=lambda item: (not item[0].startswith("E"), item[0])))
