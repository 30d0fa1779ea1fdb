#include "crank.h"

#include <math.h>

/* One turn as the sum of two doubles, so that unwrapping loses nothing. */
static const double TURN = 6.283185307179586477, TURN_LOW = 2.4492935982947064e-16;
static const double JUMP = 1.570796326794896619; /* a quarter turn */

/* The motion h seconds later: Taylor's series. */
static CrankMotion motion_after(CrankMotion m, double h) {
    /* powers first: the angle is what everything after the step waits for */
    static const double THIRD = 1.0 / 3.0;
    double half_square = 0.5 * h * h, cube = half_square * h * THIRD;
    return (CrankMotion){
        (m.phi + (h * m.w + half_square * m.a)) + cube * m.jerk,
        m.w + (h * m.a + half_square * m.jerk),
        m.a + h * m.jerk,
        m.jerk,
    };
}

static bool are_set(const CrankInput *input, const InputDerivatives *derivatives) {
    return input->has_derivatives && derivatives_order(derivatives) > 0;
}

static bool is_given(double rate, const CrankInput *input, const InputDerivatives *derivatives) {
    return rate != 0.0
           || (are_set(input, derivatives)
               && (derivatives->value[0] != 0.0 || derivatives->value[1] != 0.0));
}

static CrankSource best_source(const Crank *before, const CrankInput *input) {
    if (before->source == SOURCE_ACCELERATION)
        return SOURCE_ACCELERATION;
    if (before->source == SOURCE_ANGLE && !is_given(input->w, input, &input->w_derivatives))
        return SOURCE_ANGLE;
    return is_given(input->a, input, &input->a_derivatives) ? SOURCE_ACCELERATION : SOURCE_SPEED;
}

static double source_value(CrankSource source, const CrankInput *input) {
    switch (source) {
    case SOURCE_ANGLE: return input->phi;
    case SOURCE_SPEED: return input->w;
    default: return input->a;
    }
}

/* The host begins to give a higher derivative. Its zeros so far are samples where the crank did
 * not change what the host gave; elsewhere they only say that the derivative was not connected.
 * One sample shows no change: there, a crank that starts from rest has come half as far as one
 * that ran on, and the limit lies between. */
static Samples zeros_so_far(const Samples *below, double change, double w, double gap) {
    bool is_flat = below->first == 0.0 && below->second == 0.0 && below->third == 0.0;
    bool was_given = is_flat && (below->count > 1 || fabs(change) < 0.75 * fabs(w * gap));
    return (Samples){.count = was_given ? below->count : 0};
}

/* Degrees of the polynomials: four angles, three speeds or two accelerations reach order 4. */
static void add_sample(Samples *samples, CrankSource source, const SampleTimes *times,
                       const CrankInput *input, double phi_change) {
    switch (source) {
    case SOURCE_ANGLE: samples_add(samples, times, input->phi, phi_change, 3); break;
    case SOURCE_SPEED: samples_add(samples, times, input->w, input->w - samples->newest, 2); break;
    default: samples_add(samples, times, input->a, input->a - samples->newest, 1); break;
    }
}

/* The motion at the newest sample, each derivative from the best source there is. */
static CrankMotion motion_at_sample(const Samples *samples, CrankSource source,
                                    const SampleTimes *times, const CrankInput *input) {
    Derivatives trend;
    CrankMotion motion = {input->phi, input->w, input->a, 0.0};
    switch (source) {
    case SOURCE_ANGLE:
        if (are_set(input, &input->phi_derivatives)) {
            motion.w = input->phi_derivatives.value[0];
            motion.a = input->phi_derivatives.value[1];
        } else {
            trend = samples_derivatives(samples, times);
            motion.w = trend.first;
            motion.a = input->a != 0.0 ? input->a : trend.second;
            motion.jerk = trend.third;
        }
        return motion;
    case SOURCE_SPEED:
        trend = samples_derivatives(samples, times);
        motion.a = trend.first;
        motion.jerk = trend.second;
        break;
    default: motion.jerk = samples->first; break;
    }
    if (are_set(input, &input->a_derivatives))
        motion.jerk = input->a_derivatives.value[0];
    if (are_set(input, &input->w_derivatives)) {
        motion.a = input->w_derivatives.value[0];
        motion.jerk = input->w_derivatives.value[1];
    }
    return motion;
}

CrankMotion crank_motion_of(const CrankInput *input) {
    static const SampleTimes no_times;
    static const Samples no_samples;
    static const Crank no_crank;
    return motion_at_sample(&no_samples, best_source(&no_crank, input), &no_times, input);
}

void crank_drop_sample(Crank *crank, const SampleTimes *times) {
    double step = samples_drop(&crank->samples, times);
    if (crank->source == SOURCE_ANGLE)
        crank->phi -= step;
}

void crank_start(Crank *crank, const CrankInput *input) {
    CrankSource source = best_source(crank, input);
    crank->phi = input->phi;
    crank->source = source;
    samples_start(&crank->samples, source_value(source, input));
}

int crank_advance(const Crank *before, const SampleTimes *times, const CrankInput *input, double h,
                  Crank *restrict after) {
    int noticed = 0;
    double change = input->phi - before->phi;
    bool is_first = before->samples.count == 0;
    if (!is_first) {
        CrankMotion expected = before->end;
        if (input->at_step_end) {
            expected.phi = before->phi;
            expected = motion_after(expected, h);
        }
        double off = input->phi - expected.phi;
        if (!(fabs(off) <= JUMP)) {
            double turns = floor(off / TURN + 0.5);
            change = (change - turns * TURN) - turns * TURN_LOW;
            off = (off - turns * TURN) - turns * TURN_LOW;
            is_first = !(fabs(off) <= JUMP);
            noticed = is_first ? CRANK_RESTARTED : CRANK_UNWRAPPED;
        }
    }
    CrankSource source = best_source(before, input);
    after->phi = input->phi;
    after->source = source;
    if (is_first) {
        samples_start(&after->samples, source_value(source, input));
    } else {
        after->samples = source == before->source
                             ? before->samples
                             : zeros_so_far(&before->samples, change, input->w, times->gap[0]);
        add_sample(&after->samples, source, times, input, change);
    }
    CrankMotion motion = motion_at_sample(&after->samples, source, times, input);
    after->end = input->at_step_end ? motion : motion_after(motion, h);
    if (are_set(input, &input->phi_derivatives) && !input->at_step_end) {
        const double *derivative = input->phi_derivatives.value;
        after->end.phi = input->phi + h * (derivative[0] + h * (0.5 * derivative[1]));
    }
    return noticed;
}
