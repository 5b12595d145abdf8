/* Supply: voltage from the bandgap, and when it counts as low. */
#include <doctest.h>

#include "memory_bench.h"
extern "C" {
#include "parameters.h"
#include "supply.h"
}

namespace {

constexpr uint64_t TICK = memory_bench::TICK;

/* 24.7, rounded down, with the bandgap that the parameter says (mV). */
int expected(double volts, int bandgap) {
  const int result = static_cast<int>(1.1 * 1024 / volts);
  return bandgap * 1024 / result;
}

/* Runs until a measurement at that voltage has been made. */
void measure(memory_bench &bench, double volts) {
  bench.volts = volts;
  bench.run(TICK);
}

/* Has measured that voltage, and nothing else before. */
void settle(memory_bench &bench, double volts) {
  bench.volts = volts;
  bench.power_on();
  bench.run(5 * TICK);
}

}  // namespace

TEST_CASE("no voltage before the first measurement, and then it is not low") {
  memory_bench bench;
  bench.volts = 3.0;
  bench.power_on();
  CHECK(supply_voltage() == 0);
  CHECK_FALSE(supply_low());
  bench.run(6 * TICK);
  CHECK(supply_voltage() == expected(3.0, 1100));
  CHECK(supply_low());
}

TEST_CASE("the first measurement is not used") {
  memory_bench bench;
  bench.volts = 3.0;
  bench.power_on();
  bench.run(TICK); /* the first is over, the second has not begun */
  CHECK(supply_voltage() == 0);
  bench.volts = 5.0;
  while (supply_voltage() == 0 && bench.machine.now < 10 * TICK) {
    bench.run(TICK / 10);
  }
  CHECK(supply_voltage() == expected(5.0, 1100));
}

TEST_CASE("voltage of every supply, with every bandgap") {
  memory_bench bench;
  settle(bench, 5.0);
  for (int bandgap : {1000, 1001, 1099, 1100, 1187, 1200}) {
    REQUIRE(parameters_set(PARAMETER_BANDGAP, bandgap) == ANSWER_STATUS_OK);
    for (double volts = 1.15; volts < 5.6; volts += 0.07) {
      measure(bench, volts);
      bench.run(TICK);
      CAPTURE(volts);
      CAPTURE(bandgap);
      CHECK(supply_voltage() == expected(volts, bandgap));
    }
  }
}

TEST_CASE("one low measurement is not low, two in a row are") {
  memory_bench bench;
  settle(bench, 5.0);
  for (double volts : {4.0, 5.0, 4.0, 4.25, 4.0, 5.0, 5.0, 5.0}) {
    measure(bench, volts);
    CHECK_FALSE(supply_low());
  }
  measure(bench, 4.0);
  measure(bench, 4.0);
  CHECK(supply_low());
}

TEST_CASE("low lasts until one measurement is more than 100 mV above the minimum") {
  memory_bench bench;
  settle(bench, 4.0);
  REQUIRE(supply_low());
  for (double volts : {4.19, 4.21, 4.25, 4.29}) {
    measure(bench, volts);
    bench.run(3 * TICK);
    REQUIRE(supply_voltage() <= 4300);
    CHECK(supply_low());
  }
  measure(bench, 4.33);
  measure(bench, 4.25); /* one is enough, and what is above the minimum is not low */
  bench.run(3 * TICK);
  CHECK_FALSE(supply_low());
}

TEST_CASE("a minimum of 0 is never low, and ends a low supply") {
  memory_bench bench;
  settle(bench, 3.0);
  REQUIRE(supply_low());
  REQUIRE(parameters_set(PARAMETER_SUPPLY_MINIMUM, 0) == ANSWER_STATUS_OK);
  bench.run(2 * TICK);
  CHECK_FALSE(supply_low());
  measure(bench, 1.2);
  bench.run(5 * TICK);
  CHECK_FALSE(supply_low());
}

TEST_CASE("another minimum counts from the next tick on") {
  memory_bench bench;
  settle(bench, 4.5);
  CHECK_FALSE(supply_low());
  REQUIRE(parameters_set(PARAMETER_SUPPLY_MINIMUM, 4700) == ANSWER_STATUS_OK);
  bench.run(3 * TICK);
  CHECK(supply_low());
}
