/* The tick and what the board says in it: telemetry, garbage on the line, more requests than fit, cuts of a run. */
#include <doctest.h>

#include <random>

extern "C" {
#include "clock.h"
}
#include "generated/parameters.h"
#include "native_bench.h"

TEST_CASE("in a session one telemetry each tick, in order, with the tick's time") {
  native_bench bench;
  bench.start();
  bench.messages.clear();
  const uint64_t first = bench.ticks_begun();
  bench.run_in_session(1000 * TICK);
  uint64_t tick = first;
  uint8_t sequence = bench.messages[0].sequence;
  for (const message &m : bench.messages) {
    CHECK(m.sequence == sequence++);
    if (m.id == MSG_TELEMETRY_ID) {
      const auto telemetry = m.as<msg_telemetry>();
      CHECK(telemetry.tick == tick);
      CHECK(telemetry.time == 10000u * tick);
      CHECK(telemetry.overruns == 0);
      CHECK(m.cycle == bench.tick(tick));
      tick++;
    }
  }
  CHECK(tick == first + 1000);
}

TEST_CASE("ticks and time go on across the roll-over of 16 bits, of the time, and of the ticks themselves") {
  for (uint32_t first : {UINT32_C(0xFFF0), UINT32_C(429480), UINT32_C(0xFFFFFFF0)}) {
    native_bench bench(RESET_CAUSE_POWER, 0, first);
    bench.start();
    bench.messages.clear();
    bench.run_in_session(40 * TICK);
    const std::vector<message> all = bench.all(MSG_TELEMETRY_ID);
    REQUIRE(all.size() == 40);
    for (const message &m : all) {
      const auto telemetry = m.as<msg_telemetry>();
      CHECK(m.cycle == bench.tick(telemetry.tick - first));
      CHECK(telemetry.time == static_cast<uint32_t>(telemetry.tick * UINT64_C(10000)));
    }
  }
}

TEST_CASE("a watchdog reset shows in the status") {
  for (uint8_t cause : {RESET_CAUSE_POWER, RESET_CAUSE_WATCHDOG}) {
    native_bench bench(cause);
    bench.start();
    CHECK(((bench.telemetry().status & STATUS_WATCHDOG_RESET) != 0) == (cause == RESET_CAUSE_WATCHDOG));
  }
}

TEST_CASE("the supply is in the telemetry once it was measured") {
  native_bench bench;
  bench.start();
  CHECK(bench.telemetry().supply > 4900);
  CHECK(bench.telemetry().supply < 5100);
}

TEST_CASE("garbage on the line is survived and counted, and the next frame is heard") {
  std::mt19937 random(4);
  native_bench bench;
  bench.start();
  for (int i = 0; i < 200; i++) {
    std::vector<uint8_t> noise(random() % 400);
    for (uint8_t &byte : noise) {
      byte = static_cast<uint8_t>(random());
    }
    bench.send_bytes(noise);
    bench.run(TICK);
    bench.probe(1);
  }
  CHECK(bench.telemetry().overruns == 0);
  CHECK(bench.telemetry().pulse_left == 0);
  bench.run(TICK);
  bench.signal(5000, 5000, 500);
  bench.run(4 * TICK);
  CHECK((bench.telemetry().status & STATUS_MOTORS_ENABLED) != 0);
  CHECK(bench.counters().bad > 150);
}

TEST_CASE("more requests than the line can answer wait; none is lost") {
  native_bench bench;
  bench.start();
  bench.messages.clear();
  for (uint8_t i = 0; i < 20; i++) { /* 220 bytes in, 300 out, besides telemetry */
    bench.get(i % PARAMETER_COUNT);
  }
  bench.run(2 * TICK);
  CHECK(bench.count(MSG_ANSWER_ID) == 20);
  CHECK((bench.telemetry().status & STATUS_RECEIVE_OVERRUN) == 0);
}

