"""Stentor, which feeds and, when disturbed, avoids in steps of rising cost: section 7.2 of the notes, E59 and E60.

    dU_i/dt + a_i U_i = b_i X,   U_1 = C,   U_i(0) = 0         (7.11), (7.12)
    i_sel = argmax U_i                                         (7.13)
    dX/dt + k_1 X = X_1 while it feeds,  dX/dt + k_2 X = X_2 otherwise      (7.14), (7.15)

The notes do not give the parameters; these reproduce Fig. 7.4. Three ways through the equations stand here: Euler's
method, by which the expected times were found, the exact one, from switch to switch, and that of the kit's behavior
`Escalate`, whose chain of leaky integrators holds X over each step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.behaviors.escalate import LeakyChain
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, exactly, experiment

DECAYS = np.array((8.5, 4.3, 1.6, 0.75))  # a_2..a_5 (1/s)
GAINS = np.array((12.0, 6.6, 2.75, 1.45))  # b_2..b_5 (1/s)
FEED = 0.46  # C
K_1, K_2, X_1, X_2 = 1.15, 0.9, 2.6, 0.15
SECONDS = 4.0  # axis of Fig. 7.4
STEP = 0.001  # s
NAMES = ("B1 feed", "B2 turn away", "B3 reverse cilia", "B4 contract", "B5 detach")
LINES = ("-", "--", ":", "-.", "-")


@dataclass(frozen=True)
class Response:
    """One disturbance: what it did."""

    times: Floats
    stimulus: Floats
    """X"""
    utilities: Floats
    """U_1..U_5, shape (times, 5)"""
    starts: list[tuple[int, float]]
    """which behavior began when (1..5, s)"""

    @property
    def order(self) -> str:
        """The behaviors in the order of their starts, such as "12345"."""
        return "".join(str(which) for which, _ in self.starts)

    def first(self, behavior: int) -> float:
        """When that behavior (1..5) began first (s); NaN: never."""
        return next((time for which, time in self.starts if which == behavior), np.nan)


def by_euler(dose: float = X_1, seconds: float = SECONDS, step: float = STEP) -> Response:
    """Stentor under a disturbance of strength X_1 = `dose`, by Euler's method; X is advanced before the utilities."""
    times: Floats = np.arange(round(seconds / step), dtype=np.float64) * step
    stimulus, utilities = np.zeros(len(times)), np.full((len(times), 5), FEED)
    x, u, starts = 0.0, np.zeros(4), [(1, 0.0)]
    for index, time in enumerate(times):
        stimulus[index], utilities[index, 1:] = x, u
        active = int(np.argmax(utilities[index]))
        if starts[-1][0] != active + 1:
            starts.append((active + 1, float(time)))
        x += step * (dose - K_1 * x if active == 0 else X_2 - K_2 * x)
        u = u + step * (GAINS * x - DECAYS * u)
    return Response(times, stimulus, utilities, starts)


def by_chain(seconds: float = SECONDS, step: float = STEP) -> list[tuple[int, float]]:
    """Starts as the kit's chain has them (1..5, s); X is advanced before it, by (7.14) or (7.15) solved."""
    chain = LeakyChain(list(zip(DECAYS.tolist(), GAINS.tolist(), strict=True)), FEED)
    x, starts = 0.0, [(1, 0.0)]
    for index in range(round(seconds / step)):
        active = chain.chosen
        if starts[-1][0] != active + 1:
            starts.append((active + 1, index * step))
        k, end = (K_1, X_1 / K_1) if active == 0 else (K_2, X_2 / K_2)
        x = end + (x - end) * math.exp(-k * step)
        chain.advance(x, step)
    return starts


def held(active: int, dose: float, x: float, u: Floats, since: Floats) -> tuple[Floats, Floats]:
    """X and U_2..U_5 a while after x and u, the same behavior (0..4) being active: (7.12) with (7.14) or (7.15) solved,

    X = X_e + (x - X_e) e^(-kt),   U = b X_e / a + p e^(-kt) + (u - b X_e / a - p) e^(-at),   p = b (x - X_e) / (a - k).
    """
    k, end = (K_1, dose / K_1) if active == 0 else (K_2, X_2 / K_2)
    settled, part = GAINS * end / DECAYS, GAINS * (x - end) / (DECAYS - k)
    fading, own = np.exp(-k * since), np.exp(-DECAYS * since[:, None])
    return end + (x - end) * fading, settled + part * fading[:, None] + (u - settled - part) * own


