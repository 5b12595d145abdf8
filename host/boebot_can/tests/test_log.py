"""A run's CAN frames in logs that stock tools open, and logs of stock tools as runs: `boebot report --as can.blf`,
`boebot replay LOG`. python-can and cantools judge."""

from __future__ import annotations

import json
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import can
import cantools.database
import pytest
from test_bridge import bridged

import boebot as library
from boebot.errors import BoebotError
from boebot.link.messages import Telemetry
from boebot.result import RunResult
from boebot.running.board_driver import BoardDriver
from boebot_can.frames import CanFrame
from boebot_can.log import KINDS, Sent, frames_of, read_log, save_log
from boebot_can.socketcand_server import SocketcandBus
from command import boebot, heed_signals

DATABASE: Any = cantools.database.load_file(Path(__file__).resolve().parents[3] / "protocol" / "boebot.dbc")
HELLO = range(0x621, 0x631, 2)
NODE = 0xE0  # bits of an identifier
OPEN, SET_POINT, TELEMETRY, CLOCK_PROBE = 0x620, 0x120, 0x321, 0x224
ISO_TP_TO_BOARD, ISO_TP_TO_HOST = 0x53E, 0x53F


@pytest.fixture(scope="module")
def run() -> RunResult:
    """Two seconds on the native board."""
    return library.run("wander", seconds=2, seed=5)


def stock(path: Path) -> list[can.Message]:
    """A log as python-can reads it."""
    with can.LogReader(path) as log:
        return list(log)


def write(path: Path, frames: Iterable[CanFrame]) -> Path:
    """A log as python-can writes it, a frame each millisecond."""
    with can.Logger(path) as log:
        for number, frame in enumerate(frames):
            log.on_message_received(
                can.Message(number / 1000, arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)
            )
    return path


def frames(sent: Iterable[Sent]) -> list[CanFrame]:
    return [frame for _, frame in sent]


# ---- a run as a log --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def logs(run: RunResult, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[can.Message]]:
    """The same run in each format, as python-can reads it."""
    folder = tmp_path_factory.mktemp("logs")
    return {kind: stock(save_log(run, folder / f"can.{kind}")) for kind in KINDS}


def test_stock_tools_decode_what_the_run_has_recorded(run: RunResult, logs: dict[str, list[can.Message]]) -> None:
    telemetry: dict[int, dict[str, Any]] = {}
    set_points = []
    for message in logs["blf"]:
        if message.arbitration_id in (ISO_TP_TO_BOARD, ISO_TP_TO_HOST):
            continue  # no message of a database
        signals = DATABASE.decode_message(message.arbitration_id, message.data, decode_choices=False)
        if message.arbitration_id == TELEMETRY:
            newest = telemetry[signals["tick"]] = {}
        elif 0x320 <= message.arbitration_id < 0x340:
            newest |= signals
        elif message.arbitration_id == SET_POINT:
            set_points.append((signals["left"], signals["right"]))
    recorded = [Telemetry.unpack(data[: Telemetry.LENGTH]) for _, data in run.record.rows("telemetry")]
    assert len(recorded) == 201 and max(seen.ping_echo for seen in recorded) > 0
    for seen in recorded:
        decoded = telemetry[seen.tick]
        assert (decoded["tick"], decoded["ping_echo"]) == (seen.tick & 0xFF, seen.ping_echo)
        pulses = decoded["pulse_left"], decoded["pulse_right"]
        assert pulses == (seen.pulse_left / 16, seen.pulse_right / 16), "counts of the 16 MHz clock, in µs"
    wanted = [command[2:] for command in run.record.steps]
    assert set_points == [pytest.approx(command, abs=0.00005) for command in wanted] and len(wanted) == 40


