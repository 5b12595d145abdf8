"""`boebot faults`, and `boebot run --fault`, as a shell has them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from boebot.description.robots import load_robot
from boebot.running.faults import known
from command import boebot


def test_every_fault_is_listed_with_its_unit(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "faults", "--robot", "shieldbot-quad", "--json")
    assert (code, err) == (0, "")
    rows = {row["name"]: row for row in json.loads(out)["faults"]}
    assert list(rows) == list(known(load_robot("shieldbot-quad"))) and all(row["does"] for row in rows.values())
    assert (rows["serial.delayed"]["unit"], rows["serial.delayed"]["default"]) == ("s", 0.1)
    code, out, err = boebot(capsys, "faults")
    assert (code, err) == (0, "") and "0.1 s (0 to 10)" in out and "external, watchdog" in out


def test_a_robot_that_cannot_fail_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "faults", "--robot", "arsim")
    assert (code, out) == (2, "") and err.count("\n") == 1 and "expected a robot with a board" in err


@pytest.mark.parametrize(
    ("fault", "code", "said"),
    [
        ("serial.repeated=1@0.2..0.3", 0, ""),
        ("serial.flipped=1e-9@0.2..0.3", 3, "did not fire"),
        ("serial.flippd@0.2", 2, "did you mean 'serial.flipped'?"),
        ("cable.out@0.2", 1, "the board at native fell silent"),
    ],
)
def test_exit_codes(capsys: pytest.CaptureFixture[str], tmp_path: Path, fault: str, code: int, said: str) -> None:
    """An error of the run comes before a fault that did not fire; a run that is refused leaves no folder."""
    others = ["--fault", "serial.flipped=1e-9@0.1..0.11"] if code == 1 else []
    others += ["--out", str(tmp_path / "out")] if code == 2 else []
    ended, out, err = boebot(capsys, "run", "wander", "--seconds", "0.5", "--fault", fault, *others, "--json")
    assert ended == code and not (tmp_path / "out").exists()
    assert said in err and err.count("\n") == bool(said)
    if code != 2:
        fired = int(re.findall(r" fired (\d+)", json.loads(out)["faults"])[0])
        assert (fired > 0) is (code != 3)
