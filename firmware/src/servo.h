/* servo.h: pulses for the two continuous-rotation servos and the turret's, one each in a 20 ms frame.
 *
 * Widths are in cycles (1/16 us). A width takes effect with the next frame, for both wheels at once; a pulse under way
 * is finished at its old width, so a pulse is whole or absent, never cut. Width 0: no pulses; a Boe-Bot servo then
 * free-wheels. Edges are exact: the interrupt starts HAL_EDGE_LEAD early and waits for the very cycle. */
#ifndef SERVO_H
#define SERVO_H

#include <stdbool.h>
#include <stdint.h>

#include "generated/messages.h"
#include "pins.h"

/* Beside LEFT and RIGHT. */
enum { SERVO_TURRET = SIDES, SERVOS };

#define SERVO_TURRET_MIN 9600u  /* 600 us in cycles */
#define SERVO_TURRET_MAX 38400u /* 2400 us */

/* Lines low. That of the turret's servo only while it is connected. */
void servo_start(void);
void servo_connect_turret(bool connected);

/* Widths from the next frame on. */
void servo_set(uint16_t left, uint16_t right);
void servo_turn(uint16_t turret);

/* Width of the pulses in the frame that runs. */
uint16_t servo_pulse(uint8_t servo);

/* In an interrupt: a frame begins; a servo's slot begins at hal_time() `start`. */
void servo_frame(void);
void servo_begin(uint8_t servo, uint16_t start);

/* Fills in its fields of telemetry. */
void servo_report_telemetry(msg_telemetry *message);

#endif
