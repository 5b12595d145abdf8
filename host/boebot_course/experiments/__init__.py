"""The experiments of the notes, one topic per file: each run by one command, with a figure and a verdict."""

from importlib import import_module
from pkgutil import iter_modules

from boebot_course.experiment import EXPERIMENTS, Experiment, Measured, Outcome

__all__ = ["Experiment", "Measured", "Outcome", "all_experiments"]


def all_experiments() -> dict[str, Experiment]:
    """All of them, by name, in the order of their names; those of one name as its file has its robots."""
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    found = sorted(EXPERIMENTS.values(), key=lambda one: (not one.name.startswith("E"), one.bare_name))
    return {one.name: one for one in found}
