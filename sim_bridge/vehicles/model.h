/* model.h: what a vehicle without a board is made of: a body, a drive, sensors and perhaps a battery.
 *
 * A model is built up once and then shared by any number of worlds and threads, which do not change it. Each sensor adds
 * readings, numbers that the brain gets; a sensor with a period holds its readings in between (notes, section 3.2.2). A
 * sensor's noise is keyed by its kind and its number among that kind, so that another sensor changes no draw.
 */
#ifndef VEHICLES_MODEL_H
#define VEHICLES_MODEL_H

#include <stddef.h>
#include <stdint.h>

#include "../world/body.h"
#include "../world/motor_dc.h"
#include "../world/motor_regulated.h"
#include "../world/sensors/accelerometer.h"
#include "../world/sensors/compass.h"
#include "../world/sensors/infrared_proximity.h"
#include "../world/sensors/laser.h"
#include "../world/sensors/light.h"
#include "../world/sensors/odometer.h"
#include "../world/sensors/sample_hold.h"
#include "../world/sensors/sharp_infrared.h"
#include "../world/sensors/sonar.h"
#include "../world/sensors/table_noise.h"
#include "../world/servo_motor.h"
#include "../world/supply.h"

#define VEHICLE_SENSORS 24

/* python: begin */
enum {
  VEHICLE_OK = 0,
  VEHICLE_BAD_NUMBER = -1, /* not finite, or outside its range */
  VEHICLE_BAD_STEP = -2,   /* dt <= 0 or not finite, or at or beyond the motors' Euler limit */
  VEHICLE_NOT_FREE = -3,   /* the start is not free space */
  VEHICLE_TOO_MANY = -4,   /* sensors, or a second drive or battery */
  VEHICLE_NO_MEMORY = -5,
  VEHICLE_BAD_SNAPSHOT = -6, /* not made by this version, or damaged */
  VEHICLE_NOT_PLACED = -7,   /* a world that is not there or without an arena, or a model without a drive */
  VEHICLE_OTHER_MODEL = -8,  /* a saved state is of another model */
  VEHICLE_OTHER_ARENA = -9,
  VEHICLE_OTHER_MEMORY = -10, /* its compiled brain's memory has another size */
};

typedef struct vehicle_model vehicle_model;

/* A model that steps by `dt` seconds, without drive and sensors; NULL without memory or with a body whose mass, inertia,
 * radius, half track or wheel radius is not positive (see body_parameters_wrong), or dt <= 0. */
vehicle_model *vehicle_model_new(const body_parameters *parameters, double dt);
void vehicle_model_destroy(vehicle_model *self);

/* Drives: motor signal s in [-1, 1]. DC: s V_max volts, quasi-static, or with the current as a state if `full` (a motor
 * with inductance 0 is quasi-static nevertheless). Servo: 1500 us +- 200 us s, one pulse every 20 ms. Regulated: (3.15)
 * with the reference s v_max. */
int vehicle_model_drive_dc(vehicle_model *self, const motor_dc_parameters *left, const motor_dc_parameters *right,
                           int full);
int vehicle_model_drive_servo(vehicle_model *self, const servo_motor_parameters *left,
                              const servo_motor_parameters *right);
int vehicle_model_drive_regulated(vehicle_model *self, const motor_regulated_parameters *left,
                                  const motor_regulated_parameters *right);

/* The notes' battery; its reading is the voltage empty + E (full - empty) with noise sigma, V. */
int vehicle_model_battery(vehicle_model *self, const energy_parameters *energy, double empty, double full,
                          double sigma);

/* Switches: all noise (1), and the end of a run at a collision (1). */
void vehicle_model_switch(vehicle_model *self, int noise, int ends_at_collision);

/* Sensors. Each returns the number of its first reading, or an error. `period`: s between samples, 0: every step.
 * Readings: one each, except the odometer (x, y, heading) and the laser (one a ray). */
int vehicle_model_add_infrared_proximity(vehicle_model *self, const infrared_proximity_parameters *p, double period);
int vehicle_model_add_sharp_infrared(vehicle_model *self, const sharp_infrared_parameters *p);
int vehicle_model_add_sonar(vehicle_model *self, const sonar_parameters *p, double period);
int vehicle_model_add_laser(vehicle_model *self, const laser_parameters *p, double period);
int vehicle_model_add_compass(vehicle_model *self, const compass_parameters *p, double period);
int vehicle_model_add_accelerometer(vehicle_model *self, const accelerometer_parameters *p, double period);
int vehicle_model_add_phototransistor(vehicle_model *self, const phototransistor_parameters *p, double period);
int vehicle_model_add_odometer(vehicle_model *self, const odometer_parameters *p);

/* A sensor known by its table: distance and angle of incidence at the nearest thing that its rays meet; `none` beyond
 * `range`. The table stays the caller's. */
int vehicle_model_add_table(vehicle_model *self, const beam_parameters *look, const table_noise *table, double range,
                            double none, double period);

/* Whisker: a segment from (x0, y0) to (x1, y1) in the body's frame; reads 1 while it touches something. */
int vehicle_model_add_whisker(vehicle_model *self, double x0, double y0, double x1, double y1);

/* Above this step, s, Euler's method diverges for the drive and body: 2 / (the faster of their two linearised rates). */
double vehicle_model_euler_limit(const vehicle_model *self);
/* python: end */

enum {
  SENSOR_INFRARED_PROXIMITY = 1,
  SENSOR_SHARP_INFRARED,
  SENSOR_SONAR,
  SENSOR_LASER,
  SENSOR_COMPASS,
  SENSOR_ACCELEROMETER,
  SENSOR_PHOTOTRANSISTOR,
  SENSOR_ODOMETER,
  SENSOR_TABLE,
  SENSOR_WHISKER,
  SENSOR_BATTERY,
};

enum { DRIVE_NONE = 0, DRIVE_DC, DRIVE_SERVO, DRIVE_REGULATED };

typedef struct {
  beam beam;
  const table_noise *table;
  double range, none;
} table_sensor;

typedef struct {
  double x0, y0, x1, y1;
} whisker_segment;

#define WHISKER_HEIGHT_M 0.03 /* above the floor: what is lower does not bend it */

typedef struct {
  double empty, full, sigma;
} battery_gauge;

typedef struct {
  int kind;
  uint32_t device; /* key of its noise */
  size_t first;    /* of its readings */
  double period;
  union {
    infrared_proximity infrared_proximity;
    sharp_infrared sharp_infrared;
    sonar sonar;
    laser_parameters laser;
    compass_parameters compass;
    accelerometer_parameters accelerometer;
    phototransistor phototransistor;
    odometer_parameters odometer;
    table_sensor table;
    whisker_segment whisker;
    battery_gauge battery;
  } as;
} vehicle_sensor;

struct vehicle_model {
  body_parameters body;
  double reach; /* of body and whiskers, m */
  double dt;
  int drive, full;
  motor_dc_parameters dc[2];
  servo_motor_parameters servo[2];
  motor_regulated_parameters regulated[2];
  int has_battery;
  const vehicle_sensor *laser; /* NULL: there is none */
  energy_parameters energy;
  int noise, ends_at_collision;
  size_t sensors_count, readings;
  vehicle_sensor sensors[VEHICLE_SENSORS];
};

/* A hash of all parameters: equal for two models only if their worlds go on alike from the same state. */
uint64_t vehicle_model_fingerprint(const vehicle_model *self);

#endif
