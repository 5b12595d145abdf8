/* When the motors may run: time to live, stop, and pulses that are whole or absent. */
#include <doctest.h>
#include <initializer_list>

#include <random>
#include <set>

#include "../native_bench.h"
#include "generated/parameters.h"

namespace {

constexpr uint64_t FRAME = 320000; /* 20 ms */

/* Widths of the pulses at a pin, by the cycle of the rising edge. */
std::vector<std::pair<uint64_t, uint64_t>> pulses(const native_bench &bench, uint8_t pin) {
  std::vector<std::pair<uint64_t, uint64_t>> found;
  uint64_t rise = 0;
  for (const pin_edge &edge : bench.edges_of(pin)) {
    if (edge.level == NATIVE_HIGH) {
      rise = edge.cycle;
    } else if (rise != 0) {
      found.emplace_back(rise, edge.cycle - rise);
      rise = 0;
    }
  }
  return found;
}

}  // namespace

TEST_CASE("no set-point, no pulses") {
  native_bench bench;
  bench.run(100 * TICK);
  CHECK(pulses(bench, PIN_SERVO_LEFT).empty());
  CHECK(pulses(bench, PIN_SERVO_RIGHT).empty());
  CHECK((bench.telemetry().status & (STATUS_MOTORS_ENABLED | STATUS_DEAD_MAN | STATUS_STOPPED)) == 0);
  CHECK(bench.telemetry().pulse_left == 0);
}

TEST_CASE("a set-point gives pulses of its width every 20 ms, and the telemetry says so") {
  native_bench bench;
  bench.signal(5000, -2500, 2000);
  bench.run(100 * TICK);
  const auto left = pulses(bench, PIN_SERVO_LEFT);
  const auto right = pulses(bench, PIN_SERVO_RIGHT);
  REQUIRE(left.size() >= 40);
  for (size_t i = 0; i < left.size(); i++) {
    CHECK(left[i].second == 24000 + 1600);
    if (i > 0) {
      CHECK(left[i].first - left[i - 1].first == FRAME);
    }
  }
  for (const auto &pulse : right) {
    CHECK(pulse.second == 24000 + 800);
  }
  CHECK(bench.telemetry().pulse_left == 25600);
  CHECK(bench.telemetry().pulse_right == 24800);
  CHECK(bench.telemetry().status == STATUS_MOTORS_ENABLED);
}

TEST_CASE("signal 0 holds the wheels with centre pulses") {
  native_bench bench;
  bench.signal(0, 0, 1000);
  bench.run(20 * TICK);
  REQUIRE_FALSE(pulses(bench, PIN_SERVO_LEFT).empty());
  CHECK(pulses(bench, PIN_SERVO_LEFT).back().second == 24000);
}

