/* Compass: settings and readings over the bus, a device that is missing, a bus that is held. Registers as in the data sheet
 * of the HMC5883L: settings 0 to 2, then x, z, y, the high byte first. */
#include <doctest.h>

#include "generated/parameters.h"
#include "two_wire_device.h"

namespace {

constexpr uint8_t ADDRESS = 0x1E;

class compass_bench : public attended_bench {
 public:
  two_wire_device device{*this, ADDRESS};

  compass_bench() {
    field(0, 0, 0);
    set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_COMPASS);
  }
  void field(int x, int y, int z) {
    const int values[] = {x, z, y};
    for (size_t i = 0; i < 3; i++) {
      device.registers[3 + 2 * i] = static_cast<uint8_t>(values[i] >> 8);
      device.registers[4 + 2 * i] = static_cast<uint8_t>(values[i]);
    }
  }
};

}  // namespace

TEST_CASE("settings are written once, then the three axes come every 40 ms") {
  compass_bench bench;
  bench.field(-4096, 2047, -1);
  bench.run(20 * TICK);
  CHECK(bench.device.registers[0] == 0x78);
  CHECK(bench.device.registers[1] == 0x20);
  CHECK(bench.device.registers[2] == 0x00);
  CHECK(bench.devices().compass_status == COMPASS_STATUS_OK);
  CHECK(bench.devices().compass_x == -4096);
  CHECK(bench.devices().compass_y == 2047);
  CHECK(bench.devices().compass_z == -1);
  const unsigned before = bench.device.transfers;
  bench.run(40 * TICK);
  CHECK(bench.device.transfers - before == 2 * 10); /* a reading addresses twice */
  for (int i = 0; i < 20; i++) {
    bench.run(TICK);
    CHECK(bench.devices().compass_age >= 1);
    CHECK(bench.devices().compass_age <= 6);
  }
  for (int value : {0, 1, -1, 255, 256, -256, 1090, -2048}) {
    bench.field(value, -value, value / 2);
    bench.run(10 * TICK);
    CHECK(bench.devices().compass_x == value);
    CHECK(bench.devices().compass_y == -value);
    CHECK(bench.devices().compass_z == value / 2);
  }
}

TEST_CASE("the clock runs at 100 kHz at most, and data change while it is low") {
  compass_bench bench;
  bench.run(5 * TICK);
  bench.edges.clear();
  bench.run(20 * TICK);
  uint64_t last_rise = 0;
  bool clock = true, data = true;
  int starts = 0, stops = 0;
  for (const pin_edge &edge : bench.edges) {
    const bool high = edge.level != NATIVE_LOW;
    if (edge.pin == PIN_COMPASS_SCL) {
      if (high) {
        CHECK(edge.cycle - last_rise >= 160);
        last_rise = edge.cycle;
      }
      clock = high;
    } else if (edge.pin == PIN_COMPASS_SDA && high != data) {
      starts += clock && !high;
      stops += clock && high;
      data = high;
    }
  }
  CHECK(starts == 2 * stops); /* start, repeated start, stop: nothing else moves while the clock is high */
  CHECK(stops >= 4);
}

TEST_CASE("a compass that is not there is reported, and found when it comes") {
  compass_bench bench;
  bench.device.plugged = false;
  bench.run(20 * TICK);
  CHECK(bench.devices().compass_status == COMPASS_STATUS_NO_ANSWER);
  CHECK(bench.devices().compass_age == 255);
  bench.field(11, 22, 33);
  bench.device.plugged = true;
  bench.run(15 * TICK);
  CHECK(bench.devices().compass_status == COMPASS_STATUS_OK);
  CHECK(bench.devices().compass_y == 22);
  bench.device.plugged = false; /* pulled out again: the reading grows old */
  bench.run(30 * TICK);
  CHECK(bench.devices().compass_status == COMPASS_STATUS_NO_ANSWER);
  CHECK(bench.devices().compass_age >= 20);
  bench.device.registers[0] = 0; /* it has lost its settings */
  bench.device.plugged = true;
  bench.run(15 * TICK);
  CHECK(bench.device.registers[0] == 0x78);
}

TEST_CASE("a device that holds the data line is clocked until it lets go") {
  for (int falls = 1; falls <= 9; falls++) {
    compass_bench bench;
    bench.field(5, 6, 7);
    bench.run(10 * TICK);
    bench.device.hold_data(falls);
    bool stuck = false;
    for (int tick = 0; tick < 60; tick++) {
      bench.run(TICK);
      stuck = stuck || bench.devices().compass_status == COMPASS_STATUS_BUS_STUCK;
    }
    CAPTURE(falls);
    CHECK(stuck);
    CHECK(bench.devices().compass_status == COMPASS_STATUS_OK);
    CHECK(bench.devices().compass_age <= 6);
  }
}

TEST_CASE("a clock that is held low stops nothing but the compass") {
  compass_bench bench;
  bench.run(10 * TICK);
  bench.drive(bench.machine.now, PIN_COMPASS_SCL, NATIVE_LOW);
  bench.run(200 * TICK);
  CHECK(bench.devices().compass_status == COMPASS_STATUS_BUS_STUCK);
  CHECK(bench.devices().compass_age >= 150);
  CHECK(bench.telemetry().overruns == 0);
  bench.drive(bench.machine.now, PIN_COMPASS_SCL, NATIVE_RELEASED);
  bench.run(60 * TICK);
  CHECK(bench.devices().compass_status == COMPASS_STATUS_OK);
}

TEST_CASE("switched off: no clock, no reading") {
  compass_bench bench;
  bench.run(10 * TICK);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_TURRET);
  bench.run(5 * TICK);
  bench.edges.clear();
  bench.run(20 * TICK);
  CHECK(bench.edges_of(PIN_COMPASS_SCL).empty());
  CHECK(bench.devices().compass_status == COMPASS_STATUS_OFF);
  CHECK(bench.devices().compass_age == 255);
}
