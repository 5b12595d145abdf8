"""A simulation with boards is saved in mid-run and goes on identically: on both kinds of board, one robot and two."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import boebot
from boebot import Member
from boebot.arenas import Arena, load_arena
from boebot.boards import BoardRequest
from boebot.brains import load_brain
from boebot.description.robots import load_robot
from boebot.link import messages
from boebot.link.link import Link
from boebot.record.result import RunResult
from boebot.robot import Robot
from boebot.running import stepping
from sim_bridge.boards.board import CLOCK_HZ, Damage
from sim_bridge.boards.emulated import avr_board, avr_image, native_board, native_library
from sim_bridge.pins import BoardPins
from sim_bridge.saved import FORMAT, MAGIC, SavedStateError
from sim_bridge.sessions import opening, with_board
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import MS, add_scripted, arena_of
from sim_bridge.vehicle import Vehicle, arsim

KINDS = {
    "native": lambda pin_map: native_board(native_library(pin_map)),
    "avr": lambda pin_map: avr_board(avr_image(pin_map)),
}
SHIELDBOT = load_robot("shieldbot")


def sim_of(kind: str = "native", count: int = 1, *, arena: Arena | None = None, seed: int = 3) -> Sim:
    sim = Sim(load_arena("room") if arena is None else arena, seed=seed)
    for number in range(count):
        sim.add(KINDS[kind](SHIELDBOT.pin_map), SHIELDBOT, pose=(0.8, 0.2 + 0.5 * number, math.pi * number))
    return sim


def poke(sim: Sim, number: int) -> None:
    """All that a host or a test can do to a robot."""
    pins = BoardPins(sim.robot(number))
    pins.press_whisker(5, True)
    pins.square_wave(3, 1000, 0.02)
    pins.drive(2, 1)
    pins.answer_ping(900.0)
    pins.brown_out(upsets_per_s=0.5)
    pins.write_eeprom(1000, b"kept")
    pins.eeprom_damage(Damage.GARBAGE, 0x33)
    pins.place(1.1, 0.3 + 0.5 * number, 0.3)
    sim.robot(number).line_rate(250_000)
    sim.robot(number).send(bytes(range(200)))
    sim.run(7 * MS + 123)
    pins.supply(4.4)
    sim.robot(number).line_rate(500_000)
    pins.reset("power")
    sim.run(3 * MS)
    pins.supply(None)


def all_of(sim: Sim) -> str:
    """Digest of everything that can be asked of a simulation."""
    heap = hashlib.sha256(repr((sim.cycle, sim.hash())).encode())
    for robot in sim.robots:
        pins = BoardPins(robot)
        heap.update(repr((pins.counters(), pins.brown_outs(), robot.true_contacts, robot.pack_voltage)).encode())
        log = pins.pin_log()
        heap.update(pins.read_eeprom() + log["cycle"].tobytes() + log["pin"].tobytes() + log["level"].tobytes())
        for table in (robot.truth(), robot.looks(), robot.tones()):
            for column in table.values():
                heap.update(column.tobytes())
        heap.update(robot.receive())
    for late in sim.lateness():
        heap.update(late.time.tobytes() + late.waited.tobytes())
    return heap.hexdigest()


# ---- identical continuation ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "count"), list(itertools.product(KINDS, (1, 2))))
def test_simulation_goes_on_identically(kind: str, count: int) -> None:
    """After everything that outside can do, saved within a world step with bytes on the line and in the buffer."""
    here, there = sim_of(kind, count), sim_of(kind, count)
    here.run(200 * MS + 77)
    for number in range(count):
        poke(here, number)
    here.robot(0).receive()
    here.run(50 * MS + 4321)
    state = here.save()
    there.restore(state)
    assert there.cycle == here.cycle and there.save() == state
    for sim in (here, there):
        sim.run(30 * MS)
        sim.robot(0).send(b"\x00\x11\x22\x00" * 20)
        sim.run(300 * MS + 1)
    assert all_of(here) == all_of(there)


@pytest.mark.unsanitized
def test_it_goes_on_in_another_process(tmp_path: Path) -> None:
    here = sim_of()
    here.run(100 * MS)
    poke(here, 0)
    (tmp_path / "state").write_bytes(here.save())
    code = (
        "import sys; from sim_bridge.tests.test_saved import sim_of; sim = sim_of();"
        "sim.restore(open(sys.argv[1], 'rb').read()); sim.run(1_600_000); print(sim.hash(), sim.cycle)"
    )
    said = subprocess.run([sys.executable, "-c", code, tmp_path / "state"], capture_output=True, text=True, check=True)
    here.run(1_600_000)
    assert said.stdout.split() == [str(here.hash()), str(here.cycle)]


def test_it_can_be_gone_back_to_again_and_again() -> None:
    """In place: what was tried after the save is forgotten; who holds the robot or its pins keeps them."""
    sim = sim_of()
    robot, pins = sim.robot(0), BoardPins(sim.robot(0))
    sim.run(300 * MS)
    state = sim.save()
    outcomes = []
    for x in (1.1, 0.8, 1.1):
        pins.place(x, 0.5, 0.0)
        sim.run(200 * MS)
        outcomes.append((robot.body().x, pins.counters()["bytes_out"], sim.hash()))
        sim.restore(state)
        assert sim.cycle == 300 * MS and robot.body().x == 0.8
    assert outcomes[0] == outcomes[2] != outcomes[1]
    assert outcomes[0][0] == pytest.approx(1.1, abs=0.01)


# ---- with a brain that drives ----------------------------------------------------------------------------------------


def digest(result: RunResult) -> str:
    """Of every byte with its time, every command and the true path of a run."""
    assert result.error is None and result.truth is not None
    heap = hashlib.sha256(
        repr((result.record.rows("to_board"), result.record.rows("to_host"), result.record.steps)).encode()
    )
    heap.update(result.truth.x.tobytes() + result.truth.heading.tobytes() + result.truth.contact.tobytes())
    return heap.hexdigest()


@pytest.mark.parametrize(("kind", "count"), list(itertools.product(KINDS, (1, 2))))
def test_run_of_a_brain_goes_on_identically(kind: str, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The world is saved, driven astray and restored beneath a brain in mid-run, which does not notice."""
    opened: list[Sim] = []

    def watched(request: BoardRequest, step_s: float) -> Sim:
        opened.append(opening.new_sim(replace(request, saveable=True), step_s))
        return opened[-1]

    monkeypatch.setattr(with_board, "new_sim", watched)
    monkeypatch.setattr(stepping, "_LASTS_S", math.inf)  # on a slow machine the record would get what happens astray
    wander = load_brain("wander")

    def run(at_step: int | None) -> list[str]:
        steps = itertools.count()

        def brain(robot: Robot) -> None:
            if next(steps) == at_step:
                sim = opened[-1]
                state = sim.save()
                BoardPins(sim.robot(0)).place(0.8, 0.5, 1.0)
                sim.run(33 * MS)
                sim.restore(state)
            wander.step(robot)

        if count == 1:
            return [digest(boebot.run(brain, arena="room", on=kind, seconds=3, seed=6))]
        members = [Member(brain=brain), Member(brain="wander")]
        return [digest(one) for one in boebot.run_together(members, "room", 3.0, on=kind, seed=6).robots]

    straight, interrupted = run(None), run(31)
    assert straight == interrupted


