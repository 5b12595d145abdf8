"""Utility theory: section 7.1 of the notes, E56 to E58."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from boebot.experiments.experiment import Measured, Outcome, Progress, about, exactly, experiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TERMS = 100  # of the sum in (7.3): those beyond are below 1e-25


def expected_gain(wealth: float, price: float) -> float:
    """P_s = Σ 2^-k [ln(W - r + 2^k) - ln W]  (7.3): what the game is worth to somebody of that wealth."""
    return sum(2.0**-k * (math.log(wealth - price + 2.0**k) - math.log(wealth)) for k in range(1, TERMS))


def bisected(is_below: Callable[[float], bool], low: float, high: float) -> float:
    """Where `is_below` changes from true to false, between `low` and `high`."""
    for _ in range(60):
        middle = (low + high) / 2
        if is_below(middle):
            low = middle
        else:
            high = middle
    return (low + high) / 2


def fair_price(wealth: float) -> float:
    """The price r at which P_s is 0, by bisection: P_s falls with r."""
    return bisected(lambda price: expected_gain(wealth, price) > 0, 0.0, wealth)


@experiment(
    "E56",
    title="St. Petersburg: a game of infinite payoff has a fair price",
    source="section 7.1, equations (7.2), (7.3)",
    caption="Fair price of the St. Petersburg game against the player's wealth; the payoff itself is infinite.",
)
def saint_petersburg(seed: int, progress: Progress) -> Outcome:
    expected = {100.0: 7.792, 1000.0: 10.954, 1e6: 20.875}
    measured = [
        about(f"fair price at wealth {wealth:g}", fair_price(wealth), r, 1e-3) for wealth, r in expected.items()
    ]
    partial = np.cumsum([2.0**-k * 2.0**k for k in range(1, 51)])  # (7.2): each term adds 1
    measured.append(about("payoff that each term of (7.2) adds", float(np.diff(partial).min()), 1.0, 1e-12))
    wealths = np.geomspace(10, 1e6, 60)
    prices = [fair_price(wealth) for wealth in wealths]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.semilogx(wealths, prices)
        axes.plot(list(expected), list(expected.values()), "o", label="expected")
        axes.set(xlabel="wealth W (money)", ylabel="fair price r (money)")
        axes.legend()

    return Outcome(measured, {"wealth": wealths, "fair_price": prices}, draw)


@experiment(
    "E57",
    title="The street: expected utilities of two choices",
    source="section 7.1, equations (7.6), (7.8), (7.9)",
    caption="Utility of a lottery between 5 and -10 against the probability of the better outcome.",
)
def street(seed: int, progress: Progress) -> Outcome:
    def lottery(p: float, better: float, worse: float) -> float:
        """U(c) = p u(c_1) + (1 - p) u(c_2)  (7.5), (7.8)"""
        return p * better + (1 - p) * worse

    measured = [
        about("U of 0.2 · 5 + 0.8 · (-10)", lottery(0.2, 5, -10), -7.0, 1e-12),
        about("U at p = 0.1", lottery(0.1, 5, -10), -8.5, 1e-12),
        about("U at p = 0.5", lottery(0.5, 5, -10), -2.5, 1e-12),
    ]
    chances = np.linspace(0, 1, 101)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(chances, [lottery(p, 5, -10) for p in chances])
        for p in (0.1, 0.2, 0.5):
            axes.plot(p, lottery(p, 5, -10), "o", color="C1")
        axes.set(xlabel="p of the better outcome", ylabel="utility U")

    return Outcome(measured, {"p": chances, "utility": lottery(chances, 5, -10)}, draw)  # type: ignore[arg-type]


KAPPA = 40 / 900  # from (1 + 30 κ)² = 1 + 100 κ: u(30) = 1/2


def money_utility(amount: float) -> float:
    """u(x) = ln(1 + κ x) / ln(1 + 100 κ): through (0, 0), (30, 1/2) and (100, 1), as Fig. 7.1."""
    return math.log1p(KAPPA * amount) / math.log1p(100 * KAPPA)


@experiment(
    "E58",
    title="Utility of money to somebody who avoids risks",
    source="section 7.1, equation (7.10), Fig. 7.1",
    caption="Utility of money: 30 for sure is worth an even chance of 100 or nothing. Dashed: without aversion.",
)
def money(seed: int, progress: Progress) -> Outcome:
    amounts = np.linspace(0, 100, 201)
    utilities = np.array([money_utility(amount) for amount in amounts])
    measured = [
        about("u(30)", money_utility(30), 0.5, 1e-12),
        about("u(50)", money_utility(50), 0.690, 5e-4),
        Measured("largest second difference of u", float(np.diff(utilities, 2).max()), most=0.0),
    ]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(amounts, utilities)
        axes.plot([0, 100], [0, 1], "--", color="0.6")
        axes.plot([0, 30, 30], [0.5, 0.5, 0], ":", color="C1")
        axes.set(xlabel="money x", ylabel="utility u(x)")

    return Outcome(measured, {"amount": amounts, "utility": utilities}, draw)


def certainty_equivalent(p: float, better: float, worse: float) -> float:
    """The amount for sure that is worth as much as the lottery, by bisection of u."""
    aim = p * money_utility(better) + (1 - p) * money_utility(worse)
    return bisected(lambda amount: money_utility(amount) < aim, worse, better)


def elicited(answer: Callable[[float, float], float], depth: int) -> tuple[list[float], list[float]]:
    """A utility function through the answers of somebody who is asked for certainty equivalents of even chances.

    Args:
        answer: function of (better, worse): the amount for sure that is as good as an even chance of both.
        depth: how often each interval is halved.
    """
    amounts, utilities = [0.0, 100.0], [0.0, 1.0]
    for _ in range(depth):
        for index in range(len(amounts) - 1, 0, -1):
            amounts.insert(index, answer(amounts[index], amounts[index - 1]))
            utilities.insert(index, (utilities[index] + utilities[index - 1]) / 2)
    return amounts, utilities


@experiment(
    "elicitation",
    title="A utility function from certainty equivalents",
    source="section 7.1, equation (7.10)",
    caption="Utility of money as asked for by halving (dots, joined), and the one that gave the answers (line).",
)
def elicitation(seed: int, progress: Progress) -> Outcome:
    depth = 4
    amounts, utilities = elicited(lambda better, worse: certainty_equivalent(0.5, better, worse), depth)
    true = [money_utility(amount) for amount in amounts]
    grid = np.linspace(0, 100, 401)
    between = np.abs(np.interp(grid, amounts, utilities) - [money_utility(x) for x in grid]).max()
    # linear pieces of a concave function with pieces of height h = 1/16: below it by at most h²/8 · max |u''|/u'²,
    # which is ln(1 + 100 κ) everywhere for u = ln(1 + κ x) / ln(1 + 100 κ)
    bound = (2.0**-depth) ** 2 / 8 * math.log1p(100 * KAPPA)
    measured = [
        exactly("questions asked", len(amounts) - 2, 2**depth - 1),
        about("first certainty equivalent (of 100 or nothing)", amounts[2 ** (depth - 1)], 30.0, 1e-9),
        Measured("largest error at the amounts asked", float(np.abs(np.array(utilities) - true).max()), most=1e-9),
        Measured("largest error between them", float(between), most=1.05 * bound),
    ]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(grid, [money_utility(x) for x in grid])
        axes.plot(amounts, utilities, "o-", linewidth=0.8)
        axes.set(xlabel="money x", ylabel="utility u(x)")

    return Outcome(measured, {"amount": amounts, "utility": utilities}, draw)
