/* Changes of the pins of port C: storms, a full ring, pulses too short to be seen, and pins that are listened to again. What
 * comes of changes shows in the encoders' counts. */
extern "C" {
#include "pin_changes.h"
#include "hal/interrupts.h"
}

#include <doctest.h>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

#if ENCODER_LINES == 2
constexpr uint8_t LEFT_LINE = PIN_ENCODER_LEFT_A, RIGHT_LINE = PIN_ENCODER_RIGHT_A;
#else
constexpr uint8_t LEFT_LINE = PIN_ENCODER_LEFT, RIGHT_LINE = PIN_ENCODER_RIGHT;
#endif
constexpr uint8_t LEFT_BIT = 1u << (LEFT_LINE - 14);
constexpr uint16_t BOTH_MASKED = STATUS_ENCODER_LEFT_MASKED | STATUS_ENCODER_RIGHT_MASKED;

/* Lines whose every edge counts. */
class pins_bench : public attended_bench {
 public:
  pins_bench() {
    set(PARAMETER_ENCODER_GAP, 0);
    run_to(tick(1));
  }

  /* Toggles a line `count` times, `period` cycles apart, from `first` on. */
  void toggle(uint8_t pin, uint64_t first, uint64_t period, int count) {
    for (int i = 0; i < count; i++) {
      drive(first + static_cast<uint64_t>(i) * period, pin, i % 2 == 0 ? NATIVE_HIGH : NATIVE_LOW);
    }
  }

  /* The interrupt, `count` times, while the main loop does something else: with the left line's bit toggled each time, or
   * with the port as it is. */
  void interrupt(int count, uint64_t period, bool toggled) {
    for (int i = 0; i < count; i++) {
      machine.now += period;
      pin_changes_on_change(static_cast<uint16_t>(machine.now - tick(0) + SLOT), toggled && i % 2 == 0 ? LEFT_BIT : 0);
    }
  }

  /* STATUS_ENCODER_..._MASKED at the next tick's begin. */
  uint16_t masked_at(uint64_t number) {
    run_to(tick(number) + 1);
    return telemetry().status & BOTH_MASKED;
  }
};

}  // namespace

TEST_CASE("changes back to back are a storm: masked at once, the other wheel counts on") {
  pins_bench bench;
  const uint64_t start = bench.tick(2);
  bench.toggle(LEFT_LINE, start + 1000, 200, 750);  /* 80 kHz until the tick ends */
  bench.toggle(RIGHT_LINE, start + 1001, 3000, 50); /* a wheel that turns, in step with it */
  const uint64_t before = bench.machine.interrupts;
  bench.run_to(bench.tick(3) + 1);
  CHECK((bench.telemetry().status & STATUS_ENCODER_LEFT_MASKED) != 0);
  CHECK((bench.telemetry().status & STATUS_ENCODER_RIGHT_MASKED) == 0);
  CHECK(bench.telemetry().edge_period_left == 0);
  CHECK(bench.telemetry().edge_period_right >= 3000 / 256);
  CHECK(bench.telemetry().edge_period_right <= 3000 / 256 + 1);
  CHECK(bench.machine.interrupts - before < 300);
#if ENCODER_LINES == 1
  CHECK(bench.telemetry().encoder_left <= 8);
  CHECK(bench.telemetry().encoder_right == 50);
#endif
}

TEST_CASE("all lines changing at once is no storm") {
  pins_bench bench;
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

TEST_CASE("five changes in a row, each within 256 cycles of the one before, are a storm; less is none") {
  struct row {
    uint64_t period;
    int changes;
    bool is_storm;
  };
  for (const row &r : {row{255, 5, true}, row{256, 40, false}, row{100, 4, false}}) {
    pins_bench bench;
    bench.toggle(LEFT_LINE, bench.tick(2) + 1000, r.period, r.changes);
    bench.toggle(LEFT_LINE, bench.tick(2) + 70000, r.period, 4); /* a row begins anew after a pause */
    CAPTURE(r.period);
    CHECK(bench.masked_at(3) == (r.is_storm ? STATUS_ENCODER_LEFT_MASKED : 0));
  }
}

TEST_CASE("what the quiet line does while a storm has all masked is counted") {
  pins_bench bench;
  bench.run_to(bench.tick(2) + 1000);
  bench.interrupt(5, 100, true);
  CHECK(pin_changes_due());
  bench.drive(bench.machine.now + 10, RIGHT_LINE, NATIVE_HIGH); /* no interrupt comes with this one */
  bench.drive(bench.machine.now + 9000, RIGHT_LINE, NATIVE_LOW);
  CHECK(bench.masked_at(3) == STATUS_ENCODER_LEFT_MASKED);
  bench.drive(bench.tick(3) + 1000, LEFT_LINE, NATIVE_HIGH); /* listened to again */
  CHECK(bench.masked_at(4) == 0);
  CHECK(bench.telemetry().edge_period_right != 0);
#if ENCODER_LINES == 1
  CHECK(bench.telemetry().encoder_right == 2);
  CHECK(bench.telemetry().encoder_left == 5 + 1);
#endif
}

TEST_CASE("a full ring keeps what it has, and its line is noise") {
  pins_bench bench;
  bench.run_to(bench.tick(2) + 1000);
  bench.interrupt(64, 500, true); /* 63 wait at most */
  CHECK(bench.masked_at(3) == STATUS_ENCODER_LEFT_MASKED);
  CHECK(bench.masked_at(4) == 0);
#if ENCODER_LINES == 1
  CHECK(bench.telemetry().encoder_left == 63);
#endif
}

TEST_CASE("pulses too short to be seen, more than 40 in a slot: nobody knows whose, so all are masked") {
  for (const int count : {40, 41}) {
    pins_bench bench;
    bench.run_to(bench.tick(2) + 1000);
    bench.interrupt(count, 500, false);
    CHECK(bench.masked_at(3) == (count > 40 ? BOTH_MASKED : 0));
    bench.run_to(bench.tick(3) + 1000);
    bench.interrupt(30, 500, false);
    bench.run_to(bench.slot(4 * 3 + 1) + 1000);
    bench.interrupt(30, 500, false); /* in another slot */
    CHECK(bench.masked_at(4) == 0);
  }
}

#if ENCODER_LINES == 2
TEST_CASE("where both lines of a wheel have changed at once, nothing is known of its direction") {
  pins_bench bench;
  bench.run_to(bench.tick(2) + 1000);
  const uint8_t both = LEFT_BIT | 1u << (PIN_ENCODER_LEFT_B - 14);
  for (int i = 0; i < 10; i++) {
    bench.machine.now += 2000;
    pin_changes_on_change(static_cast<uint16_t>(bench.machine.now - bench.tick(0) + SLOT), i % 2 == 0 ? both : 0);
  }
  CHECK(bench.masked_at(3) == 0);
  CHECK(bench.telemetry().encoder_left == 0);
  CHECK(bench.telemetry().edge_period_left >= 2000 / 256);
  CHECK(bench.telemetry().edge_period_left <= 2000 / 256 + 1);
}
#endif