def drive(session: with_board.SimSession) -> None:
    """Straight on for half a second, over its own link."""
    link = Link(session.transport)
    link.open()
    link.arm()
    for _ in range(10):
        payload = link.poll(0.05, 0.045)[-1][0]
        link.send_signal(0.5, 0.5, 250, messages.Telemetry.unpack(payload).tick)


def test_link_of_the_host_is_opened_anew_in_a_restored_simulation() -> None:
    """What the host's end knew is not saved: a new link takes the board over and drives it."""
    first = with_board.open_native(BoardRequest(robot=SHIELDBOT, arena="empty"))
    drive(first)
    second = with_board.open_native(BoardRequest(robot=SHIELDBOT, arena="empty"))
    second.sim.restore(first.sim.save())
    x = second.robot.body().x
    assert x > 0.005
    drive(second)
    assert second.robot.body().x > x + 0.02
    for session in (first, second):
        session.close()


# ---- what is refused -------------------------------------------------------------------------------------------------


def saved_one() -> tuple[Sim, bytes]:
    sim = sim_of()
    sim.run(20 * MS)
    sim.robot(0).send(b"hello")
    sim.run(20 * MS)
    return sim, sim.save()


def again(data: bytes, change: Callable[[dict[str, object]], None] = lambda heading: None, tail: bytes = b"") -> bytes:
    """The same bytes with another heading and more inputs, under a right checksum."""
    start = len(MAGIC) + 4
    length = int.from_bytes(data[len(MAGIC) : start], "little")
    heading = json.loads(data[start : start + length])
    change(heading)
    head = json.dumps(heading).encode()
    body = MAGIC + len(head).to_bytes(4, "little") + head + data[start + length : -32] + tail
    return body + hashlib.sha256(body).digest()


