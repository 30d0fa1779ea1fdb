#include "samples.h"

bool sample_times_change(const SampleTimes *times, double gap) {
    return gap != times->gap[0] || gap != times->gap[1] || gap != times->gap[2];
}

void sample_times_add(SampleTimes *times, double gap) {
    double second = gap + times->gap[0], third = second + times->gap[1];
    times->gap[2] = times->gap[1];
    times->gap[1] = times->gap[0];
    times->gap[0] = gap;
    times->per_span[0] = 1.0 / gap;
    times->per_span[1] = 1.0 / second;
    times->per_span[2] = 1.0 / third;
}

void samples_start(Samples *samples, double value) {
    *samples = (Samples){.newest = value, .count = 1};
}

void samples_add(Samples *samples, const SampleTimes *times, double value, double change,
                 int order) {
    double *difference = samples->difference;
    double next = change;
    for (int i = 0; i < order && i < samples->count; ++i) {
        double old = difference[i];
        difference[i] = next * times->per_span[i];
        next = difference[i] - old;
    }
    samples->newest = value;
    if (samples->count <= order)
        samples->count += 1;
}

void samples_derivatives(const Samples *samples, const SampleTimes *times, double derivative[3]) {
    /* the polynomial is d0 s + d1 s (s + one) + d2 s (s + one) (s + two), s = 0 at the newest */
    const double *d = samples->difference;
    double one = times->gap[0], two = one + times->gap[1];
    derivative[0] = d[0] + one * (d[1] + two * d[2]);
    derivative[1] = 2.0 * (d[1] + (one + two) * d[2]);
    derivative[2] = 6.0 * d[2];
}
