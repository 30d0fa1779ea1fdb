/* The clock of the C hosts that measure costs. POSIX; who includes it defines _GNU_SOURCE first. */
#ifndef CLOCK_H
#define CLOCK_H

#include <time.h>

/* Nanoseconds since some moment. */
static inline double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

#endif
