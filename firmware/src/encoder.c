/* encoder.c: see encoder.h. */
#include "encoder.h"

#include "generated/values.h"
#include "hal/hal.h"
#include "parameters.h"
#include "tasks.h"

#define PERIOD_LONGEST 31250u /* 0.5 s in 16 us */
#define SILENT_TICKS 50u      /* 0.5 s */

#if ENCODER_LINES == 2
#define LEFT_A HAL_PIN_BIT(ENCODER_LEFT_A)
#define LEFT_B HAL_PIN_BIT(ENCODER_LEFT_B)
#define RIGHT_A HAL_PIN_BIT(ENCODER_RIGHT_A)
#define RIGHT_B HAL_PIN_BIT(ENCODER_RIGHT_B)
_Static_assert(PIN_ENCODER_LEFT_A >= 14 && PIN_ENCODER_LEFT_B >= 14, "encoders are on port C");
_Static_assert(PIN_ENCODER_RIGHT_A >= 14 && PIN_ENCODER_RIGHT_B >= 14, "encoders are on port C");
#elif ENCODER_LINES == 1
#define LEFT_A HAL_PIN_BIT(ENCODER_LEFT)
#define RIGHT_A HAL_PIN_BIT(ENCODER_RIGHT)
#define LEFT_B 0u
#define RIGHT_B 0u
_Static_assert(PIN_ENCODER_LEFT >= 14 && PIN_ENCODER_RIGHT >= 14, "encoders are on port C");
#else /* wheels without encoders */
#define LEFT_A 0u
#define LEFT_B 0u
#define RIGHT_A 0u
#define RIGHT_B 0u
#endif

#define LEFT_PINS (LEFT_A | LEFT_B)
#define RIGHT_PINS (RIGHT_A | RIGHT_B)
#define ALL_PINS ((uint8_t)(LEFT_PINS | RIGHT_PINS))

enum { LINE_LEFT_A, LINE_LEFT_B, LINE_RIGHT_A, LINE_RIGHT_B, LINES };
static const uint8_t line_pins[LINES] = {LEFT_A, LEFT_B, RIGHT_A, RIGHT_B};

typedef struct {
  int32_t count;   /* edges since reset */
  uint16_t period; /* time between the last two edges in 16 us; 0: none within 0.5 s */
  bool masked;     /* a line of this wheel was masked in the tick that ended */
} encoder_reading;

typedef struct {
  int16_t steps;      /* by which the count has changed in this tick */
  uint16_t last, gap; /* time of the last edge that counts, and since the one before; 16 us */
  uint8_t edges;      /* that count, in this tick, at most 2 */
  uint8_t silence;    /* ticks since the last of them, at most SILENT_TICKS */
  encoder_reading reading;
} wheel;

static wheel wheels[SIDES];
static uint8_t edges_left[LINES]; /* of each line in this tick before it is masked */
static uint16_t shortest_gap;     /* parameter encoder_gap in 16 us, rounded up */
static uint8_t levels;            /* of single lines, after their last edges that count */
static uint8_t masked;            /* pins, until the next tick */
static uint8_t was_masked;        /* in the tick that ended */
static bool time_lost;            /* in this tick */

uint8_t encoder_pins(void) {
  if (!parameters_device_on(DEVICES_ENCODER)) {
    return 0;
  }
  return ALL_PINS & (uint8_t)~masked;
}

void encoder_lose_time(void) { time_lost = true; }

void encoder_mask(uint8_t pins) { masked = (uint8_t)(masked | (pins & ALL_PINS)); }

void encoder_lift_masks(void) {
  was_masked = masked;
  masked = 0;
}

void encoder_set_levels(uint8_t pins, uint8_t bits) { levels = (uint8_t)((levels & (uint8_t)~pins) | (bits & pins)); }

/* The step of an edge, 0 if a single line is only back at the level of its last edge that counts. Of two lines, forward, an edge
 * of A leaves them different and one of B equal. */
#if ENCODER_LINES == 2
#define STEP_A(bits, a, b) ((((bits) & (a)) != 0) != (((bits) & (b)) != 0) ? 1 : -1)
#define STEP_B(bits, a, b) (-STEP_A(bits, a, b))
#else
#define STEP_A(bits, a, b) ((((bits) ^ levels) & (a)) != 0 ? 1 : 0)
#define STEP_B(bits, a, b) 0
#endif

/* One edge of a line. A line that bounces makes pairs of them, close together: of two lines the steps of a pair cancel, of one
 * line they do not count. None of them is a time. The time of an edge long ago may have rolled over: after a silence none is
 * close. Where both lines change at once, these are two edges that give no step and no time. */
