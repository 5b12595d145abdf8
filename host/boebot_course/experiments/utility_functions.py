"""Utility functions, gamma parameters and activation: section 8.2 of the notes, Figs. 8.2 and 8.3, E61 to E64.

    τ_i du_i/dt + u_i = tanh(c_i (Σ_k w_ik z_k + b_i + Γ_i)),   τΓ_i dΓ_i/dt = -Γ_i        (8.4)-(8.6)

All by the kit's own utilities, and E64 by a whole brain on a robot.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import boebot
from boebot.brain import Brain, CognitiveProcess, StateVariable, Utility
from boebot.brain.utility import Utilities
from boebot.robot import Robot
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, exactly, experiment
from boebot_course.trials import Log, Steady, decisions


def advanced(functions: list[Utility], variables: dict[str, Floats], step: float) -> Floats:
    """Utilities over time, shape (times, functions): at each time after the state variables of that time have been held
    for a step."""
    utilities = Utilities(functions, list(variables))
    rows = np.stack(list(variables.values()), axis=1).tolist()
    utilities.start(rows[0])
    values = []
    for z in rows:
        utilities.advance(z, step)
        values.append(list(utilities.values))
    return np.array(values)


TAU = 0.3  # s
LOSS, LOST_AT = 0.15, 5.0  # s; of Fig. 8.2
WEIGHT = 2.0  # of z_2 in u_3, Fig. 8.3
KICK = 3.0  # of E63


@experiment("E61")
def loss(seed: int) -> Outcome:
    """A short loss of readings hardly moves a utility

    In the notes: section 8.2.2, Fig. 8.2

    Figure: Left: a state variable z that is lost for 0.15 s. Right: a utility function of it, with time constant
    0.3 s; dotted: without.

    Expected: (8.4) solved: tanh 1.5 = 0.9051 falls by 0.0566, 1 - exp(-0.5) = 0.393 of all; back in 0.73 s.
    """
    step = 0.005
    times = np.arange(0, 10, step)
    z = np.where((times >= LOST_AT - 1e-9) & (times < LOST_AT + LOSS - 1e-9), 0.0, 1.0)
    utility = advanced([Utility(b=1.0, w={"z": 0.5}, tau=TAU)], {"z": z}, step)[:, 0]
    times_after = times + step  # the state variables hold until then
    settled, direct = math.tanh(1.5), np.tanh(1.0 + 0.5 * z)
    dip = settled - utility.min()
    lowest = int(utility.argmin())
    back = times_after[lowest:][utility[lowest:] > settled - 0.005][0] - times_after[lowest]
    measured = [
        about("utility before the loss", utility[0], 0.9051, 5e-5),
        about("dip of the utility", dip, 0.0566, 0.001),
        about("dip against that without a time constant", dip / (settled - direct.min()), 0.393, 0.005),
        about("lowest at", times_after[lowest], 5.15, 0.01, "s"),
        about("back within 0.005 after", back, 0.73, 0.01, "s"),
    ]

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, sharex=True)
        left.plot(times, z)
        left.set(xlabel="time (s)", ylabel="state variable z", ylim=(-0.05, 1.05))
        right.plot(times_after, utility, label="τ = 0.3 s")
        right.plot(times, direct, ":", color="0.5", label="without")
        right.set(xlabel="time (s)", ylabel="utility u", ylim=(-0.05, 1.05))
        right.legend(loc="lower right")

    return Outcome(measured, {"time_s": times, "z": z, "u": utility, "u_unfiltered": direct}, draw)


def intervals(active: NDArray[np.bool_], times: Floats) -> list[tuple[float, float]]:
    """When something was active: (from, to), to the last time at which it was."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(int), [0]))))
    return [(float(times[a]), float(times[b - 1])) for a, b in edges.reshape(-1, 2)]


FIRST, SECOND = (21.0, 2.5), (27.0, 0.5)  # s: when B3 takes over and for how long; the second "for less than 1 s"
RIPPLE = 0.1  # of z_2, sin²: 0.05 in the mean


def pulse_of(begin: float, length: float) -> tuple[float, float]:
    """When z_2 has to be 1 (from, to, s) for B3 to be active from `begin` on for `length` seconds: u_3 takes

        τ ln((s_1 - s_0) / (s_1 - u_1))   to rise to u_1, and   τ ln((s_1 - s_0) / (u_1 - s_0))   to fall to it,

    at rest at s_0 = tanh(w z - 0.9) with z the ripple alone, s_1 with 1 more. From (8.4).
    """
    rest, most, u_1 = (math.tanh(x) for x in (WEIGHT * RIPPLE / 2 - 0.9, WEIGHT * (1 + RIPPLE / 2) - 0.9, 0.5))
    rise = TAU * math.log((most - rest) / (most - u_1))
    fall = TAU * math.log((most - rest) / (u_1 - rest))
    return begin - rise, begin + length - fall


