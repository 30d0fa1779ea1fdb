#include "step.h"

#include "inputs.h"
#include "message.h"
#include "pose.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A host's time may be off the end of the last step by its own rounding: i*h against a sum, or
 * a clock that counts nanoseconds. */
static const double TIME_TOLERANCE_STEPS = 1e-6;      /* of the step */
static const double TIME_TOLERANCE_ULPS = 16 * DBL_EPSILON; /* of the time */

/* Refused steps in a row after which no other one is discarded but an error, for hosts that never
 * try the same one twice; bisecting down to the last bit takes a tenth of them. */
enum { MOST_DISCARDS = 1000 };

ComponentStatus component_check_step(Component *c, double time, double step) {
    double expected = c->value[VARIABLE_TIME];
    double tolerance = TIME_TOLERANCE_STEPS * step + TIME_TOLERANCE_ULPS * fabs(expected);
    if (!(step > 0.0 && step <= DBL_MAX)) {
        message_write(c->message, sizeof c->message,
                      "communication step size %g s: must be positive and finite", step);
        return COMPONENT_ERROR;
    }
    if (!(fabs(time - expected) <= tolerance)) {
        message_write(c->message, sizeof c->message,
                      "communication point %g s: the last step ended at %g s, %g s off", time,
                      expected, fabs(time - expected));
        return COMPONENT_ERROR;
    }
    if (c->settings.stop_is_set && !(time + step <= c->settings.stop + tolerance)) {
        message_write(c->message, sizeof c->message,
                      "a step from %g s to %g s: goes %g s beyond the stop time", time, time + step,
                      time + step - c->settings.stop);
        return COMPONENT_ERROR;
    }
    return COMPONENT_OK;
}

/* A step that is not done has used the room where outputs that follow inputs are kept. */
static COMPONENT_RARELY void take_back_step(Component *c) {
    if (c->settings.follows_inputs)
        inputs_follow(c);
}

/* A step whose crank angle cannot be had: Discard at first, Error when it is tried again as it
 * was or after many others. */
static COMPONENT_RARELY ComponentStatus refuse_step(Component *c, double time, double step,
                                                    double phi, LinkageClosure closure,
                                                    double gap) {
    pose_explain_gap(c, closure, phi, gap);
    bool again = c->refusals > 0 && c->refused_time == time && c->refused_step == step
                 && c->refused_phi == phi;
    bool is_error = again || c->refusals >= MOST_DISCARDS - 1;
    if (is_error) {
        size_t length = strlen(c->message);
        message_write(c->message + length, sizeof c->message - length,
                      again ? "; the same step was discarded before"
                            : "; %u steps in a row were discarded before",
                      (unsigned)(MOST_DISCARDS - 1));
    }
    if (c->refusals < MOST_DISCARDS)
        c->refusals += 1;
    c->settings.mode = MODE_STEP_REFUSED;
    /* linkage_place left no pose: that of the last step is computed anew when it is read */
    c->fresh = EVALUATION_NONE;
    take_back_step(c);
    c->refused_time = time;
    c->refused_step = step;
    c->refused_phi = phi;
    return is_error ? COMPONENT_ERROR : COMPONENT_DISCARD;
}

static COMPONENT_RARELY void explain_news(Component *c, int noticed, double from, double to,
                                          double time) {
    if (noticed & CRANK_SPEED_IGNORED) {
        message_write(
            c->message, sizeof c->message,
            "crank.w = %g rad/s at %g s is not how crank.phi moves, from %g rad to %g rad: "
            "crank.w is ignored until they agree",
            c->value[VARIABLE_CRANK_W], time, from, to);
        return;
    }
    message_write(c->message, sizeof c->message,
                  noticed & CRANK_RESTARTED
                      ? "crank.phi jumps from %g rad to %g rad at %g s: its history restarts"
                      : "crank.phi goes from %g rad to %g rad at %g s: taken as continuing over "
                        "whole turns",
                  from, to, time);
}

ComponentStatus component_do_step(Component *c, double time, double step) {
    ComponentStatus status = component_check_step(c, time, step);
    if (status != COMPONENT_OK)
        return status;
    pose_prepare(c);

    const Motion *before = component_present(c);
    Motion *after = component_spare(c);
    CrankInput input = inputs_of_crank(c);
    /* the time since the last sample: samples belong to the starts of steps, or to their ends */
    double gap = input.at_step_end ? step : before->last_step;
    bool is_close = samples_are_close(gap, step) && input.smoothing == 0.0;
    bool times_change = gap > 0.0 && (is_close || sample_times_change(&c->settings.times, gap));
    SampleTimes changed = {.are_equal = 0};
    const SampleTimes *times = &c->settings.times;
    const Crank *crank = &before->crank;
    Crank without_close;
    if (times_change) {
        changed = c->settings.times;
        if (is_close) {
            without_close = *crank;
            crank_drop_samples(&without_close, &changed, gap, step);
            crank = &without_close;
        } else {
            sample_times_add(&changed, gap);
        }
        times = &changed;
    }
    after->last_step = step;
    int noticed = crank_advance(crank, times, &input, step, &after->crank);
    static const InputDerivatives none;
    const InputDerivatives *speed =
        c->settings.derivatives_are_set ? inputs_derivatives(c, VARIABLE_MACHINE_V) : &none;
    travel_advance(&before->travel, gap, c->value[VARIABLE_MACHINE_V], speed, input.at_step_end,
                   step, &after->travel);
    inputs_set_force(c, input.at_step_end ? 0.0 : step, after);

    double phi = after->crank.end.phi;
    if (!motion_is_bounded(after)
        || (c->settings.derivatives_are_set && !motion_has_bounded_force(after))) {
        message_write(c->message, sizeof c->message,
                      "a step of %g s ends at crank.phi = %g rad, crank.w = %g rad/s, crank.a = %g "
                      "rad/s2, machine.s = %g m, tip.fx = %g N, tip.fy = %g N: beyond all numbers",
                      step, phi, after->crank.end.w, after->crank.end.a, after->travel.end.s,
                      after->force[0][0], after->force[0][1]);
        take_back_step(c);
        return COMPONENT_ERROR;
    }
    double open_by;
    LinkageClosure closure = linkage_place(&c->linkage, phi, &c->pose, &open_by);
    if (closure != LINKAGE_CLOSED)
        return refuse_step(c, time, step, phi, closure, open_by);

    c->has_news = noticed != 0;
    if (noticed)
        explain_news(c, noticed, before->crank.phi, after->crank.phi, time);
    if (times_change)
        c->settings.times = changed;
    if (c->settings.derivatives_are_set) {
        memset(c->settings.input_derivatives, 0, sizeof c->settings.input_derivatives);
        c->settings.derivatives_are_set = 0;
    }
    c->present = 1 - c->present;
    c->shown = after;
    c->settings.follows_inputs = 0;
    c->value[VARIABLE_TIME] = time + step;
    c->settings.mode = MODE_STEP;
    c->fresh = EVALUATION_NONE;
    c->refusals = 0;
    return COMPONENT_OK;
}
