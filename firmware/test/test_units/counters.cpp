/* What the board counts and how long its tasks took, how often it says so, and how telemetry thins where the line is
 * slow. */
#include <doctest.h>

#include <initializer_list>

#include "generated/parameters.h"
extern "C" {
#include "link/counters.h"
#include "link/send.h"
#include "link/telemetry.h"
#include "task_times.h"
#include "tasks.h"
}
#include "native_bench.h"

namespace {

/* Ticks from one to the next. */
std::vector<uint64_t> gaps(const std::vector<message> &all) {
  std::vector<uint64_t> found;
  for (size_t i = 1; i < all.size(); i++) {
    found.push_back((all[i].cycle - all[i - 1].cycle) / TICK);
  }
  return found;
}

constexpr uint64_t TURN = 4;                        /* ticks from one message about the board itself to the next */
constexpr uint64_t ROUND = TURN * (TASK_COUNT + 1); /* each task's time, and the counters */

/* As if a task had run for these cycles. */
void ran(native_bench &bench, uint8_t task, uint32_t cycles) {
  task_begins(task);
  bench.machine.now += cycles;
  task_has_ended();
}

/* The time that the board sends of a task; waits for it. */
uint16_t task_time(native_bench &bench, uint8_t task) {
  bench.messages.clear();
  bench.run_in_session(ROUND * TICK);
  std::vector<uint16_t> found;
  for (const message &m : bench.all(MSG_TASK_TIME_ID)) {
    if (m.as<msg_task_time>().task == task) {
      found.push_back(m.as<msg_task_time>().longest);
    }
  }
  REQUIRE(found.size() == 1);
  return found[0];
}

/* As if the line had been started at that rate, in 100 bit/s. */
void line_of(uint16_t baud) {
  send_start(baud);
  telemetry_start_line();
}

}  // namespace

TEST_CASE("the counters are sent once in a round of all tasks in a session, and never without") {
  native_bench bench;
  bench.run(200 * TICK);
  CHECK(bench.count(MSG_COUNTERS_ID) == 0);
  CHECK(bench.count(MSG_TASK_TIME_ID) == 0);
  bench.open();
  bench.run_in_session(7 * ROUND * TICK);
  const std::vector<uint64_t> all = gaps(bench.all(MSG_COUNTERS_ID));
  REQUIRE(all.size() >= 6);
  for (uint64_t gap : all) {
    CHECK(gap == ROUND);
  }
}

TEST_CASE("the times of the tasks are sent one after another, the counters between the last and the first") {
  attended_bench bench;
  bench.run(3 * ROUND * TICK);
  std::vector<message> own;
  for (const message &m : bench.messages) {
    if (m.id == MSG_TASK_TIME_ID || m.id == MSG_COUNTERS_ID) {
      own.push_back(m);
    }
  }
  REQUIRE(own.size() >= 2 * (TASK_COUNT + 1));
  for (uint64_t gap : gaps(own)) {
    CHECK(gap == TURN);
  }
  const auto turn = [](const message &m) {
    return m.id == MSG_COUNTERS_ID ? static_cast<uint8_t>(TASK_COUNT) : m.as<msg_task_time>().task;
  };
  for (size_t i = 1; i < own.size(); i++) {
    CHECK(turn(own[i]) == (turn(own[i - 1]) + 1) % (TASK_COUNT + 1));
  }
}

TEST_CASE("the time of a task is that of its longest run of the session, and stays") {
  native_bench bench;
  bench.start();
  CHECK(task_time(bench, TASK_turret) == 0);
  ran(bench, TASK_turret, 1234);
  ran(bench, TASK_turret, 1233);
  ran(bench, TASK_whisker, 4321);
  CHECK(task_time(bench, TASK_turret) == 1234);
  CHECK(task_time(bench, TASK_turret) == 1234);
  ran(bench, TASK_turret, 1235);
  CHECK(task_time(bench, TASK_turret) == 1235);
  CHECK(task_time(bench, TASK_whisker) == 4321);
}

TEST_CASE("the longest times start anew with each session, also where it takes the place of another") {
  native_bench bench;
  bench.start();
  for (uint32_t nonce : {0x11111u, 0x22222u}) {
    ran(bench, TASK_turret, 1234);
    CHECK(task_time(bench, TASK_turret) == 1234);
    bench.run_in_session(20 * TICK); /* a hello with the next nonce */
    bench.open(nonce);
    CHECK(task_time(bench, TASK_turret) == 0);
  }
  ran(bench, TASK_turret, 1234);
  bench.run(2000 * MILLISECOND); /* silence ends the session */
  bench.open(0x33333);
  CHECK(task_time(bench, TASK_turret) == 0);
}

TEST_CASE("good frames, damaged ones and the finding back are counted") {
  native_bench bench;
  bench.start();
  const msg_counters before = bench.counters();
  for (int i = 0; i < 3; i++) {
    std::vector<uint8_t> damaged = bench.frame(MSG_STOP_ID, "x", 1);
    damaged[2] ^= 4;
    bench.send_bytes(damaged);
    bench.send_bytes(damaged);
    bench.stop(1);
    bench.stop(2);
    bench.run(TICK);
  }
  const size_t probes = bench.count(MSG_CLOCK_ANSWER_ID);
  const msg_counters after = bench.counters();
  CHECK(after.bad - before.bad == 6);
  CHECK(after.resynchronised - before.resynchronised == 3);
  CHECK(after.good - before.good >= 6);
  CHECK(after.good - before.good <= 6 + bench.count(MSG_CLOCK_ANSWER_ID) - probes + 20);
}

