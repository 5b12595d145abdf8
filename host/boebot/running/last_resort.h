/* last_resort.h: ends this process when it was asked to and Python does nothing about it.
 *
 * Python runs its signal handlers between two of its instructions; while a library that was called keeps the
 * interpreter, none of them runs. But the number of each signal is written into a pipe at once (signal.set_wakeup_fd).
 * A thread that waits here needs no Python to read it.
 */
#ifndef BOEBOT_LAST_RESORT_H
#define BOEBOT_LAST_RESORT_H

/* python: begin */
/* Reads from `descriptor`: numbers of signals, and words of one byte: 0, signals from here on do not count, nor did
 * those before; 255, they count again; 253, the countdown waits for a further signal; 254, return. `signals` has a bit
 * for each number that counts. The first of them begins a countdown of `limit_s`, a further one that comes more than
 * `one_press_s` after the one before shortens it to `again_s`. At its end `sentence` is written to standard error and the
 * process ends with the exit code 128 + the first one's number. */
void last_resort_watch(int descriptor, unsigned long signals, double limit_s, double again_s, double one_press_s,
                       const char *sentence);

/* Number of the signal that began the countdown; 0: there is none. */
int last_resort_signal(void);
/* python: end */

#endif
