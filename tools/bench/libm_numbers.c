/* libm_numbers.c: the functions of world/numbers.h by the C library, for the bench alone: how much faster a world would be
 * that need not give the same bits everywhere. */
#include <math.h>

#include "world/numbers.h"

void number_sincos(double angle, double *sine, double *cosine) {
  *sine = sin(angle);
  *cosine = cos(angle);
}

double number_exp(double x) { return exp(x); }

double number_log(double x) { return log(x); }

double number_tanh(double x) { return tanh(x); }

double number_atan2(double y, double x) { return atan2(y, x); }

double number_wrap(double angle) {
  const double wrapped = remainder(angle, 2.0 * NUMBERS_PI);
  return wrapped == -NUMBERS_PI ? NUMBERS_PI : wrapped;
}
