/* turret.c: see turret.h. */
#include "turret.h"

#include "generated/messages.h"
#include "link/parameters.h"
#include "motion.h"
#include "servo.h"

void turret_hold(int16_t angle) {
  const int32_t pulse =
      (int32_t)parameters_u16(PARAMETER_TURRET_CENTRE) + motion_offset(parameters_i16(PARAMETER_TURRET_GAIN), angle);
  servo_turn(pulse < (int32_t)SERVO_TURRET_MIN   ? SERVO_TURRET_MIN
             : pulse > (int32_t)SERVO_TURRET_MAX ? SERVO_TURRET_MAX
                                                 : (uint16_t)pulse);
}

void turret_release(void) { servo_turn(0); }

void turret_task(void) {
  if (!parameters_device_on(DEVICES_TURRET)) {
    turret_release();
  }
}
