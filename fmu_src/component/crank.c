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

static const InputDerivatives *source_derivatives(CrankSource source, const CrankInput *input) {
    switch (source) {
    case SOURCE_ANGLE: return &input->phi_derivatives;
    case SOURCE_SPEED: return &input->w_derivatives;
    default: return &input->a_derivatives;
    }
}

/* Of the polynomial through its samples: four angles, three speeds or two accelerations reach
 * order 4. */
static int degree_of(CrankSource source) { return 3 - (int)source; }

/* The host begins to give a higher derivative. Its zeros so far are samples where the crank did
 * not change what the host gave; elsewhere they only say that the derivative was not connected.
 * One sample shows no change: there, a crank that starts from rest has come half as far as one
 * that ran on, and the limit lies between. */
static Samples zeros_so_far(const Samples *below, CrankSource source, double change, double w,
                            double gap) {
    int64_t most = degree_of(source) + 1;
    bool is_flat = below->first == 0.0 && below->second == 0.0 && below->third == 0.0;
    bool was_given = is_flat && (below->count > 1 || fabs(change) < 0.75 * fabs(w * gap));
    return (Samples){.count = !was_given ? 0 : below->count < most ? below->count : most};
}

/* Adds the newest sample to the older ones; returns what continues them for h seconds. */
static Derivatives add_sample(Samples *samples, const Samples *older, CrankSource source,
                              const SampleTimes *times, const CrankInput *input, double phi_change,
                              double h) {
    switch (source) {
    case SOURCE_ANGLE:
        samples_add(samples, older, times, input->phi, phi_change, 3);
        return samples_derivatives(samples, older, times, 3, h);
    case SOURCE_SPEED:
        samples_add(samples, older, times, input->w, input->w - older->newest, 2);
        return samples_derivatives(samples, older, times, 2, h);
    default:
        samples_add(samples, older, times, input->a, input->a - older->newest, 1);
        return samples_derivatives(samples, older, times, 1, h);
    }
}

/* The motion at the newest sample, each derivative from the best source there is; trend: of the
 * source's samples. */
static CrankMotion motion_at_sample(CrankSource source, Derivatives trend,
                                    const CrankInput *input) {
    CrankMotion motion = {input->phi, input->w, input->a, 0.0};
    switch (source) {
    case SOURCE_ANGLE:
        if (are_set(input, &input->phi_derivatives)) {
            motion.w = input->phi_derivatives.value[0];
            motion.a = input->phi_derivatives.value[1];
        } else {
            motion.w = trend.first;
            motion.a = input->a != 0.0 ? input->a : trend.second;
            motion.jerk = trend.third;
        }
        return motion;
    case SOURCE_SPEED:
        motion.a = trend.first;
        motion.jerk = trend.second;
        break;
    default: motion.jerk = trend.first; break;
    }
    if (are_set(input, &input->a_derivatives))
        motion.jerk = input->a_derivatives.value[0];
    if (are_set(input, &input->w_derivatives)) {
        motion.a = input->w_derivatives.value[0];
        motion.jerk = input->w_derivatives.value[1];
    }
    return motion;
}

/* The weights of samples fade with this time constant: a fiftieth is left after the window. One
 * far below every step does no more, and its powers stay numbers. */
static double fade_time(const CrankInput *input) { return fmax(0.25 * input->smoothing, 1e-12); }

/* Adds the newest sample, `change` above the one `gap` before it, to the fit, whose degree is the
 * one without smoothing. */
static COMPONENT_RARELY void add_to_fit(Fit *fit, CrankSource source, double gap, double change,
                                        const CrankInput *input) {
    fit_add(fit, gap / fade_time(input), change, degree_of(source));
}

/* Whether it has met samples over steps like that, or goes no farther in `ahead` seconds than the
 * last samples bear out, but for noise. */
static COMPONENT_RARELY bool fit_is_believed(const Crank *crank, const Samples *older,
                                             const SampleTimes *times, double ahead,
                                             const CrankInput *input) {
    double time = ahead / fade_time(input), change = fit_change(&crank->fit, time);
    if (time <= FIT_LONGEST * crank->fit.met
        && fabs(change) <= FIT_STEEPEST * crank->fit.slope * time)
        return true;
    int degree = degree_of((CrankSource)crank->source);
    LastSlopes last = last_slopes(&crank->samples, older, times, degree);
    double farthest = farthest_change(&last, &crank->samples, times, degree, change, ahead);
    if (degree < 3)
        farthest = fmin(farthest, farthest_of_a_rate(&last, &crank->samples, times));
    return fabs(change) <= farthest + FIT_OUTLIER * fmin(crank->fit.noise, crank->fit.missed);
}