def test_formats_hold_the_same_frames(run: RunResult, logs: dict[str, list[can.Message]]) -> None:
    one, *others = ([(m.arbitration_id, bytes(m.data), m.is_rx) for m in logs[kind]] for kind in KINDS)
    assert others == [one, one] and not any(message.is_extended_id for message in logs["asc"])
    assert all(is_rx == identifier % 2 for identifier, _, is_rx in one), "the host receives odd ones"
    for messages in logs.values():
        times = [message.timestamp for message in messages]
        assert times == sorted(times) and times == pytest.approx([time_s for time_s, _ in frames_of(run)], abs=2e-6)


def test_telemetry_has_the_time_of_its_tick(logs: dict[str, list[can.Message]]) -> None:
    """Though the host has read five ticks at once."""
    messages = logs["blf"]
    driven = [place for place, message in enumerate(messages) if message.arbitration_id == 0x120]
    begun = [m for m in messages[driven[0] : driven[-1]] if m.arbitration_id == 0x321]
    ticks = [int.from_bytes(m.data[:4], "little") for m in begun]
    assert len(ticks) > 180 and ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    since = [m.timestamp - begun[0].timestamp for m in begun]
    assert since == pytest.approx([0.01 * (tick - ticks[0]) for tick in ticks], abs=0.001)


def test_identity_goes_by_iso_tp_with_its_flow_control(run: RunResult, logs: dict[str, list[can.Message]]) -> None:
    assert run.identity is not None
    asked, first, go_on, *further = [
        bytes(m.data) for m in logs["log"] if m.arbitration_id in (ISO_TP_TO_BOARD, ISO_TP_TO_HOST)
    ]
    wanted = b"\x81" + run.identity.pack()
    assert asked == b"\x01\x02", "identify, as a single frame of one byte"
    assert first == bytes((0x10, len(wanted))) + wanted[:6]
    assert go_on == b"\x30\x00\x00", "clear to send, all at once, without a pause"
    assert [frame[0] for frame in further] == [0x20 + number for number in range(1, len(further) + 1)]
    assert wanted[6:] == b"".join(frame[1:] for frame in further)


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs and reports leave no pictures and pages: those take their time, and other tests look at them."""
    monkeypatch.setattr("boebot.view._draw", lambda robots, error, path: path.touch())


def together(folder: Path, *robots: str) -> str:
    """The folder of a run of these robots."""
    library.run_together([library.Member(robot=robot) for robot in robots], "empty", seconds=0.1, out=folder)
    return str(folder)


@pytest.mark.usefixtures("no_pictures")
def test_each_robot_with_a_board_has_a_log(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    mixed = together(tmp_path / "mixed", "arsim", "shieldbot", "boebot")
    code, out, err = boebot(capsys, "report", mixed, "--as", "can.asc", "--json")
    assert (code, err) == (0, "")
    logs = [Path(name) for name in json.loads(out)["files"] if "can" in Path(name).name]
    assert (
        logs == [Path(mixed, f"robot-{number}", "can.asc") for number in (2, 3)] == sorted(Path(mixed).rglob("can.*"))
    )
    for number, log in enumerate(logs, 2):
        assert {message.arbitration_id >> 5 & 7 for message in stock(log)} == {number}, "each is a node"


@pytest.mark.usefixtures("no_pictures")
@pytest.mark.parametrize(
    ("robots", "sentence"),
    [
        (["arsim"], "robot 'arsim' has no line in this run, so no CAN frames"),
        (["arsim", "arsim"], "no robot of the run has a board, so there are no CAN frames"),
        (["shieldbot"], "the run's files cannot be written to {}: Is a directory"),
    ],
)
def test_where_no_log_can_be_written_figures_are_printed_all_the_same(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, robots: list[str], sentence: str
) -> None:
    folder = together(tmp_path / "run", *robots)
    Path(folder, "can.blf").mkdir()
    code, out, err = boebot(capsys, "report", folder, "--as", "can.blf")
    assert (code, err) == (1, f"boebot: {sentence.format(folder)}\n") and robots[0] in out


def test_log_is_whole_or_not_there(run: RunResult, tmp_path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for kind in KINDS:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
        try:
            with pytest.raises(BoebotError) as failed:
                save_log(run, tmp_path / f"can.{kind}")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert str(failed.value) == f"the run's files cannot be written to {tmp_path}: File too large"
    assert not list(tmp_path.iterdir())


# ---- a log as a run --------------------------------------------------------------------------------------------------


def by_way(log: Path) -> list[list[tuple[int, bytes]]]:
    """The frames of a log from the host's first `open` on, with identifiers of node 1: those to the board, those to the
    host, and those of long messages, which wait for each other, to the host and to the board, there in any order.
    The board's hellos are without their `round`: it counts those before a host came, too."""
    found = [(message.arbitration_id & ~NODE | 0x20, bytes(message.data)) for message in stock(log)]
    begin = next(place for place, (identifier, _) in enumerate(found) if identifier == OPEN)
    ways: list[list[tuple[int, bytes]]] = [[], [], [], []]
    for identifier, data in found[begin:]:
        long = {ISO_TP_TO_HOST: 2, ISO_TP_TO_BOARD: 3}
        ways[long.get(identifier, identifier % 2)].append((identifier, data[identifier in HELLO :]))
    ways[3].sort()
    return ways


