/* Turret: pulses for angles, in its slot, and when they end. */
#include <doctest.h>

#include <cmath>
#include <cstdlib>
#include <initializer_list>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

class turret_bench : public native_bench {
 public:
  turret_bench() {
    start();
    set(PARAMETER_DEVICES, DEVICES_BUILT & ~DEVICES_COMPASS);
    run_in_session(2 * TICK);
  }
  void turn(int16_t angle, uint8_t hold = 1) { say(MSG_TURRET_ID, msg_turret{angle, hold}); }

  /* Start and width of the last whole pulse since `from`; {0, 0} if there is none. */
  struct pulse {
    uint64_t start, width;
  };
  pulse last_pulse(uint64_t from) const {
    pulse found{0, 0};
    uint64_t rise = 0;
    for (const pin_edge &edge : edges_of(PIN_TURRET)) {
      if (edge.level == NATIVE_HIGH) {
        rise = edge.cycle;
      } else if (rise >= from && rise != 0) {
        found = {rise, edge.cycle - rise};
        rise = 0;
      }
    }
    return found;
  }
};

}  // namespace

TEST_CASE("pulse = centre + gain * angle, to a cycle, within 600 to 2400 us, in the fifth slot") {
  turret_bench bench;
  for (int gain : {9167, -9167, 16000, -16000, 1, 0}) {
    bench.set(PARAMETER_TURRET_GAIN, gain);
    for (int angle : {0, 1, -1, 1234, -7854, 7854, 15708, -16000, 16000}) {
      bench.turn(static_cast<int16_t>(angle));
      const uint64_t from = bench.machine.now + 3 * TICK;
      bench.run_in_session(6 * TICK);
      const double wanted = std::fmin(std::fmax(24000.0 + gain * (angle / 10000.0), 9600.0), 38400.0);
      const auto pulse = bench.last_pulse(from);
      CAPTURE(gain);
      CAPTURE(angle);
      CHECK(std::fabs(static_cast<double>(pulse.width) - wanted) <= 1.0);
      CHECK(bench.devices().turret_pulse == pulse.width);
      CHECK((pulse.start - bench.slot(4)) % (2 * TICK) == 10000);
    }
  }
}

TEST_CASE("switched on and turned at once, in any slot, it has whole pulses from the next frame on") {
  for (uint64_t slots = 0; slots < 8; slots++) {
    turret_bench bench;
    bench.set(PARAMETER_DEVICES, DEVICES_SERVO);
    bench.run_in_session(4 * TICK + slots * TICK / 4);
    bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_TURRET);
    bench.turn(0);
    const uint64_t from = bench.machine.now;
    bench.run_in_session(8 * TICK);
    const auto pulse = bench.last_pulse(from);
    CAPTURE(slots);
    CHECK(pulse.width == 24000);
    CHECK(bench.devices().turret_pulse == 24000);
    for (const pin_edge &edge : bench.edges_of(PIN_TURRET)) {
      const bool rises = edge.cycle > from && edge.level == NATIVE_HIGH;
      CHECK((!rises || (edge.cycle - bench.slot(4)) % (2 * TICK) == 10000));
    }
  }
}

TEST_CASE("what stops the motors releases it, and it does not move while they are latched") {
  turret_bench bench;
  bench.turn(1000);
  bench.run_in_session(6 * TICK);
  CHECK(bench.devices().turret_pulse != 0);
  bench.stop(1);
  bench.run_in_session(4 * TICK);
  CHECK(bench.devices().turret_pulse == 0);
  bench.edges.clear();
  bench.turn(1000);
  bench.run_in_session(6 * TICK);
  CHECK(bench.edges_of(PIN_TURRET).empty());
  CHECK(bench.counters().refused == 1);
  bench.arm();
  bench.turn(1000);
  bench.run_in_session(6 * TICK);
  CHECK(bench.devices().turret_pulse != 0);

  bench.signal(1000, 1000, 100); /* dead-man */
  bench.run_in_session(5 * TICK);
  CHECK(bench.devices().turret_pulse != 0);
  bench.run_in_session(12 * TICK);
  CHECK((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
  CHECK(bench.devices().turret_pulse == 0);

  bench.turn(1000);
  bench.run_in_session(6 * TICK);
  bench.edges.clear();
  bench.run(200 * TICK); /* the host has died */
  const auto after = bench.edges_of(PIN_TURRET);
  REQUIRE_FALSE(after.empty());
  CHECK(bench.machine.now - after.back().cycle > 80 * TICK);
  CHECK(after.back().level == NATIVE_LOW);
}

TEST_CASE("released by its own message, by its switch; wrong angles are refused") {
  turret_bench bench;
  bench.turn(0);
  bench.run_in_session(6 * TICK);
  CHECK(bench.devices().turret_pulse == 24000);
  bench.turn(16001);
  bench.turn(-16001);
  bench.turn(5, 2);
  bench.run_in_session(6 * TICK);
  CHECK(bench.devices().turret_pulse == 24000);
  CHECK(bench.counters().refused == 3);
  bench.turn(0, 0);
  bench.run_in_session(6 * TICK);
  CHECK(bench.devices().turret_pulse == 0);
  bench.turn(0);
  bench.run_in_session(6 * TICK);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_BUZZER);
  bench.run_in_session(8 * TICK);
  CHECK(bench.devices().turret_pulse == 0);
}

TEST_CASE("a pulse is whole or absent, and the wheels' pulses are as without it") {
  turret_bench bench;
  bench.signal(3000, -3000, 2000);
  for (int i = 0; i < 40; i++) {
    bench.turn(static_cast<int16_t>(i % 2 == 0 ? 16000 : -16000));
    bench.run_in_session(TICK + 7777 * static_cast<uint64_t>(i));
    if (i % 8 == 0) {
      bench.signal(3000, -3000, 2000);
    }
  }
  for (const uint8_t pin : std::initializer_list<uint8_t>{PIN_TURRET, PIN_SERVO_LEFT, PIN_SERVO_RIGHT}) {
    uint64_t rise = 0;
    for (const pin_edge &edge : bench.edges_of(pin)) {
      if (edge.level == NATIVE_HIGH) {
        rise = edge.cycle;
      } else if (rise != 0) {
        const uint64_t width = edge.cycle - rise;
        if (pin == PIN_TURRET) {
          CHECK((std::llabs(static_cast<long long>(width) - (24000 + 14667)) <= 268 || /* clamped at 38400 */
                 std::llabs(static_cast<long long>(width) - (24000 - 14667)) <= 268)); /* and at 9600 */
        } else {
          CHECK(width == 24000 + 960);
        }
      }
    }
  }
}