/* What continues the fit: its motion at the newest sample instead of the trend of the samples. */
static COMPONENT_RARELY CrankMotion smooth_motion(const Fit *fit, CrankSource source,
                                                  const CrankInput *input) {
    const double *c = fit->coefficient, per_time = 1.0 / fade_time(input);
    CrankMotion motion =
        motion_at_sample(source,
                         (Derivatives){per_time * c[1], 2.0 * per_time * per_time * c[2],
                                       6.0 * per_time * per_time * per_time * c[3]},
                         input);
    switch (source) {
    case SOURCE_ANGLE: motion.phi += c[0]; break;
    case SOURCE_SPEED: motion.w += c[0]; break;
    default: motion.a += c[0]; break;
    }
    return motion;
}

CrankMotion crank_motion_of(const CrankInput *input) {
    static const Derivatives no_trend;
    static const Crank no_crank;
    return motion_at_sample(best_source(&no_crank, input), no_trend, input);
}

void crank_drop_samples(Crank *crank, SampleTimes *times, double gap, double h) {
    CrankSource source = (CrankSource)crank->source;
    Samples *samples = &crank->samples;
    int64_t left = samples->count;
    double since_newest = gap, rise = 0.0;
    for (bool again = false; samples_are_close(gap, h) && left > 0; again = true) {
        double last = times->gap[0], dropped = samples->newest;
        double step = samples_drop(samples, times, degree_of(source));
        left -= 1;
        rise += step;
        if (again) /* what a full history has in reserve is gone */
            *samples = (Samples){samples->newest, samples->first, 0.0, 0.0, left};
        if (source == SOURCE_ANGLE) {
            crank->phi -= step;
        } else {
            double w = source == SOURCE_SPEED ? samples->newest
                                              : crank->w - 0.5 * (dropped + samples->newest) * last;
            crank->phi -= 0.5 * (crank->w + w) * last;
            crank->w = w;
        }
        *times = (SampleTimes){.gap = {times->gap[1], times->gap[2]}};
        gap += last;
    }
    sample_times_add(times, gap);
    times->are_equal = 0; /* the next step has its own, with nothing left out */
    times->skipped_gap = since_newest;
    times->skipped_rise = rise;
}

void crank_start(Crank *crank, const CrankInput *input) {
    CrankSource source = best_source(crank, input);
    crank->phi = input->phi;
    crank->w = input->w;
    crank->source = source;
    crank->is_told = source != SOURCE_ANGLE;
    samples_start(&crank->samples, source_value(source, input));
    if (input->smoothing > 0.0)
        add_to_fit(&crank->fit, source, 0.0, 0.0, input);
}

/* ---- whether the speed is the angle's -----------------------------------------------------------
 */

/* What speaks against it counts at most this much from one sample, so that no single jump does;
 * more than 1.5 times as much does, where it is more than 0.55 of the way (no tie of whole parts).
 */
static const double MOST_EVIDENCE = 0.02; /* rad, about a degree */
enum { AGREEMENTS = 2 }; /* in a row, until it is believed again: a jump may make one */

static double no_more_than(double most, double value) { return fmax(-most, fmin(most, value)); }

/* The doubt after a sample: the angle moved by `change`, the speeds say `told`; greatest: how far
 * either may have moved. */
static COMPONENT_RARELY CrankDoubt doubt_after(CrankDoubt doubt, double change, double told,
                                               double greatest) {
    static const CrankDoubt none;
    doubt.missed += no_more_than(MOST_EVIDENCE, change - told);
    doubt.moved += fmin(MOST_EVIDENCE, greatest);
    double missed = fabs(doubt.missed);
    if (doubt.is_ignored)
        return doubt.moved > 4 * MOST_EVIDENCE && missed < 0.23 * doubt.moved
                   ? (CrankDoubt){.is_ignored = doubt.is_ignored - 1}
               : doubt.moved > 8 * MOST_EVIDENCE ? (CrankDoubt){.is_ignored = AGREEMENTS}
                                                 : doubt;
    if (missed > 1.5 * MOST_EVIDENCE && missed > 0.55 * doubt.moved)
        return (CrankDoubt){.is_ignored = AGREEMENTS};
    if (doubt.moved > 8 * MOST_EVIDENCE) /* and nothing came of it */
        return none;
    return doubt;
}

/* Whether a step needs no second look at crank.w: nearly none does. told: how far the angle moved
 * by the speeds. */
static inline bool speed_agrees(const Crank *before, double change, double told) {
    return fabs(change - told) <= 0.25 * fabs(change) && before->doubt.moved == 0.0
           && !before->doubt.is_ignored;
}

/* Fills in *doubt, as it is after this sample; returns whether the sample tells by itself that
 * angle or speed is wrong. */
