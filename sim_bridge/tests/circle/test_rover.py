"""The rover: programs on the emulated chip drive it by its H-bridge, follow a line, and look about with its turret."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.result import RunResult
from boebot.view import scene
from sim_bridge.tests.boards.avr.avr_program import compiled

pytestmark = pytest.mark.unsanitized

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
  power(0); _delay_ms(1500);                          /* coast */
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
    else { ways(1, 1); power(110); }
  }
}
"""


AVOID = """
static void put(char byte) { while (!(UCSR0A & 1 << UDRE0)) {} UDR0 = byte; }
static void print(unsigned mm) {
  for (unsigned unit = 1000; unit; unit /= 10) put('0' + mm / unit % 10);
  put('\\n');
}
static void frame(unsigned us) {                      /* of 20 ms: a pulse to the servo, pin 3 */
  PORTD |= 1 << 3;
  for (unsigned i = 0; i < us / 8; i++) _delay_us(7.5);
  PORTD &= ~(1 << 3);
  _delay_ms(18);
}
static unsigned look(unsigned us, int frames) {       /* there, and mm to what the HC-SR04 sees: Trig A5, Echo A4 */
  while (frames--) frame(us);
  PORTC |= 1 << 5; _delay_us(10); PORTC &= ~(1 << 5);
  while (!(PINC & 1 << 4)) {}
  TCNT1 = 0;
  while (PINC & 1 << 4) {}
  return TCNT1 * 4UL * 343 / 2000;
}
enum { RIGHT = 544, AHEAD = 1472, LEFT = 2400 };      /* as Servo.write(0), (90), (180) */
int main(void) {
  begin();
  DDRC = 1 << 5 | 1 << 3;
  TCCR1B = 1 << CS11 | 1 << CS10;                     /* 4 us */
  UBRR0 = 16;
  UCSR0A = 1 << U2X0;
  UCSR0B = 1 << TXEN0;
  print(look(LEFT, 40));
  print(look(RIGHT, 40));
  look(AHEAD, 30);
  for (;;) {
    PORTC &= ~(1 << 3);
    ways(1, 1); power(100);
    while (look(AHEAD, 1) > 500) {}
    ways(0, 0); power(255);
    PORTC |= 1 << 3;                                  /* the lamp, A3, while it looks about */
    unsigned left = look(LEFT, 25), right = look(RIGHT, 40);
    print(left); print(right);
    look(AHEAD, 25);
    do {
      if (left > right) ways(-1, 1); else ways(1, -1);
      power(150); _delay_ms(150);
      ways(0, 0); power(255); _delay_ms(150);
    } while (look(AHEAD, 2) < 700);
  }
}
"""


def program(folder: Path, source: str) -> Path:
    return compiled(MOTORS + source, folder / "rover.elf")


def drive(
    folder: Path,
    source: str,
    arena: str,
    seconds: float,
    pose: tuple[float, float, float] | None = None,
    without: Sequence[str] = (),
) -> RunResult:
    file = program(folder, source)
    return boebot.run(file, robot="rover", without=without, arena=arena, seconds=seconds, pose=pose)


def test_it_drives_coasts_brakes_and_turns(tmp_path: Path) -> None:
    """Without the drops of the bridge its brake is a short: i = e / R. The pack gives what the motors' columns say."""
    run = drive(tmp_path, STRAIGHT, "empty", 6.2, without=["motor_spread", "bridge_drop", "slip"])
    truth = run.truth
    assert truth is not None and truth.left_speed is not None
    body, speeds = run.robot.body, truth.left_speed

    def at(time_s: float) -> tuple[float, float]:
        """Speed and x then."""
        index = int(np.argmin(np.abs(truth.time - time_s)))
        return float(speeds[index]), float(truth.x[index])

    rolling = body.mass_kg + 2 * body.wheel_mass_kg + 2 * body.wheel_inertia_kg_m2 / body.wheel_radius_m**2
    damping = body.linear_damping_n_s_m * rolling / body.mass_kg
    ohm = 6 / 0.8
    constant = (6 - ohm * 0.16) / (48 * 250 * 2 * math.pi / 60)
    efficiency = 0.0785 / (48 * constant * (0.8 - 0.16))
    force = 48 / efficiency * constant / body.wheel_radius_m  # N/A of a wheel that drives its motor

    def way(v: float, per_speed: float) -> float:
        settled, rate = -2 * force * 0.16 / per_speed, per_speed / rolling
        time = math.log(1 - v / settled) / rate
        return settled * time + v / rate

    (v, x), (slow, end) = at(1.5), at(2.99)
    assert v > 0.4 and slow < 0.01
    coasted = end - x
    assert coasted == pytest.approx(way(v, damping), rel=0.02)
    (v, x), (stands, end) = at(4.5), at(5.45)
    assert stands < 0.01
    assert end - x == pytest.approx(way(v, damping + 2 * force * 48 * constant / body.wheel_radius_m / ohm), rel=0.03)
    assert end - x < 0.6 * coasted
    assert float(np.abs(truth.y[truth.time < 5.4]).max()) < 1e-3, "straight"
    assert float(np.unwrap(truth.heading)[-1]) > 3.0 and end > 1.0, "to the left"
    current = run.series.number("motor_left", "current")
    assert 0.15 < float(current[run.series.time < 1.5].max()) < 8.4 / ohm


