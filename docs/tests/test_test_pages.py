"""docs/how-to/test-a-sketch.md: its workflow for CI is one, installs what the kit says it needs, and its command writes
what it keeps, of tests that fail, too. What the pages' commands print: test_shown_output.py, test_board_page.py."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from tools import shown_output

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "how-to" / "test-a-sketch.md").read_text(encoding="utf-8")


@pytest.mark.unsanitized
def test_the_workflow_keeps_what_its_tests_leave(tmp_path: Path) -> None:
    files = {name: text for text, name in shown_output.FILE.findall(PAGE)}
    workflow = yaml.safe_load(files.pop(".github/workflows/tests.yml"))
    (job,) = workflow["jobs"].values()
    *_, packages, install, command, keep = job["steps"]
    extras = re.search(r"\[([\w,]+)\]", install["run"])
    known = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert extras is not None and set(extras[1].split(",")) <= set(known)
    on_page = re.search(r"`apt install ([^`]+)`", PAGE)
    assert on_page is not None and packages["run"].endswith(on_page[1])
    for name in ("arm/arm.ino", "arm/test_arm.py"):  # as it is before it is mended: the test fails
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(files[name], encoding="utf-8")
    module, *words = shlex.split(command["run"])
    done = subprocess.run(
        [sys.executable, "-m", module, *shown_output.PYTEST, *words], cwd=tmp_path, capture_output=True, check=False
    )
    assert done.returncode == 1, done.stderr
    assert keep["if"] == "always()" and keep["with"]["include-hidden-files"]
    report, kept = (tmp_path / name for name in keep["with"]["path"].split())
    assert "1715.875" in report.read_text(encoding="utf-8")
    (folder,) = kept.iterdir()
    assert {"pins.vcd", "serial.txt", "again.txt"} <= {file.name for file in folder.iterdir()}
