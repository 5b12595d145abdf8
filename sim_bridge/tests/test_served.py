"""The emulated robot offered to other programs: on a pty and on TCP, driven as one would a robot on a port."""

from __future__ import annotations

import csv
import json
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
import serial
from serving import serving

import copied_process
from boebot.result import RunResult, read_run

pytestmark = pytest.mark.wall_clock

BOEBOT = [sys.executable, "-m", "boebot"]


def served(board: str, *where: str) -> AbstractContextManager[tuple[str, subprocess.Popen[str]]]:
    """As `serving`: a robot in a room."""
    return serving("--on", board, *where, "--arena", "room")


@pytest.fixture(scope="module")
def native_pty() -> Iterator[str]:
    """The URL of a robot that several tests drive, one after the other."""
    with served("native", "--pty") as (url, _):
        yield url


def boebot(*arguments: str) -> copied_process.Done:
    return copied_process.command(arguments, Path.cwd())


def test_served_board_answers_no_sooner_than_it_was_asked(native_pty: str) -> None:
    """Else the bounds of its clock would contradict each other."""
    done = boebot("doctor", native_pty, "--watch", "--seconds", "3", "--json")
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    assert last["clock_restarts"] == 0
    assert 0 < last["clock_bound_s"] < 0.01


@pytest.mark.parametrize(
    ("board", "where"),
    [("avr", ("--pty",)), pytest.param("native", ("--tcp", "0"), marks=pytest.mark.soak)],
    ids=["avr-pty", "native-tcp"],
)
def test_brain_drives_a_served_robot(board: str, where: tuple[str, ...], tmp_path: Path) -> None:
    with served(board, *where) as (url, _):
        done = boebot(
            "run", "wander", "--on", url, "--seconds", "2", "--out", str(tmp_path), "--json", "--arena", "room"
        )
        assert done.returncode == 0, done.stderr
        assert "arena room changes nothing: the robot at" in done.stderr
        summary = json.loads(done.stdout)
        assert summary["lost_frames"] == 0 and summary["bad_frames"] == 0
        assert {"record.mcap", "run.png", "replay.html"} <= {path.name for path in tmp_path.iterdir()}
        # a second client finds the robot as the first one left it: ready
        info = boebot("doctor", url, "--identity", "--json")
        assert info.returncode == 0, info.stderr
        assert json.loads(info.stdout)["pin_map"] == "shieldbot"


