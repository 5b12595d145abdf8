"""The live view as a browser meets it: a run in a process of its own, its page over HTTP, its stream by WebSocket."""

from __future__ import annotations

import base64
import contextlib
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from boebot.result import RunResult, read_run
from boebot.view.replay import content
from command import boebot, heed_signals

LIMIT_S = 30.0
SLOWLY = ("--speed", "0.01")  # a run hardly goes on until its page is there, and says how fast
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")  # without them no page opens by itself


class Run:
    """`boebot run ... --view` as a process."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "boebot", *arguments]
        environment = {name: value for name, value in os.environ.items() if name not in DISPLAYS}
        self.process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
            preexec_fn=heed_signals,
        )
        assert self.process.stderr is not None
        line = self.process.stderr.readline()
        found = re.search(r"http://\S+", line)
        assert found, line + self.process.stderr.read()
        self.url = urlsplit(found[0])

    def stream(self, *, token: str | None = None, origin: str | None = None) -> ClientConnection:
        """Its stream."""
        query = self.url.query if token is None else f"token={token}"
        address = f"ws://{self.url.netloc}/stream?{query}"
        stream: ClientConnection = connect(
            address, origin=Origin(f"http://{self.url.netloc}" if origin is None else origin), max_size=None
        )
        return stream

    def end(self) -> tuple[int, str, str]:
        """Exit code, standard output and standard error."""
        out, error = self.process.communicate(timeout=LIMIT_S)
        return self.process.returncode, out, error


class Page:
    """What a browser's page does."""

    def __init__(self, stream: ClientConnection) -> None:
        self.stream = stream
        self.say(type="hello")

    def say(self, **message: Any) -> None:
        """Sends it."""
        self.stream.send(json.dumps(message))

    def do(self, kind: str, **deed: Any) -> None:
        """Does it to the first robot."""
        self.say(type="do", robot=0, deed={"kind": kind, **deed})

    def until(self, kind: str, *, where: Any = lambda message: True) -> Any:
        """The next message of a kind of which that is true."""
        deadline = time.perf_counter() + LIMIT_S
        while time.perf_counter() < deadline:
            message = json.loads(self.stream.recv(timeout=LIMIT_S))
            if message["type"] == kind and where(message):
                return message
        raise AssertionError(f"no {kind}")

    def state(self, where: Any = lambda state: True) -> Any:
        """The next state, with a chunk or by itself, of which that is true."""
        deadline = time.perf_counter() + LIMIT_S
        while time.perf_counter() < deadline:
            message = json.loads(self.stream.recv(timeout=LIMIT_S))
            if "state" in message and where(message["state"]):
                return message["state"]
        raise AssertionError("no such state")


@pytest.fixture(scope="module")
def endless() -> Iterator[Run]:
    """A run that goes on until the tests are done with it."""
    run = Run("run", "wander", "--view", "--seconds", "inf")
    yield run
    run.process.send_signal(signal.SIGTERM)
    code, _, error = run.end()
    assert code == 143, error
    assert "Traceback" not in error


def get(run: Run, path: str, **headers: str) -> tuple[int, str, Any]:
    """Status, body and headers of a page of that run."""
    connection = http.client.HTTPConnection(run.url.hostname or "", run.url.port or 0, timeout=LIMIT_S)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    return response.status, response.read().decode(), response.headers


def times_of(rows: dict[str, Any]) -> list[float]:
    return list(np.frombuffer(base64.b64decode(rows["time"]), "<f4"))


def test_page_is_for_who_has_its_address(endless: Run) -> None:
    status, body, headers = get(endless, f"/?{endless.url.query}")
    assert status == 200 and "<canvas" in body and headers["Cache-Control"] == "no-store"
    assert re.search(r"(src|href)=.?https?:", body) is None  # nothing from the internet
    assert get(endless, "/")[0] == 403
    assert get(endless, "/?token=wrong")[0] == 403
    assert get(endless, f"/other?{endless.url.query}")[0] == 404
    status, body, _ = get(endless, f"/?{endless.url.query}", Host="example.org")  # as a rebound name would say
    assert status == 403 and body.count("\n") == 1
    for rubbish in (
        "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
        f"GET http://[ HTTP/1.1\r\nHost: {endless.url.netloc}\r\n\r\n",
    ):
        with socket.create_connection((endless.url.hostname or "", endless.url.port or 0), timeout=LIMIT_S) as sent:
            sent.sendall(rubbish.encode())
            assert sent.recv(1000).startswith(b"HTTP/1.1 400 ")
    with socket.create_connection((endless.url.hostname or "", endless.url.port or 0)) as sent:
        sent.sendall(b"\x00\xff\r\n\r\n")  # the fixture looks at what the run has said of it: nothing


