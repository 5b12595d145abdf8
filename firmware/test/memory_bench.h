/* memory_bench.h: a native machine for tests of what outlives a reset: EEPROM, memory that a reset leaves alone, supply.
 * It can be started again and again, and its power can be cut while a cell of the EEPROM is being written. One at a time:
 * the firmware's variables are those of this process. */
#ifndef MEMORY_BENCH_H
#define MEMORY_BENCH_H

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "generated/messages.h"
#include "hal/native/machine.h"

extern "C" const native_api *firmware_board_api(void);

using eeprom_image = std::array<uint8_t, NATIVE_EEPROM_SIZE>;

/* A cell while it is being written: what the EEPROM held then, and what the cell was to hold. */
struct eeprom_write {
  eeprom_image before;
  uint16_t address;
  uint8_t value;
};

class memory_bench {
 public:
  static constexpr uint64_t MILLISECOND = 16000; /* cycles */
  static constexpr uint64_t TICK = 160000;

  native_machine machine{};
  double volts = 5.0;
  std::vector<eeprom_write> writes; /* all that began in run() */

  memory_bench() {
    machine.next_edge = machine.next_byte = NATIVE_NEVER;
    std::memset(machine.output, NATIVE_RELEASED, sizeof machine.output);
    std::memset(machine.outside, NATIVE_RELEASED, sizeof machine.outside);
    std::memset(machine.eeprom, 0xFF, sizeof machine.eeprom);
    machine.edge = [](native_machine *, uint64_t, uint8_t, uint8_t) {};
    machine.transmit = [](native_machine *, uint64_t, const uint8_t *, size_t) {};
    machine.analog = [](native_machine *self, uint64_t, uint8_t channel) {
      return channel == NATIVE_SUPPLY ? reinterpret_cast<memory_bench *>(self)->volts : 0.0;
    };
  }
  explicit memory_bench(const eeprom_image &eeprom) : memory_bench() {
    std::memcpy(machine.eeprom, eeprom.data(), eeprom.size());
    power_on();
  }
  memory_bench(const memory_bench &) = delete;
  memory_bench &operator=(const memory_bench &) = delete;

  void reset(uint8_t cause) { api_->start(&machine, cause); }

  /* Power comes; memory that a reset leaves alone holds anything, another time something else. */
  void power_on() {
    machine.eeprom_writing = 0;
    spoil();
    reset(RESET_CAUSE_POWER);
  }

  void spoil() {
    for (uint8_t &byte : machine.noinit) {
      noise_ = noise_ * 1664525u + 1013904223u;
      byte = static_cast<uint8_t>(noise_ >> 24);
    }
  }

  /* Runs, and notes the cells that are written. A write takes 3.4 ms, so none begins unseen. */
  void run(uint64_t cycles) {
    const uint64_t end = machine.now + cycles;
    while (machine.now < end) {
      const uint64_t step = machine.now + MILLISECOND / 2;
      api_->advance(step < end ? step : end);
      if (machine.eeprom_writing && machine.eeprom_done != seen_) {
        seen_ = machine.eeprom_done;
        writes.push_back({eeprom(), machine.eeprom_address, machine.eeprom_value});
      }
    }
  }

  /* Runs without looking at the cells. */
  void run_blind(uint64_t cycles) { api_->advance(machine.now + cycles); }

  eeprom_image eeprom() const {
    eeprom_image image;
    std::memcpy(image.data(), machine.eeprom, image.size());
    return image;
  }

 private:
  const native_api *api_ = firmware_board_api();
  uint64_t seen_ = 0;
  static inline uint32_t noise_ = 1;
};

/* What the EEPROM may hold when the power was cut during that write: the cell as it was, erased, as it should be, or
 * something else. */
inline std::vector<eeprom_image> cut(const eeprom_write &write) {
  std::vector<eeprom_image> images;
  const uint8_t old = write.before[write.address];
  for (const int cell : {int{old}, 0xFF, int{write.value}, 0x00, 0xA5, 0x5A, old & write.value, old ^ 0x10,
                         write.value ^ 0x81}) { /* the marks of a record are among them */
    images.push_back(write.before);
    images.back()[write.address] = static_cast<uint8_t>(cell);
  }
  return images;
}

/* CRC-16/MCRF4XX of the catalogue of parametrised CRC algorithms: polynomial 0x1021, reflected, from 0xFFFF. Bit by bit. */
inline uint16_t crc16_bitwise(const uint8_t *bytes, size_t count) {
  uint16_t crc = 0xFFFF;
  for (size_t i = 0; i < count; i++) {
    crc = static_cast<uint16_t>(crc ^ bytes[i]);
    for (int bit = 0; bit < 8; bit++) {
      crc = static_cast<uint16_t>((crc & 1u) != 0 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
  }
  return crc;
}

#endif
