"""Sweeps by the command and from Python: every row once, the same rows whatever happened on the way."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import boebot
import command
from boebot.cli import output
from boebot.cli.ending import Detail
from boebot.errors import BoebotError
from boebot_campaign import kept, local, plan, tasks
from boebot_campaign.command import NEWEST_ROWS, newest_rows
from boebot_campaign.report import report
from boebot_campaign.rows import APART, columns, run_case, table_of

FORKED = multiprocessing.get_context("forkserver")
FORKED.set_forkserver_preload(local.IMPORTED)
COMMAND = [sys.executable, "-m", "boebot", "sweep"]
PLAN = """\
brains = ["odd.py", "clearway"]
robots = ["shieldbot"]
arenas = ["room"]
seconds = 1
seeds = { from = 1, to = 10 }
starts = 2
"""
ODD = """\
brains = ["odd.py"]
seconds = 1
seeds = [1, 2]
limit_s = 1.5
[parameters]
"odd.how" = ["well", "raises", "loops", "kills"]
"""


def saved(folder: Path, text: str) -> Path:
    shutil.copy(Path(__file__).with_name("odd.py"), folder)
    (folder / "sweep.toml").write_text(text)
    return folder / "sweep.toml"


def rows_of(folder: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = kept.Folder(folder).table().to_pylist()
    return [{name: value for name, value in row.items() if name not in APART} for row in rows]


def at_a_worker(out: Path, first: int, end: int) -> int | None:
    """The exit code of a process that does that part, as Dask's workers do."""
    worker = FORKED.Process(target=tasks.do_part, args=(str(out), kept.Folder(out).stamp, first, end))
    worker.start()
    worker.join()
    return worker.exitcode


def by_hand(out: Path, file: Path, *parts: tuple[int, int]) -> list[dict[str, Any]]:
    """The rows after those parts, or else all that are not there yet, were done in that order without a cluster."""
    with kept.locked(out, plan.read(file, plan.Plan)) as folder:
        for part in parts or folder.undone():
            assert at_a_worker(out, *part) == 0
        folder.merge()
    return rows_of(out)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a plan, and its sweep in `out`, with two workers."""
    folder = tmp_path_factory.mktemp("sweep")
    boebot.sweep(saved(folder, PLAN), out=folder / "out", workers=2)
    return folder


def test_rows_do_not_depend_on_workers_parts_and_their_order(undisturbed: Path) -> None:
    rows = rows_of(undisturbed / "out")
    assert [row["row"] for row in rows] == list(range(40)) and len({row["hash"] for row in rows}) > 30
    assert by_hand(undisturbed / "again", undisturbed / "sweep.toml", (30, 40), (0, 7), (5, 30)) == rows


def test_a_killed_and_resumed_sweep_has_the_same_rows(undisturbed: Path, tmp_path: Path) -> None:
    file, out = saved(tmp_path, PLAN), tmp_path / "out"
    begun = subprocess.Popen([*COMMAND, str(file), "--out", str(out), "--workers", "1"], stderr=subprocess.DEVNULL)
    until = time.perf_counter() + 60
    while not list(out.glob("parts/*.parquet")) and time.perf_counter() < until:
        time.sleep(0.02)
    assert len(workers_of(out)) >= 2
    begun.kill()
    begun.wait()
    assert len(kept.Folder(out).done()) > 0 and kept.Folder(out).undone()
    until = time.perf_counter() + 10
    while workers_of(out) and time.perf_counter() < until:
        time.sleep(0.05)
    assert not workers_of(out)
    assert by_hand(out, file) == rows_of(undisturbed / "out")


def workers_of(out: Path) -> list[str]:
    """Processes of this computer that work for that sweep: their standard error is its log."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if (entry / "fd" / "2").readlink() == out.resolve() / ".workers.log":
                found.append(entry.name)
    return found


@pytest.mark.soak
def test_ctrl_c_is_a_sentence_and_leaves_no_process(tmp_path: Path) -> None:
    file, out = saved(tmp_path, PLAN), tmp_path / "out"
    begun = subprocess.Popen(
        [*COMMAND, str(file), "--out", str(out), "--workers", "1"], stderr=subprocess.PIPE, text=True
    )
    until = time.perf_counter() + 60
    while not list(out.glob("parts/*.parquet")) and time.perf_counter() < until:
        time.sleep(0.02)
    begun.send_signal(signal.SIGINT)
    _, said = begun.communicate(timeout=20)
    assert begun.returncode == 130 and "the same command goes on" in said and "Traceback" not in said
    assert not workers_of(out) and kept.Folder(out).done()


