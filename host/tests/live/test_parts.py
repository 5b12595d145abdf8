"""The parts of the live view, each by itself: what people want, how fast a run goes, what waits for a slow page."""

from __future__ import annotations

import base64
import json
import threading
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boebot.brains import load_brain
from boebot.errors import BoebotError
from boebot.live import messages
from boebot.live.audience import PAST, Audience, thinned
from boebot.live.controls import SILENT_S, Controls
from boebot.live.live_view import LiveView
from boebot.live.outbox import EVENTS, LETTERS, Outbox
from boebot.live.pace import Pace
from boebot.record.interventions import Arm, Deed, Hand, Parameter, Place, Release, Stop, Tally
from boebot.record.record import Record
from boebot.running.brain_parameters import bounds, set_parameters, sliders
from boebot.running.loop import execute
from boebot.running.tasks import Member, Request

ALL = frozenset({"pause", "step", "speed", "restart", "drag", "hand", "parameters"})


def controls(
    can: frozenset[str] = ALL, *, pages: Sequence[int] = (1, 2), robots: int = 1, speed: float | None = 1.0
) -> Controls:
    """`pages`: that are open."""
    return Controls(robots, 0, can, Pace(speed), lambda: pages)


def test_past_of_a_long_run_is_bounded_and_even() -> None:
    past: deque[Any] = deque()
    for time_s in range(20 * PAST):
        past.append({"of": 1, "time": time_s, "runs": [], "printed": ""})
        past = thinned(past) if len(past) > PAST else past
    times = [chunk["time"] for chunk in past]
    assert PAST / 8 < len(times) <= PAST and times[-1] == 20 * PAST - 1
    assert max(later - time_s for time_s, later in zip([0, *times], times, strict=False)) <= 20 * 8


def test_deeds_are_given_once_and_in_their_order() -> None:
    wanted = controls()
    for asked in (messages.Do(0, Stop()), messages.Do(0, Place(1.0, 2.0, 3.0)), messages.Do(0, Arm())):
        wanted.heard(1, asked)
    assert wanted.due(0, None) == [Stop(), Place(1.0, 2.0, 3.0), Arm()]
    assert wanted.due(0, None) == []


def test_hand_that_falls_silent_stops_the_robot_and_keeps_it() -> None:
    wanted = controls()
    wanted.heard(1, messages.Do(0, Hand(0.5, -0.5)))
    (hand,) = wanted.due(0, None)
    assert hand == Hand(0.5, -0.5)
    assert wanted.due(0, hand) == []  # the same: said once
    time.sleep(SILENT_S + 0.05)
    assert wanted.due(0, hand) == [Hand(0.0, 0.0)]
    wanted.heard(1, messages.Do(0, Release()))
    assert wanted.due(0, Hand(0.0, 0.0)) == [Release()]


def test_page_that_is_closed_drives_nothing() -> None:
    pages = [1, 2]
    wanted = controls(pages=pages)
    wanted.heard(1, messages.Do(0, Hand(0.5, 0.5)))
    pages.remove(1)
    wanted.went()
    assert wanted.due(0, Hand(0.5, 0.5)) == [Hand(0.0, 0.0)]


def test_one_page_drives_at_a_time() -> None:
    pages = [1, 2]
    wanted = controls(pages=pages, robots=2)
    wanted.heard(1, messages.Do(0, Hand(0.5, 0.5)))
    wanted.heard(2, messages.Do(1, Hand(0.1, 0.1)))  # the other robot is free
    with pytest.raises(BoebotError, match="another page drives robot 1"):
        wanted.heard(2, messages.Do(0, Hand(0.1, 0.1)))
    with pytest.raises(BoebotError, match="another page drives robot 1"):
        wanted.heard(2, messages.Do(0, Release()))
    wanted.heard(2, messages.Do(0, Stop()))  # anybody may stop it
    pages.remove(1)
    wanted.went()
    wanted.heard(2, messages.Do(0, Hand(0.1, 0.1)))
    assert wanted.drivers() == [2, 2]


def test_driving_by_hand_is_never_faster_than_real_time() -> None:
    wanted = controls(speed=None)
    wanted.heard(1, messages.Do(0, Hand(0.5, 0.5)))
    assert wanted.pace.speed == 1.0


