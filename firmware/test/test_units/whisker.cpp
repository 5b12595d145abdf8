/* Whiskers: debouncing alone, then at the pins of the whole firmware. */
#include <doctest.h>

#include <vector>

#include "native_bench.h"
extern "C" {
#include "whisker.h"
}

TEST_CASE("one sample is not a touch, two are") {
  whisker_state state{false, 0};
  CHECK_FALSE(whisker_debounce(&state, true));
  CHECK_FALSE(whisker_debounce(&state, false));
  CHECK_FALSE(whisker_debounce(&state, true));
  CHECK(whisker_debounce(&state, true));
}

TEST_CASE("a touch ends after four samples without it") {
  whisker_state state{true, 0};
  for (bool touching : {false, false, false, true, false, false, false}) {
    CHECK(whisker_debounce(&state, touching));
  }
  CHECK_FALSE(whisker_debounce(&state, false));
}

TEST_CASE("a bouncing touch is one touch") {
  whisker_state state{false, 0};
  std::vector<bool> samples{true, true, false, true, false, false, true, true, true, true};
  int changes = 0;
  bool before = false;
  for (bool touching : samples) {
    const bool now = whisker_debounce(&state, touching);
    changes += now != before;
    before = now;
  }
  CHECK(changes == 1);
  CHECK(before);
}

TEST_CASE("touch and release are in the telemetry within two ticks, at any phase") {
  for (uint64_t phase = 0; phase < TICK; phase += 997) {
    attended_bench bench;
    bench.drive(0, PIN_WHISKER_LEFT, NATIVE_HIGH);
    bench.drive(0, PIN_WHISKER_RIGHT, NATIVE_HIGH);
    const uint64_t touch = bench.tick(3) + 1 + phase; /* in tick 3 */
    const uint64_t release = touch + 10 * TICK;
    bench.drive(touch, PIN_WHISKER_RIGHT, NATIVE_LOW);
    bench.drive(release, PIN_WHISKER_RIGHT, NATIVE_HIGH);
    bench.run_to(touch);
    CHECK(bench.telemetry().whiskers == 0);
    bench.run_to(bench.tick(5) + 1);
    CHECK(bench.telemetry().tick == 5);
    CHECK(bench.telemetry().whiskers == WHISKERS_RIGHT);
    bench.run_to(bench.tick(13));
    CHECK(bench.telemetry().whiskers == WHISKERS_RIGHT);
    bench.run_to(bench.tick(15) + 1);
    CHECK(bench.telemetry().whiskers == 0);
  }
}

TEST_CASE("a free whisker pin is pulled up: no touch") {
  attended_bench bench;
  bench.run(10 * TICK);
  CHECK(bench.telemetry().whiskers == 0);
  CHECK(bench.machine.output[PIN_WHISKER_LEFT] == NATIVE_PULLED_UP);
}

TEST_CASE("switched off, whiskers are silent") {
  attended_bench bench;
  bench.drive(0, PIN_WHISKER_LEFT, NATIVE_LOW);
  bench.run(5 * TICK);
  CHECK(bench.telemetry().whiskers == WHISKERS_LEFT);
  bench.set(0, static_cast<int32_t>(DEVICES_SERVO));
  bench.run(3 * TICK);
  CHECK(bench.telemetry().whiskers == 0);
}
