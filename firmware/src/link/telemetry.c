/* telemetry.c: see telemetry.h. */
#include "link/telemetry.h"

#include "clock.h"
#include "generated/devices.h"
#include "link/counters.h"
#include "link/frame.h"
#include "link/send.h"
#include "link/session_seed.h"
#include "parameters.h"
#include "reset.h"
#include "safety.h"
#include "schedule.h"
#include "storage.h"
#include "supply.h"
#include "tasks.h"

static uint8_t line_period; /* ticks */
static uint8_t due_in;      /* ticks until the next is sent */

void telemetry_start_line(void) {
  const uint8_t least = send_ticks(2u * (MSG_TELEMETRY_LENGTH + FRAME_OVERHEAD));
  line_period = least <= 2u ? least : least <= 5u ? 5u : 10u; /* 1, 2, 5, 10 */
}
_Static_assert(10u * 2u * (MSG_TELEMETRY_LENGTH + FRAME_OVERHEAD) <= 10u * 96u, "9600 bit/s need no longer one");

void telemetry_start(void) { due_in = 1; }

uint8_t telemetry_line_period(void) { return line_period; }

uint8_t telemetry_period(void) {
  const uint16_t wanted = parameters_u16(PARAMETER_TELEMETRY_PERIOD); /* up to 100 */
  return (uint8_t)(wanted > line_period ? wanted : line_period);
}

static uint16_t status_bits(void) {
  uint16_t status = safety_status();
  if (schedule_overran()) {
    status |= STATUS_TICK_OVERRUN;
  }
  if (counters_bytes_lost()) {
    status |= STATUS_RECEIVE_OVERRUN;
  }
  if (reset_cause() >= RESET_CAUSE_WATCHDOG) {
    status |= STATUS_WATCHDOG_RESET;
  }
  if (supply_low()) {
    status |= STATUS_SUPPLY_LOW;
  }
  if (storage_busy()) {
    status |= STATUS_SAVING;
  }
  return status;
}

/* In every tick: collects and sends when it is its turn in a session. Latest wins: without room on the line it is left
 * out, and the host sees the gap. */
void telemetry_task(void) {
  if (!session_is_open() || --due_in != 0) {
    return;
  }
  due_in = telemetry_period();
  msg_telemetry telemetry = {
      .tick = clock_tick(),
      .time = clock_tick_time(),
      .status = status_bits(),
      .latch = safety_latched(),
      .latches = safety_latches(),
      .setpoint_sequence = safety_setpoint_sequence(),
      .overruns = schedule_overruns(),
  };
  devices_report_telemetry(&telemetry);
  send_message(MSG_TELEMETRY_ID, &telemetry, sizeof telemetry);
}
