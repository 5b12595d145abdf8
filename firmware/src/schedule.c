/* schedule.c: slots, tasks and overruns; see schedule.h and tasks.def. */
#include "schedule.h"

#include "bounds.h"
#include "hal/interrupts.h"
#include "infrared.h"
#include "pin_changes.h"
#include "servo.h"
#include "task_times.h"
#include "tasks.h"

#define SLOT_US (SCHEDULE_TICK_US / SCHEDULE_SLOTS_PER_TICK)
#define SLOTS_KEPT (2u * SCHEDULE_SLOTS_PER_TICK) /* that may wait; of more, whole ticks are dropped */
#define OVERLOAD_TICKS 10u                        /* ticks in a row that overran: the watchdog ends it */

#define TASK(name, period, phase, budget) \
  _Static_assert(256 % (period) == 0 && (phase) < (period), "task " #name ": period and phase");
#include "tasks.def"
_Static_assert(HAL_SLOT_CYCLES == SLOT_US * HAL_CYCLES_PER_US, "both clocks go together");

#ifdef __AVR__
/* The timing table as part of the image, so that an image can be judged without its sources: a text for each row, ended by
 * a zero byte, in a section that is not loaded. */
#define ROW(text) __asm__(".pushsection .boebot.timing, \"\", @progbits \n .asciz \"" text "\" \n .popsection");
#define TASK(name, period, phase, budget) ROW("TASK " #name " " #period " " #phase " " #budget)
#define INTERRUPT(name, vector, budget, latency, interval) \
  ROW("INTERRUPT " #name " " #vector " " #budget " " #latency " " #interval)
#define SENSOR(name, conversion, period, age) ROW("SENSOR " #name " " #conversion " " #period " " #age)
#define CONSTANT(name, value) ROW("CONSTANT " #name " " #value)
#include "tasks.def"
#endif
_Static_assert(CONSTANT_slot_cycles == HAL_SLOT_CYCLES && CONSTANT_slots_per_tick == SCHEDULE_SLOTS_PER_TICK &&
                   CONSTANT_slots_kept == SLOTS_KEPT && CONSTANT_receive_ring == HAL_RECEIVE_MAX,
               "constants of tasks.def");

volatile uint8_t schedule_slot;
uint8_t schedule_next_slot;

volatile uint32_t schedule_slot_cycles;

static volatile uint32_t slot_us; /* time on the board's clock at which schedule_slot began */

static uint32_t tick;
static uint32_t tick_us; /* time on the board's clock at which it begins, or has begun */
static uint8_t overruns;
static bool late;           /* a slot of this tick was worked on when the next tick had begun */
static bool overran;        /* so it was in the previous tick, or ticks were dropped */
static uint8_t overrun_row; /* ticks in a row that overran, at most OVERLOAD_TICKS */

void schedule_start(uint32_t first_tick) {
  schedule_slot = 0xFF; /* the first slot is still to begin */
  schedule_next_slot = 0;
  schedule_slot_cycles = 0;
  tick = first_tick;
  tick_us = first_tick * SCHEDULE_TICK_US;
  slot_us = tick_us - SLOT_US;
  overruns = overrun_row = 0;
  late = overran = false;
}

/* What begins in which slot: the table at the head of tasks.def. */
void schedule_on_slot(void) {
  schedule_slot++;
  const uint32_t start = schedule_slot_cycles + HAL_SLOT_CYCLES;
  schedule_slot_cycles = start;
  slot_us += SLOT_US;
  const uint16_t begins = (uint16_t)start;
  hal_slot_arm((uint16_t)(begins + HAL_SLOT_CYCLES));
  switch (schedule_slot % SCHEDULE_SLOTS_PER_FRAME) {
    case 0:
      servo_frame();
      servo_begin(LEFT, begins);
      break;
    case 1:
      servo_begin(RIGHT, begins);
      break;
    case 2:
    case 6:
      infrared_begin(LEFT);
      break;
    case 3:
    case 7:
      infrared_begin(RIGHT);
      break;
    case 4:
      servo_begin(SERVO_TURRET, begins);
      break;
    default:
      break;
  }
}

uint32_t schedule_now(void) {
  uint32_t start = 0;
  uint16_t time = 0;
  HAL_ATOMIC {
    start = schedule_slot_cycles;
    time = hal_time();
  }
  return start + (uint16_t)(time - (uint16_t)start);
}

uint32_t schedule_time(void) {
  uint32_t start = 0;
  uint16_t since = 0;
  HAL_ATOMIC {
    start = slot_us;
    since = (uint16_t)(hal_time() - (uint16_t)schedule_slot_cycles);
  }
  return start + since / HAL_CYCLES_PER_US;
}

uint32_t schedule_tick(void) { return tick; }

uint32_t schedule_tick_time(void) { return tick_us; }

uint16_t schedule_begun_tick(void) {
  const bool is_awaited = (int32_t)(schedule_time() - tick_us) < 0; /* its tasks are, but it has not begun */
  return (uint16_t)((uint16_t)tick - is_awaited);
}

uint8_t schedule_overruns(void) { return overruns; }

bool schedule_overran(void) { return overran; }

static void next_tick(void) {
  tick++;
  tick_us += SCHEDULE_TICK_US;
}

static void begin_tick(void) {
  overran = late;
  overruns = (uint8_t)(overruns + late);
  late = false;
  /* Hopelessly behind: drop whole ticks, keep the time right. */
  while (schedule_waiting() > SLOTS_KEPT) {
    LOOP_BOUND((UINT8_MAX - SLOTS_KEPT + SCHEDULE_SLOTS_PER_TICK - 1u) / SCHEDULE_SLOTS_PER_TICK);
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
  if (schedule_tick_begins()) {
    begin_tick();
  }
  pin_changes_begin_slot();
  run_tasks(schedule_next_slot);
  schedule_next_slot++;
  if (schedule_tick_begins()) {
    next_tick();
  }
  /* Work of a tick that ends when a later tick has already begun has overrun. */
  const uint8_t left =
      (uint8_t)(0u - schedule_next_slot) % SCHEDULE_SLOTS_PER_TICK; /* slots of this tick still to come */
  if (schedule_waiting() > left) {
    late = true;
  }
}
