/* Encoders: steps of two lines, counts, periods and the limit. */
#include <doctest.h>

#include <random>

#include "../native_bench.h"
#include "encoder.h"
#include "generated/parameters.h"

namespace {

#if ENCODER_LINES == 2
constexpr uint8_t LEFT_LINE = PIN_ENCODER_LEFT_A;
constexpr uint8_t RIGHT_LINE = PIN_ENCODER_RIGHT_A;
#else
constexpr uint8_t LEFT_LINE = PIN_ENCODER_LEFT;
constexpr uint8_t RIGHT_LINE = PIN_ENCODER_RIGHT;
#endif

/* (A, B) while the wheel turns forward. */
constexpr uint8_t FORWARD[4] = {0b00, 0b10, 0b11, 0b01};

/* Toggles one line `count` times, `period` cycles apart, from `first` on. */
void toggle(native_bench &bench, uint8_t pin, uint64_t first, uint64_t period, int count) {
  for (int i = 0; i < count; i++) {
    bench.drive(first + static_cast<uint64_t>(i) * period, pin, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
  }
}

}  // namespace

TEST_CASE("steps of two lines") {
  for (uint8_t i = 0; i < 4; i++) {
    const uint8_t here = FORWARD[i], next = FORWARD[(i + 1) % 4], opposite = FORWARD[(i + 2) % 4];
    CHECK(encoder_quadrature_step(here, next) == 1);
    CHECK(encoder_quadrature_step(next, here) == -1);
    CHECK(encoder_quadrature_step(here, here) == 0);
    CHECK(encoder_quadrature_step(here, opposite) == 0);
  }
}

#if ENCODER_LINES == 2
TEST_CASE("a random walk of phases is counted exactly") {
  std::mt19937 random(3);
  attended_bench bench;
  int phase = 0, turns = 0;
  uint64_t at = bench.tick(1);
  for (int step = 0; step < 4000; step++) {
    const int by = random() % 3 == 0 ? -1 : 1;
    turns += by;
    phase = (phase + by + 4) % 4;
    at += 3000 + random() % 9000;
    bench.drive(at, PIN_ENCODER_LEFT_A, (FORWARD[phase] & 2) != 0);
    bench.drive(at, PIN_ENCODER_LEFT_B, (FORWARD[phase] & 1) != 0);
    bench.drive(at + 7, PIN_ENCODER_RIGHT_A, (FORWARD[(4 - phase) % 4] & 2) != 0);
    bench.drive(at + 7, PIN_ENCODER_RIGHT_B, (FORWARD[(4 - phase) % 4] & 1) != 0);
    bench.run_to(at);
  }
  bench.run(3 * TICK);
  CHECK(bench.telemetry().encoder_left == turns);
  CHECK(bench.telemetry().encoder_right == -turns);
}

TEST_CASE("whatever edges a slot can bring are counted, though each line stays below its limit") {
  attended_bench bench;
  const uint64_t start = bench.tick(2) + 1000;
  constexpr int EDGES = 148; /* 74 of each line, 80 are allowed; no two are close */
  for (int i = 0; i < EDGES; i++) {
    const uint8_t phase = FORWARD[(i + 1) % 4];
    const uint64_t at = start + static_cast<uint64_t>(i) * 260;
    bench.drive(at, PIN_ENCODER_LEFT_A, (phase & 2) != 0);
    bench.drive(at, PIN_ENCODER_LEFT_B, (phase & 1) != 0);
  }
  bench.run_to(bench.tick(5));
  CHECK(bench.telemetry().encoder_left == EDGES);
  CHECK((bench.telemetry().status & STATUS_ENCODER_LEFT_MASKED) == 0);
}
#else
TEST_CASE("every edge counts up") {
  attended_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 10000, 1000);
  toggle(bench, RIGHT_LINE, bench.tick(1), 7000, 501);
  bench.run(70 * TICK);
  CHECK(bench.telemetry().encoder_left == 1000);
  CHECK(bench.telemetry().encoder_right == 501);
  CHECK(bench.telemetry().status == STATUS_LATCHED);
}

TEST_CASE("the count goes on beyond 16 bits") {
  attended_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 2500, 70000);
  bench.run(1110 * TICK);
  CHECK(bench.telemetry().encoder_left == 70000);
}
#endif

TEST_CASE("the time between the last two edges, to 16 us") {
  for (uint64_t period : {300u, 2560u, 39999u, 40001u, 170000u, 1600000u, 7900000u}) {
    attended_bench bench;
    toggle(bench, LEFT_LINE, bench.tick(1) + 12345, period, 3);
    bench.run_to(bench.tick(1) + 12345 + 2 * period + TICK);
    CAPTURE(period);
    CHECK(bench.telemetry().edge_period_left == period / 256);
    CHECK(bench.telemetry().edge_period_right == 0);
  }
}

TEST_CASE("edges more than half a second apart have no period, nor has a wheel at rest") {
  attended_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 8100000, 2);
  bench.run_to(bench.tick(1) + 8100000 + 2 * TICK);
  CHECK(bench.telemetry().edge_period_left == 0);

  attended_bench moving;
  toggle(moving, LEFT_LINE, moving.tick(1), 100000, 10);
  moving.run_to(moving.tick(40));
  CHECK(moving.telemetry().edge_period_left == 390);
  moving.run_to(moving.tick(60));
  CHECK(moving.telemetry().edge_period_left == 0);
}