TEST_CASE("requests beyond what the line can carry do not silence telemetry, nor hold up a set-point before them") {
  native_bench bench;
  bench.start();
  bench.messages.clear();
  const uint64_t first = bench.ticks_begun();
  for (uint64_t tick = first; tick < first + 20; tick++) {
    bench.signal(static_cast<int16_t>(tick), 0, 250, static_cast<uint16_t>(tick - 1));
    for (int i = 0; i < 20; i++) { /* 20 x 68 bytes out: three times the line */
      bench.send(MSG_IDENTIFY_ID);
    }
    bench.run_to(bench.tick(tick));
  }
  uint64_t expected = first;
  for (const message &m : bench.all(MSG_TELEMETRY_ID)) {
    CHECK(m.as<msg_telemetry>().tick == expected++);
  }
  CHECK(expected == first + 20);
}

TEST_CASE("bytes without an end of frame never block the line") {
  native_bench bench;
  bench.start();
  for (int i = 0; i < 20; i++) {
    bench.send_bytes(std::vector<uint8_t>(200, 0x55));
    bench.run(TICK);
  }
  bench.send_bytes({0});
  bench.signal(5000, 5000, 500);
  bench.run(4 * TICK);
  CHECK((bench.telemetry().status & STATUS_MOTORS_ENABLED) != 0);
}

TEST_CASE("messages meant for the host are refused") {
  native_bench bench;
  bench.start();
  bench.say(MSG_ANSWER_ID, msg_answer{1, 2, 0});
  bench.say(MSG_EVENT_ID, msg_event{1, 0, 0, 0});
  bench.run(2 * TICK);
  CHECK(bench.counters().bad == 2);
}

TEST_CASE("a run does not depend on how it is cut, nor on when it began") {
  std::vector<pin_edge> edges[3];
  std::vector<message> messages[3];
  for (int kind = 0; kind < 3; kind++) {
    const uint64_t start = kind == 2 ? UINT64_C(0x1FFFFFF00) : 0; /* beyond 32 bits */
    native_bench bench(RESET_CAUSE_POWER, start);
    std::mt19937 random(5);
    for (uint64_t i = 1; i < 300; i++) {
      bench.drive(bench.tick(1) + 7001 * i, 16, i % 2 != 0);
    }
    bench.start();
    bench.signal(2500, 5000, 100);
    while (bench.machine.now < bench.tick(20)) {
      bench.run_to(kind == 1 ? bench.machine.now + 1 + random() % 5000 : bench.tick(20));
    }
    for (pin_edge edge : bench.edges) {
      edge.cycle -= start;
      edges[kind].push_back(edge);
    }
    messages[kind] = bench.messages;
  }
  for (int kind = 1; kind < 3; kind++) {
    REQUIRE(edges[kind].size() == edges[0].size());
    for (size_t i = 0; i < edges[0].size(); i++) {
      CHECK(edges[kind][i].cycle == edges[0][i].cycle);
      CHECK(edges[kind][i].level == edges[0][i].level);
    }
    REQUIRE(messages[kind].size() == messages[0].size());
    for (size_t i = 0; i < messages[0].size(); i++) {
      CHECK(messages[kind][i].payload == messages[0][i].payload);
    }
  }
}

TEST_CASE("a stamp of 16 bits becomes the board's cycles, from just before the slot's begin to its end") {
  native_bench bench;
  for (const uint64_t slot : {0u, 1u, 2u, 3u, 250u, 107374u}) { /* in the last one 32 bits roll over */
    bench.run_to(bench.slot(slot));
    for (const int64_t beside : {-16000, -1, 0, 1, 7, 39999}) {
      const uint64_t since_start = (slot + 1) * SLOT + static_cast<uint64_t>(beside);
      CAPTURE(slot);
      CAPTURE(beside);
      CHECK(clock_cycles_at(static_cast<uint16_t>(since_start)) == static_cast<uint32_t>(since_start));
    }
  }
}