def test_doctor_finds_a_served_robot_well_and_another_robots_pin_map_wrong(native_pty: str) -> None:
    done = boebot("doctor", native_pty, "--json")
    assert done.returncode == 0, done.stdout
    checks = json.loads(done.stdout)["checks"]
    assert [check["part"] for check in checks][:4] == ["kit", "port", "permission", "held by"]
    assert {check["part"] for check in checks} > {"telemetry", "supply", "whisker_left", "ping"}
    done = boebot("doctor", native_pty, "--robot", "shieldbot-quad", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["checks"][-1] == {
        "part": "pin map",
        "reads": "shieldbot",
        "expected": "shieldbot-quad",
        "hint": "flash its image, or name another --robot",
        "well": False,
    }


def late_run(url: str, folder: Path, *options: str) -> tuple[copied_process.Done, list[dict[str, str]]]:
    """Runs a brain, one of whose steps sleeps for 0.8 s, on a served board; what it said, and its record."""
    path = folder / "late.py"
    path.write_text(
        "import time\nslept = []\ndef step(robot):\n    robot.drive(0.5, 0.5)\n"
        "    if robot.time > 0.499 and not slept:\n        slept.append(robot.time)\n        time.sleep(0.8)\n"
    )
    out = folder / "run"
    done = boebot("run", str(path), "--on", url, "--seconds", "2", "--out", str(out), "--json", *options)
    assert boebot("report", str(out), "--as", "csv").returncode == 0
    with (out / "run.csv").open() as file:
        return done, list(csv.DictReader(file))


def test_dead_man_stops_the_motors_while_the_brain_thinks_and_the_run_goes_on(native_pty: str, tmp_path: Path) -> None:
    """Its last set-point came before 0.5 s and lives for 0.25 s; the step ends at 1.3 s at the earliest."""
    done, rows = late_run(native_pty, tmp_path, "--step-timeout", "60")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["dead_man_stops"] >= 1 and summary["late_steps"] >= 14
    asleep = [row for row in rows if 0.85 < float(row["time_s"]) < 1.25]
    assert len(asleep) > 30 and {float(row["servo_left_pulse_us"]) for row in asleep} == {0.0}
    assert float(rows[-1]["time_s"]) > 1.9 and float(rows[-1]["servo_left_pulse_us"]) > 0


def test_step_that_outlasts_its_set_points_ends_the_run_with_its_place(native_pty: str, tmp_path: Path) -> None:
    done, rows = late_run(native_pty, tmp_path)
    assert done.returncode == 1
    notice, error = done.stderr.splitlines()
    assert notice.startswith("boebot: the brain calls sleep, in which the robot does not move on")
    assert error.startswith(
        f"boebot: {tmp_path / 'late.py'}, line 7: a step of the brain has not ended after 0.25 s; the dead-man stops"
    )
    assert 0.49 < float(rows[-1]["time_s"]) < 0.6, "up to the step that did not end"


def test_host_that_slept_ends_its_run_when_it_wakes(native_pty: str, tmp_path: Path) -> None:
    """As a laptop that is closed and opened: for longer than the board keeps its session."""
    (tmp_path / "brain.py").write_text(
        "def step(robot):\n    robot.drive(0.5, 0.5)\n    if robot.time > 0.2:\n        print('drives', flush=True)\n"
    )
    command = [*BOEBOT, "run", str(tmp_path / "brain.py"), "--on", native_pty, "--seconds", "20"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        assert any(line.startswith("drives") for line in client.stdout)
        client.send_signal(signal.SIGSTOP)
        time.sleep(1.1)
        client.send_signal(signal.SIGCONT)
        _, errors = client.communicate(timeout=20)
    assert client.returncode == 1 and re.fullmatch(
        rf"boebot: this program stood still for 1\.\d s, as when a computer sleeps; expected 0\.75 s at most: "
        rf"the board at {re.escape(native_pty)} had no host, its motors are off\n",
        errors,
    )


@pytest.mark.parametrize(
    "where", [("--pty",), pytest.param(("--tcp", "0"), marks=pytest.mark.soak)], ids=["pty", "tcp"]
)
def test_no_byte_is_lost_beside_a_brain_that_computes(where: tuple[str, ...], tmp_path: Path) -> None:
    """Its steps take 100 ms at a telemetry of 10 ms, and another of its threads never rests: what comes meanwhile waits
    in the operating system's buffer of 4 KB, which telemetry and the other messages fill in half a second."""
    (tmp_path / "brain.py").write_text(
        "import threading, time\n"
        "def think():\n    while True:\n        sum(range(1000))\n"
        "threading.Thread(target=think, daemon=True).start()\n"
        "def step(robot):\n    robot.drive(0.2, 0.2)\n    until = time.perf_counter() + 0.1\n"
        "    while time.perf_counter() < until:\n        pass\n"
    )
    with served("native", *where) as (url, _):
        done = boebot(
            *("run", str(tmp_path / "brain.py"), "--on", url, "--seconds", "3"),
            *("--step-timeout", "60", "--json", "--out", str(tmp_path / "run")),
        )
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["late_steps"] > 20
    assert summary["lost_frames"] == summary["bad_frames"] == 0
    host = read_run(tmp_path / "run").link["host"]  # type: ignore[union-attr]
    assert host["overrun"] == host["dropped"] == host["lost"] == 0 and host["good"] > 300


def test_port_that_vanishes_in_mid_run_is_one_sentence_and_a_complete_record(tmp_path: Path) -> None:
    file, begun = tmp_path / "record.mcap", 25_000  # bytes that a second of the run takes, beside its description
    with served("native", "--pty") as (url, server):
        client = subprocess.Popen(
            [*BOEBOT, "run", "wander", "--on", url, "--seconds", "30", "--out", str(tmp_path)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        while not (file.exists() and file.stat().st_size > begun):  # it drives
            assert client.poll() is None, "the run ended before the port vanished"
            time.sleep(0.1)
        server.kill()
        _, errors = client.communicate(timeout=20)
    assert client.returncode == 1
    assert "has gone" in errors and "Traceback" not in errors
    result = read_run(tmp_path)
    assert isinstance(result, RunResult) and result.record.ticks > 20
    assert (tmp_path / "replay.html").is_file()


@pytest.mark.soak
def test_suite_runs_on_a_board_behind_a_port(native_pty: str) -> None:
    """Some of what needs no pins, here against a served robot; what needs them, or moves, is skipped."""
    done = boebot("test", "--on", native_pty, "-q", "-k", "handshake or setpoint_is or speed_setpoint")
    assert done.returncode == 0, done.stdout
    assert " skipped" in done.stdout and " passed" in done.stdout
    assert "it may move the robot; expected --motors" in done.stdout


def test_port_is_opened_by_one_program_only(native_pty: str) -> None:
    with serial.Serial(native_pty, 500_000, exclusive=True):
        done = boebot("run", "wander", "--on", native_pty, "--seconds", "1")
    assert done.returncode == 1 and "busy" in done.stderr


def test_tcp_is_loopback_only() -> None:
    with served("native", "--tcp", "0") as (url, _):
        port = int(url.rsplit(":", 1)[1])
        for family, _, _, _, address in socket.getaddrinfo(socket.gethostname(), port, type=socket.SOCK_STREAM):
            if not str(address[0]).startswith(("127.", "::1")):
                with socket.socket(family) as probe:
                    probe.settimeout(1)
                    assert probe.connect_ex(address) != 0, f"{address} listens"
        table = Path("/proc/net/tcp")
        if table.exists():
            listening = [line.split()[1] for line in table.read_text().splitlines()[1:] if line.split()[3] == "0A"]
            assert f"0100007F:{port:04X}" in listening
            assert f"00000000:{port:04X}" not in listening


def test_taken_tcp_port_is_one_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        done = boebot("serve", "--on", "native", "--tcp", str(taken.getsockname()[1]))
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1 and "cannot be opened" in done.stderr