def by_convolution(settled: Floats, step: float, tau: float) -> Floats:
    """(8.4) solved as an integral: u(t) = ∫ e^((s-t)/τ) settled(s) ds / τ, from rest, by the sum over all steps."""
    kernel = np.exp(-step * np.arange(round(40 * tau / step)) / tau) * (1 - math.exp(-step / tau))
    whole = np.convolve(settled - settled[0], kernel)[: len(settled)]
    return np.asarray(settled[0] + whole)


@experiment("E62")
def three_behaviors(seed: int) -> Outcome:
    """Of three behaviors the one of the highest utility is active

    In the notes: section 8.2.3, Fig. 8.3

    Figure: Utilities of three behaviors: u1 (red) is constant, u2 (green) and u3 (blue) follow state variables.
    Below: the active one.

    Expected: The notes say: B1 most of the time, B3 around 21 s for around 2.5 s and around 27 s for less than 1 s,
    B2 never. w and b are chosen; when z_2 is 1 follows from those times by the closed solution of (8.4). Its
    ripple, 0 to 0.1, moves the rise by up to 0.03 s and the fall by 0.01 s, a short pulse the fall by 0.02 s, and
    steps are 0.01 s: 0.1 s is allowed. All utilities are compared with (8.4) as an integral.
    """
    step = 0.01
    times = np.arange(0, 50, step)
    z_1 = 0.5 + 0.4 * np.sin(0.35 * times) + 0.03 * np.sin(9 * times)
    ripple = RIPPLE * np.sin(1.3 * times) ** 2
    pulses = [pulse_of(*one) for one in (FIRST, SECOND)]
    z_2 = sum(((times >= begin) & (times < end)) for begin, end in pulses) + ripple
    functions = [
        Utility(b=0.5, tau=0.2),
        Utility(b=-0.8, w={"z1": 0.6}, tau=TAU),
        Utility(b=-0.9, w={"z2": WEIGHT}, tau=TAU),
    ]
    utilities = advanced(functions, {"z1": z_1, "z2": z_2}, step)
    solved = [np.full(len(times), math.tanh(0.5))]
    solved += [by_convolution(np.tanh(x), step, 0.3) for x in (0.6 * z_1 - 0.8, 2.0 * z_2 - 0.9)]
    active = utilities.argmax(axis=1)
    third = intervals(active == 2, times)
    first, second = (*third, (math.nan, math.nan), (math.nan, math.nan))[:2]
    measured = [
        exactly("intervals of B3", len(third), 2),
        exactly("time of B2", float((active == 1).sum()) * step, 0, "s"),
        about("first interval begins", first[0], 21.0, 0.1, "s"),
        about("length of the first", first[1] + step - first[0], 2.5, 0.1, "s"),
        about("second interval begins", second[0], 27.0, 0.1, "s"),
        Measured("length of the second", second[1] + step - second[0], "s", 0.0, 1.0),
        Measured(
            "largest distance of a utility from the integral",
            float(max(np.abs(utilities[:, i] - solved[i]).max() for i in range(3))),
            most=1e-9,
        ),
    ]

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True, height_ratios=(4, 1))
        for index, color in enumerate(("red", "green", "blue")):
            upper.plot(times, utilities[:, index], color=color, label=f"u{index + 1}")
            for begin, end in intervals(active == index, times):
                lower.hlines(index + 1, begin, end, color=color, linewidth=5)
        upper.set(ylabel="utility", ylim=(-0.8, 1.02))
        upper.legend(loc="upper right")
        lower.set(xlabel="time (s)", ylabel="active", yticks=(1, 2, 3), yticklabels=("B1", "B2", "B3"), ylim=(0.5, 3.5))

    data = {"time_s": times, "z1": z_1, "z2": z_2}
    return Outcome(measured, data | {f"u{i + 1}": utilities[:, i] for i in range(3)}, draw)


