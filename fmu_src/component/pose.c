#include "pose.h"

#include "message.h"

#include <math.h>
#include <string.h>

void pose_prepare(Component *c) {
    if (c->linkage_is_ready)
        return;
    LinkageGeometry geometry;
    /* interface.c checks that both lie alike */
    memcpy(&geometry, &c->value[VARIABLE_GEOMETRY_L1], sizeof geometry);
    linkage_prepare(&geometry, &c->linkage);
    c->linkage_is_ready = 1;
    c->pose.order = -1;
}

void pose_explain_gap(Component *c, LinkageClosure closure, double phi, double gap) {
    bool is_abd = closure == LINKAGE_ABD_OPEN;
    const char *base = is_abd ? "AD" : "EG";
    if (gap == 0.0)
        message_write(c->message, sizeof c->message,
                      "the linkage is at a dead point, where velocities are infinite: dyad %s at "
                      "crank.phi = %g rad",
                      is_abd ? "ABD" : "EFG", phi);
    else
        message_write(c->message, sizeof c->message,
                      "the linkage cannot be closed: dyad %s at crank.phi = %g rad, where distance "
                      "%s is %G mm too %s for the two links",
                      is_abd ? "ABD" : "EFG", phi, base, 1000.0 * fabs(gap),
                      gap > 0.0 ? "long" : "short");
}

ComponentStatus pose_solve(Component *c, int order) {
    pose_prepare(c);
    if (c->pose.order < 0) {
        double phi = c->shown->crank.end.phi, gap;
        LinkageClosure closure = linkage_place(&c->linkage, phi, &c->pose, &gap);
        if (closure != LINKAGE_CLOSED) {
            pose_explain_gap(c, closure, phi, gap);
            return COMPONENT_DISCARD;
        }
    }
    linkage_differentiate(&c->linkage, &c->pose, order);
    return COMPONENT_OK;
}

int pose_needs(PoseFactor factor, int n) {
    switch (factor) {
    case POSE_ONE: return POSE_NEEDS_ONE(n);
    case POSE_TIP_X: return POSE_NEEDS_TIP_X(n);
    case POSE_TIP_Y: return POSE_NEEDS_TIP_Y(n);
    case POSE_TIP_ANGLE: return POSE_NEEDS_TIP_ANGLE(n);
    default: return POSE_NEEDS_ASSEMBLY_MARGIN(n);
    }
}

double *pose_variation(const Component *c, LinkageVariation *variation, PoseFactor factor, int n) {
    switch (factor) {
    case POSE_ONE: return NULL;
    case POSE_TIP_X: return &variation->tip[n].x;
    case POSE_TIP_Y: return &variation->tip[n].y;
    case POSE_TIP_ANGLE: return &variation->angle;
    default:
        return pose_is_near_abd(c) ? &variation->transmission_abd : &variation->transmission_efg;
    }
}

double pose_gradient_by_phi(const Component *c, const LinkageVariation *weight, int order) {
    double sum = 0.0;
    /* what is not weighed may not be there */
    if (weight->angle != 0.0)
        sum += weight->angle * pose_factor(c, POSE_TIP_ANGLE, 1);
    double margin = pose_is_near_abd(c) ? weight->transmission_abd : weight->transmission_efg;
    if (margin != 0.0)
        sum += margin * pose_factor(c, POSE_ASSEMBLY_MARGIN, 1);
    for (int n = 0; n <= order; ++n)
        sum += dot(weight->tip[n], c->pose.tip[n + 1]);
    return sum;
}
