/* Derivatives by the crank angle of vectors that turn: with the cranks, or with a link whose
 * angle's derivatives (rates) are known. */
#ifndef TURNING_H
#define TURNING_H

#include "plane.h"

/* The n-th derivative of a e(-phi) is (-i)^n a e(-phi). */
static inline Vector clockwise_derivative(int n, Vector a) {
    switch (n & 3) {
    case 0: return a;
    case 1: return (Vector){a.y, -a.x};
    case 2: return (Vector){-a.x, -a.y};
    default: return (Vector){-a.y, a.x};
    }
}

/* A link z of rates rate[] has z^(n) = (known + i rate[n]) z; `known` follows from lower orders
 * (Faa di Bruno's formula for e(angle)). At order 1 it is zero, at order 2 real: n is constant
 * where these functions are inlined, so that nothing is spent on those zeros. */
static inline Vector known_part(int n, const double *rate) {
    double w = rate[1];
    switch (n) {
    case 1: return (Vector){0.0, 0.0};
    case 2: return (Vector){-w * w, 0.0};
    case 3: return (Vector){-3.0 * w * rate[2], -w * w * w};
    default:
        return (Vector){w * w * w * w - 4.0 * w * rate[3] - 3.0 * rate[2] * rate[2],
                        -6.0 * w * w * rate[2]};
    }
}

/* The n-th derivative of start + z, whose own one is `start_derivative`. The rate of order n, which
 * is known last, is added last. */
static inline Vector derivative_beyond(int n, Vector start_derivative, const double *rate,
                                       Vector z) {
    Vector across = {-rate[n] * z.y, rate[n] * z.x}, known = known_part(n, rate);
    if (n == 1)
        return plus(start_derivative, across);
    Vector rest = n == 2 ? scaled(known.x, z) : turned(known, z);
    return plus(plus(start_derivative, rest), across);
}

#endif
