/* What a component remembers of a signal that it is given once a step: the polynomial through
 * its last samples, in Newton's form, so that steps may vary. Plain data: 8-byte members only. */
#ifndef SAMPLES_H
#define SAMPLES_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* Marks what few calls execute, those that are refused before all: kept out of the way of the
 * others. */
#if defined(__GNUC__)
#define COMPONENT_RARELY __attribute__((cold, noinline))
#else
#define COMPONENT_RARELY
#endif

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

/* The older samples and one that lies `change` above their newest (its difference, where values
 * wrap). degree: of the polynomial to keep, 1 to 3. */
static inline void samples_add(Samples *samples, const Samples *older, const SampleTimes *times,
                               double value, double change, int degree) {
    double first = 0.0, second = 0.0, third = 0.0;
    if (older->count >= 1)
        first = change * times->per_span[0];
    if (degree >= 2 && older->count >= 2)
        second = (first - older->first) * times->per_span[1];
    if (degree >= 3 && older->count >= 3)
        third = (second - older->second) * times->per_span[2];
    int64_t count = older->count <= degree ? older->count + 1 : older->count;
    *samples = (Samples){value, first, second, third, count};
}

/* Takes the newest sample away, leaving the differences of the others; returns by how much it lay
 * above the one before it. Where there were samples for the whole degree, the highest difference
 * stays: it is not added to, but still tells how slopes are expected to change. */
static inline double samples_drop(Samples *samples, const SampleTimes *times, int degree) {
    double one = times->gap[0], two = one + times->gap[1], three = two + times->gap[2];
    double step = samples->first * one;
    *samples = (Samples){samples->newest - step, samples->first - samples->second * two,
                         samples->second - samples->third * three, samples->third,
                         samples->count > degree ? samples->count : samples->count - 1};
    return step;
}

/* The one of smaller magnitude, 0 where they differ in sign. */
static inline double smaller_slope(double a, double b) {
    if (a * b <= 0.0)
        return 0.0;
    return fabs(a) < fabs(b) ? a : b;
}

/* Whether a slope that changed not as expected tells of a jump; it does not where a smooth signal
 * is sampled eight times or more in its shortest period. */
static inline bool slope_jumped(double slope_before, double expected, double change) {
    return fabs(change - expected) > 0.75 * (fabs(slope_before) + fabs(expected));
}

/* The time derivatives at the newest sample of the polynomial of degree 2 or 3 that continues
 * the signal. `older`: the history without the newest sample. A polynomial of degree 2 or 3
 * through samples on both sides of a jump would overshoot, for as many steps as it has samples:
 * there, the smaller of the last two slopes goes on. */
static inline Derivatives samples_derivatives(const Samples *samples, const Samples *older,
                                              const SampleTimes *times, int degree) {
    double one = times->gap[0], two = one + times->gap[1];
    double first = samples->first, second = samples->second, third = samples->third;
    if (older->count > degree) {
        bool is_cubic = degree == 3;
        double *slope = is_cubic ? &second : &first, *higher = is_cubic ? &third : &second;
        double slope_before = is_cubic ? older->second : older->first;
        double expected = is_cubic ? older->third * (two + times->gap[2]) : older->second * two;
        if (slope_jumped(slope_before, expected, *slope - slope_before)) {
            *slope = smaller_slope(*slope, slope_before);
            *higher = 0.0;
        }
    }
    /* first s + second s (s + one) + third s (s + one) (s + two), s = 0 at the newest sample */
    return (Derivatives){
        first + one * (second + two * third),
        2.0 * (second + (one + two) * third),
        6.0 * third,
    };
}

#endif
