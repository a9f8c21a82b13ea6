/* lfssao/kernels/elementary.py and spiral.py in C: the C library's functions would give other bits. */
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Compiled with -DROUNDING, each texel and each sample begins with the next direction of rounding at random. */
#ifdef ROUNDING
void next_rounding(void);
#define NEXT next_rounding();
#else
#define NEXT
#endif

static inline void sincospi_(double x, double *sine, double *cosine)
{
    const int64_t quadrant = x >= 0 ? (int64_t)(x * 2 + 0.5) : -(int64_t)(0.5 - x * 2);
    const double a = 3.141592653589793 * (x - (double)quadrant * 0.5), a2 = a * a;
    double s = 1.0 / 355687428096000.0, c = 1.0 / 20922789888000.0;
    s = s * a2 - 1.0 / 1307674368000.0;
    s = s * a2 + 1.0 / 6227020800.0;
    s = s * a2 - 1.0 / 39916800.0;
    s = s * a2 + 1.0 / 362880.0;
    s = s * a2 - 1.0 / 5040.0;
    s = s * a2 + 1.0 / 120.0;
    s = s * a2 - 1.0 / 6.0;
    s = s * a2 * a + a;
    c = c * a2 - 1.0 / 87178291200.0;
    c = c * a2 + 1.0 / 479001600.0;
    c = c * a2 - 1.0 / 3628800.0;
    c = c * a2 + 1.0 / 40320.0;
    c = c * a2 - 1.0 / 720.0;
    c = c * a2 + 1.0 / 24.0;
    c = c * a2 - 0.5;
    c = c * a2 + 1.0;
    switch (quadrant & 3) {
    case 0: *sine = s, *cosine = c; break;
    case 1: *sine = c, *cosine = -s; break;
    case 2: *sine = -s, *cosine = -c; break;
    default: *sine = -c, *cosine = s;
    }
}

static inline double log2_(double x)
{
    uint64_t bits;
    double m;
    x = x > 0x1p-1022 ? x : 0x1p-1022;
    x = x < INFINITY ? x : INFINITY;
    memcpy(&bits, &x, 8);
    int64_t k = (int64_t)(bits >> 52) - 1023;
    bits = (bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000;
    memcpy(&m, &bits, 8);
    if (m > 1.4142135623730951)
        m *= 0.5, k++;
    const double s = (m - 1) / (m + 1), s2 = s * s;
    double y = 1.0 / 21.0;
    for (int n = 19; n >= 3; n -= 2)
        y = y * s2 + 1.0 / n;
    y = (y * s2) * s + s;
    return (double)k + 2.8853900817779268 * y;
}

static inline double acos_(double x)
{
    const double size = fabs(x), square = size > 0.5 ? 0.5 * (1.0 - size) : size * size;
    const double sine = size > 0.5 ? sqrt(square) : size;
    double y = 1.0;
    for (int n = 48; n > 0; n -= 2)
        y = 1.0 + y * square * ((n - 1.0) * (n - 1.0) / (n * (n + 1.0)));
    const double angle = sine * y, near = size > 0.5 ? 2.0 * angle : 0.5 * 3.141592653589793 - angle;
    return x < 0.0 ? 3.141592653589793 - near : near;
}
