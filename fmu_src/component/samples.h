/* What a component remembers of a signal that it is given once a step: the polynomial through
 * its last samples, in Newton's form, so that steps may vary. Plain data: 8-byte members only. */
#ifndef SAMPLES_H
#define SAMPLES_H

#include <stdbool.h>
#include <stdint.h>

enum { SAMPLES_MAX_ORDER = 3 };

/* Seconds between successive samples, the newest gap first, and the reciprocals of the time
 * from the newest sample to the 2nd, 3rd and 4th before it: one division each, for all signals. */
typedef struct {
    double gap[SAMPLES_MAX_ORDER];
    double per_span[SAMPLES_MAX_ORDER];
} SampleTimes;

/* difference[i] is the divided difference of order i + 1 at the newest of `count` samples. */
typedef struct {
    double newest;
    double difference[SAMPLES_MAX_ORDER];
    int64_t count;
} Samples;

/* The time derivatives of order 1 and 2 that a host has set with an input's value. */
typedef struct {
    double value[2];
    int64_t order; /* the highest one set; 0: none */
} InputDerivatives;

/* Puts a gap (> 0) before the older ones. */
void sample_times_add(SampleTimes *times, double gap);

/* Whether adding this gap would change anything: not so at a constant step. */
bool sample_times_change(const SampleTimes *times, double gap);

/* Forgets all but one first sample. */
void samples_start(Samples *samples, double value);

/* Adds a sample that lies `change` above the newest one (its difference, where values wrap).
 * order: the degree of the polynomial to keep, at most SAMPLES_MAX_ORDER. */
void samples_add(Samples *samples, const SampleTimes *times, double value, double change,
                 int order);

/* The first three time derivatives of the polynomial at its newest sample. */
void samples_derivatives(const Samples *samples, const SampleTimes *times, double derivative[3]);

#endif
