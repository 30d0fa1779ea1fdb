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
    /* Where samples within the newest gap were left out: the time since the newest of them (else
     * 0), and by how much it lay above the one before the gap. */
    double skipped_gap, skipped_rise;
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

/* A slope is carried on over at most this many times the gap that it was seen over. */
static const double MOST_GROWTH = 20.0;

/* Whether a sample is too near to the next one for a step of h: over the short time between
 * them a jump looks like a slope without bounds. */
static inline bool samples_are_close(double gap, double h) { return MOST_GROWTH * gap < h; }

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
    times->skipped_gap = times->skipped_rise = 0.0;
}

static inline bool are_merged(const SampleTimes *times) { return times->skipped_gap > 0.0; }

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

/* ---- how far to believe the polynomial ----------------------------------------------------
 *
 * Each change between samples is what holding the signal would have missed by. A prediction that
 * goes at most 5/3 as far as the largest of them misses by at most 2.5 times what holding misses,
 * a from-rest parabola (changes 1, 3, then 5) just passes, and nothing else need be known. Farther,
 * as where steps grow or a signal turns, it is believed where the polynomial through the older
 * samples has just met the newest one; else, as far as the slopes bear it out. What it missed by is
 * of higher order in the step than what it goes: steps that vary keep their order. */
static const double FARTHEST_CHANGE = 1.67; /* of the largest change between samples */
static const double FARTHEST_OF_A_LINE = 3.0; /* likewise, of an acceleration */
static const double GREATEST_MISS = 0.5; /* of it, that is expected of a polynomial believed */
static const double GREATEST_CUBIC = 1.0 / 3.0; /* its last term, of the others together: leaps of a
                                                 * coarse encoder every third step have 1/2 */
static const double GREATEST_SLOPE = 3.0; /* of the largest slope of a smooth signal; 1 + r at the
                                           * vertex of a parabola, the next step r times as long */
static const double GREATEST_UNPROVEN = 1.5; /* of the smallest of the last slopes, elsewhere */
static const double GREATEST_OF_A_RATE = 2.0; /* of the largest speed or acceleration: from -0.5
                                               * over 0.5 to 1.5; more than that moves the angle
                                               * farther than holding it ever missed by */
/* Differences within this many units in the last place of the values are their rounding. */
static const double ROUNDING = 16 * DBL_EPSILON;
/* Steps this many times as long as the gap before them, and more, make it worth a look. */
static const double LONG_STEP = 2.0;

/* Newton's form of the polynomial at the newest sample; one, two: seconds to the samples before. */
typedef struct {
    double first, second, third, one, two;
} Polynomial;

/* Its change over the next h seconds. */
static inline double polynomial_change(const Polynomial *p, double h) {
    return h * (p->first + (h + p->one) * (p->second + (h + p->two) * p->third));
}

/* Less the differences that are rounding; three: seconds to the third sample before. */
static COMPONENT_RARELY Polynomial polynomial_without_rounding(Polynomial p, const Samples *samples,
                                                               double three) {
    double rounding = ROUNDING * fabs(samples->newest);
    if (fabs(p.first * p.one) <= rounding)
        p.first = 0.0;
    if (fabs(p.second * p.one * p.two) <= rounding) {
        p.second = 0.0;
        if (fabs(p.third * p.one * p.two * three) <= 4 * rounding)
            p.third = 0.0;
    }
    return p;
}

/* The last slopes, at most three, the newest first; 0 where there are too few samples. */
typedef struct {
    double slope[3];
    bool are_three;
    double largest_change; /* that holding the signal missed by */
} LastSlopes;

