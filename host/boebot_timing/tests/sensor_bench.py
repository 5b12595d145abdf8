"""A board with sensors whose surroundings change at given cycles, and the age of the readings in its telemetry."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from boebot.link import messages
from boebot.link.messages import Devices
from boebot_timing.emulated.line import Line
from boebot_timing.emulated.loads import CYCLES_PER_US, ECHO_DELAY_CYCLES, TICK_CYCLES, Ping
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.board import Level

PROBE_CYCLES = 1_600_000  # 0.1 s: a session lives as long as it hears of us


@dataclass
class Stimulus:
    """What one sensor sees: one of two states; when it changed into which."""

    changes: list[tuple[int, bool]] = field(default_factory=lambda: [(0, False)])

    def at(self, cycle: int) -> bool:
        """The state at that time."""
        return self.changes[bisect_right(self.changes, cycle, key=lambda change: change[0]) - 1][1]

    @property
    def now(self) -> bool:
        """The newest state."""
        return self.changes[-1][1]


class Surroundings:
    """A board on a bench, and what is around it; everything happens at the cycle for which it is due."""

    def __init__(self, elf: Path) -> None:
        self.bench = Bench(elf, record=False)
        self.line = Line(self.bench)
        self.stimuli: dict[str, Stimulus] = {}

    def begin(self, devices: Devices) -> None:
        """Opens a session with those devices on, each sent as often as it can be."""
        self.line.open()
        self.line.set("devices", int(devices))
        self.line.set("encoder_gap", 0)
        if devices & Devices.BATTERY:
            self.line.set("devices_period", 1)
        self.bench.run(20 * TICK_CYCLES)
        self.each(self.bench.now + PROBE_CYCLES, PROBE_CYCLES, lambda: self.line.send(messages.ClockProbe(0)))

    def each(self, first: int, period: int, action: Callable[[], Any]) -> None:
        """Does something again and again."""

        def once(cycle: int) -> None:
            action()
            self.bench.at(cycle + period, lambda: once(cycle + period))

        self.bench.at(first, lambda: once(first))

    def change(self, name: str, first: int, period: int, apply: Callable[[bool], None]) -> None:
        """Changes what a sensor sees, again and again. `period`, in cycles, is longer than a reading's greatest age;
        what remains of it after whole periods of the sensor sweeps those."""
        self.stimuli[name] = stimulus = Stimulus()

        def other() -> None:
            stimulus.changes.append((self.bench.now, not stimulus.now))
            apply(stimulus.now)

        self.each(first, period, other)

    def run(self, seconds: float) -> None:
        """Lets time pass."""
        self.bench.run(round(seconds * 16e6))

    def ages(self, name: str, kind: type, shows: Callable[[Any, bool], bool]) -> Ages:
        """Of all changes of a stimulus, by the telemetry of that kind. `shows(message, state)`: it is of that state
        alone."""
        sent = [heard for heard in self.line.heard if isinstance(heard.message, kind)]
        firsts = [heard.first for heard in sent]
        changes = self.stimuli[name].changes[1:]
        ages, delays = [], []
        for (cycle, state), (until, _) in pairwise(changes):
            since = sent[bisect_right(firsts, cycle) : bisect_right(firsts, until)]
            old = [number for number, heard in enumerate(since) if not shows(heard.message, state)]
            shown = old[-1] + 1 if old else 0
            assert shown < len(since), f"{name}: a change was never sent"
            ages.append((since[shown - 1].first - cycle) / CYCLES_PER_US if old else 0.0)
            delays.append((since[shown].first - cycle) / CYCLES_PER_US)
        return Ages(name, np.array(ages), np.array(delays))


@dataclass
class Ages:
    """us from each change to the last telemetry that did not show it, and to the first that did."""

    name: str
    ages: np.ndarray
    delays: np.ndarray


class RangeFinder(Ping):
    """Answers a trigger with the echo of what is there at that time."""

    def __init__(self, pin: int, stimulus: Stimulus, lengths: tuple[int, int]) -> None:
        super().__init__(pin)
        self.stimulus, self.lengths = stimulus, lengths  # us

    def _answer(self, bench: Bench, triggered: int) -> None:
        if self.echoes and triggered < self.echoes[-1][1]:
            return
        rise = triggered + ECHO_DELAY_CYCLES
        fall = rise + self.lengths[self.stimulus.at(triggered)] * CYCLES_PER_US
        bench.drive(self.pin, Level.HIGH, at=rise)
        bench.drive(self.pin, Level.LOW, at=fall)
        self.echoes.append((rise, fall))


class Receiver:
    """An IR receiver that sees the bursts of its LED while its stimulus is on: its output is low then."""

    def __init__(self, bench: Bench, led: int, pin: int, stimulus: Stimulus) -> None:
        self.bench, self.pin, self.stimulus, self._until = bench, pin, stimulus, 0
        bench.on_edge(led, self._on_edge)

    def _on_edge(self, cycle: int, level: Level) -> None:
        if level == Level.HIGH and cycle > self._until:
            self._until = cycle + 1300 * CYCLES_PER_US
            if self.stimulus.at(cycle):
                self.bench.drive(self.pin, Level.LOW)
                self.bench.drive(self.pin, Level.HIGH, at=self._until)


class LightSensor:
    """A capacitor that the board charges and the light discharges; `decays`: us, in either light."""

    def __init__(self, bench: Bench, pin: int, decays: tuple[int, int]) -> None:
        self.bench, self.pin, self.decays = bench, pin, [us * CYCLES_PER_US for us in decays]
        self.bright = False
        self._left, self._since = 0.0, 0  # charge, of 1, and when it was that
        self._falls: int | None = None
        bench.on_edge(pin, self._on_edge)

    def _on_edge(self, cycle: int, level: Level) -> None:
        if level == Level.HIGH:
            self._falls = None
            self.bench.drive(self.pin, Level.HIGH)
        else:
            self._left, self._since = 1.0, cycle
            self._fall()

    def shine(self, bright: bool) -> None:
        """The light changes; what is left of the charge goes at the new rate."""
        now = self.bench.now
        if self._falls is not None and now < self._falls:
            self._left -= (now - self._since) / self.decays[self.bright]
            self._since, self.bright = now, bright
            self._fall()
        self.bright = bright

    def _fall(self) -> None:
        self._falls = self._since + round(self._left * self.decays[self.bright])
        self.bench.drive(self.pin, Level.LOW, at=self._falls)


class Held:
    """A sensor with its own clock: what was there when a measurement began comes out `late` cycles after its end,
    and stays until the next one does."""

    def __init__(
        self, around: Surroundings, name: str, first: int, timing: tuple[int, int], out: Callable[[bool], None]
    ) -> None:
        period, late = timing
        self._around, self._name, self._out, self._takes = around, name, out, period + late
        around.each(first, period, self._measure)

    def _measure(self) -> None:
        state = self._around.stimuli[self._name].now
        self._around.bench.at(self._around.bench.now + self._takes, lambda: self._out(state))
