/* cos and sin of an angle together, and the angle of a vector: the transcendental functions of the
 * linkage.
 *
 * The platform's libm would do, but each has its own last digits: with these functions an FMU
 * returns the same bits on every platform, and they are faster than the calls.
 *
 * Error: below 1e-16, each component, for |angle| <= 2e8 rad (30 million turns, 8000 hours of
 * planting at 65 plants a minute); libm's beyond that. The rounding mode is to be round to
 * nearest, as C starts; in another one, which the host may set, it stays below 1e-9. */
#ifndef DIRECTION_H
#define DIRECTION_H

#include "linkage.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* (sin t - t)/t^3 and (cos t - 1 + t^2/2)/t^4 as polynomials in t^2 for |t| <= pi/4, errors of
 * sin and cos below 2e-17: Chebyshev interpolation, each coefficient rounded to a double
 * (tests/linkage/test_direction.py computes them). */
static const double DIRECTION_SIN[6] = {
    -0.16666666666666666,   0.008333333333330948,   -0.00019841269836756774,
    2.7557316101617874e-06, -2.505113165023518e-08, 1.5918115263265974e-10,
};
static const double DIRECTION_COS[6] = {
    0.041666666666666664,    -0.0013888888888887398, 2.480158729876456e-05,
    -2.7557317271145144e-07, 2.087614614655861e-09,  -1.1382623647474604e-11,
};

/* atan(t)/t as a polynomial in t^2 for 0 <= t <= 1, error of atan below 3e-6: likewise. */
static const double DIRECTION_ATAN[6] = {
    0.9999948346338879,   -0.33295711032247716, 0.19534659002798738,
    -0.12044858521319932, 0.05658998519982956,  -0.013130382075265306,
};

/* pi/2 = high + middle + low - 1.5e-33. High and middle have 25 bits each, so that their
 * products with a number of quarter turns below 2^28 are exact (Cody and Waite's reduction). */
static const double DIRECTION_QUARTER_HIGH = 1.5707963109016418;
static const double DIRECTION_QUARTER_MIDDLE = 1.5893254712295857e-08;
static const double DIRECTION_QUARTER_LOW = 6.123233995736766e-17;
static const double DIRECTION_QUARTERS_PER_RADIAN = 0.6366197723675814;
static const double DIRECTION_LIMIT = 2e8;

/* c0 + c1 z + ... + c5 z^5, in pairs: the shorter wait beats the fewer operations of Horner. */
static inline double direction_polynomial(const double c[6], double z) {
    double z2 = z * z;
    return ((c[0] + c[1] * z) + z2 * (c[2] + c[3] * z)) + (z2 * z2) * (c[4] + c[5] * z);
}

/* (cos t, sin t) of the angle t that is left of `angle` (rad) without `*quarters` (0 to 3) quarter
 * turns: for those who turn by quarters at no cost, by having turned beforehand. */
static inline Vector direction_within_quarter(double angle, unsigned *quarters) {
    if (!(fabs(angle) <= DIRECTION_LIMIT)) {
        *quarters = 0;
        return (Vector){cos(angle), sin(angle)};
    }

    /* the nearest number of quarter turns: adding 1.5 * 2^52 leaves no room for fractions, and
     * puts the integer into the low bits */
    const double round = 6755399441055744.0;
    double shifted = angle * DIRECTION_QUARTERS_PER_RADIAN + round;
    double turned = shifted - round;
    uint64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    *quarters = (unsigned)(bits & 3);

    /* t + t_low = angle - turned pi/2 */
    double rest = (angle - turned * DIRECTION_QUARTER_HIGH) - turned * DIRECTION_QUARTER_MIDDLE;
    double low = turned * DIRECTION_QUARTER_LOW;
    double t = rest - low;
    double t_low = (rest - t) - low;

    double z = t * t, half_z = 0.5 * z, head = 1.0 - half_z;
    double s = t + ((t * z) * direction_polynomial(DIRECTION_SIN, z) + t_low * head);
    double c = head
               + (((1.0 - head) - half_z)
                  + ((z * z) * direction_polynomial(DIRECTION_COS, z) - t * t_low));
    return (Vector){c, s};
}

/* (cos angle, sin angle): the unit vector at `angle` rad from forward, counter-clockwise. */
static inline Vector direction(double angle) {
    unsigned quarters;
    Vector v = direction_within_quarter(angle, &quarters);
    switch (quarters) {
    case 0: return v;
    case 1: return (Vector){-v.y, v.x};
    case 2: return (Vector){-v.x, -v.y};
    default: return (Vector){v.y, -v.x};
    }
}

/* The angle of a vector that is not 0, within half a turn of forward, as atan2(v.y, v.x). Error:
 * below one unit in the last place of pi, 4.5e-16. */
static inline double direction_angle(Vector v) {
    const double quarter = 1.5707963267948966, half = 3.141592653589793;
    double along = fabs(v.x), across = fabs(v.y);
    double t = across < along ? across / along : along / across;
    double near = t * direction_polynomial(DIRECTION_ATAN, t * t);
    near = across < along ? near : quarter - near;
    near = v.x < 0.0 ? half - near : near;
    near = v.y < 0.0 ? -near : near;
    /* the rest is its own tangent: the third part of its cube is below 1e-17 */
    Vector e = direction(near);
    return near + (e.x * v.y - e.y * v.x) / (e.x * v.x + e.y * v.y);
}

#endif
