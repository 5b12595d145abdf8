"""How exact pins and link are on the emulated AVR board."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from boebot.devices.servo import PULSE_SCALE_US
from boebot.link import frame, messages
from boebot.runner import execute
from tools.bench.figures import figure

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "hil_tests"))

from rig import CYCLES_PER_US, Rig

SERVO_LEFT, SERVO_RIGHT = 13, 12


@figure("servo pulse width at the pin, UART saturated both ways: largest error", "cycles", at_most=4)
def servo_width() -> float:
    worst = 0.0
    with Rig.open("avr") as rig:
        rig.start()
        for sequence, signal in enumerate(np.linspace(-1.0, 1.0, 9)):
            counts = round(float(signal) * 1e4)
            setpoint = messages.SetpointSignal(counts, counts, 250, 0)
            for _ in range(10):
                # 50 bytes a millisecond is the line's rate: 100 ms of frames without a gap
                wire = frame.encode(setpoint.ID, sequence, setpoint.pack())
                rig.transport.write((wire * (5000 // len(wire) + 1))[:5000])
                telemetry = rig.listen(0.1)
            settled = rig.session.transport.now() - 0.5
            in_force = {SERVO_LEFT: telemetry[-1].pulse_left, SERVO_RIGHT: telemetry[-1].pulse_right}
            for pin, pulse in in_force.items():
                pulses = rig.pulses(pin)
                recent = pulses[pulses[:, 0] > settled * 1e6 * CYCLES_PER_US]
                expected = pulse * PULSE_SCALE_US * CYCLES_PER_US
                worst = max(worst, float(np.abs(recent[:, 1] - expected).max()))
    return worst


@figure("frames lost in 10 simulated minutes of wander on the AVR image", "frames", at_most=0)
def lost_frames() -> float:
    result = execute("wander", arena="room", on="avr", seconds=600.0)
    if result.error is not None:
        raise result.error
    return float(result.lost_frames + result.bad_frames)
