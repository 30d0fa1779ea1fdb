#include "crank.h"

#include <math.h>

/* One turn as the sum of two doubles, so that unwrapping loses nothing. */
static const double TURN = 6.283185307179586477, TURN_LOW = 2.4492935982947064e-16;
static const double HALF_TURN = 3.141592653589793238;
static const double QUARTER_TURN = 1.570796326794896619;

/* Degrees of the polynomials: four angles, three speeds, two accelerations reach order 4. */
enum { PHI_ORDER = 3, W_ORDER = 2, A_ORDER = 1 };

CrankMotion crank_motion_after(CrankMotion m, double h) {
    return (CrankMotion){
        m.phi + h * (m.w + h * (0.5 * m.a + h * (m.jerk / 6.0))),
        m.w + h * (m.a + h * (0.5 * m.jerk)),
        m.a + h * m.jerk,
        m.jerk,
    };
}

/* The host gives this rate from now on. Its zeros so far are samples if the crank stood still;
 * if not, they only say that the rate was not connected. */
static void begin_rate(Samples *rate, const Samples *phi) {
    const double *d = phi->difference;
    samples_start(rate, 0.0);
    if (d[0] == 0.0 && d[1] == 0.0 && d[2] == 0.0)
        rate->count = phi->count;
}

static bool is_set(const Signal *signal) {
    return signal->value != 0.0 || signal->derivative[0] != 0.0 || signal->derivative[1] != 0.0;
}

static void notice_rates(Crank *crank, const CrankInput *input) {
    if (!crank->a_is_given && is_set(&input->a)) {
        crank->a_is_given = 1;
        begin_rate(&crank->a, &crank->phi);
    }
    if (!crank->w_is_given && (crank->a_is_given || is_set(&input->w))) {
        crank->w_is_given = 1;
        begin_rate(&crank->w, &crank->phi);
    }
}

/* The motion at the sample, each derivative from the best source there is. */
static CrankMotion motion_at_sample(const Crank *crank, const SampleTimes *times,
                                    const CrankInput *input) {
    double trend[3];
    CrankMotion motion = {input->phi.value, 0.0, 0.0, 0.0};
    if (!crank->w_is_given) {
        if (input->phi.derivatives > 0) {
            motion.w = input->phi.derivative[0];
            motion.a = input->phi.derivative[1];
        } else {
            samples_derivatives(&crank->phi, times, trend);
            motion.w = trend[0];
            motion.a = trend[1];
            motion.jerk = trend[2];
        }
        return motion;
    }
    motion.w = input->w.value;
    if (crank->a_is_given) {
        motion.a = input->a.value;
        motion.jerk = crank->a.difference[0];
    } else {
        samples_derivatives(&crank->w, times, trend);
        motion.a = trend[0];
        motion.jerk = trend[1];
    }
    if (input->a.derivatives > 0)
        motion.jerk = input->a.derivative[0];
    if (input->w.derivatives > 0) {
        motion.a = input->w.derivative[0];
        motion.jerk = input->w.derivative[1];
    }
    return motion;
}

void crank_start(Crank *crank, const CrankInput *input) {
    samples_start(&crank->phi, input->phi.value);
    samples_start(&crank->w, input->w.value);
    samples_start(&crank->a, input->a.value);
}

int crank_advance(Crank *crank, const SampleTimes *times, const CrankInput *input, double h) {
    int noticed = 0;
    bool first = crank->phi.count == 0;
    double change = input->phi.value - crank->phi.newest;
    if (!first) {
        double expected = input->at_step_end ? crank_motion_after(crank->end, h).phi : crank->end.phi;
        double off = input->phi.value - expected;
        if (fabs(off) > HALF_TURN) {
            double turns = floor(off / TURN + 0.5);
            change = (change - turns * TURN) - turns * TURN_LOW;
            off = (off - turns * TURN) - turns * TURN_LOW;
            noticed |= CRANK_UNWRAPPED;
        }
        if (!(fabs(off) <= QUARTER_TURN)) {
            noticed = CRANK_RESTARTED;
            first = true;
        }
    }
    notice_rates(crank, input);
    if (first) {
        crank_start(crank, input);
    } else {
        samples_add(&crank->phi, times, input->phi.value, change, crank->w_is_given ? 0 : PHI_ORDER);
        if (crank->w_is_given)
            samples_add(&crank->w, times, input->w.value, input->w.value - crank->w.newest,
                        crank->a_is_given ? 0 : W_ORDER);
        if (crank->a_is_given)
            samples_add(&crank->a, times, input->a.value, input->a.value - crank->a.newest, A_ORDER);
    }

    CrankMotion motion = motion_at_sample(crank, times, input);
    if (input->at_step_end) {
        crank->end = motion;
        return noticed;
    }
    crank->end = crank_motion_after(motion, h);
    if (input->phi.derivatives > 0)
        crank->end.phi = input->phi.value
                         + h * (input->phi.derivative[0] + h * (0.5 * input->phi.derivative[1]));
    return noticed;
}
