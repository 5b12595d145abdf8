"""The rover: programs on the emulated chip drive it by its H-bridge, follow a line, and look about with its turret."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.result import RunResult

pytestmark = pytest.mark.emulated

# Motors as ELEGOO's sketches drive them: analogWrite of pins 5 and 6 is Timer0, at 976 Hz.
MOTORS = """
#include <avr/io.h>
#include <util/delay.h>
static void ways(int left, int right) {               /* 1 forward, -1 back, 0 brake */
  PORTD = (PORTD & ~(1 << 7)) | (left > 0) << 7;      /* IN1 7 */
  PORTB = (PORTB & ~(1 << 0 | 1 << 1 | 1 << 3)) | (left < 0) << 0 | (right < 0) << 1 | (right > 0) << 3;
}
static void power(int duty) {                         /* analogWrite(ENA and ENB) */
  OCR0B = OCR0A = duty;
  TCCR0A = duty ? 1 << COM0A1 | 1 << COM0B1 | 1 << WGM01 | 1 << WGM00 : 1 << WGM01 | 1 << WGM00;
}
static void begin(void) {
  DDRB = 1 << 0 | 1 << 1 | 1 << 3 | 1 << 5;
  DDRD = 1 << 3 | 1 << 5 | 1 << 6 | 1 << 7;
  PORTD = 1 << 2;
  TCCR0B = 1 << CS01 | 1 << CS00;
}
"""
STRAIGHT = """
int main(void) {
  begin();
  ways(1, 1); power(120); _delay_ms(1500);
  power(0); _delay_ms(2500);                          /* coast */
  power(120); _delay_ms(1500);
  ways(0, 0); power(255); _delay_ms(1000);            /* brake */
  ways(-1, 1); _delay_ms(500);                        /* on the spot, to the left */
  power(0);
  for (;;) {}
}
"""
LINE = """
int main(void) {
  begin();
  for (;;) {                                          /* a sensor is low over the tape */
    if (!(PINB & 1 << 2)) { ways(1, -1); power(90); }
    else if (!(PIND & 1 << 2)) { ways(-1, 1); power(90); }
    else { ways(1, 1); power(90); }
  }
}
"""


def program(folder: Path, source: str) -> Path:
    (folder / "rover.c").write_text(MOTORS + source)
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-Wall", "-Wno-array-bounds"]
    subprocess.run(["avr-gcc", *flags, "-o", folder / "rover.elf", folder / "rover.c"], check=True)
    return folder / "rover.elf"


def drive(folder: Path, source: str, arena: str, seconds: float) -> RunResult:
    alike = ["motor_spread", "bridge_drop"]
    return boebot.run(program(folder, source), robot="rover", without=alike, arena=arena, seconds=seconds)


def test_it_drives_coasts_brakes_and_turns(tmp_path: Path) -> None:
    """Without the drops of the bridge its brake is a short: i = e / R. The pack gives what the motors' columns say."""
    run = drive(tmp_path, STRAIGHT, arena="empty", seconds=7.2)
    truth = run.truth
    assert truth is not None and truth.left_speed is not None
    body, speeds = run.robot.body, truth.left_speed

    def at(time_s: float) -> tuple[float, float]:
        """Speed and x then."""
        index = int(np.argmin(np.abs(truth.time - time_s)))
        return float(speeds[index]), float(truth.x[index])

    rolling = body.mass_kg + 2 * body.wheel_mass_kg + 2 * body.wheel_inertia_kg_m2 / body.wheel_radius_m**2
    damping = body.linear_damping_n_s_m * rolling / body.mass_kg
    constant = (6 - 4 * 0.16) / (48 * 250 * 2 * math.pi / 60)
    force = 0.0785 / (1.5 - 0.16) / body.wheel_radius_m  # N/A of a wheel: stall torque by the current beyond friction's

    def way(v: float, per_speed: float) -> float:
        settled, rate = -2 * force * 0.16 / per_speed, per_speed / rolling
        time = math.log(1 - v / settled) / rate
        return settled * time + v / rate

    (v, x), (slow, end) = at(1.5), at(3.99)
    assert v > 0.4 and slow < 0.01
    coasted = end - x
    assert coasted == pytest.approx(way(v, damping), rel=0.02)
    (v, x), (stands, end) = at(5.5), at(6.45)
    assert stands < 0.01
    assert end - x == pytest.approx(way(v, damping + 2 * force * 48 * constant / body.wheel_radius_m / 4), rel=0.03)
    assert end - x < 0.3 * coasted
    assert float(np.abs(truth.y[truth.time < 6.4]).max()) < 1e-3, "straight"
    assert float(np.unwrap(truth.heading)[-1]) > 3.0 and end > 1.0, "to the left"
    current = run.series.number("motor_left", "current")
    assert 0.15 < float(current[run.series.time < 1.5].max()) < 8.4 / 4


def test_it_follows_a_line(tmp_path: Path) -> None:
    """By its outer line sensors, round the bend and on."""
    run = drive(tmp_path, LINE, arena="track", seconds=8)
    truth = run.truth
    assert truth is not None and not run.true_contacts
    assert run.true_distance is not None and run.true_distance > 1.5
    dark = [run.series.number(name, "dark").mean() for name in ("line_left", "line_middle", "line_right")]
    assert dark[1] > 0.3 and dark[1] > max(dark[0], dark[2]) > 0
    assert run.series.number("line_middle", "voltage").max() > 4.5
