"""The experiments of the notes, one topic per file: each run by one command, with a figure and a verdict."""

from importlib import import_module

from boebot.experiments.experiment import EXPERIMENTS, Experiment, Measured, Outcome

TOPICS = ("chemotaxis", "stentor", "utility_theory")

__all__ = ["Experiment", "Measured", "Outcome", "all_experiments"]


def all_experiments() -> dict[str, Experiment]:
    """All of them, by name, in the order of their names."""
    for topic in TOPICS:
        import_module(f"boebot.experiments.{topic}")
    return dict(sorted(EXPERIMENTS.items(), key=lambda item: (not item[0].startswith("E"), item[0])))
