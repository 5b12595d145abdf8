/* Sessions: hello, opening, confirming, taking over, closing, silence, and what belongs to which session. */
#include <doctest.h>

#include <initializer_list>
#include <set>
#include <string>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

constexpr uint32_t HOST = 0x0F0F0F;

std::string text(const char *field, size_t room) { return std::string(field, strnlen(field, room)); }

/* Ticks from one hello to the next. */
std::vector<uint64_t> gaps(const native_bench &bench, size_t from = 0) {
  const std::vector<message> hellos = bench.all(MSG_HELLO_ID);
  std::vector<uint64_t> found;
  for (size_t i = from + 1; i < hellos.size(); i++) {
    found.push_back((hellos[i].cycle - hellos[i - 1].cycle + TICK / 2) / TICK);
  }
  return found;
}

}  // namespace

TEST_CASE("hello says who speaks") {
  for (uint8_t cause : {RESET_CAUSE_POWER, RESET_CAUSE_EXTERNAL, RESET_CAUSE_BROWN_OUT, RESET_CAUSE_WATCHDOG}) {
    native_bench bench(cause);
    bench.run(3 * TICK);
    REQUIRE(bench.count(MSG_HELLO_ID) >= 1);
    const msg_hello hello = bench.hello();
    CHECK(hello.protocol_version == PROTOCOL_VERSION);
    CHECK(hello.schema_hash == SCHEMA_HASH);
    CHECK(hello.board_nonce <= FRAME_SEED_MAX);
    CHECK(hello.session == 0);
    CHECK(hello.tick_rate == 100);
    CHECK(hello.session_time_out == 1000);
    CHECK(hello.telemetry_period == 1);
    CHECK(hello.boot_counter == 1);
    CHECK(hello.reset_cause == cause);
    CHECK(hello.parameters_saved == 0);
    CHECK(hello.devices == DEFAULT_DEVICES);
    CHECK(text(hello.robot, sizeof hello.robot) == ROBOT_NAME);
  }
}

TEST_CASE("without a session the board says hello in the first tick and every 10 ticks, and nothing else") {
  native_bench bench;
  bench.run_to(bench.tick(1));
  CHECK(bench.count(MSG_HELLO_ID) == 1);
  bench.run_to(bench.tick(200));
  CHECK(bench.count(MSG_HELLO_ID) == bench.messages.size());
  const std::vector<uint64_t> all = gaps(bench);
  REQUIRE(all.size() >= 19);
  for (uint64_t gap : all) {
    CHECK(gap == 10);
  }
}

TEST_CASE("open gives a hello with the session and a new nonce; then telemetry every tick, and hello every 20") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  const uint32_t nonce = bench.hello().board_nonce;
  const size_t before = bench.count(MSG_HELLO_ID);
  bench.open(HOST);
  REQUIRE(bench.count(MSG_HELLO_ID) == before + 1);
  CHECK(bench.hello().session == (nonce ^ HOST));
  CHECK(bench.hello().board_nonce != nonce);
  bench.run_in_session(200 * TICK);
  const std::vector<uint64_t> all = gaps(bench, before);
  REQUIRE(all.size() >= 8);
  CHECK((all[0] == 19 || all[0] == 20)); /* the answer to open came within a tick */
  for (size_t i = 1; i < all.size(); i++) {
    CHECK(all[i] == 20);
  }
  const std::vector<message> telemetry = bench.all(MSG_TELEMETRY_ID);
  REQUIRE(telemetry.size() >= 199);
  for (size_t i = 1; i < telemetry.size(); i++) {
    CHECK(telemetry[i].as<msg_telemetry>().tick == telemetry[i - 1].as<msg_telemetry>().tick + 1);
  }
}

