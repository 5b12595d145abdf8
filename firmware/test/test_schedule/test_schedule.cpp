/* The tick and what the board says: telemetry each tick, hello, identity, garbage on the line, cuts of a run. */
#include <doctest.h>

#include <random>
#include <string>

#include "../native_bench.h"
#include "generated/parameters.h"
#include "schedule.h"

TEST_CASE("after a reset the board says hello first, with the cause") {
  for (uint8_t cause : {RESET_CAUSE_POWER, RESET_CAUSE_EXTERNAL, RESET_CAUSE_WATCHDOG}) {
    native_bench bench(cause);
    bench.run(3 * TICK);
    REQUIRE(bench.messages.size() >= 2);
    REQUIRE(bench.messages[0].id == MSG_HELLO_ID);
    const auto hello = bench.messages[0].as<msg_hello>();
    CHECK(hello.protocol_version == PROTOCOL_VERSION);
    CHECK(hello.schema_hash == SCHEMA_HASH);
    CHECK(hello.tick_rate == 100);
    CHECK(hello.devices == DEFAULT_DEVICES);
    CHECK(hello.reset_cause == cause);
    CHECK(std::string(hello.pin_map, strnlen(hello.pin_map, 16)) == PIN_MAP_NAME);
    const bool watchdog = (bench.telemetry().status & STATUS_WATCHDOG_RESET) != 0;
    CHECK(watchdog == (cause == RESET_CAUSE_WATCHDOG));
  }
}

TEST_CASE("one telemetry each tick, in order, with the tick's time") {
  native_bench bench;
  bench.run(1000 * TICK + SLOT + 1);
  uint32_t tick = 0;
  uint8_t sequence = 0;
  for (const message &m : bench.messages) {
    CHECK(m.sequence == sequence++);
    if (m.id == MSG_TELEMETRY_ID) {
      const auto telemetry = m.as<msg_telemetry>();
      CHECK(telemetry.tick == tick);
      CHECK(telemetry.time == 10000u * tick);
      CHECK(telemetry.overruns == 0);
      tick++;
    }
  }
  CHECK(tick == 1001);
}

TEST_CASE("identity names version and compiler") {
  native_bench bench;
  bench.send(MSG_IDENTIFY_ID);
  bench.run(TICK);
  const auto identity = bench.last(MSG_IDENTITY_ID).as<msg_identity>();
  CHECK(std::string(identity.firmware_version, strnlen(identity.firmware_version, 12)).size() > 0);
  CHECK(std::string(identity.compiler, strnlen(identity.compiler, 24)).find(' ') != std::string::npos);
  CHECK(identity.image_size == 0);
}

TEST_CASE("hello on request") {
  native_bench bench;
  bench.run(5 * TICK);
  bench.messages.clear();
  const uint8_t version = PROTOCOL_VERSION;
  bench.send(MSG_HELLO_REQUEST_ID, &version, 1);
  bench.run(TICK);
  CHECK(bench.last(MSG_HELLO_ID).id == MSG_HELLO_ID);
}

TEST_CASE("garbage on the line is survived and counted, and the next frame is heard") {
  std::mt19937 random(4);
  native_bench bench;
  for (int i = 0; i < 200; i++) {
    std::vector<uint8_t> noise(random() % 400);
    for (uint8_t &byte : noise) {
      byte = static_cast<uint8_t>(random());
    }
    bench.send_bytes(noise);
    bench.run(TICK);
  }
  CHECK(bench.telemetry().overruns == 0);
  CHECK(bench.telemetry().frames_bad != 0);
  CHECK(bench.telemetry().pulse_left == 0);
  bench.signal(5000, 5000, 500);
  bench.run(4 * TICK);
  CHECK(bench.telemetry().status == STATUS_MOTORS_ENABLED);
}

TEST_CASE("more requests than the line can answer wait; none is lost") {
  native_bench bench;
  bench.run(5 * TICK);
  bench.messages.clear();
  for (uint8_t i = 0; i < 20; i++) { /* 180 bytes in, 280 out, besides telemetry */
    const uint8_t parameter = i % PARAMETER_COUNT;
    bench.send(MSG_GET_PARAMETER_ID, &parameter, 1);
  }
  bench.run(2 * TICK);
  int answers = 0;
  for (const message &m : bench.messages) {
    answers += m.id == MSG_PARAMETER_ID;
  }
  CHECK(answers == 20);
  CHECK((bench.telemetry().status & STATUS_RECEIVE_OVERRUN) == 0);
}

TEST_CASE("requests beyond what the line can carry do not silence telemetry, nor hold up a set-point before them") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  bench.messages.clear();
  for (uint64_t tick = 5; tick < 25; tick++) {
    bench.signal(static_cast<int16_t>(tick), 0, 250);
    for (int i = 0; i < 20; i++) { /* 20 x 52 bytes out: twice the line */
      bench.send(MSG_IDENTIFY_ID);
    }
    bench.run_to(bench.tick(tick + 1));
  }
  uint32_t expected = 6;
  for (const message &m : bench.messages) {
    if (m.id == MSG_TELEMETRY_ID) {
      CHECK(m.as<msg_telemetry>().tick == expected++);
    }
  }
  CHECK(expected >= 24);
}

TEST_CASE("bytes without an end of frame never block the line") {
  native_bench bench;
  for (int i = 0; i < 20; i++) {
    bench.send_bytes(std::vector<uint8_t>(200, 0x55));
    bench.run(TICK);
  }
  CHECK((bench.telemetry().status & STATUS_RECEIVE_OVERRUN) == 0);
  bench.send_bytes({0});
  bench.signal(5000, 5000, 500);
  bench.run(4 * TICK);
  CHECK(bench.telemetry().status == STATUS_MOTORS_ENABLED);
}

TEST_CASE("messages meant for the host are refused") {
  native_bench bench;
  const msg_parameter wrong{1, 2, 0};
  bench.send(MSG_PARAMETER_ID, &wrong, sizeof wrong);
  bench.run(2 * TICK);
  CHECK(bench.telemetry().frames_bad == 1);
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

TEST_CASE("moments: a difference is right across the count's and the slots' roll-over") {
  CHECK(schedule_between({10, 100}, {10, 160}) == 60);
  CHECK(schedule_between({10, 39990}, {11, 5}) == 15);
  CHECK(schedule_between({255, 39990}, {0, 5}) == 15);
  CHECK(schedule_between({10, 100}, {11, 65530}) == 40000 - 6 - 100); /* captured just before slot 11 */
  CHECK(schedule_between({250, 0}, {2, 0}) == 8 * 40000);
}
