"""The files that a run leaves behind."""

from __future__ import annotations

import base64
import csv
import dataclasses
import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure

import boebot
from boebot.errors import BoebotError
from boebot.link import frame, messages
from boebot.result import RunResult, read_run
from boebot.running import board_driver as board
from boebot.running import loop
from boebot.view import picture, replay, scene, tables
from peer import InProcess, Peer


@pytest.fixture(scope="module")
def result() -> RunResult:
    """Half a minute: into the wall, and back a little."""
    peer = Peer()

    def step(robot: boebot.Robot) -> None:
        if robot.time < 8:
            robot.drive(0.8, 0.8)
        elif robot.time < 10:
            robot.drive(-0.2, -0.2)
        else:
            robot.drive(-0.2, 0.2)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop, "open_world", lambda url, requests: InProcess(peer))
        return boebot.run(step, seconds=30)


@pytest.fixture(scope="module")
def folder(result: RunResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "deep" / "run"
    assert {path.name for path in result.save(folder, csv=True)} == {path.name for path in folder.iterdir()}
    return folder


def test_table_counts_what_happened(result: RunResult) -> None:
    table = result.table()
    assert table["true_contacts"] == 1 and table["whisker_touches"] == 2
    assert table["ticks"] == 3001 and table["steps"] == 600
    assert table["ended"] == "complete"
    assert table["image_hash"] is None, "a board without flash has no image"


def test_what_only_a_simulator_knows_is_none_without_one(result: RunResult) -> None:
    """One run with the truth and without it: what the robot knows stays the same, bit for bit."""
    real = dataclasses.replace(result, world=None)
    assert (real.true_pose, real.true_distance, real.true_contacts, real.placed_odometry) == (None,) * 4
    assert real.odometry is not None and result.odometry is not None
    for mine, theirs in zip(dataclasses.astuple(real.odometry), dataclasses.astuple(result.odometry), strict=True):
        assert mine[0] == 0.0 and np.array_equal(mine, theirs)
    assert real.whisker_touches == result.whisker_touches == 2
    assert real.odometry_distance == result.odometry_distance
    figures, known = real.table(), result.table()
    hidden = {name for name, value in figures.items() if value != known[name]}
    assert hidden == {"true_distance_m", "true_contacts", "odometry_error_m", "arena"}
    assert all(figures[name] is None for name in hidden)
    assert "true" not in real.summary() and f"odometry distance {real.odometry_distance:.2f} m" in real.summary()


def test_odometry_lies_in_the_arena_from_the_true_start(result: RunResult) -> None:
    assert result.placed_odometry is not None and result.true_pose is not None
    assert result.placed_odometry.at(0) == pytest.approx(result.true_pose.at(0))
    assert result.odometry_error == pytest.approx(
        math.dist(result.placed_odometry.at(-1)[:2], result.true_pose.at(-1)[:2])
    )


def test_csv_has_a_row_for_each_tick(result: RunResult, folder: Path) -> None:
    with (folder / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == result.record.ticks
    middle = rows[1500]
    assert float(middle["time_s"]) == 15.0
    assert int(middle["tick"]) == result.series.raw["tick"][1500]
    assert float(middle["true_x_m"]) == pytest.approx(result.true_pose.x[1500], abs=1e-4)  # type: ignore[union-attr]
    assert {row["command"] for row in rows} == {"signal"}
    assert sum(int(row["true_contact"]) for row in rows) > 10
    assert all(set(row) == set(rows[0]) and None not in row.values() for row in rows)


def test_raw_bytes_and_their_stamps_agree(result: RunResult, folder: Path) -> None:
    received = (folder / "to_host.bin").read_bytes()
    greeting = frame.Decoder(frame.NO_SESSION)
    hellos = [messages.Hello.unpack(payload) for number, _, payload in greeting.feed(received) if number == 0x80]
    decoder = frame.Decoder(next(hello.session for hello in hellos if hello.session))
    telemetry = [payload for message_id, _, payload in decoder.feed(received) if message_id == 0x90]
    recorded = [data[: len(telemetry[0])] for _, data in result.record.rows("telemetry")]
    assert telemetry[-result.record.ticks - 5 :][: len(recorded)][-1] in recorded
    assert (decoder.bad, decoder.lost) == (0, 0)
    with (folder / "wire.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for name in ("to_board", "to_host"):
        mine = [row for row in rows if row["file"] == name]
        ends = [int(row["first_byte"]) + int(row["bytes"]) for row in mine]
        assert [int(row["first_byte"]) for row in mine] == [0, *ends[:-1]]
        assert ends[-1] == (folder / f"{name}.bin").stat().st_size
    stamps = [float(row["time_s"]) for row in rows]
    assert stamps == sorted(stamps)


def test_summary_is_the_table(result: RunResult, folder: Path) -> None:
    beside: dict[str, object] = {"counters": {}, "watchdog_resets": [], "wall_clock": result.wall_clock()}
    assert json.loads((folder / "summary.json").read_text()) == {"format": 4} | result.table() | beside


def test_picture_shows_something(folder: Path) -> None:
    picture = matplotlib.image.imread(folder / "run.png")
    assert picture.shape[0] > 600 and picture.shape[1] > 600
    red, green, blue = ((picture[::4, ::4, k] * 255).astype(int) for k in range(3))
    assert len(np.unique(red << 16 | green << 8 | blue)) > 100


def test_picture_counts_in_words_that_agree(result: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    texts: list[str] = []
    monkeypatch.setattr(Figure, "text", lambda self, x, y, text, **_: texts.append(text))
    picture.draw([result], None).save(tmp_path / "run.png")
    assert "   ·   1 true contact   ·   2 whisker touches" in texts[1]


class Loads(HTMLParser):
    """Notes everything that a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[tuple[str, str | None]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.fetched += [(tag, value) for name, value in attrs if name in ("src", "href", "data", "srcset", "action")]


def data_of(page: str) -> dict[str, Any]:
    """Of the first robot."""
    data: dict[str, Any] = content_of(page)["runs"][0]
    return data


def content_of(page: str) -> dict[str, Any]:
    """The data of a page."""
    match = re.search(r"const page = (\{.*\});\n", page)
    assert match
    content: dict[str, Any] = json.loads(match[1].replace("<\\/", "</"))
    return content


def test_replay_page_needs_nothing_from_outside(folder: Path) -> None:
    page = (folder / "replay.html").read_text()
    parser = Loads()
    parser.feed(page)
    assert parser.fetched == []
    assert not re.search(r"https?:|@import|url\(|fetch\(|XMLHttpRequest|import\(", page)
    assert "default-src 'none'" in page


def test_replay_page_holds_the_run(result: RunResult, folder: Path) -> None:
    data = data_of((folder / "replay.html").read_text())
    time, x = (np.frombuffer(base64.b64decode(text), "<f4") for text in (data["rows"]["time"], data["rows"]["path"][0]))
    flags = np.frombuffer(base64.b64decode(data["rows"]["state"]), np.uint8)
    assert len(time) == len(x) == len(flags) == result.record.ticks
    assert time[-1] == 30.0
    assert np.allclose(x, result.true_pose.x, atol=1e-6)  # type: ignore[union-attr]
    signs = dict(zip([sign["device"] for sign in data["signs"]], data["rows"]["signs"], strict=True))
    pressed = np.frombuffer(base64.b64decode(signs["whisker_left"]), np.uint8)
    assert np.array_equal(pressed != 0, result.series.flag("whisker_left", "pressed"))
    assert [kind for _, kind, _ in data["rows"]["events"]].count("contact") == 1 and data["known"]


def test_long_run_is_thinned_for_the_page(result: RunResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boebot.record.overview.POINTS", 1000)
    long = dataclasses.replace(result)
    data = replay.run_data(long, scene.view(long))
    count = len(base64.b64decode(data["rows"]["time"])) // 4
    assert 700 < count <= 1001
    assert len(base64.b64decode(data["rows"]["state"])) == count


def test_text_cannot_break_out_of_the_page(result: RunResult, tmp_path: Path) -> None:
    result.brain, brain = "</script><b>", result.brain
    try:
        page = replay.write([result], tmp_path / "page.html").read_text()
    finally:
        result.brain = brain
    assert page.count("</script>") == 1
    assert data_of(page)["table"]["brain"] == "</script><b>"


def test_run_without_truth_is_drawn_by_odometry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = InProcess(Peer())
    session.drain = lambda **_: {}  # type: ignore[method-assign]
    monkeypatch.setattr(loop, "open_world", lambda url, requests: session)
    result = boebot.run("wander", seconds=5, out=tmp_path)
    assert result.odometry_error is None
    content = content_of((tmp_path / "replay.html").read_text())
    data = content["runs"][0]
    assert not data["known"] and not data["has_estimate"] and content["plan"]["items"] == []
    header = tables.columns(result)
    assert "odometry_x_m" in header and "true_x_m" not in header


def test_run_that_never_heard_of_its_board_still_leaves_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = InProcess(Peer())
    monkeypatch.setattr(loop, "open_world", lambda url, requests: session)
    monkeypatch.setattr(board, "configure", lambda link, robot: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        boebot.run("wander", seconds=5, out=tmp_path)
    unheard = read_run(tmp_path)
    assert isinstance(unheard, RunResult) and unheard.record.ticks == 0
    assert json.loads((tmp_path / "summary.json").read_text())["ended"] == "interrupted"


@pytest.mark.parametrize("folder", ["file", "file/below/it"])
def test_folder_that_cannot_be_written_is_one_sentence(folder: str, result: RunResult, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BoebotError, match="file is a file; expected a folder, by another --out"):
        result.save(tmp_path / folder)
