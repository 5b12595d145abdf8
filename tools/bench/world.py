"""Worlds without boards, beside ir-sim and pymunk on the same scene (scene.py), in the builds of builds.py.

The installed core is the portable one, with the same bits everywhere; the native one is BOEBOT_NATIVE=1. The cost of
bit-equality compares the portable one with the same source freed of it: -O3, -march=native, contracted operations, and
the C library's sin, cos, exp, log, tanh and atan2. The builds take turns within each comparison.
"""

from __future__ import annotations

import atexit
import functools
import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any

from tools.bench import peers
from tools.bench.builds import ROOT, Build, core
from tools.bench.figures import Peer, figure
from tools.bench.scene import BEAMS

STEPS = "robot-steps/s"
RAYS = "rays/s"
ROUNDS = 5
PAIRS = 15  # of rates that are compared
BUILDS: tuple[Build, Build] = ("portable", "native")


@functools.cache
def side(build: Build) -> subprocess.Popen[str]:
    """The process that measures that build."""
    extension = core(build)
    command = [sys.executable, "-m", "tools.bench.world_side", *([] if extension is None else [str(extension)])]
    process = subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    atexit.register(process.kill)
    return process


def ask(build: Build, what: str, **question: Any) -> float:
    """A measurement by world_side.py. Raises RuntimeError if it failed."""
    process = side(build)
    assert process.stdin is not None and process.stdout is not None
    process.stdin.write(json.dumps({"what": what, **question}) + "\n")
    process.stdin.flush()
    answer = json.loads(process.stdout.readline() or '{"error": "its process ended"}')
    if "error" in answer:
        raise RuntimeError(f"{build} build, {what}: {answer['error']}")
    return float(answer["value"])


def asked(build: Build, what: str, **question: Any) -> Callable[[], float]:
    return lambda: ask(build, what, **question)


def ratio(
    over: tuple[Build, dict[str, Any]], under: tuple[Build, dict[str, Any]], what: str = "compiled"
) -> Callable[[], float]:
    """One rate over another, measured one after the other."""
    return lambda: ask(over[0], what, **over[1]) / ask(under[0], what, **under[1])


@functools.cache
def of_steps(edges: int) -> list[Peer]:
    """Their steps on the same scene: neither motors, sensor models nor brain; pymunk without noise."""
    return [
        Peer("ir-sim", functools.partial(peers.ir_sim, edges)),
        Peer("pymunk", functools.partial(peers.pymunk, edges)),
    ]


@functools.cache
def of_rays(edges: int) -> list[Peer]:
    return [
        Peer("ir-sim", lambda: BEAMS * peers.ir_sim(edges, laser=True)),
        Peer("pymunk", lambda: BEAMS * peers.pymunk(edges, laser=True)),
    ]


def rows_of_steps() -> None:
    for build, few, many, batch in zip(BUILDS, (1.5e6, 2.5e6), (0.8e6, 1.2e6), (3e6, 5e6), strict=True):
        for edges, target in ((48, few), (1000, many)):
            name = f"world: compiled brain, {edges:,} edges, {build}"
            figure(name, STEPS, at_least=target, peers=of_steps(edges), rounds=ROUNDS)(
                asked(build, "compiled", edges=edges)
            )
        name = f"world: Python brain at each step, 48 edges, {build}"
        figure(name, STEPS, at_least=500e3, peers=of_steps(48), rounds=ROUNDS)(asked(build, "python", edges=48))
        name = f"world: batch of 1,000, compiled brain, {build}"
        figure(name, STEPS, at_least=batch, peers=of_steps(48), rounds=ROUNDS)(
            asked(build, "compiled", edges=48, worlds=1000)
        )
        name = f"world: batch of 1,000, compiled brain, two threads, {build}"
        figure(name, STEPS, peers=of_steps(48), rounds=ROUNDS)(
            asked(build, "compiled", edges=48, worlds=1000, threads=2)
        )
        name = f"world: 4,000 edges against 48, compiled brain, {build}"
        figure(name, "× slower", at_most=2.5, rounds=PAIRS, of="median")(
            ratio((build, {"edges": 48}), (build, {"edges": 4000}))
        )


def rows_of_rays() -> None:
    for build, few, many in zip(BUILDS, (100e6, 200e6), (20e6, 30e6), strict=True):
        for edges, target in ((100, few), (1000, many)):
            for noise in (True, False):
                name = f"laser of 683 beams, {edges:,} edges, {'noise' if noise else 'no noise'}, {build}"
                figure(name, RAYS, at_least=target, peers=of_rays(edges), rounds=ROUNDS)(
                    asked(build, "scan", edges=edges, noise=noise)
                )


def rows_of_equality() -> None:
    compared: list[tuple[str, str, dict[str, Any]]] = [
        ("compiled brain, 48 edges", "compiled", {"edges": 48}),
        ("compiled brain, 1,000 edges", "compiled", {"edges": 1000}),
        ("Python brain, 48 edges", "python", {"edges": 48}),
        ("laser, 100 edges, noise", "scan", {"edges": 100, "noise": True}),
    ]
    for name, what, question in compared:
        figure(f"cost of bit-equality: freed build / portable, {name}", "×", rounds=PAIRS, of="median")(
            ratio(("free", question), ("portable", question), what)
        )


def rows_of_memory() -> None:
    figure("memory of a world with movers, nine rays", "B", at_most=4096)(asked("portable", "memory"))
    figure("memory of a world with a laser's fan of 683", "B")(asked("portable", "memory", laser=True))
    for steps, name in ((0, "grid"), (20_000, "grid and lists for rays")):
        figure(f"memory of an arena with its {name}, 4,000 edges", "B/edge")(
            asked("portable", "memory_of_edges", edges=4000, steps=steps)
        )


rows_of_steps()
rows_of_rays()
rows_of_equality()
rows_of_memory()
