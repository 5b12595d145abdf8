/* Analog inputs: battery and analog infra-red in turn with the supply, ages, switches. */
#include <doctest.h>

#include <cmath>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

constexpr int BATTERY = PIN_BATTERY - 14;

/* 24.7 of the data sheet, rounded down. */
int expected(double volts, double supply) {
  return std::min(1023, static_cast<int>(std::floor(volts * 1024.0 / supply)));
}

}  // namespace

TEST_CASE("a voltage becomes a ratio of the supply within three ticks") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_BATTERY);
  for (double supply : {5.0, 4.6}) {
    for (double volts : {0.0, 0.01, 1.234, 3.3, 4.59, 4.999, 6.0}) {
      bench.volts = supply;
      bench.analog[BATTERY] = volts;
      bench.run(4 * TICK);
      CHECK(bench.devices().battery == expected(volts, supply));
      CHECK(bench.devices().battery_age <= 2);
      CHECK(bench.devices().supply > 1000 * supply - 30);
      CHECK(bench.devices().supply < 1000 * supply + 30);
    }
  }
}

TEST_CASE("the supply is measured in every tick, whatever else is") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, DEVICES_BUILT);
  bench.run(10 * TICK);
  for (double volts : {4.7, 5.2, 4.4, 5.0, 4.9}) {
    bench.volts = volts;
    bench.run(2 * TICK);
    CHECK(bench.telemetry().supply > 1000 * volts - 30);
    CHECK(bench.telemetry().supply < 1000 * volts + 30);
  }
}

#ifdef PIN_ANALOG_INFRARED
TEST_CASE("both inputs in turn, each its own") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_BATTERY | DEVICES_ANALOG_INFRARED);
  for (double volts : {0.4, 1.1, 2.2, 3.1}) {
    bench.analog[BATTERY] = volts;
    bench.analog[PIN_ANALOG_INFRARED - 14] = 4.0 - volts;
    bench.run(6 * TICK);
    CHECK(bench.devices().battery == expected(volts, 5.0));
    CHECK(bench.devices().analog_infrared == expected(4.0 - volts, 5.0));
    CHECK(bench.devices().battery_age <= 3);
    CHECK(bench.devices().analog_infrared_age <= 3);
  }
}
#endif

TEST_CASE("switched off: no reading") {
  attended_bench bench;
  bench.analog[BATTERY] = 3.0;
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_BATTERY);
  bench.run(5 * TICK);
  CHECK(bench.devices().battery_age <= 2);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_TURRET);
  bench.run(5 * TICK);
  CHECK(bench.devices().battery == 0);
  CHECK(bench.devices().battery_age == 255);
}
