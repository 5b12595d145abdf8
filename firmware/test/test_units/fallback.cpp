/* The board's own brain: when it takes over and hands back, what keeps it off, and what it does. */
#include <doctest.h>

#include <initializer_list>
#include <ostream>

#include "../native_bench.h"
extern "C" {
#include "fallback.h"
#include "parameters.h"
#include "safety.h"
#include "servo.h"
#include "supply.h"
}
#include "generated/parameters.h"

namespace {

constexpr uint16_t AFTER = 300; /* ms of silence; when it has begun to drive, the session is still open */
constexpr uint64_t WAITED = 55; /* ticks that it stands still at first, with those that a pulse takes to come */
constexpr int CENTRE = 24000;   /* cycles */
constexpr int SLOW = 3200 * 3 / 8, SLOWER = 3200 * 2 / 8;

/* Offsets of the pulses from the centre, forward positive; or none. */
struct driven {
  bool pulses;
  int left, right;
  bool operator==(const driven &other) const {
    return pulses == other.pulses && left == other.left && right == other.right;
  }
};
std::ostream &operator<<(std::ostream &out, const driven &what) {
  return out << (what.pulses ? "pulses " : "no pulses ") << what.left << ' ' << what.right;
}
constexpr driven NONE{false, 0, 0}, BACK{true, -SLOW, -SLOW}, TURN_LEFT{true, -SLOW, SLOW},
    TURN_RIGHT{true, SLOW, -SLOW};

bool is_wandering(const driven &now) {
  return now == driven{true, SLOW, SLOW} || now == driven{true, SLOWER, SLOW} || now == driven{true, SLOW, SLOWER};
}

/* Kind of event and its value; of a dead-man stop 0. */
using event_list = std::vector<std::pair<int, int>>;
constexpr std::pair<int, int> DEAD_MAN{EVENT_KIND_DEAD_MAN, 0}, TAKES_OVER{EVENT_KIND_FALLBACK, 1},
    HANDS_BACK{EVENT_KIND_FALLBACK, 0}, SESSION_ENDED{EVENT_KIND_LATCH, LATCH_SESSION_ENDED};

class fallback_bench : public native_bench {
 public:
  uint8_t sees = 0; /* INFRARED_... bits: what the IR pairs see */

  explicit fallback_bench(uint8_t reset_cause = RESET_CAUSE_POWER) : native_bench(reset_cause) {
    drive(machine.now, PIN_INFRARED_LEFT_RECEIVER, NATIVE_HIGH);
    drive(machine.now, PIN_INFRARED_RIGHT_RECEIVER, NATIVE_HIGH);
    answers_pin = [this](const pin_edge &edge) {
      if (edge.pin == PIN_INFRARED_LEFT_LED) {
        answer_burst(edge, LEFT, INFRARED_LEFT, PIN_INFRARED_LEFT_RECEIVER);
      } else if (edge.pin == PIN_INFRARED_RIGHT_LED) {
        answer_burst(edge, RIGHT, INFRARED_RIGHT, PIN_INFRARED_RIGHT_RECEIVER);
      }
    };
  }

  /* A host arms the motors and switches the fallback on. */
  void arm_and_switch_on(uint16_t after = AFTER) {
    acknowledges = true;
    start();
    acknowledges = false;
    set(PARAMETER_FALLBACK_AFTER, after);
    run(MILLISECOND);
    edges.clear();
  }

  void be_silent(uint64_t ms) { run(ms * MILLISECOND); }

  /* Silence, until it has begun to drive. */
  void run_until_it_drives() {
    be_silent(AFTER + 10);
    run(WAITED * TICK);
    REQUIRE(has_flag());
    REQUIRE_FALSE(now() == NONE);
  }

  bool has_flag() const { return (safety_status() & STATUS_FALLBACK) != 0; }

  driven now() const {
    const uint16_t left = servo_pulse(LEFT), right = servo_pulse(RIGHT);
    return left == 0 && right == 0 ? NONE : driven{true, left - CENTRE, CENTRE - right};
  }

  void touch(uint8_t pin, bool touching) { drive(machine.now, pin, touching ? NATIVE_LOW : NATIVE_HIGH); }

  /* The next session gets what has been queued. */
  event_list events_of_next_session() {
    messages.clear();
    acknowledges = true;
    run(15 * TICK); /* a hello without a session */
    open();
    run(20 * TICK);
    acknowledges = false;
    event_list found;
    int number = 0;
    for (const message &m : all(MSG_EVENT_ID)) {
      const auto event = m.as<msg_event>();
      if (event.number != number) {
        found.emplace_back(event.kind, event.kind == EVENT_KIND_DEAD_MAN ? 0 : event.value);
      }
      number = event.number;
    }
    return found;
  }

