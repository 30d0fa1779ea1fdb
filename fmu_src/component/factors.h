/* What the equations of interface.toml are made of: factors of the pose, which are functions of
 * crank angle and parameters, and factors of the motion, which are functions of time. To each its
 * value, its derivatives, and how it changes with what the host sets. */
#ifndef FACTORS_H
#define FACTORS_H

#include "../linkage/sensitivity.h"

#include "instance.h"

/* ---- of the pose --------------------------------------------------------------------------------
 */

typedef enum {
    POSE_ONE,
    POSE_TIP_X, /* m */
    POSE_TIP_Y,
    POSE_TIP_ANGLE,        /* of the nozzle, rad */
    POSE_ASSEMBLY_MARGIN,  /* the smaller |sine| of the transmission angles */
    POSE_LINKAGE_MASS,     /* of all bodies, kg; with those that follow, LinkageMassJets */
    POSE_LINKAGE_INERTIA,  /* reflected to the cranks, kg m2 */
    POSE_LINKAGE_MOMENT_X, /* first moment of mass, kg m */
    POSE_LINKAGE_MOMENT_Y
} PoseFactor;

/* The derivatives of the pose that the n-th derivative of each factor by phi needs; -1 where it
 * needs no pose. Macros, so that the compiler knows what outputs need. */
#define POSE_NEEDS_ONE(n) (-1)
#define POSE_NEEDS_TIP_X(n) (n)
#define POSE_NEEDS_TIP_Y(n) (n)
#define POSE_NEEDS_TIP_ANGLE(n) (n)
#define POSE_NEEDS_ASSEMBLY_MARGIN(n) ((n) > 0 ? (n) + 1 : 0)
#define POSE_NEEDS_LINKAGE_MASS(n) (-1)
#define POSE_NEEDS_LINKAGE_INERTIA(n) ((n) + 1)
#define POSE_NEEDS_LINKAGE_MOMENT_X(n) ((n) > 0 ? (n) : 1)
#define POSE_NEEDS_LINKAGE_MOMENT_Y(n) ((n) > 0 ? (n) : 1)

/* The order that a sweep over the linkage must have for the change of such a derivative; -1 where
 * nothing of it changes. */
#define POSE_SWEEP_ONE(n) (-1)
#define POSE_SWEEP_TIP_X(n) (n)
#define POSE_SWEEP_TIP_Y(n) (n)
#define POSE_SWEEP_TIP_ANGLE(n) 0
#define POSE_SWEEP_ASSEMBLY_MARGIN(n) 0
#define POSE_SWEEP_LINKAGE_MASS(n) 0
#define POSE_SWEEP_LINKAGE_INERTIA(n) ((n) + 1)
#define POSE_SWEEP_LINKAGE_MOMENT_X(n) (n)
#define POSE_SWEEP_LINKAGE_MOMENT_Y(n) (n)

/* Such a number as a bit of a set, so that what several need is found by or. */
#define POSE_BIT(needs) ((needs) < 0 ? 0 : 1 << ((needs) & 7))

/* Whether the dyad ABD is the one nearer to its dead point. */
static inline bool is_near_abd(const Component *c) {
    return linkage_transmission(&c->linkage.abd, &c->pose.abd, 0)
           <= linkage_transmission(&c->linkage.efg, &c->pose.efg, 0);
}

/* The n-th derivative of a factor by phi; the pose has what it needs. */
static inline double pose_factor(const Component *c, PoseFactor factor, int n) {
    switch (factor) {
    case POSE_ONE: return n == 0 ? 1.0 : 0.0;
    case POSE_TIP_X: return c->pose.tip[n].x;
    case POSE_TIP_Y: return c->pose.tip[n].y;
    case POSE_TIP_ANGLE:
        return n == 0 ? linkage_nozzle_angle(&c->linkage, &c->pose) : c->pose.efg.first_rate[n];
    case POSE_ASSEMBLY_MARGIN:
        return is_near_abd(c) ? linkage_transmission(&c->linkage.abd, &c->pose.abd, n)
                              : linkage_transmission(&c->linkage.efg, &c->pose.efg, n);
    case POSE_LINKAGE_MASS: return n == 0 ? c->inertia.total : 0.0;
    case POSE_LINKAGE_INERTIA: return c->mass_jets.inertia[n];
    case POSE_LINKAGE_MOMENT_X: return c->mass_jets.moment[n].x;
    default: return c->mass_jets.moment[n].y;
    }
}

/* Where a change, or a weight, of the n-th derivative of a factor by phi stands; NULL for the
 * factor 1, which does not change. */
INTERNAL double *pose_factor_variation(const Component *component, LinkageVariation *variation,
                                       PoseFactor factor, int n);

/* ---- of the motion ------------------------------------------------------------------------------
 */

typedef enum {
    MOTION_ONE,
    MOTION_CRANK_W, /* rad/s */
    MOTION_CRANK_W_SQUARED,
    MOTION_CRANK_A,   /* rad/s2 */
    MOTION_MACHINE_S, /* m, m/s, m/s2 */
    MOTION_MACHINE_V,
    MOTION_MACHINE_A,
    MOTION_TIP_FX, /* of the soil on the tip, N */
    MOTION_TIP_FY,
    MOTION_GRAVITY, /* m/s2 */
    MOTION_FACTOR_COUNT
} MotionFactor;

/* Of the crank, whose rates count together where changes are summed up. */
static inline bool motion_factor_is_of_crank(MotionFactor factor) {
    return factor <= MOTION_CRANK_A;
}

/* The n-th derivative of a factor by time, n = 0 to 2. */
static inline double motion_factor(const Component *c, MotionFactor factor, int n) {
    const CrankMotion *crank = &c->shown->crank.end;
    const MachineMotion *machine = &c->shown->travel.end;
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
    case MOTION_TIP_FX: return c->shown->force[n][0];
    case MOTION_TIP_FY: return c->shown->force[n][1];
    default: return n == 0 ? c->value[VARIABLE_GRAVITY] : 0.0;
    }
}

/* The first-order change of a factor under a change of what is known, by value reference. */
INTERNAL double motion_factor_change(const Component *component, MotionFactor factor,
                                     const double known[]);

/* ---- the transpose of both ---------------------------------------------------------------------
 */

/* The weight of phi from those of the factors of the pose, up to the order of the sweep: the sum
 * over all, each times its derivative by phi. */
INTERNAL double factors_gradient_by_phi(const Component *component, const LinkageVariation *weight,
                                        int order);

/* The weights of what is known, by value reference, from those of the factors of the motion. */
INTERNAL void factors_gradient_by_motion(const Component *component,
                                         const double weight[MOTION_FACTOR_COUNT],
                                         double gradient[]);

#endif
