/* The communication step: the crank and the machine are carried to its end. */
#ifndef STEP_H
#define STEP_H

#include "instance.h"

/* A communication step from `time` over `step` > 0 seconds. `time` must be the end of the last
 * step to rounding. A step that ends in an unreachable pose is COMPONENT_DISCARD; the same step
 * with the same inputs tried once more is COMPONENT_ERROR, and so is the 1000th refused step in a
 * row, lest a host try for ever.
 * component->has_news tells of a jump or wrap of the crank's angle. */
INTERNAL ComponentStatus component_do_step(Component *component, double time, double step);

/* Whether a step may be done at all; component_do_step asks this itself. */
INTERNAL ComponentStatus component_check_step(Component *component, double time, double step);

#endif
