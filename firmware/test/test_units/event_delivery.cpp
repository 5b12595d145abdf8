/* Events on the line: sent once each and in order, sent again until acknowledged; what a new session hears. */
#include <doctest.h>

#include <initializer_list>

extern "C" {
#include "events.h"
}
#include "generated/parameters.h"
#include "native_bench.h"

namespace {

void begin(native_bench &bench) {
  bench.run_to(bench.tick(4));
  bench.open();
  bench.run_to(bench.tick(6));
}

msg_event last_event(const native_bench &bench) { return bench.last(MSG_EVENT_ID).as<msg_event>(); }

void acknowledge(native_bench &bench, uint16_t number) {
  bench.say(MSG_ACKNOWLEDGE_ID, msg_acknowledge{number});
  bench.run(3 * SLOT);
}

/* The events in the order of their first sending. */
std::vector<msg_event> events_of(const native_bench &bench) {
  std::vector<msg_event> found;
  for (const message &m : bench.all(MSG_EVENT_ID)) {
    const auto one = m.as<msg_event>();
    if (found.empty() || found.back().number != one.number) {
      found.push_back(one);
    }
  }
  return found;
}

}  // namespace

TEST_CASE("a whisker's touch and its end are events, within 10 ms, with their time") {
  native_bench bench;
  begin(bench);
  bench.acknowledges = true;
  const uint64_t touch = bench.tick(10) + 1234, end = bench.tick(20) + 4321;
  bench.drive(touch, PIN_WHISKER_LEFT, NATIVE_LOW);
  bench.drive(end, PIN_WHISKER_LEFT, NATIVE_RELEASED);
  bench.run_to(bench.tick(30));
  const std::vector<msg_event> events = events_of(bench);
  REQUIRE(events.size() == 2);
  CHECK(events[0].number == 1);
  CHECK(events[0].kind == EVENT_KIND_WHISKERS);
  CHECK(events[0].value == (WHISKERS_LEFT | WHISKERS_LEFT << 8));
  CHECK(events[1].number == 2);
  CHECK(events[1].value == 0);
  const uint32_t touched_us = static_cast<uint32_t>((touch - bench.tick(0)) / 16);
  CHECK(events[0].time >= touched_us);
  CHECK(events[0].time <= touched_us + 5000);
  CHECK(bench.all(MSG_EVENT_ID)[0].cycle <= touch + 4 * SLOT); /* two samples, and every other slot a look */
}

TEST_CASE("arming, latching and the dead-man are events") {
  native_bench bench;
  bench.acknowledges = true;
  bench.start();
  bench.signal(5000, 5000, 50);
  const auto answered = static_cast<uint16_t>(bench.telemetry().tick);
  bench.run(10 * TICK);
  bench.stop(1);
  bench.run(5 * TICK);
  bench.stop(2); /* changes nothing */
  bench.run(5 * TICK);
  const std::vector<msg_event> events = events_of(bench);
  REQUIRE(events.size() == 3);
  CHECK(events[0].kind == EVENT_KIND_LATCH);
  CHECK(events[0].value == LATCH_NONE);
  CHECK(events[1].kind == EVENT_KIND_DEAD_MAN);
  CHECK(events[1].value == answered);
  CHECK(events[2].kind == EVENT_KIND_LATCH);
  CHECK(events[2].value == LATCH_STOP_COMMAND);
}

TEST_CASE("an event is sent again every retry_time until it is acknowledged, unchanged") {
  native_bench bench;
  begin(bench);
  events_raise(EVENT_KIND_WHISKERS, 0x0101);
  bench.run(30 * TICK);
  std::vector<message> all = bench.all(MSG_EVENT_ID);
  REQUIRE(all.size() >= 10);
  for (size_t i = 1; i < all.size(); i++) {
    CHECK(all[i].payload == all[0].payload);
    const uint64_t gap = all[i].cycle - all[i - 1].cycle; /* two ticks, 200 bytes, rounded up to the next look */
    CHECK(gap >= 24 * MILLISECOND);
    CHECK(gap <= 24 * MILLISECOND + 2 * SLOT);
  }
  acknowledge(bench, 1);
  const size_t count = bench.count(MSG_EVENT_ID);
  bench.run(20 * TICK);
  CHECK(bench.count(MSG_EVENT_ID) == count);
  CHECK(bench.counters().retransmitted == count - 1);
}