TEST_CASE("hello comes every 20 ticks however seldom telemetry is wanted") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  bench.open(HOST);
  bench.set(PARAMETER_TELEMETRY_PERIOD, 100);
  bench.run_in_session(30 * TICK);
  CHECK(bench.hello().telemetry_period == 100);
  const size_t before = bench.count(MSG_HELLO_ID);
  bench.run_in_session(170 * TICK);
  const std::vector<uint64_t> all = gaps(bench, before);
  REQUIRE(all.size() >= 7);
  for (uint64_t gap : all) {
    CHECK(gap == 20);
  }
}

TEST_CASE("the same open again is only answered: nothing begins anew") {
  native_bench bench;
  bench.start();
  const uint32_t session = bench.seed;
  const uint32_t nonce = bench.hello().board_nonce;
  const size_t before = bench.count(MSG_HELLO_ID);
  for (uint32_t board : {UINT32_C(1), UINT32_C(0x1ABCDE), session}) { /* any two halves of the seed */
    bench.say_open(board, board ^ session);
    bench.run(TICK); /* telemetry goes first */
  }
  CHECK(bench.count(MSG_HELLO_ID) == before + 3);
  CHECK(bench.hello().session == session);
  CHECK(bench.hello().board_nonce == nonce);
  bench.signal(5000, 5000, 500);
  bench.run(3 * TICK);
  CHECK(bench.telemetry().latch == LATCH_NONE);
  CHECK(bench.telemetry().pulse_left == 25600);
}

TEST_CASE("an open that does not fit is dropped") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  const uint32_t nonce = bench.hello().board_nonce;
  const size_t before = bench.count(MSG_HELLO_ID);
  bench.say_open(nonce ^ 1, HOST);                    /* another nonce */
  bench.say_open(nonce, nonce);                       /* seed 0 */
  bench.say_open(0, 0);                               /* the same */
  bench.say_open(nonce, nonce ^ FRAME_SEED);          /* the handshake's seed */
  bench.say_open(nonce, HOST | 0x200000);             /* more than 21 bits */
  bench.say_open(nonce, HOST, PROTOCOL_VERSION + 16); /* another version */
  bench.run(4 * TICK);
  CHECK(bench.count(MSG_HELLO_ID) == before);
  CHECK(bench.count(MSG_TELEMETRY_ID) == 0);
  bench.say_open(nonce, HOST); /* and one that fits */
  bench.run(TICK);
  CHECK(bench.hello().session == (nonce ^ HOST));
  bench.use_seed(nonce ^ HOST);
  CHECK(bench.counters().refused == 6);
}

TEST_CASE("a nonce opens one session only: a late copy of an earlier open is dropped") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  const uint32_t first_nonce = bench.hello().board_nonce;
  bench.open(HOST);
  bench.open(HOST + 1); /* somebody else, with the new nonce */
  const uint32_t session = bench.seed;
  REQUIRE(bench.hello().session == session);
  bench.say_open(first_nonce, HOST);
  bench.run(2 * TICK);
  bench.run_in_session(25 * TICK);
  CHECK(bench.hello().session == session);
}

TEST_CASE("another opening begins anew: latched, numbers from 1, the old session's frames refused") {
  native_bench bench;
  bench.start();
  bench.get(PARAMETER_RETRY_TIME);
  bench.signal(5000, 5000, 2000);
  bench.run(4 * TICK);
  REQUIRE(bench.telemetry().pulse_left == 25600);
  const uint32_t old_session = bench.seed;
  const uint8_t latches = bench.telemetry().latches;
  const std::vector<uint8_t> of_old = bench.frame(MSG_STOP_ID, "x", 1);
  bench.open(HOST + 7);
  REQUIRE(bench.seed != old_session);
  bench.run(3 * TICK);
  CHECK(bench.telemetry().latch == LATCH_SESSION_ENDED);
  CHECK(bench.telemetry().latches == latches + 1);
  CHECK(bench.telemetry().pulse_left == 0);
  bench.get(PARAMETER_TIME_TO_LIVE); /* number 1 */
  bench.run(2 * MILLISECOND);
  CHECK(bench.answer().number == 1);
  CHECK(bench.answer().value == 250);
  const uint16_t bad = bench.counters().bad;
  bench.send_bytes(of_old);
  bench.run(2 * MILLISECOND);
  CHECK(bench.count(MSG_STOPPED_ID) == 0);
  CHECK(bench.counters().bad == bad + 1);
}

