/* Encoders: steps of two lines, counts, periods and the limit. */
#include <doctest.h>

#include <random>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

#if ENCODER_LINES == 2
constexpr uint8_t LEFT_LINE = PIN_ENCODER_LEFT_A;
constexpr uint8_t RIGHT_LINE = PIN_ENCODER_RIGHT_A;
#else
constexpr uint8_t LEFT_LINE = PIN_ENCODER_LEFT;
constexpr uint8_t RIGHT_LINE = PIN_ENCODER_RIGHT;
#endif

/* Lines of which every edge counts, however soon after the one before. */
class encoder_bench : public attended_bench {
 public:
  encoder_bench() { set(PARAMETER_ENCODER_GAP, 0); }
};

/* Times are reported in 16 us; both edges' are rounded down to that. */
bool is_period(uint16_t reported, uint64_t cycles) { return reported == cycles / 256 || reported == cycles / 256 + 1; }

/* Toggles one line `count` times, `period` cycles apart, from `first` on. */
void toggle(native_bench &bench, uint8_t pin, uint64_t first, uint64_t period, int count) {
  for (int i = 0; i < count; i++) {
    bench.drive(first + static_cast<uint64_t>(i) * period, pin, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
  }
}

}  // namespace

#if ENCODER_LINES == 2
constexpr uint8_t FORWARD[4] = {0b00, 0b10, 0b11, 0b01}; /* (A, B) while the wheel turns forward */

TEST_CASE("a random walk of phases is counted exactly") {
  std::mt19937 random(3);
  encoder_bench bench;
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
  encoder_bench bench;
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
  encoder_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 10000, 1000);
  toggle(bench, RIGHT_LINE, bench.tick(1), 7000, 501);
  bench.run(70 * TICK);
  CHECK(bench.telemetry().encoder_left == 1000);
  CHECK(bench.telemetry().encoder_right == 501);
  CHECK(bench.telemetry().status == STATUS_LATCHED);
}

TEST_CASE("the count goes on beyond 16 bits") {
  encoder_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 2500, 70000);
  bench.run(1110 * TICK);
  CHECK(bench.telemetry().encoder_left == 70000);
}
#endif

TEST_CASE("the time between the last two edges, to 16 us") {
  for (uint64_t period : {300u, 2560u, 39999u, 40001u, 170000u, 1600000u, 7900000u}) {
    encoder_bench bench;
    toggle(bench, LEFT_LINE, bench.tick(1) + 12345, period, 3);
    bench.run_to(bench.tick(1) + 12345 + 2 * period + TICK);
    CAPTURE(period);
    CHECK(is_period(bench.telemetry().edge_period_left, period));
    CHECK(bench.telemetry().edge_period_right == 0);
  }
}

TEST_CASE("edges more than half a second apart have no period, nor has a wheel at rest") {
  encoder_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 8100000, 2);
  bench.run_to(bench.tick(1) + 8100000 + 2 * TICK);
  CHECK(bench.telemetry().edge_period_left == 0);

  encoder_bench moving;
  toggle(moving, LEFT_LINE, moving.tick(1), 100000, 10);
  moving.run_to(moving.tick(40));
  CHECK(is_period(moving.telemetry().edge_period_left, 100000));
  moving.run_to(moving.tick(60));
  CHECK(moving.telemetry().edge_period_left == 0);
}

TEST_CASE("after a long rest the first edge gives no period, whatever the clock's roll-over") {
  for (uint64_t rest : {10100000u, 10240000u, 10250000u, 20480100u}) {
    encoder_bench bench;
    toggle(bench, LEFT_LINE, bench.tick(1), rest, 2);
    bench.run_to(bench.tick(1) + rest + 2 * TICK);
    CAPTURE(rest);
    CHECK(bench.telemetry().edge_period_left == 0);
  }
}

TEST_CASE("a line that fires above its limit is masked until the tick ends, and reported") {
  encoder_bench bench;
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

TEST_CASE("the time across a gap is no period: switched off and on, and masked") {
  encoder_bench bench;
  toggle(bench, LEFT_LINE, bench.tick(1), 200000, 40);
  bench.run_to(bench.tick(6));
  CHECK(is_period(bench.telemetry().edge_period_left, 200000));
  bench.set(PARAMETER_DEVICES, 0);
  bench.run_to(bench.tick(18));
  CHECK(bench.telemetry().edge_period_left == 0);
  bench.set(PARAMETER_DEVICES, DEFAULT_DEVICES);
  for (uint64_t tick = 19; tick < 30; tick++) {
    bench.run_to(bench.tick(tick) + 1);
    const auto period = bench.telemetry().edge_period_left;
    CHECK((period == 0 || is_period(period, 200000)));
  }
  CHECK(is_period(bench.telemetry().edge_period_left, 200000));

  encoder_bench noisy;
  toggle(noisy, LEFT_LINE, noisy.tick(2) + 1000, 160, 500);
  toggle(noisy, LEFT_LINE, noisy.tick(5), 400000, 3);
  for (uint64_t tick = 3; tick < 10; tick++) {
    noisy.run_to(noisy.tick(tick) + 1);
    const auto period = noisy.telemetry().edge_period_left;
    CHECK((tick < 8 ? period == 0 : is_period(period, 400000)));
  }
  noisy.run_to(noisy.tick(11));
  CHECK(is_period(noisy.telemetry().edge_period_left, 400000));
}

TEST_CASE("a line at its limit is not masked") {
  encoder_bench bench;
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
  encoder_bench bench;
  bench.set(PARAMETER_DEVICES, 0);
  bench.run_to(bench.tick(2));
  toggle(bench, LEFT_LINE, bench.tick(2) + 100, 7000, 20);
  bench.run_to(bench.tick(5));
  CHECK(bench.telemetry().encoder_left == 0);
}
