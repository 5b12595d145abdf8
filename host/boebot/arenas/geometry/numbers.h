/* numbers.h: elementary functions from additions, multiplications and divisions only.
 *
 * The world's state must be the same bit for bit on every machine; results of a C library's sin, exp and log are not.
 * Errors are a few units in the last place, which no test or robot can see. Compile with -ffp-contract=off.
 * What every step needs is inline: in a loop the compiler may then compute several at once.
 */
#ifndef GEOMETRY_NUMBERS_H
#define GEOMETRY_NUMBERS_H

#include <stdint.h>
#include <string.h>

#define NUMBERS_PI 3.14159265358979323846

#ifdef __GNUC__
#define NUMBERS_INLINE static inline __attribute__((always_inline))
#else
#define NUMBERS_INLINE static inline
#endif

/* python: begin */
/* Sine and cosine of an angle in rad, |angle| < 1e5. */
static void number_sincos(double angle, double *sine, double *cosine);

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
static double number_wrap(double angle);
/* python: end */

/* The largest whole number <= x, |x| < 2^62. */
static inline long long number_floor(double x) {
  const long long whole = (long long)x;
  return (x < (double)whole) ? whole - 1 : whole;
}

/* Limited to [-limit, limit]: each comparison is a single operation without a branch. */
NUMBERS_INLINE double number_limited(double value, double limit) {
  const double below = value < limit ? value : limit;
  return below > -limit ? below : -limit;
}

/* By minimax polynomials on [-pi/4, pi/4]. */
NUMBERS_INLINE void number_sincos(double angle, double *sine, double *cosine) {
  /* pi/2 in three parts: the first two have few enough bits for exact products with small whole numbers. */
  static const double part_1 = 1.57079632673412561417e+00;
  static const double part_2 = 6.07710050630396597660e-11;
  static const double part_3 = 2.02226624879595063154e-21;
  const double shifted =
      angle * (2.0 / NUMBERS_PI) + 0x1.8p52; /* its last bits are those of the nearest whole number */
  const double n = shifted - 0x1.8p52;
  uint64_t quarter;
  memcpy(&quarter, &shifted, sizeof quarter);
  const double r = ((angle - n * part_1) - n * part_2) - n * part_3;
  const double z = r * r;
  const double s = r + r * z *
                           (-1.66666666666666324348e-01 +
                            z * (8.33333333332248946124e-03 +
                                 z * (-1.98412698298579493134e-04 +
                                      z * (2.75573137070700676789e-06 +
                                           z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
  const double c =
      (1.0 - 0.5 * z) + z * z *
                            (4.16666666666666019037e-02 +
                             z * (-1.38888888888741095749e-03 +
                                  z * (2.48015872894767294178e-05 +
                                       z * (-2.75573143513906633035e-07 +
                                            z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  /* Turned by whole quarters: sine and cosine change places by each, and signs by each second one. */
  const uint64_t swap = (uint64_t)0 - (quarter & 1u);
  const uint64_t sine_sign = (quarter & 2u) << 62;
  const uint64_t cosine_sign = ((quarter + 1u) & 2u) << 62;
  uint64_t s_bits, c_bits;
  memcpy(&s_bits, &s, sizeof s_bits);
  memcpy(&c_bits, &c, sizeof c_bits);
  const uint64_t change = (s_bits ^ c_bits) & swap;
  s_bits ^= change ^ sine_sign;
  c_bits ^= change ^ cosine_sign;
  memcpy(sine, &s_bits, sizeof s_bits);
  memcpy(cosine, &c_bits, sizeof c_bits);
}

NUMBERS_INLINE double number_wrap(double angle) {
  if (angle > -NUMBERS_PI && angle <= NUMBERS_PI) return angle;
  const double turns = angle / (2.0 * NUMBERS_PI) + 0.5;
  const double near = (turns + 0x1.8p52) - 0x1.8p52; /* the nearest whole number */
  const double whole = near > turns ? near - 1.0 : near;
  const double once = angle - whole * (2.0 * NUMBERS_PI);
  const double above = once <= -NUMBERS_PI ? once + 2.0 * NUMBERS_PI : once;
  return above > NUMBERS_PI ? above - 2.0 * NUMBERS_PI : above;
}

#endif
