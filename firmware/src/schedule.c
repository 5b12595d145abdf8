/* schedule.c: slots, tasks and overruns; see schedule.h and tasks.def. */
#include "schedule.h"

#include "bounds.h"
#include "clock.h"
#include "hal/interrupts.h"
#include "infrared.h"
#include "pin_changes.h"
#include "servo.h"
#include "task_times.h"
#include "tasks.h"

#define SLOTS_KEPT (2u * CLOCK_SLOTS_PER_TICK) /* that may wait; of more, whole ticks are dropped */
#define OVERLOAD_TICKS 10u                     /* ticks in a row that overran: the watchdog ends it */

#define TASK(name, period, phase, budget) \
  _Static_assert(256 % (period) == 0 && (phase) < (period), "task " #name ": period and phase");
#include "tasks.def"

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
_Static_assert(CONSTANT_slot_cycles == HAL_SLOT_CYCLES && CONSTANT_slots_per_tick == CLOCK_SLOTS_PER_TICK &&
                   CONSTANT_slots_kept == SLOTS_KEPT && CONSTANT_receive_ring == HAL_RECEIVE_MAX,
               "constants of tasks.def");

static uint8_t overruns;
static bool late;           /* a slot of this tick was worked on when the next tick had begun */
static bool overran;        /* so it was in the previous tick, or ticks were dropped */
static uint8_t overrun_row; /* ticks in a row that overran, at most OVERLOAD_TICKS */

void schedule_start(uint32_t first_tick) {
  clock_start(first_tick);
  overruns = overrun_row = 0;
  late = overran = false;
}

/* What begins in which slot: the table at the head of tasks.def. */
void schedule_on_slot(void) {
  const uint16_t begins = clock_begin_slot();
  hal_slot_arm((uint16_t)(begins + HAL_SLOT_CYCLES));
  switch (clock_slot % CLOCK_SLOTS_PER_FRAME) {
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

uint8_t schedule_overruns(void) { return overruns; }

bool schedule_overran(void) { return overran; }

static void begin_tick(void) {
  overran = late;
  overruns = (uint8_t)(overruns + late);
  late = false;
  /* Hopelessly behind: drop whole ticks, keep the time right. */
  while (clock_waiting() > SLOTS_KEPT) {
    LOOP_BOUND((UINT8_MAX - SLOTS_KEPT + CLOCK_SLOTS_PER_TICK - 1u) / CLOCK_SLOTS_PER_TICK);
    clock_next_slot = (uint8_t)(clock_next_slot + CLOCK_SLOTS_PER_TICK);
    clock_next_tick();
    overruns++;
    overran = true;
  }
  overrun_row = !overran ? 0u : overrun_row < OVERLOAD_TICKS ? (uint8_t)(overrun_row + 1u) : OVERLOAD_TICKS;
}

/* Runs the tasks that are due in a slot. The watchdog is kicked here and nowhere else: only when all of them have returned,
 * and not when the board has fallen behind for good, because the tasks of dropped ticks have not run. */
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
  if (clock_tick_begins()) {
    begin_tick();
  }
  pin_changes_begin_slot();
  run_tasks(clock_next_slot);
  clock_next_slot++;
  if (clock_tick_begins()) {
    clock_next_tick();
  }
  /* Work of a tick that ends when a later tick has already begun has overrun. */
  const uint8_t left = (uint8_t)(0u - clock_next_slot) % CLOCK_SLOTS_PER_TICK; /* slots of this tick still to come */
  if (clock_waiting() > left) {
    late = true;
  }
}
