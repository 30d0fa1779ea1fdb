#include "motion.h"

#include <math.h>

static const double GREATEST_FORCE = 1e120;

bool motion_has_bounded_force(const Motion *motion) {
    double sum = 0.0;
    for (int order = 0; order <= MOTION_MAX_DERIVATIVE; ++order)
        sum += fabs(motion->force[order][0]) + fabs(motion->force[order][1]);
    return sum <= GREATEST_FORCE;
}

double motion_change(const Motion *motion, MotionFactor factor, const double known[]) {
    switch (factor) {
    case MOTION_CRANK_W: return known[VARIABLE_CRANK_W];
    case MOTION_CRANK_W_SQUARED: return 2.0 * motion->crank.end.w * known[VARIABLE_CRANK_W];
    case MOTION_CRANK_A: return known[VARIABLE_CRANK_A];
    case MOTION_MACHINE_S: return known[VARIABLE_MACHINE_S];
    case MOTION_MACHINE_V: return known[VARIABLE_MACHINE_V];
    case MOTION_TIP_FX: return known[VARIABLE_TIP_FX];
    case MOTION_TIP_FY: return known[VARIABLE_TIP_FY];
    default: return 0.0; /* the machine's acceleration comes from samples before */
    }
}

void motion_gradient(const Motion *motion, const double weight[MOTION_FACTOR_COUNT],
                     double gradient[]) {
    gradient[VARIABLE_CRANK_W] =
        weight[MOTION_CRANK_W] + 2.0 * motion->crank.end.w * weight[MOTION_CRANK_W_SQUARED];
    gradient[VARIABLE_CRANK_A] = weight[MOTION_CRANK_A];
    gradient[VARIABLE_MACHINE_S] = weight[MOTION_MACHINE_S];
    gradient[VARIABLE_MACHINE_V] = weight[MOTION_MACHINE_V];
    gradient[VARIABLE_TIP_FX] = weight[MOTION_TIP_FX];
    gradient[VARIABLE_TIP_FY] = weight[MOTION_TIP_FY];
}
