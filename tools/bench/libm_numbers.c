/* libm_numbers.c: the functions of world/numbers.h by the C library, for the bench alone: how much faster a world would be
 * that need not give the same bits everywhere. Sine, cosine and wrap are inline there, for a loop's sake, and stay. */
#include <math.h>

#include "world/numbers.h"

double number_exp(double x) { return exp(x); }

double number_log(double x) { return log(x); }

double number_tanh(double x) { return tanh(x); }

double number_atan2(double y, double x) { return atan2(y, x); }
