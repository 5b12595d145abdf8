/* two_wire.c: see two_wire.h. */
#include "two_wire.h"

#include "hal/hal.h"
#include "hal/interrupts.h"

/* Shared with the interrupt; written before a transfer begins, read after it has ended. */
static volatile uint8_t target; /* address << 1, and 1 while reading */
static volatile uint8_t to_write[TWO_WIRE_WRITE_MAX], write_count, written;
static volatile uint8_t to_read[TWO_WIRE_READ_MAX], read_count, has_read;
static volatile uint8_t result;

void two_wire_start(void) {
  result = TWO_WIRE_FAILED;
  hal_two_wire_on();
}

void two_wire_stop(void) {
  hal_two_wire_off();
  result = TWO_WIRE_FAILED;
}

void two_wire_begin(uint8_t address, const uint8_t *bytes, uint8_t writes, uint8_t reads) {
  target = (uint8_t)(address << 1);
  for (uint8_t i = 0; i < writes; i++) {
    LOOP_BOUND(TWO_WIRE_WRITE_MAX);
    to_write[i] = bytes[i];
  }
  write_count = writes;
  read_count = reads;
  written = has_read = 0;
  result = TWO_WIRE_BUSY;
  hal_two_wire_begin();
}

two_wire_result two_wire_ended(void) { return (two_wire_result)result; }

const volatile uint8_t *two_wire_bytes(void) { return to_read; }

static inline void end(two_wire_result how) {
  result = (uint8_t)how;
  hal_two_wire_end();
}

void two_wire_on_step(void) {
  switch (hal_two_wire_status()) {
    case HAL_TWO_WIRE_STARTED:
    case HAL_TWO_WIRE_STARTED_AGAIN:
      hal_two_wire_send(target);
      break;
    case HAL_TWO_WIRE_ADDRESS_TAKEN:
    case HAL_TWO_WIRE_BYTE_TAKEN:
      if (written < write_count) {
        hal_two_wire_send(to_write[written++]);
      } else if (read_count != 0) {
        target |= 1u;
        hal_two_wire_begin();
      } else {
        end(TWO_WIRE_OK);
      }
      break;
    case HAL_TWO_WIRE_BYTE_READ:
    case HAL_TWO_WIRE_LAST_READ:
      to_read[has_read++] = hal_two_wire_byte();
      /* fall through */
    case HAL_TWO_WIRE_READ_TAKEN: {
      const uint8_t left = (uint8_t)(read_count - has_read);
      if (left != 0) {
        hal_two_wire_receive(left > 1u);
      } else {
        end(TWO_WIRE_OK);
      }
      break;
    }
    case HAL_TWO_WIRE_ADDRESS_REFUSED:
    case HAL_TWO_WIRE_READ_REFUSED:
      end(TWO_WIRE_NO_ANSWER);
      break;
    default:
      end(TWO_WIRE_FAILED);
      break;
  }
}
