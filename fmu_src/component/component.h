/* One instance of the transplanter linkage, as every version of FMI sees it: variables by value
 * reference, modes, communication steps, outputs computed when they are first read, state as
 * plain data. It knows nothing of FMI; the adaptors in ../fmi translate, and include this file
 * alone. Each subject is a file:
 *
 *   inputs.h        what the host sets              step.h         the communication step
 *   outputs.h       what it reads                   state.h        save, restore, serialize
 *   derivatives.h   derivatives of what it reads    variables.h    what references stand for
 *
 * and this one: start values and modes.
 *
 * Every function that can refuse returns a status, changes nothing when it is not COMPONENT_OK,
 * and leaves the reason in component->message, in words for the user of a host. References and
 * array arguments must not be NULL where a count is not 0; the adaptors check. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include "derivatives.h"
#include "inputs.h"
#include "instance.h"
#include "outputs.h"
#include "state.h"
#include "step.h"
#include "variables.h"

/* Start values, mode instantiated: for a new instance and for one that starts again. */
INTERNAL void component_reset(Component *component, ComponentKind kind);

/* start: the time of the first communication step in s. */
INTERNAL ComponentStatus component_set_experiment(Component *component, double start,
                                                  bool stop_is_set, double stop);

/* Checks geometry and initial pose; `next` is the mode that follows. */
INTERNAL ComponentStatus component_exit_initialization(Component *component, ComponentMode next);

/* The other changes of mode, which change nothing else. */
static inline void component_enter_mode(Component *component, ComponentMode mode) {
    component->settings.mode = mode;
}

/* What the adaptors ask of an instance: which calls are legal is theirs to say. */
static inline ComponentMode component_mode(const Component *component) {
    return (ComponentMode)component->settings.mode;
}
static inline ComponentKind component_kind(const Component *component) {
    return (ComponentKind)component->settings.kind;
}
/* s: where the next step begins. */
static inline double component_time(const Component *component) {
    return component->value[VARIABLE_TIME];
}

#endif