def test_what_cannot_be_done_here_is_refused() -> None:
    wanted = controls(frozenset({"hand"}))
    for asked in (messages.Pause(), messages.Speed(2.0), messages.Do(0, Place(0.0, 0.0, 0.0)), messages.Restart(1, [])):
        with pytest.raises(BoebotError, match="cannot be done here"):
            wanted.heard(1, asked)
    with pytest.raises(BoebotError, match="there is no robot 2"):
        wanted.heard(1, messages.Do(1, Stop()))


def test_deeds_are_not_queued_without_end() -> None:
    wanted = controls()
    for _ in range(100):
        wanted.heard(1, messages.Do(0, Stop()))
    with pytest.raises(BoebotError, match="wait already"):
        wanted.heard(1, messages.Do(0, Stop()))


def test_run_that_stands_still_goes_on_with_its_last_page() -> None:
    pages = [1, 2]
    wanted = controls(pages=pages)
    wanted.heard(1, messages.Pause())
    for page in (1, 2):
        assert wanted.pace.paused
        pages.remove(page)
        wanted.went()
    assert not wanted.pace.paused


def test_pace_steps_through_instants() -> None:
    pace = Pace(None)
    assert not pace.holds(0.0)
    pace.pause()
    assert pace.holds(0.05)
    pace.step()
    assert not pace.holds(0.05)  # a robot steps,
    assert not pace.holds(0.05)  # and another one at the same instant
    assert pace.holds(0.10)
    pace.resume()
    assert not pace.holds(0.10)


def test_pace_holds_a_run_to_its_speed() -> None:
    pace = Pace(4.0)
    begun = time.perf_counter()
    for step in range(21):
        while pace.holds(step * 0.05):
            pass
    assert time.perf_counter() - begun >= 1.0 / 4.0


def test_pace_that_waits_hears_at_once() -> None:
    pace = Pace(0.01)
    pace.holds(0.0)
    threading.Timer(0.05, pace.set_speed, [None]).start()
    begun = time.perf_counter()
    while pace.holds(10.0):
        pass
    assert time.perf_counter() - begun < 100.0  # not a thousand seconds


def chunk(number: int, **rows: Any) -> dict[str, Any]:
    """One of a robot."""
    empty: dict[str, Any] = {"events": [], "layers": [], "mind": None}
    return {"type": "chunk", "number": number, "runs": [empty | rows], "printed": f"{number}\n"}


def test_slow_page_gets_the_newest_and_what_must_not_be_lost() -> None:
    box = Outbox()
    box.put(chunk(1, events=[[0.1, "touch", "left"]], layers=[{"name": "a", "n": 1}, {"name": "b", "n": 1}]))
    box.put(chunk(2, events=[[0.2, "touch", "right"]], layers=[{"name": "a", "n": 2}]))
    (text,) = box.take()
    assert '"number":2' in text and "left" in text and "right" in text and '"printed":"1\\n2\\n"' in text
    assert '{"name":"a","n":2}' in text and '{"name":"b","n":1}' in text and '{"name":"a","n":1}' not in text
    assert box.take() == []


def test_end_of_a_run_comes_after_its_last_chunk() -> None:
    """Also where both have waited; and the newest state is not told before an older one."""
    box = Outbox()
    for message in (chunk(1), {"type": "state", "state": 1}, chunk(2), {"type": "end"}):
        box.put(message)
    assert [json.loads(text)["type"] for text in box.take()] == ["state", "chunk", "end"]


def test_switches_outlast_a_stretch_without_a_step_of_the_brain() -> None:
    box = Outbox()
    box.put(chunk(1, mind={"switches": [[0.1, "avoid", "near"]]}))
    box.put(chunk(2))
    assert "avoid" in box.take()[0]


