/* What a component remembers of a signal that it is given once a step: the polynomial through
 * its last samples, in Newton's form, so that steps may vary. Plain data: 8-byte members only. */
#ifndef SAMPLES_H
#define SAMPLES_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* Seconds between successive samples, the newest gap first, and the reciprocals of the time
 * from the newest sample to the 1st, 2nd and 3rd before it: one division each for all signals. */
typedef struct {
    double gap[3];
    double per_span[3];
    int64_t are_equal; /* the gaps, as under a constant step: nothing changes then */
} SampleTimes;

/* Divided differences of order 1, 2 and 3 at the newest of `count` samples; those for which
 * there are too few samples are 0. */
typedef struct {
    double newest;
    double first, second, third;
    int64_t count; /* at most 4 */
} Samples;

/* Time derivatives. */
typedef struct {
    double first, second, third;
} Derivatives;

/* The time derivatives of order 1 and 2 that a host has set with an input's value. */
typedef struct {
    double value[2];
    int64_t is_set[2];
} InputDerivatives;

/* How many of them count: one of order 2 says nothing without the one of order 1. */
static inline int derivatives_order(const InputDerivatives *derivatives) {
    return derivatives->is_set[0] ? (derivatives->is_set[1] ? 2 : 1) : 0;
}

/* isfinite, in two instructions where compilers make thirty of it. */
static inline bool is_finite(double value) { return fabs(value) <= DBL_MAX; }

/* Whether a sample is too near to the next one for a step of h: over the short time between
 * them a jump looks like a slope without bounds. */
static inline bool samples_are_close(double gap, double h) { return gap < 0.05 * h; }

/* Whether adding this gap would change anything. */
static inline bool sample_times_change(const SampleTimes *times, double gap) {
    return !(times->are_equal && gap == times->gap[0]);
}

/* Puts a gap (> 0) before the older ones. */
static inline void sample_times_add(SampleTimes *times, double gap) {
    double second = gap + times->gap[0], third = second + times->gap[1];
    times->gap[2] = times->gap[1];
    times->gap[1] = times->gap[0];
    times->gap[0] = gap;
    times->per_span[0] = 1.0 / gap;
    times->per_span[1] = 1.0 / second;
    times->per_span[2] = 1.0 / third;
    times->are_equal = gap == times->gap[1] && gap == times->gap[2];
}

/* Lengthens the newest gap by another one: the sample between them was taken away. */
static inline void sample_times_merge(SampleTimes *times, double gap) {
    SampleTimes older = {{times->gap[1], times->gap[2], 0.0}, {0.0}, 0};
    sample_times_add(&older, times->gap[0] + gap);
    *times = older;
}

/* Forgets all but one first sample. */
static inline void samples_start(Samples *samples, double value) {
    *samples = (Samples){.newest = value, .count = 1};
}

/* Adds a sample that lies `change` above the newest one (its difference, where values wrap).
 * degree: of the polynomial to keep, 1 to 3. */
static inline void samples_add(Samples *samples, const SampleTimes *times, double value,
                               double change, int degree) {
    double first = 0.0, second = 0.0, third = 0.0;
    if (samples->count >= 1)
        first = change * times->per_span[0];
    if (degree >= 2 && samples->count >= 2)
        second = (first - samples->first) * times->per_span[1];
    if (degree >= 3 && samples->count >= 3)
        third = (second - samples->second) * times->per_span[2];
    int64_t count = samples->count <= degree ? samples->count + 1 : samples->count;
    *samples = (Samples){value, first, second, third, count};
}

/* Takes the newest sample away, leaving the polynomial through the others; returns by how much
 * it lay above the one before it. */
static inline double samples_drop(Samples *samples, const SampleTimes *times) {
    double one = times->gap[0], two = one + times->gap[1], three = two + times->gap[2];
    double step = samples->first * one;
    *samples = (Samples){samples->newest - step, samples->first - samples->second * two,
                         samples->second - samples->third * three, 0.0, samples->count - 1};
    return step;
}

/* The time derivatives of the polynomial at its newest sample. */
static inline Derivatives samples_derivatives(const Samples *samples, const SampleTimes *times) {
    /* first s + second s (s + one) + third s (s + one) (s + two), s = 0 at the newest sample */
    double one = times->gap[0], two = one + times->gap[1];
    return (Derivatives){
        samples->first + one * (samples->second + two * samples->third),
        2.0 * (samples->second + (one + two) * samples->third),
        6.0 * samples->third,
    };
}

#endif
