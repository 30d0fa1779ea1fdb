/* What an instance remembers: saved, restored, and as bytes. */
#ifndef STATE_H
#define STATE_H

#include "instance.h"

/* All of it, without what can be computed anew: 8-byte members only, no pointers, no padding; its
 * bytes are the same in every process and on every little-endian platform. */
typedef struct {
    double set[INTERFACE_SETTABLE_COUNT]; /* the values of interface_settable, in its order */
    ComponentSettings settings;
    Motion motion;
} ComponentState;

INTERNAL void component_save(Component *component, ComponentState *state);
INTERNAL void component_restore(Component *component, const ComponentState *state);

/* The interface type of the instance that a state was saved of. */
static inline ComponentKind component_kind_of_state(const ComponentState *state) {
    return (ComponentKind)state->settings.kind;
}

/* A saved state as bytes with format version, interface token and checksum. */
INTERNAL size_t component_serialized_size(void);
INTERNAL void component_serialize(const ComponentState *state, uint8_t bytes[]);
/* Refuses, with a message, bytes of another size, version, interface or content. */
INTERNAL ComponentStatus component_deserialize(Component *component, const uint8_t bytes[],
                                               size_t size, ComponentState *state);

#endif
