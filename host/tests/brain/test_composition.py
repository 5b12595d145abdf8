"""Brains composed in TOML: every kind of process, the same commands as in Python, and the errors of bad files."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot.behaviors import Avoid, ChargeBattery, RunAndTumble, Wander
from boebot.brain import Brain, Utility
from boebot.brain.composition import load, process_kinds
from boebot.cognition import BatteryLevel, LightSense, near
from boebot.errors import BrainError
from boebot.robot import Robot
from steps import FULL, Stepped, SteppedVehicle

# what the kinds need beside their names
REQUIRED = {
    "battery_level": "empty = 5.0\nfull = 7.75",
    "kinesis": 'stimulus = "near"',
    "run_and_tumble": 'stimulus = "near"',
}


WITH = {  # what a kind asks, or takes its figures from
    "charge_battery": ["battery_level"],
    "drift": ["odometry"],
    "homing": ["odometry", "path_integration"],
    "path_integration": ["odometry"],
    "straight_run": ["odometry"],
    "stuck_detector": ["odometry"],
}


def write(folder: Path, text: str) -> Path:
    path = folder / "brain.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", sorted(process_kinds()))
def test_every_kind_of_process_can_be_made_and_stepped(kind: str, tmp_path: Path) -> None:
    kinds = ["stop"] * (kind != "stop") + [*WITH.get(kind, ()), kind]
    tables = [f"[process.{one}]\n{REQUIRED.get(one, '')}\nutility = {{ b = {0.1 * (one != 'stop')} }}" for one in kinds]
    brain = load(write(tmp_path, "[variable.near]\n\n" + "\n\n".join(tables)))
    stepped = Stepped(0.05, description=FULL)
    process = next(one for one in brain.processes if one.name == kind)
    assert type(process) is process_kinds()[kind]
    was_active = False
    for _ in range(20):  # touched, and something near: what waits for a stimulus has it
        stepped.step(brain, whiskers=1, infrared=3, light_left=900, light_right=800, battery=700, battery_age=0)
        was_active |= brain._active[brain._place(process)]
    assert was_active


BOTH = """
period_s = 0.05
margin = 0.01

[variable.near]

[variable.hungry]
of = "pack"

[variable.on_charger]
of = "pack"
kind = "charging"

[variable.bright]
of = "light_sense"

[process.wander]
turn_probability = 0.02
utility = { b = 0.5 }

[process.avoid]
clear = 0.1
utility = { b = -1.0, w = { near = 10.0 }, tau = 0.1 }

[process.fetch]
kind = "charge_battery"
signal = 0.3
utility = { b = -1.7, w = { hungry = 3.2, on_charger = 1.9 } }

[process.coli]
kind = "run_and_tumble"
stimulus = "bright"
period = 0.1
utility = { b = -0.6, w = { bright = 2.0 } }

[process.pack]
kind = "battery_level"
empty = 10
full = 12.0
tau = 0.1