TEST_CASE("every counter goes on across 65535") {
  native_bench bench;
  bench.start();
  counters.late = counters.refused = counters.duplicate = 0xFFFF;
  bench.signal(0, 0, 2000, static_cast<uint16_t>(bench.telemetry().tick + 5)); /* late */
  bench.signal(10001, 0, 100);                                                 /* refused */
  bench.next_number--;
  bench.arm(9); /* the last request again */
  bench.run(TICK);
  const msg_counters after = bench.counters();
  CHECK(after.late == 0);
  CHECK(after.refused == 0);
  CHECK(after.duplicate == 0);
}

TEST_CASE("bytes that were lost are counted once a tick and reported in the next telemetry") {
  native_bench bench;
  bench.start();
  /* Waiting for the room of an answer keeps the ring's bytes where they are: more than it holds come meanwhile. */
  for (int i = 0; i < 70; i++) {
    bench.probe(1);
  }
  bench.run(6 * TICK);
  bool reported = false;
  for (const message &m : bench.all(MSG_TELEMETRY_ID)) {
    reported |= (m.as<msg_telemetry>().status & STATUS_RECEIVE_OVERRUN) != 0;
  }
  CHECK(reported);
  bench.run_in_session(40 * TICK);
  CHECK((bench.telemetry().status & STATUS_RECEIVE_OVERRUN) == 0);
  const uint16_t overrun = bench.counters().overrun;
  CHECK(overrun >= 1);
  CHECK(overrun <= 3);
}

TEST_CASE("a message left out for want of room takes a sequence number and is counted") {
  native_bench bench;
  bench.start();
  for (uint8_t i = 0; i < 30; i++) { /* 30 x 9 bytes at one instant: beside the telemetry the ring takes 8 */
    send_message(MSG_STOPPED_ID, &i, 1);
  }
  bench.run(TICK);
  const std::vector<message> all = bench.all(MSG_STOPPED_ID);
  const size_t sent = all.size();
  REQUIRE(sent >= 5);
  REQUIRE(sent < 30);
  const auto dropped = static_cast<uint16_t>(30 - sent);
  const message next = bench.last(MSG_TELEMETRY_ID);
  CHECK(static_cast<uint8_t>(next.sequence - all.back().sequence) == dropped + 1);
  CHECK(bench.counters().dropped == dropped);
}

TEST_CASE("telemetry fills half of the line at most, at every rate") {
  struct expectation {
    uint16_t baud;
    uint8_t period;
  };
  /* 46 bytes of 10 bits: 47.9 ms at 9600 baud, 24.0 at 19200, 12.0 at 38400, 8.0 at 57600, 4.0 at 115200 */
  for (const expectation &line : std::initializer_list<expectation>{
           {96, 10}, {192, 5}, {384, 5}, {576, 2}, {1152, 1}, {2500, 1}, {5000, 1}, {10000, 1}}) {
    native_bench bench;
    bench.run_to(bench.tick(4));
    line_of(line.baud);
    CAPTURE(line.baud);
    CHECK(telemetry_line_period() == line.period);
    CHECK(2.0 * (MSG_TELEMETRY_LENGTH + FRAME_OVERHEAD) * 10 / (line.baud * 100) <= 0.010 * line.period);
    bench.open();
    CHECK(bench.hello().telemetry_period == line.period);
    bench.run_in_session(100 * TICK);
    for (uint64_t gap : gaps(bench.all(MSG_TELEMETRY_ID))) {
      CHECK(gap == line.period);
    }
    bench.messages.clear();
    bench.run_in_session(3 * ROUND * line.period * TICK);
    const std::vector<uint64_t> all = gaps(bench.all(MSG_COUNTERS_ID));
    REQUIRE(all.size() >= 1);
    for (uint64_t gap : all) {
      CHECK(gap == ROUND * line.period);
    }
    const size_t own = TASK_COUNT * (MSG_TASK_TIME_LENGTH + FRAME_OVERHEAD) + MSG_COUNTERS_LENGTH + FRAME_OVERHEAD;
    CHECK(own * 10.0 / (line.baud * 100) <= 0.035 * 0.010 * ROUND * line.period); /* a small part of the line */
  }
}

TEST_CASE("the time of bytes on the line follows from its rate") {
  native_bench bench;
  line_of(96);
  CHECK(send_ticks(96) == 10); /* 100 ms */
  CHECK(send_ticks(97) == 11);
  CHECK(send_half_ms(96) == 200);
  line_of(5000);
  CHECK(send_ticks(500) == 1); /* 10 ms */
  CHECK(send_ticks(501) == 2);
  CHECK(send_half_ms(200) == 8);
  line_of(10000);
  CHECK(send_ticks(1) == 1);
  CHECK(send_half_ms(49) == 0); /* 0.49 ms */
  CHECK(send_half_ms(50) == 1);
}

TEST_CASE("the parameter makes telemetry rarer, never more frequent than the line allows") {
  native_bench bench;
  bench.run_to(bench.tick(4));
  line_of(192);
  bench.open();
  for (const uint8_t wanted : std::initializer_list<uint8_t>{1, 3, 5, 7, 100}) {
    bench.set(PARAMETER_TELEMETRY_PERIOD, wanted);
    bench.run_in_session(110 * TICK);
    bench.messages.clear();
    bench.run_in_session(400 * TICK);
    for (uint64_t gap : gaps(bench.all(MSG_TELEMETRY_ID))) {
      CHECK(gap == (wanted < 5 ? 5 : wanted));
    }
    CHECK(bench.count(MSG_TELEMETRY_ID) >= 4);
  }
}
