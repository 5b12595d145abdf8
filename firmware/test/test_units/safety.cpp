/* When the motors may run: latch, time to live, order of set-points, and pulses that are whole or absent. */
#include <doctest.h>
#include <initializer_list>

#include <random>
#include <set>

#include "generated/parameters.h"
#include "native_bench.h"

namespace {

constexpr uint64_t FRAME = 320000; /* 20 ms */

/* Widths of the pulses at a pin, by the cycle of the rising edge. */
std::vector<std::pair<uint64_t, uint64_t>> pulses(const native_bench &bench, uint8_t pin) {
  std::vector<std::pair<uint64_t, uint64_t>> found;
  uint64_t rise = 0;
  for (const pin_edge &edge : bench.edges_of(pin)) {
    if (edge.level == NATIVE_HIGH) {
      rise = edge.cycle;
    } else if (rise != 0) {
      found.emplace_back(rise, edge.cycle - rise);
      rise = 0;
    }
  }
  return found;
}

}  // namespace

namespace {

/* Whether the last thing said moves the motors: telemetry of the next ticks. */
bool moves(native_bench &bench) {
  bench.run(4 * TICK);
  return (bench.telemetry().status & STATUS_MOTORS_ENABLED) != 0 && bench.telemetry().pulse_left != 0;
}

uint16_t now_of(const native_bench &bench) { return static_cast<uint16_t>(bench.telemetry().tick); }

constexpr uint16_t MOTION_BITS = STATUS_MOTORS_ENABLED | STATUS_DEAD_MAN | STATUS_LATCHED;

}  // namespace

TEST_CASE("at start the motors are latched off, whatever set-points come") {
  native_bench bench;
  bench.run_to(bench.tick(4));
  bench.open();
  bench.run(2 * TICK);
  CHECK(bench.telemetry().latch == LATCH_START);
  CHECK(bench.telemetry().latches == 1);
  const uint16_t refused = bench.counters().refused;
  for (int i = 0; i < 10; i++) {
    bench.signal(5000, 5000, 2000);
    bench.run(2 * TICK);
  }
  CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_LATCHED);
  CHECK(bench.telemetry().pulse_left == 0);
  CHECK(pulses(bench, PIN_SERVO_LEFT).empty());
  CHECK(pulses(bench, PIN_SERVO_RIGHT).empty());
  CHECK(bench.counters().refused == refused + 10);
}

TEST_CASE("armed, a set-point gives pulses of its width every 20 ms, and the telemetry says so") {
  native_bench bench;
  bench.start();
  CHECK((bench.telemetry().status & MOTION_BITS) == 0);
  CHECK(bench.telemetry().latch == LATCH_NONE);
  bench.signal(5000, -2500, 2000);
  bench.run_in_session(100 * TICK);
  const auto left = pulses(bench, PIN_SERVO_LEFT);
  const auto right = pulses(bench, PIN_SERVO_RIGHT);
  REQUIRE(left.size() >= 40);
  for (size_t i = 0; i < left.size(); i++) {
    CHECK(left[i].second == 24000 + 1600);
    if (i > 0) {
      CHECK(left[i].first - left[i - 1].first == FRAME);
    }
  }
  for (const auto &pulse : right) {
    CHECK(pulse.second == 24000 + 800);
  }
  CHECK(bench.telemetry().pulse_left == 25600);
  CHECK(bench.telemetry().pulse_right == 24800);
  CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_MOTORS_ENABLED);
}

TEST_CASE("signal 0 holds the wheels with centre pulses, coasting gives none and latches nothing") {
  native_bench bench;
  bench.start();
  bench.signal(0, 0, 1000);
  bench.run(20 * TICK);
  REQUIRE_FALSE(pulses(bench, PIN_SERVO_LEFT).empty());
  CHECK(pulses(bench, PIN_SERVO_LEFT).back().second == 24000);
  bench.say(MSG_SETPOINT_COAST_ID, msg_setpoint_coast{500, now_of(bench)});
  bench.run(4 * TICK);
  const size_t count = pulses(bench, PIN_SERVO_LEFT).size();
  bench.run(10 * TICK);
  CHECK(pulses(bench, PIN_SERVO_LEFT).size() == count);
  CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_MOTORS_ENABLED);
  bench.signal(0, 0, 1000);
  CHECK(moves(bench));
}

