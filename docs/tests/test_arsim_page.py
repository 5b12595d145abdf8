"""docs/reference/arsim.md has a row for every function of ARSim's appendix, and its counterpart is used on the page."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = (Path(__file__).resolve().parents[1] / "reference" / "arsim.md").read_text()
# THEORY section 3.6: 29 functions, the other name of one of them, and the script of the test run.
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


def test_counterparts_are_used_in_the_section_that_their_row_names() -> None:
    for function, row in ROWS.items():
        anchor = re.search(r"\]\(#([\w-]+)\)$", row)
        assert anchor, function
        section = re.search(rf"^## {anchor[1].replace('-', ' ')}\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S | re.I)
        assert section, f"{function}: no section {anchor[1]}"
        code = "".join(re.findall(r"^```\w*\n(.*?)^```$", section[1], re.MULTILINE | re.DOTALL))
        names = [re.split(r"[(\s]", span)[0] for span in re.findall(r"`([^`]+)`", row.rpartition("|")[0])]
        assert any(name.rpartition(".")[2] in code for name in names), f"{function}: none of {names} in the example"