 private:
  uint64_t burst_until_[SIDES] = {};

  /* A receiver that sees a burst is low from soon after its beginning to soon after its end. */
  void answer_burst(const pin_edge &edge, uint8_t side, uint8_t bit, uint8_t receiver) {
    if (edge.level != NATIVE_HIGH || edge.cycle < burst_until_[side] || (sees & bit) == 0) {
      return;
    }
    burst_until_[side] = edge.cycle + 2 * MILLISECOND;
    drive(edge.cycle + 2000, receiver, NATIVE_LOW);
    drive(edge.cycle + MILLISECOND + 2000, receiver, NATIVE_HIGH);
  }
};

}  // namespace

TEST_CASE("with a time of 0 it never drives, however long the host is silent") {
  fallback_bench bench;
  bench.arm_and_switch_on(0);
  bench.run(7000 * TICK);
  CHECK_FALSE(bench.has_flag());
  CHECK(bench.edges_of(PIN_SERVO_LEFT).empty());
}

TEST_CASE("it takes over after the silence that the parameter says, waits, and wanders slowly") {
  fallback_bench bench;
  bench.arm_and_switch_on();
  bench.be_silent(AFTER - 10);
  CHECK_FALSE(bench.has_flag());
  bench.be_silent(20);
  CHECK(bench.has_flag());
  CHECK((bench.telemetry().status & STATUS_FALLBACK) != 0);
  CHECK((bench.telemetry().status & (STATUS_MOTORS_ENABLED | STATUS_LATCHED)) == 0);
  bench.run(45 * TICK);
  CHECK(bench.now() == NONE);
  bench.run(10 * TICK);
  for (int i = 0; i < 1000; i++) {
    bench.run(TICK);
    CHECK(is_wandering(bench.now()));
  }
}

TEST_CASE("a set-point in force comes first: its dead-man stop, then the fallback, as they are sent") {
  for (const uint16_t after : std::initializer_list<uint16_t>{20, 600}) {
    fallback_bench bench;
    bench.arm_and_switch_on(after);
    bench.signal(5000, 5000, 400);
    bench.be_silent(380);
    CAPTURE(after);
    CHECK(bench.now() == driven{true, 1600, 1600});
    CHECK_FALSE(bench.has_flag());
    bench.be_silent(60);
    CHECK(bench.now() == NONE);
    bench.be_silent(1500);
    CHECK(is_wandering(bench.now()));
    /* No latch is sent when the host comes back: the session's end has latched already. */
    CHECK(bench.events_of_next_session() == event_list{DEAD_MAN, TAKES_OVER, SESSION_ENDED, HANDS_BACK});
  }
}

TEST_CASE("a frame of the session stops it at once; the next set-point drives, without arming") {
  fallback_bench bench;
  bench.arm_and_switch_on();
  bench.run_until_it_drives();
  bench.acknowledges = true;
  bench.probe(1);
  bench.run(MILLISECOND);
  CHECK_FALSE(bench.has_flag());
  bench.run(2 * TICK);
  CHECK(bench.now() == NONE);
  bench.run(10 * TICK);
  CHECK(bench.now() == NONE);
  CHECK(bench.telemetry().latch == LATCH_NONE);
  const auto last = bench.last(MSG_EVENT_ID).as<msg_event>();
  CHECK(last.kind == EVENT_KIND_FALLBACK);
  CHECK(last.value == 0);
  bench.signal(5000, 5000, 1000);
  bench.run(3 * TICK);
  CHECK(bench.now() == driven{true, 1600, 1600});
  CHECK_FALSE(bench.has_flag());
}

TEST_CASE("the session's end by silence latches for the host alone, who must arm; opening stops the fallback") {
  fallback_bench bench;
  bench.arm_and_switch_on();
  bench.run_until_it_drives();
  bench.edges.clear();
  bench.be_silent(2000); /* the session ends: it drives on */
  CHECK(bench.has_flag());
  CHECK(bench.edges_of(PIN_SERVO_LEFT).size() >= 2 * 99);
  CHECK(bench.hello().session == 0);
  bench.open();
  CHECK_FALSE(bench.has_flag());
  bench.run(2 * TICK);
  CHECK(bench.now() == NONE);
  CHECK(bench.telemetry().latch == LATCH_SESSION_ENDED);
  bench.signal(5000, 5000, 1000);
  bench.run(3 * TICK);
  CHECK(bench.now() == NONE);
  bench.be_silent(5000);
  CHECK_FALSE(bench.has_flag()); /* nobody has armed since */
  bench.run(15 * TICK);
  bench.open();
  bench.arm();
  bench.run_until_it_drives();
}