def test_stream_is_refused_to_other_pages_and_without_token(endless: Run) -> None:
    for wrong in ({"origin": "http://example.org"}, {"token": "wrong"}, {"origin": "null"}):
        with pytest.raises(InvalidStatus), endless.stream(**wrong):
            pass


def let_go(stream: ClientConnection) -> bool:
    """The server closes it."""
    deadline = time.perf_counter() + LIMIT_S
    try:
        while time.perf_counter() < deadline:
            stream.recv(timeout=LIMIT_S)
    except ConnectionClosed:
        return True
    return False


def test_rubbish_and_floods_are_let_go_and_the_run_goes_on(endless: Run) -> None:
    for messages in (["rubbish"], [json.dumps({"type": "hello", "format": 1})], [b"\x00" * 100], ["x" * 100_000]):
        with endless.stream() as stream:
            for message in messages:
                stream.send(message)
            assert let_go(stream)
    with endless.stream() as stream:
        stream.send(json.dumps({"type": "é" * 200}, ensure_ascii=False))  # the sentence has more bytes than letters
        assert let_go(stream)
        assert stream.close_reason is not None and "Invalid value 'ééé" in stream.close_reason
    with endless.stream() as stream:
        page = Page(stream)
        with contextlib.suppress(ConnectionClosed):
            for _ in range(10_000):
                page.say(type="resume")
        assert let_go(stream)
    with endless.stream() as stream:
        page = Page(stream)
        assert page.until("run")["live"]["can"] == ["drag", "hand", "pause", "restart", "speed", "step"]
        first = page.state()
        assert page.state(lambda state: state["time"] > first["time"] + 0.5)


def test_two_pages_one_drives(endless: Run) -> None:
    with endless.stream() as one, endless.stream() as two:
        pages = Page(one), Page(two)
        number = pages[0].until("run")["page"]
        pages[0].do("hand", left=0.4, right=0.4)
        for page in pages:
            assert page.state(lambda state: state["robots"][0]["driver"])["robots"][0]["driver"] == number
        pages[1].do("hand", left=-1, right=-1)
        assert "another page drives" in pages[1].until("refused")["sentence"]
        pages[0].do("release")
        pages[0].state(lambda state: not state["robots"][0]["driver"])


def test_interventions_are_recorded_and_repeated_bit_by_bit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "out"
    robot = ("--robot", "shieldbot-charging", "--arena", "showcase")
    run = Run("run", "demo", *robot, "--view", "--seconds", "3", "--out", str(folder), "--json", *SLOWLY)
    with run.stream() as stream:
        page = Page(stream)
        page.until("run")
        page.say(type="pause")
        page.say(type="speed", speed=1)
        page.state(lambda state: state["paused"])
        page.do("place", x=0.0, y=0.0, heading=1.0)
        state = page.state(lambda state: state["touched"] == 1)
        assert state["robots"][0]["pose"] == [0.0, 0.0, 1.0]
        page.do("place", x=9.0, y=9.0, heading=0.0)
        assert "cannot stand at 9.00 m, 9.00 m" in page.until("refused")["sentence"]
        page.do("shape", index=0, x=1.2, y=0.3, heading=0.5)
        page.state(lambda state: state["touched"] == 2)
        page.do("parameter", name="wander.forward", value=0.3)
        page.say(type="step")
        later = page.state(lambda now: now["time"] > state["time"])
        assert later["paused"] and later["robots"][0]["parameters"]["wander.forward"] == 0.3
        page.do("hand", left=0.5, right=-0.5)
        page.say(type="resume")
        page.state(lambda now: now["robots"][0]["driver"])
        page.say(type="speed", speed=None)
        assert page.until("end")["ended"] == "complete"
    code, out, error = run.end()
    assert code == 0, error
    assert json.loads(out)["touched"] == 4  # robot and shape lifted, a parameter, by hand
    watched = read_run(folder)
    assert isinstance(watched, RunResult)
    shown = [text for _, kind, text in content([watched])["runs"][0]["rows"]["events"] if kind == "intervention"]
    assert shown[:2] == ["put at 0.00, 0.00 m, 57°", "moving shape 1 put at 1.20, 0.30 m"]
    assert shown[2] == "wander.forward = 0.3" and shown[3].startswith("driven by hand")
    for command in (["replay", str(folder), "--again"], ["replay", str(folder), "--brain", "demo"]):
        code, out, error = boebot(capsys, *command)
        assert code == 0, out + error


