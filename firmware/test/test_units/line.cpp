/* Line sensors: decay times of three capacitors that fall at different times, to a microsecond. */
#include <doctest.h>

#include <array>
#include <cstdlib>
#include <limits>

#include "generated/parameters.h"
#include "native_bench.h"

#ifdef PIN_LINE_LEFT

namespace {

constexpr std::array<uint8_t, 3> PINS = {PIN_LINE_LEFT, PIN_LINE_MIDDLE, PIN_LINE_RIGHT};
constexpr double NEVER = std::numeric_limits<double>::infinity();

/* The capacitors: high while they are charged, low that many us after they are let go. */
class line_bench : public attended_bench {
 public:
  std::array<double, 3> us = {1000, 1000, 1000};

  line_bench() {
    answers_pin = [this](const pin_edge &edge) {
      for (size_t i = 0; i < PINS.size(); i++) {
        if (edge.pin == PINS[i]) {
          sensor(edge, us[i], charged_[i]);
        }
      }
    };
    set(PARAMETER_DEVICES, DEVICES_BUILT & ~DEVICES_COMPASS);
  }

  msg_line_telemetry line() const { return last(MSG_LINE_TELEMETRY_ID).as<msg_line_telemetry>(); }

 private:
  void sensor(const pin_edge &edge, double decay_us, bool &charged) {
    if (edge.level == NATIVE_HIGH) {
      charged = true;
      drive(edge.cycle, edge.pin, NATIVE_HIGH);
    } else if (charged) {
      charged = false;
      if (decay_us < NEVER) {
        drive(edge.cycle + static_cast<uint64_t>(decay_us * 16), edge.pin, NATIVE_LOW);
      }
    }
  }
  std::array<bool, 3> charged_{};
};

}  // namespace

TEST_CASE("decay times of three sensors in any order, and how old they are") {
  line_bench bench;
  const std::array<std::array<double, 3>, 5> cases = {
      {{200, 3000, 200}, {3000, 200, 210}, {210, 200, 3000}, {1, 5, 13990}, {4096, 8200, 2500}}};
  for (const auto &us : cases) {
    bench.us = us;
    bench.run(8 * TICK);
    CAPTURE(us[1]);
    CHECK(std::abs(bench.line().line_left - us[0]) <= 2);
    CHECK(std::abs(bench.line().line_middle - us[1]) <= 2);
    CHECK(std::abs(bench.line().line_right - us[2]) <= 2);
    CHECK(bench.line().line_age >= 1);
    CHECK(bench.line().line_age <= 2);
  }
}

TEST_CASE("sensors that fall at the same time have the same decay") {
  line_bench bench;
  bench.us = {777, 777, 777};
  bench.run(8 * TICK);
  CHECK(std::abs(bench.line().line_left - 777) <= 2);
  CHECK(bench.line().line_left == bench.line().line_middle);
  CHECK(bench.line().line_left == bench.line().line_right);
}

TEST_CASE("over nothing that reflects, the longest time, also where the line falls after it") {
  line_bench bench;
  bench.us = {NEVER, 14600, 20000}; /* collected 15 ms after the release */
  bench.run(12 * TICK);
  CHECK(bench.line().line_left == 14000);
  CHECK(bench.line().line_middle == 14000);
  CHECK(bench.line().line_right == 14000);
}

TEST_CASE("a sensor that falls at once has a decay of 1 us: 0 is no reading") {
  line_bench bench;
  bench.us = {0, 0, 0.4};
  bench.run(8 * TICK);
  CHECK(bench.line().line_left == 1);
  CHECK(bench.line().line_middle == 1);
  CHECK(bench.line().line_right == 1);
}

TEST_CASE("noise after the fall changes no reading") {
  line_bench bench;
  bench.us = {500, 1500, 2500};
  bench.run(6 * TICK);
  bench.edges.clear();
  bench.run(2 * TICK);
  for (const pin_edge &edge : bench.edges_of(PIN_LINE_LEFT)) {
    if (edge.level == NATIVE_HIGH) { /* charged; the next time in two ticks, let go a slot later */
      const uint64_t released = edge.cycle + 2 * TICK + SLOT;
      for (uint64_t i = 0; i < 20; i++) {
        bench.drive(released + 16 * (600 + 40 * i), PIN_LINE_LEFT, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
      }
    }
  }
  bench.run(2 * TICK);
  CHECK(std::abs(bench.line().line_left - 500) <= 2);
  CHECK(std::abs(bench.line().line_middle - 1500) <= 2);
  CHECK(std::abs(bench.line().line_right - 2500) <= 2);
}

TEST_CASE("each capacitor is charged for 2.5 ms, once in 20 ms") {
  line_bench bench;
  bench.run(10 * TICK);
  bench.edges.clear();
  bench.run(100 * TICK);
  for (uint8_t pin : PINS) {
    uint64_t high = 0, last = 0;
    int charges = 0;
    for (const pin_edge &edge : bench.edges_of(pin)) {
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
}

TEST_CASE("switched off: pulled up, no message; on again: readings") {
  line_bench bench;
  bench.run(9 * TICK);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO);
  bench.run(4 * TICK);
  for (uint8_t pin : PINS) {
    CHECK(bench.machine.output[pin] == NATIVE_PULLED_UP);
  }
  bench.edges.clear();
  const size_t before = bench.count(MSG_LINE_TELEMETRY_ID);
  bench.run(20 * TICK);
  CHECK(bench.edges_of(PIN_LINE_LEFT).empty());
  CHECK(bench.count(MSG_LINE_TELEMETRY_ID) == before);
  bench.us = {321, 321, 321};
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_LINE);
  bench.run(8 * TICK);
  CHECK(bench.count(MSG_LINE_TELEMETRY_ID) > before);
  CHECK(std::abs(bench.line().line_middle - 321) <= 2);
}

#endif