@pytest.mark.wall_clock
@pytest.mark.unsanitized
def test_log_of_a_stock_tool_drives_a_brain(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A run over CAN that python-can's logger follows. It sees the frames that the run's record gives, in
    their order, from the handshake on until the host has left."""
    log = tmp_path / "bus.blf"
    with bridged(node=3) as board:
        assert isinstance(board.bus, SocketcandBus)
        bus = ["-i", "socketcand", "-c", "can0", "--bus-kwargs", "host=localhost", f"port={board.bus.port}"]
        with subprocess.Popen(
            [sys.executable, "-u", "-m", "can.logger", "-f", str(log), *bus],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # its remarks on frames that come in parts
            text=True,
            preexec_fn=heed_signals,
        ) as logger:
            try:
                assert logger.stdout is not None
                assert any(line.startswith("Can Logger (Started") for line in logger.stdout)
                result = library.run("wander", on=board.url, seconds=0.6)
                time.sleep(0.3)  # for the logger
            finally:
                logger.send_signal(signal.SIGINT)
    own = save_log(result, tmp_path / "own.log")
    for path in (log, own):
        code, out, err = boebot(capsys, "replay", str(path), "--brain", "wander")
        assert (code, out, err) == (0, f"all {result.steps} commands are the same\n", "")
    (to_board, to_host, *long), made = by_way(log), by_way(own)
    assert [to_board, to_host[: len(made[1])], *long] == made, "to a host that has left the board speaks for a while"
    assert len(made[0]) > 10 and {message.arbitration_id & NODE for message in stock(own)} == {3 << 5}


def test_first_command_that_differs_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    brain, other = tmp_path / "brain.py", tmp_path / "other.py"
    brain.write_text("def step(robot):\n    robot.drive(robot.ping.age / 3, 0.5)\n")
    other.write_text("def step(robot):\n    robot.drive(robot.ping.age / 3, 0.5 if robot.time < 0.29 else 0.25)\n")
    result = library.run(brain, seconds=0.5)
    log = str(save_log(result, tmp_path / "can.asc"))
    assert boebot(capsys, "replay", log, "--brain", str(brain)) == (0, "all 10 commands are the same\n", "")
    code, _, err = boebot(capsys, "replay", log)
    assert code == 2 and "expected --brain BRAIN" in err and "--again" not in err
    code, out, err = boebot(capsys, "replay", log, "--brain", str(other))
    index, _, left, _ = result.record.steps[6]
    tick, left = Telemetry.unpack(result.record.rows("telemetry")[index][1][: Telemetry.LENGTH]).tick, round(left, 4)
    assert (code, err) == (1, "") and " ".join(out.split()) == (
        f"step 6 (tick {tick}, 0.30 s) differs: Command(kind='signal', left={left}, right=0.5) in the run, "
        f"Command(kind='signal', left={left}, right=0.25) in the replay"
    )


def test_log_says_what_the_board_was_set_to(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The robot's file is not needed where the board's parameters say what is in it."""
    (tmp_path / "narrow.toml").write_text('extends = "shieldbot"\n[body]\ntrack_width_m = 0.09\n')
    brain = tmp_path / "brain.py"
    brain.write_text("def step(robot):\n    robot.drive(robot.dimensions.track_width, 0.0)\n")
    log = str(save_log(library.run(brain, robot=tmp_path / "narrow.toml", seconds=0.2), tmp_path / "can.log"))
    assert boebot(capsys, "replay", log, "--brain", str(brain))[:2] == (0, "all 4 commands are the same\n")


Change = Callable[[list[CanFrame]], list[CanFrame]]


def without(*identifiers: int) -> Change:
    return lambda frames: [frame for frame in frames if frame.identifier not in identifiers]


def with_data(identifier: int, place: int, data: bytes) -> Change:
    """Other bytes from a place on in each frame of that identifier."""
    return lambda frames: [
        frame._replace(data=frame.data[:place] + data + frame.data[place + len(data) :])
        if frame.identifier == identifier
        else frame
        for frame in frames
    ]


def set_points(frames: list[CanFrame]) -> list[int]:
    """The places of set-points."""
    return [place for place, frame in enumerate(frames) if frame.identifier == SET_POINT]


def missing(frames: list[CanFrame], begin: int, end: int) -> list[CanFrame]:
    """Without the frames from one place up to another."""
    return frames[:begin] + frames[end:]


def twice_as_node_1(frames: list[CanFrame]) -> list[CanFrame]:
    """Another robot's bridge has the same node: telemetry of two sessions, in turn."""
    found, parts = [], []
    for frame in frames:
        found.append(frame)
        if frame.identifier in range(0x321, 0x32F, 2):
            parts.append(frame)
            if frame.identifier == 0x32D:
                *first, last = parts
                found += [*first, last._replace(data=last.data[:-1] + bytes((last.data[-1] ^ 1,)))]
                parts = []
    return found


def as_node_2(frames: list[CanFrame]) -> list[CanFrame]:
    return [frame._replace(identifier=frame.identifier + 0x20) for frame in frames]


@pytest.mark.parametrize(
    ("change", "options", "sentence"),
    [
        (without(*HELLO), "", "{} has no hello of a board; expected a log from before the run began"),
        (without(SET_POINT), "", "{} has no set-points for node 1: nobody drove the robot"),
        (lambda frames: frames + as_node_2(frames), "", "{} has boards of several nodes; expected --node 1 or 2"),
        (as_node_2, "--node 5", "{} has no hello of a board of node 5; expected 2"),
        (as_node_2, "--robot 2", "{} is no record of boebot's; expected --node in place of --robot"),
        (
            as_node_2,
            "--kind arsim",
            "robot 'arsim' has no board; expected one like that in {}, 'shieldbot'",
        ),
        (
            with_data(0x62B, 2, b"nobody"),
            "",
            "the board in {} says that it is 'nobodybot', which is no bundled robot; expected --kind",
        ),
        (
            with_data(0x621, 2, b"\x20"),
            "",
            "the board at {} speaks protocol version 2.0, this kit speaks version 3.1; flash the firmware that came "
            "with this kit",
        ),
        (
            with_data(0x625, 2, bytes(2)),
            "",
            "the board at {} says that it makes 0 control ticks in a second; expected more",
        ),
        (
            lambda frames: [frame for frame in frames if (frame.identifier, frame.data[0]) != (0x323, 5)],
            "",
            "{} begins with a gap: it lacks the telemetry of tick 5, which a set-point answers",
        ),
        (
            lambda frames: missing(frames, (at := set_points(frames)[0]), at + 1),
            "",
            "{} begins with a gap: it lacks set-points",
        ),
        (twice_as_node_1, "", "{} has two boards of node 1 on one bus; expected each to have another"),
    ],
)
def test_log_that_is_no_run_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, run: RunResult, change: Change, options: str, sentence: str
) -> None:
    log = write(tmp_path / "can.log", change(frames(frames_of(run))))
    code, out, err = boebot(capsys, "replay", str(log), "--brain", "wander", *options.split())
    assert (code, out, err) == (2, "", f"boebot: {sentence.format(log)}\n")