TEST_CASE("an open that is refused, and frames that are none of the session, are no host") {
  fallback_bench bench;
  bench.arm_and_switch_on();
  bench.run_until_it_drives();
  bench.say_open(1, 2);
  bench.send(MSG_IDENTIFY_ID);
  bench.use_seed(77);
  bench.probe(1);
  bench.run(2 * TICK);
  CHECK(bench.has_flag());
}

TEST_CASE("stop and close keep it off until the motors are armed again") {
  for (const bool while_it_drives : {false, true}) {
    for (const bool is_close : {false, true}) {
      fallback_bench bench;
      bench.arm_and_switch_on();
      if (while_it_drives) {
        bench.run_until_it_drives();
      }
      if (is_close) {
        bench.say(MSG_CLOSE_ID, msg_close{bench.seed});
      } else {
        bench.stop(1);
      }
      bench.run(3 * TICK);
      CAPTURE(is_close);
      CHECK(bench.now() == NONE);
      bench.be_silent(5000);
      CHECK_FALSE(bench.has_flag());
      bench.open();
      bench.be_silent(5000); /* opening is not arming */
      CHECK_FALSE(bench.has_flag());
      bench.open();
      bench.arm();
      bench.run_until_it_drives();
    }
  }
}

TEST_CASE("a low supply stops it, is sent as the latch, and keeps it off when it is back") {
  fallback_bench bench;
  bench.arm_and_switch_on();
  bench.run_until_it_drives();
  bench.be_silent(1000); /* the session has ended, and the host is latched off */
  bench.volts = 3.5;
  bench.run(8 * TICK);
  CHECK_FALSE(bench.has_flag());
  CHECK(bench.now() == NONE);
  CHECK(safety_latched() == LATCH_SUPPLY_LOW);
  bench.volts = 5.0;
  bench.be_silent(5000);
  CHECK_FALSE(bench.has_flag());
  CHECK(bench.events_of_next_session() ==
        event_list{TAKES_OVER, SESSION_ENDED, {EVENT_KIND_LATCH, LATCH_SUPPLY_LOW}, HANDS_BACK});
  bench.arm();
  bench.run_until_it_drives();
}

namespace {

/* As after a start with these parameters in the EEPROM. */
void start_with(uint16_t after, bool at_start) {
  parameters_set(PARAMETER_FALLBACK_AFTER, after);
  parameters_set(PARAMETER_FALLBACK_AT_START, at_start);
  safety_start();
}

}  // namespace

TEST_CASE("after a start it drives only if the second parameter says so, and never after a fault") {
  for (const uint8_t cause : {RESET_CAUSE_POWER, RESET_CAUSE_EXTERNAL, RESET_CAUSE_BROWN_OUT, RESET_CAUSE_WATCHDOG}) {
    for (const bool at_start : {false, true}) {
      fallback_bench bench(cause);
      start_with(AFTER, at_start);
      bench.be_silent(AFTER - 10);
      CHECK_FALSE(bench.has_flag());
      bench.edges.clear();
      bench.be_silent(3000);
      CAPTURE(int{cause});
      CHECK(bench.has_flag() == (at_start && (cause == RESET_CAUSE_POWER || cause == RESET_CAUSE_EXTERNAL)));
      CHECK(!bench.edges_of(PIN_SERVO_LEFT).empty() == bench.has_flag());
    }
  }
}

TEST_CASE("a host that comes after such a start, and does not arm, has ended it") {
  fallback_bench bench;
  start_with(AFTER, true);
  bench.be_silent(3000);
  REQUIRE(bench.has_flag());
  bench.open();
  bench.be_silent(5000);
  CHECK_FALSE(bench.has_flag());
}