static inline LastSlopes last_slopes(const Samples *samples, const Samples *older,
                                     const SampleTimes *times, int degree) {
    bool has_reserve = are_merged(times) && older->count > degree; /* see samples_drop */
    int64_t count = has_reserve ? degree : older->count;
    LastSlopes last = {.slope = {samples->first}, .are_three = count >= 3};
    if (count >= 2)
        last.slope[1] = older->first;
    if (last.are_three)
        last.slope[2] = older->first - older->second * (times->gap[1] + times->gap[2]);
    double newest = fabs(samples->first * times->gap[0]), largest = newest;
    if (are_merged(times)) /* of angles, one of the two that it is made of; a jump of the speed is
                            * no angle that was missed by */
        largest = degree == 3 ? fmax(fabs(times->skipped_rise),
                                     fabs(samples->first * times->gap[0] - times->skipped_rise))
                              : 0.0;
    if (degree == 3 || !are_merged(times))
        for (int i = 1; i < 3; ++i)
            largest = fmax(largest, fabs(last.slope[i] * times->gap[i]));
    last.largest_change = largest;
    return last;
}

/* The slope of a signal that is not known to be smooth: the smallest of the last three, where there
 * are so many, and no more than that since the newest sample that was left out, but for rounding.
 */
static inline double proven_slope(const LastSlopes *last, const Samples *samples,
                                  const SampleTimes *times) {
    double slope = smaller_slope(last->slope[0], last->slope[1]);
    if (last->are_three)
        slope = smaller_slope(slope, last->slope[2]);
    if (are_merged(times)) {
        double rise = samples->first * times->gap[0] - times->skipped_rise;
        double forward = slope < 0.0 ? -rise : rise;
        double most = fmax(0.0, forward + ROUNDING * fabs(samples->newest)) / times->skipped_gap;
        slope = fmax(-most, fmin(most, slope));
    }
    return slope;
}

/* How far a prediction over h seconds that changes the signal by `change` is believed to go: as far
 * as it came, or the way that its slopes say. */
static inline double farthest_change(const LastSlopes *last, const Samples *samples,
                                     const SampleTimes *times, int degree, double change,
                                     double h) {
    double slope = GREATEST_UNPROVEN * proven_slope(last, samples, times);
    double believed =
        slope * change > 0.0 ? fabs(slope) * fmin(h, MOST_GROWTH * times->gap[0]) : 0.0;
    double share = degree > 1 ? FARTHEST_CHANGE : FARTHEST_OF_A_LINE;
    return fmax(share * last->largest_change, believed);
}

/* And of a speed or an acceleration. */
static inline double farthest_of_a_rate(const LastSlopes *last, const Samples *samples,
                                        const SampleTimes *times) {
    double before = samples->newest - last->slope[0] * times->gap[0];
    double first = before - last->slope[1] * times->gap[1];
    return GREATEST_OF_A_RATE * fmax(fabs(samples->newest), fmax(fabs(before), fabs(first)));
}

/* Whether the polynomial of a full history is believed for h seconds: what the one before missed
 * the newest sample by, grown as the distances to the samples do, is little. */
static inline bool polynomial_is_borne_out(const Polynomial *p, const LastSlopes *last,
                                           const Samples *samples, const Samples *older,
                                           const SampleTimes *times, int degree, double h) {
    double three = p->two + times->gap[2], missed, grown;
    if (degree == 3) {
        missed = (samples->second - older->second - older->third * three) * p->one * p->two;
        grown = (h + three) / three;
    } else {
        missed = (samples->first - older->first - older->second * p->two) * p->one;
        grown = 1.0;
    }
    double times_longer = h / p->one;
    grown *= times_longer * (h + p->one) * (h + p->two) / (p->two * three);
    grown *= fmax(1.0, times_longer); /* a chance meeting would be carried the farther */
    double steepest = fmax(fabs(last->slope[0]), fmax(fabs(last->slope[1]), fabs(last->slope[2])));
    double line = p->first, bend = p->second * (h + p->one),
           cubic = p->third * (h + p->one) * (h + p->two);
    return fabs(missed) * grown <= GREATEST_MISS * last->largest_change
           && fabs(cubic) <= GREATEST_CUBIC * (fabs(line) + fabs(bend))
           && fabs(line + bend + cubic) * h
                  <= fmax(FARTHEST_CHANGE * last->largest_change,
                          GREATEST_SLOPE * steepest * fmin(h, MOST_GROWTH * p->one));
}