TEST_CASE("after a long rest the first edge gives no period, whatever the clock's roll-over") {
  for (uint64_t rest : {10100000u, 10240000u, 10250000u, 20480100u}) {
    attended_bench bench;
    toggle(bench, LEFT_LINE, bench.tick(1), rest, 2);
    bench.run_to(bench.tick(1) + rest + 2 * TICK);
    CAPTURE(rest);
    CHECK(bench.telemetry().edge_period_left == 0);
  }
}

TEST_CASE("a line that fires above its limit is masked until the tick ends, and reported") {
  attended_bench bench;
  const uint64_t start = bench.tick(2);
  toggle(bench, LEFT_LINE, start + 100, 160, 3000);  /* 100 kHz for three ticks */
  toggle(bench, RIGHT_LINE, start + 100, 16000, 30); /* a wheel that turns */
  const uint64_t before = bench.machine.interrupts;
  bench.run_to(bench.tick(3) + 1);
  CHECK((bench.telemetry().status & STATUS_ENCODER_LEFT_MASKED) != 0);
  CHECK((bench.telemetry().status & STATUS_ENCODER_RIGHT_MASKED) == 0);
  CHECK(bench.machine.interrupts - before < 400);
  bench.run_to(bench.tick(10));
  CHECK((bench.telemetry().status & STATUS_ENCODER_LEFT_MASKED) == 0);
#if ENCODER_LINES == 1
  CHECK(bench.telemetry().encoder_left <= 3 * 81 + 3);
  CHECK(bench.telemetry().encoder_right == 30);
#endif
  CHECK(bench.telemetry().overruns == 0);
}

TEST_CASE("changes back to back are a storm: masked at once, the other wheel counts on") {
  attended_bench bench;
  const uint64_t start = bench.tick(2);
  toggle(bench, LEFT_LINE, start + 1000, 200, 750);  /* 80 kHz until the tick ends */
  toggle(bench, RIGHT_LINE, start + 1001, 3000, 50); /* a wheel that turns, in step with it */
  const uint64_t before = bench.machine.interrupts;
  bench.run_to(bench.tick(3) + 1);
  CHECK((bench.telemetry().status & STATUS_ENCODER_LEFT_MASKED) != 0);
  CHECK((bench.telemetry().status & STATUS_ENCODER_RIGHT_MASKED) == 0);
  CHECK(bench.telemetry().edge_period_left == 0);
  CHECK(bench.telemetry().edge_period_right == 3000 / 256);
  CHECK(bench.machine.interrupts - before < 300);
#if ENCODER_LINES == 1
  CHECK(bench.telemetry().encoder_left <= 8);
  CHECK(bench.telemetry().encoder_right == 50);
#endif
}

TEST_CASE("all lines changing at once is no storm") {
  attended_bench bench;
  for (uint64_t i = 0; i < 600; i++) {
    for (uint8_t pin = 14; pin < 18; pin++) {
      bench.drive(bench.tick(2) + 3000 * i + 60 * pin, pin, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
    }
  }
  for (int tick = 3; tick < 13; tick++) {
    bench.run_to(bench.tick(static_cast<uint64_t>(tick)) + 1);
    CHECK(bench.telemetry().status == STATUS_LATCHED);
  }
}

TEST_CASE("the time across a gap is no period: switched off and on, and masked") {
  attended_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 200000, 40);
  bench.run_to(bench.tick(6));
  CHECK(bench.telemetry().edge_period_left == 200000 / 256);
  bench.set(PARAMETER_DEVICES, 0);
  bench.run_to(bench.tick(18));
  CHECK(bench.telemetry().edge_period_left == 0);
  bench.set(PARAMETER_DEVICES, DEFAULT_DEVICES);
  for (uint64_t tick = 19; tick < 30; tick++) {
    bench.run_to(bench.tick(tick) + 1);
    const auto period = bench.telemetry().edge_period_left;
    CHECK((period == 0 || period == 200000 / 256));
  }
  CHECK(bench.telemetry().edge_period_left == 200000 / 256);

  attended_bench noisy;
  toggle(noisy, LEFT_LINE, noisy.tick(2) + 1000, 160, 500);
  toggle(noisy, LEFT_LINE, noisy.tick(5), 400000, 3);
  for (uint64_t tick = 3; tick < 10; tick++) {
    noisy.run_to(noisy.tick(tick) + 1);
    CHECK(noisy.telemetry().edge_period_left == (tick < 8 ? 0 : 400000 / 256));
  }
  noisy.run_to(noisy.tick(11));
  CHECK(noisy.telemetry().edge_period_left == 400000 / 256);
}

TEST_CASE("a line at its limit is not masked") {
  attended_bench bench;
  bench.set(PARAMETER_ENCODER_LIMIT, 20);
  bench.run_to(bench.tick(2));
  toggle(bench, LEFT_LINE, bench.tick(2) + 100, 7000, 20);
  bench.run_to(bench.tick(3) + 1);
  CHECK(bench.telemetry().status == STATUS_LATCHED);
  toggle(bench, LEFT_LINE, bench.tick(3) + 100, 7000, 21);
  bench.run_to(bench.tick(4) + 1);
  CHECK(bench.telemetry().status == (STATUS_LATCHED | STATUS_ENCODER_LEFT_MASKED));
}

TEST_CASE("switched off, encoders do not count") {
  attended_bench bench;
  bench.set(PARAMETER_DEVICES, 0);
  bench.run_to(bench.tick(2));
  toggle(bench, LEFT_LINE, bench.tick(2) + 100, 7000, 20);
  bench.run_to(bench.tick(5));
  CHECK(bench.telemetry().encoder_left == 0);
}