TEST_CASE("without a session every frame that is not of the handshake is dropped, whatever its seed") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  for (uint32_t seed : {UINT32_C(0), static_cast<uint32_t>(FRAME_SEED), static_cast<uint32_t>(FRAME_SEED_MAX),
                        bench.hello().board_nonce}) {
    bench.seed = seed;
    bench.stop(1);
    bench.probe(2);
    bench.get(0);
    bench.run(TICK);
  }
  /* Nothing else was said, not even in frames that the bench does not understand. */
  CHECK(bench.bytes_out == bench.count(MSG_HELLO_ID) * (MSG_HELLO_LENGTH + FRAME_OVERHEAD));
}

TEST_CASE("silence ends the session after session_time_out, and not before") {
  for (const uint16_t time_out : std::initializer_list<uint16_t>{200, 1000, 1500}) {
    native_bench bench;
    bench.run_to(bench.tick(5));
    bench.open(HOST);
    bench.set(PARAMETER_SESSION_TIME_OUT, time_out);
    bench.run_to(bench.tick(20));
    bench.probe(1);
    const uint64_t heard = bench.machine.now + 10 * NATIVE_BYTE_CYCLES; /* the probe's last byte */
    const uint32_t nonce = bench.hello().board_nonce;
    bench.run_to(heard + time_out * MILLISECOND);
    CAPTURE(time_out);
    CHECK(bench.hello().session == bench.seed);
    CHECK(bench.telemetry().tick == bench.ticks_begun() - 1);
    bench.run(3 * TICK);
    CHECK(bench.hello().session == 0);
    CHECK(bench.hello().board_nonce != nonce);
    const size_t count = bench.count(MSG_TELEMETRY_ID);
    bench.run(20 * TICK);
    CHECK(bench.count(MSG_TELEMETRY_ID) == count);
  }
}

TEST_CASE("any frame of the session keeps it open; frames of the handshake and damaged ones do not") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  bench.open(HOST);
  for (int i = 0; i < 10; i++) {
    bench.run(90 * TICK);
    bench.stop(1);
  }
  bench.run(TICK);
  CHECK(bench.hello().session == bench.seed);
  for (int i = 0; i < 12; i++) {
    bench.run(10 * TICK);
    bench.send(MSG_IDENTIFY_ID);
    std::vector<uint8_t> damaged = bench.frame(MSG_STOP_ID, "x", 1);
    damaged[3] ^= 1;
    bench.send_bytes(damaged);
  }
  CHECK(bench.hello().session == 0);
}

TEST_CASE("silence is counted across the roll-over of the ticks' 16 bits") {
  native_bench bench(RESET_CAUSE_POWER, 0, 0xFFB0);
  bench.run_to(bench.tick(5));
  bench.open(HOST);
  bench.run_to(bench.tick(70));
  bench.probe(1);
  bench.run_to(bench.tick(165));
  REQUIRE(bench.telemetry().tick > 0x10000);
  CHECK(bench.hello().session == bench.seed);
  bench.run_to(bench.tick(175));
  CHECK(bench.hello().session == 0);
}