TEST_CASE("motors stop within the time to live, counted from the answered tick, plus one servo frame, and not before") {
  for (const uint16_t time_to_live : std::initializer_list<uint16_t>{20, 30, 100, 250, 999, 2000}) {
    for (const uint16_t late : std::initializer_list<uint16_t>{0, 1, 5}) {
      if (late * 10u + 10u >= time_to_live) {
        continue;
      }
      native_bench bench;
      bench.start();
      bench.run(12345);
      const uint32_t answered = bench.telemetry().tick;
      bench.run_in_session(late * TICK);
      bench.signal(5000, 5000, time_to_live, static_cast<uint16_t>(answered));
      bench.run(2 * MILLISECOND);
      for (int i = 0; i < 25; i++) {
        bench.run_in_session((time_to_live + 100u) * MILLISECOND / 25);
      }
      const auto left = pulses(bench, PIN_SERVO_LEFT);
      REQUIRE_FALSE(left.empty());
      const uint64_t last = left.back().first;
      const uint64_t end = bench.tick(answered) + time_to_live * MILLISECOND;
      CAPTURE(time_to_live);
      CAPTURE(late);
      CHECK(last + left.back().second <= end + FRAME);
      CHECK(last + FRAME >= end);
      CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_DEAD_MAN);
      CHECK(bench.telemetry().pulse_left == 0);
    }
  }
}

TEST_CASE("a set-point is accepted up to the last cycle of its time to live, and late from then on") {
  constexpr uint16_t TIME_TO_LIVE = 40;
  constexpr uint64_t FRAME_TIME = 16 * NATIVE_BYTE_CYCLES; /* of a set-point on the line */
  for (const int64_t beside : std::initializer_list<int64_t>{-16000, -16, -1, 0, 1, 16000}) {
    native_bench bench;
    bench.start();
    const uint32_t answered = bench.telemetry().tick;
    const uint64_t end = bench.tick(answered) + TIME_TO_LIVE * MILLISECOND;
    /* Its last byte, at which it is worked on, comes at `end + beside`. */
    bench.run_to(static_cast<uint64_t>(static_cast<int64_t>(end - FRAME_TIME) + beside));
    bench.signal(5000, 5000, TIME_TO_LIVE, static_cast<uint16_t>(answered));
    bench.run(3 * MILLISECOND);
    bench.run(2 * TICK);
    CAPTURE(beside);
    const bool accepted = (bench.telemetry().status & STATUS_DEAD_MAN) != 0; /* it ended at once */
    CHECK(accepted == (beside < 0));
    CHECK(bench.counters().late == (beside < 0 ? 0 : 1));
  }
}

TEST_CASE("a set-point that names no time to live has the parameter's") {
  native_bench bench;
  bench.start();
  bench.set(PARAMETER_TIME_TO_LIVE, 50);
  bench.run(2 * MILLISECOND);
  bench.signal(5000, 5000, 0);
  bench.run(4 * TICK);
  CHECK((bench.telemetry().status & STATUS_MOTORS_ENABLED) != 0);
  bench.run(3 * TICK);
  CHECK((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
}

TEST_CASE("a late copy of an older set-point is late too when the newer one has outlived itself") {
  native_bench bench;
  bench.start();
  bench.run(12345);
  const uint32_t older = bench.telemetry().tick;
  bench.run_in_session(2 * TICK);
  bench.signal(0, 0, 20, static_cast<uint16_t>(bench.telemetry().tick));
  bench.run_in_session(5 * TICK);
  REQUIRE((bench.telemetry().status & MOTION_BITS) == STATUS_DEAD_MAN);
  bench.signal(5000, 5000, 2000, static_cast<uint16_t>(older));
  bench.run_in_session(2 * TICK);
  CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_DEAD_MAN);
  CHECK_FALSE(moves(bench));
}

TEST_CASE("the next set-point ends a dead-man stop") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 20);
  bench.run(10 * TICK);
  REQUIRE((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
  bench.signal(5000, 5000, 1000);
  bench.run(10 * TICK);
  CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_MOTORS_ENABLED);
  CHECK(bench.telemetry().pulse_left == 25600);
}

