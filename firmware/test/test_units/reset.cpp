/* Reset: causes from the chip or from the record, and nonces. */
#include <doctest.h>

#include <set>

extern "C" {
#include "hal/interrupts.h"
#include "reset.h"
#include "task_times.h"
#include "tasks.h"
}
#include "memory_bench.h"

namespace {

constexpr uint32_t NONCES = 1u << 21;

/* Bits in which two numbers differ. */
int distance(uint32_t a, uint32_t b) {
  int bits = 0;
  for (uint32_t x = a ^ b; x != 0; x &= x - 1) {
    bits++;
  }
  return bits;
}

}  // namespace

TEST_CASE("a cause that the chip knows is reported") {
  memory_bench bench;
  bench.power_on();
  CHECK(reset_cause() == RESET_CAUSE_POWER);
  for (uint8_t cause : {RESET_CAUSE_EXTERNAL, RESET_CAUSE_BROWN_OUT, RESET_CAUSE_WATCHDOG}) {
    bench.reset(cause);
    CHECK(reset_cause() == cause);
  }
}

TEST_CASE("behind a bootloader that clears the cause a whole record means an external reset") {
  memory_bench bench;
  bench.power_on();
  for (int i = 0; i < 3; i++) {
    bench.reset(RESET_CAUSE_UNKNOWN);
    CHECK(reset_cause() == RESET_CAUSE_EXTERNAL);
  }
}

TEST_CASE("behind such a bootloader a watchdog that spoke before it bit is reported, once") {
  memory_bench bench;
  bench.power_on();
  bench.run(memory_bench::TICK);
  reset_on_watchdog();
  bench.reset(RESET_CAUSE_UNKNOWN);
  CHECK(reset_cause() == RESET_CAUSE_WATCHDOG);
  bench.reset(RESET_CAUSE_UNKNOWN);
  CHECK(reset_cause() == RESET_CAUSE_EXTERNAL);
}

TEST_CASE("a watchdog reset is reported with the task that ran, and with none between tasks") {
  for (const uint8_t chip : {RESET_CAUSE_WATCHDOG, RESET_CAUSE_UNKNOWN}) { /* the latter behind such a bootloader */
    memory_bench bench;
    bench.power_on();
    for (uint8_t task = 0; task < TASK_COUNT; task++) {
      bench.run(memory_bench::TICK);
      task_begins(task);
      reset_on_watchdog();
      bench.reset(chip);
      CHECK(reset_cause() == RESET_CAUSE_WATCHDOG + 1 + task);
      bench.run(memory_bench::TICK);
      CHECK(reset_cause() == RESET_CAUSE_WATCHDOG + 1 + task); /* as long as this run lasts */
    }
    task_begins(TASK_encoder);
    task_has_ended();
    reset_on_watchdog();
    bench.reset(chip);
    CHECK(reset_cause() == RESET_CAUSE_WATCHDOG);
  }
}

TEST_CASE("a task that ran at a reset of another cause is not reported, nor at the next watchdog reset") {
  memory_bench bench;
  bench.power_on();
  for (const uint8_t cause : {RESET_CAUSE_EXTERNAL, RESET_CAUSE_BROWN_OUT}) {
    bench.run(memory_bench::TICK);
    task_begins(TASK_encoder);
    bench.reset(cause);
    CHECK(reset_cause() == cause);
    bench.reset(RESET_CAUSE_WATCHDOG); /* before any task has run */
    CHECK(reset_cause() == RESET_CAUSE_WATCHDOG);
  }
}

TEST_CASE("a number that is no task's is not believed") {
  memory_bench bench;
  for (const int number : {TASK_COUNT + 1, 255}) {
    bench.power_on();
    reset_note_running(static_cast<uint8_t>(number));
    bench.reset(RESET_CAUSE_WATCHDOG);
    CHECK(reset_cause() == RESET_CAUSE_WATCHDOG);
  }
}

TEST_CASE("after a power failure no task is reported") {
  memory_bench bench;
  for (int i = 0; i < 100; i++) {
    bench.power_on();
    task_begins(TASK_encoder);
    bench.spoil();
    bench.reset(RESET_CAUSE_WATCHDOG);
    CHECK(reset_cause() == RESET_CAUSE_WATCHDOG);
  }
}

TEST_CASE("what the chip knows counts more than the record") {
  memory_bench bench;
  bench.power_on();
  reset_on_watchdog();
  bench.reset(RESET_CAUSE_EXTERNAL);
  CHECK(reset_cause() == RESET_CAUSE_EXTERNAL);
  bench.reset(RESET_CAUSE_UNKNOWN); /* and takes the mark away */
  CHECK(reset_cause() == RESET_CAUSE_EXTERNAL);
}

TEST_CASE("behind such a bootloader a broken record means that the power came") {
  memory_bench bench;
  for (int i = 0; i < 1000; i++) {
    bench.power_on();
    reset_on_watchdog();
    bench.spoil();
    bench.reset(RESET_CAUSE_UNKNOWN);
    CHECK(reset_cause() == RESET_CAUSE_POWER);
  }
}

TEST_CASE("a record with a wrong bit means no watchdog") {
  memory_bench bench;
  for (int bit = 0; bit < 8 * 12; bit++) {
    bench.power_on();
    reset_on_watchdog();
    uint8_t &byte = bench.machine.noinit[bit / 8];
    byte = static_cast<uint8_t>(byte ^ 1 << bit % 8);
    bench.reset(RESET_CAUSE_UNKNOWN);
    CAPTURE(bit);
    CHECK(reset_cause() < RESET_CAUSE_WATCHDOG);
  }
}

TEST_CASE("nonces: 21 bits, not 0, another one after each reset") {
  memory_bench bench;
  bench.power_on();
  std::set<uint32_t> seen;
  for (int i = 0; i < 5000; i++) {
    const uint32_t nonce = reset_nonce();
    CHECK(nonce > 0);
    CHECK(nonce < NONCES);
    CHECK(seen.insert(nonce).second);
    bench.reset(i % 2 == 0 ? RESET_CAUSE_EXTERNAL : RESET_CAUSE_UNKNOWN);
  }
}

TEST_CASE("nonces of one start: nearly all numbers come once before one comes again") {
  memory_bench bench;
  bench.power_on();
  std::vector<uint8_t> seen(NONCES);
  uint32_t again = 0;
  for (uint32_t i = 0; i < NONCES; i++) {
    const uint32_t nonce = reset_nonce();
    again += seen[nonce];
    seen[nonce] = 1;
  }
  CHECK(seen[0] == 0);
  CHECK(again == 1); /* in place of 0 */
}

TEST_CASE("nonces that follow each other differ in half of their bits") {
  memory_bench bench;
  bench.power_on();
  uint32_t last = reset_nonce();
  int total = 0;
  for (int i = 0; i < 10000; i++) {
    const uint32_t nonce = reset_nonce();
    total += distance(nonce, last);
    last = nonce;
  }
  CHECK(total > 9 * 10000);
  CHECK(total < 12 * 10000);
}

TEST_CASE("power-ons draw from all nonces: as many coincidences as chance gives") {
  memory_bench bench;
  std::set<uint32_t> seen;
  int again = 0;
  for (int i = 0; i < 4000; i++) {
    bench.power_on();
    again += !seen.insert(reset_nonce()).second;
  }
  CHECK(again <= 14); /* 4000^2 / 2 / 2^21 = 3.8 expected; more than 14 once in 100,000 */
}
