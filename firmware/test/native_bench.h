/* native_bench.h: the whole firmware on the bench: a native machine (hal/native/machine.h) whose pins and line the tests
 * hold in their hands, and the least of a host: it opens a session, numbers its requests, acknowledges events if it is
 * asked to, and remembers what the board said. Each bench is a fresh power-on. */
#ifndef NATIVE_BENCH_H
#define NATIVE_BENCH_H

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <vector>

#include "generated/messages.h"
#include "hal/native/machine.h"
#include "host_frame.h"
extern "C" {
#include "link/frame.h"
#include "link/session_seed.h"
#include "schedule.h"
}
#include "pins.h"

extern "C" const native_api *firmware_board_api(void);

constexpr uint64_t MILLISECOND = 16000; /* cycles */
constexpr uint64_t SLOT = 40000;
constexpr uint64_t TICK = 160000;

/* Pins of the encoders' lines; none where the wheels have no encoders. */
const std::vector<uint8_t> ENCODER_PINS = {
#if ENCODER_LINES == 2
    PIN_ENCODER_LEFT_A, PIN_ENCODER_LEFT_B, PIN_ENCODER_RIGHT_A, PIN_ENCODER_RIGHT_B
#elif ENCODER_LINES == 1
    PIN_ENCODER_LEFT, PIN_ENCODER_RIGHT
#endif
};

struct pin_edge {
  uint64_t cycle;
  uint8_t pin, level;
};

struct message {
  uint8_t id, sequence;
  std::vector<uint8_t> payload;
  uint64_t cycle; /* when its last byte had been handed to the sender */

  /* A test that asks for a message that never came has failed. */
  template <typename T>
  T as() const {
    T value;
    if (payload.size() != sizeof value) {
      throw std::runtime_error("the board has not sent this message");
    }
    std::memcpy(&value, payload.data(), sizeof value);
    return value;
  }
};

class native_bench {
 public:
  native_machine machine{};
  double volts = 5.0;                                /* of the supply */
  double analog[6] = {};                             /* at A0 to A5 */
  std::vector<pin_edge> edges;                       /* everything the firmware did to its pins */
  std::function<void(const pin_edge &)> answers_pin; /* a device: may drive pins at once */
  std::vector<message> messages; /* everything it said that is of this session or of the handshake */
  uint64_t bytes_out = 0;
  uint32_t seed = FRAME_NO_SESSION; /* of the session that the host believes in */
  uint16_t next_number = 1;         /* of the next request */
  uint8_t next_sequence = 0;
  bool acknowledges = false; /* every event at once */

  /* `first_tick`: number of the first tick, for what happens where counts roll over. */
  explicit native_bench(uint8_t reset_cause = RESET_CAUSE_POWER, uint64_t start = 0, uint32_t first_tick = 0) {
    machine.now = start;
    machine.next_edge = machine.next_byte = NATIVE_NEVER;
    std::memset(machine.output, NATIVE_RELEASED, sizeof machine.output);
    std::memset(machine.outside, NATIVE_RELEASED, sizeof machine.outside);
    for (uint8_t pin : ENCODER_PINS) {
      machine.outside[pin] = NATIVE_LOW; /* encoders drive their lines, other devices let them go */
    }
    std::memset(machine.eeprom, 0xFF, sizeof machine.eeprom);
    machine.edge = on_edge;
    machine.transmit = on_transmit;
    machine.analog = [](native_machine *self, uint64_t, uint8_t channel) {
      return channel == NATIVE_SUPPLY ? of(self).volts : of(self).analog[channel];
    };
    host_decoder_start(&decoder_, FRAME_NO_SESSION);
    api_->start(&machine, reset_cause);
    schedule_start(first_tick);
    start_ = machine.now;
  }
  native_bench(const native_bench &) = delete;
  native_bench &operator=(const native_bench &) = delete;
  ~native_bench() {
    for (auto &queue : machine.edges) {
      std::free(queue.edges);
    }
    std::free(machine.incoming.bytes);
  }

  void run(uint64_t cycles) { run_to(machine.now + cycles); }
  void run_to(uint64_t cycle) {
    while (attended_ && cycle >= next_probe_) {
      api_->advance(next_probe_);
      probe(0);
      next_probe_ = machine.now + PROBE_PERIOD;
    }
    api_->advance(cycle);
  }

