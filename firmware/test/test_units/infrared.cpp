/* IR pairs: the burst at the LED, the sample at its end, ages. */
#include <doctest.h>
#include <initializer_list>

#include "generated/parameters.h"
#include "native_bench.h"

TEST_CASE("every reading is 38 periods of 38 kHz on each LED, left first, and leaves the LEDs dark") {
  attended_bench bench;
  bench.run_to(bench.tick(DEFAULT_INFRARED_PERIOD) - 1);
  for (const uint8_t pin : std::initializer_list<uint8_t>{PIN_INFRARED_LEFT_LED, PIN_INFRARED_RIGHT_LED}) {
    const auto edges = bench.edges_of(pin);
    const uint64_t slot = bench.slot(pin == PIN_INFRARED_LEFT_LED ? 2 : 3);
    std::vector<uint64_t> rises;
    for (const pin_edge &edge : edges) {
      if (edge.level == NATIVE_HIGH) {
        rises.push_back(edge.cycle);
      }
    }
    REQUIRE(rises.size() == 38);
    CHECK(rises.front() == slot + 211);
    for (size_t i = 1; i < rises.size(); i++) {
      CHECK(rises[i] - rises[i - 1] == 422); /* 37.9 kHz */
    }
    CHECK(edges.back().level == NATIVE_LOW);
    CHECK(edges.back().cycle - rises.back() == 211);
  }
}

TEST_CASE("a low receiver at the burst's end is an object on that side") {
  attended_bench bench;
  bench.drive(0, PIN_INFRARED_LEFT_RECEIVER, NATIVE_HIGH);
  bench.drive(0, PIN_INFRARED_RIGHT_RECEIVER, NATIVE_HIGH);
  const uint64_t burst = bench.slot(4 * DEFAULT_INFRARED_PERIOD + 3); /* the second right burst */
  bench.drive(burst + 4000, PIN_INFRARED_RIGHT_RECEIVER, NATIVE_LOW);
  bench.drive(burst + MILLISECOND + 100, PIN_INFRARED_RIGHT_RECEIVER, NATIVE_HIGH);
  bench.run_to(bench.tick(2));
  CHECK(bench.telemetry().infrared == 0);
  bench.run_to(bench.tick(DEFAULT_INFRARED_PERIOD + 1) + 1);
  CHECK(bench.telemetry().infrared == INFRARED_RIGHT);
  bench.run_to(bench.tick(2 * DEFAULT_INFRARED_PERIOD + 1) + 1);
  CHECK(bench.telemetry().infrared == 0);
}

TEST_CASE("the age counts ticks since the reading") {
  attended_bench bench;
  bench.run_to(bench.tick(0) + 1);
  CHECK(bench.telemetry().infrared_age == 255);
  for (unsigned tick = 1; tick <= 30; tick++) {
    bench.run_to(bench.tick(tick) + 1);
    CHECK(bench.telemetry().infrared_age == (tick - 1) % DEFAULT_INFRARED_PERIOD + 1);
  }
}

TEST_CASE("the period is a parameter, odd or even") {
  for (int32_t period : {2, 3, 7, 250}) {
    attended_bench bench;
    bench.set(PARAMETER_INFRARED_PERIOD, period);
    bench.run_to(bench.tick(20));
    bench.edges.clear();
    bench.run(2100 * TICK);
    int bursts = 0;
    uint64_t last = 0;
    for (const pin_edge &edge : bench.edges_of(PIN_INFRARED_LEFT_LED)) {
      if (edge.level == NATIVE_HIGH && edge.cycle > last + TICK / 2) {
        bursts++;
        CHECK((bursts == 1 || (edge.cycle - last) / TICK >= static_cast<uint64_t>(period - 1)));
      }
      last = edge.level == NATIVE_HIGH ? edge.cycle : last;
    }
    CAPTURE(period);
    CHECK(bursts >= 2100 / period - 1);
    CHECK(bursts <= 2100 / period + 1);
  }
}

TEST_CASE("switched off: no bursts, no reading") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, static_cast<int32_t>(DEVICES_SERVO));
  bench.run_to(bench.tick(8));
  bench.edges.clear();
  bench.run(50 * TICK);
  CHECK(bench.edges_of(PIN_INFRARED_LEFT_LED).empty());
  CHECK(bench.telemetry().infrared_age == 255);
}

