/* two_wire_device.h: a device on the two-wire bus, bit by bit on the pins of a native bench (NXP UM10204): registers behind
 * a pointer that moves on, as the HMC5883L has them. It can be unplugged, hold the data line, or hold the clock. */
#ifndef TWO_WIRE_DEVICE_H
#define TWO_WIRE_DEVICE_H

#include <array>
#include <cstdint>

#include "native_bench.h"

class two_wire_device {
 public:
  std::array<uint8_t, 16> registers{};
  bool plugged = true;
  int holds_data = 0; /* more falls of the clock for which it holds the data line */
  unsigned transfers = 0;

  two_wire_device(native_bench &bench, uint8_t address) : bench_(bench), address_(address) {
    bench.answers_pin = [this](const pin_edge &edge) { see(edge); };
  }

  /* Holds the data line low until the clock has fallen so often. */
  void hold_data(int falls) {
    holds_data = falls;
    pull(bench_.machine.now + 1, true);
  }

 private:
  enum { IDLE, ADDRESS, WRITE, READ };

  void pull(uint64_t at, bool low) {
    bench_.drive(at, PIN_COMPASS_SDA, low ? NATIVE_LOW : NATIVE_RELEASED);
    pulls_ = low;
  }

  void see(const pin_edge &edge) {
    const bool high = edge.level != NATIVE_LOW;
    if (edge.pin == PIN_COMPASS_SDA && high != data_) {
      data_ = high;
      if (clock_ && !pulls_ && plugged) {
        state_ = high ? IDLE : ADDRESS;
        bit_ = -1;
      }
    } else if (edge.pin == PIN_COMPASS_SCL && high != clock_) {
      clock_ = high;
      if (high) {
        rise();
      } else {
        fall(edge.cycle + 5);
      }
    }
  }

  void rise() {
    if (bit_ >= 0 && bit_ < 8 && state_ != READ) {
      shift_ = static_cast<uint8_t>(shift_ << 1 | (data_ ? 1 : 0));
    } else if (bit_ == 8 && state_ == READ && data_) {
      state_ = IDLE; /* not acknowledged: the last byte */
    }
  }

  void fall(uint64_t at) {
    if (holds_data > 0) {
      if (--holds_data == 0) {
        pull(at, false);
      }
      return;
    }
    if (state_ == IDLE || !plugged) {
      return;
    }
    bit_++;
    if (bit_ == 8 && state_ != READ) {
      pull(at, take_byte());
    } else if (bit_ == 9) {
      bit_ = 0;
      if (state_ == ADDRESS) {
        state_ = (shift_ & 1) != 0 ? READ : WRITE;
        pointer_set_ = false;
        transfers++;
      }
      if (state_ == READ) {
        shift_ = registers[pointer_++ % registers.size()];
      } else {
        pull(at, false);
      }
    }
    if (state_ == READ) {
      pull(at, bit_ < 8 && (shift_ >> (7 - bit_) & 1) == 0);
    }
  }

  /* Whether a byte that has come is acknowledged. */
  bool take_byte() {
    if (state_ == ADDRESS) {
      if (shift_ >> 1 != address_) {
        state_ = IDLE;
        return false;
      }
    } else if (!pointer_set_) {
      pointer_ = shift_;
      pointer_set_ = true;
    } else {
      registers[pointer_++ % registers.size()] = shift_;
    }
    return true;
  }

  native_bench &bench_;
  uint8_t address_;
  bool data_ = true, clock_ = true, pulls_ = false, pointer_set_ = false;
  int state_ = IDLE, bit_ = -1;
  uint8_t shift_ = 0, pointer_ = 0;
};

#endif