TEST_CASE("after such a start it waits until the supply has been measured") {
  fallback_bench bench;
  start_with(10, true);
  REQUIRE(parameters_set(PARAMETER_DEVICES, DEVICES_SERVO | DEVICES_WHISKER) == ANSWER_STATUS_OK);
  bench.run_to(bench.tick(1) + 1);
  REQUIRE(supply_voltage() == 0);
  CHECK_FALSE(bench.has_flag());
  bench.run_to(bench.tick(10));
  CHECK(bench.has_flag());
  fallback_bench low;
  low.volts = 3.5;
  start_with(AFTER, true);
  low.be_silent(3000);
  low.volts = 5.0;
  low.be_silent(3000);
  CHECK_FALSE(low.has_flag());
}

TEST_CASE("it needs the servos, and IR pairs or whiskers; IR pairs that are on must have a fresh reading") {
  struct needs {
    uint16_t off;
    uint16_t infrared_period;
    bool drives;
  };
  for (const needs &row :
       {needs{DEVICES_SERVO, 5, false}, needs{DEVICES_INFRARED | DEVICES_WHISKER, 5, false},
        needs{DEVICES_INFRARED, 5, true}, needs{DEVICES_WHISKER, 5, true}, needs{0, 21, false}, needs{0, 20, true}}) {
    fallback_bench bench;
    bench.arm_and_switch_on();
    bench.set(PARAMETER_DEVICES, DEFAULT_DEVICES & ~row.off);
    bench.set(PARAMETER_INFRARED_PERIOD, row.infrared_period);
    bench.run(MILLISECOND);
    bench.be_silent(AFTER + 10);
    bench.run(WAITED * TICK);
    CAPTURE(row.off);
    CHECK(bench.has_flag() == row.drives);
    CHECK((bench.now() == NONE) == !row.drives);
  }
}

TEST_CASE("it backs off from a touch, and turns away from the side of it") {
  for (const uint8_t pin : std::initializer_list<uint8_t>{PIN_WHISKER_LEFT, PIN_WHISKER_RIGHT}) {
    fallback_bench bench;
    bench.arm_and_switch_on();
    bench.run_until_it_drives();
    bench.touch(pin, true);
    bench.run(4 * TICK);
    CHECK(bench.now() == BACK);
    bench.touch(pin, false);
    bench.run(45 * TICK);
    CHECK(bench.now() == BACK);
    bench.run(6 * TICK);
    const driven away = pin == PIN_WHISKER_LEFT ? TURN_RIGHT : TURN_LEFT;
    CHECK(bench.now() == away);
    bench.run(32 * TICK);
    CHECK(bench.now() == away);
    bench.run(10 * TICK);
    CHECK(is_wandering(bench.now()));
  }
}

TEST_CASE("it turns away from what the IR pairs see, as long as they see it") {
  for (const uint8_t side : std::initializer_list<uint8_t>{INFRARED_LEFT, INFRARED_RIGHT}) {
    fallback_bench bench;
    bench.arm_and_switch_on();
    bench.run_until_it_drives();
    bench.sees = side;
    const driven away = side == INFRARED_LEFT ? TURN_RIGHT : TURN_LEFT;
    bench.run(10 * TICK);
    for (int i = 0; i < 200; i++) {
      bench.run(TICK);
      CHECK(bench.now() == away);
    }
    bench.sees = 0;
    bench.run(55 * TICK);
    CHECK(is_wandering(bench.now()));
  }
}

TEST_CASE("what it cannot get away from, or a sensor that is stuck, stops it until that is over") {
  for (const bool by_whisker : {false, true}) {
    fallback_bench bench;
    bench.arm_and_switch_on();
    bench.run_until_it_drives();
    bench.sees = by_whisker ? 0 : INFRARED_LEFT | INFRARED_RIGHT;
    if (by_whisker) {
      bench.touch(PIN_WHISKER_LEFT, true);
    }
    bench.run(490 * TICK);
    CHECK_FALSE(bench.now() == NONE);
    bench.run(25 * TICK);
    CHECK(bench.now() == NONE);
    bench.edges.clear();
    bench.run(500 * TICK);
    CHECK(bench.edges_of(PIN_SERVO_LEFT).empty());
    CHECK(bench.has_flag());
    bench.sees = 0;
    bench.touch(PIN_WHISKER_LEFT, false);
    bench.run((WAITED + 5) * TICK);
    CHECK(is_wandering(bench.now()));
  }
}

TEST_CASE("a hand-back comes when the parameter is at its greatest, too, and silence is counted to there") {
  fallback_bench bench;
  bench.arm_and_switch_on(65535);
  bench.be_silent(65500);
  CHECK_FALSE(bench.has_flag());
  bench.be_silent(60);
  CHECK(bench.has_flag());
}
