/* Numbered requests: carried out once and in order, answered as often as they come. And clock probes. */
#include <doctest.h>

#include <random>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

/* A session that begins at tick 4. */
void begin(native_bench &bench) {
  bench.run_to(bench.tick(4));
  bench.open();
}

void set(native_bench &bench, uint16_t number, uint8_t parameter, int32_t value) {
  bench.say(MSG_SET_PARAMETER_ID, msg_set_parameter{number, parameter, value});
  bench.run(2 * MILLISECOND);
}

void get(native_bench &bench, uint16_t number, uint8_t parameter) {
  bench.say(MSG_GET_PARAMETER_ID, msg_get_parameter{number, parameter});
  bench.run(2 * MILLISECOND);
}

}  // namespace

TEST_CASE("the first request of a session has number 1; none has number 0") {
  native_bench bench;
  begin(bench);
  get(bench, 0, PARAMETER_TIME_TO_LIVE);
  get(bench, 2, PARAMETER_TIME_TO_LIVE);
  get(bench, 0xFFFF, PARAMETER_TIME_TO_LIVE);
  CHECK(bench.count(MSG_ANSWER_ID) == 0);
  get(bench, 1, PARAMETER_TIME_TO_LIVE);
  REQUIRE(bench.count(MSG_ANSWER_ID) == 1);
  CHECK(bench.answer().number == 1);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
  CHECK(bench.answer().value == 250);
  CHECK(bench.counters().refused == 3);
}

TEST_CASE("a copy of the last request is answered as before and not carried out again; others are dropped") {
  native_bench bench;
  begin(bench);
  set(bench, 1, PARAMETER_TIME_TO_LIVE, 100);
  set(bench, 2, PARAMETER_TIME_TO_LIVE, 200);
  set(bench, 2, PARAMETER_TIME_TO_LIVE, 300); /* the number counts, whatever else has changed */
  REQUIRE(bench.count(MSG_ANSWER_ID) == 3);
  CHECK(bench.answer().number == 2);
  CHECK(bench.answer().value == 200);
  set(bench, 1, PARAMETER_TIME_TO_LIVE, 300); /* the one before it */
  set(bench, 4, PARAMETER_TIME_TO_LIVE, 300); /* one left out */
  CHECK(bench.count(MSG_ANSWER_ID) == 3);
  get(bench, 3, PARAMETER_TIME_TO_LIVE);
  CHECK(bench.answer().number == 3);
  CHECK(bench.answer().value == 200);
  const msg_counters counters = bench.counters();
  CHECK(counters.duplicate == 1);
  CHECK(counters.refused == 2);
}

TEST_CASE("numbers go on across 65535, and 0 is then one of them") {
  native_bench bench;
  begin(bench);
  bench.acknowledges = true;
  uint16_t number = 1;
  for (uint32_t i = 1; i <= 65535 + 3; i++, number++) {
    bench.say(MSG_GET_PARAMETER_ID, msg_get_parameter{number, PARAMETER_RETRY_TIME});
    bench.run(MILLISECOND);
    REQUIRE(bench.answer().number == number);
    if (i % 64 == 0) {
      bench.messages.clear();
    }
  }
  CHECK(number == 3);
  bench.messages.clear();
  get(bench, 2, PARAMETER_RETRY_TIME);
  CHECK(bench.count(MSG_ANSWER_ID) == 1);
  get(bench, 1, PARAMETER_RETRY_TIME);
  CHECK(bench.count(MSG_ANSWER_ID) == 1);
}

TEST_CASE("arm is carried out once: a copy that comes after a stop does not arm again") {
  native_bench bench;
  begin(bench);
  bench.run(2 * TICK);
  const uint8_t latches = bench.telemetry().latches;
  bench.say(MSG_ARM_ID, msg_arm{1, latches});
  bench.run(2 * TICK);
  REQUIRE(bench.telemetry().latch == LATCH_NONE);
  bench.stop(1);
  bench.run(TICK);
  bench.say(MSG_ARM_ID, msg_arm{1, latches});
  bench.run(2 * TICK);
  CHECK(bench.answer().status == ANSWER_STATUS_OK); /* what it was answered then */
  CHECK(bench.telemetry().latch == LATCH_STOP_COMMAND);
}

TEST_CASE("a save is answered when it is done, copies meanwhile are silent, and a change is answered by busy") {
  native_bench bench;
  begin(bench);
  set(bench, 1, PARAMETER_TIME_TO_LIVE, 123);
  bench.messages.clear();
  bench.say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{2});
  bench.run(4 * TICK); /* 3.4 ms for each of its cells */
  CHECK(bench.count(MSG_ANSWER_ID) == 0);
  CHECK((bench.telemetry().status & STATUS_SAVING) != 0);
  bench.say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{2});
  bench.run(2 * TICK);
  CHECK(bench.count(MSG_ANSWER_ID) == 0);
  bench.run_in_session(60 * TICK);
  REQUIRE(bench.count(MSG_ANSWER_ID) == 1);
  CHECK(bench.answer().number == 2);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
  CHECK((bench.telemetry().status & STATUS_SAVING) == 0);
  bench.say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{2}); /* done: only answered again */
  bench.run(2 * TICK);
  CHECK(bench.count(MSG_ANSWER_ID) == 2);
  CHECK((bench.telemetry().status & STATUS_SAVING) == 0);
}