TEST_CASE("a set-point that answers an older tick than the one in force is late; a newer one is not") {
  native_bench bench;
  bench.start();
  bench.run(5 * TICK);
  const uint16_t tick = now_of(bench);
  bench.signal(5000, 5000, 500, tick);
  bench.run(2 * MILLISECOND);
  bench.signal(1000, 1000, 500, static_cast<uint16_t>(tick - 1));
  CHECK(moves(bench));
  CHECK(bench.telemetry().pulse_left == 25600);
  bench.signal(1000, 1000, 500, static_cast<uint16_t>(tick + 1));
  CHECK(moves(bench));
  CHECK(bench.telemetry().pulse_left == 24320);
  CHECK(bench.counters().late == 1);
}

TEST_CASE("of one tick the later sequence number counts, across its roll-over; a copy is late") {
  native_bench bench;
  bench.start();
  bench.run(2 * TICK);
  const uint16_t tick = now_of(bench);
  bench.next_sequence = 254;
  bench.signal(1000, 1000, 1000, tick);
  CHECK(moves(bench));
  bench.next_sequence = 2;
  bench.signal(2000, 2000, 1000, tick);
  CHECK(moves(bench));
  CHECK(bench.telemetry().pulse_left == 24640);
  CHECK(bench.telemetry().setpoint_sequence == 2);
  bench.next_sequence = 255; /* before it */
  bench.signal(3000, 3000, 1000, tick);
  bench.next_sequence = 2; /* a copy */
  bench.signal(3000, 3000, 1000, tick);
  CHECK(moves(bench));
  CHECK(bench.telemetry().pulse_left == 24640);
  CHECK(bench.telemetry().setpoint_sequence == 2);
  CHECK(bench.counters().late == 2);
}

