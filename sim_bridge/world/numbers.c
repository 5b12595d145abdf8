/* numbers.c: see numbers.h. Sine and cosine by minimax polynomials on [-pi/4, pi/4], exponential and logarithm by series
 * on a reduced argument. */
#include "numbers.h"

#include <stdint.h>
#include <string.h>

void number_sincos(double angle, double *sine, double *cosine) {
  /* pi/2 in three parts: the first two have few enough bits for exact products with small whole numbers. */
  static const double part_1 = 1.57079632673412561417e+00;
  static const double part_2 = 6.07710050630396597660e-11;
  static const double part_3 = 2.02226624879595063154e-21;
  const long long quarter = number_floor(angle * (2.0 / NUMBERS_PI) + 0.5);
  const double n = (double)quarter;
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
  switch ((unsigned)(unsigned long long)quarter & 3u) {
    case 0:
      *sine = s;
      *cosine = c;
      break;
    case 1:
      *sine = c;
      *cosine = -s;
      break;
    case 2:
      *sine = -s;
      *cosine = -c;
      break;
    default:
      *sine = -c;
      *cosine = s;
      break;
  }
}

double number_exp(double x) {
  static const double ln2_high = 6.93147180369123816490e-01;
  static const double ln2_low = 1.90821492927058770002e-10;
  if (!(x > -700.0)) return 0.0;
  if (x > 700.0) x = 700.0;
  const long long k = number_floor(x * 1.44269504088896338700 + 0.5);
  const double r = (x - (double)k * ln2_high) - (double)k * ln2_low; /* |r| <= 0.35 */
  double sum = 1.0;
  for (int i = 14; i >= 1; i--) sum = 1.0 + sum * r / (double)i;
  const uint64_t bits = (uint64_t)(k + 1023) << 52;
  double scale;
  memcpy(&scale, &bits, sizeof scale);
  return sum * scale;
}

double number_log(double x) {
  uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  long long exponent = (long long)((bits >> 52) & 0x7ffu) - 1023;
  bits = (bits & 0x000fffffffffffffu) | 0x3ff0000000000000u;
  double m;
  memcpy(&m, &bits, sizeof m); /* in [1, 2) */
  if (m > 1.41421356237309504880) {
    m *= 0.5;
    exponent++;
  }
  const double f = (m - 1.0) / (m + 1.0); /* ln m = 2 atanh f, |f| <= 0.172 */
  const double f2 = f * f;
  double sum = 0.0;
  for (int i = 21; i >= 1; i -= 2) sum = sum * f2 + 1.0 / (double)i;
  return 2.0 * f * sum + (double)exponent * 6.93147180559945286227e-01;
}

double number_tanh(double x) {
  const double magnitude = x < 0.0 ? -x : x;
  if (magnitude > 20.0) return x < 0.0 ? -1.0 : 1.0;
  if (magnitude < 1e-5) return x;
  const double e = number_exp(2.0 * magnitude);
  const double t = (e - 1.0) / (e + 1.0);
  return x < 0.0 ? -t : t;
}

double number_wrap(double angle) {
  if (angle > -NUMBERS_PI && angle <= NUMBERS_PI) return angle;
  const double turns = (double)number_floor(angle / (2.0 * NUMBERS_PI) + 0.5);
  double wrapped = angle - turns * (2.0 * NUMBERS_PI);
  if (wrapped <= -NUMBERS_PI) wrapped += 2.0 * NUMBERS_PI;
  if (wrapped > NUMBERS_PI) wrapped -= 2.0 * NUMBERS_PI;
  return wrapped;
}