def exact(dose: float = X_1, seconds: float = SECONDS) -> Response:
    """The same without steps: solved from switch to switch, each switch located to 1e-12 s.

    A visit to another behavior of less than 1 ms would be passed over.
    """
    grid = np.arange(0.0, seconds + 2 * STEP, STEP)
    begin, active, x, u = 0.0, 0, 0.0, np.zeros(4)
    starts = [(1, 0.0)]
    pieces: list[tuple[Floats, Floats, Floats]] = []
    while True:
        since = grid[grid < seconds - begin]
        xs, us = held(active, dose, x, u, since)
        wants = _largest(us)
        left = np.flatnonzero(wants != active)
        left = left[left > 0]  # at 0 the two are equal
        until = len(since) if not len(left) else int(left[0])
        pieces.append((begin + since[:until], xs[:until], us[:until]))
        if not len(left):
            break
        low, high = float(since[until - 1]), float(since[until])
        while high - low > 1e-12:
            middle = (low + high) / 2
            if _largest(held(active, dose, x, u, np.array([middle]))[1])[0] == active:
                low = middle
            else:
                high = middle
        last_x, last_u = held(active, dose, x, u, np.array([high]))
        x, u, begin = float(last_x[0]), last_u[0], begin + high
        active = int(_largest(last_u)[0])
        starts.append((active + 1, begin))
    times, stimulus, utilities = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return Response(times, stimulus, np.insert(utilities, 0, FEED, axis=1), starts)


def _largest(u: Floats) -> NDArray[np.intp]:
    """(7.13), 0..4, at each row of U_2..U_5."""
    return np.asarray(np.where(u.max(axis=1) > FEED, u.argmax(axis=1) + 1, 0))


def undisturbed(seconds: float) -> float:
    """The weakest X_1 at which it stops feeding within that time: until then U_i is proportional to X_1."""
    u = held(0, 1.0, 0.0, np.zeros(4), np.array([seconds]))[1]
    return float(FEED / u.max())


