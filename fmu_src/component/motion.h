/* What a communication step changes: where the crank and the machine are, how they move, and the
 * force on the tip. */
#ifndef MOTION_H
#define MOTION_H

#include "crank.h"
#include "interface.h"
#include "travel.h"

/* The highest derivatives by time that hosts give of inputs and ask for of outputs. */
enum { MOTION_MAX_DERIVATIVE = 2 };

/* At one instant. Plain data: 8-byte members only. */
typedef struct {
    double last_step; /* s, of the step that led here; 0 before the first one */
    double force[MOTION_MAX_DERIVATIVE + 1][2]; /* N; x, y on the tip; derivatives by time */
    Travel travel; /* travel.end is the machine's motion that the outputs belong to */
    Crank crank;   /* crank.end likewise; last, since its own end is for smoothing alone */
} Motion;

/* The crank's jerk, and a force, may be larger by many orders than what they are multiplied with.
 */
static const double MOTION_JERK_SCALE = 1e180; /* leaves 1e128 */

/* Whether every output of this motion, and its derivatives, are numbers: a step must end so.
 * Inlined, so that each step pays three comparisons: a sum is not finite where one of its terms is
 * not. */
static inline bool motion_is_bounded(const Motion *motion) {
    CrankMotion crank = motion->crank.end;
    MachineMotion machine = motion->travel.end;
    return fabs(crank.w) <= INTERFACE_GREATEST_VALUE && fabs(crank.a) <= INTERFACE_GREATEST_VALUE
           && is_finite((crank.phi + machine.s) + (machine.v + MOTION_JERK_SCALE * crank.jerk));
}

/* The same of the force, which is as set where the host has given no derivatives of it. */
INTERNAL bool motion_has_bounded_force(const Motion *motion);

#endif
