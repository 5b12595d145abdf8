/* Buzzer: frequency and length of tones, tokens, what silences it, the beep at start. */
#include <doctest.h>

#include <cmath>
#include <initializer_list>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

class buzzer_bench : public native_bench {
 public:
  buzzer_bench() {
    run_to(tick(4));
    open();
    set(PARAMETER_DEVICES, DEVICES_BUILT & ~DEVICES_COMPASS);
    run_in_session(2 * TICK);
    edges.clear();
  }
  void tone(uint16_t frequency, uint8_t ticks, uint8_t token) {
    say(MSG_BUZZER_ID, msg_buzzer{frequency, ticks, token});
  }
};

bool is_silent(const native_bench &bench) {
  for (const pin_edge &edge : bench.edges_of(PIN_BUZZER)) {
    if (edge.level == NATIVE_HIGH) {
      return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("frequency within 2 %, length within a tick, and low afterwards") {
  buzzer_bench bench;
  uint8_t token = 1;
  for (const uint16_t frequency :
       std::initializer_list<uint16_t>{40, 50, 122, 123, 261, 440, 488, 489, 1000, 2093, 3906, 3907, 8000}) {
    bench.edges.clear();
    bench.tone(frequency, 20, token++);
    bench.run_in_session(30 * TICK);
    const auto edges = bench.edges_of(PIN_BUZZER);
    REQUIRE(edges.size() > 2);
    const double seconds = static_cast<double>(edges.back().cycle - edges.front().cycle) / 16e6;
    const double half_periods = static_cast<double>(edges[edges.size() - 2].cycle - edges.front().cycle) / 16e6 /
                                static_cast<double>(edges.size() - 2);
    CAPTURE(frequency);
    CHECK(std::fabs(0.5 / half_periods / frequency - 1.0) <= 0.02);
    CHECK(seconds <= 0.20);
    CHECK(seconds >= 0.19 - 2 * half_periods);
    CHECK(edges.back().level == NATIVE_LOW);
    CHECK(bench.devices().buzzer_token == static_cast<uint8_t>(token - 1));
  }
}

TEST_CASE("the same token again changes nothing, another one takes its place at once") {
  buzzer_bench bench;
  bench.tone(1000, 30, 9);
  bench.run_in_session(10 * TICK);
  for (int i = 0; i < 5; i++) {
    bench.tone(1000, 30, 9);
    bench.run_in_session(10 * TICK);
  }
  const auto edges = bench.edges_of(PIN_BUZZER);
  CHECK(std::fabs(static_cast<double>(edges.size()) - 600.0) <= 20.0); /* 0.3 s of 1 kHz, once */
  bench.tone(1000, 100, 10);
  bench.run_in_session(5 * TICK);
  bench.tone(0, 0, 11);
  bench.run_in_session(TICK);
  bench.edges.clear();
  bench.run_in_session(20 * TICK);
  CHECK(is_silent(bench));
  CHECK(bench.devices().buzzer_token == 11);
}

TEST_CASE("no such frequency, or switched off: refused") {
  buzzer_bench bench;
  bench.tone(39, 10, 1);
  bench.tone(8001, 10, 2);
  bench.tone(65535, 10, 3);
  bench.run_in_session(2 * TICK);
  CHECK(bench.devices().buzzer_token == 0);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_TURRET);
  bench.tone(1000, 10, 4);
  bench.run_in_session(2 * TICK);
  CHECK(is_silent(bench));
  CHECK(bench.counters().refused == 4);
}

TEST_CASE("a stop silences it, and so does the end of the host; a new session begins without a token") {
  buzzer_bench bench;
  bench.tone(1000, 250, 1);
  bench.run_in_session(3 * TICK);
  bench.stop(1);
  bench.run_in_session(2 * TICK);
  bench.edges.clear();
  bench.run_in_session(10 * TICK);
  CHECK(is_silent(bench));

  bench.tone(1000, 250, 2); /* 2.5 s; the session ends after 1 s */
  bench.run_in_session(TICK);
  bench.edges.clear();
  bench.run(300 * TICK);
  const auto edges = bench.edges_of(PIN_BUZZER);
  REQUIRE_FALSE(edges.empty());
  CHECK(bench.machine.now - edges.back().cycle > 150 * TICK);
  bench.open(0x54321);
  bench.run_in_session(5 * TICK);
  CHECK(bench.devices().buzzer_token == 0);
}

TEST_CASE("a beep at start is heard if the robot has it saved") {
  native_bench bench;
  bench.start();
  bench.edges.clear();
  bench.set(PARAMETER_DEVICES, DEVICES_BUILT & ~DEVICES_COMPASS);
  bench.set(PARAMETER_START_BEEP, 10);
  bench.run_in_session(3 * TICK);
  CHECK(is_silent(bench));
  bench.save();
  bench.run_in_session(60 * TICK);
  native_machine &machine = bench.machine;
  bench.edges.clear();
  firmware_board_api()->start(&machine, RESET_CAUSE_EXTERNAL); /* saved parameters outlive the reset */
  const uint64_t start = machine.now;
  bench.use_seed(FRAME_NO_SESSION);
  bench.run(20 * MILLISECOND);
  bench.open(0x777); /* opening a session does not cut it short */
  bench.run_in_session(30 * TICK);
  const auto edges = bench.edges_of(PIN_BUZZER);
  REQUIRE(edges.size() > 100);
  CHECK(edges.back().cycle - start <= 11 * TICK);
  CHECK(edges.back().cycle - start >= 9 * TICK);
}