  /* The cycle at which the slot, tick of that number (counted from the start) begins. */
  uint64_t slot(uint64_t number) const { return start_ + SLOT * (number + 1); }
  uint64_t tick(uint64_t number) const { return slot(4 * number); }

  /* Number of ticks since the start that have begun. */
  uint64_t ticks_begun() const { return machine.now < tick(0) ? 0 : (machine.now - tick(0)) / TICK + 1; }

  /* Queues an edge; each pin's in order of time. */
  void drive(uint64_t at, uint8_t pin, uint8_t level) {
    native_edge_queue &queue = machine.edges[pin];
    append(queue.edges, queue.first, queue.count, queue.capacity, native_edge{at, level});
    native_find_next_edge(&machine);
  }

  /* ---- line ---- */

  void send_bytes(const std::vector<uint8_t> &bytes) {
    native_byte_queue &queue = machine.incoming;
    if (line_free_ < machine.now) {
      line_free_ = machine.now;
    }
    for (uint8_t byte : bytes) {
      line_free_ += NATIVE_BYTE_CYCLES;
      append(queue.bytes, queue.first, queue.count, queue.capacity, native_byte{line_free_, byte, 0});
    }
    machine.next_byte = queue.count == 0 ? NATIVE_NEVER : queue.bytes[queue.first].cycle;
  }

  std::vector<uint8_t> frame(uint8_t id, const void *payload = nullptr, uint8_t length = 0) {
    std::vector<uint8_t> wire(FRAME_SIZE_MAX);
    wire.resize(frame_encode(wire.data(), id, next_sequence++, payload, length, seed));
    return wire;
  }
  void send(uint8_t id, const void *payload = nullptr, uint8_t length = 0) { send_bytes(frame(id, payload, length)); }

  template <typename T>
  void say(uint8_t id, const T &payload) {
    send(id, &payload, sizeof payload);
  }

  /* ---- the host's part of the protocol ---- */

  /* From now on the host's frames are made with that seed, and only such are understood. */
  void use_seed(uint32_t session) {
    seed = session;
    host_decoder_seed(&decoder_, session);
  }

  msg_hello hello() const { return last(MSG_HELLO_ID).as<msg_hello>(); }

  void say_open(uint32_t board_nonce, uint32_t host_nonce, uint8_t version = PROTOCOL_VERSION) {
    say(MSG_OPEN_ID, msg_open{version, board_nonce, host_nonce});
  }

  /* Opens a session with the nonce of the last hello; waits for the hello that answers, which comes once a tick. */
  void open(uint32_t host_nonce = 0x12345) {
    const uint32_t board_nonce = hello().board_nonce;
    say_open(board_nonce, host_nonce);
    use_seed(board_nonce ^ host_nonce);
    next_number = 1;
    for (uint64_t end = machine.now + 3 * TICK; machine.now < end && hello().session != seed;) {
      run(MILLISECOND);
    }
  }

  /* Waits for the hello and the first measurement of the supply, then opens and arms; runs 5 ticks and the time of the
   * frames. From the next tick on set-points move the motors. */
  void start() {
    run_to(tick(4));
    open();
    arm();
    run_to(tick(6));
  }

  void arm(uint8_t latches) { say(MSG_ARM_ID, msg_arm{next_number++, latches}); }
  void arm() {
    if (last(MSG_TELEMETRY_ID).payload.empty()) {
      run(TICK + MILLISECOND);
    }
    arm(telemetry().latches);
  }
  void stop(uint8_t token) { say(MSG_STOP_ID, msg_stop{token}); }
  void probe(uint16_t token) { say(MSG_CLOCK_PROBE_ID, msg_clock_probe{token}); }

  /* A set-point that answers the last telemetry. */
  void signal(int16_t left, int16_t right, uint16_t time_to_live) {
    signal(left, right, time_to_live, static_cast<uint16_t>(telemetry().tick));
  }
  void signal(int16_t left, int16_t right, uint16_t time_to_live, uint16_t answers_tick) {
    say(MSG_SETPOINT_SIGNAL_ID, msg_setpoint_signal{left, right, time_to_live, answers_tick});
  }
  void get(uint8_t parameter) { say(MSG_GET_PARAMETER_ID, msg_get_parameter{next_number++, parameter}); }
  void set(uint8_t parameter, int32_t value) {
    say(MSG_SET_PARAMETER_ID, msg_set_parameter{next_number++, parameter, value});
  }
  void save() { say(MSG_SAVE_PARAMETERS_ID, msg_save_parameters{next_number++}); }