def test_log_ends_with_the_first_run(capsys: pytest.CaptureFixture[str], tmp_path: Path, run: RunResult) -> None:
    """What somebody drives after the host has left is not of it, nor what follows once the board was reset."""
    first = frames(frames_of(run))
    last = [frame.data for frame in first if frame.identifier == SET_POINT][-1]
    by_hand = bytearray(last)
    by_hand[5] += 3  # the tick that it answers
    again = frames(frames_of(library.run("wander", seconds=0.5, seed=6)))
    log = write(tmp_path / "can.log", [*first, CanFrame(SET_POINT, bytes(by_hand)), *again])
    assert boebot(capsys, "replay", str(log), "--brain", "wander", "--seed", "5")[1] == "all 40 commands are the same\n"


def test_frames_that_are_there_twice_end_no_run(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, run: RunResult
) -> None:
    whole = frames(frames_of(run))
    begin = set_points(whole)[20]
    log = write(tmp_path / "can.log", [*whole[: begin + 40], *whole[begin : begin + 40], *whole[begin + 40 :]])
    code, out, err = boebot(capsys, "replay", str(log), "--brain", "wander", "--seed", "5")
    assert (code, out, err) == (0, "all 40 commands are the same\n", "")


@pytest.mark.parametrize(
    ("lost", "compared", "lacks"),
    [
        (lambda at: (at[20] - 10, at[20] + 40), 20, "set-points"),
        (lambda at: (at[39] - 10, at[39] - 9), 40, ""),
        (lambda at: (at[7], at[7] + 1), 7, "set-points"),
        (lambda at: (at[30] - 2, at[30] - 1), 30, "the telemetry of tick 155, which a set-point answers"),
    ],
    ids=["50 frames", "what no brain sees", "one set-point", "a part of telemetry"],
)
def test_gap_is_no_fault_of_the_brain(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    run: RunResult,
    lost: Callable[[list[int]], tuple[int, int]],
    compared: int,
    lacks: str,
) -> None:
    whole = [frame for frame in frames(frames_of(run)) if frame.identifier != CLOCK_PROBE]
    assert len(whole) < len(frames(frames_of(run)))
    log = write(tmp_path / "can.log", missing(whole, *lost(set_points(whole))))
    code, out, err = boebot(capsys, "replay", str(log), "--brain", "wander", "--seed", "5")
    if not lacks:
        assert (code, out, err) == (0, "all 40 commands are the same\n", "")
        return
    assert (code, out) == (
        1,
        f"all {compared} commands are the same, as far as it goes\n",
    )
    pattern = rf"boebot: {re.escape(str(log))} has a gap after tick \d+ \(\d\.\d\d s\): it lacks {lacks}; \d+ of \d+ "
    assert re.match(pattern, err)