TEST_CASE("half a roll-over of the ticks after the last set-point the next one is accepted") {
  native_bench bench;
  bench.start();
  bench.run(10 * TICK);
  bench.signal(5000, 5000, 20, now_of(bench));
  bench.run_in_session(33000 * TICK); /* its tick is now ahead, by the sign of the difference */
  REQUIRE((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
  bench.signal(1000, 1000, 500, now_of(bench));
  CHECK(moves(bench));
}

TEST_CASE("a set-point that answers a tick to come is late") {
  native_bench bench;
  bench.start();
  bench.run(5 * TICK);
  for (const int ahead : {1, 2, 100, 32767, 32768, 65000}) {
    bench.signal(5000, 5000, 2000, static_cast<uint16_t>(bench.telemetry().tick + static_cast<uint32_t>(ahead)));
    bench.run(2 * MILLISECOND);
    CAPTURE(ahead);
    CHECK((bench.telemetry().status & STATUS_MOTORS_ENABLED) == 0);
  }
  bench.run(2 * TICK);
  CHECK(bench.telemetry().pulse_left == 0);
  CHECK(bench.counters().late == 6);
}

TEST_CASE("ticks of set-points are compared across the roll-over of their 16 bits") {
  native_bench bench(RESET_CAUSE_POWER, 0, 0xFFF0);
  bench.start();
  int moving = 0, ticks = 0;
  for (int i = 0; i < 40; i++) {
    bench.signal(static_cast<int16_t>(100 * i), 0, 30);
    bench.run(TICK);
    if (i >= 3) {
      ticks++;
      moving += (bench.telemetry().status & MOTION_BITS) == STATUS_MOTORS_ENABLED;
    }
  }
  REQUIRE(bench.telemetry().tick > 0x10000);
  CHECK(moving == ticks);
  CHECK(bench.counters().late == 0);
  bench.signal(5000, 0, 2000);
  bench.run(2 * TICK);
  bench.signal(1000, 0, 2000, static_cast<uint16_t>(bench.telemetry().tick - 0x30)); /* before the roll-over */
  bench.run(2 * TICK);
  CHECK(bench.telemetry().pulse_left == 25600);
  CHECK(bench.counters().late == 1);
}

TEST_CASE("time to live and dead-man work across the roll-over of the board's time") {
  constexpr uint32_t FIRST = 429480; /* 2^32 us come in tick 429496 */
  for (uint32_t offset = 0; offset < 6; offset++) {
    native_bench bench(RESET_CAUSE_POWER, 0, FIRST);
    bench.start();
    bench.run((3 + offset) * TICK);
    const uint32_t answered = bench.telemetry().tick;
    bench.signal(5000, 5000, 60);
    bench.run(20 * TICK);
    REQUIRE(bench.telemetry().time < 1000000);
    const auto left = pulses(bench, PIN_SERVO_LEFT);
    REQUIRE_FALSE(left.empty());
    const uint64_t end = bench.tick(answered - FIRST) + 60 * MILLISECOND;
    CHECK(left.back().first + left.back().second <= end + FRAME);
    CHECK(left.back().first + FRAME >= end);
    CHECK((bench.telemetry().status & STATUS_DEAD_MAN) != 0);
  }
}

TEST_CASE("long after arming set-points are still accepted, also when half of the ticks' 16 bits has gone by") {
  native_bench bench;
  bench.start();
  for (int i = 0; i < 34; i++) {
    bench.messages.clear();
    bench.run_in_session(1000 * TICK);
    bench.signal(1000, 1000, 200);
    CHECK(moves(bench));
  }
  REQUIRE(bench.telemetry().tick > 0x8000 + 10);
}

TEST_CASE("stop stops at once, is answered, and latches until armed") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  REQUIRE(moves(bench));
  const uint8_t before = bench.telemetry().latches;
  bench.stop(77);
  bench.run(2 * MILLISECOND);
  CHECK(bench.last(MSG_STOPPED_ID).as<msg_stopped>().token == 77);
  bench.run(4 * TICK);
  CHECK((bench.telemetry().status & MOTION_BITS) == STATUS_LATCHED);
  CHECK(bench.telemetry().latch == LATCH_STOP_COMMAND);
  CHECK(bench.telemetry().latches == before + 1);
  CHECK(bench.telemetry().pulse_left == 0);
  const size_t count = pulses(bench, PIN_SERVO_LEFT).size();
  for (int i = 0; i < 10; i++) {
    bench.signal(1000, 1000, 2000);
    bench.run(2 * TICK);
  }
  CHECK(pulses(bench, PIN_SERVO_LEFT).size() == count);
  bench.arm();
  bench.run(2 * TICK);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
  CHECK((bench.telemetry().status & MOTION_BITS) == 0);
  bench.signal(1000, 1000, 200);
  CHECK(moves(bench));
}

TEST_CASE("a repeated stop is answered and counted; the first reason stays") {
  native_bench bench;
  bench.run_to(bench.tick(4));
  bench.open();
  bench.run(2 * TICK);
  for (uint8_t i = 1; i <= 3; i++) {
    bench.stop(i);
    bench.run(2 * TICK);
    CHECK(bench.count(MSG_STOPPED_ID) == i);
    CHECK(bench.telemetry().latch == LATCH_START);
    CHECK(bench.telemetry().latches == 1 + i);
  }
}

TEST_CASE("arm ends only the latch that its sender knows of") {
  native_bench bench;
  bench.start();
  bench.stop(1);
  bench.run(2 * TICK);
  const uint8_t known = bench.telemetry().latches;
  bench.stop(2); /* on its way while the host arms */
  bench.arm(known);
  bench.run(2 * TICK);
  CHECK(bench.answer().status == ANSWER_STATUS_LATCHED_AGAIN);
  CHECK(bench.telemetry().latch == LATCH_STOP_COMMAND);
  bench.arm(static_cast<uint8_t>(known + 1));
  bench.run(2 * TICK);
  CHECK(bench.answer().status == ANSWER_STATUS_OK);
  CHECK(bench.telemetry().latch == LATCH_NONE);
}

TEST_CASE("arming goes by the count of latches across its roll-over") {
  native_bench bench;
  bench.start();
  for (int i = 0; i < 260; i++) {
    bench.stop(static_cast<uint8_t>(i));
    bench.run(2 * MILLISECOND);
  }
  bench.run(TICK);
  CHECK(bench.telemetry().latches == static_cast<uint8_t>(1 + 260));
  bench.arm();
  bench.run(2 * TICK);
  CHECK(bench.telemetry().latch == LATCH_NONE);
}

TEST_CASE("set-points that answer the tick of the arming or an older one are late, those of the next tick move") {
  native_bench bench;
  bench.start();
  bench.stop(1);
  bench.run(3 * TICK);
  bench.run_to(bench.tick(20) + 3 * MILLISECOND);
  REQUIRE(bench.telemetry().tick == 20);
  bench.arm();
  bench.run(MILLISECOND);
  REQUIRE(bench.answer().status == ANSWER_STATUS_OK);
  for (uint16_t tick = 16; tick <= 20; tick++) {
    bench.signal(5000, 5000, 2000, tick);
    bench.run(MILLISECOND);
  }
  bench.run_to(bench.tick(21));
  CHECK((bench.telemetry().status & MOTION_BITS) == 0);
  bench.signal(5000, 5000, 2000, 21);
  CHECK(moves(bench));
  CHECK(bench.counters().late == 5);
}

TEST_CASE("the end of a session latches the motors") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  REQUIRE(moves(bench));
  bench.run(110 * TICK); /* silence */
  const size_t count = pulses(bench, PIN_SERVO_LEFT).size();
  bench.open();
  bench.run(2 * TICK);
  CHECK(bench.telemetry().latch == LATCH_SESSION_ENDED);
  bench.signal(5000, 5000, 2000);
  bench.run(10 * TICK);
  CHECK(pulses(bench, PIN_SERVO_LEFT).size() == count);
}