TEST_CASE("motors stop within the time to live plus one servo frame, and not before it") {
  for (const uint16_t time_to_live : std::initializer_list<uint16_t>{20, 100, 250, 999, 2000}) {
    native_bench bench;
    bench.run(10 * TICK + 12345);
    bench.signal(5000, 5000, time_to_live);
    bench.run(1); /* the bytes are under way */
    const uint64_t sent = bench.machine.now;
    bench.run((time_to_live + 100u) * MILLISECOND);
    const auto left = pulses(bench, PIN_SERVO_LEFT);
    REQUIRE_FALSE(left.empty());
    const uint64_t last = left.back().first;
    const uint64_t end = sent + time_to_live * MILLISECOND;
    CAPTURE(time_to_live);
    CHECK(last + left.back().second <= end + FRAME);
    CHECK(last + FRAME >= end);
    CHECK((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
    CHECK((bench.telemetry().status & STATUS_MOTORS_ENABLED) == 0);
    CHECK(bench.telemetry().pulse_left == 0);
  }
}

TEST_CASE("a set-point that names no time to live has the default") {
  native_bench bench;
  bench.set(PARAMETER_TIME_TO_LIVE_DEFAULT, 50);
  bench.signal(5000, 5000, 0);
  bench.run(4 * TICK);
  CHECK((bench.telemetry().status & STATUS_MOTORS_ENABLED) != 0);
  bench.run(3 * TICK);
  CHECK((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
}

TEST_CASE("the next set-point ends a dead-man stop") {
  native_bench bench;
  bench.signal(5000, 5000, 20);
  bench.run(10 * TICK);
  REQUIRE((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
  bench.signal(5000, 5000, 1000);
  bench.run(10 * TICK);
  CHECK(bench.telemetry().status == STATUS_MOTORS_ENABLED);
  CHECK(bench.telemetry().pulse_left == 25600);
}

TEST_CASE("stop stops until the next set-point") {
  native_bench bench;
  bench.signal(5000, 5000, 2000);
  bench.run(10 * TICK);
  bench.send(MSG_STOP_ID);
  bench.run(4 * TICK);
  CHECK(bench.telemetry().status == STATUS_STOPPED);
  CHECK(bench.telemetry().pulse_left == 0);
  const size_t count = pulses(bench, PIN_SERVO_LEFT).size();
  bench.run(50 * TICK);
  CHECK(pulses(bench, PIN_SERVO_LEFT).size() == count);
  bench.signal(1000, 1000, 200);
  bench.run(4 * TICK);
  CHECK(bench.telemetry().status == STATUS_MOTORS_ENABLED);
}

TEST_CASE("a set-point out of range is refused and changes nothing") {
  native_bench bench;
  bench.signal(5000, 5000, 2000);
  bench.run(10 * TICK);
  const msg_telemetry before = bench.telemetry();
  bench.signal(10001, 0, 100);
  bench.signal(0, -10001, 100);
  bench.signal(0, 0, 2001);
  const msg_setpoint_speed fast{5001, 0, 100, 0};
  bench.send(MSG_SETPOINT_SPEED_ID, &fast, sizeof fast);
  bench.run(10 * TICK);
  const msg_telemetry after = bench.telemetry();
  CHECK(after.pulse_left == before.pulse_left);
  CHECK(after.setpoint_sequence == before.setpoint_sequence);
  CHECK(after.frames_bad == before.frames_bad + 4);
}

TEST_CASE("set-points in m/s are scaled by the full speed") {
  native_bench bench;
  const msg_setpoint_speed speed{850, -1700, 1000, 0};
  bench.send(MSG_SETPOINT_SPEED_ID, &speed, sizeof speed);
  bench.run(10 * TICK);
  CHECK(bench.telemetry().pulse_left == 24000 + 1600);
  CHECK(bench.telemetry().pulse_right == 24000 + 3200);
}

TEST_CASE("switching the servos off stops them and refuses set-points") {
  native_bench bench;
  bench.signal(5000, 5000, 2000);
  bench.run(10 * TICK);
  bench.set(PARAMETER_DEVICES, 0);
  bench.run(4 * TICK);
  CHECK(bench.telemetry().status == 0);
  CHECK(bench.telemetry().pulse_left == 0);
  bench.signal(5000, 5000, 2000);
  bench.run(4 * TICK);
  CHECK(bench.telemetry().pulse_left == 0);
}

TEST_CASE("a pulse is whole or absent whenever set-points and stops come") {
  std::mt19937 random(2);
  native_bench bench;
  std::set<uint64_t> asked;
  for (int i = 0; i < 400; i++) {
    if (random() % 3 == 0) {
      bench.send(MSG_STOP_ID);
    } else {
      const auto signal = static_cast<int16_t>(1000 * static_cast<int>(random() % 10));
      asked.insert(24000u + 320u * static_cast<unsigned>(signal / 1000));
      bench.signal(signal, signal, 20);
    }
    bench.run(random() % (3 * TICK));
  }
  const auto left = pulses(bench, PIN_SERVO_LEFT);
  REQUIRE(left.size() > 50);
  for (const auto &pulse : left) {
    CHECK(asked.count(pulse.second) == 1);
  }
}

TEST_CASE("both wheels take a set-point in the same frame") {
  for (uint64_t phase = 0; phase < FRAME; phase += 1999) {
    native_bench bench;
    bench.signal(1000, 1000, 2000);
    bench.run_to(bench.tick(10) + phase);
    bench.signal(5000, 5000, 2000);
    bench.run_to(bench.tick(20));
    const auto left = pulses(bench, PIN_SERVO_LEFT);
    const auto right = pulses(bench, PIN_SERVO_RIGHT);
    REQUIRE(left.size() == right.size());
    for (size_t i = 0; i < left.size(); i++) {
      CHECK(static_cast<int>(left[i].second) - 24000 == 24000 - static_cast<int>(right[i].second));
    }
  }
}