@pytest.mark.parametrize("kind", KINDS)
def test_boards_on_two_buses_are_two_boards(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, run: RunResult, kind: str
) -> None:
    """Both are node 1, and their frames are mixed in the log."""
    other = library.run("wander", seconds=2, seed=6)
    log = tmp_path / f"can.{kind}"
    names = ["can0", "can1"] if kind == "log" else ["1", "2"]
    with can.Logger(log) as writer:
        both = ((*sent, channel) for channel, result in enumerate((run, other)) for sent in frames_of(result))
        for time_s, frame, channel in sorted(both, key=lambda sent: sent[0]):
            message = can.Message(time_s, arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)
            message.channel = names[channel] if kind == "log" else channel
            writer.on_message_received(message)
    for name, seed in zip(names, "56", strict=True):
        replay = "replay", str(log), "--brain", "wander", "--seed", seed
        assert boebot(capsys, *replay, "--node", f"{name}:1") == (0, "all 40 commands are the same\n", "")
    several, none = "boards of several nodes", "no hello of a board of node 1"
    for options, which in (((), several), (("--node", "1"), none)):
        expected = "--node " * (not options) + " or ".join(f"{name}:1" for name in names)
        code, out, err = boebot(capsys, "replay", str(log), "--brain", "wander", *options)
        assert (code, out, err) == (2, "", f"boebot: {log} has {which}; expected {expected}\n")