  /* Runs that long, and keeps the session open meanwhile. */
  void run_in_session(uint64_t cycles) {
    const bool before = attended_;
    attended_ = true;
    run(cycles);
    attended_ = before;
  }

  /* Opens a session before the first tick, thus before the first hello, and keeps it open whenever time goes by: for tests of
   * devices. */
  void attend() {
    say_open(session_board_nonce(), 0x12345);
    use_seed(session_board_nonce() ^ 0x12345);
    run_to(tick(0) - 1);
    attended_ = true;
  }

  /* ---- what it said ---- */

  /* The last message of that id; its payload is empty if there is none. */
  message last(uint8_t id) const {
    for (auto found = messages.rbegin(); found != messages.rend(); ++found) {
      if (found->id == id) {
        return *found;
      }
    }
    return message{0, 0, {}, 0};
  }
  std::vector<message> all(uint8_t id) const {
    std::vector<message> found;
    for (const message &m : messages) {
      if (m.id == id) {
        found.push_back(m);
      }
    }
    return found;
  }
  size_t count(uint8_t id) const { return all(id).size(); }
  msg_telemetry telemetry() const { return last(MSG_TELEMETRY_ID).as<msg_telemetry>(); }
  msg_devices_telemetry devices() const { return last(MSG_DEVICES_TELEMETRY_ID).as<msg_devices_telemetry>(); }
  msg_answer answer() const { return last(MSG_ANSWER_ID).as<msg_answer>(); }

  /* The board's counters, sent every 80 ticks: waits for the next ones. */
  msg_counters counters() {
    const size_t before = count(MSG_COUNTERS_ID);
    for (int i = 0; i < 20 && count(MSG_COUNTERS_ID) == before; i++) {
      run_in_session(5 * TICK);
    }
    return last(MSG_COUNTERS_ID).as<msg_counters>();
  }

  std::vector<pin_edge> edges_of(uint8_t pin) const {
    std::vector<pin_edge> found;
    for (const pin_edge &edge : edges) {
      if (edge.pin == pin) {
        found.push_back(edge);
      }
    }
    return found;
  }

 private:
  static native_bench &of(native_machine *machine) { return *reinterpret_cast<native_bench *>(machine); }

  static void on_edge(native_machine *machine, uint64_t cycle, uint8_t pin, uint8_t level) {
    native_bench &self = of(machine);
    self.edges.push_back({cycle, pin, level});
    if (self.answers_pin) {
      self.answers_pin(self.edges.back());
    }
  }
  static void on_transmit(native_machine *machine, uint64_t, const uint8_t *bytes, size_t count) {
    native_bench &self = of(machine);
    self.bytes_out += count;
    for (size_t i = 0; i < count; i++) {
      if (host_decode(&self.decoder_, bytes[i])) {
        self.hear();
      }
    }
  }

  void hear() {
    const uint8_t id = host_message_id(&decoder_);
    const uint8_t *payload = host_message_payload(&decoder_);
    messages.push_back({id, host_message_sequence(&decoder_),
                        std::vector<uint8_t>(payload, payload + message_length_to_host(id)), machine.now});
    if (id == MSG_EVENT_ID && acknowledges) {
      say(MSG_ACKNOWLEDGE_ID, msg_acknowledge{messages.back().as<msg_event>().number});
    }
  }

  template <typename T>
  static void append(T *&items, size_t &first, size_t &count, size_t &capacity, T item) {
    if (first + count == capacity) {
      capacity = 2 * capacity + 16;
      items = static_cast<T *>(std::realloc(items, capacity * sizeof(T)));
    }
    items[first + count++] = item;
  }

  static constexpr uint64_t PROBE_PERIOD = 5 * TICK;

  const native_api *api_ = firmware_board_api();
  bool attended_ = false; /* the host probes the clock, so that the session stays open */
  uint64_t next_probe_ = 0;
  uint64_t start_ = 0;
  uint64_t line_free_ = 0;
  host_decoder decoder_{};
};

/* A bench with a session from the first tick on. */
class attended_bench : public native_bench {
 public:
  attended_bench() { attend(); }
};

#endif
