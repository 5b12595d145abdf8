/* safety.h: whether the motors may run (protocol/PROTOCOL.md, "Fail-safe").
 *
 * At start, by a stop command, at the end of a session and by a low supply the motors are latched off; only safety_arm()
 * ends that. Armed, they follow the set-point in force, which lives for its time to live, counted from the start of the
 * tick that it answers; when no newer one came by then, the motors stop until the next (dead-man). However they are
 * stopped, there are no more pulses from the next servo frame on (motion.h); the turret is released and the buzzer silenced
 * with them.
 *
 * The board's own brain (fallback.h) has its own permission. The host gives it by arming; every latch takes it away, but
 * for one: the session's end by silence, which latches for the host alone. So silence never takes it away, and whatever
 * somebody or a fault has stopped stays stopped. At start it is given by the parameter fallback_at_start, after power and
 * the reset button only. A set-point in force comes first: its dead-man stop ends it before the fallback may drive. */
#ifndef SAFETY_H
#define SAFETY_H

#include <stdbool.h>
#include <stdint.h>

#define SAFETY_TIME_TO_LIVE_MAX 2000u /* ms */

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

/* The session has ended because the host was silent: latches the motors, but for the board's own brain. */
void safety_host_lost(void);

/* Times that the motors were latched off, at start too, modulo 256. */
uint8_t safety_latches(void);

/* Ends the latch that was the `latches`th. ANSWER_STATUS_OK; or ANSWER_STATUS_LATCHED_AGAIN: there has been another since;
 * or ANSWER_STATUS_SUPPLY_LOW: it is low or not yet measured. */
uint8_t safety_arm(uint8_t latches);

/* LATCH_..., LATCH_NONE while armed. */
uint8_t safety_latched(void);

/* The board's own brain wants to drive in this tick. If it may, it drives from now on, and the caller sets the motors. */
bool safety_accept_fallback(void);

/* It drives no more: the motors stop, unless they are the host's already. */
void safety_end_fallback(void);

/* STATUS_MOTORS_ENABLED, STATUS_DEAD_MAN, STATUS_FALLBACK, STATUS_LATCHED. */
uint16_t safety_status(void);

#endif
