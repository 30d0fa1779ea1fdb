/* The pose that an instance's outputs belong to, and the masses in it: solved when they are needed,
 * and as far as they are. */
#ifndef POSE_H
#define POSE_H

#include "instance.h"

/* Makes geometry and masses ready where they were set anew. */
INTERNAL void pose_prepare(Component *component);

/* Makes sure that the pose is there, with derivatives up to `order`. COMPONENT_DISCARD, with a
 * message, where it cannot be reached. */
INTERNAL ComponentStatus pose_solve(Component *component, int order);

/* The mass jets of a pose that is there, up to `order` of the first moment (LinkageMassJets). */
static inline void pose_solve_masses(Component *c, int order) {
    linkage_differentiate_masses(&c->linkage, &c->inertia, &c->pose, order, &c->mass_jets);
}

/* The message that the pose at crank angle phi cannot be reached. */
INTERNAL void pose_explain_gap(Component *component, LinkageClosure closure, double phi,
                               double gap);

#endif