static COMPONENT_RARELY bool look_at_speed(const Crank *before, const CrankInput *input, double gap,
                                           double change, double told, CrankDoubt *doubt) {
    double missed = fabs(change - told);
    double greatest = fmax(fabs(change), fmax(fabs(before->w), fabs(input->w)) * gap);
    *doubt = doubt_after(before->doubt, change, told, greatest);
    return missed > MOST_EVIDENCE && missed > 0.5 * greatest;
}

/* ---- the step -----------------------------------------------------------------------------------
 */

/* Whole turns in a change of the angle, of which `expected` was expected; is_told: by more than
 * angles alone, which tell of turns only where the host's angle leaps by more than half a one. */
static double whole_turns(double change, double expected, bool is_told) {
    if (!is_told) {
        if (fabs(change) <= 0.5 * TURN)
            return 0.0;
        expected = no_more_than(0.5 * TURN, expected);
    }
    return floor((change - expected) / TURN + 0.5);
}

int crank_advance(const Crank *before, const SampleTimes *times, const CrankInput *input, double h,
                  Crank *restrict after) {
    int noticed = 0;
    after->doubt = before->doubt;
    double change = input->phi - before->phi;
    bool is_first = before->samples.count == 0, is_contradicted = false;
    CrankSource source = best_source(before, input);
    if (!is_first) {
        CrankMotion expected = before->end;
        if (input->at_step_end) {
            expected.phi = before->phi;
            expected = motion_after(expected, h);
        }
        double off = input->phi - expected.phi;
        if (!(fabs(off) <= JUMP)) {
            double turns = whole_turns(change, expected.phi - before->phi, before->is_told);
            change = (change - turns * TURN) - turns * TURN_LOW;
            off = (off - turns * TURN) - turns * TURN_LOW;
            is_first = !(fabs(off) <= JUMP);
            noticed = is_first ? CRANK_RESTARTED : CRANK_UNWRAPPED;
        }
        /* angles of step ends may sweep as they like: nothing is predicted by the speed */
        if (!input->at_step_end && (before->source != SOURCE_ANGLE || before->doubt.is_ignored)) {
            double gap = times->gap[0], told = 0.5 * (before->w + input->w) * gap;
            if (!speed_agrees(before, change, told)) {
                is_contradicted = look_at_speed(before, input, gap, change, told, &after->doubt);
                if (after->doubt.is_ignored) {
                    source = SOURCE_ANGLE;
                    noticed |= before->doubt.is_ignored ? 0 : CRANK_SPEED_IGNORED;
                }
            }
        }
    }
    static const Samples none;
    const Samples *older = is_first ? &none : &before->samples;
    Samples others;
    SampleTimes of_others;
    if (!is_first && source != before->source) {
        if (source < (CrankSource)before->source) {
            others = (Samples){.newest = before->phi, .count = 1};
        } else {
            others = zeros_so_far(older, source, change, input->w, times->gap[0]);
            /* a crank that still stood may have been given the acceleration it started with */
            if (source == SOURCE_ACCELERATION)
                others.newest = before->end.a;
        }
        older = &others;
        of_others = *times; /* what was left out did not rise */
        of_others.skipped_rise = 0.0;
        times = &of_others;
    }
    after->phi = input->phi;
    after->w = input->w;
    after->source = source;
    after->is_told = source != SOURCE_ANGLE || are_set(input, &input->phi_derivatives);
    double ahead = input->at_step_end ? 0.0 : h;
    Derivatives trend = add_sample(&after->samples, older, source, times, input, change, ahead);
    CrankMotion motion = motion_at_sample(source, trend, input);
    if (is_contradicted && source != SOURCE_ANGLE && fabs(change) < fabs(input->w * times->gap[0]))
        motion = (CrankMotion){input->phi, change / times->gap[0], 0.0, 0.0};
    if (input->smoothing > 0.0) {
        after->fit = before->fit;
        if (older->count == 0 || source != before->source)
            fit_restart(&after->fit, older->count > 0 && source > (CrankSource)before->source);
        if (source != SOURCE_ANGLE)
            change = after->samples.newest - older->newest;
        add_to_fit(&after->fit, source, times->gap[0], change, input);
        if (fit_is_proven(&after->fit, ahead / fade_time(input), degree_of(source))
            && fit_is_believed(after, older, times, ahead, input) && !is_contradicted
            && !are_set(input, source_derivatives(source, input)))
            motion = smooth_motion(&after->fit, source, input);
    }
    after->end = input->at_step_end ? motion : motion_after(motion, h);
    if (are_set(input, &input->phi_derivatives) && !input->at_step_end) {
        const double *derivative = input->phi_derivatives.value;
        after->end.phi = input->phi + h * (derivative[0] + h * (0.5 * derivative[1]));
    }
    return noticed;
}
