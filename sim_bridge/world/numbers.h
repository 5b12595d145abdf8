/* numbers.h: elementary functions from additions, multiplications and divisions only.
 *
 * The world's state must be the same bit for bit on every machine; results of a C library's sin, exp and log are not.
 * Errors are a few units in the last place, which no test or robot can see. Compile with -ffp-contract=off.
 */
#ifndef WORLD_NUMBERS_H
#define WORLD_NUMBERS_H

#define NUMBERS_PI 3.14159265358979323846

/* python: begin */
/* Sine and cosine of an angle in rad, |angle| < 1e5. */
void number_sincos(double angle, double *sine, double *cosine);

/* e to the x; 0 below -700, capped at x = 700. */
double number_exp(double x);

/* Natural logarithm of x > 0. */
double number_log(double x);

/* Hyperbolic tangent. */
double number_tanh(double x);

/* Direction of (x, y) != (0, 0), finite and below 1e150, in [-pi, pi]; y where both are 0 and x = +0 or y on the positive
 * x axis. */
double number_atan2(double y, double x);

/* The same angle in (-pi, pi]. */
double number_wrap(double angle);
/* python: end */

/* The largest whole number <= x, |x| < 2^62. */
static inline long long number_floor(double x) {
  const long long whole = (long long)x;
  return (x < (double)whole) ? whole - 1 : whole;
}

#endif