TEST_CASE("retry_time sets the time between two sendings") {
  native_bench bench;
  begin(bench);
  bench.set(PARAMETER_RETRY_TIME, 100);
  bench.run(MILLISECOND);
  events_raise(EVENT_KIND_WHISKERS, 0x0101);
  bench.run(60 * TICK);
  const std::vector<message> all = bench.all(MSG_EVENT_ID);
  REQUIRE(all.size() >= 5);
  for (size_t i = 1; i < all.size(); i++) {
    CHECK(all[i].cycle - all[i - 1].cycle == 100 * MILLISECOND);
  }
}

TEST_CASE("one event is under way; the next follows its acknowledgement, and no other number moves it") {
  native_bench bench;
  begin(bench);
  for (uint16_t value = 1; value <= 3; value++) {
    events_raise(EVENT_KIND_WHISKERS, value);
  }
  bench.run(3 * SLOT);
  CHECK(last_event(bench).number == 1);
  for (const uint16_t wrong : std::initializer_list<uint16_t>{0, 2, 3, 65535, 257}) {
    acknowledge(bench, wrong);
    CHECK(last_event(bench).number == 1);
  }
  for (uint16_t number = 1; number <= 3; number++) {
    CHECK(last_event(bench).number == number);
    CHECK(last_event(bench).value == number);
    acknowledge(bench, number);
    acknowledge(bench, number); /* a copy of the acknowledgement */
  }
  const size_t count = bench.count(MSG_EVENT_ID);
  bench.run(10 * TICK);
  CHECK(bench.count(MSG_EVENT_ID) == count);
}

TEST_CASE("an acknowledgement that comes before the event was sent moves nothing") {
  native_bench bench;
  begin(bench);
  acknowledge(bench, 1);
  events_raise(EVENT_KIND_WHISKERS, 7);
  bench.run(3 * SLOT);
  CHECK(last_event(bench).number == 1);
  CHECK(last_event(bench).value == 7);
}

TEST_CASE("numbers of events go on across 65535") {
  native_bench bench;
  begin(bench);
  bench.acknowledges = true;
  uint16_t expected = 1;
  for (uint32_t i = 0; i < 65536 + 5; i++, expected++) {
    events_raise(EVENT_KIND_WHISKERS, static_cast<uint16_t>(i & 0xFF));
    bench.run(2 * SLOT + MILLISECOND);
    REQUIRE(last_event(bench).number == expected);
    REQUIRE(last_event(bench).value == (i & 0xFF));
    if (i % 64 == 0) {
      bench.messages.clear();
    }
  }
  CHECK(expected == 6);
}

TEST_CASE("a retry is in time across the roll-over of the board's time") {
  native_bench bench(RESET_CAUSE_POWER, 0, 429488);
  begin(bench);
  events_raise(EVENT_KIND_WHISKERS, 1);
  bench.run(20 * TICK);
  const std::vector<message> all = bench.all(MSG_EVENT_ID);
  REQUIRE(bench.telemetry().time < 1000000);
  REQUIRE(all.size() >= 7);
  for (size_t i = 1; i < all.size(); i++) {
    CHECK(all[i].cycle - all[i - 1].cycle <= 24 * MILLISECOND + 2 * SLOT);
  }
}

TEST_CASE("what found no room in the queue is sent afterwards, and counted") {
  native_bench bench;
  begin(bench);
  for (uint16_t value = 1; value <= 9; value++) {
    events_raise(EVENT_KIND_DEAD_MAN, value);
  }
  bench.acknowledges = true;
  bench.run(20 * TICK);
  const std::vector<msg_event> events = events_of(bench);
  REQUIRE(events.size() == 5);
  CHECK(events[4].value == 9);
  CHECK(bench.counters().deferred == 5);
}

TEST_CASE("a new session hears of stops before it, not of touches, and numbers begin at 1") {
  native_bench bench;
  bench.run_to(bench.tick(4));
  events_raise(EVENT_KIND_WHISKERS, 1);
  events_raise(EVENT_KIND_DEAD_MAN, 2);
  bench.run(5 * TICK);
  CHECK(bench.count(MSG_EVENT_ID) == 0);
  for (uint32_t host : {77u, 78u}) { /* the second one takes the place of the first, which acknowledges nothing */
    bench.open(host);
    bench.run(5 * TICK);
    CHECK(last_event(bench).number == 1);
    CHECK(last_event(bench).kind == EVENT_KIND_DEAD_MAN);
    CHECK(last_event(bench).value == 2);
    events_raise(EVENT_KIND_WHISKERS, 3);
  }
  bench.acknowledges = true;
  bench.run(10 * TICK);
  CHECK(last_event(bench).number == 2);
  CHECK(last_event(bench).kind == EVENT_KIND_WHISKERS);
}