static __attribute__((noinline)) void encoder_edge(wheel *w, uint8_t line, int8_t step, uint16_t time) {
  if (--edges_left[line] == 0) {
    encoder_mask(line_pins[line]);
  }
  const uint16_t since = (uint16_t)(time - w->last);
  const bool is_close = since < shortest_gap && (w->edges != 0 || w->silence < SILENT_TICKS);
  if (ENCODER_LINES == 1) {
    if (is_close || step == 0) {
      return;
    }
    levels = levels ^ line_pins[line];
  }
  w->steps = (int16_t)(w->steps + step);
  if (is_close || since == 0) {
    return;
  }
  w->gap = since;
  w->last = time;
  if (w->edges < 2u) {
    w->edges++;
  }
}

void encoder_on_change(uint8_t changed, uint8_t bits, uint16_t time) {
  if ((changed & LEFT_A) != 0) {
    encoder_edge(&wheels[LEFT], LINE_LEFT_A, STEP_A(bits, LEFT_A, LEFT_B), time);
  }
  if ((changed & LEFT_B) != 0) {
    encoder_edge(&wheels[LEFT], LINE_LEFT_B, STEP_B(bits, LEFT_A, LEFT_B), time);
  }
  if ((changed & RIGHT_A) != 0) {
    encoder_edge(&wheels[RIGHT], LINE_RIGHT_A, STEP_A(bits, RIGHT_A, RIGHT_B), time);
  }
  if ((changed & RIGHT_B) != 0) {
    encoder_edge(&wheels[RIGHT], LINE_RIGHT_B, STEP_B(bits, RIGHT_A, RIGHT_B), time);
  }
}

/* A line may make as many edges in a tick as the parameter allows; one more masks it. */
static void begin_tick(void) {
  const uint8_t limit = (uint8_t)(parameters_u16(PARAMETER_ENCODER_LIMIT) + 1u);
  for (uint8_t line = 0; line < LINES; line++) {
    edges_left[line] = limit;
  }
  wheels[LEFT].edges = wheels[RIGHT].edges = 0;
  shortest_gap = (uint16_t)((parameters_u16(PARAMETER_ENCODER_GAP) + 15ul) / 16u);
  time_lost = false;
}

void encoder_start(void) {
#if ENCODER_LINES == 2
  HAL_PIN_PULL_UP(ENCODER_LEFT_A);
  HAL_PIN_PULL_UP(ENCODER_LEFT_B);
  HAL_PIN_PULL_UP(ENCODER_RIGHT_A);
  HAL_PIN_PULL_UP(ENCODER_RIGHT_B);
#elif ENCODER_LINES == 1
  HAL_PIN_PULL_UP(ENCODER_LEFT);
  HAL_PIN_PULL_UP(ENCODER_RIGHT);
#endif
  wheels[LEFT] = wheels[RIGHT] = (wheel){.silence = SILENT_TICKS};
  levels = masked = was_masked = 0;
  begin_tick();
}

/* The time between two edges as it is reported. */
static uint16_t period_of(uint16_t gap) { return gap == 0 ? 1u : gap >= PERIOD_LONGEST ? 0u : gap; }

/* Makes the reading of a wheel from the tick that ends. */
static void close_tick(wheel *w, bool not_listening) {
  w->reading.count += w->steps;
  w->steps = 0;
  w->reading.masked = not_listening;
  if (not_listening || time_lost) {
    w->reading.period = 0;
    w->silence = SILENT_TICKS; /* what was missed says nothing about the time to the next edge */
  } else if (w->edges != 0) {
    w->reading.period = w->edges >= 2u || w->silence < SILENT_TICKS ? period_of(w->gap) : 0u;
    w->silence = 0;
  } else if (w->silence < SILENT_TICKS) {
    w->silence++;
  } else {
    w->reading.period = 0;
  }
}

/* Once per tick: closes the readings of the tick that ended. */
void encoder_task(void) {
  const bool off = !parameters_device_on(DEVICES_ENCODER);
  close_tick(&wheels[LEFT], off || (was_masked & LEFT_PINS) != 0);
  close_tick(&wheels[RIGHT], off || (was_masked & RIGHT_PINS) != 0);
  wheels[LEFT].reading.masked &= !off;
  wheels[RIGHT].reading.masked &= !off;
  begin_tick();
}

int32_t encoder_count(uint8_t side) { return wheels[side].reading.count; }

void encoder_report_telemetry(msg_telemetry *message) {
  const encoder_reading *left = &wheels[LEFT].reading;
  const encoder_reading *right = &wheels[RIGHT].reading;
  message->encoder_left = left->count;
  message->encoder_right = right->count;
  message->edge_period_left = left->period;
  message->edge_period_right = right->period;
  if (left->masked) {
    message->status |= STATUS_ENCODER_LEFT_MASKED;
  }
  if (right->masked) {
    message->status |= STATUS_ENCODER_RIGHT_MASKED;
  }
}
