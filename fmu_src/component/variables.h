/* What value references stand for, and the messages that refuse wrong ones. References are any
 * number that a host may give. */
#ifndef VARIABLES_H
#define VARIABLES_H

#include "instance.h"

static inline bool variable_is_known(uint32_t reference) { return reference - 1 < INTERFACE_COUNT; }

static inline bool variable_is_boolean(uint32_t reference) {
    return variable_is_known(reference) && interface_evaluation[reference] == EVALUATION_NOT_REAL;
}

static inline bool variable_is_input(uint32_t reference) {
    return variable_is_known(reference) && interface_variables[reference].input >= 0;
}

static inline bool variable_is_output(uint32_t reference) {
    return variable_is_known(reference) && interface_variables[reference].is_output;
}

static inline bool variable_is_geometry(uint32_t reference) {
    return reference >= VARIABLE_GEOMETRY_L1 && reference <= VARIABLE_GEOMETRY_THETA9;
}

/* Of the masses, or gravity, which acts on nothing else. */
static inline bool variable_is_mass(uint32_t reference) {
    return reference >= VARIABLE_BODY_OA_M && reference <= VARIABLE_GRAVITY;
}

/* Whether a variable may have this value; only parameters have a range of their own. */
INTERNAL bool component_accepts(uint32_t reference, double value);

/* COMPONENT_ERROR, with a message: that it is unknown, or the demand that it does not meet; that it
 * may not have this value; that there is no derivative of this order. */
INTERNAL COMPONENT_RARELY ComponentStatus refuse_reference(Component *component, uint32_t reference,
                                                           const char *demand);
INTERNAL COMPONENT_RARELY ComponentStatus refuse_value(Component *component, uint32_t reference,
                                                       double value);
INTERNAL COMPONENT_RARELY ComponentStatus refuse_order(Component *component, uint32_t reference,
                                                       int32_t order);

/* Whether derivatives of this order exist, of inputs and of outputs. */
static inline bool has_order(int32_t order) { return order >= 1 && order <= MOTION_MAX_DERIVATIVE; }

#endif