TEST_CASE("close ends the session at once; another seed closes nothing") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  bench.run(4 * TICK);
  bench.say(MSG_CLOSE_ID, msg_close{bench.seed ^ 1});
  bench.run(2 * TICK);
  CHECK(bench.hello().session == bench.seed);
  CHECK(bench.telemetry().pulse_left == 25600);
  const size_t before = bench.count(MSG_HELLO_ID);
  bench.say(MSG_CLOSE_ID, msg_close{bench.seed});
  bench.run(TICK);
  CHECK(bench.count(MSG_HELLO_ID) == before + 1);
  CHECK(bench.hello().session == 0);
  bench.run(2 * TICK); /* a servo frame */
  bench.edges.clear();
  bench.run(10 * TICK);
  CHECK(bench.edges_of(PIN_SERVO_LEFT).empty());
  bench.open(HOST);
  bench.run(2 * TICK);
  CHECK(bench.telemetry().latch == LATCH_SESSION_ENDED);
  CHECK(bench.telemetry().pulse_left == 0);
}

TEST_CASE("board nonces are never the same twice in a row, over many openings and ends") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  std::set<uint32_t> seen{bench.hello().board_nonce};
  for (uint32_t i = 1; i <= 500; i++) {
    bench.open(i);
    CHECK(seen.insert(bench.hello().board_nonce).second);
    if (i % 2 == 0) {
      bench.say(MSG_CLOSE_ID, msg_close{bench.seed});
      bench.run(TICK);
      CHECK(seen.insert(bench.hello().board_nonce).second);
    }
  }
}

TEST_CASE("opens without end do not silence telemetry, and one hello at most waits") {
  native_bench bench;
  bench.run_to(bench.tick(5));
  bench.open(HOST);
  bench.run(TICK);
  const size_t before = bench.count(MSG_TELEMETRY_ID);
  const uint64_t from = bench.machine.now;
  for (int tick = 0; tick < 20; tick++) {
    for (int i = 0; i < 25; i++) {
      bench.say_open(1, 1 ^ bench.seed);
    }
    bench.run(TICK);
  }
  CHECK(bench.count(MSG_TELEMETRY_ID) == before + (bench.machine.now - from) / TICK);
  bench.messages.clear();
  bench.run(8 * TICK);
  CHECK(bench.count(MSG_HELLO_ID) <= 1);
}

TEST_CASE("identity names version, compiler and pin map") {
  native_bench bench;
  bench.send(MSG_IDENTIFY_ID);
  bench.run(TICK);
  const auto identity = bench.last(MSG_IDENTITY_ID).as<msg_identity>();
  CHECK(text(identity.firmware_version, sizeof identity.firmware_version).size() > 0);
  CHECK(text(identity.compiler, sizeof identity.compiler).find(' ') != std::string::npos);
  CHECK(text(identity.pin_map, sizeof identity.pin_map) == PIN_MAP_NAME);
  CHECK(identity.image_size == 0);
}

TEST_CASE("describe answers with id, length and hash of each message, to who names the nonce in force") {
  struct known {
    uint8_t id, length;
    uint32_t hash;
  };
#define KNOWN(id, length, hash) {(id), (length), (hash)},
  const std::vector<known> list = {MESSAGE_LIST(KNOWN)};
#undef KNOWN
  native_bench bench;
  bench.run_to(bench.tick(5));
  const uint32_t nonce = bench.hello().board_nonce;
  for (int index = 0; index < 256; index++) {
    bench.say(MSG_DESCRIBE_ID, msg_describe{static_cast<uint8_t>(index), nonce});
    bench.run(3 * MILLISECOND);
    const auto described = bench.last(MSG_DESCRIPTION_ID).as<msg_description>();
    REQUIRE(described.index == index);
    CHECK(described.count == list.size());
    const bool exists = static_cast<size_t>(index) < list.size();
    CHECK(described.id == (exists ? list[static_cast<size_t>(index)].id : 0));
    CHECK(described.length == (exists ? list[static_cast<size_t>(index)].length : 0));
    CHECK(described.hash == (exists ? list[static_cast<size_t>(index)].hash : 0));
  }
  const size_t before = bench.count(MSG_DESCRIPTION_ID);
  bench.say(MSG_DESCRIBE_ID, msg_describe{0, nonce ^ 1});
  bench.run(3 * MILLISECOND);
  CHECK(bench.count(MSG_DESCRIPTION_ID) == before);
}
