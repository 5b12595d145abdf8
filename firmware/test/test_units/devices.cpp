/* Telemetry of the slow devices: when it is sent, and how often. */
#include <doctest.h>

#include "generated/parameters.h"
#include "native_bench.h"

TEST_CASE("it is sent while one of the slow devices is on, and not otherwise") {
  for (const uint32_t device : {DEVICES_BATTERY, DEVICES_LIGHT, DEVICES_COMPASS, DEVICES_TURRET, DEVICES_BUZZER}) {
    attended_bench bench;
    bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_WHISKER | DEVICES_INFRARED | DEVICES_PING);
    bench.run(3 * TICK);
    const size_t before = bench.count(MSG_DEVICES_TELEMETRY_ID);
    bench.run(20 * TICK);
    CHECK(bench.count(MSG_DEVICES_TELEMETRY_ID) == before);
    bench.set(PARAMETER_DEVICES, static_cast<int32_t>(DEVICES_SERVO | device));
    bench.run(20 * TICK);
    CHECK(bench.count(MSG_DEVICES_TELEMETRY_ID) - before >= 9);
  }
}

TEST_CASE("for the zones of the IR sweep as well") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_INFRARED);
  bench.set(PARAMETER_INFRARED_SWEEP, 1);
  bench.run(20 * TICK);
  CHECK(bench.count(MSG_DEVICES_TELEMETRY_ID) >= 9);
}

TEST_CASE("the period is a parameter, and telemetry of every tick is never left out for it") {
  for (int period : {1, 2, 7, 100}) {
    attended_bench bench;
    bench.set(PARAMETER_DEVICES, DEVICES_BUILT);
    bench.set(PARAMETER_DEVICES_PERIOD, period);
    bench.run(110 * TICK);
    const size_t before = bench.count(MSG_DEVICES_TELEMETRY_ID);
    const size_t telemetry = bench.count(MSG_TELEMETRY_ID);
    bench.run(700 * TICK);
    CHECK(bench.count(MSG_DEVICES_TELEMETRY_ID) - before == static_cast<size_t>(700 / period));
    CHECK(bench.count(MSG_TELEMETRY_ID) - telemetry == 700);
  }
}

TEST_CASE("at most 45 bytes on the wire") { CHECK(MSG_DEVICES_TELEMETRY_LENGTH + FRAME_OVERHEAD <= 45); }
