"""What an evolution is to do: evolve.toml, read and checked before the first run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np

from boebot.brains import LoadedBrain, load_brain
from boebot.description import toml_files
from boebot.description.robots import Positive
from boebot.errors import BoebotError, CallError, did_you_mean
from boebot.running import brain_parameters
from boebot_campaign import plan, rows, toml_brain
from boebot_campaign.plan import MOST_RUNS, SOME, Plan, Seeds, Starts, Whole

EMPTY, RAISED = "empty_battery", "raised"
EVENTS = (EMPTY, RAISED)  # of a run; 1 or 0


class Box(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename={"low": "from", "high": "to"}):
    """Bounds of a parameter; None: as `brain_parameters.bounds` has it."""

    low: float | None = None
    high: float | None = None


class Given(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The keys of evolve.toml (docs/how-to/evolve.md); those that sweep.toml has, too, mean the same."""

    brain: str
    seconds: float
    seeds: Seeds
    test_seeds: Seeds
    parameters: Annotated[dict[str, Box], SOME]
    fitness: Annotated[dict[str, float], SOME]
    robot: str | None = None
    arenas: list[str] = []
    test_arenas: list[str] = []
    on: str | None = None
    starts: Starts = []
    limit_s: Positive = 60.0
    population: Annotated[int, msgspec.Meta(ge=2)] = 10
    generations: Annotated[int, msgspec.Meta(ge=1)] = 20
    restarts: Annotated[int, msgspec.Meta(ge=0, le=20)] = 0
    seed: Annotated[int, msgspec.Meta(ge=0)] = 1


class Evolve(NamedTuple):
    """An evolution that can be done.

    Attributes:
        name: of the file, for errors.
        loaded: the brain by hand.
        plan, test: of the candidates, and of the brain by hand after it.
        by_hand: the brain's own parameters as a point of the plan.
    """

    name: str
    given: Given
    loaded: LoadedBrain
    plan: Plan
    test: Plan
    by_hand: list[float]

    @property
    def robot(self) -> str | None:
        """The bundled one that the evolved brain's file names."""
        return _bundled(self.given.robot, self.loaded.robot)

    @property
    def arena(self) -> str | None:
        """The bundled one that it names."""
        return _bundled(next(iter(self.given.arenas), None), self.loaded.arena)

    @property
    def most_runs(self) -> int:
        """It has; a start ends sooner where the search finds nothing new."""
        each, given = self.plan.count // self.plan.points, self.given
        candidates = given.generations * given.population * ((2 << given.restarts) - 1) + 1
        return candidates * each + 2 * self.test.count

    def fitness(self, row: Mapping[str, Any], folder: Path) -> float:
        """Of a run; nan: it has no figures. Raises BoebotError: one of the fitness is not known of such runs."""
        if row["status"] not in (rows.OK, rows.RAISED):
            return np.nan
        charge = row["battery_charge"]
        known = {**row, RAISED: row["status"] == rows.RAISED, EMPTY: None if charge is None else charge == 0}
        for name in self.given.fitness:
            if known[name] is None:
                if row["status"] == rows.RAISED:
                    return np.nan
                raise BoebotError(
                    f"{self.name}: {name} is not known of row {row['row']} in {folder}; expected figures in fitness "
                    "that this robot and this arena have"
                )
        return float(sum(weight * known[name] for name, weight in self.given.fitness.items()))


def read(path: Path) -> Evolve:
    """What is in a file; what it names is found beside it.

    Raises:
        BoebotError: in one sentence, where anything is wrong with it.
    """
    if not path.is_file():
        raise CallError(f"there is no evolution file {path}; expected a TOML file")
    given = toml_files.convert(toml_files.read(path, CallError), Given, path.name, CallError)
    return _checked(given, path.parent, path.name)


def made(keys: Mapping[str, Any]) -> Evolve:
    """Of these keys, as a file could have them. Raises as `read`."""
    name = "evolution"
    return _checked(toml_files.convert(plan.as_in_a_file(keys, name), Given, name, CallError), Path(), name)


def _checked(given: Given, folder: Path, name: str) -> Evolve:
    loaded = load_brain(plan.whole(given.brain, folder))
    toml_brain.check(loaded)
    boxes = {one: _box(loaded, one, box, name) for one, box in given.parameters.items()}
    keys = {key: getattr(given, key) for key in ("seconds", "on", "starts", "limit_s")}
    keys |= {"brains": [given.brain], "robots": [given.robot] if given.robot else []}
    ranges = {one: {"from": low, "to": high} for one, (low, _, high) in boxes.items()}
    candidates = {"arenas": given.arenas, "seeds": given.seeds, "parameters": ranges}
    asked = plan.made(keys | candidates | {"design": "random", "points": given.population}, folder, name)
    test = plan.made(keys | {"arenas": given.test_arenas or given.arenas, "seeds": given.test_seeds}, folder, name)
    if both := _seeds(given.seeds) & _seeds(given.test_seeds):
        raise CallError(f"{name}: test_seeds has {min(both)}, as seeds has; expected seeds that no candidate has met")
    for one in given.fitness:
        if one not in (known := [*rows.numbers(asked), *EVENTS]):
            raise CallError(
                f"{name}: fitness has {one!r}; expected figures of a run: {', '.join(known)}{did_you_mean(one, known)}"
            )
    by_hand = [(value - low) / (high - low) for low, value, high in boxes.values()]
    found = Evolve(name, given, loaded, asked, test, by_hand)
    if found.most_runs > MOST_RUNS:
        raise CallError(f"{name}: these are up to {found.most_runs:,} runs; expected at most {MOST_RUNS:,}")
    return found


def _box(loaded: LoadedBrain, one: str, box: Box, name: str) -> tuple[float, float, float]:
    """Least, present and greatest value of a parameter."""
    values = brain_parameters.parameters(loaded)
    free = [*brain_parameters.sliders(loaded), *(other for other in values if ".utility.w." in other)]
    if one not in free:
        with brain_parameters.in_force(loaded, {one: values.get(one)}):  # says which there are
            pass
        raise CallError(f"{name}: {one} is {values[one]!r}; expected parameters that are numbers, and not whole ones")
    low, high = brain_parameters.bounds(loaded, one) if None in (box.low, box.high) else (0.0, 0.0)
    low, high = low if box.low is None else box.low, high if box.high is None else box.high
    if not low < high:
        raise CallError(f"{name}: {one} is from {low:g} to {high:g}; expected from below to")
    if not low <= values[one] <= high:
        raise CallError(f"{name}: {one} is {values[one]:g} by hand; expected bounds around it, not {low:g} to {high:g}")
    return low, values[one], high


def _seeds(given: list[int] | Whole) -> set[int]:
    return set(given) if isinstance(given, list) else set(range(given.low, given.high + 1))


def _bundled(given: str | None, own: str | None) -> str | None:
    """The name that a brain's file may say: of the one that was given, or else of the brain's own."""
    return own if given is None else given if Path(given).suffix != ".toml" else None
