/* Vectors of the plane as complex numbers. */
#ifndef PLANE_H
#define PLANE_H

#include "linkage.h"

static inline Vector plus(Vector a, Vector b) { return (Vector){a.x + b.x, a.y + b.y}; }
static inline Vector minus(Vector a, Vector b) { return (Vector){a.x - b.x, a.y - b.y}; }
static inline Vector scaled(double s, Vector a) { return (Vector){s * a.x, s * a.y}; }
static inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y; }
static inline double cross(Vector a, Vector b) { return a.x * b.y - a.y * b.x; }

/* a b, the product of complex numbers: a turned and stretched by b. */
static inline Vector turned(Vector a, Vector b) {
    return (Vector){a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x};
}

#endif