@experiment("E63")
def gamma(seed: int) -> Outcome:
    """A gamma parameter calls a process for a while

    In the notes: section 8.2.2, equation (8.6)

    Figure: A process at rest at tanh(-0.5) whose gamma parameter is set to 3: gamma and utility; grey: active.

    Expected: Γ = 3 exp(-t / 0.5 s) by (8.6); with it (8.4) gives u > 0 from 0.117 s to 1.215 s, ± 0.01 s.
    """
    step, decay = 0.001, 0.5
    utilities = Utilities([Utility(b=-0.5, tau=TAU, tau_gamma=decay)], [])
    utilities.start([])
    utilities.gammas[0] = KICK
    times: Floats = np.arange(1, 2001, dtype=np.float64) * step
    gammas, values = [], []
    for _ in times:
        utilities.advance([], step)
        gammas.append(utilities.gammas[0])
        values.append(utilities.values[0])
    active = intervals(np.array(values) > 0, times)
    begin, end = active[0] if active else (math.nan, math.nan)
    deviation = float(np.abs(np.array(gammas) - 3 * np.exp(-times / decay)).max())
    measured = [
        exactly("intervals in which it is active", len(active), 1),
        about("active from", begin, 0.117, 0.01, "s"),
        about("active to", end, 1.215, 0.01, "s"),
        Measured("largest distance of gamma from 3 exp(-t / 0.5 s)", deviation, most=1e-9),
    ]

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True)
        upper.plot(times, gammas)
        upper.set(ylabel="gamma parameter Γ")
        lower.plot(times, values)
        lower.axhline(0, color="0.6", linewidth=0.8)
        lower.set(xlabel="time after the kick (s)", ylabel="utility u")
        for axes in (upper, lower):
            axes.axvspan(begin, end, color="0.9", label="active")
        lower.legend()

    return Outcome(measured, {"time_s": times, "gamma": gammas, "u": values}, draw)


RISE, FALL = 1.0, 4.0  # s


@experiment("E64", robot="arsim")
def activation(seed: int) -> Outcome:
    """One motor behavior, and every cognitive process above zero

    In the notes: section 8.2.3

    Figure: Utilities of three motor behaviors and three cognitive processes while a state variable is 1 from 1 s to
    4 s; thick: active.

    Expected: The best motor behavior drives, cognitive ones run while u > 0: by (8.4) 0.142 s and 0.292 s late.
    """
    motor = [
        Steady(name=f"m{i}", left=i / 10, right=-i / 10, utility=Utility(b=i / 10, w={"z": 0.3 - i / 5}))
        for i in range(3)
    ]

    def when(_: CognitiveProcess, robot: Robot) -> float:
        return robot.time

    delayed = Log(name="delayed", read=when, utility=Utility(b=-0.5, w={"z": 1.5}, tau=TAU))
    notes = [delayed, Log(name="always", read=when), Log(name="never", read=when, utility=Utility(b=-0.2))]
    z = StateVariable("z", lambda robot: float(RISE - 1e-9 <= robot.time < FALL - 1e-9))
    brain = Brain([*motor, *notes], [z], period=0.01)
    result = boebot.run(brain, robot="arsim", arena="empty", seconds=6, seed=seed)
    record = decisions(result)
    times, utilities = record.time, record.utilities
    best = utilities[:, :3].argmax(axis=1)
    driving = np.array([round(left * 10) for _, _, left, _ in result.record.steps])
    stepped = np.stack([np.isin(times, note.rows) for note in notes], axis=1)
    disagree = int((stepped != (utilities[:, 3:] > 0)).sum())
    first, last = (delayed.rows[0], delayed.rows[-1]) if delayed.rows else (math.nan, math.nan)
    low, high = math.tanh(-0.5), math.tanh(1.0)
    on, off = 0.3 * math.log((high - low) / high), 0.3 * math.log((high - low) / -low)
    measured = [
        exactly("steps in which another motor behavior than the best drives", int((driving != best).sum()), 0),
        # m2 at z = 0, m0 at z = 1; halfway tanh is concave: (tanh 0.1 + tanh 0.2) / 2 of m1 > tanh(0.3) / 2 of m0
        exactly("motor behaviors that have been active", len(set(driving.tolist())), 3),
        exactly("steps and processes with u > 0 but idle, or not but active", disagree, 0),
        about("delay of switching on", first - RISE, on, 0.01, "s"),
        about("delay of switching off", last + brain.PERIOD - FALL, off, 0.01, "s"),
    ]

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True)
        active = np.concatenate((best[:, None] == np.arange(3), stepped), axis=1)
        for index, process in enumerate(brain.processes):
            axes, values, color = (upper if index < 3 else lower), utilities[:, index], f"C{index}"
            axes.plot(times, values, linewidth=0.8, color=color)
            axes.plot(times, np.where(active[:, index], values, np.nan), linewidth=3, color=color, label=process.name)
        for axes, kind in ((upper, "motor"), (lower, "cognitive")):
            axes.axhline(0, color="0.6", linewidth=0.8)
            axes.set(ylabel=f"utility, {kind}")
            axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))
        lower.set(xlabel="time (s)")

    names = [process.name for process in brain.processes]
    return Outcome(measured, {"time_s": times} | {f"u_{name}": utilities[:, i] for i, name in enumerate(names)}, draw)
