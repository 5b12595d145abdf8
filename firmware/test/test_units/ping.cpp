/* Ping: trigger, echo, age, silence. */
#include <doctest.h>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

constexpr uint64_t HOLD_OFF = 750 * 16;

/* The cycle at which the first trigger that begins at or after `from` has ended; 0 if there is none. */
uint64_t trigger_end(const native_bench &bench, uint64_t from) {
  for (const pin_edge &edge : bench.edges_of(PIN_PING)) {
    if (edge.level == NATIVE_RELEASED && edge.cycle >= from) {
      return edge.cycle;
    }
  }
  return 0;
}

/* Runs until the next trigger and answers it with an echo; returns the tick after the echo's end. */
void echo(native_bench &bench, uint64_t cycles) {
  const uint64_t from = bench.machine.now;
  uint64_t end = 0;
  while ((end = trigger_end(bench, from + 1)) == 0) {
    bench.run(1000);
  }
  bench.drive(end + HOLD_OFF, PIN_PING, NATIVE_HIGH);
  bench.drive(end + HOLD_OFF + cycles, PIN_PING, NATIVE_LOW);
  bench.run_to(end + HOLD_OFF + cycles + TICK);
}

}  // namespace

TEST_CASE("the trigger lasts 5 us and leaves the pin to the sensor") {
  attended_bench bench;
  bench.run_to(bench.tick(1));
  const auto edges = bench.edges_of(PIN_PING);
  REQUIRE(edges.size() >= 4);
  for (size_t i = 0; i + 1 < edges.size(); i++) {
    if (edges[i].level == NATIVE_HIGH) {
      CHECK(edges[i + 1].cycle - edges[i].cycle == 80);
      CHECK(edges[i + 1].level == NATIVE_LOW);
    }
  }
  CHECK(bench.machine.output[PIN_PING] == NATIVE_RELEASED);
}

TEST_CASE("an echo is measured to the nearest microsecond, from 115 us to 18.3 ms") {
  for (uint64_t us : {115u, 116u, 1000u, 2500u, 4096u, 5000u, 17493u, 18300u}) {
    for (uint64_t cycles : {us * 16 - 8, us * 16, us * 16 + 7}) {
      attended_bench bench;
      bench.run_to(bench.tick(2));
      echo(bench, cycles);
      CHECK(bench.telemetry().ping_echo == us);
      CHECK(bench.telemetry().ping_age == 1);
      CHECK(bench.telemetry().ping_status == PING_STATUS_OK);
    }
  }
}

TEST_CASE("the longest pulse is that of a sensor that hears nothing") {
  attended_bench bench;
  bench.run_to(bench.tick(2));
  echo(bench, 18500 * 16);
  CHECK(bench.telemetry().ping_echo == 0);
  CHECK(bench.telemetry().ping_status == PING_STATUS_NOTHING_NEAR);
}

TEST_CASE("the age counts from the tick in which the echo ended") {
  attended_bench bench;
  bench.set(PARAMETER_PING_PERIOD, 10);
  bench.run_to(bench.tick(1));
  CHECK(bench.telemetry().ping_age == 255);
  bench.run_to(bench.tick(20));
  echo(bench, 3000 * 16);
  REQUIRE(bench.telemetry().ping_age == 1);
  bench.run(3 * TICK);
  CHECK(bench.telemetry().ping_age == 4);
}

TEST_CASE("no pulse: given up after 20 ms, the sensor is absent") {
  attended_bench bench;
  bench.run_to(bench.tick(2));
  echo(bench, 3000 * 16);
  REQUIRE(bench.telemetry().ping_echo == 3000);
  const uint64_t end = trigger_end(bench, bench.machine.now - 4 * TICK);
  REQUIRE(end != 0);
  bench.run_to(bench.tick(2 + 3 * DEFAULT_PING_PERIOD));
  CHECK(bench.telemetry().ping_echo == 0);
  CHECK(bench.telemetry().ping_status == PING_STATUS_ABSENT);
  CHECK(bench.telemetry().ping_age <= DEFAULT_PING_PERIOD);
}

TEST_CASE("shorter than the sensor's shortest echo: too near") {
  for (uint64_t us : {1u, 50u, 99u, 100u}) {
    attended_bench bench;
    bench.run_to(bench.tick(2));
    echo(bench, us * 16);
    CHECK(bench.telemetry().ping_echo == (us < 100 ? 0 : us));
    CHECK(bench.telemetry().ping_status == (us < 100 ? PING_STATUS_TOO_NEAR : PING_STATUS_OK));
    CHECK(bench.telemetry().ping_age == 1);
  }
}

TEST_CASE("a pin stuck high neither stops the tick nor the next reading") {
  attended_bench bench;
  bench.run_to(bench.tick(2));
  bench.drive(bench.machine.now + 100, PIN_PING, NATIVE_HIGH);
  bench.run(50 * TICK);
  CHECK(bench.telemetry().ping_echo == 0);
  bench.drive(bench.machine.now + 100, PIN_PING, NATIVE_LOW);
  bench.run(DEFAULT_PING_PERIOD * TICK);
  echo(bench, 1234 * 16);
  CHECK(bench.telemetry().ping_echo == 1234);
}

TEST_CASE("triggers keep the period") {
  for (int32_t period : {4, 5, 9}) {
    attended_bench bench;
    bench.set(PARAMETER_PING_PERIOD, period);
    bench.run_to(bench.tick(20));
    bench.edges.clear();
    bench.run(200 * TICK);
    uint64_t last = 0;
    for (const pin_edge &edge : bench.edges_of(PIN_PING)) {
      if (edge.level == NATIVE_HIGH) {
        CHECK((last == 0 || edge.cycle - last == static_cast<uint64_t>(period) * TICK));
        last = edge.cycle;
      }
    }
    CHECK(last != 0);
  }
}

TEST_CASE("switched off: no trigger, no reading") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, static_cast<int32_t>(DEVICES_SERVO));
  bench.run_to(bench.tick(8));
  bench.edges.clear();
  bench.run(50 * TICK);
  CHECK(bench.edges_of(PIN_PING).empty());
  CHECK(bench.telemetry().ping_age == 255);
  CHECK(bench.telemetry().ping_echo == 0);
}
