/* numbers.c: see numbers.h. Series on a reduced argument. */
#include "numbers.h"

#include <stddef.h>

/* e^r - 1 for |r| <= 0.35, by its series. */
static double small_expm1(double r) {
  static const double c[] = {
      1.1470745597729725e-11, 1.6059043836821613e-10, 2.08767569878681e-09,
      2.505210838544172e-08,  2.755731922398589e-07,  2.7557319223985893e-06,
      2.48015873015873e-05,   1.984126984126984e-04,  1.388888888888889e-03,
      8.333333333333333e-03,  4.1666666666666664e-02, 1.6666666666666666e-01}; /* 1/14! ... 1/3! */
  double sum = c[0];
  for (size_t i = 1; i < sizeof c / sizeof c[0]; i++) sum = c[i] + r * sum;
  return r + r * r * (0.5 + r * sum);
}

/* 2 to the k, -1022 <= k <= 1023. */
static double power_of_two(long long k) {
  const uint64_t bits = (uint64_t)(k + 1023) << 52;
  double power;
  memcpy(&power, &bits, sizeof power);
  return power;
}

/* x = k ln 2 + r with |r| <= ln(2) / 2. */
static long long reduce(double x, double *r) {
  static const double ln2_high = 6.93147180369123816490e-01; /* few enough bits for an exact k ln2_high */
  static const double ln2_low = 1.90821492927058770002e-10;
  const long long k = number_floor(x * 1.44269504088896338700 + 0.5);
  *r = (x - (double)k * ln2_high) - (double)k * ln2_low;
  return k;
}

double number_exp(double x) {
  if (!(x > -700.0)) return 0.0;
  if (x > 700.0) x = 700.0;
  double r;
  const long long k = reduce(x, &r);
  return (1.0 + small_expm1(r)) * power_of_two(k);
}

double number_log(double x) {
  static const double c[] = {1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13,
                             1.0 / 11, 1.0 / 9,  1.0 / 7,  1.0 / 5,  1.0 / 3}; /* of atanh */
  static const double ln2_high = 6.93147180369123816490e-01;
  static const double ln2_low = 1.90821492927058770002e-10;
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
  /* ln m = 2 atanh f with f = (m - 1) / (m + 1), |f| <= 0.172; 2 f = g - f g with g = m - 1, which is exact. */
  const double g = m - 1.0;
  const double f = g / (m + 1.0);
  const double f2 = f * f;
  double sum = c[0];
  for (size_t i = 1; i < sizeof c / sizeof c[0]; i++) sum = c[i] + f2 * sum;
  const double k = (double)exponent;
  return k * ln2_high + (g - (f * (g - 2.0 * f2 * sum) - k * ln2_low));
}

double number_tanh(double x) {
  const double magnitude = x < 0.0 ? -x : x;
  if (magnitude > 20.0) return x < 0.0 ? -1.0 : 1.0;
  double r;
  const long long k = reduce(2.0 * magnitude, &r);
  const double power = power_of_two(k);
  const double e = k == 0 ? small_expm1(r) : power * small_expm1(r) + (power - 1.0); /* e^(2 |x|) - 1 */
  const double t = e / (e + 2.0);
  return x < 0.0 ? -t : t;
}

/* atan(k / 16), k = 0 ... 16, as the nearest number and what is missing to it. */
static const double sixteenths[17][2] = {
    {0x0.0p+0, 0x0.0p+0},
    {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.0657e94db30d0p-1, -0x1.d5b495f6349e6p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
};

/* atan(y / x) for 0 <= y <= x, x > 0, as the sum of high and low. */
static double first_octant(double y, double x, double *low) {
  const double ratio = y / x;
  const int k = (int)(ratio * 16.0 + 0.5);
  const double c = (double)k * 0.0625;
  const double z =
      k == 0 ? ratio : (y - c * x) / (x + c * y); /* atan a - atan c = atan((a - c) / (1 + a c)), |z| <= 1/32 */
  const double z2 = z * z;
  const double rest = z * z2 * (-1.0 / 3 + z2 * (1.0 / 5 + z2 * (-1.0 / 7 + z2 * (1.0 / 9 + z2 * (-1.0 / 11)))));
  *low = z + (rest + sixteenths[k][1]);
  return sixteenths[k][0];
}

double number_atan2(double y, double x) {
  static const double half_pi_low = 0x1.1a62633145c07p-54;
  const double ay = y < 0.0 ? -y : y;
  const double ax = x < 0.0 ? -x : x;
  if (ay == 0.0 && !(x < 0.0)) return y;
  double angle, low;
  if (ay <= ax) {
    angle = first_octant(ay, ax, &low);
    angle = x < 0.0 ? NUMBERS_PI - (angle - (2.0 * half_pi_low - low)) : angle + low;
  } else {
    const double high = first_octant(ax, ay, &low);
    angle = x < 0.0 ? NUMBERS_PI / 2.0 + (high + (low + half_pi_low)) : NUMBERS_PI / 2.0 - (high + (low - half_pi_low));
  }
  return y < 0.0 ? -angle : angle;
}
