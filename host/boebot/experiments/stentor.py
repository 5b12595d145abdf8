"""Stentor, which feeds and, when disturbed, avoids in steps of rising cost: section 7.2 of the notes, E59 and E60.

    dU_i/dt + a_i U_i = b_i X,   U_1 = C,   U_i(0) = 0         (7.11), (7.12)
    i_sel = argmax U_i                                         (7.13)
    dX/dt + k_1 X = X_1 while it feeds,  dX/dt + k_2 X = X_2 otherwise      (7.14), (7.15)

The parameters are lost; these reproduce Fig. 7.4 (section 6.2 of the specification).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boebot.experiments.experiment import Measured, Outcome, Progress, about, exactly, experiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DECAYS = (8.5, 4.3, 1.6, 0.75)  # a_2..a_5 (1/s)
GAINS = (12.0, 6.6, 2.75, 1.45)  # b_2..b_5 (1/s)
FEED = 0.46  # C
K_1, K_2, X_1, X_2 = 1.15, 0.9, 2.6, 0.15
NAMES = ("B1 feed", "B2 turn away", "B3 reverse cilia", "B4 contract", "B5 detach")


@dataclass(frozen=True)
class Response:
    """One disturbance: what it did, step by step."""

    times: list[float]
    stimulus: list[float]
    """X"""
    utilities: list[tuple[float, ...]]
    """U_1..U_5"""
    starts: list[tuple[int, float]]
    """which behavior began when (1..5, s)"""


def respond(dose: float = X_1, seconds: float = 4.0, step: float = 0.001) -> Response:
    """Stentor under a disturbance of that strength, X_1.

    Later starts follow from short returns to feeding, and feel the step and the scheme: with Euler steps of 1 ms, X
    before U, they are those of the specification; with steps that go to nothing the last two come 0.06 s later.
    """
    avoidance = [0.0] * len(DECAYS)
    x = 0.0
    found = Response([], [], [], [])
    for index in range(round(seconds / step)):
        utilities = (FEED, *avoidance)
        active = max(range(5), key=utilities.__getitem__)
        if not found.starts or found.starts[-1][0] != active + 1:
            found.starts.append((active + 1, index * step))
        found.times.append(index * step)
        found.stimulus.append(x)
        found.utilities.append(utilities)
        decay, rate = (K_1, dose) if active == 0 else (K_2, X_2)
        x += step * (rate - decay * x)  # (7.14), (7.15)
        avoidance = [u + step * (b * x - a * u) for u, a, b in zip(avoidance, DECAYS, GAINS, strict=True)]  # (7.12)
    return found


def _draw(found: Response) -> object:
    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True, height_ratios=(3, 1))
        for index, name in enumerate(NAMES):
            upper.plot(found.times, [utilities[index] for utilities in found.utilities], label=name)
        upper.set(ylabel="utility U")
        upper.legend(fontsize="small", ncols=3)
        starts = [*found.starts, (found.starts[-1][0], found.times[-1])]
        lower.step([time for _, time in starts], [which for which, _ in starts], where="post")
        lower.set(xlabel="time (s)", ylabel="active", yticks=range(1, 6))

    return draw


@experiment(
    "E59",
    title="Stentor avoids in steps",
    source="section 7.2, equations (7.11)-(7.15), Fig. 7.4",
    caption="Utilities of Stentor's five behaviors under a lasting disturbance, and which of them is active.",
)
def sequence(seed: int, progress: Progress) -> Outcome:
    found = respond()
    expected = [(1, 0.0), (2, 0.24), (3, 0.61), (4, 1.15), (5, 2.07), (1, 2.82), (5, 2.85), (1, 3.62), (5, 3.64)]
    order = [which for which, _ in found.starts]
    measured = [
        exactly("order is 1, 2, 3, 4, 5, 1, 5, 1, 5 (1: yes)", order == [which for which, _ in expected], 1),
        *(
            about(f"start {number} of B{which}", time, aim, 0.05, "s")
            for number, ((which, time), (_, aim)) in enumerate(zip(found.starts, expected, strict=False), 1)
        ),
        about("largest X", max(found.stimulus), 0.55, 0.02),
    ]
    data = {"time_s": found.times, "x": found.stimulus}
    data |= {f"u{index + 1}": [u[index] for u in found.utilities] for index in range(5)}
    return Outcome(measured, data, _draw(found))  # type: ignore[arg-type]


@experiment(
    "E60",
    title="Stentor: a weaker disturbance is not worth the costliest answer",
    source="section 7.2, equation (7.14)",
    caption="Utilities of Stentor's behaviors under a disturbance of less than half the strength: B5 stays away.",
)
def dose(seed: int, progress: Progress) -> Outcome:
    found = respond(1.0)
    order = "".join(str(which) for which, _ in found.starts)
    measured = [
        exactly("starts of B5 in 4 s", order.count("5"), 0),
        exactly("order is 1, 2, 3, 4, 1, 4, 1, 4 (1: yes)", order == "12341414", 1),
    ]
    data = {"time_s": found.times, "x": found.stimulus}
    data |= {f"u{index + 1}": [u[index] for u in found.utilities] for index in range(5)}
    return Outcome(measured, data, _draw(found))  # type: ignore[arg-type]


@experiment(
    "dose-response",
    title="Stentor's costliest behavior against the strength of the disturbance",
    source="section 7.2",
    caption="First behaviors reached within 4 s, and time until B5, against the strength X_1 of the disturbance.",
)
def dose_response(seed: int, progress: Progress) -> Outcome:
    doses = np.linspace(0.2, 4.0, 39)
    highest, detaching = [], []
    for index, strength in enumerate(doses):
        found = respond(float(strength), step=0.002)
        highest.append(max(which for which, _ in found.starts))
        detaching.append(next((time for which, time in found.starts if which == 5), float("nan")))
        progress(index / len(doses))
    falls = int((np.diff(highest) < 0).sum())
    first = float(doses[highest.index(5)])
    known = np.array([time for time in detaching if time == time])
    measured = [
        exactly("a stronger disturbance brings a milder answer (cases)", falls, 0),
        Measured("weakest disturbance that brings B5", first, "", 1.0, 1.4),
        Measured(
            "weakest disturbance that brings any avoidance",
            float(doses[next(i for i, h in enumerate(highest) if h > 1)]),
            "",
            0.0,
            1.0,
        ),
        Measured("share of stronger doses that bring B5 sooner", float((np.diff(known) <= 0).mean()), "", 0.9, 1.0),
    ]

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True)
        upper.step(doses, highest, where="mid")
        upper.set(ylabel="highest behavior", yticks=range(1, 6))
        lower.plot(doses, detaching, ".-")
        lower.set(xlabel="strength X_1 of the disturbance", ylabel="time until B5 (s)")

    return Outcome(measured, {"dose": doses, "highest": highest, "time_to_b5_s": detaching}, draw)