def test_it_follows_a_line(tmp_path: Path) -> None:
    """By its outer line sensors, round the bend and on."""
    run = drive(tmp_path, LINE, "track", 8)
    truth = run.truth
    assert truth is not None and not run.true_contacts
    assert run.true_distance is not None and run.true_distance > 1.2
    dark = [run.series.number(name, "dark").mean() for name in ("line_left", "line_middle", "line_right")]
    assert dark[1] > 0.3 and dark[1] > max(dark[0], dark[2]) > 0
    assert run.series.number("line_middle", "voltage").max() > 4.5


def test_it_looks_about_with_its_turret_and_avoids_walls(tmp_path: Path) -> None:
    """Left of it the wall is 2 m from its middle, right 1 m; the HC-SR04 is 20 mm before the turret's axis."""
    run = drive(tmp_path, AVOID, "room", 20, pose=(-1.2, -0.5, 0.0))
    said = [int(line) for line in b"".join(data for _, data in run.record.rows("to_host")).split()]
    assert said[:2] == pytest.approx([1980, 980], rel=0.03)
    assert len(said) >= 4 and run.true_contacts == 0
    assert run.true_distance is not None and run.true_distance > 1.2
    angle, lit = run.series.number("turret", "angle"), run.series.number("lamp", "brightness") > 0.5
    assert float(angle.max()) == pytest.approx(math.pi / 2, abs=0.08) == -float(angle.min())
    assert lit.any() and float(np.abs(angle[~lit][run.series.time[~lit] > 3]).max()) < 0.3
    seen = run.series.number("sonar", "distance")
    assert said[0] / 1000 == pytest.approx(float(seen[np.searchsorted(run.series.time, 1.0)]), rel=0.03)
    (shown,) = (row for row in scene.view(run).turret[[np.argmax(angle)]])
    assert shown == pytest.approx(float(angle.max()), abs=1e-4), "pictures turn the beam"


COUNT = """
#include <avr/interrupt.h>
static void put(char byte) { while (!(UCSR0A & 1 << UDRE0)) {} UDR0 = byte; }
static volatile int left, right;
ISR(INT0_vect) { left++; }
ISR(INT1_vect) { if (PIND & 1 << 3) right += PINB & 1 << 2 ? -1 : 1; }  /* B is still low as A rises: forward */
int main(void) {
  begin();
  DDRD &= ~(1 << 3);
  PORTD = 0;
  EICRA = 1 << ISC10 | 1 << ISC00;                    /* both edges of 2 and 3 */
  EIMSK = 1 << INT0 | 1 << INT1;
  sei();
  UBRR0 = 16;
  UCSR0A = 1 << U2X0;
  UCSR0B = 1 << TXEN0;
  ways(1, 1); power(150); _delay_ms(700);
  ways(-1, -1); _delay_ms(900);
  ways(0, 0); _delay_ms(300);
  for (int i = 0; i < 2; i++) {
    put((i ? right : left) >> 8); put(i ? right : left);
  }
  for (;;) {}
}
"""


def test_encoders_are_on_any_pins(tmp_path: Path) -> None:
    """One channel at INT0 counts its edges whichever way; two channels at INT1 and 10 count periods with their sign."""
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'extends = "rover"\nname = "mine"\nremove = ["line_left", "line_right", "turret", "sonar"]\n'
        '[device.encoder_left]\ntype = "encoder"\npin = 2\nedges_per_turn = 40\n'
        '[device.encoder_right]\ntype = "quadrature_encoder"\npin_a = 3\npin_b = 10\nedges_per_turn = 80\n'
    )
    file = program(tmp_path, COUNT)
    without = ["encoder_errors", "slip"]
    run = boebot.run(file, robot=mine, arena="empty", seconds=2, without=without)
    data = b"".join(data for _, data in run.record.rows("to_host"))
    left, right = (int.from_bytes(data[i : i + 2], "big", signed=True) for i in (0, 2))
    truth, turn_m = run.truth, 2 * math.pi * run.robot.body.wheel_radius_m
    assert truth is not None and truth.right_speed is not None and truth.left_speed is not None
    rolled = (
        float(np.trapezoid(truth.right_speed, truth.time)),
        float(np.trapezoid(np.abs(truth.left_speed), truth.time)),
    )
    assert rolled[0] < -0.02, "farther back than forth"
    assert right == pytest.approx(rolled[0] / turn_m * 20, abs=1.1)
    assert left == pytest.approx(rolled[1] / turn_m * 40, abs=2.1)
    assert run.series.number("encoder_right", "count")[-1] == pytest.approx(rolled[0] / turn_m * 80, abs=1.1)
    ahead = float(np.trapezoid(truth.left_speed, truth.time))
    assert run.series.number("encoder_left", "count")[-1] == pytest.approx(ahead / turn_m * 40, abs=1.1)