def test_page_begins_a_run_afresh_also_after_its_end() -> None:
    """What the page switches off is no longer of another magnitude."""
    given = ("--imperfection", "tyre_grip=0.3")
    run = Run("run", "wander", "--view", "--seconds", "1", "--json", *given, *SLOWLY)
    with run.stream() as stream:
        page = Page(stream)
        page.say(type="speed", speed=4)
        assert page.until("end")["again"]
        page.say(type="restart", seed=7, without=["slipp"])
        assert "; did you mean 'slip'?" in page.until("refused")["sentence"]
        page.say(type="restart", seed=7, without=["slip"])
        assert page.until("run")["live"]["seed"] == 7
        page.say(type="speed", speed=4)
        table = page.until("end")["tables"][0]
        assert (table["without"], table["imperfections"]) == ("slip", None)
    code, out, error = run.end()
    assert code == 0, error
    assert json.loads(out)["seed"] == 7


def test_ctrl_c_ends_a_run_that_stands_still() -> None:
    run = Run("run", "wander", "--view", "--seconds", "inf")
    with run.stream() as stream:
        page = Page(stream)
        page.until("run")
        page.say(type="pause")
        page.state(lambda state: state["paused"])
        with run.stream() as later:
            assert Page(later).state()["paused"], "a page that comes later knows it at once"
        run.process.send_signal(signal.SIGINT)
        assert page.until("end")
    assert run.end()[0] == 130


def test_ctrl_c_at_the_end_of_a_run_leaves_what_came_of_it() -> None:
    run = Run("run", "wander", "--view", "--seconds", "60", "--json", *SLOWLY)
    with run.stream() as stream:
        page = Page(stream)
        page.say(type="speed", speed=None)
        page.until("end")
        run.process.send_signal(signal.SIGTERM)
        code, out, error = run.end()
    assert code == 0, error
    assert json.loads(out)["ended"] == "complete"


def test_several_robots_and_what_a_brain_prints_and_shows(tmp_path: Path) -> None:
    brain = tmp_path / "talks.py"
    brain.write_text(
        "def step(robot):\n    print('hello', robot.time)\n    robot.show('x', robot.time)\n"
        "    robot.sketch('line', lines=[[(0, 0), (0.5, robot.time)]])\n    robot.drive(0.3, 0.3)\n"
    )
    short = tmp_path / "short.py"
    short.write_text("def main(robot):\n    robot.wait(0.5)\n")
    run = Run("run", str(brain), str(short), "--view", "--seconds", "2", "--json", *SLOWLY)
    with run.stream() as stream:
        page = Page(stream)
        assert len(page.until("run")["runs"]) == 2
        page.say(type="speed", speed=1)
        chunk = page.until("chunk", where=lambda chunk: chunk["printed"] and chunk["runs"][0]["layers"])
        assert chunk["printed"].startswith("hello")
        assert [one["name"] for one in chunk["runs"][0]["shown"]["numbers"]] == ["x"]
        ended = page.until("chunk", where=lambda chunk: chunk["state"]["time"] > 1.5)["runs"][1]
        assert times_of(ended) == pytest.approx([0.55], abs=0.06), "the newest once more"
        last = page.until("chunk", where=lambda chunk: times_of(chunk["runs"][0])[-1] > 1.99)
        assert last["state"]["time"] == pytest.approx(2.0, abs=0.05), "up to the end"
        page.until("end")
        whole = short.read_text()
        short.write_text("def main(robot:\n")  # a run that cannot begin: another one may be asked for
        page.say(type="restart", seed=1, without=[])
        assert f"{short}, line 1: " in page.until("end")["ended"]
        short.write_text(whole)
        page.say(type="restart", seed=1, without=[])
        page.until("run")
        page.say(type="speed", speed=1)
        page.until("end")
    code, out, error = run.end()
    assert code == 0, error
    assert set(json.loads(out)) >= {"robots"}  # JSON alone on standard output


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--speed", "2"], "expected --view with them"),
        (["--view", "--speed", "0"], "expected 0.01 to 10000, 1 for real time, or max"),
        (["--view", "--speed", "quick"], "'quick' is no speed"),
    ],
)
def test_wrong_options_are_one_sentence(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, error = boebot(capsys, "run", "wander", *arguments)
    assert code != 0 and "Traceback" not in error
    assert sentence in " ".join(error.split())


def test_taken_port_is_one_sentence(endless: Run, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, error = boebot(capsys, "run", "wander", "--view", "--view-port", str(endless.url.port))
    assert code != 0 and "Traceback" not in error
    assert "cannot be served at 127.0.0.1" in error


def test_served_robot_is_shown_and_driven_only_by_who_has_its_port() -> None:
    run = Run("serve", "--on", "native", "--tcp", "0", "--view")
    with run.stream() as stream:
        page = Page(stream)
        assert page.until("run")["live"]["can"] == []
        first = page.state()["time"]
        page.do("hand", left=1, right=1)
        assert "is driven by the program that has its port" in page.until("refused")["sentence"]
        assert page.state(lambda state: state["time"] > first + 0.2)
        run.process.send_signal(signal.SIGINT)
    assert run.end()[0] == 0
