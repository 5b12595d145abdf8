/* model.h: what a vehicle without a board is made of: a body, a drive, sensors and perhaps a battery.
 *
 * A model is built up once and then shared by any number of worlds and threads, which do not change it. Each sensor adds
 * readings, numbers that the brain gets; a sensor with a period holds its readings in between (notes, section 3.2.2).
 */
#ifndef VEHICLES_MODEL_H
#define VEHICLES_MODEL_H

#include <stddef.h>
#include <stdint.h>

#include "../world/body.h"
#include "../world/motor_dc.h"
#include "../world/motor_regulated.h"
#include "../world/sensors/sample_hold.h"
#include "../world/sensors/sensor.h"
#include "../world/servo_motor.h"
#include "../world/supply.h"
#include "motion.h"

/* python: begin */
enum {
  VEHICLE_OK = 0,
  VEHICLE_BAD_NUMBER = -1, /* not finite, or outside its range */
  VEHICLE_NOT_FREE = -3,   /* the start is not free space */
  VEHICLE_NO_MEMORY = -5,
};

typedef struct vehicle_model vehicle_model;

/* A model that steps by `dt` seconds, without drive and sensors; NULL without memory. All parameters here and below are within
 * their ranges (checked_structs.py, sim_bridge/devices). */
vehicle_model *vehicle_model_new(const body_parameters *parameters, double dt);
void vehicle_model_destroy(vehicle_model *self);

/* Drives: motor signal s in [-1, 1]. DC: s V_max volts, quasi-static, or with the current as a state if `full` (a motor
 * with inductance 0 is quasi-static nevertheless). Servo: 1500 us +- 200 us s, one pulse every 20 ms. Regulated: (3.15)
 * with the reference s v_max. A model has one, and steps by less than its Euler limit, before worlds are made of it. */
void vehicle_model_drive_dc(vehicle_model *self, const motor_dc_parameters *left, const motor_dc_parameters *right,
                            int full);
void vehicle_model_drive_servo(vehicle_model *self, const servo_motor_parameters *left,
                               const servo_motor_parameters *right);
void vehicle_model_drive_regulated(vehicle_model *self, const motor_regulated_parameters *left,
                                   const motor_regulated_parameters *right);

/* A model with servos gets its pulses as from a board: by these maps. */
void vehicle_model_board(vehicle_model *self, const motion_map *left, const motion_map *right);

/* The notes' battery, which empties by these rates; sensors/charge.h reads it. */
void vehicle_model_battery(vehicle_model *self, const energy_parameters *energy);

/* Adds a sensor of a kind (world/sensors/sensor.h), with the parameters that its header says. `period`: s between samples;
 * 0: every step. Returns the number of its first reading, or an error. */
int vehicle_model_add(vehicle_model *self, const sensor_kind *kind, const void *parameters, double period);

/* Above this step, s, Euler's method diverges for the drive and body: 2 / (the faster of their two linearised rates). */
double vehicle_model_euler_limit(const vehicle_model *self);
/* python: end */

enum { DRIVE_NONE = 0, DRIVE_DC, DRIVE_SERVO, DRIVE_REGULATED };

typedef struct {
  const sensor_kind *kind;
  uint32_t device; /* key of its noise */
  size_t first;    /* of its readings */
  size_t numbers;  /* that the sensors before it keep */
  double period;
  void *made; /* by its kind */
} vehicle_sensor;

struct vehicle_model {
  body_parameters body;
  double reach; /* of the body and what sticks out of it, m */
  double dt;
  int drive, full;
  motor_dc_parameters dc[2];
  servo_motor_parameters servo[2]; /* those of a world may be others */
  int has_board;
  motion_map motion[2]; /* if it has one */
  motor_regulated_parameters regulated[2];
  int has_battery;
  energy_parameters energy;
  int noise, ends_at_collision; /* switches, both on at first: all noise, and the end of a run at a collision */
  size_t sensors_count, readings;
  size_t numbers; /* that all sensors keep */
  vehicle_sensor *sensors;
};

#endif
