/* safety.h: whether the motors may run (protocol/PROTOCOL.md, "Fail-safe").
 *
 * At start, by a stop command, at the end of a session and by a low supply the motors are latched off; only safety_arm()
 * ends that. Armed, they follow the set-point in force, which lives for its time to live, counted from the start of the
 * tick that it answers; when no newer one came by then, the motors stop until the next (dead-man). However they are
 * stopped, there are no more pulses from the next servo frame on (motion.h); the turret is released and the buzzer silenced
 * with them. */
#ifndef SAFETY_H
#define SAFETY_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void safety_start(void);

typedef enum {
  SAFETY_ACCEPTED,
  SAFETY_LATE, /* its time to live has passed, or there is a newer one, or its tick was over when the motors were armed or
                    * stopped by themselves */
  SAFETY_REFUSED, /* latched, out of range, or the servos are switched off */
} safety_verdict;

/* A set-point came, with its time to live in ms (0: the parameter's), the low 16 bits of the tick that it answers, and its
 * sequence number. If accepted it is in force from now on, and the caller sets the motors. */
safety_verdict safety_accept(uint16_t time_to_live, uint16_t answers_tick, uint8_t sequence);

/* Sequence number of the last set-point that was accepted. */
uint8_t safety_setpoint_sequence(void);

/* Stops the motors and latches them off for that reason (LATCH_...). If they are latched already the first reason stays;
 * a stop command is counted all the same. */
void safety_latch(uint8_t reason);

/* Times that the motors were latched off, at start too, modulo 256. */
uint8_t safety_latches(void);

/* Ends the latch that was the `latches`th. ANSWER_STATUS_OK; or ANSWER_STATUS_LATCHED_AGAIN: there has been another since;
 * or ANSWER_STATUS_SUPPLY_LOW: it is low or not yet measured. */
uint8_t safety_arm(uint8_t latches);

/* LATCH_..., LATCH_NONE while armed. */
uint8_t safety_latched(void);

/* In every slot: ends set-points that have outlived themselves, latches when the supply is low. */
void safety_task(void) __attribute__((noinline));

/* STATUS_MOTORS_ENABLED, STATUS_DEAD_MAN, STATUS_LATCHED. */
uint16_t safety_status(void);

#ifdef __cplusplus
}
#endif

#endif
