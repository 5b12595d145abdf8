/* link_fuzzer.cpp: the whole firmware on a native machine, with a host that says anything: damaged bytes, whole messages with
 * any content, sessions opened at any moment, whiskers pressed, the supply sagging. Guided by coverage (libFuzzer), under
 * the address and undefined-behaviour sanitizers. What must hold whatever happens:
 *
 *   nobody armed: no pulse has left the board;
 *   afterwards the board still says hello, opens a session, answers a request and a stop, and gives no pulse after it.
 *
 * An input is a row of actions, each a byte and what it takes. */
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "../test/native_bench.h"
#include "generated/parameters.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

namespace {

enum action : uint8_t { RAW, MESSAGE, RUN, WHISKER, OPEN, SUPPLY, ARM, SET_POINT, ACTIONS };

struct kind {
  uint8_t id, length;
};

#define ROW(id, length, hash) {(id), (length)},
constexpr kind KINDS[] = {MESSAGE_LIST(ROW)};

/* The rest of the input, byte by byte; zeros behind its end. */
class input {
 public:
  input(const uint8_t *data, size_t size) : data_(data), end_(data + size) {}
  bool is_empty() const { return data_ == end_; }
  uint8_t byte() { return is_empty() ? uint8_t{0} : *data_++; }
  std::vector<uint8_t> bytes(size_t count) {
    std::vector<uint8_t> some(count);
    for (uint8_t &one : some) {
      one = byte();
    }
    return some;
  }

 private:
  const uint8_t *data_, *end_;
};

bool is_high_on_servo(const pin_edge &edge) {
  return (edge.pin == PIN_SERVO_LEFT || edge.pin == PIN_SERVO_RIGHT) && edge.level == NATIVE_HIGH;
}

size_t pulses(const native_bench &bench) {
  size_t count = 0;
  for (const pin_edge &edge : bench.edges) {
    count += is_high_on_servo(edge);
  }
  return count;
}

/* A message of any kind, to either side, with any content, in a right frame of the session. True if it may arm. */
bool send_any(native_bench &bench, input &from) {
  const kind &chosen = KINDS[from.byte() % (sizeof KINDS / sizeof KINDS[0])];
  const std::vector<uint8_t> payload = from.bytes(chosen.length);
  bench.send(chosen.id, payload.data(), chosen.length);
  return chosen.id == MSG_ARM_ID;
}

void act(native_bench &bench, input &from, bool &armed) {
  switch (from.byte() % ACTIONS) {
    case RAW:
      bench.send_bytes(from.bytes(from.byte() % 64u));
      break;
    case MESSAGE:
      armed = send_any(bench, from) || armed;
      break;
    case RUN:
      bench.run((from.byte() % 64u + 1u) * MILLISECOND);
      break;
    case WHISKER:
      bench.drive(bench.machine.now + 1, PIN_WHISKER_LEFT, from.byte() % 2u != 0 ? NATIVE_LOW : NATIVE_RELEASED);
      break;
    case OPEN:
      if (bench.count(MSG_HELLO_ID) > 0) { /* it comes with the first tick */
        bench.open(0x100u + from.byte());
      }
      break;
    case SUPPLY:
      bench.volts = 3.5 + from.byte() / 128.0;
      break;
    case ARM:
      bench.run(2 * TICK);
      if (bench.count(MSG_TELEMETRY_ID) > 0) {
        bench.arm(bench.telemetry().latches);
        armed = true;
      }
      break;
    default:
      if (bench.count(MSG_TELEMETRY_ID) > 0) {
        bench.signal(static_cast<int16_t>(100 * from.byte()), 5000, 500);
      }
      break;
  }
}

/* The board answers a host that comes afresh, and stops. */
void check_that_it_lives(native_bench &bench) {
  bench.use_seed(FRAME_NO_SESSION);
  bench.send_bytes({0}); /* what was cut off before ends here */
  bench.volts = 5.0;
  bench.run(300 * TICK); /* whatever session there was is over */
  bench.messages.clear();
  bench.run(22 * TICK);
  assert(bench.count(MSG_HELLO_ID) > 0);
  bench.open(0x54321);
  bench.run(2 * TICK); /* the session's task says hello */
  assert(bench.hello().session == bench.seed);
  bench.get(PARAMETER_TIME_TO_LIVE);
  bench.stop(77);
  bench.run(4 * TICK);
  assert(bench.count(MSG_ANSWER_ID) > 0);
  assert(bench.count(MSG_STOPPED_ID) > 0);
  bench.edges.clear();
  bench.run(5 * TICK);
  assert(pulses(bench) == 0);
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  native_bench bench;
  input from(data, size);
  bool armed = false;
  bench.run(2 * TICK); /* it has said hello */
  while (!from.is_empty()) {
    act(bench, from, armed);
  }
  bench.run(2 * TICK);
  assert(armed || pulses(bench) == 0);
  check_that_it_lives(bench);
  return 0;
}