@pytest.mark.soak
def test_runs_that_raise_hang_or_kill_are_rows(tmp_path: Path) -> None:
    done = subprocess.run(
        [*COMMAND, str(saved(tmp_path, ODD)), "--workers", "2", "--json"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["statuses"] == {"ok": 2, "raised": 2, "timed out": 2, "killed": 2}
    rows = kept.Folder(tmp_path / "sweep").table().to_pylist()
    assert [row["status"] for row in rows] == ["ok"] * 2 + ["raised"] * 2 + ["timed out"] * 2 + ["killed"] * 2
    raised, *others = rows[2], rows[4], rows[6]
    assert (
        0.5 <= raised["run_time_s"] < 0.7 and "odd.py, line" in raised["error"] and str(tmp_path) not in raised["error"]
    )
    assert all(row["run_time_s"] is None and row["hash"] is None for row in others)


@pytest.mark.soak
def test_a_sleep_that_no_signal_ends_takes_its_worker_with_it(tmp_path: Path) -> None:
    done = boebot.sweep(saved(tmp_path, ODD.replace('"loops", "kills"', '"sleeps"')), out=tmp_path / "out", workers=1)
    rows = done.table().to_pylist()
    assert {row["status"] for row in rows[4:]} <= {"timed out", "killed"} and [row["status"] for row in rows[:2]] == [
        "ok"
    ] * 2


FULL = """\
import resource
from boebot import cli
from boebot_campaign import engine
run = engine.Workers.run
def full(*given):
    resource.setrlimit(resource.RLIMIT_FSIZE, (6000, resource.RLIM_INFINITY))
    run(*given)
engine.Workers.run = full
cli.main()
"""


@pytest.mark.soak
def test_a_full_disk_ends_the_sweep_in_a_sentence_and_loses_no_row(undisturbed: Path, tmp_path: Path) -> None:
    file, out = saved(tmp_path, PLAN), tmp_path / "out"
    words = [sys.executable, "-c", FULL, "sweep", str(file), "--out", str(out), "--workers", "1"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert (
        done.returncode == 1 and "the sweep's files cannot be written" in done.stderr and "Traceback" not in done.stderr
    )
    assert not list(out.glob("parts/.*")) and kept.Folder(out).undone() == [(0, 40)]
    assert by_hand(out, file) == rows_of(undisturbed / "out")


def test_a_full_disk_leaves_no_half_part(undisturbed: Path, tmp_path: Path) -> None:
    file, out, said = saved(tmp_path, PLAN), tmp_path / "out", tmp_path / "said"
    with kept.locked(out, plan.read(file, plan.Plan)) as folder:
        code = f"""
import resource, sys
from boebot_campaign import tasks
sys.stderr = open({str(said)!r}, "w")
resource.setrlimit(resource.RLIMIT_FSIZE, (6000, resource.RLIM_INFINITY))
tasks.do_part({str(out)!r}, {folder.stamp!r}, 0, 40)
"""
        worker = FORKED.Process(target=exec, args=(code,))
        worker.start()
        worker.join()
        assert worker.exitcode == 1 and "BoebotError: the sweep's files cannot be written to" in said.read_text()
        assert not list(folder.parts.iterdir())
    assert by_hand(out, file) == rows_of(undisturbed / "out")


@pytest.mark.parametrize("each", [1, pytest.param(2, marks=pytest.mark.soak)])
def test_the_row_that_kills_two_workers_says_so_and_the_others_are_run(each: int, tmp_path: Path) -> None:
    text = ODD.replace('"raises", "loops", "kills"', '"kills", "raises"')
    file, out = saved(tmp_path, text if each == 2 else text.replace("[1, 2]", "[1]")), tmp_path / "out"
    with kept.locked(out, plan.read(file, plan.Plan)) as folder:
        for _ in range(2 * each):
            assert at_a_worker(out, 0, 3 * each) == -signal.SIGKILL
        assert at_a_worker(out, 0, 3 * each) == 0
        assert not list(folder.parts.glob("*.begun"))
        folder.merge()
    rows = kept.Folder(out).table().to_pylist()
    assert [row["status"] for row in rows] == ["ok"] * each + ["killed"] * each + ["raised"] * each
    raised, lost = rows[2 * each], rows[each]
    assert (
        0.5 <= raised["run_time_s"] < 0.7 and "odd.py, line" in raised["error"] and str(tmp_path) not in raised["error"]
    )
    assert lost["run_time_s"] is None and lost["hash"] is None


def test_a_brain_that_interrupts_or_exits_is_a_row(tmp_path: Path) -> None:
    text = ODD.replace('"well", "raises", "loops", "kills"', '"interrupts", "exits"').replace("[1, 2]", "[1]")
    with kept.locked(tmp_path / "out", plan.read(saved(tmp_path, text), plan.Plan)) as folder:
        rows = [run_case(folder, folder.plan.case(row, folder.points)) for row in range(2)]
    for row, error in zip(rows, ("KeyboardInterrupt", "SystemExit"), strict=True):
        assert row["status"] == "raised" and 0.5 <= row["run_time_s"] < 0.7
        assert re.fullmatch(rf"files/brain-0/odd\.py, line \d+: process 'odd': {error}", row["error"])


def test_a_run_beyond_the_limit_is_a_row_without_figures(tmp_path: Path) -> None:
    text = ODD.replace('["well", "raises", "loops", "kills"]', '["loops"]').replace("1.5", "0.3")
    with kept.locked(tmp_path / "out", plan.read(saved(tmp_path, text), plan.Plan)) as folder:
        assert at_a_worker(folder.path, 0, 1) == 0
        row = folder.table().to_pylist()[0]
    assert row["status"] == "timed out" and row["error"] == "the run has lasted longer than 0.3 s"
    assert row["hash"] is None and row["run_time_s"] is None


def test_after_a_change_it_is_refused_and_the_file_named(undisturbed: Path, tmp_path: Path) -> None:
    shutil.copytree(undisturbed, tmp_path / "copy")
    file, out = tmp_path / "copy" / "sweep.toml", tmp_path / "copy" / "out"
    (out / "rows.parquet").unlink()
    file.write_text(PLAN.replace("to = 10", "to = 11"))
    with pytest.raises(BoebotError, match=r"the plan has changed .* in seeds"):
        boebot.sweep(file, out=out)
    copy = next(out.glob("files/brain-0/odd.py"))
    copy.write_text(copy.read_text() + "\n")
    with pytest.raises(BoebotError, match=re.escape(str(copy))):
        boebot.sweep(undisturbed / "sweep.toml", out=out)


@pytest.mark.parametrize("size", [0, 100])
@pytest.mark.parametrize("name", ["rows.parquet", "sweep.json", "points.npy", "0000010-0000039.parquet"])
def test_a_damaged_file_of_a_sweep_is_named(undisturbed: Path, name: str, size: int, tmp_path: Path) -> None:
    file, out = saved(tmp_path, PLAN), shutil.copytree(undisturbed / "out", tmp_path / "out")
    if name.startswith("0"):
        in_parts(out, 10)
    (damaged,) = out.rglob(name)
    damaged.write_bytes(damaged.read_bytes()[:size])
    with pytest.raises(BoebotError, match=rf"{name} (cannot be read|has changed).*; .*(another --out|remove it)"):
        by_hand(out, file)


def test_a_part_that_lacks_a_row_is_named(undisturbed: Path, tmp_path: Path) -> None:
    file, out = saved(tmp_path, PLAN), shutil.copytree(undisturbed / "out", tmp_path / "out")
    first = in_parts(out, 10)
    first.rename(first.with_name("0000000-0000010.parquet"))
    with pytest.raises(BoebotError, match=r"0010\.parquet cannot be read \(it has 10 rows in place of 11\); remove it"):
        by_hand(out, file)


def in_parts(out: Path, first: int) -> Path:
    """Takes a whole sweep back to two parts, the first one, which is returned, of that many rows."""
    folder = kept.Folder(out)
    rows, parts = folder.table(), [folder.part(0, first), folder.part(first, folder.plan.count)]
    folder.parts.mkdir()
    kept.write_part(parts[0], rows.slice(0, first))
    kept.write_part(parts[1], rows.slice(first))
    (out / "rows.parquet").unlink()
    return parts[0]


def test_a_damaged_byte_of_the_rows_changes_none(undisturbed: Path, tmp_path: Path) -> None:
    shutil.copytree(undisturbed / "out", tmp_path / "out")
    rows, whole, refused = tmp_path / "out" / "rows.parquet", kept.Folder(undisturbed / "out").table(), 0
    data = rows.read_bytes()
    end = len(data) - 8 - int.from_bytes(data[-8:-4], "little")  # names of columns and the like follow
    for at in range(4, end, end // 50):
        rows.write_bytes(data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :])
        try:
            assert kept.Folder(rows.parent).table().equals(whole)
        except BoebotError:
            refused += 1
    assert refused > 20


def test_a_kept_row_is_run_again(undisturbed: Path) -> None:
    row = rows_of(undisturbed / "out")[27]
    words = [sys.executable, "-m", "boebot", "run", "--sweep", str(undisturbed / "out"), "--row", "27", "--json"]
    (undisturbed / "odd.py").write_text("raise OSError('the kept one is meant')\n")
    done = subprocess.run(words, capture_output=True, text=True)
    assert json.loads(done.stdout)["hash"] == row["hash"]


def test_a_report_has_intervals_and_compares_the_brains(undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report(undisturbed / "out", Detail.JSON)
    said = json.loads(capsys.readouterr().out)
    rows = kept.Folder(undisturbed / "out").table().to_pylist()
    ways = {name: [row["true_distance_m"] for row in rows if row["brain"] == name] for name in ("clearway", "odd.py")}
    for level in (one for one in said["levels"] if one["factor"] == "brain"):
        mean, least, most = level["true_distance_m"]
        assert least < mean < most and mean == pytest.approx(sum(ways[level["value"]]) / 20)
    (pair,) = said["compared"]
    assert pair["figure"] == "true_distance_m" and pair["pairs"] == 20
    assert pair["difference"][0] == pytest.approx(sum(ways["clearway"]) / 20 - sum(ways["odd.py"]) / 20)
    picture, page = map(Path, said["files"])
    assert picture.read_bytes().startswith(b"\x89PNG") and f"({picture.name})" in page.read_text()
    assert page.read_text().count("\n| ") == len(said["levels"]) + 2 and "clearway less odd.py" in page.read_text()


def test_a_report_of_one_pair_says_that_it_shows_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    by_hand(tmp_path / "out", saved(tmp_path, PLAN.replace("to = 10", "to = 1").replace("starts = 2\n", "")))
    report(tmp_path / "out", Detail.JSON)
    said, page = json.loads(capsys.readouterr().out), (tmp_path / "out" / "index.md").read_text()
    (pair,) = said["compared"]
    assert pair["pairs"] == 1 and pair["difference"][1:] == [None, None] and "wilcoxon_p" not in pair
    assert said["levels"][0]["ok"][0] == 1 and None in said["levels"][1]["true_distance_m"]
    assert " over 1 pair: nothing is shown\n" in page and "Wilcoxon" not in page and "inf" not in page


def test_a_report_is_of_the_same_rows_throughout_while_a_sweep_goes_on(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    looks: list[int] = []

    def done(_: kept.Folder) -> list[tuple[int, int]]:
        looks.append(1)
        return [(20 * at, 20 * at + len(looks)) for at in range(2)]

    with kept.locked(tmp_path / "out", plan.read(saved(tmp_path, PLAN), plan.Plan)) as folder:
        rows = kept.Folder(undisturbed / "out").table()
        for first, count in ((0, 1), (20, 1), (0, 2), (20, 2)):
            kept.write_part(folder.part(first, first + count), rows.slice(first, count))
    monkeypatch.setattr(kept.Folder, "done", done)
    report(tmp_path / "out", Detail.JSON)
    said = json.loads(capsys.readouterr().out)
    assert len(looks) == 1 and said["levels"][0]["runs"] == 2 and said["compared"][0]["pairs"] == 1


@pytest.mark.parametrize("listed", [[(0, 40)], []])
def test_rows_are_read_while_the_parts_are_being_merged(
    listed: list[tuple[int, int]], undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between a look at which parts there are and the reading of them they go."""
    out = shutil.copytree(undisturbed / "out", tmp_path / "out")
    (out / kept.ROWS).rename(out / "later")

    def done(_: kept.Folder) -> list[tuple[int, int]]:
        (out / "later").rename(out / kept.ROWS)
        return listed

    monkeypatch.setattr(kept.Folder, "done", done)
    assert rows_of(out) == rows_of(undisturbed / "out")


def test_brains_are_compared_where_robot_and_arena_are_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, text = tmp_path / "out", 'brains = ["clearway", "demo"]\nseconds = 0.2\nseeds = [1, 2, 3]\n'
    rows = by_hand(out, saved(tmp_path, text))
    places = {(row["brain"], row["robot"], row["arena"]) for row in rows}
    assert places == {("clearway", "shieldbot", "room"), ("demo", "shieldbot-charging", "station")}
    killed = {"row": 5, "brain": "demo", "seed": 3, "status": "killed"}
    all_rows = [*kept.Folder(out).table().to_pylist()[:5], killed]
    kept.write_part(out / kept.ROWS, table_of(all_rows, columns(kept.Folder(out).plan, ["clearway", "demo"])))
    report(out, Detail.JSON)
    said = json.loads(capsys.readouterr().out)
    (pair,) = said["compared"]
    assert pair["pairs"] == 0 and pair["difference"] is None
    assert [one["value"] for one in said["levels"] if one["factor"] == "arena"] == ["room", "station"]


def test_a_picture_of_what_cannot_be_negative_begins_at_0_or_above(
    undisturbed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn: list[Any] = []

    def saved(figure: Any, path: Path) -> Path:
        drawn.append(figure)
        return path

    monkeypatch.setattr("boebot_campaign.report.saved", saved)
    report(undisturbed / "out", Detail.NOTHING)
    assert all(panel.get_ylim()[0] >= 0 for panel in drawn[0].axes) and capsys.readouterr().out == ""


def test_the_newest_rows_are_shown_while_a_sweep_runs(tmp_path: Path) -> None:
    with kept.locked(tmp_path / "out", plan.read(saved(tmp_path, PLAN), plan.Plan)) as folder:
        assert newest_rows(folder.path, 1) == ""
        rows = [{"row": row, "brain": "odd.py", "seed": row + 500, "status": "ok"} for row in range(10)]
        kept.write_part(folder.part(0, 10), table_of(rows, columns(folder.plan, ["clearway"])))
        assert newest_rows(folder.path, 1) == ""  # it looks once in a second
        printed = output.console()
        with printed.capture() as caught:
            printed.print(newest_rows(folder.path, 2))
        assert newest_rows(tmp_path, 3) != ""  # an evolution's sweeps are in folders of its folder
    lines = [line for line in caught.get().splitlines() if "odd.py" in line]
    assert len(lines) == NEWEST_ROWS and "509" in lines[-1] and "row" in caught.get()


def test_a_dry_run_says_how_long_all_runs_take_and_keeps_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = saved(tmp_path, PLAN.replace('"odd.py", ', "").replace("to = 10", "to = 1_000_000"))
    before = time.perf_counter()
    code, said, _ = command.boebot(capsys, "sweep", str(file), "--dry-run", "--json")
    took_s = time.perf_counter() - before
    found = json.loads(said)
    assert code == 0 and found["runs"] == 2_000_000 and 1e-3 < found["one_worker_s"] / 2_000_000 < took_s
    assert sorted(path.name for path in tmp_path.iterdir()) == ["odd.py", "sweep.toml"]


def test_what_a_brain_prints_and_where_it_goes_as_it_is_loaded_changes_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "away.py").write_text(
        "import os\nprint('hello')\nos.chdir(os.sep)\n\ndef step(robot):\n    print('on')\n"
    )
    Path("sweep.toml").write_text('brains = ["away.py"]\nseconds = 0.2\nseeds = [1]\n')
    code, said, _ = command.boebot(capfd, "sweep", "sweep.toml", "--dry-run", "--json")
    assert code == 0 and json.loads(said)["runs"] == 1
    with kept.locked(Path("out"), plan.read(Path("sweep.toml"), plan.Plan)):
        assert (tmp_path / "out" / "files" / "brain-0" / "away.py").is_file()
    assert Path.cwd() == tmp_path


@pytest.mark.parametrize("workers", [0, 1.5, "2"])
def test_workers_that_are_no_count_are_refused(tmp_path: Path, workers: Any) -> None:
    with pytest.raises(BoebotError, match=f"workers is {workers!r}; expected a whole number from 1 on"):
        boebot.sweep(saved(tmp_path, ODD), out=tmp_path / "out", workers=workers)
    assert not (tmp_path / "out").exists()


def test_ctrl_c_ends_a_dry_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = saved(tmp_path, ODD.replace('"well", "raises", "loops", "kills"', '"interrupts"'))  # in this process
    assert command.boebot(capsys, "sweep", str(file), "--dry-run")[0] == 130


def test_a_part_that_is_there_is_not_run_again(tmp_path: Path) -> None:
    file = saved(tmp_path, PLAN)
    with kept.locked(tmp_path / "out", plan.read(file, plan.Plan)) as folder:
        folder.part(0, 3).write_bytes(b"not looked at")
        tasks.do_part(str(folder.path), folder.stamp, 0, 3)
        assert list(folder.parts.iterdir()) == [folder.part(0, 3)]
        assert folder.part(0, 3).read_bytes() == b"not looked at"


STRANGE = """\
import sys
import boebot, distributed
with distributed.LocalCluster(
    n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://", host="127.0.0.1", dashboard_address=None
) as cluster:
    print(cluster.scheduler_address, flush=True)
    for line in sys.stdin:
        exec(line)
        print("done", flush=True)
"""


def test_a_cluster_that_does_not_fit_is_refused_before_the_first_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, elsewhere, out = saved(tmp_path, PLAN), tmp_path / "elsewhere", tmp_path / "out"
    elsewhere.mkdir()
    monkeypatch.chdir(tmp_path)
    words = [sys.executable, "-c", STRANGE]
    with subprocess.Popen(
        words, cwd=elsewhere, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as cluster:
        assert cluster.stdin is not None and cluster.stdout is not None
        url = cluster.stdout.readline().strip()
        other_disk = Path("/proc/self/cwd/out")  # the cluster's process has another folder there
        with pytest.raises(BoebotError, match=r"^worker tcp://\S+ does not see /proc/self/cwd/out; expected a folder"):
            boebot.sweep(file, out=other_disk, scheduler=url)
        changes = {
            "boebot.__version__ = '0.0.1'": "^worker tcp://.* has boebot 0.0.1 .*; expected boebot ",
            "distributed.versions._version_cached = lambda _: '9.9'": "^the scheduler has distributed 9.9; expected ",
        }
        for change, sentence in changes.items():
            cluster.stdin.write(change + "\n")
            assert cluster.stdout.readline() == "done\n"
            with pytest.raises(BoebotError, match=sentence):
                boebot.sweep(file, out=out, scheduler=url)
        cluster.stdin.close()
    assert not list((out / "parts").iterdir()) and not list(out.glob(".probe*"))


@pytest.mark.soak
def test_a_sweep_outlives_a_scheduler_that_is_begun_anew(undisturbed: Path, tmp_path: Path) -> None:
    file, out = saved(tmp_path, PLAN), tmp_path / "out"
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    url = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "dask"]
    begun: list[subprocess.Popen[Any]] = []
    logs = {name: tmp_path / name for name in ("dask", "sweep")}

    def begin(command: list[str], log: str = "dask") -> subprocess.Popen[Any]:
        with logs[log].open("a") as file:
            begun.append(subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=file))
        return begun[-1]

    def scheduler() -> subprocess.Popen[Any]:
        return begin([*dask, "scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard"])

    def worker() -> None:
        begin([*dask, "worker", url, "--nthreads", "1", "--no-dashboard"])

    def wait_until(it_is: Callable[[], object]) -> None:
        until = time.perf_counter() + 60
        while not it_is() and time.perf_counter() < until:
            time.sleep(0.02)

    sweep = [*COMMAND, str(file), "--out", str(out), "--scheduler", url]
    try:
        first = scheduler()
        waits = begin(sweep, "sweep")
        wait_until(lambda: "Receive client connection" in logs["dask"].read_text())
        time.sleep(2)  # it is connected, and waits for workers
        first.kill()
        assert waits.wait(60) == 1 and logs["sweep"].read_text().count("\n") == 1
        first = scheduler()
        worker()
        goes_on = begin(sweep, "sweep")
        wait_until(lambda: list(out.glob("parts/*.parquet")))
        first.kill()
        first.wait()
        time.sleep(12)  # after 10 s a client of Dask closes
        scheduler()
        worker()
        assert goes_on.wait(90) == 0, logs["sweep"].read_text()
        assert logs["sweep"].read_text().count("\n") == 1
        assert rows_of(out) == rows_of(undisturbed / "out")
    finally:
        for process in begun:
            process.terminate()
        for process in begun:
            process.wait(20)