[process.light_sense]
scale = 3.0
"""


def in_python() -> Brain:
    pack, light = BatteryLevel(name="pack", empty=10.0, full=12.0, tau=0.1), LightSense(scale=3.0)
    hungry, on_charger, bright = pack.variable(), pack.charging_variable(), light.variable()
    weights = {"low": 3.2, "charging": 1.9}

    def stimulus(robot: Robot) -> float | None:
        return bright.read(robot)

    return Brain(
        [
            Wander(turn_probability=0.02, utility=Utility(b=0.5)),
            Avoid(clear=0.1, utility=Utility(b=-1.0, w={"near": 10.0}, tau=0.1)),
            ChargeBattery(name="fetch", signal=0.3, utility=Utility(b=-1.7, w=weights)),
            RunAndTumble(name="coli", stimulus=stimulus, period=0.1, utility=Utility(b=-0.6, w={"light": 2.0})),
            pack,
            light,
        ],
        [near(), hungry, on_charger, bright],
        period=0.05,
        margin=0.01,
    )


def test_a_brain_of_a_file_gives_the_commands_of_the_same_brain_in_python(tmp_path: Path) -> None:
    brains = load(write(tmp_path, BOTH)), in_python()
    drivers = []
    for brain in brains:
        vehicle = SteppedVehicle(0.05, seed=5)
        commands = []
        for step in range(600):
            near_by = 0.6 if step % 97 < 20 else 0.02
            light = 8.0 if step % 131 > 90 else 0.5
            volts = 12.0 - 2.0 * (step % 300) / 300
            commands.append(vehicle.steer(brain, near_by, 0.01, 0, 0, 0, 0, light, 1.0, volts))
        drivers.append((commands, [one.motor for one in brain.steps]))
    assert drivers[0] == drivers[1]
    assert {"wander", "avoid", "fetch", "coli"} == set(drivers[0][1]), "all had their turn"


STOP = "[process.stop]\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[process.stop", "brain.toml is no valid TOML: "),
        (STOP + STOP, "brain.toml:2: 'process.stop' is given twice; expected each key and table once"),
        ("period_s = 0.05\n", "brain.toml: the key 'process' is missing"),
        ("process = 3\n", "brain.toml:1: process: expected object, got int"),
        (STOP + "[process.up]\n", "brain.toml:2: process.up: kind is 'up'; expected one of avoid, "),
        (STOP + "sped = 1\n", "brain.toml:2: process.stop: there is no key 'sped' here; expected utility, period"),
        ("[process.wander]\n\nforward = 'x'\n", "brain.toml:3: process.wander.forward: expected float, got str"),
        ("[process.wander]\nforward = nan\n", "brain.toml:2: process.wander.forward: expected a finite number"),
        ("[process.kinesis]\n", "brain.toml:1: process.kinesis: the key 'stimulus' is missing"),
        (
            "[process.kinesis]\nfast = 0.3\nstimulus = 'fog'\n",
            "brain.toml:3: process.kinesis.stimulus names the state variable 'fog'; this brain has none",
        ),
        (
            "[variable.near]\n[process.stop]\nutility = { w = { neer = 1.0 } }\n",
            "brain.toml:3: process.stop.utility.w.neer names the state variable 'neer'; this brain has near",
        ),
        (STOP + "utility = { tau = 0.0 }\n", "brain.toml:2: utility: tau is 0.0; expected more than 0"),
        (
            STOP + "utility = { t = 1.0 }\n",
            "brain.toml:2: process.stop.utility: there is no key 't' here; ",
        ),
        (
            "[process.f]\nkind = 'follow_wall'\nside = 'up'\n",
            "brain.toml:3: process.f.side is 'up'; expected one of left, right",
        ),
        (
            "[process.evade]\nsignal = 0.4\nstrong = 0.05\n",
            "brain.toml:3: evade: weak is 0.1 and strong 0.05; expected 0 <= weak < strong",
        ),
        (STOP + "period = -1\n", "brain.toml:2: stop: period is -1.0; expected seconds from step to step"),
        (
            STOP + "[variable.fog]\n",
            "brain.toml:2: variable.fog: there is no kind 'fog'; expected ",
        ),
        (
            STOP + "[variable.a]\nof = 'stop'\n",
            "brain.toml:3: variable.a.of is 'stop'; expected a process that has a state variable: there is none",
        ),
        (
            STOP + "[process.contact]\n[process.drift]\n[process.odometry]\n[variable.a]\nof = 'drift'\nkind = 'x'\n",
            "brain.toml:7: variable.a.kind is 'x'; drift has one alone: expected no kind",
        ),
        (
            STOP + "[process.battery_level]\nempty = 1\nfull = 2\n[variable.a]\nkind = 'x'\nof = 'battery_level'\n",
            "brain.toml:6: variable.a.kind is 'x'; battery_level has 'charging'",
        ),
        ("period_s = 0.0\n" + STOP, "brain.toml:1: a brain's period of 0.0; expected seconds from step to step"),
        (STOP + "[process.drift]\nname = 'x'\n", "brain.toml:3: process.drift: there is no key 'name' here"),
        ("[process.odometry]\n", "brain.toml:1: a brain needs at least one motor behavior"),
        ("margin = -1.0\n" + STOP, "brain.toml:1: a margin of -1.0; expected 0 or more"),
    ],
)
def test_a_bad_file_gets_one_sentence_with_its_line(text: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(BrainError) as caught:
        load(write(tmp_path, text))
    said = str(caught.value)
    assert said.startswith(sentence) and "\n" not in said


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(BrainError, match=r"none\.toml cannot be read: "):
        load(tmp_path / "none.toml")
