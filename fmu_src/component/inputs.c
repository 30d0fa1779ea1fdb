#include "inputs.h"

#include "variables.h"

#include <math.h>
#include <string.h>

/* ---- the motion that the inputs tell --------------------------------------------------------- */

CrankInput inputs_of_crank(const Component *c) {
    CrankInput input;
    input.phi = c->value[VARIABLE_CRANK_PHI];
    input.w = c->value[VARIABLE_CRANK_W];
    input.a = c->value[VARIABLE_CRANK_A];
    input.at_step_end = c->value[VARIABLE_CRANK_AT_STEP_END] > 0.0;
    input.smoothing = c->value[VARIABLE_CRANK_SMOOTHING];
    input.has_derivatives = c->settings.derivatives_are_set != 0;
    if (input.has_derivatives) {
        input.phi_derivatives = *inputs_derivatives(c, VARIABLE_CRANK_PHI);
        input.w_derivatives = *inputs_derivatives(c, VARIABLE_CRANK_W);
        input.a_derivatives = *inputs_derivatives(c, VARIABLE_CRANK_A);
    }
    return input;
}

void inputs_set_force(const Component *c, double ahead, Motion *motion) {
    static const uint32_t references[2] = {VARIABLE_TIP_FX, VARIABLE_TIP_FY};
    double (*force)[2] = motion->force;
    if (!c->settings.derivatives_are_set) {
        memset(force, 0, sizeof motion->force);
        force[0][0] = c->value[VARIABLE_TIP_FX];
        force[0][1] = c->value[VARIABLE_TIP_FY];
        return;
    }
    for (int axis = 0; axis < 2; ++axis) {
        const InputDerivatives *derivatives = inputs_derivatives(c, references[axis]);
        int order = derivatives_order(derivatives);
        double first = order >= 1 ? derivatives->value[0] : 0.0;
        double second = order >= 2 ? derivatives->value[1] : 0.0;
        force[0][axis] = c->value[references[axis]] + ahead * (first + ahead * (0.5 * second));
        force[1][axis] = first + ahead * second;
        force[2][axis] = second;
    }
}

void inputs_start_histories(Motion *motion, const CrankInput *input) {
    travel_start(&motion->travel, motion->travel.end);
    motion->crank = (Crank){.end = motion->crank.end};
    if (input->at_step_end) {
        /* the first step brings the samples of its end, so these count */
        crank_start(&motion->crank, input);
        motion->travel.samples = 1;
    }
}

void inputs_follow(Component *c) {
    const double *real = c->value;
    Motion *motion = component_present(c);
    CrankInput input = inputs_of_crank(c);
    CrankMotion crank = crank_motion_of(&input);
    const InputDerivatives *speed = inputs_derivatives(c, VARIABLE_MACHINE_V);
    int order = derivatives_order(speed);
    MachineMotion machine = {real[VARIABLE_MACHINE_S], real[VARIABLE_MACHINE_V],
                             order >= 1 ? speed->value[0] : 0.0,
                             order >= 2 ? speed->value[1] : 0.0};
    if (component_has_stepped(c)) {
        const Crank *predicted = &motion->crank;
        if (predicted->source == SOURCE_ANGLE && (crank.w == 0.0 || predicted->doubt.is_ignored))
            crank.w = predicted->end.w;
        if (predicted->source != SOURCE_ACCELERATION && crank.a == 0.0) {
            crank.a = predicted->end.a;
            crank.jerk = predicted->end.jerk;
        }
        if (order == 0) {
            machine.a = motion->travel.end.a;
            machine.jerk = motion->travel.end.jerk;
        }
        machine.s = motion->travel.end.s;
        Motion *spare = component_spare(c);
        *spare = *motion;
        motion = spare;
        c->settings.follows_inputs = 1;
    }
    motion->crank.end = crank;
    motion->travel.end = machine;
    if (!component_has_stepped(c) && c->settings.mode == MODE_EVENT)
        inputs_start_histories(motion, &input);
    inputs_set_force(c, 0.0, motion);
    c->shown = motion;
    c->pose.order = -1;
    c->fresh = EVALUATION_NONE;
}

/* Whether inputs that are set now belong to the instant that the outputs belong to. */
static bool follows_inputs(Component *c) {
    return !component_has_stepped(c) || c->settings.follows_inputs || c->settings.mode == MODE_EVENT
           || c->settings.mode == MODE_UPDATE_AT_END;
}

/* ---- values ---------------------------------------------------------------------------------- */

/* The ACCESS_ bits of which a variable must have one to be set now. */
static uint32_t real_access_now(const Component *c) {
    if (c->settings.mode <= MODE_INITIALIZATION)
        return ACCESS_REAL_BEFORE_START;
    return c->settings.kind == KIND_MODEL_EXCHANGE ? ACCESS_REAL_LATER | ACCESS_STATE_LATER
                                                   : ACCESS_REAL_LATER;
}

