/* One instance of the transplanter linkage, as every version of FMI sees it: variables by value
 * reference, modes, communication steps, outputs computed when they are first read, state as
 * plain data. It knows nothing of FMI; the adaptors in ../fmi translate.
 *
 * Every function that can refuse returns a status, changes nothing when it is not COMPONENT_OK,
 * and leaves the reason in component->message, in words for the user of a host. References and
 * array arguments must not be NULL where a count is not 0; the adaptors check. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include "../linkage/linkage.h"

#include "crank.h"
#include "interface.h"
#include "travel.h"

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

enum { COMPONENT_MESSAGE_SIZE = 320, COMPONENT_MAX_DERIVATIVE = 2 };

/* What one communication step changes, besides the spacing of the samples. */
typedef struct {
    double last_step; /* s; 0 before the first step */
    Crank crank;      /* crank.end is the crank that the outputs belong to */
    Travel travel;    /* travel.end likewise */
    double force[COMPONENT_MAX_DERIVATIVE + 1][2]; /* x, y on the tip; derivatives by time */
} ComponentProgress;

/* What the host has set and reads, and what seldom changes. */
typedef struct {
    double real[INTERFACE_COUNT + 1]; /* by value reference; Booleans are 0 or 1; outputs are 0
                                       * when saved */
    InputDerivatives input_derivatives[INTERFACE_INPUT_COUNT]; /* for the next step */
    int64_t derivatives_are_set;
    int64_t stop_is_set;
    double stop;
    int64_t kind;
    int64_t mode;
    int64_t follows_inputs; /* after a step an input was set that belongs to its end: outputs
                             * follow the inputs until the next step, as they do before the first */
    SampleTimes times; /* of the crank's samples */
} ComponentSettings;

/* All that an instance remembers: 8-byte members only, no pointers, no padding; its bytes are
 * the same in every process and on every little-endian platform. */
typedef struct {
    ComponentSettings settings;
    ComponentProgress progress;
} ComponentState;

typedef struct {
    ComponentSettings settings;
    /* The present, and room for the next step to be prepared in: a refused step leaves no trace,
     * a good one costs no copy. */
    ComponentProgress progress[2];
    uint32_t present;
    /* What the outputs belong to: the present, or where they follow inputs that were set after a
     * step, the present with these in the place of what was predicted. */
    const ComponentProgress *shown;
    ComponentProgress followed;

    /* derived from these, and made again when needed */
    Linkage linkage;
    LinkagePose pose;
    uint32_t linkage_is_ready;
    uint32_t fresh; /* the EVALUATION_ bits of the outputs whose values in settings.real hold */
    /* the step refused last, and how many since one was done: no part of the state, so that
     * restoring cannot make a loop of them */
    double refused_time, refused_step, refused_phi;
    uint32_t refusals;
    bool has_news; /* the last step was done, and message says something about it */
    char message[COMPONENT_MESSAGE_SIZE];
} Component;

/* What the last step, or the start, led to. */
static inline ComponentProgress *component_present(Component *component) {
    return &component->progress[component->present];
}

/* Start values, mode instantiated: for a new instance and for one that starts again. */
INTERNAL void component_reset(Component *component, ComponentKind kind);

/* start: the time of the first communication step in s. */
INTERNAL ComponentStatus component_set_experiment(Component *component, double start,
                                                  bool stop_is_set, double stop);
/* Checks geometry and initial pose; `next` is the mode that follows. The other changes of mode
 * change nothing else: the adaptors write settings.mode. */
INTERNAL ComponentStatus component_exit_initialization(Component *component, ComponentMode next);

/* Whether a variable may have this value; only parameters have a range of their own. */
INTERNAL bool component_accepts(uint32_t reference, double value);
/* Values by reference: `count` of them, all or none. Reals are finite and within the ranges of
 * interface.toml, so that no output can overflow. Reading an output of a pose that cannot be
 * reached is COMPONENT_DISCARD. */
INTERNAL ComponentStatus component_get_real(Component *component, const uint32_t reference[],
                                            size_t count, double value[]);
INTERNAL ComponentStatus component_set_real(Component *component, const uint32_t reference[],
                                            size_t count, const double value[]);
/* Booleans one by one, after all of a call have been checked: every version of FMI has its own C
 * type for them. */
INTERNAL ComponentStatus component_check_booleans(Component *component, const uint32_t reference[],
                                                  size_t count, bool are_set);
static inline bool component_get_boolean(const Component *component, uint32_t reference) {
    return component->settings.real[reference] != 0.0;
}
static inline void component_set_boolean(Component *component, uint32_t reference, bool value) {
    component->settings.real[reference] = value;
}

/* Model Exchange: the host's time in s, and machine.s in m. */
INTERNAL ComponentStatus component_set_time(Component *component, double time);
INTERNAL ComponentStatus component_set_travel(Component *component, double travel);

/* Time derivatives of inputs at the start of the next step, orders 1 and 2; they are used up by
 * that step. */
INTERNAL ComponentStatus component_set_input_derivatives(Component *component,
                                                         const uint32_t reference[], size_t count,
                                                         const int32_t order[],
                                                         const double value[]);
/* Time derivatives of outputs, orders 1 and 2, at the instant that the outputs belong to. */
INTERNAL ComponentStatus component_get_output_derivatives(Component *component,
                                                          const uint32_t reference[], size_t count,
                                                          const int32_t order[], double value[]);
/* sensitivity[i] = sum over k of d unknown[i] / d known[k] times seed[k], at the instant that
 * the outputs belong to. Unknowns: outputs and der(machine.s). Knowns: inputs, machine.s, time and,
 * in initialization mode, the parameters of the geometry. */
INTERNAL ComponentStatus component_get_directional_derivative(
    Component *component, const uint32_t unknown[], size_t unknown_count, const uint32_t known[],
    size_t known_count, const double seed[], double sensitivity[]);
/* The other way about: sensitivity[k] = sum over i of seed[i] times d unknown[i] / d known[k]. */
INTERNAL ComponentStatus component_get_adjoint_derivative(
    Component *component, const uint32_t unknown[], size_t unknown_count, const uint32_t known[],
    size_t known_count, const double seed[], double sensitivity[]);

/* A communication step from `time` over `step` > 0 seconds. `time` must be the end of the last
 * step to rounding. A step that ends in an unreachable pose is COMPONENT_DISCARD; the same step
 * with the same inputs tried once more is COMPONENT_ERROR, and so is the 1000th refused step in a
 * row, lest a host try for ever.
 * component->has_news tells of a jump or wrap of the crank's angle. */
INTERNAL ComponentStatus component_do_step(Component *component, double time, double step);
/* Whether a step may be done at all; component_do_step asks this itself. */
INTERNAL ComponentStatus component_check_step(Component *component, double time, double step);

/* Whether every output of this motion, and its derivatives, are numbers. */
INTERNAL bool component_is_bounded(const ComponentProgress *progress);

/* The whole state, without the values that can be computed anew; to be kept or compared. */
INTERNAL void component_save(Component *component, ComponentState *state);
INTERNAL void component_restore(Component *component, const ComponentState *state);

/* A saved state as bytes with format version, interface token and checksum. */
INTERNAL size_t component_serialized_size(void);
INTERNAL void component_serialize(const ComponentState *state, uint8_t bytes[]);
/* Refuses, with a message, bytes of another size, version, interface or content. */
INTERNAL ComponentStatus component_deserialize(Component *component, const uint8_t bytes[],
                                               size_t size, ComponentState *state);

#endif