def test_damaged_bytes_are_refused_and_change_nothing() -> None:
    sim, data = saved_one()
    before, cycle = sim.hash(), sim.cycle
    for wrong in (b"", b"boebot", data[:-1], data + b"x", data[: len(data) // 2], MAGIC, MAGIC + bytes(40)):
        with pytest.raises(SavedStateError):
            sim.restore(wrong)
    nothing: list[Any] = ["text", 3, None]
    for none in nothing:
        with pytest.raises(SavedStateError, match="is no saved state"):
            sim.restore(none)
    for place in range(0, len(data), 7):
        flipped = bytearray(data)
        flipped[place] ^= 1 << place % 8
        with pytest.raises(SavedStateError):
            sim.restore(bytes(flipped))
    assert (sim.hash(), sim.cycle) == (before, cycle)
    sim.restore(data)


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=80), st.integers(0, 2**64 - 1), st.integers(0, 20))
def test_wrong_inputs_are_refused_whatever_they_are(payload: bytes, cycle: int, kind: int) -> None:
    """Bytes with a right checksum that no save() gave: one sentence, no crash."""
    sim, data = saved_one()
    size = len(payload)
    entry = cycle.to_bytes(8, "little") + bytes(4) + kind.to_bytes(4, "little") + size.to_bytes(4, "little")
    with pytest.raises(SavedStateError):
        sim.restore(again(data, tail=payload or b"\x01"))
    with pytest.raises(SavedStateError):
        sim.restore(again(data, tail=entry + size.to_bytes(4, "little") + payload))


def test_what_was_built_otherwise_is_refused_by_name() -> None:
    _, data = saved_one()
    other = boebot.description.robots.load_robot("shieldbot-basic")
    cases: list[tuple[Sim, str]] = [
        (sim_of(arena=arena_of()), "arena 'room'.*'test'"),
        (sim_of(seed=4), "seed 3.* 4"),
        (sim_of(count=2), r"robots with the numbers \[0\].*\[0, 1\]"),
        (sim_of("avr"), "another firmware image"),
        (Sim(load_arena("room"), seed=3, noise=False), "noise True"),
        (Sim(load_arena("room"), seed=3, step_cycles=32_000), "step_cycles 16000"),
    ]
    for sim, why in cases:
        with pytest.raises(SavedStateError, match=why):
            sim.restore(data)
    elsewhere = Sim(load_arena("room"), seed=3)
    elsewhere.add(KINDS["native"](SHIELDBOT.pin_map), SHIELDBOT, pose=(1.1, 1.0, 0.0))
    with pytest.raises(SavedStateError, match="start"):
        elsewhere.restore(data)
    basic = Sim(load_arena("room"), seed=3)
    basic.add(KINDS["native"](other.pin_map), other, pose=(0.8, 0.2, 0.0))
    with pytest.raises(SavedStateError, match="shieldbot"):
        basic.restore(data)


def test_a_world_and_a_simulation_are_not_taken_for_each_other() -> None:
    sim, data = saved_one()
    vehicle = Vehicle(arsim(), load_arena("arsim"))
    with pytest.raises(SavedStateError, match="saved state of a world; expected that of a simulation"):
        sim.restore(vehicle.save())
    with pytest.raises(SavedStateError, match="saved state of a simulation; expected that of a world"):
        vehicle.restore(data)


def test_other_formats_and_states_are_refused() -> None:
    sim, data = saved_one()
    with pytest.raises(SavedStateError, match=f"format 99; expected format {FORMAT}"):
        sim.restore(again(data, lambda heading: heading.update(format=99)))
    with pytest.raises(SavedStateError, match=r"another state at 0\.040 s"):
        sim.restore(again(data, lambda heading: heading.update(state="0" * 16)))
    with pytest.raises(SavedStateError, match="heading"):
        sim.restore(again(data, lambda heading: heading.update(cycle="late")))
    with pytest.raises(SavedStateError, match="does not fit"):
        sim.restore(again(data, lambda heading: heading.update(cycle=5)))


def test_what_cannot_be_repeated_is_not_saved() -> None:
    scripted = add_scripted(Sim(arena_of()))
    with pytest.raises(SavedStateError, match="runs a script"):
        scripted.sim.save()


def test_progress_is_told(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim_bridge.sim.REPLAY_CYCLES", MS)
    monkeypatch.setattr("sim_bridge.sim.REPORT_S", 0.0)
    sim, data = saved_one()
    heard: list[float] = []
    sim.restore(data, heard.append)
    assert heard == pytest.approx([0.001 * n for n in range(1, 41)])
    sim.restore(data)
    assert not capsys.readouterr().err
    monkeypatch.setattr("sim_bridge.sim.PATIENCE_S", 0.0)
    sim.restore(data)
    assert capsys.readouterr().err.startswith("restoring: 0 of 0 s\n")
    assert sim.cycle == 40 * CLOCK_HZ // 1000
