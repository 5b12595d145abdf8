/* The queue of what has happened: its order, what merges when it is full, and what is forgotten. */
extern "C" {
#include "events.h"
}

#include <doctest.h>

#include <initializer_list>

#include "native_bench.h"

namespace {

struct happened {
  uint8_t kind;
  uint16_t value;
  bool operator==(const happened &other) const { return kind == other.kind && value == other.value; }
};

/* All that waits; none of it waits any more. */
std::vector<happened> collect() {
  std::vector<happened> found;
  for (const event *first = events_first(); first != nullptr; first = events_first()) {
    found.push_back({first->kind, first->value});
    events_drop_first();
  }
  return found;
}

/* One after another, a millisecond apart. */
void raise_all(native_bench &bench, std::initializer_list<happened> all) {
  for (const happened &one : all) {
    events_raise(one.kind, one.value);
    bench.run(MILLISECOND);
  }
}

constexpr uint8_t WHISKERS = EVENT_KIND_WHISKERS, LATCH = EVENT_KIND_LATCH, DEAD_MAN = EVENT_KIND_DEAD_MAN;

}  // namespace

TEST_CASE("four of any kind wait in their order, with their times") {
  native_bench bench;
  bench.run_to(bench.tick(2));
  for (uint16_t value = 1; value <= 4; value++) {
    events_raise(WHISKERS, value);
    bench.run(MILLISECOND);
  }
  for (uint16_t value = 1; value <= 4; value++) {
    REQUIRE(events_first() != nullptr);
    CHECK(events_first()->value == value);
    CHECK(events_first()->time == 20000u + 1000u * (value - 1u));
    events_drop_first();
  }
  CHECK(events_first() == nullptr);
  CHECK(events_deferred() == 0);
}

TEST_CASE("behind the full queue one of each kind waits: the latest, in the order of their times") {
  for (uint32_t first_tick : {UINT32_C(0), UINT32_C(429496)}) { /* in the second one the board's time rolls over */
    native_bench bench(RESET_CAUSE_POWER, 0, first_tick);
    bench.run_to(bench.tick(0) + 2 * MILLISECOND);
    raise_all(bench, {{DEAD_MAN, 1},
                      {DEAD_MAN, 2},
                      {DEAD_MAN, 3},
                      {DEAD_MAN, 4},
                      {LATCH, LATCH_STOP_COMMAND},
                      {DEAD_MAN, 5},
                      {WHISKERS, 1},
                      {LATCH, LATCH_NONE}});
    CHECK(collect() == std::vector<happened>{{DEAD_MAN, 1},
                                             {DEAD_MAN, 2},
                                             {DEAD_MAN, 3},
                                             {DEAD_MAN, 4},
                                             {DEAD_MAN, 5},
                                             {WHISKERS, 1},
                                             {LATCH, LATCH_NONE}});
    CHECK(events_deferred() == 4);
  }
}

TEST_CASE("touches that merge have the latest state and all that closed since") {
  native_bench bench;
  raise_all(bench, {{LATCH, 1}, {LATCH, 2}, {LATCH, 3}, {LATCH, 4}});
  events_raise(WHISKERS, 0x0101); /* left closed */
  events_raise(WHISKERS, 0x0203); /* right closed too */
  events_raise(WHISKERS, 0x0000); /* both open again */
  CHECK(collect().back() == happened{WHISKERS, 0x0300});
}

TEST_CASE("a collected event makes room: the next of its kind is one more") {
  native_bench bench;
  raise_all(bench, {{LATCH, 1}, {LATCH, 2}, {LATCH, 3}, {LATCH, 4}, {WHISKERS, 5}});
  events_drop_first(); /* the touch is the fourth now */
  raise_all(bench, {{WHISKERS, 6}, {WHISKERS, 7}});
  CHECK(collect() == std::vector<happened>{{LATCH, 2}, {LATCH, 3}, {LATCH, 4}, {WHISKERS, 5}, {WHISKERS, 7}});
}

TEST_CASE("forgetting touches leaves the stops of the motors in their order") {
  native_bench bench;
  raise_all(bench, {{WHISKERS, 1}, {DEAD_MAN, 2}, {WHISKERS, 3}, {LATCH, 4}, {WHISKERS, 5}, {DEAD_MAN, 6}});
  events_forget_touches();
  CHECK(collect() == std::vector<happened>{{DEAD_MAN, 2}, {LATCH, 4}, {DEAD_MAN, 6}});
}
