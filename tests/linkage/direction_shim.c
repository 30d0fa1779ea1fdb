/* direction.h as a function over arrays, for test_direction.py. */
#include "linkage/direction.h"

#include <stddef.h>

#if defined(_WIN32)
#define SHOWN __declspec(dllexport)
#else
#define SHOWN __attribute__((visibility("default")))
#endif

SHOWN void directions(size_t count, const double angle[], double cosine[], double sine[]);

void directions(size_t count, const double angle[], double cosine[], double sine[]) {
    for (size_t i = 0; i < count; ++i) {
        Vector v = direction(angle[i]);
        cosine[i] = v.x;
        sine[i] = v.y;
    }
}
