/* IR pairs: the burst at the LED, the sample at its end, ages. */
#include <doctest.h>
#include <initializer_list>

#include "../native_bench.h"
#include "generated/parameters.h"

TEST_CASE("every reading is 1 ms of 38 kHz on each LED, left first, and leaves the LEDs dark") {
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
    REQUIRE(rises.size() >= 36);
    CHECK(rises.size() <= 40);
    CHECK(rises.front() >= slot);
    CHECK(rises.back() < slot + MILLISECOND);
    for (size_t i = 1; i < rises.size(); i++) {
      CHECK(rises[i] - rises[i - 1] == 422); /* 37.9 kHz */
    }
    CHECK(edges.back().level == NATIVE_LOW);
    CHECK(edges.back().cycle == slot + MILLISECOND);
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
  bench.set(PARAMETER_DEVICES, static_cast<int32_t>(DEVICES_SERVOS));
  bench.run_to(bench.tick(8));
  bench.edges.clear();
  bench.run(50 * TICK);
  CHECK(bench.edges_of(PIN_INFRARED_LEFT_LED).empty());
  CHECK(bench.telemetry().infrared_age == 255);
}
