/* direction.h as functions over arrays, for test_direction.py. */
#include "linkage/direction.h"

#include <stddef.h>

#if defined(_WIN32)
#define SHOWN __declspec(dllexport)
#else
#define SHOWN __attribute__((visibility("default")))
#endif

SHOWN void directions(size_t count, const double angle[], double cosine[], double sine[]);
SHOWN void angles(size_t count, const double x[], const double y[], double angle[]);

void directions(size_t count, const double angle[], double cosine[], double sine[]) {
    for (size_t i = 0; i < count; ++i) {
        Vector v = direction(angle[i]);
        cosine[i] = v.x;
        sine[i] = v.y;
    }
}

void angles(size_t count, const double x[], const double y[], double angle[]) {
    for (size_t i = 0; i < count; ++i)
        angle[i] = direction_angle((Vector){x[i], y[i]});
}