/* Lowers the degree until the change over h seconds is believed, and unproven terms do not outweigh
 * the slope; at last, the smaller of the last two slopes goes on, and a single one not much farther
 * than it has come. */
static COMPONENT_RARELY Polynomial polynomial_restrain(Polynomial p, const Samples *samples,
                                                       const Samples *older,
                                                       const SampleTimes *times, int degree,
                                                       bool is_smooth, double h) {
    LastSlopes last = last_slopes(samples, older, times, degree);
    if (is_smooth && polynomial_is_borne_out(&p, &last, samples, older, times, degree, h))
        return p;
    double change = polynomial_change(&p, h), most = fabs(p.first);
    bool third_is_small = fabs(p.third * (h + p.one) * (h + p.two)) <= most;
    bool second_is_small = fabs(p.second * (h + p.one)) <= most;
    double rate = degree == 2 ? farthest_of_a_rate(&last, samples, times) : HUGE_VAL;
    if (third_is_small && second_is_small
        && fabs(change) <= fmin(rate, farthest_change(&last, samples, times, degree, change, h)))
        return p;
    p.third = 0.0;
    change = polynomial_change(&p, h);
    if (second_is_small
        && fabs(change) <= fmin(rate, farthest_change(&last, samples, times, degree, change, h)))
        return p;
    p.second = 0.0;
    double farthest = fmin(rate, farthest_change(&last, samples, times, degree, p.first, h));
    if (fabs(p.first * h) <= farthest)
        return p;
    if (older->count >= 2)
        p.first = smaller_slope(samples->first, older->first);
    p.first = fmax(-farthest, fmin(farthest, p.first * h)) / h;
    return p;
}

/* The time derivatives at the newest sample of the polynomial of degree 1 to 3 that continues the
 * signal for h seconds. `older`: the history without the newest sample. A polynomial of degree 2 or
 * 3 through samples on both sides of a jump would overshoot, for as many steps as it has samples:
 * there, the smaller of the last two slopes goes on. */
static inline Derivatives samples_derivatives(const Samples *samples, const Samples *older,
                                              const SampleTimes *times, int degree, double h) {
    double one = times->gap[0], two = one + times->gap[1];
    if (degree == 1 && h <= FARTHEST_OF_A_LINE * one) /* a step as long as others: as it is */
        return (Derivatives){samples->first, 0.0, 0.0};
    Polynomial p = {samples->first, degree >= 2 ? samples->second : 0.0,
                    degree >= 3 ? samples->third : 0.0, one, two};
    double change = p.first * one;
    bool is_smooth = degree > 1 && older->count > degree && !are_merged(times);
    if (degree > 1 && older->count > degree) {
        bool is_cubic = degree == 3;
        double *slope = is_cubic ? &p.second : &p.first, *higher = is_cubic ? &p.third : &p.second;
        double slope_before = is_cubic ? older->second : older->first;
        double expected = is_cubic ? older->third * (two + times->gap[2]) : older->second * two;
        if (slope_jumped(slope_before, expected, *slope - slope_before)) {
            *slope = smaller_slope(*slope, slope_before);
            *higher = 0.0;
            is_smooth = false;
        }
    }
    if (h > LONG_STEP * one)
        p = polynomial_without_rounding(p, samples, two + times->gap[2]);
    double farthest = degree > 1 ? FARTHEST_CHANGE : FARTHEST_OF_A_LINE;
    if (!(fabs(polynomial_change(&p, h)) <= farthest * fabs(change)) || are_merged(times))
        p = polynomial_restrain(p, samples, older, times, degree, is_smooth, h);
    /* first s + second s (s + one) + third s (s + one) (s + two), s = 0 at the newest sample */
    return (Derivatives){
        p.first + one * (p.second + two * p.third),
        2.0 * (p.second + (one + two) * p.third),
        6.0 * p.third,
    };
}

#endif