TEST_CASE("a low supply latches and refuses arming; when it is back the motors stay latched until armed") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  REQUIRE(moves(bench));
  bench.volts = 3.5;
  bench.run(8 * TICK);
  CHECK(bench.telemetry().latch == LATCH_SUPPLY_LOW);
  CHECK((bench.telemetry().status & STATUS_SUPPLY_LOW) != 0);
  CHECK(bench.telemetry().pulse_left == 0);
  CHECK(bench.telemetry().latches == 2);
  bench.arm();
  bench.run(2 * TICK);
  CHECK(bench.answer().status == ANSWER_STATUS_SUPPLY_LOW);
  CHECK(bench.telemetry().latch == LATCH_SUPPLY_LOW);
  bench.volts = 5.0;
  bench.run(8 * TICK);
  CHECK((bench.telemetry().status & STATUS_SUPPLY_LOW) == 0);
  CHECK(bench.telemetry().latch == LATCH_SUPPLY_LOW);
  bench.signal(5000, 5000, 2000);
  CHECK_FALSE(moves(bench));
  bench.arm();
  bench.run(2 * TICK);
  CHECK(bench.telemetry().latch == LATCH_NONE);
}

TEST_CASE("before the supply was measured arming is refused") {
  attended_bench bench;
  bench.arm(1);
  bench.run(MILLISECOND);
  REQUIRE(bench.count(MSG_ANSWER_ID) == 1);
  CHECK(bench.answer().status == ANSWER_STATUS_SUPPLY_LOW);
}

TEST_CASE("a set-point out of range is refused and changes nothing") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  bench.run(10 * TICK);
  const msg_telemetry before = bench.telemetry();
  const uint16_t tick = now_of(bench);
  bench.signal(10001, 0, 100);
  bench.signal(0, -10001, 100);
  bench.signal(0, 0, 2001);
  bench.say(MSG_SETPOINT_SPEED_ID, msg_setpoint_speed{5001, 0, 100, tick});
  bench.say(MSG_SETPOINT_COAST_ID, msg_setpoint_coast{2001, tick});
  bench.run(10 * TICK);
  const msg_telemetry after = bench.telemetry();
  CHECK(after.pulse_left == before.pulse_left);
  CHECK(after.setpoint_sequence == before.setpoint_sequence);
  const msg_counters counters = bench.counters();
  CHECK(counters.refused == 5);
  CHECK(counters.late == 0);
}

TEST_CASE("set-points in m/s are scaled by the full speed") {
  native_bench bench;
  bench.start();
  bench.say(MSG_SETPOINT_SPEED_ID, msg_setpoint_speed{850, -1700, 1000, now_of(bench)});
  bench.run(10 * TICK);
  CHECK(bench.telemetry().pulse_left == 24000 + 1600);
  CHECK(bench.telemetry().pulse_right == 24000 + 3200);
}

