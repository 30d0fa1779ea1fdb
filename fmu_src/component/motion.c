#include "motion.h"

#include <math.h>

static const double GREATEST_FORCE = 1e120;

bool motion_has_bounded_force(const Motion *motion) {
    double sum = 0.0;
    for (int order = 0; order <= MOTION_MAX_DERIVATIVE; ++order)
        sum += fabs(motion->force[order][0]) + fabs(motion->force[order][1]);
    return sum <= GREATEST_FORCE;
}
