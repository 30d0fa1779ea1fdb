#include "component.h"

#include "message.h"
#include "pose.h"

#include <string.h>

void component_reset(Component *c, ComponentKind kind) {
    memset(c, 0, sizeof *c);
    for (uint32_t i = 1; i <= INTERFACE_COUNT; ++i)
        c->value[i] = interface_variables[i].start;
    c->settings.kind = kind;
    c->settings.mode = MODE_INSTANTIATED;
    inputs_follow(c);
}

ComponentStatus component_set_experiment(Component *c, double start, bool stop_is_set,
                                         double stop) {
    if (!is_finite(start) || (stop_is_set && !(stop >= start && is_finite(stop)))) {
        message_write(c->message, sizeof c->message,
                      "start time %g s, stop time %g s: must be finite and in this order", start,
                      stop);
        return COMPONENT_ERROR;
    }
    c->value[VARIABLE_TIME] = start;
    c->settings.stop_is_set = stop_is_set;
    c->settings.stop = stop_is_set ? stop : 0.0;
    return COMPONENT_OK;
}

/* Whether each body's moment of inertia can be: without a mass, a body has none. One that turns
 * about a fixed pivot may stand for a wheel whose weight is borne by the machine. */
static ComponentStatus check_masses(Component *c) {
    static const uint32_t masses[] = {VARIABLE_BODY_AB_M, VARIABLE_BODY_DE_M, VARIABLE_BODY_EF_M};
    for (size_t i = 0; i < sizeof masses / sizeof masses[0]; ++i) {
        uint32_t mass = masses[i], inertia = masses[i] + 3;
        if (c->value[mass] == 0.0 && c->value[inertia] > 0.0) {
            message_write(c->message, sizeof c->message,
                          "%s = %g kg.m2, but %s = 0: a body that is carried has no moment of "
                          "inertia without mass",
                          interface_variables[inertia].name, c->value[inertia],
                          interface_variables[mass].name);
            return COMPONENT_ERROR;
        }
    }
    return COMPONENT_OK;
}

ComponentStatus component_exit_initialization(Component *c, ComponentMode next) {
    if (pose_solve(c, 0) != COMPONENT_OK || check_masses(c) != COMPONENT_OK)
        return COMPONENT_ERROR;
    CrankInput input = inputs_of_crank(c);
    inputs_start_histories(component_present(c), &input);
    c->settings.mode = next;
    return COMPONENT_OK;
}
