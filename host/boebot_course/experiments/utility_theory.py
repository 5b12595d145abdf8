"""Utility theory: section 7.1 of the notes, E56 to E58."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

import boebot
from boebot.behaviors import Stop
from boebot.brain import Brain, StateVariable, Utility
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, exactly, experiment
from boebot_course.trials import Steady, decisions

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


GAMES = 100_000


def played(tosses: int, source: np.random.Generator) -> Measured:
    """The mean payoff of games that end without one after so many tosses: each toss adds 2^-k 2^k = 1 to it, (7.2).

    Its standard error is √(Σ 2^-k 4^k / n): four of them are allowed.
    """
    heads = source.random((GAMES, tosses)) < 0.5
    first = np.where(heads.any(axis=1), heads.argmax(axis=1) + 1, 0)
    payoff = np.where(first > 0, 2.0**first, 0.0)
    error = math.sqrt(sum(2.0**k for k in range(1, tosses + 1)) / GAMES)
    return about(f"mean payoff of games of {tosses} tosses at most", float(payoff.mean()), tosses, 4 * error)


@experiment("E56")
def saint_petersburg(seed: int) -> Outcome:
    """St. Petersburg: a game of infinite payoff has a fair price

    In the notes: section 7.1, equations (7.2), (7.3)

    Figure: Fair price of the St. Petersburg game against the player's wealth; the payoff itself is infinite.

    Expected: Prices solved from (7.3) by another program. Each toss that a game may last longer adds 1 to its mean
    payoff: of 100,000 games by chance, give or take four standard errors.
    """
    expected = {100.0: 7.792, 1000.0: 10.954, 1e6: 20.875}
    measured = [
        about(f"fair price at wealth {wealth:g}", fair_price(wealth), r, 1e-3) for wealth, r in expected.items()
    ]
    source = np.random.default_rng([seed, 56])
    measured += [played(tosses, source) for tosses in (6, 10, 14)]
    wealths = np.geomspace(10, 1e6, 60)
    prices = [fair_price(wealth) for wealth in wealths]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.semilogx(wealths, prices)
        axes.plot(list(expected), list(expected.values()), "o", label="expected")
        axes.set(xlabel="wealth W (money)", ylabel="fair price r (money)")
        axes.legend()

    return Outcome(measured, {"wealth": wealths, "fair_price": prices}, draw)


def expected_utility(chances: Sequence[float], utilities: Sequence[float]) -> float:
    """U(c) = Σ p_k u(c_k)  (7.5) of a mixed consequence.

    Raises:
        ValueError: the chances do not add up to 1, or are not as many as the utilities.
    """
    if not math.isclose(sum(chances), 1.0, abs_tol=1e-12):
        raise ValueError(f"chances {chances} add up to {sum(chances):g}; expected 1")
    return sum(p * u for p, u in zip(chances, utilities, strict=True))


# ---- crossing the street ---------------------------------------------------------------------------------------------

MEET, HIT = 5.0, -10.0  # utilities of getting across and of being hit by a car, (7.6)
CROSSINGS = 20_000
BRAIN_STEP, LAG = 0.01, 0.02  # s
SAFER = 0.05  # by which p grows in a second
STEEPNESS = 0.1  # c in tanh(c ...): the utilities to be compared are of the order of 10


def crosses_from(staying: float, seed: int) -> float:
    """The chance p of getting across from which on a robot crosses that loses `staying` by not crossing; p grows
    evenly. NaN: it never crosses.

    (7.5) is linear in p, so that it is a utility function of the kit with the state variable p.
    """
    worst, best = (expected_utility((p, 1 - p), (MEET, HIT)) for p in (0.0, 1.0))
    cross = Steady(left=0.5, right=0.5, utility=Utility(b=worst, w={"p": best - worst}, c=STEEPNESS, tau=LAG))
    stay = Stop(utility=Utility(b=staying, c=STEEPNESS, tau=LAG))
    p = StateVariable("p", lambda robot: SAFER * robot.time)
    brain = Brain([stay, cross], [p], period=BRAIN_STEP)
    record = decisions(boebot.run(brain, robot="arsim", arena="empty", seconds=0.7 / SAFER, seed=seed))
    crosses = np.flatnonzero(record.motor == record.names.behaviors.index(cross.name))
    return float(record.values[crosses[0], 0]) if len(crosses) else math.nan


@experiment("E57", robot="arsim")
def street(seed: int) -> Outcome:
    """The street: expected utilities of two choices

    In the notes: section 7.1, equations (7.6) to (7.9)

    Figure: Expected utility of crossing the street against the chance p to get across. Dots: mean of 20,000
    crossings. Dashed: what not crossing is worth to a daring and to a cautious one; dotted: where such a robot
    began to cross.

    Expected: (7.6) and (7.9) by hand. The mean of n crossings at p = 0.2 is off by 15 √(0.2 · 0.8 / n) = 0.042 (1
    σ): four of them are allowed. A robot for which not crossing is worth -8.5 crosses where 15 p - 10 > -8.5, from
    p = 0.1 on, and one for which it is worth -2.5 from p = 0.5 on; the brain's step of 0.01 s and the utilities'
    lag of 0.02 s make it later by at most two steps and a lag, p by 0.05 in a second.
    """
    source = np.random.default_rng([seed, 57])
    chances = np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95])
    means = [float(np.where(source.random(CROSSINGS) < p, MEET, HIT).mean()) for p in chances]
    at_fifth = expected_utility((0.2, 0.8), (MEET, HIT))
    four_sigma = 4 * (MEET - HIT) * math.sqrt(0.2 * 0.8 / CROSSINGS)
    stays = {-8.5: 0.1, -2.5: 0.5}
    begun = {staying: crosses_from(staying, seed) for staying in stays}
    late = SAFER * (2 * BRAIN_STEP + LAG)
    measured = [
        about("U of 0.2 · 5 + 0.8 · (-10)", at_fifth, -7.0, 1e-12),
        about("mean utility of 20,000 crossings at p = 0.2", means[2], -7.0, four_sigma),
        about("U at p = 0.1", expected_utility((0.1, 0.9), (MEET, HIT)), -8.5, 1e-12),
        about("U at p = 0.5", expected_utility((0.5, 0.5), (MEET, HIT)), -2.5, 1e-12),
        *(
            Measured(f"not crossing is worth {staying:g}: the robot crosses from p", begun[staying], "", p, p + late)
            for staying, p in stays.items()
        ),
    ]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        line = np.linspace(0, 1, 2)
        axes.plot(line, [expected_utility((p, 1 - p), (MEET, HIT)) for p in line.tolist()], label="crossing")
        axes.plot(chances, means, "o", color="C0")
        for color, (staying, name) in zip(("C1", "C2"), ((-8.5, "dares"), (-2.5, "is cautious")), strict=True):
            axes.axhline(staying, linestyle="--", color=color, label=f"not crossing, {name}")
            axes.axvline(begun[staying], linestyle=":", color=color)
        axes.set(xlabel="chance p of getting across", ylabel="utility U")
        axes.legend()

    return Outcome(measured, {"p": chances, "mean_of_crossings": means, "utility": 15 * chances - 10}, draw)


# ---- money -----------------------------------------------------------------------------------------------------------

MOST = 100.0


def money_utility(amount: float, kappa: float) -> float:
    """u(x) = ln(1 + κ x) / ln(1 + 100 κ): 0 at 0, 1 at 100, and the more bent the larger κ."""
    return math.log1p(kappa * amount) / math.log1p(MOST * kappa)


def bend(sure: float) -> float:
    """κ of somebody to whom `sure` is worth an even chance of 100 or nothing, (7.10), by bisection: below 50."""
    return bisected(lambda kappa: money_utility(sure, kappa) < 0.5, 1e-6, 1e6)


def certainty_equivalent(
    utility: Callable[[float], float], chances: Sequence[float], amounts: Sequence[float]
) -> float:
    """The amount for sure that is worth as much as those amounts with those chances, by bisection of u."""
    aim = expected_utility(chances, [utility(amount) for amount in amounts])
    return bisected(lambda amount: utility(amount) < aim, min(amounts), max(amounts))


@experiment("E58")
def money(seed: int) -> Outcome:
    """Utility of money to somebody who avoids risks

    In the notes: section 7.1, equation (7.10), Fig. 7.1

    Figure: Utility of money: 30 for sure is worth an even chance of 100 or nothing. Dashed: to somebody who does
    not mind risks; dotted: to somebody who likes them as much.

    Expected: By hand: u(30) = 1/2 asks for (1 + 30 κ)² = 1 + 100 κ, κ = 40/900; a chance of 1/4 of 100 is then
    worth ((1 + 100 κ)^(1/4) - 1) / κ = 11.87. u'' = -κ² / ((1 + κ x)² ln(1 + 100 κ)) is nearest to 0 at x = 100.
    Somebody who likes risks has u mirrored in both axes: 100 - 30.
    """
    kappa = bend(30.0)
    amounts = np.linspace(0, MOST, 201)
    utilities = np.array([money_utility(amount, kappa) for amount in amounts])
    attitudes: dict[str, Callable[[float], float]] = {
        "avoids risks": lambda x: money_utility(x, kappa),
        "does not mind risks": lambda x: x / MOST,
        "likes risks": lambda x: 1 - money_utility(MOST - x, kappa),
    }
    even = [certainty_equivalent(utility, (0.5, 0.5), (MOST, 0.0)) for utility in attitudes.values()]
    quarter = certainty_equivalent(attitudes["avoids risks"], (0.25, 0.75), (MOST, 0.0))
    bent = np.diff(utilities, 2) / (amounts[1] - amounts[0]) ** 2
    straightest = -((4 / 90) ** 2) / ((1 + 400 / 90) ** 2 * math.log(1 + 400 / 90))
    measured = [
        about("κ from the certainty equivalent of 30", kappa, 40 / 900, 1e-9),
        about("u(50)", money_utility(50, kappa), 0.690, 5e-4),
        *(
            about(f"even chance of 100, to somebody who {attitude}", found, expected, 1e-6)
            for attitude, found, expected in zip(attitudes, even, (30.0, 50.0, 70.0), strict=True)
        ),
        about("chance of 1/4 of 100, to somebody who avoids risks", quarter, 11.87, 0.005),
        about("second derivative where it is nearest to 0", float(bent.max()), straightest, 0.02 * -straightest),
    ]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for (attitude, utility), line in zip(attitudes.items(), ("-", "--", ":"), strict=True):
            axes.plot(amounts, [utility(x) for x in amounts.tolist()], line, color="C0", label=attitude)
        axes.plot([0, 30, 30], [0.5, 0.5, 0], ":", color="C1")
        axes.set(xlabel="money x", ylabel="utility u(x)")
        axes.legend()

    return Outcome(measured, {"amount": amounts, "utility": utilities}, draw)


# ---- asking for it ---------------------------------------------------------------------------------------------------

KAPPA = 40 / 900  # of the one who is asked, as Fig. 7.1
DEPTH = 4
CHOICES = 10_000


def answer(better: float, worse: float) -> float:
    """What the one who is asked takes for an even chance of both: by hand, (1 + κ x)² = (1 + κ better)(1 + κ worse)."""
    return (math.sqrt((1 + KAPPA * better) * (1 + KAPPA * worse)) - 1) / KAPPA


def elicited(answer: Callable[[float, float], float], depth: int) -> tuple[list[float], list[float]]:
    """A utility function through the answers of somebody who is asked for certainty equivalents of even chances.

    Args:
        answer: function of (better, worse): the amount for sure that is as good as an even chance of both.
        depth: how often each interval is halved.
    """
    amounts, utilities = [0.0, MOST], [0.0, 1.0]
    for _ in range(depth):
        for index in range(len(amounts) - 1, 0, -1):
            amounts.insert(index, answer(amounts[index], amounts[index - 1]))
            middle = expected_utility((0.5, 0.5), (utilities[index], utilities[index - 1]))
            utilities.insert(index, middle)
    return amounts, utilities


def choices(amounts: Floats, utilities: Floats, seed: int) -> tuple[Floats, Floats, Floats]:
    """Three amounts by chance with chances by chance, or one for sure? By how much the former is better for the one who
    was asked, by the elicited function, and by expected payoff (in shares of 100)."""
    source = np.random.default_rng([seed, 58])
    lotteries, sure = source.uniform(0, MOST, (CHOICES, 3)), source.uniform(0, MOST, CHOICES)
    chances = source.dirichlet((1.0, 1.0, 1.0), CHOICES)
    own = np.log(1 + KAPPA * np.column_stack((lotteries, sure))) / math.log(1 + MOST * KAPPA)
    asked = np.interp(np.column_stack((lotteries, sure)), amounts, utilities)
    by_function = [
        expected_utility(chance, row[:3]) - row[3] for chance, row in zip(chances.tolist(), asked.tolist(), strict=True)
    ]
    return (
        (chances * own[:, :3]).sum(axis=1) - own[:, 3],
        np.array(by_function),
        ((chances * lotteries).sum(axis=1) - sure) / MOST,
    )


@experiment("elicitation")
def elicitation(seed: int) -> Outcome:
    """A utility function from certainty equivalents

    In the notes: section 7.1, equation (7.10)

    Figure: Utility of money as asked for by halving (dots, joined), and that of the one who gave the answers
    (line).

    Expected: Answers are by u = ln(1 + κ x) / ln(1 + 100 κ) in closed form. Straight pieces of height h = 1/16 lie
    below u by h²/8 · |u''| / u'² at most, h²/8 · ln(1 + 100 κ) = 0.00083 everywhere. The elicited function may
    choose otherwise only where two things are worth the same within twice that: rarer than one in a hundred, as
    differences spread over 1. Who goes by expected payoff errs more often.
    """
    found = elicited(answer, DEPTH)
    amounts, utilities = np.array(found[0]), np.array(found[1])
    grid = np.linspace(0, MOST, 401)
    true = np.log(1 + KAPPA * grid) / math.log(1 + MOST * KAPPA)
    at_amounts = np.log(1 + KAPPA * amounts) / math.log(1 + MOST * KAPPA)
    between = float(np.abs(np.interp(grid, amounts, utilities) - true).max())
    bound = (2.0**-DEPTH) ** 2 / 8 * math.log(1 + MOST * KAPPA)
    own, by_function, by_payoff = choices(amounts, utilities, seed)
    wrong, poor = (np.sign(one) != np.sign(own) for one in (by_function, by_payoff))
    measured = [
        Measured("largest error at the amounts asked", float(np.abs(utilities - at_amounts).max()), most=1e-9),
        Measured("largest error between them", between, "", 0.9 * bound, 1.05 * bound),
        exactly("wrong choices by more than twice that, of 10,000", int((wrong & (np.abs(own) > 2 * bound)).sum()), 0),
        Measured("share of choices that are wrong by the elicited function", float(wrong.mean()), most=0.01),
        Measured("share of choices that are wrong by expected payoff", float(poor.mean()), least=0.01),
    ]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(grid, true, linewidth=3, label="true")
        axes.plot(amounts, utilities, "o-", linewidth=0.8, label="as answered")
        axes.legend()
        axes.set(xlabel="money x", ylabel="utility u(x)")

    return Outcome(measured, {"amount": amounts, "utility": utilities}, draw)
