/* Light sensors: decay times on both sides, to a microsecond, beside encoders that go on counting. */
#include <doctest.h>

#include <cstdlib>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

/* The capacitors: high while they are charged, low that many us after they are let go; negative: never. */
class light_bench : public attended_bench {
 public:
  double left_us = 1000, right_us = 1000;

  light_bench() {
    answers_pin = [this](const pin_edge &edge) {
#ifdef PIN_LIGHT_LEFT
      sensor(edge, PIN_LIGHT_LEFT, left_us, left_charged_);
#endif
      sensor(edge, PIN_LIGHT_RIGHT, right_us, right_charged_);
    };
    set(PARAMETER_DEVICES, DEVICES_BUILT & ~DEVICES_COMPASS);
    set(PARAMETER_ENCODER_GAP, 0);
  }

 private:
  void sensor(const pin_edge &edge, uint8_t pin, double us, bool &charged) {
    if (edge.pin != pin) {
      return;
    }
    if (edge.level == NATIVE_HIGH) {
      charged = true;
      drive(edge.cycle, pin, NATIVE_HIGH);
    } else if (charged) {
      charged = false;
      if (us >= 0) {
        drive(edge.cycle + static_cast<uint64_t>(us * 16), pin, NATIVE_LOW);
      }
    }
  }
  bool left_charged_ = false, right_charged_ = false;
};

}  // namespace

TEST_CASE("decay times of both sides, and how old they are") {
  light_bench bench;
  for (double us : {1.0, 7.0, 150.0, 999.0, 2500.0, 4096.0, 4100.0, 8200.0, 13990.0}) {
    bench.left_us = us;
    bench.right_us = 14000.0 - us;
    bench.run(8 * TICK);
    CAPTURE(us);
#ifdef PIN_LIGHT_LEFT
    CHECK(std::abs(bench.devices().light_left - us) <= 2);
#endif
    CHECK(std::abs(bench.devices().light_right - (14000.0 - us)) <= 2);
    CHECK(bench.devices().light_age >= 1);
    CHECK(bench.devices().light_age <= 2);
  }
}

TEST_CASE("in the dark the longest time, also where the next reading has begun") {
  light_bench bench;
  bench.left_us = -1;
  bench.right_us = 20000;
  bench.run(12 * TICK);
#ifdef PIN_LIGHT_LEFT
  CHECK(bench.devices().light_left == 14000);
#endif
  CHECK(bench.devices().light_right == 14000);

  bench.left_us = bench.right_us = 14600; /* falls after the longest time, collected 15 ms after the release */
  bench.run(8 * TICK);
#ifdef PIN_LIGHT_LEFT
  CHECK(bench.devices().light_left == 14000);
#endif
  CHECK(bench.devices().light_right == 14000);
}

TEST_CASE("each capacitor is charged for 2.5 ms, once in 20 ms") {
  light_bench bench;
  bench.run(10 * TICK);
  bench.edges.clear();
  bench.run(100 * TICK);
  uint64_t high = 0, last = 0;
  int charges = 0;
  for (const pin_edge &edge : bench.edges_of(PIN_LIGHT_RIGHT)) {
    if (edge.level == NATIVE_HIGH) {
      CHECK((last == 0 || edge.cycle - last == 2 * TICK));
      high = last = edge.cycle;
      charges++;
    } else if (high != 0) {
      CHECK(edge.cycle - high == SLOT);
      high = 0;
    }
  }
  CHECK(charges == 50);
}

#if ENCODER_LINES == 1
TEST_CASE("encoders beside it miss no edge and count none of the sensor's") {
  light_bench bench;
  bench.run(4 * TICK);
  const int32_t before = bench.telemetry().encoder_left;
  const uint64_t start = bench.machine.now + 1000;
  for (int i = 0; i < 2000; i++) {
    bench.drive(start + static_cast<uint64_t>(i) * 3331, PIN_ENCODER_LEFT, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
  }
  for (int i = 0; i < 42; i++) {
    bench.left_us = 100.0 + 300.0 * i;
    bench.run(TICK);
  }
  bench.run(6 * TICK);
  CHECK(bench.telemetry().encoder_left - before == 2000);
  CHECK(bench.telemetry().encoder_right == 0);
  CHECK(std::abs(bench.devices().light_left - (100.0 + 300.0 * 41)) <= 2);
}

TEST_CASE("noise on its line masks no encoder") {
  light_bench bench;
  bench.left_us = -1;
  bench.run(4 * TICK);
  const int32_t before = bench.telemetry().encoder_left;
  const uint64_t start = bench.machine.now + 1000;
  const int edges = 400;
  for (int i = 0; i < edges; i++) {
    bench.drive(start + static_cast<uint64_t>(i) * 16000, PIN_ENCODER_LEFT, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
  }
  for (uint64_t i = 0; i < 40 * TICK / 80; i++) { /* 100 kHz */
    bench.drive(start + 80 * i, PIN_LIGHT_LEFT, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
  }
  for (int i = 0; i < 42; i++) {
    bench.run(TICK);
    CHECK((bench.telemetry().status & (STATUS_ENCODER_LEFT_MASKED | STATUS_ENCODER_RIGHT_MASKED)) == 0);
  }
  CHECK(bench.telemetry().encoder_left - before == edges);
}
#endif

TEST_CASE("switched off: pulled up, no reading") {
  light_bench bench;
  bench.run(9 * TICK);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_TURRET);
  bench.run(4 * TICK);
  CHECK(bench.machine.output[PIN_LIGHT_RIGHT] == NATIVE_PULLED_UP);
  bench.edges.clear();
  bench.run(20 * TICK);
  CHECK(bench.edges_of(PIN_LIGHT_RIGHT).empty());
  CHECK(bench.devices().light_right == 0);
  CHECK(bench.devices().light_age == 255);
}
