/* The pose that an instance's outputs belong to, solved when it is needed and as far as it is, and
 * the factors by which it enters the outputs (interface.toml). */
#ifndef POSE_H
#define POSE_H

#include "../linkage/sensitivity.h"

#include "instance.h"

/* What the motion is multiplied with in the equations: functions of crank angle and geometry. */
typedef enum {
    POSE_ONE,
    POSE_TIP_X, /* m */
    POSE_TIP_Y,
    POSE_TIP_ANGLE, /* of the nozzle, rad */
    POSE_ASSEMBLY_MARGIN /* the smaller |sine| of the transmission angles */
} PoseFactor;

/* The derivatives of the pose that the n-th derivative of each factor by phi needs; none for the
 * factor 1, which needs no pose. Macros, so that the compiler knows what groups of outputs need. */
enum { POSE_NEEDS_NONE = -1 };
#define POSE_NEEDS_ONE(n) POSE_NEEDS_NONE
#define POSE_NEEDS_TIP_X(n) (n)
#define POSE_NEEDS_TIP_Y(n) (n)
#define POSE_NEEDS_TIP_ANGLE(n) (n)
#define POSE_NEEDS_ASSEMBLY_MARGIN(n) ((n) > 0 ? (n) + 1 : 0)

/* The same where the factor is known at run time only. */
INTERNAL int pose_needs(PoseFactor factor, int n);

/* Makes the geometry ready where it was set anew. */
INTERNAL void pose_prepare(Component *component);

/* Makes sure that the pose is there, with derivatives up to `order`. COMPONENT_DISCARD, with a
 * message, where it cannot be reached. */
INTERNAL ComponentStatus pose_solve(Component *component, int order);

/* The message that the pose at crank angle phi cannot be reached. */
INTERNAL void pose_explain_gap(Component *component, LinkageClosure closure, double phi,
                               double gap);

/* Whether the dyad ABD is the one nearer to its dead point. */
static inline bool pose_is_near_abd(const Component *c) {
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
    default:
        return pose_is_near_abd(c) ? linkage_transmission(&c->linkage.abd, &c->pose.abd, n)
                                   : linkage_transmission(&c->linkage.efg, &c->pose.efg, n);
    }
}

/* Where a change, or a weight, of the n-th derivative of a factor by phi stands; NULL for the
 * factor 1, which does not change. */
INTERNAL double *pose_variation(const Component *component, LinkageVariation *variation,
                                PoseFactor factor, int n);

/* The weight of phi from those of the factors, tip[0] to tip[order] among them: the sum over all,
 * each times its derivative by phi. */
INTERNAL double pose_gradient_by_phi(const Component *component, const LinkageVariation *weight,
                                     int order);

#endif