static uint32_t boolean_access_now(const Component *c) {
    return c->settings.mode <= MODE_INITIALIZATION ? ACCESS_BOOLEAN_BEFORE_START
                                                   : ACCESS_BOOLEAN_LATER;
}

static COMPONENT_RARELY ComponentStatus refuse_setting(Component *c, uint32_t reference) {
    const char *demand = "can be set until the end of initialization only";
    if (interface_access[reference] == ACCESS_READ_ONLY)
        demand = "cannot be set";
    else if (interface_access[reference] & ACCESS_STATE_LATER)
        demand = "can be set until the end of initialization, and later in Model Exchange only";
    return refuse_reference(c, reference, demand);
}

static COMPONENT_RARELY ComponentStatus refuse_values(Component *c, const uint32_t reference[],
                                                      const double value[]) {
    for (;; ++reference, ++value) {
        if (!variable_is_known(*reference) || variable_is_boolean(*reference))
            return refuse_reference(c, *reference, "is a Boolean, not a real");
        if (!(interface_access[*reference] & real_access_now(c)))
            return refuse_setting(c, *reference);
        if (!component_accepts(*reference, *value))
            return refuse_value(c, *reference, *value);
    }
}

ComponentStatus component_set_real(Component *c, const uint32_t reference[], size_t count,
                                   const double value[]) {
    uint32_t access = real_access_now(c);
    for (size_t i = 0; i < count; ++i)
        if (!(reference[i] <= INTERFACE_COUNT && (interface_access[reference[i]] & access)
              && fabs(value[i]) <= INTERFACE_GREATEST_VALUE))
            return refuse_values(c, reference, value);
    if (access == ACCESS_REAL_BEFORE_START)
        for (size_t i = 0; i < count; ++i)
            if (!component_accepts(reference[i], value[i]))
                return refuse_values(c, reference, value);
    for (size_t i = 0; i < count; ++i)
        c->value[reference[i]] = value[i];
    if (follows_inputs(c)) {
        for (size_t i = 0; i < count; ++i)
            if (variable_is_geometry(reference[i])
                || variable_is_mass(reference[i])) /* before the end of initialization */
                c->linkage_is_ready = 0;
        inputs_follow(c);
    }
    return COMPONENT_OK;
}

ComponentStatus component_check_booleans(Component *c, const uint32_t reference[], size_t count,
                                         bool are_set) {
    for (size_t i = 0; i < count; ++i) {
        if (!variable_is_boolean(reference[i]))
            return refuse_reference(c, reference[i], "is a real, not a Boolean");
        if (are_set && !(interface_access[reference[i]] & boolean_access_now(c)))
            return refuse_setting(c, reference[i]);
    }
    return COMPONENT_OK;
}

ComponentStatus component_set_time(Component *c, double time) {
    if (!is_finite(time))
        return refuse_value(c, VARIABLE_TIME, time);
    /* Beyond the stop time as well, though FMI has "an error where the host computes past it" (FMI
     * 2.0.4, section 2.1.6; FMI 3.0.2, section 2.3.2): solvers that interpolate, CVODES in FMPy
     * and CasADi among them, step over the end and come back. To refuse would make them useless;
     * nothing here depends on the time, so to answer harms nobody. A step of Co-Simulation beyond
     * the stop time is an error. */
    c->value[VARIABLE_TIME] = time;
    return COMPONENT_OK;
}

ComponentStatus component_set_travel(Component *c, double travel) {
    if (!(fabs(travel) <= INTERFACE_GREATEST_VALUE))
        return refuse_value(c, VARIABLE_MACHINE_S, travel);
    c->value[VARIABLE_MACHINE_S] = travel;
    inputs_follow(c);
    return COMPONENT_OK;
}

ComponentStatus component_set_input_derivatives(Component *c, const uint32_t reference[],
                                                size_t count, const int32_t order[],
                                                const double value[]) {
    for (size_t i = 0; i < count; ++i) {
        if (!variable_is_input(reference[i]))
            return refuse_reference(c, reference[i], "is no input");
        if (!has_order(order[i]))
            return refuse_order(c, reference[i], order[i]);
        if (!(fabs(value[i]) <= INTERFACE_GREATEST_VALUE))
            return refuse_value(c, reference[i], value[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        InputDerivatives *input =
            &c->settings.input_derivatives[interface_variables[reference[i]].input];
        input->value[order[i] - 1] = value[i];
        input->is_set[order[i] - 1] = 1;
        c->settings.derivatives_are_set = 1;
    }
    if (follows_inputs(c))
        inputs_follow(c);
    return COMPONENT_OK;
}
