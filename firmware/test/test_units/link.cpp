/* What comes over a line that is too full: reception stops when its ring is full, and goes on with the next whole frame. */
#include <doctest.h>

extern "C" {
#include "hal/hal.h"
}
#include "native_bench.h"

namespace {

/* Sends probes, back to back: their answers are longer than they, so the line out cannot carry them all. Runs until
 * reception has stopped. */
void fill(native_bench &bench, uint16_t probes) {
  for (uint16_t token = 1; token <= probes; token++) {
    bench.probe(token);
  }
  for (int i = 0; i < 300 && !hal_serial_stopped(); i++) {
    bench.run(10 * NATIVE_BYTE_CYCLES);
  }
  REQUIRE(hal_serial_stopped());
}

std::vector<uint16_t> answered(const native_bench &bench) {
  std::vector<uint16_t> tokens;
  for (const message &m : bench.all(MSG_CLOCK_ANSWER_ID)) {
    tokens.push_back(m.as<msg_clock_answer>().token);
  }
  return tokens;
}

}  // namespace

TEST_CASE("what does not fit is dropped as whole frames: no damaged one is counted, and the next is heard") {
  native_bench bench;
  bench.start();
  const msg_counters before = bench.counters();
  bench.messages.clear();
  fill(bench, 60);
  bench.run(10 * TICK);
  CHECK_FALSE(hal_serial_stopped());
  const std::vector<uint16_t> tokens = answered(bench);
  REQUIRE(tokens.size() >= 30);
  REQUIRE(tokens.size() < 60);
  for (size_t i = 1; i < tokens.size(); i++) {
    CHECK(tokens[i] > tokens[i - 1]);
  }
  bench.probe(1000);
  bench.run(TICK);
  CHECK(answered(bench).back() == 1000);
  const msg_counters after = bench.counters();
  CHECK(after.bad == before.bad);
  CHECK(after.overrun == before.overrun + 1);
}

TEST_CASE("a line that stays full is heard again and again, and telemetry goes on") {
  native_bench bench;
  bench.start();
  const msg_counters before = bench.counters();
  bench.messages.clear();
  fill(bench, 500); /* 10 ticks of bytes */
  bench.run(12 * TICK);
  CHECK(bench.count(MSG_TELEMETRY_ID) >= 12);
  CHECK(answered(bench).size() >= 250); /* most of what the line out carries beside the telemetry */
  CHECK(answered(bench).size() < 500);
  const msg_counters after = bench.counters();
  CHECK(after.bad == before.bad);
  CHECK(after.overrun >= before.overrun + 3);
}

TEST_CASE("a stop that was dropped with the rest is obeyed when it is said again") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  bench.run(4 * TICK);
  fill(bench, 60);
  for (uint8_t token = 1; token < 200 && bench.count(MSG_STOPPED_ID) == 0; token++) {
    bench.stop(token);
    bench.run(MILLISECOND);
  }
  CHECK(bench.last(MSG_STOPPED_ID).as<msg_stopped>().token > 1); /* the first ones were dropped */
  bench.run(TICK);
  CHECK(bench.telemetry().latch == LATCH_STOP_COMMAND);
}
