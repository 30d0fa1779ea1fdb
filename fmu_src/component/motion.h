/* What a communication step changes: where the crank and the machine are, how they move, and the
 * force on the tip. And the factors by which this enters the outputs (interface.toml). */
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
    Crank crank;      /* crank.end is the crank that the outputs belong to */
    Travel travel;    /* travel.end likewise */
    double force[MOTION_MAX_DERIVATIVE + 1][2]; /* N; x, y on the tip; derivatives by time */
} Motion;

/* What the pose is multiplied with in the equations. */
typedef enum {
    MOTION_ONE,
    MOTION_CRANK_W,         /* of the crank, rad/s */
    MOTION_CRANK_W_SQUARED,
    MOTION_CRANK_A,         /* of the crank, rad/s2 */
    MOTION_MACHINE_S,         /* of the machine: m, m/s, m/s2 */
    MOTION_MACHINE_V,
    MOTION_MACHINE_A,
    MOTION_TIP_FX,        /* of the soil on the tip, N */
    MOTION_TIP_FY,
    MOTION_FACTOR_COUNT
} MotionFactor;

/* Of the crank, whose rates count together where changes are summed up. */
static inline bool motion_is_of_crank(MotionFactor factor) { return factor <= MOTION_CRANK_A; }

/* The n-th derivative of a factor by time, n = 0 to 2. */
static inline double motion_factor(const Motion *motion, MotionFactor factor, int n) {
    const CrankMotion *crank = &motion->crank.end;
    const MachineMotion *machine = &motion->travel.end;
    switch (factor) {
    case MOTION_ONE: return n == 0 ? 1.0 : 0.0;
    case MOTION_CRANK_W: return n == 0 ? crank->w : n == 1 ? crank->a : crank->jerk;
    case MOTION_CRANK_W_SQUARED:
        return n == 0   ? crank->w * crank->w
               : n == 1 ? 2.0 * crank->w * crank->a
                        : 2.0 * (crank->a * crank->a + crank->w * crank->jerk);
    case MOTION_CRANK_A: return n == 0 ? crank->a : n == 1 ? crank->jerk : 0.0;
    case MOTION_MACHINE_S: return n == 0 ? machine->s : n == 1 ? machine->v : machine->a;
    case MOTION_MACHINE_V: return n == 0 ? machine->v : n == 1 ? machine->a : machine->jerk;
    case MOTION_MACHINE_A: return n == 0 ? machine->a : n == 1 ? machine->jerk : 0.0;
    case MOTION_TIP_FX: return motion->force[n][0];
    default: return motion->force[n][1];
    }
}

/* The first-order change of a factor under a change of the inputs and of machine.s, by value
 * reference. */
INTERNAL double motion_change(const Motion *motion, MotionFactor factor, const double known[]);

/* The transpose: weights of all factors into those of inputs and machine.s, by value reference. */
INTERNAL void motion_gradient(const Motion *motion, const double weight[MOTION_FACTOR_COUNT],
                              double gradient[]);

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
