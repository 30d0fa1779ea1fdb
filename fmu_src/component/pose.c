#include "pose.h"

#include "message.h"

#include <math.h>
#include <string.h>

void pose_prepare(Component *c) {
    if (c->linkage_is_ready)
        return;
    LinkageGeometry geometry;
    LinkageMasses masses;
    /* interface.c checks that they lie alike */
    memcpy(&geometry, &c->value[VARIABLE_GEOMETRY_L1], sizeof geometry);
    memcpy(&masses, &c->value[VARIABLE_BODY_OA_M], sizeof masses);
    linkage_prepare(&geometry, &c->linkage);
    linkage_prepare_masses(&c->linkage, &masses, &c->inertia);
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
