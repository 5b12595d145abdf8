"""Worlds without boards, beside ir-sim and pymunk on the same scene (scene.py)."""

from __future__ import annotations

import functools
from functools import partial

from tools.tests.bench import peers, worlds
from tools.tests.bench.figures import Peer, figure
from tools.tests.bench.scene import BEAMS

STEPS = "robot-steps/s"
RAYS = "rays/s"
ROUNDS = 5
PAIRS = 15  # of rates that are compared


@functools.cache
def of_steps(edges: int) -> list[Peer]:
    """Their steps on the same scene: neither motors, sensor models nor brain; pymunk without noise."""
    return [
        Peer("pymunk", partial(peers.pymunk, edges)),
        Peer("ir-sim", partial(peers.ir_sim, edges)),
    ]


@functools.cache
def of_rays(edges: int) -> list[Peer]:
    return [
        Peer("pymunk", lambda: BEAMS * peers.pymunk(edges, laser=True)),
        Peer("ir-sim", lambda: BEAMS * peers.ir_sim(edges, laser=True)),
    ]


def rows_of_steps() -> None:
    for edges, target in ((48, 15), (1000, 12)):
        name = f"world: compiled brain, {edges:,} edges"
        figure(name, STEPS, times_at_least=target, peers=of_steps(edges), rounds=ROUNDS)(
            partial(worlds.compiled, edges=edges)
        )
    name = "world: Python brain at each step, 48 edges"
    figure(name, STEPS, times_at_least=4, peers=of_steps(48), rounds=ROUNDS)(partial(worlds.python, edges=48))
    name = "world: batch of 1,000, compiled brain"
    figure(name, STEPS, times_at_least=20, peers=of_steps(48), rounds=ROUNDS)(
        partial(worlds.compiled, edges=48, worlds=1000)
    )
    name = "world: batch of 1,000, compiled brain, two threads"
    figure(name, STEPS, peers=of_steps(48), rounds=ROUNDS)(partial(worlds.compiled, edges=48, worlds=1000, threads=2))
    name = "world: 4,000 edges against 48, compiled brain"
    figure(name, "× slower", at_most=2.5, rounds=PAIRS, of="median")(
        lambda: worlds.compiled(edges=48) / worlds.compiled(edges=4000)
    )


def rows_of_rays() -> None:
    for edges in (100, 1000):
        for noise in (True, False):
            name = f"laser of 683 beams, {edges:,} edges, {'noise' if noise else 'no noise'}"
            figure(name, RAYS, times_at_least=100, peers=of_rays(edges), rounds=ROUNDS)(
                partial(worlds.scan, edges=edges, noise=noise)
            )


rows_of_steps()
rows_of_rays()
