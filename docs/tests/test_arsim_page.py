"""docs/reference/arsim.md has a row for every function of ARSim's appendix, and its counterpart is used on the page."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).resolve().parents[1] / "reference" / "arsim.md").read_text()
# Appendix A of the notes: 29 functions, the other name of one of them, and the script of the test run.
LISTED = """
AddMotionResults BrainStep CalibrateOdometer CheckForCollisions CreateArena CreateArenaObject CreateBrain CreateCompass
CreateIRSensor CreateMotor CreateOdometer CreateRobot GetCompassReading GetDistanceToLineAlongRay
GetDistanceToNearestObject GetIRSensorReading GetMinMaxAngle GetMotorSignalsFromBrain GetOdometerReading
GetRayBasedSensorReadings GetTorque InitializeMotionResults InitPlot InitializePlot MoveRobot ScaleMotorSignals
SetPositionAndVelocity ShowRobot UpdateMotorAxisAngularSpeed UpdateSensorPositions TestRunRobot
"""
FUNCTIONS = LISTED.split()
ROWS = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", PAGE, re.MULTILINE))


def test_every_function_has_a_row() -> None:
    assert len(FUNCTIONS) == 31 and set(ROWS) == set(FUNCTIONS)


def words(code: str) -> set[str]:
    """Everything that Python code names, calls, defines or asks for by a text."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(code)):
        for field in ("id", "attr", "name", "arg"):
            if isinstance(value := getattr(node, field, None), str):
                found.add(value)
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.add(node.value)
    return found


def section_of(function: str) -> tuple[str, list[str], list[str]]:
    """The row's first counterpart, and the Python blocks and shell blocks of the section that the row names."""
    row = ROWS[function]
    anchor = re.search(r"\]\(#([\w-]+)\)$", row)
    assert anchor, function
    section = re.search(rf"^## {anchor[1].replace('-', ' ')}\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S | re.I)
    assert section, f"{function}: no section {anchor[1]}"
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", section[1], re.MULTILINE | re.DOTALL)
    first = re.search(r"`([^`]+)`", row)
    assert first, function
    return first[1], [code for name, code in blocks if name == "python"], [code for name, code in blocks if not name]


@pytest.mark.parametrize("function", FUNCTIONS)
def test_counterpart_is_used_in_the_section_that_its_row_names(function: str) -> None:
    """The first one that the row names: by the example's Python (which test_docs.py runs), or as its command."""
    first, python, shell = section_of(function)
    if first.startswith("boebot "):
        assert any(line.startswith(first) for code in shell for line in code.splitlines())
        return
    called = first.partition("(")[0]
    wanted = re.findall(r"\w+", called)[-1]  # VehicleModel.compass -> compass, vehicle["compass"] -> compass
    assert any(wanted in words(code) for code in python), f"{function}: {first} is not in the example"


@pytest.mark.parametrize("function", FUNCTIONS)
def test_examples_check_what_they_show(function: str) -> None:
    """A section's Python asserts, or is saved as the file that a command of the same section runs."""
    _, python, shell = section_of(function)
    for code in python:
        saved = re.match(r"# (\w+\.py):", code)
        by_command = saved is not None and any(saved[1] in command for command in shell)
        assert by_command or any(isinstance(node, ast.Assert) for node in ast.walk(ast.parse(code)))