namespace {

/* Half periods in cycles of each burst on a LED since `from`, in order; one value for each burst. */
std::vector<uint64_t> half_periods(const native_bench &bench, uint8_t pin, uint64_t from) {
  std::vector<uint64_t> found;
  uint64_t last = 0;
  for (const pin_edge &edge : bench.edges_of(pin)) {
    if (edge.cycle < from) {
      continue;
    }
    if (last != 0 && edge.cycle - last < 1000 && (found.empty() || found.back() == 0)) {
      if (found.empty()) {
        found.push_back(0);
      }
      found.back() = edge.cycle - last;
    } else if (last != 0 && edge.cycle - last > TICK / 2) {
      found.push_back(0);
    }
    last = edge.cycle;
  }
  return found;
}

}  // namespace

TEST_CASE("a sweep goes through five frequencies, all different, each within 0.12 kHz, in five ticks") {
  attended_bench bench;
  bench.set(PARAMETER_INFRARED_SWEEP, 1);
  bench.run_to(bench.tick(12));
  const uint64_t from = bench.tick(20);
  bench.run_to(bench.tick(41));
  for (const uint8_t pin : std::initializer_list<uint8_t>{PIN_INFRARED_LEFT_LED, PIN_INFRARED_RIGHT_LED}) {
    const std::vector<uint64_t> found = half_periods(bench, pin, from);
    REQUIRE(found.size() >= 20);
    size_t first = 0;
    while (first < 5 && found[first] != 211) {
      first++;
    }
    REQUIRE(first < 5);
    for (size_t i = 0; i < 15; i++) {
      const double frequency = 16e6 / (2.0 * static_cast<double>(found[first + i]));
      CHECK(frequency > 38000.0 + 1000.0 * static_cast<double>(i % 5) - 120.0);
      CHECK(frequency < 38000.0 + 1000.0 * static_cast<double>(i % 5) + 120.0);
    }
  }
}

TEST_CASE("the zone is the number of frequencies at which the object is seen") {
  for (int left = 0; left <= 5; left++) {
    attended_bench bench;
    const int right = 5 - left;
    uint64_t last_left = 0, last_right = 0;
    int toggles = 0;
    /* A receiver whose sensitivity ends below some frequency: it sees the burst by its half period, until it ends. */
    bench.answers_pin = [&](const pin_edge &edge) {
      const bool is_left = edge.pin == PIN_INFRARED_LEFT_LED;
      if ((!is_left && edge.pin != PIN_INFRARED_RIGHT_LED) || edge.level == NATIVE_RELEASED) {
        return;
      }
      uint64_t &last = is_left ? last_left : last_right;
      const uint64_t half = edge.cycle - last;
      last = edge.cycle;
      toggles = half < 1000 ? toggles + 1 : 1;
      if (toggles == 76) {
        bench.drive(edge.cycle + 500, is_left ? PIN_INFRARED_LEFT_RECEIVER : PIN_INFRARED_RIGHT_RECEIVER, NATIVE_HIGH);
      } else if (half > 150 && half < 250) {
        const int band = static_cast<int>(16e6 / 2.0 / static_cast<double>(half) / 1000.0 + 0.5) - 38;
        bench.drive(edge.cycle + 1, is_left ? PIN_INFRARED_LEFT_RECEIVER : PIN_INFRARED_RIGHT_RECEIVER,
                    band < (is_left ? left : right) ? NATIVE_LOW : NATIVE_HIGH);
      }
    };
    bench.set(PARAMETER_INFRARED_SWEEP, 1);
    bench.run(25 * TICK);
    CAPTURE(left);
    CHECK(bench.devices().infrared_zone_left == left);
    CHECK(bench.devices().infrared_zone_right == right);
    CHECK(bench.devices().infrared_zone_age >= 1);
    CHECK(bench.devices().infrared_zone_age <= 7);
    const unsigned expected = (left > 0 ? 1u * INFRARED_LEFT : 0u) | (right > 0 ? 1u * INFRARED_RIGHT : 0u);
    CHECK(bench.telemetry().infrared == expected); /* the bit stays that of 38 kHz */
    CHECK(bench.telemetry().infrared_age <= 6);
    bench.set(PARAMETER_INFRARED_SWEEP, 0);
    bench.set(PARAMETER_DEVICES, static_cast<int32_t>(DEVICES_SERVO | DEVICES_INFRARED | DEVICES_TURRET));
    bench.run(20 * TICK);
    CHECK(bench.devices().infrared_zone_age == 255);
    CHECK(bench.telemetry().infrared == expected);
  }
}
