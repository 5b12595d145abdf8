"""The table at the end of `make test`, and the hook that gives its figures."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tools.times_table import rows, table

ROOT = Path(__file__).resolve().parents[2]


def test_calls_of_pytest_are_added_up_by_folder() -> None:
    times = "sim_bridge\t3\t1.5\nhost\t2\t0.25\nsim_bridge\t1\t0.5\nsim_bridge, sanitized\t4\t8.0\n"
    units = "=== 212 test cases: 212 succeeded in 00:01:07.250 ===\n"
    assert rows(times, units) == [
        ("sim_bridge", 4, 2.0),
        ("host", 2, 0.25),
        ("sim_bridge, sanitized", 4, 8.0),
        ("firmware units", 212, 67.25),
    ]
    assert table(rows(times)).splitlines()[-1].split() == ["all", "10", "10.2"]
    assert rows("") == []


def test_pytest_writes_what_its_tests_took(tmp_path: Path) -> None:
    """One test that sleeps, in a folder of its own."""
    (tmp_path / "conftest.py").write_text((ROOT / "conftest.py").read_text())
    (tmp_path / "some").mkdir()
    (tmp_path / "some" / "test_it.py").write_text(
        "import time\ndef test_sleeps(): time.sleep(0.3)\ndef test_not(): pass\n"
    )
    times = tmp_path / "times"
    environment = os.environ | {"BOEBOT_TEST_TIMES": str(times)}
    for name in ("some", "some/test_it.py::test_not"):
        subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "--rootdir", str(tmp_path), "-c", os.devnull, name],
            cwd=tmp_path, env=environment, check=True, capture_output=True,
        )  # fmt: skip
    ((folder, tests, seconds),) = rows(times.read_text())
    assert (folder, tests) == ("some", 3) and seconds >= 0.3
