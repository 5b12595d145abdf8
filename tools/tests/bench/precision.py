"""How exact pins and link are on the emulated AVR board."""

from __future__ import annotations

import numpy as np

from boebot.link import messages
from boebot.running.tasks import Request
from boebot_hil.rig import CYCLES_PER_US
from sim_bridge.tests.rigs import SessionRig
from tools.tests.bench.figures import figure, ran

SERVO_LEFT, SERVO_RIGHT = 13, 12


@figure(
    "servo pulse width at the pin, UART saturated both ways: largest error",
    "cycles",
    at_most=16,
)
def servo_width() -> float:
    worst = 0.0
    with SessionRig.open("avr") as rig:
        rig.start()
        for signal in np.linspace(-1.0, 1.0, 9):
            counts = round(float(signal) * 1e4)
            setpoint = messages.SetpointSignal(counts, counts, 250, 0)
            rig.flood(setpoint, 0.1)  # the pulses that are under way when the set-point changes
            begun = rig.board.cycle
            rig.flood(setpoint, 1.0)
            for pin, mirror in ((SERVO_LEFT, 1), (SERVO_RIGHT, -1)):
                pulses = rig.pulses(pin)
                widths = pulses[pulses[:, 0] > begun, 1]
                expected = (1500 + mirror * 200 * float(signal)) * CYCLES_PER_US
                worst = max(worst, float(np.abs(widths - expected).max()))
    return worst


@figure("frames lost in 10 simulated minutes of wander on the AVR image", "frames", at_most=0)
def lost_frames() -> float:
    result = ran(Request.single("wander", arena="room", on="avr", seconds=600.0))
    return float((result.lost_frames or 0) + (result.bad_frames or 0))
