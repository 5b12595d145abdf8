/* schedule.c: slots, tasks and overruns; see schedule.h and tasks.def. */
#include "schedule.h"

#include "analog.h"
#include "bounds.h"
#include "buzzer.h"
#include "compass.h"
#include "encoder.h"
#include "generated/messages.h"
#include "generated/parameters.h"
#include "infrared.h"
#include "light.h"
#include "link/counters.h"
#include "link/devices.h"
#include "link/events.h"
#include "link/link.h"
#include "link/requests.h"
#include "link/session.h"
#include "link/telemetry.h"
#include "ping.h"
#include "pins.h"
#include "safety.h"
#include "servo.h"
#include "storage.h"
#include "supply.h"
#include "task_times.h"
#include "turret.h"
#include "whisker.h"

#define SLOTS_PER_FRAME 8u
#define SLOT_US (SCHEDULE_TICK_US / SCHEDULE_SLOTS_PER_TICK)
#define SLOTS_KEPT (2u * SCHEDULE_SLOTS_PER_TICK) /* that may wait; of more, whole ticks are dropped */
#define OVERLOAD_TICKS 10u                        /* ticks in a row that overran: the watchdog ends it */

#define TASK(name, period, phase, budget) \
  _Static_assert(256 % (period) == 0 && (phase) < (period), "task " #name ": period and phase");
#include "tasks.def"
_Static_assert(HAL_SLOT_CYCLES == SLOT_US * HAL_CYCLES_PER_US, "both clocks go together");

#ifdef __AVR__
/* The timing table as part of the image, so that an image can be judged without its sources: a text for each row, ended by
 * a zero byte, in a section that is not loaded. Behind the rows of tasks.def there is one for each message to the board, and one
 * for each constant on which the bounds depend. */
#define ROW(text) __asm__(".pushsection .boebot.timing, \"\", @progbits \n .asciz \"" text "\" \n .popsection");
#define TASK(name, period, phase, budget) ROW("TASK " #name " " #period " " #phase " " #budget)
#define INTERRUPT(name, vector, budget, latency, interval) \
  ROW("INTERRUPT " #name " " #vector " " #budget " " #latency " " #interval)
#define SENSOR(name, conversion, period, age) ROW("SENSOR " #name " " #conversion " " #period " " #age)
#include "tasks.def"
#define FRAME(name, id, length) ROW("FRAME " #name " " #id " " #length)
MESSAGES_TO_BOARD(FRAME)

/* A constant's value may be an expression, and so is an operand: these stand in a function of which there is one. */
#define CONSTANT(name, value)                                                        \
  __asm__(".pushsection .boebot.timing, \"\", @progbits \n .asciz \"CONSTANT " #name \
          " %0\" \n .popsection" ::"n"((uint32_t)(value)))
#define LIMIT_OF(name, type, least, most, first) +(PARAMETER_##name == PARAMETER_ENCODER_LIMIT ? (int32_t)(first) : 0)
#define TELL_CONSTANTS()                                       \
  CONSTANT(slot_cycles, HAL_SLOT_CYCLES);                      \
  CONSTANT(slots_per_tick, SCHEDULE_SLOTS_PER_TICK);           \
  CONSTANT(slots_kept, SLOTS_KEPT);                            \
  CONSTANT(receive_due, HAL_RECEIVE_DUE);                      \
  CONSTANT(encoder_limit, PARAMETER_LIST(LIMIT_OF));           \
  CONSTANT(changes_due, ENCODER_DUE_BYTES / HAL_CHANGE_BYTES); \
  CONSTANT(change_bytes, HAL_CHANGE_BYTES);                    \
  CONSTANT(changes_close, HAL_CHANGES_CLOSE);                  \
  CONSTANT(changes_storm, HAL_CHANGES_STORM)
#else
#define LIMIT_OF(name, type, least, most, first) +(PARAMETER_##name == PARAMETER_ENCODER_LIMIT ? (int32_t)(first) : 0)
#define TELL_CONSTANTS() ((void)0)
#endif

HAL_NAMED volatile uint8_t schedule_slot;
uint8_t schedule_next_slot;
volatile uint16_t schedule_slot_start;

static volatile uint32_t slot_cycles; /* time at which schedule_slot began */
static volatile uint32_t slot_us;     /* the same on the board's clock */
static volatile bool edge_is_servo;   /* whom the next edge interrupt is for */

static uint32_t tick;
static uint32_t tick_us; /* time on the board's clock at which it begins, or has begun */
static uint8_t overruns;
static bool late;           /* a slot of this tick was worked on when the next tick had begun */
static bool overran;        /* so it was in the previous tick, or ticks were dropped */
static uint8_t overrun_row; /* ticks in a row that overran, at most OVERLOAD_TICKS */

void schedule_start(uint32_t first_tick) {
  TELL_CONSTANTS();
  schedule_slot = 0xFF;
  HAL_ZERO(schedule_slot_start);
  HAL_ZERO(slot_cycles);
  tick = first_tick;
  tick_us = first_tick * SCHEDULE_TICK_US;
  slot_us = tick_us - SLOT_US; /* the first slot is still to begin */
  HAL_ZERO(edge_is_servo);
  HAL_ZERO(schedule_next_slot);
  HAL_ZERO(overruns);
  HAL_ZERO(late);
  HAL_ZERO(overran);
  HAL_ZERO(overrun_row);
}

HAL_INTERRUPT_SLOT {
  schedule_slot++;
  hal_serial_look();
  schedule_slot_start = (uint16_t)(schedule_slot_start + HAL_SLOT_CYCLES);
  slot_cycles += HAL_SLOT_CYCLES;
  slot_us += SLOT_US;
  hal_slot_arm((uint16_t)(schedule_slot_start + HAL_SLOT_CYCLES));
  switch (schedule_slot % SLOTS_PER_FRAME) {
    case 0:
      servo_frame();
      edge_is_servo = true;
      servo_begin(LEFT, schedule_slot_start);
      break;
    case 1:
      servo_begin(RIGHT, schedule_slot_start);
      break;
    case 2:
    case 6:
      edge_is_servo = false;
      infrared_begin(LEFT, schedule_slot_start);
      break;
    case 3:
    case 7:
      infrared_begin(RIGHT, schedule_slot_start);
      break;
    case 4:
      edge_is_servo = true;
      servo_begin(SERVO_TURRET, schedule_slot_start);
      break;
    default:
      break;
  }
  hal_serial_look();
}

HAL_INTERRUPT_EDGE {
  if (edge_is_servo) {
    servo_edge();
  } else {
    infrared_end();
  }
  hal_serial_look();
}

int32_t schedule_between(schedule_moment from, schedule_moment to) {
  /* An offset above three quarters of the count is an edge captured just before its slot began. */
  const int32_t start = from.offset >= 0xC000u ? (int32_t)from.offset - 65536 : (int32_t)from.offset;
  const int32_t end = to.offset >= 0xC000u ? (int32_t)to.offset - 65536 : (int32_t)to.offset;
  return (int32_t)(uint8_t)(to.slot - from.slot) * (int32_t)HAL_SLOT_CYCLES + end - start;
}

uint32_t schedule_now(void) {
  uint32_t cycles = 0;
  HAL_ATOMIC { cycles = slot_cycles + (uint16_t)(hal_time() - schedule_slot_start); }
  return cycles;
}

uint32_t schedule_cycles_at(uint8_t slot, uint16_t time) {
  uint32_t start = 0;
  HAL_ATOMIC { start = slot_cycles - (uint8_t)(schedule_slot - slot) * (uint32_t)HAL_SLOT_CYCLES; }
  return start + (uint16_t)(time - (uint16_t)start);
}

uint32_t schedule_time(void) {
  uint32_t us = 0;
  HAL_ATOMIC { us = slot_us + (uint16_t)(hal_time() - schedule_slot_start) / HAL_CYCLES_PER_US; }
  return us;
}

uint32_t schedule_tick(void) { return tick; }

uint32_t schedule_tick_time(void) { return tick_us; }

uint16_t schedule_begun_tick(void) {
  const bool is_awaited = (int32_t)(schedule_time() - tick_us) < 0; /* its tasks are, but it has not begun */
  return (uint16_t)((uint16_t)tick - is_awaited);
}

static void next_tick(void) {
  tick++;
  tick_us += SCHEDULE_TICK_US;
}

uint8_t schedule_overruns(void) { return overruns; }

bool schedule_overran(void) { return overran; }

static void begin_tick(void) {
  overran = late;
  overruns = (uint8_t)(overruns + late);
  late = false;
  /* Hopelessly behind: drop whole ticks, keep the time right. The waiting slots are a byte, and none begins in the short
   * time that this takes, or one that makes the byte 0. */
  BOUNDED((UINT8_MAX - SLOTS_KEPT + SCHEDULE_SLOTS_PER_TICK - 1u) / SCHEDULE_SLOTS_PER_TICK,
          while (schedule_waiting() > SLOTS_KEPT)) {
    schedule_next_slot = (uint8_t)(schedule_next_slot + SCHEDULE_SLOTS_PER_TICK);
    next_tick();
    overruns++;
    overran = true;
  }
  overrun_row = !overran ? 0u : overrun_row < OVERLOAD_TICKS ? (uint8_t)(overrun_row + 1u) : OVERLOAD_TICKS;
}

/* Runs what is due in a slot. The watchdog is kicked here and nowhere else, and only when all of it has returned, and not
 * in a board that has fallen behind for good: tasks of dropped ticks have not run. */
static void run_tasks(uint8_t slot) {
  encoder_update();
#define TASK(name, period, phase, budget)    \
  if (slot % (uint8_t)(period) == (phase)) { \
    task_begins(TASK_##name);                \
    name##_task();                           \
    task_has_ended();                        \
  }
#include "tasks.def"
  if (overrun_row < OVERLOAD_TICKS) {
    hal_kick_watchdog();
  }
}

void schedule_poll(void) {
  if (schedule_next_slot % SCHEDULE_SLOTS_PER_TICK == 0) {
    begin_tick();
  }
  run_tasks(schedule_next_slot);
  schedule_next_slot++;
  if (schedule_next_slot % SCHEDULE_SLOTS_PER_TICK == 0) {
    next_tick();
  }
  /* Work of a tick that ends when a later tick has already begun has overrun. */
  const uint8_t waiting = schedule_waiting();
  const uint8_t left =
      (uint8_t)(0u - schedule_next_slot) % SCHEDULE_SLOTS_PER_TICK; /* slots of this tick still to come */
  if (waiting > left) {
    late = true;
  }
}
