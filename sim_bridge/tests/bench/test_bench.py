"""A bench: time, edges, what reacts to them, the line, and boards on robots."""

from __future__ import annotations

from functools import partial

import pytest

from boebot.errors import BoardError, CallError
from boebot.record.record import LINE_FRAME
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.board import CLOCK_HZ, Level
from sim_bridge.tests.bench import programs

BYTE = 320  # cycles at 500,000 baud
TRIGGER, ECHO, SERVO, BUTTON, LED = 7, 6, 9, 2, 13


def test_a_run_ends_at_an_edge_of_the_firmware_or_of_the_outside() -> None:
    with Bench(programs.image(programs.BUTTON)) as bench:
        bench.run_until(20_000)
        assert not bench.run_until(25_000, edge_of=[LED])
        bench.drive(BUTTON, 0, at=30_000)
        assert bench.run_until(10**6, edge_of=[BUTTON]) and 30_000 <= bench.now <= 30_003
        assert bench.run_until(10**6, edge_of=[LED, BUTTON])
        assert bench.edges[LED][-1] == (bench.now, LED, Level.HIGH) and bench.now < 30_020
        assert bench.driven[BUTTON] == [(30_000, BUTTON, Level.LOW)]
        bench.run(16_000)
        assert bench.mark <= bench.now <= bench.mark + 3


def test_a_part_in_python_answers_at_its_cycle_however_the_run_is_cut() -> None:
    """An echo of 5,000 cycles. The loop that waits for the pin's level takes 5 cycles at most, at either edge."""
    heard, edges = [], []
    for step in (777, 100_000, 1_600_000):
        with Bench(programs.image(programs.PING)) as bench:

            def echo(cycle: int, level: Level, bench: Bench = bench) -> None:
                assert bench.now == cycle
                if level == Level.LOW:
                    bench.drive(ECHO, 1, at=cycle + 12_000)
                    bench.drive(ECHO, 0, at=cycle + 17_000)

            bench.drive(ECHO, 0)
            bench.on_edge(TRIGGER, echo)
            while bench.now < 1_600_000:
                bench.run(step)
            data, _ = bench.robot.received()
            heard.append(data)
            edges.append([tuple(edge) for edge in bench.driven[ECHO] if edge.cycle < 1_600_000])
    assert heard[1].startswith(heard[2][:50]) and heard[0].startswith(heard[2][:50])
    assert edges[0] == edges[1] == edges[2] and len(edges[0]) > 40
    widths = [heard[0][i] | heard[0][i + 1] << 8 for i in range(0, len(heard[0]) - 1, 2)]
    assert len(widths) > 20 and all(abs(width - 5_000) <= 5 for width in widths[1:])  # behind the start


def test_a_reaction_lets_no_time_pass_and_what_it_raises_is_raised() -> None:
    with Bench(programs.image(programs.SERVO)) as bench:
        bench.on_edge(SERVO, lambda cycle, level: bench.run(100))
        with pytest.raises(BoardError, match="a reaction to an edge cannot let time pass"):
            bench.run(CLOCK_HZ)


def test_bytes_go_and_come_at_their_cycles() -> None:
    """A frame of ten bits of 32 cycles; the program answers behind the middle of the stop bit."""
    with Bench(programs.image(programs.ECHO)) as bench:
        bench.send(b"ab", at=50_000)
        bench.run(100_000)
        data, cycles = bench.robot.received()
        assert data == b"bc" and bench.robot.received() == (b"", [])
        assert all(50_000 + n * BYTE + 1.9 * BYTE < at < 50_000 + n * BYTE + 2.2 * BYTE for n, at in enumerate(cycles))
        streams = bench.streams()
    frames = streams["line_in"].table(LINE_FRAME)
    assert bytes(frames["byte"]) == b"ab" and streams["line_in"].times[0] * CLOCK_HZ == 50_000
    assert bytes(streams["line_out"].table(LINE_FRAME)["byte"]) == b"bc"
    assert {"pins", "truth"} <= set(streams) and "inputs" not in streams


def test_what_is_done_at_a_time_is_done_in_order() -> None:
    with Bench(programs.image(programs.SERVO)) as bench:
        done = []
        for number, cycle in enumerate((5_000, 1_000, 5_000)):
            bench.at(cycle, partial(lambda number: done.append((number, bench.now)), number))
        bench.run(900)
        assert done == []
        bench.run(100_000)
        assert [number for number, _ in done] == [1, 0, 2]
        assert all(cycle <= now <= cycle + 3 for (_, now), cycle in zip(done, (1_000, 5_000, 5_000), strict=True))


@pytest.mark.parametrize(("volts", "reads"), [(0.0, 0), (2.5, 128), (4.99, 255)])
def test_a_voltage_is_held_at_a_pin(volts: float, reads: int) -> None:
    """ADCH = 256 V / 5 V, cut (24.7)."""
    with Bench(programs.image(programs.VOLTAGE)) as bench:
        bench.pins.analog(0, volts)
        bench.run(100_000)
        assert bench.robot.received()[0][-1] == reads
        bench.pins.release(14)
        bench.run(100_000)
        assert bench.robot.received()[0][-1] == 0
        with pytest.raises(BoardError, match="the voltage is nan"):
            bench.pins.analog(0, float("nan"))


@pytest.mark.parametrize("on", ["native", "avr"])
def test_the_kits_firmware_alone_and_on_a_robot(on: str) -> None:
    for robot in (None, "shieldbot"):
        with Bench(on=on, robot=robot) as bench:
            bench.run(CLOCK_HZ // 5)
            data, cycles = bench.robot.received()
            assert len(data) == len(cycles) > 10 and cycles == sorted(cycles)
            assert bool(bench.robot.parts) == (robot is not None)
            assert ("inputs" in bench.streams()) == (on == "avr" and robot is not None)


def test_a_whisker_is_the_tests_until_it_is_released() -> None:
    with Bench(robot="shieldbot") as bench:
        bench.run(100_000)
        bench.drive(5, 0)
        bench.run(1_000)
        assert bench.pins.levels()[5] == 0
        bench.pins.release(5)
        bench.run(1_000)
        assert bench.pins.levels()[5] == 1
        bench.pins.release(11)  # nothing drives it


def test_bad_calls() -> None:
    with pytest.raises(CallError, match="no board 'arm' for a bench; expected avr or native"):
        Bench(on="arm")
    with pytest.raises(BoardError, match="there is no firmware image"):
        Bench("nothing.elf")
    with Bench() as bench, pytest.raises(BoardError, match="pin"):
        bench.run_until(100, edge_of=[20])
    with pytest.raises(BoardError, match="closed"):
        bench.run(1)


def test_source_of_edges_is_asked_ahead() -> None:
    with Bench(programs.image(programs.SERVO)) as bench:
        asked = []

        class Notes:
            def queue(self, bench: Bench, until: int) -> None:
                asked.append((bench.now, until))

        bench.sources.append(Notes())
        bench.run(20_000)
        assert asked[0] == (0, 8_512) and len(asked) == 3 and asked[-1][1] == 20_512
