#include "crank.h"

#include <math.h>

/* One turn as the sum of two doubles, so that unwrapping loses nothing. */
static const double TURN = 6.283185307179586477, TURN_LOW = 2.4492935982947064e-16;
static const double HALF_TURN = 3.141592653589793238;
static const double JUMP = 1.570796326794896619; /* a quarter turn */

CrankMotion crank_motion_after(CrankMotion m, double h) {
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

static bool is_given(double rate, const InputDerivatives *derivatives) {
    return rate != 0.0 || derivatives->value[0] != 0.0 || derivatives->value[1] != 0.0;
}

static CrankSource best_source(const Crank *crank, const CrankInput *input) {
    if (crank->source == SOURCE_ACCELERATION || is_given(input->a, input->a_derivatives))
        return SOURCE_ACCELERATION;
    if (crank->source == SOURCE_SPEED || is_given(input->w, input->w_derivatives))
        return SOURCE_SPEED;
    return SOURCE_ANGLE;
}

/* The host gives a higher derivative from now on. Its zeros so far are samples if the derivative
 * below it has not changed; if it has, they only say that the higher one was not connected. */
static void change_source(Crank *crank, CrankSource source) {
    const Samples *s = &crank->samples;
    bool is_flat = s->first == 0.0 && s->second == 0.0 && s->third == 0.0;
    crank->samples = (Samples){.count = is_flat ? s->count : 0};
    crank->source = source;
}

static double source_value(const Crank *crank, const CrankInput *input) {
    switch (crank->source) {
    case SOURCE_ANGLE: return input->phi;
    case SOURCE_SPEED: return input->w;
    default: return input->a;
    }
}

/* Degrees of the polynomials: four angles, three speeds or two accelerations reach order 4. */
static void add_sample(Crank *crank, const SampleTimes *times, const CrankInput *input,
                       double phi_change) {
    switch (crank->source) {
    case SOURCE_ANGLE:
        samples_add(&crank->samples, times, input->phi, phi_change, 3);
        break;
    case SOURCE_SPEED:
        samples_add(&crank->samples, times, input->w, input->w - crank->samples.newest, 2);
        break;
    default:
        samples_add(&crank->samples, times, input->a, input->a - crank->samples.newest, 1);
        break;
    }
}

/* The motion at the newest sample, each derivative from the best source there is. */
static CrankMotion motion_at_sample(const Crank *crank, const SampleTimes *times,
                                    const CrankInput *input) {
    Derivatives trend;
    CrankMotion motion = {input->phi, input->w, input->a, 0.0};
    switch (crank->source) {
    case SOURCE_ANGLE:
        if (input->phi_derivatives->order > 0) {
            motion.w = input->phi_derivatives->value[0];
            motion.a = input->phi_derivatives->value[1];
        } else {
            trend = samples_derivatives(&crank->samples, times);
            motion.w = trend.first;
            motion.a = trend.second;
            motion.jerk = trend.third;
        }
        return motion;
    case SOURCE_SPEED:
        trend = samples_derivatives(&crank->samples, times);
        motion.a = trend.first;
        motion.jerk = trend.second;
        break;
    default:
        motion.jerk = crank->samples.first;
        break;
    }
    if (input->a_derivatives->order > 0)
        motion.jerk = input->a_derivatives->value[0];
    if (input->w_derivatives->order > 0) {
        motion.a = input->w_derivatives->value[0];
        motion.jerk = input->w_derivatives->value[1];
    }
    return motion;
}

void crank_start(Crank *crank, const CrankInput *input) {
    crank->phi = input->phi;
    samples_start(&crank->samples, source_value(crank, input));
}

int crank_advance(Crank *crank, const SampleTimes *times, const CrankInput *input, double h) {
    int noticed = 0;
    double change = input->phi - crank->phi;
    CrankSource source = best_source(crank, input);
    bool is_first = crank->samples.count == 0;
    if (!is_first) {
        CrankMotion expected = input->at_step_end ? crank_motion_after(crank->end, h) : crank->end;
        double off = input->phi - expected.phi;
        if (fabs(off) > HALF_TURN) {
            double turns = floor(off / TURN + 0.5);
            change = (change - turns * TURN) - turns * TURN_LOW;
            off = (off - turns * TURN) - turns * TURN_LOW;
            noticed = CRANK_UNWRAPPED;
        }
        if (!(fabs(off) <= JUMP)) {
            noticed = CRANK_RESTARTED;
            is_first = true;
        }
    }
    if (source != crank->source)
        change_source(crank, source);
    if (is_first)
        crank_start(crank, input);
    else
        add_sample(crank, times, input, change);
    crank->phi = input->phi;

    CrankMotion motion = motion_at_sample(crank, times, input);
    crank->end = input->at_step_end ? motion : crank_motion_after(motion, h);
    if (input->phi_derivatives->order > 0 && !input->at_step_end) {
        const double *derivative = input->phi_derivatives->value;
        crank->end.phi = input->phi + h * (derivative[0] + h * (0.5 * derivative[1]));
    }
    return noticed;
}
