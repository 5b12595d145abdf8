/* Motor signal or speed to servo pulse. */
#include <doctest.h>
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include <cstdlib>

#include "motion.h"

namespace {
constexpr int32_t CENTRE = 24000; /* 1500 us */
constexpr int16_t GAIN = 3200;    /* 200 us */
}  // namespace

TEST_CASE("signals give the pulses of the data sheet") {
  CHECK(motion_pulse(CENTRE, GAIN, 0) == 24000);
  CHECK(motion_pulse(CENTRE, GAIN, 10000) == 1700 * 16);
  CHECK(motion_pulse(CENTRE, GAIN, -10000) == 1300 * 16);
  CHECK(motion_pulse(CENTRE, GAIN, 5000) == 1600 * 16);
}

TEST_CASE("a mirrored servo turns the other way by as much") {
  for (int signal = -10000; signal <= 10000; signal += 7) {
    const auto s = static_cast<int16_t>(signal);
    CHECK(motion_pulse(CENTRE, GAIN, s) - CENTRE == CENTRE - motion_pulse(CENTRE, static_cast<int16_t>(-GAIN), s));
  }
}

TEST_CASE("trim moves the centre") {
  CHECK(motion_pulse(1486 * 16, GAIN, 0) == 1486 * 16);
  CHECK(motion_pulse(1486 * 16, GAIN, 2500) == 1536 * 16);
}

TEST_CASE("pulses stay within 1300 to 1700 us whatever the calibration") {
  for (int32_t centre : {22400, 24000, 25600}) {
    for (int gain : {-3200, -1, 0, 1, 3200}) {
      for (int32_t signal : {-10000, -1, 0, 1, 10000}) {
        const uint16_t pulse = motion_pulse(centre, static_cast<int16_t>(gain), static_cast<int16_t>(signal));
        CHECK(pulse >= MOTION_PULSE_MIN);
        CHECK(pulse <= MOTION_PULSE_MAX);
      }
    }
  }
}

TEST_CASE("pulses rise with the signal and are rounded to 0.6 of a cycle") {
  uint16_t before = motion_pulse(CENTRE, GAIN, -10000);
  for (int signal = -9999; signal <= 10000; signal++) {
    const uint16_t pulse = motion_pulse(CENTRE, GAIN, static_cast<int16_t>(signal));
    CHECK(pulse >= before);
    CHECK(std::abs((pulse - CENTRE) * 10000 - GAIN * signal) <= 6000); /* 0.6 of a cycle */
    before = pulse;
  }
}

TEST_CASE("speeds become signals, and too fast is full") {
  CHECK(motion_signal_of_speed(0, 1700) == 0);
  CHECK(motion_signal_of_speed(850, 1700) == 5000);
  CHECK(motion_signal_of_speed(-1700, 1700) == -10000);
  CHECK(motion_signal_of_speed(5000, 1700) == 10000);
  CHECK(motion_signal_of_speed(-5000, 100) == -10000);
}

TEST_CASE("signals of speeds are right to half a count, whatever the maximum") {
  for (int maximum = 100; maximum <= 5000; maximum += 7) {
    double worst = 0;
    for (int speed = -5000; speed <= 5000; speed += 3) {
      const double exact = std::max(-10000.0, std::min(10000.0, 10000.0 * speed / maximum));
      const auto is = motion_signal_of_speed(static_cast<int16_t>(speed), static_cast<int16_t>(maximum));
      worst = std::max(worst, std::abs(is - exact));
    }
    CHECK(worst <= 0.53);
  }
}