def test_outbox_is_bounded() -> None:
    box = Outbox()
    for number in range(5_000):
        box.put(chunk(number, events=[[0.0, "touch", "x"]]))
        box.put({"type": "refused", "sentence": "no"})
    *others, last = box.take()
    assert len(others) <= EVENTS
    assert last.count('"touch"') <= EVENTS and len(last) < LETTERS + EVENTS * 30


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", '{"type":"fly"}', '{"type":"speed","speed":0}',
     '{"type":"do","robot":0,"deed":{"kind":"place","x":1}}',
     '{"type":"do","robot":0,"deed":{"kind":"hand","left":2,"right":0}}',
     '{"type":"do","robot":-1,"deed":{"kind":"hand","left":0,"right":0}}',
     '{"type":"do","robot":0,"deed":{"kind":"place","x":1,"y":2,"heading":1e999}}',
     '{"type":"do","robot":0,"deed":{"kind":"parameter","name":"a","value":1e999}}',
     "[" * 10_000],
)  # fmt: skip
def test_rubbish_is_one_sentence(text: str) -> None:
    with pytest.raises(BoebotError) as error:
        messages.decode(text)
    assert "\n" not in str(error.value)


def test_every_slider_of_the_bundled_brain_stays_within_what_its_process_takes() -> None:
    brain = load_brain("demo")
    shown = sliders(brain)
    assert {"avoid.turn", "avoid.utility.b", "avoid.utility.w.near", "charge.utility.tau_gamma"} <= shown.keys()
    assert shown.keys().isdisjoint({"avoid.period", "avoid.utility.w.low", "wander.utility.w.near"})
    for name, value in shown.items():
        least, most = bounds(brain, name)
        assert least <= value <= most, name
        for one in (least, most, value):
            set_parameters(brain, {name: one})
    assert bounds(brain, "wander.utility.b") == (-1.5, 1.5)


def test_first_chunk_has_all_robots_from_their_beginning(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Also where one begins later: a board by its clock, after a robot without one has stepped already."""
    chunks: list[list[dict[str, Any]]] = []
    monkeypatch.setattr(Audience, "add", lambda _, runs, *rest: chunks.append(runs))
    brain = tmp_path / "once.py"
    brain.write_text("def step(robot):\n    if robot.time == 0:\n        robot.sketch('once', points=[(0, 0)])\n")
    members = [Member(brain=str(brain), robot="roller", pose=(-0.8, 0.0, 0.0)), Member(brain="wander")]
    view = LiveView(lambda url: None, speed=3.0)
    result = execute(Request(members=members, arena="room", seconds=2.0), onlooker=view)
    view.close()
    assert result.error is None
    for rows in chunks[0]:
        assert np.frombuffer(base64.b64decode(rows["time"]), "<f4")[0] == 0.0
    assert [layer["name"] for layer in chunks[0][0]["layers"]] == ["once"]


def test_interventions_are_counted_as_people_count_them() -> None:
    """Driving by hand once until the brain drives again, a slider once while it is dragged."""
    deeds: list[tuple[float, Deed, int]] = [
        (1.0, Place(0.0, 0.0, 0.0), 1),
        (1.0, Hand(0.5, 0.5), 2),
        (1.1, Hand(0.5, 0.2), 2),
        (1.2, Stop(), 3),
        (1.3, Hand(0.0, 0.0), 3),
        (1.4, Release(), 3),
        (1.5, Hand(0.1, 0.1), 4),
        (2.0, Parameter("avoid.turn", 0.1), 5),
        (2.9, Parameter("avoid.turn", 0.2), 5),
        (3.5, Parameter("avoid.turn", 0.3), 5),
        (4.5, Parameter("avoid.turn", 0.4), 6),
        (4.6, Parameter("avoid.clear", 0.4), 7),
        (4.7, Arm(), 8),
        (4.8, Parameter("avoid.clear", 0.3), 9),
    ]
    tally = Tally()
    for time_s, deed, count in deeds:
        tally.add(time_s, deed)
        assert tally.count == count, deed


def test_news_of_a_record_are_told_once_and_all_is_kept_in_its_order() -> None:
    record = Record()
    told: list[bytes] = []

    def look() -> None:
        told.extend(data for _, data in record.news()["command"].rows())

    record.append("command", 0.0, b"a")
    look()
    for data in (b"bb", b"c"):
        record.append("command", 1.0, data)
    assert record.rows("command") == [(0.0, b"a"), (1.0, b"bb"), (1.0, b"c")] and record.count("command") == 3
    record.keep(1.0)
    record.append("command", 2.0, b"d")
    look()
    assert told == [b"a", b"bb", b"c", b"d"] and dict(record.news()) == {}
    record.keep(2.0)
    assert [data for _, data in record.rows("command")] == told and record.count("command") == 4
