"""The timing rule: section 3.2 of the notes and its figure, E17."""

from __future__ import annotations

import msgspec

from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import NotRealisableError
from boebot.running.runner import run
from boebot_course.experiment import Figure, Outcome, about, exactly, experiment
from boebot_timing.diagram import step
from boebot_timing.realisable import judge

STEP_S = 0.01
READING_S = 0.003  # of an IR sensor, chosen: two fit into the step with the brain, four do not, as in Fig. 3.2
BRAIN_S = 0.001
SENSORS = ("infrared_left", "infrared_right", "infrared_back_left", "infrared_back_right")


def robot_with(count: int) -> RobotDescription:
    """The notes' robot with `count` IR sensors, read one after another."""
    robot = load_robot("arsim")
    sensor = msgspec.structs.replace(robot.device["infrared_left"], reading_s=READING_S)
    others = {name: device for name, device in robot.device.items() if not name.startswith("infrared")}
    return msgspec.structs.replace(robot, device=others | dict.fromkeys(SENSORS[:count], sensor))


def is_run(count: int) -> bool:
    """Whether a run of that robot begins."""
    try:
        return run("wander", robot=robot_with(count), period=STEP_S, seconds=0.1).steps > 0
    except NotRealisableError:
        return False


@experiment("E17", robot="arsim")
def timing_rule(seed: int) -> Outcome:
    """Timing: two IR sensors fit into the time step, four do not

    In the notes: section 3.2, Fig. 3.2

    Figure: All that one time step asks of the hardware, to scale, for two IR sensors and for four; the line is Δt.

    Expected: The rule of section 3.2: the sum of all events that follow one another is less than Δt.
    """
    verdicts = {count: judge(robot_with(count), STEP_S, brain_s=BRAIN_S) for count in (2, 3, 4)}
    measured = [
        about(f"sum with {count} sensors", verdict.seconds * 1000, count * 3.0 + 1.0, 1e-9, "ms")
        for count, verdict in verdicts.items()
    ]
    measured += [
        exactly("realisable with 2 sensors (1: yes)", verdicts[2].is_realisable, 1),
        exactly("with 3, where the sum is just Δt", verdicts[3].is_realisable, 0),
        exactly("with 4", verdicts[4].is_realisable, 0),
        exactly("a run with 2 sensors begins", is_run(2), 1),
        exactly("a run with 4 sensors begins", is_run(4), 0),
    ]
    events = [(count, event) for count, verdict in verdicts.items() for event in verdict.events]

    def draw(figure: Figure) -> None:
        for axes, verdict in zip(figure.subplots(2, 1), (verdicts[2], verdicts[4]), strict=True):
            step(axes, verdict)
            axes.set_title("realisable" if verdict.is_realisable else "not realisable", loc="right", fontsize=10)

    data = {
        "sensors": [count for count, _ in events],
        "event": [event.name for _, event in events],
        "begins_s": [event.begin for _, event in events],
        "ends_s": [event.end for _, event in events],
    }
    return Outcome(measured, data, draw)
