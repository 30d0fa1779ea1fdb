#include "factors.h"

double *pose_factor_variation(const Component *c, LinkageVariation *variation, PoseFactor factor,
                              int n) {
    switch (factor) {
    case POSE_ONE: return NULL;
    case POSE_TIP_X: return &variation->tip[n].x;
    case POSE_TIP_Y: return &variation->tip[n].y;
    case POSE_TIP_ANGLE: return &variation->angle;
    case POSE_ASSEMBLY_MARGIN:
        return is_near_abd(c) ? &variation->transmission_abd : &variation->transmission_efg;
    case POSE_LINKAGE_MASS: return &variation->mass;
    case POSE_LINKAGE_INERTIA: return &variation->inertia[n];
    case POSE_LINKAGE_MOMENT_X: return &variation->moment[n].x;
    default: return &variation->moment[n].y;
    }
}

double motion_factor_change(const Component *c, MotionFactor factor, const double known[]) {
    switch (factor) {
    case MOTION_CRANK_W: return known[VARIABLE_CRANK_W];
    case MOTION_CRANK_W_SQUARED: return 2.0 * c->shown->crank.end.w * known[VARIABLE_CRANK_W];
    case MOTION_CRANK_A: return known[VARIABLE_CRANK_A];
    case MOTION_MACHINE_S: return known[VARIABLE_MACHINE_S];
    case MOTION_MACHINE_V: return known[VARIABLE_MACHINE_V];
    case MOTION_TIP_FX: return known[VARIABLE_TIP_FX];
    case MOTION_TIP_FY: return known[VARIABLE_TIP_FY];
    case MOTION_GRAVITY: return known[VARIABLE_GRAVITY];
    default: return 0.0; /* the machine's acceleration comes from samples before */
    }
}

double factors_gradient_by_phi(const Component *c, const LinkageVariation *weight, int order) {
    double sum = 0.0;
    /* what is not weighed may not be there */
    if (weight->angle != 0.0)
        sum += weight->angle * pose_factor(c, POSE_TIP_ANGLE, 1);
    double margin = is_near_abd(c) ? weight->transmission_abd : weight->transmission_efg;
    if (margin != 0.0)
        sum += margin * pose_factor(c, POSE_ASSEMBLY_MARGIN, 1);
    for (int n = 0; n <= order; ++n)
        sum += dot(weight->tip[n], c->pose.tip[n + 1]);
    for (int n = 0; n < c->pose.jets_order && n <= order; ++n)
        sum += dot(weight->moment[n], c->mass_jets.moment[n + 1]);
    for (int n = 0; n + 1 < c->pose.jets_order && n < order; ++n)
        sum += weight->inertia[n] * c->mass_jets.inertia[n + 1];
    return sum;
}

void factors_gradient_by_motion(const Component *c, const double weight[MOTION_FACTOR_COUNT],
                                double gradient[]) {
    gradient[VARIABLE_CRANK_W] =
        weight[MOTION_CRANK_W] + 2.0 * c->shown->crank.end.w * weight[MOTION_CRANK_W_SQUARED];
    gradient[VARIABLE_CRANK_A] = weight[MOTION_CRANK_A];
    gradient[VARIABLE_MACHINE_S] = weight[MOTION_MACHINE_S];
    gradient[VARIABLE_MACHINE_V] = weight[MOTION_MACHINE_V];
    gradient[VARIABLE_TIP_FX] = weight[MOTION_TIP_FX];
    gradient[VARIABLE_TIP_FY] = weight[MOTION_TIP_FY];
    gradient[VARIABLE_GRAVITY] = weight[MOTION_GRAVITY];
}
