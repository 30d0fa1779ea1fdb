/* The data of one instance, and the words that all files of this folder share. The functions are
 * in the file of each subject; component.h lists what the adaptors use. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include "../linkage/mass.h"

#include "interface.h"
#include "motion.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum {
    COMPONENT_OK,
    COMPONENT_DISCARD, /* not for these values: try others */
    COMPONENT_ERROR,   /* not at all: the call is wrong */
} ComponentStatus;

/* FMI's interface types. In Model Exchange there are no steps: outputs follow the inputs, the host
 * gives the time and integrates the travel. */
typedef enum { KIND_CO_SIMULATION, KIND_MODEL_EXCHANGE } ComponentKind;

typedef enum {
    MODE_INSTANTIATED,
    MODE_INITIALIZATION,
    MODE_EVENT,
    MODE_CONTINUOUS_TIME,     /* of Model Exchange */
    MODE_STEP,                /* between communication steps */
    MODE_STEP_REFUSED,        /* the last step was discarded: as before it */
    MODE_UPDATE_AT_START,     /* the host is called back within a step */
    MODE_UPDATE_AT_END,
    MODE_TERMINATED,
    MODE_COUNT
} ComponentMode;

enum { COMPONENT_MESSAGE_SIZE = 320 };

/* What the host's calls have led to, besides values and motion. Plain data: 8-byte members only. */
typedef struct {
    int64_t derivatives_are_set; /* any of input_derivatives */
    int64_t stop_is_set;
    double stop;
    int64_t kind;
    int64_t mode;
    int64_t follows_inputs; /* after a step an input was set that belongs to its end: outputs
                             * follow the inputs until the next step, as they do before the first */
    SampleTimes times; /* of the crank's samples */
    InputDerivatives input_derivatives[INTERFACE_INPUT_COUNT]; /* for the next step */
} ComponentSettings;

typedef struct {
    /* By value reference: time, inputs and parameters as set (Booleans are 0 or 1), and what has
     * been computed of the rest. */
    double value[INTERFACE_COUNT + 1];
    ComponentSettings settings;
    /* The present, and room for the next step to be prepared in: a refused step leaves no trace,
     * a good one costs no copy. */
    Motion motion[2];
    /* What the outputs belong to: the present, or where they follow inputs that were set after a
     * step, the present with these in the place of what was predicted, in that room. */
    const Motion *shown;
    uint32_t present;
    uint32_t fresh; /* the EVALUATION_ bits of what holds in `value` */
    uint32_t linkage_is_ready;
    uint32_t refusals; /* of steps since one was done; see below */
    bool has_news; /* the last step was done, and message says something about it */

    /* derived from these, and made again when needed */
    LinkagePose pose;
    Linkage linkage;

    /* what few steps touch: with masses, after a refusal */
    LinkageMassJets mass_jets;
    LinkageInertia inertia;
    /* the step refused last: no part of the state, so that restoring cannot make a loop of it */
    double refused_time, refused_step, refused_phi;
    char message[COMPONENT_MESSAGE_SIZE];
} Component;

/* What the last step, or the start, led to; and the room beside it. */
static inline Motion *component_present(Component *component) {
    return &component->motion[component->present];
}
static inline Motion *component_spare(Component *component) {
    return &component->motion[1 - component->present];
}

/* Until the first step, outputs belong to the inputs as set. */
static inline bool component_has_stepped(Component *component) {
    return component_present(component)->last_step > 0.0;
}

#endif
