/* accelerometer.h: a proof mass on a spring (Fig. 1.10 of the notes); its deflection z gives the acceleration, a = k z / m.
 *
 * m z'' + c z' + k z = m a, stepped implicitly, which is stable for every step: a stiff sensor simply follows.
 */
#ifndef SENSORS_ACCELEROMETER_H
#define SENSORS_ACCELEROMETER_H

#include "sensor.h"

/* python: begin */
typedef struct {
  double mass;      /* m, kg */
  double stiffness; /* k, N/m */
  double damping;   /* c, N s/m */
  double range;     /* m/s^2: the mass meets its stops at range m / k */
  double sigma;     /* m/s^2, added to the reading; 0: no noise */
  double bias;      /* m/s^2, of the unit; 0: none */
} accelerometer_parameters;

typedef struct {
  double deflection; /* z, m */
  double speed;      /* m/s */
} accelerometer_state;

/* One step of dt seconds under the body's acceleration along the sensor's axis, m/s^2. */
void accelerometer_step(const accelerometer_parameters *self, accelerometer_state *state, double acceleration,
                        double dt);

/* k z / m with bias and noise, m/s^2. */
double accelerometer_read(const accelerometer_parameters *self, const accelerometer_state *state, noise_source *noise);

extern const sensor_kind accelerometer_sensor;
/* python: end */

#endif
