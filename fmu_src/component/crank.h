/* The crank carried from the samples that a host gives to the end of its communication step.
 *
 * A host that sets inputs before a step from t to t + h gives their values at t, while the
 * outputs after the step belong to t + h (FMI 2.0.4, section 4.2.1). What the crank does in
 * between is taken from the best source that the host offers:
 *
 *   1. its input derivatives:  exactly the polynomial that they say;
 *   2. crank.w and crank.a:    Taylor's series; the slope of the last two crank.a gives one term
 *                              more; a missing crank.a comes from the parabola through the last
 *                              three crank.w; a missing crank.w, from the angles;
 *   3. the angle alone:        the cubic through the last four angles (fewer at the start).
 *
 * Angle error after a step of h: order 2 with one input derivative of the angle, 3 with two or with
 * one of the speed, 4 otherwise.
 *
 * With crank.smoothing, polynomials of the same degrees are fitted to the samples of that time
 * instead, and the angle (speed, acceleration) itself is the fitted one. */
#ifndef CRANK_H
#define CRANK_H

#include "fit.h"
#include "samples.h"

#ifndef INTERNAL /* see linkage.h */
#define INTERNAL
#endif

#include <stdbool.h>
#include <stdint.h>

/* What the crank does at one instant: its angle in rad and three derivatives by time. */
typedef struct {
    double phi, w, a, jerk;
} CrankMotion;

/* What the samples are of that continue the motion beyond what the host says itself: the angle;
 * the speed, from the moment that it is not 0; with it the acceleration, likewise. */
typedef enum { SOURCE_ANGLE, SOURCE_SPEED, SOURCE_ACCELERATION } CrankSource;

/* What speaks against crank.w: the angle moves otherwise. Both sums in rad, of steps in which the
 * two disagreed and of those after; 0 as long as they agree. Plain data: 8-byte members only. */
typedef struct {
    double missed;  /* by how much the angle moved beyond what the speeds say */
    double moved;   /* how far either of them moved */
    int64_t is_ignored; /* crank.w is not believed: how often the two must agree until it is */
} CrankDoubt;

/* All that the prediction remembers. Plain data: 8-byte members only. */
typedef struct {
    CrankMotion end;  /* the motion at the end of the last step */
    double phi, w;    /* the newest samples of angle and speed, as given */
    int64_t source;   /* CrankSource */
    int64_t is_told;  /* end comes from speeds or derivatives that the host gave */
    CrankDoubt doubt; /* whether crank.w is the speed of crank.phi */
    Samples samples;  /* of the source */
    Fit fit;          /* to these, with smoothing; else nothing */
} Crank;

/* The crank inputs of a step, as set. */
typedef struct {
    double phi, w, a;
    double smoothing; /* s, the time over which samples are smoothed; 0: none */
    bool at_step_end; /* they belong to the end of the step: nothing is predicted */
    bool has_derivatives; /* the host has set some of these */
    InputDerivatives phi_derivatives, w_derivatives, a_derivatives;
} CrankInput;

/* What crank_advance noticed, as flags. */
enum { CRANK_UNWRAPPED = 1, CRANK_RESTARTED = 2, CRANK_SPEED_IGNORED = 4 };

/* The motion that the inputs tell by themselves, before the first step. */
INTERNAL CrankMotion crank_motion_of(const CrankInput *input);

/* The first sample of a history: the inputs as they are at the start. */
INTERNAL void crank_start(Crank *crank, const CrankInput *input);

/* Takes the newest samples away that lie too close to one `gap` seconds later for a step of h: over
 * the short time between them a jump looks like a slope without bounds. *times: of the samples; on
 * return, with the new one's gap. */
INTERNAL void crank_drop_samples(Crank *crank, SampleTimes *times, double gap, double h);

/* Takes the sample of a step of h > 0 seconds and carries the crank from before to its end,
 * after->end. times->gap[0] is the time since the last sample, where there is one. Returns the
 * CRANK_ flags of what it noticed.
 * An angle that changed by more than half a turn, and is off what was expected by whole turns (a
 * host that gives it modulo one turn, say), is taken as continuing; where speeds or derivatives
 * tell what is expected, after smaller changes too. One that is off by more than a quarter of a
 * turn besides is a jump: the history restarts. A crank.w that does not fit how crank.phi moves is
 * ignored, until it does. */
INTERNAL int crank_advance(const Crank *before, const SampleTimes *times, const CrankInput *input,
                           double h, Crank *restrict after);

#endif
