/* native_bench.h: the whole firmware on the bench: a native machine (hal/native/machine.h) whose pins and line the tests
 * hold in their hands. Each bench is a fresh power-on. */
#ifndef NATIVE_BENCH_H
#define NATIVE_BENCH_H

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "generated/messages.h"
#include "hal/native/machine.h"
#include "link/frame.h"
#include "pins.h"

extern "C" const native_api *firmware_board_api(void);

constexpr uint64_t MILLISECOND = 16000; /* cycles */
constexpr uint64_t SLOT = 40000;
constexpr uint64_t TICK = 160000;

struct pin_edge {
  uint64_t cycle;
  uint8_t pin, level;
};

struct message {
  uint8_t id, sequence;
  std::vector<uint8_t> payload;

  template <typename T>
  T as() const {
    T value;
    std::memcpy(&value, payload.data(), sizeof value);
    return value;
  }
};

class native_bench {
 public:
  native_machine machine{};
  std::vector<pin_edge> edges;   /* everything the firmware did to its pins */
  std::vector<message> messages; /* everything it said */
  uint64_t bytes_out = 0;

  explicit native_bench(uint8_t reset_cause = RESET_CAUSE_POWER, uint64_t start = 0) {
    machine.now = start;
    machine.next_edge = machine.next_byte = NATIVE_NEVER;
    std::memset(machine.output, NATIVE_RELEASED, sizeof machine.output);
    std::memset(machine.outside, NATIVE_RELEASED, sizeof machine.outside);
    machine.edge = on_edge;
    machine.transmit = on_transmit;
    frame_decoder_start(&decoder_, FRAME_SEED);
    api_->start(&machine, reset_cause);
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

  void run(uint64_t cycles) { api_->advance(machine.now + cycles); }
  void run_to(uint64_t cycle) { api_->advance(cycle); }

  /* The cycle at which the slot, tick of that number begins. */
  uint64_t slot(uint64_t number) const { return start_ + SLOT * (number + 1); }
  uint64_t tick(uint64_t number) const { return slot(4 * number); }

  /* Queues an edge; each pin's in order of time. */
  void drive(uint64_t at, uint8_t pin, uint8_t level) {
    native_edge_queue &queue = machine.edges[pin];
    append(queue.edges, queue.first, queue.count, queue.capacity, native_edge{at, level});
    native_find_next_edge(&machine);
  }

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

  void send(uint8_t id, const void *payload = nullptr, uint8_t length = 0) {
    std::vector<uint8_t> wire(FRAME_SIZE_MAX);
    wire.resize(frame_encode(wire.data(), id, next_sequence_++, payload, length, FRAME_SEED));
    send_bytes(wire);
  }
  void signal(int16_t left, int16_t right, uint16_t time_to_live) {
    const msg_setpoint_signal setpoint{left, right, time_to_live, 0};
    send(MSG_SETPOINT_SIGNAL_ID, &setpoint, sizeof setpoint);
  }
  void set(uint8_t parameter, int32_t value) {
    const msg_set_parameter request{parameter, value};
    send(MSG_SET_PARAMETER_ID, &request, sizeof request);
  }

  /* The last message of that id; its payload is empty if there is none. */
  message last(uint8_t id) const {
    for (auto found = messages.rbegin(); found != messages.rend(); ++found) {
      if (found->id == id) {
        return *found;
      }
    }
    return message{0, 0, {}};
  }
  msg_telemetry telemetry() const { return last(MSG_TELEMETRY_ID).as<msg_telemetry>(); }

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
    of(machine).edges.push_back({cycle, pin, level});
  }
  static void on_transmit(native_machine *machine, uint64_t, const uint8_t *bytes, size_t count) {
    native_bench &self = of(machine);
    self.bytes_out += count;
    for (size_t i = 0; i < count; i++) {
      if (frame_decode(&self.decoder_, bytes[i])) {
        const uint8_t *payload = frame_payload(&self.decoder_);
        const uint8_t id = frame_id(&self.decoder_);
        self.messages.push_back(
            {id, frame_sequence(&self.decoder_), std::vector<uint8_t>(payload, payload + message_length(id))});
      }
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

  const native_api *api_ = firmware_board_api();
  uint64_t start_ = 0;
  uint64_t line_free_ = 0;
  uint8_t next_sequence_ = 0;
  frame_decoder decoder_{};
};

#endif