def late_begin(driver: BoardDriver) -> None:
    """The first look at the line is late by 13.7 ticks."""
    driver.link.open()
    driver._make_ready()
    driver._first_session = driver._session
    driver.link.telemetry.fetch()
    sim = driver.session.sim  # type: ignore[attr-defined]
    sim.run(137 * 16_000)


def test_log_has_the_times_and_slow_readings_that_the_brain_saw(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """To the last bit, on a host that begins late and reads so late that messages of one tick come together."""
    monkeypatch.setattr(BoardDriver, "begin", late_begin)
    monkeypatch.setattr("boebot.running.board_driver._LOOK_EARLY_BYTES", -45)
    brain = tmp_path / "brain.py"
    brain.write_text(
        "def step(robot):\n"
        "    passed = [robot.time >= first + n * 0.05 for first in (0.0, 0.02, 0.03) for n in range(20)]\n"
        "    robot.drive(sum(passed) / 100, robot.line_left.age)\n"
    )
    result = library.run(brain, robot="shieldbot-line", seconds=1)
    steps = [result.record.times_of(result.record.tick_stream)[index] for index, *_ in result.record.steps]
    assert 0.0 < steps[0] < 0.05, "the brain's period has begun before"
    log = save_log(result, tmp_path / "can.log")
    read = read_log(log)
    assert [read.record.times_of(read.record.tick_stream)[index] for index, *_ in read.record.steps] == steps
    assert boebot(capsys, "replay", str(log), "--brain", str(brain))[:2] == (
        0,
        f"all {len(steps)} commands are the same\n",
    )


@pytest.mark.parametrize("kind", ["blf", "log"])
def test_log_that_breaks_off_is_replayed_up_to_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, run: RunResult, kind: str
) -> None:
    log = save_log(run, tmp_path / f"can.{kind}")
    data = log.read_bytes()
    log.write_bytes(data[: data.index(b"\n", len(data) // 2) + 9])
    code, out, err = boebot(capsys, "replay", str(log), "--brain", "wander", "--seed", "5")
    assert code == 0 and re.fullmatch(r"all (1|2)\d commands are the same, as far as it goes\n", out)
    assert re.fullmatch(rf"boebot: {re.escape(str(log))} breaks off after [\d,]+ frames; expected .+\n", err)


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("text.asc", b"Hello, world\n" * 9, "{} has no hello of a board; expected a log from before the run began"),
        ("picture.asc", b"\x89PNG\r\n", "{} is no log of CAN frames; expected a *.asc log"),
        ("text.log", b"Hello, world\n", "{} is no log of CAN frames; expected a *.log log"),
        ("text.blf", b"Hello, world\n" * 99, "{} is no log of CAN frames; expected a *.blf log"),
        ("empty.blf", b"", "{} is no log of CAN frames; expected a *.blf log"),
        ("absent.log", None, "{} cannot be read: no such file or directory"),
    ],
)
def test_file_that_is_no_log_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, data: bytes | None, sentence: str
) -> None:
    file = tmp_path / name
    if data is not None:
        file.write_bytes(data)
    code, out, err = boebot(capsys, "replay", str(file), "--brain", "wander")
    assert (code, out, err.count("\n")) == (2, "", 1) and err.startswith(f"boebot: {sentence.format(file)}")