TEST_CASE("the request after a save is dropped until the save was answered, so that no answer is left out") {
  native_bench bench;
  begin(bench);
  bench.say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{1});
  bench.run(2 * TICK);
  get(bench, 2, PARAMETER_TIME_TO_LIVE);
  CHECK(bench.count(MSG_ANSWER_ID) == 0);
  bench.run_in_session(60 * TICK);
  REQUIRE(bench.count(MSG_ANSWER_ID) == 1);
  CHECK(bench.answer().number == 1);
  get(bench, 2, PARAMETER_TIME_TO_LIVE);
  CHECK(bench.answer().number == 2);
}

TEST_CASE(
    "a new session while a save goes on: nobody is answered for it, and changes are answered by busy until it is "
    "done") {
  native_bench bench;
  begin(bench);
  bench.say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{1});
  bench.run(2 * TICK);
  bench.open(99);
  bench.messages.clear();
  set(bench, 1, PARAMETER_TIME_TO_LIVE, 99);
  CHECK(bench.answer().status == ANSWER_STATUS_BUSY);
  bench.say(MSG_RESET_PARAMETERS_ID, msg_reset_parameters{2});
  bench.run(2 * MILLISECOND);
  CHECK(bench.answer().status == ANSWER_STATUS_BUSY);
  bench.say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{3});
  bench.run(2 * MILLISECOND);
  CHECK(bench.answer().status == ANSWER_STATUS_BUSY);
  get(bench, 4, PARAMETER_TIME_TO_LIVE);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
  CHECK(bench.answer().value == 250);
  bench.run_in_session(60 * TICK);
  CHECK(bench.count(MSG_ANSWER_ID) == 4);
  set(bench, 5, PARAMETER_TIME_TO_LIVE, 99);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
}

TEST_CASE("reset_parameters brings the defaults back; an unknown parameter and a value out of range are reported") {
  native_bench bench;
  begin(bench);
  set(bench, 1, PARAMETER_TIME_TO_LIVE, 123);
  bench.say(MSG_RESET_PARAMETERS_ID, msg_reset_parameters{2});
  bench.run(2 * MILLISECOND);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
  get(bench, 3, PARAMETER_TIME_TO_LIVE);
  CHECK(bench.answer().value == 250);
  get(bench, 4, PARAMETER_COUNT);
  CHECK(bench.answer().status == ANSWER_STATUS_UNKNOWN_PARAMETER);
  set(bench, 5, 255, 1);
  CHECK(bench.answer().status == ANSWER_STATUS_UNKNOWN_PARAMETER);
  set(bench, 6, PARAMETER_TIME_TO_LIVE, 2001);
  CHECK(bench.answer().status == ANSWER_STATUS_OUT_OF_RANGE);
  CHECK(bench.answer().value == 250);
}

TEST_CASE("requests at random, with copies and gaps, are carried out as a list of them would be") {
  std::mt19937 random(8);
  native_bench bench;
  begin(bench);
  uint16_t last = 0;
  int32_t value = 250;
  uint32_t answered = 0;
  for (int i = 0; i < 3000; i++) {
    const auto number = static_cast<uint16_t>(last + random() % 4 - 1);
    const auto wanted = static_cast<int32_t>(20 + random() % 2100);
    const bool next = number == static_cast<uint16_t>(last + 1);
    const bool copy = number == last && last != 0;
    if (next) {
      last = number;
      value = wanted <= 2000 ? wanted : value;
    }
    answered += next || copy;
    const size_t before = bench.count(MSG_ANSWER_ID);
    set(bench, number, PARAMETER_TIME_TO_LIVE, wanted);
    CHECK(bench.count(MSG_ANSWER_ID) == before + (next || copy));
    if (next || copy) {
      CHECK(bench.answer().number == number);
    }
    if (next) {
      CHECK(bench.answer().value == value);
    }
    bench.messages.clear();
  }
  REQUIRE(answered > 1000);
}

TEST_CASE("a clock probe is answered with the time of its work, to the microsecond") {
  native_bench bench;
  begin(bench);
  bench.set(PARAMETER_DEVICES, DEVICES_SERVO); /* without the Ping, whose trigger keeps the CPU for 5 us */
  bench.run(MILLISECOND);
  for (uint16_t i = 0; i < 300; i++) {
    const auto token = static_cast<uint16_t>(0xFF00 + 3 * i);
    bench.probe(token);
    const uint64_t worked = bench.machine.now + 10 * NATIVE_BYTE_CYCLES; /* when the frame's last byte is there */
    bench.run(MILLISECOND + 777 * i);
    const auto answer = bench.last(MSG_CLOCK_ANSWER_ID).as<msg_clock_answer>();
    CHECK(answer.token == token);
    CHECK(answer.time == (worked - bench.tick(0)) / 16);
  }
}

TEST_CASE("the board's time goes on across 2^32 us, in telemetry and in clock answers alike") {
  constexpr uint32_t FIRST = 429480;
  native_bench bench(RESET_CAUSE_POWER, 0, FIRST);
  begin(bench);
  const uint64_t zero = static_cast<uint64_t>(FIRST) * 10000;
  for (uint64_t tick = 5; tick < 40; tick++) {
    bench.run_to(bench.tick(tick) + 4321);
    CHECK(bench.telemetry().time == static_cast<uint32_t>(zero + 10000 * tick));
    bench.probe(1);
    const uint64_t worked = bench.machine.now + 10 * NATIVE_BYTE_CYCLES;
    bench.run(MILLISECOND);
    CHECK(bench.last(MSG_CLOCK_ANSWER_ID).as<msg_clock_answer>().time ==
          static_cast<uint32_t>(zero + (worked - bench.tick(0)) / 16));
  }
  REQUIRE(bench.telemetry().time < 1000000);
}
