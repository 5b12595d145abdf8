/* Motor signal or speed to servo pulse. */
extern "C" {
#include "motion.h"
}

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>

namespace {

constexpr uint16_t CENTRE = 24000; /* 1500 us */
constexpr int16_t GAIN = 3200;     /* 200 us */
constexpr int16_t FULL = 10000;    /* of a signal */

uint16_t pulse_of(int signal, int16_t gain = GAIN, uint16_t centre = CENTRE) {
  return motion_pulse(centre, gain, static_cast<int16_t>(signal), FULL);
}

}  // namespace

TEST_CASE("signals give the pulses of the data sheet") {
  CHECK(pulse_of(0) == 24000);
  CHECK(pulse_of(10000) == 1700 * 16);
  CHECK(pulse_of(-10000) == 1300 * 16);
  CHECK(pulse_of(5000) == 1600 * 16);
}

TEST_CASE("a mirrored servo turns the other way by as much") {
  for (int signal = -10000; signal <= 10000; signal += 7) {
    CHECK(pulse_of(signal) - CENTRE == CENTRE - pulse_of(signal, -GAIN));
  }
}

TEST_CASE("trim moves the centre") {
  CHECK(pulse_of(0, GAIN, 1486 * 16) == 1486 * 16);
  CHECK(pulse_of(2500, GAIN, 1486 * 16) == 1536 * 16);
}

TEST_CASE("pulses stay within 1300 to 1700 us whatever the calibration") {
  for (uint16_t centre : std::initializer_list<uint16_t>{22400, 24000, 25600}) {
    for (int16_t gain : std::initializer_list<int16_t>{-3200, -1, 0, 1, 3200}) {
      for (int signal : {-10000, -1, 0, 1, 10000}) {
        CHECK(pulse_of(signal, gain, centre) >= MOTION_PULSE_MIN);
        CHECK(pulse_of(signal, gain, centre) <= MOTION_PULSE_MAX);
      }
    }
  }
}

TEST_CASE("pulses rise with the signal and are rounded to the nearest cycle") {
  uint16_t before = pulse_of(-10000);
  for (int signal = -9999; signal <= 10000; signal++) {
    const uint16_t pulse = pulse_of(signal);
    CHECK(pulse >= before);
    CHECK(std::abs((pulse - CENTRE) * 10000 - GAIN * signal) <= 5000);
    before = pulse;
  }
}

TEST_CASE("speeds are parts of the full speed, to the nearest cycle; what is faster is full") {
  for (int full = 100; full <= 5000; full += 7) {
    double worst = 0;
    for (int speed = -5000; speed <= 5000; speed += 3) {
      const double exact = CENTRE + GAIN * std::max(-1.0, std::min(1.0, 1.0 * speed / full));
      const uint16_t pulse = motion_pulse(CENTRE, GAIN, static_cast<int16_t>(speed), static_cast<int16_t>(full));
      worst = std::max(worst, std::abs(pulse - exact));
    }
    CHECK(worst <= 0.5);
  }
}
