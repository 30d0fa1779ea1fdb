/* What the host sets: values and derivatives of inputs, start values and parameters; and the motion
 * that the inputs tell by themselves, where no step carries it on. */
#ifndef INPUTS_H
#define INPUTS_H

#include "instance.h"

/* Values by reference: `count` of them, all or none. Reals are finite and within the ranges of
 * interface.toml, so that no output can overflow. */
INTERNAL ComponentStatus component_set_real(Component *component, const uint32_t reference[],
                                            size_t count, const double value[]);

/* Booleans one by one, after all of a call have been checked: every version of FMI has its own C
 * type for them. */
INTERNAL ComponentStatus component_check_booleans(Component *component, const uint32_t reference[],
                                                  size_t count, bool are_set);
static inline bool component_get_boolean(const Component *component, uint32_t reference) {
    return component->value[reference] != 0.0;
}
static inline void component_set_boolean(Component *component, uint32_t reference, bool value) {
    component->value[reference] = value;
}

/* Time derivatives of inputs at the start of the next step, orders 1 and 2; they are used up by
 * that step. */
INTERNAL ComponentStatus component_set_input_derivatives(Component *component,
                                                         const uint32_t reference[], size_t count,
                                                         const int32_t order[],
                                                         const double value[]);

/* Model Exchange: the host's time in s, and machine.s in m. */
INTERNAL ComponentStatus component_set_time(Component *component, double time);
INTERNAL ComponentStatus component_set_travel(Component *component, double travel);

/* ---- for the other files of this folder -------------------------------------------------------
 */

/* The inputs of the crank, and the derivatives that the host has set of an input. */
INTERNAL CrankInput inputs_of_crank(const Component *component);
static inline const InputDerivatives *inputs_derivatives(const Component *component,
                                                         uint32_t reference) {
    return &component->settings.input_derivatives[interface_variables[reference].input];
}

/* The force on the tip, and its derivatives, `ahead` seconds after the inputs' instant. */
INTERNAL void inputs_set_force(const Component *component, double ahead, Motion *motion);

/* Makes the outputs follow the inputs: before the first step and in Model Exchange, as they are.
 * After a step, the rates that the host does not give stay as predicted, and so does the travel,
 * which is a state. */
INTERNAL void inputs_follow(Component *component);

/* The histories of crank and travel begin: the first samples come with the first step or, where
 * inputs belong to the ends of steps, are the inputs as they are. */
INTERNAL void inputs_start_histories(Motion *motion, const CrankInput *input);

#endif