TEST_CASE("another full speed counts from the next set-point on, also when it is reset") {
  native_bench bench;
  bench.start();
  bench.set(PARAMETER_WHEEL_SPEED_MAXIMUM, 3400);
  bench.say(MSG_SETPOINT_SPEED_ID, msg_setpoint_speed{850, -1700, 1000, now_of(bench)});
  bench.run(10 * TICK);
  CHECK(bench.telemetry().pulse_left == 24000 + 800);
  CHECK(bench.telemetry().pulse_right == 24000 + 1600);
  bench.say(MSG_RESET_PARAMETERS_ID, msg_reset_parameters{bench.next_number++});
  bench.say(MSG_SETPOINT_SPEED_ID, msg_setpoint_speed{850, -1700, 1000, now_of(bench)});
  bench.run(10 * TICK);
  CHECK(bench.telemetry().pulse_left == 24000 + 1600);
  CHECK(bench.telemetry().pulse_right == 24000 + 3200);
}

TEST_CASE("switching the servos off stops them and refuses set-points") {
  native_bench bench;
  bench.start();
  bench.signal(5000, 5000, 2000);
  bench.run(10 * TICK);
  bench.set(PARAMETER_DEVICES, 0);
  bench.run(4 * TICK);
  CHECK((bench.telemetry().status & MOTION_BITS) == 0);
  CHECK(bench.telemetry().pulse_left == 0);
  bench.signal(5000, 5000, 2000);
  CHECK_FALSE(moves(bench));
}

TEST_CASE("commands of a line that stalled for 2 s move nothing when they are released") {
  native_bench bench;
  bench.start();
  std::vector<uint8_t> queued;
  for (int i = 0; i < 100; i++) { /* a host that goes on and hears no more */
    const msg_setpoint_signal setpoint{5000, 5000, 2000, now_of(bench)};
    const std::vector<uint8_t> wire = bench.frame(MSG_SETPOINT_SIGNAL_ID, &setpoint, sizeof setpoint);
    queued.insert(queued.end(), wire.begin(), wire.end());
  }
  bench.run(200 * TICK);
  bench.send_bytes(queued);
  bench.run(20 * TICK);
  CHECK(pulses(bench, PIN_SERVO_LEFT).empty());
  CHECK(pulses(bench, PIN_SERVO_RIGHT).empty());
}

TEST_CASE("a pulse is whole or absent whenever set-points and stops come") {
  std::mt19937 random(2);
  native_bench bench;
  bench.start();
  std::set<uint64_t> asked;
  for (int i = 0; i < 400; i++) {
    if (random() % 3 == 0) {
      bench.stop(1);
      bench.run(2 * MILLISECOND);
      bench.arm(static_cast<uint8_t>(bench.count(MSG_STOPPED_ID) + 1));
    } else {
      const auto signal = static_cast<int16_t>(1000 * static_cast<int>(random() % 10));
      asked.insert(24000u + 320u * static_cast<unsigned>(signal / 1000));
      bench.signal(signal, signal, 20);
    }
    bench.run(random() % (3 * TICK));
  }
  const auto left = pulses(bench, PIN_SERVO_LEFT);
  REQUIRE(left.size() > 50);
  for (const auto &pulse : left) {
    CHECK(asked.count(pulse.second) == 1);
  }
}

TEST_CASE("both wheels take a set-point in the same frame") {
  for (uint64_t phase = 0; phase < FRAME; phase += 1999) {
    native_bench bench;
    bench.start();
    bench.signal(1000, 1000, 2000);
    bench.run_to(bench.tick(20) + phase);
    bench.signal(5000, 5000, 2000);
    bench.run_to(bench.tick(40));
    const auto left = pulses(bench, PIN_SERVO_LEFT);
    const auto right = pulses(bench, PIN_SERVO_RIGHT);
    REQUIRE(left.size() == right.size());
    REQUIRE(left.back().second == 25600);
    for (size_t i = 0; i < left.size(); i++) {
      CHECK(static_cast<int>(left[i].second) - 24000 == 24000 - static_cast<int>(right[i].second));
    }
  }
}