def _draw(figure: Figure, found: Response) -> None:
    axes = figure.subplot_mosaic([["u", "x"], ["active", "x"]], height_ratios=(4, 1))
    for index, (name, line) in enumerate(zip(NAMES, LINES, strict=True)):
        marker = "+" if name is NAMES[-1] else None
        every = max(1, len(found.times) // 30)
        axes["u"].plot(found.times, found.utilities[:, index], line, marker=marker, markevery=every, label=name)
    axes["u"].set(ylabel="utility U", xlim=(0, SECONDS), ylim=(0, 0.7), xticklabels=())
    axes["u"].legend(fontsize="x-small", loc="lower right")
    axes["x"].plot(found.times, found.stimulus, color="C5")
    axes["x"].set(xlabel="time (s)", ylabel="noxious substance X", xlim=(0, SECONDS), ylim=(0, 0.7))
    ends = [time for _, time in found.starts[1:]] + [SECONDS]
    for (which, time), end in zip(found.starts, ends, strict=True):
        axes["active"].hlines(which, time, end, color=f"C{which - 1}", linewidth=4)
    names = [f"B{number}" for number in range(1, 6)]
    axes["active"].set(xlabel="time (s)", ylabel="active", yticks=range(1, 6), yticklabels=names)
    axes["active"].set(xlim=(0, SECONDS), ylim=(0.4, 5.6))


def _data(found: Response) -> dict[str, Any]:
    columns = {"time_s": found.times[::4], "x": found.stimulus[::4]}
    return columns | {f"u{index + 1}": found.utilities[::4, index] for index in range(5)}


@experiment("E59")
def sequence(seed: int) -> Outcome:
    """Stentor avoids in steps

    In the notes: section 7.2, equations (7.11)-(7.15), Fig. 7.4

    Figure: Left: utilities of Stentor's five behaviors under a lasting disturbance, and which of them is active.
    Right: concentration X of the noxious substance.

    Expected: The order of Fig. 7.4, with times found by Euler's method with steps of 1 ms, X first. Later starts
    follow from short returns to feeding and feel the step; the last two of the exact solution, 0.06 s later, stand
    beside them with the times of an independent integrator. The kit's chain is compared with the exact solution.
    """
    found, limit, chain = by_euler(), exact(), by_chain()
    expected = [(1, 0.0), (2, 0.24), (3, 0.61), (4, 1.15), (5, 2.07), (1, 2.82), (5, 2.85), (1, 3.62), (5, 3.64)]
    starts = list(zip_longest(found.starts, expected, fillvalue=(0, np.nan)))
    measured = [
        exactly("order is 1, 2, 3, 4, 5, 1, 5, 1, 5 (1: yes)", found.order == "123451515", 1),
        *(
            about(f"start {number} of B{which}", time, aim, 0.05, "s")
            for number, ((_, time), (which, aim)) in enumerate(starts, 1)
        ),
        about("largest X", float(found.stimulus.max()), 0.55, 0.02),
        exactly("exact: order is the same (1: yes)", limit.order == "123451515", 1),
        about("exact: last start of B1", limit.starts[7][1] if len(limit.starts) > 7 else np.nan, 3.6794, 1e-4, "s"),
        about("exact: last start of B5", limit.starts[-1][1], 3.6976, 1e-4, "s"),
        exactly(
            "the kit's chain: order is the same (1: yes)", [b for b, _ in chain] == [b for b, _ in limit.starts], 1
        ),
        Measured("its starts off the exact ones by", _farthest(chain, limit.starts), "s", 0.0, 0.05),
    ]
    return Outcome(measured, _data(found), lambda figure: _draw(figure, found))


def _farthest(starts: list[tuple[int, float]], others: list[tuple[int, float]]) -> float:
    return max(abs(one - other) for (_, one), (_, other) in zip(starts, others, strict=False))


@experiment("E60")
def dose(seed: int) -> Outcome:
    """Stentor: a weaker disturbance is answered by the costliest behavior only after hesitation

    In the notes: section 7.2, equation (7.14)

    Figure: Utilities of Stentor's behaviors under a disturbance of less than half the strength, and its X: it
    returns to feeding four times before it detaches.

    Expected: With X_1 = 1.0 the order 1-2-3-4-1-4-1-4 was expected, and never B5 within 4 s. The equations begin
    with that order, but go on to B5 at 2.64 s, by Euler's method as well as exactly: an independent integrator with
    located switches gives the order and the time that are expected here.
    """
    found, full = exact(1.0), exact()
    measured = [
        exactly("begins with 1, 2, 3, 4, 1, 4, 1, 4 (1: yes)", found.order.startswith("12341414"), 1),
        exactly("order is 1-2-3-4-1-4-1-4-1-4-1-4-5-1-5-1-5 (1: yes)", found.order == "12341414141451515", 1),
        about("first start of B5", found.first(5), 2.6386, 1e-4, "s"),
        Measured("B5 comes later than at full strength by", found.first(5) - full.first(5), "s", least=0.0),
        Measured("Euler, 1 ms: first start of B5", by_euler(1.0).first(5), "s", 2.59, 2.69),
    ]
    return Outcome(measured, _data(found), lambda figure: _draw(figure, found))


@experiment("dose-response")
def dose_response(seed: int) -> Outcome:
    """Stentor's costliest behavior against the strength of the disturbance

    In the notes: section 7.2

    Figure: Costliest behavior reached within 4 s, and time until feeding stops and until B5 begins, against the
    strength X_1 of the disturbance. Dotted: below it Stentor goes on feeding for these 4 s.

    Expected: While it feeds, (7.12) and (7.14) are linear in X_1: the strength at which feeding stops within 4 s
    has a closed form, and a stronger one stops it sooner. Beyond that nothing forces B5 to come sooner, as a
    stronger disturbance also stops feeding and with it X sooner: nine of ten are asked for.
    """
    doses = np.linspace(0.2, 4.0, 39)
    highest, stopping, detaching = np.zeros(len(doses), dtype=int), np.full(len(doses), np.nan), np.zeros(len(doses))
    for index, strength in enumerate(doses.tolist()):
        found = exact(strength)
        highest[index] = max(which for which, _ in found.starts)
        if len(found.starts) > 1:
            stopping[index] = found.starts[1][1]
        detaching[index] = found.first(5)
    threshold, spacing = undisturbed(SECONDS), float(doses[1] - doses[0])
    answered = doses[highest > 1]
    measured = [
        Measured("weakest disturbance that stops feeding", float(answered[0]), "", threshold, threshold + spacing),
        exactly("stronger, but milder at most (cases)", int((np.diff(highest) < 0).sum()), 0),
        exactly("stronger, but feeding stops later (cases)", _rises(stopping), 0),
        Measured("share of stronger ones with B5 sooner", 1 - _rises(detaching) / (len(answered) - 1), least=0.9),
        about("B5 at X_1 = 2.6", float(np.interp(X_1, doses, detaching)), 2.07, 0.05, "s"),
    ]

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True)
        upper.step(doses, highest, where="mid")
        upper.set(ylabel="costliest behavior", yticks=range(1, 6), yticklabels=[f"B{i}" for i in range(1, 6)])
        lower.plot(doses, detaching, ".-", color="C4", label="B5 begins")
        lower.plot(doses, stopping, ".-", color="C1", label="feeding stops")
        lower.set(xlabel="strength X_1 of the disturbance (1/s)", ylabel="time (s)", ylim=(0, SECONDS))
        lower.legend()
        for axes in (upper, lower):
            axes.axvline(threshold, linestyle=":", color="0.5")

    return Outcome(
        measured, {"dose": doses, "costliest": highest, "time_to_stop_s": stopping, "time_to_b5_s": detaching}, draw
    )


def _rises(times: Floats) -> int:
    known = times[~np.isnan(times)]
    return int((np.diff(known) > 1e-9).sum())
