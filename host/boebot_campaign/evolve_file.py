"""What an evolution is to do: evolve.toml, read and checked before the first run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from math import isnan, nan
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import msgspec

from boebot.brains import LoadedBrain, load_brain
from boebot.errors import BoebotError, CallError, did_you_mean
from boebot.running import brain_parameters
from boebot.system import folder_kept
from boebot_campaign import rows, toml_brain
from boebot_campaign.plan import SOME, Plan, Range, Seeds, Single, Whole, valid

EMPTY, RAISED = "empty_battery", "raised"
EVENTS = (EMPTY, RAISED)  # of a run; 1 or 0


class Box(Range, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Bounds of a parameter; nan: as `brain_parameters.bounds` has it."""

    low: float = nan
    high: float = nan


class Evolve(Single, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True):
    """The keys of evolve.toml (docs/how-to/evolve.md); those that sweep.toml has, too, mean the same."""

    test_seeds: Seeds
    parameters: Annotated[dict[str, Box], SOME]  # type: ignore[assignment]
    fitness: Annotated[dict[str, float], SOME]
    design: Literal["random"] = "random"
    population: Annotated[int, msgspec.Meta(ge=2)] = 10
    generations: Annotated[int, msgspec.Meta(ge=1)] = 20
    restarts: Annotated[int, msgspec.Meta(ge=0, le=20)] = 0
    seed: Annotated[int, msgspec.Meta(ge=0)] = 1

    def completed(self, at: str) -> Self:
        """With the bounds of all parameters. Raises CallError."""
        if self.points or self.imperfections:
            raise CallError(f"{at}an evolution has no points and imperfections; expected population and parameters")
        toml_brain.text(self.loaded, "", None, None)
        boxes = {name: _box(self.loaded, name, box, at) for name, box in self.parameters.items()}
        found = msgspec.structs.replace(self, parameters=boxes, points=self.population)
        valid(found.test, f"{at}of the test, ")
        met = _span(self.seeds)
        if both := [seed for seed in _span(self.test_seeds) if seed in met]:
            raise CallError(f"{at}test_seeds has {min(both)}, as seeds has; expected seeds that no candidate has met")
        for name in self.fitness:
            if name not in (known := [*rows.numbers(found), *EVENTS]):
                near = did_you_mean(name, known)
                raise CallError(f"{at}fitness has {name!r}; expected figures of a run: {', '.join(known)}{near}")
        return found

    @cached_property
    def loaded(self) -> LoadedBrain:
        """The brain by hand."""
        with folder_kept():
            return load_brain(self.brains[0])

    @cached_property
    def by_hand(self) -> list[float]:
        """Its parameters as a point of the plan."""
        values = brain_parameters.parameters(self.loaded)
        return [(values[name] - box.low) / (box.high - box.low) for name, box in self.parameters.items()]

    @cached_property
    def training(self) -> Plan:
        """Of a generation."""
        return self.as_sweep(test_arenas=[])

    @cached_property
    def test(self) -> Plan:
        """Of the brain by hand."""
        arenas = {"arenas": self.test_arenas or self.arenas, "test_arenas": []}
        return self.as_sweep(seeds=self.test_seeds, design="grid", points=0, parameters={}, **arenas)

    @property
    def most_runs(self) -> int:
        """It has; a start ends sooner where the search finds nothing new."""
        candidates = self.generations * self.population * ((2 << self.restarts) - 1) + 1
        return candidates * self.training.count // self.points + 2 * self.test.count

    def fitness_of(self, row: Mapping[str, Any], folder: Path) -> float:
        """Of a run; nan: it has no figures. Raises BoebotError: one of the fitness is not known of such runs."""
        if row["status"] not in (rows.OK, rows.RAISED):
            return nan
        charge = row["battery_charge"]
        known = {**row, RAISED: row["status"] == rows.RAISED, EMPTY: None if charge is None else charge == 0}
        for name in self.fitness:
            if known[name] is None:
                if row["status"] == rows.RAISED:
                    return nan
                raise BoebotError(f"row {row['row']} in {folder} has no {name}; expected a fitness of what runs have")
        return float(sum(weight * known[name] for name, weight in self.fitness.items()))


def _box(loaded: LoadedBrain, name: str, box: Box, at: str) -> Box:
    """With both bounds of a parameter."""
    values = brain_parameters.parameters(loaded)
    free = [*brain_parameters.sliders(loaded), *(other for other in values if ".utility.w." in other)]
    if name not in free:
        with brain_parameters.in_force(loaded, {name: values.get(name)}):  # says which there are
            pass
        raise CallError(f"{at}{name} is {values[name]!r}; expected parameters that are numbers, and not whole ones")
    pairs = zip((box.low, box.high), brain_parameters.bounds(loaded, name), strict=True)
    low, high = (found if isnan(given) else given for given, found in pairs)
    if not low < high:
        raise CallError(f"{at}{name} is from {low:g} to {high:g}; expected from below to")
    if not low <= values[name] <= high:
        raise CallError(f"{at}{name} is {values[name]:g} by hand; expected bounds around it, not {low:g} to {high:g}")
    return msgspec.structs.replace(box, low=low, high=high)


def _span(seeds: list[int] | Whole) -> set[int] | range:
    return set(seeds) if isinstance(seeds, list) else range(seeds.low, seeds.high + 1)
