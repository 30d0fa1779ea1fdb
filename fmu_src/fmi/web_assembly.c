/* FMI 3.0 as a WebAssembly component's core module (FMI-LS-WASM, working draft): each function of
 * the draft's interfaces, its arguments and results laid out as the Component Model's Canonical ABI
 * has them, calls the one of FMI 3.0 that it stands for. Compiled for 32-bit addresses alone;
 * exporter/fmi_ls_wasm.py makes the component around it and checks nothing of this file but the
 * functions' types.
 *
 * Canonical ABI: a string or list is two arguments, address and count; an option two, flag and
 * value. A result that is no status is an address: of a flag (1: an error, or something in an
 * option), and behind it, aligned, the value or the status. C aligns a struct's members likewise,
 * and the draft's enumerations count as FMI's do. */
#include "fmi3Functions.h"

#include <stdlib.h>
#include <string.h>

/* Called from outside alone, and not to be static for that: no header declares them. */
#pragma clang diagnostic ignored "-Wmissing-prototypes"
#define EXPORT(name) __attribute__((export_name(name)))
/* NOLINTBEGIN(misc-use-internal-linkage) */

/* ---- memory -----------------------------------------------------------------------------------
 * What the host passes and what it is answered lives until it has read the answer. */

typedef struct Block {
    struct Block *next;
    uint64_t aligns_what_follows;
} Block;

static Block *passed; /* all that was allocated since the last call ended */

static void *pass(size_t count, size_t size) {
    Block *block =
        count <= (SIZE_MAX - sizeof *block) / size ? malloc(sizeof *block + count * size) : NULL;
    if (block == NULL)
        __builtin_trap(); /* as the Canonical ABI wants it */
    block->next = passed;
    passed = block;
    return block + 1;
}

/* By which the host allocates what it passes. */
EXPORT("cabi_realloc")
void *reallocate(const void *old, size_t old_size, size_t alignment, size_t size) {
    (void)alignment; /* at most 8 */
    void *new = pass(size, 1);
    return old_size == 0 ? new : memcpy(new, old, old_size < size ? old_size : size);
}

/* After each call, when the host has read what it was answered. */
EXPORT("release")
void release(uint32_t answer) {
    (void)answer;
    for (Block *block = passed; block != NULL; block = passed) {
        passed = block->next;
        free(block);
    }
}

/* ---- strings, lists and results ----------------------------------------------------------------
 */

typedef struct {
    const char *bytes;
    size_t size;
} String;

/* NULL, which FMI's functions refuse, where a string of C ends before its end. */
static const char *text(String string) {
    if (memchr(string.bytes, '\0', string.size) != NULL)
        return NULL;
    char *copy = memcpy(pass(string.size + 1, 1), string.bytes, string.size);
    copy[string.size] = '\0';
    return copy;
}

static String string_of(const char *of) { return (String){of, strlen(of)}; }

typedef struct {
    uint8_t is_error;
    union {
        struct {
            const void *items;
            size_t count;
        } list;
        uint8_t status;
    } is;
} ListResult;

typedef struct {
    uint8_t is_error;
    union {
        uint64_t number;
        uint8_t status;
    } is;
} NumberResult;

/* A warning comes with values, all that is worse with none. */
static bool fails(fmi3Status status) { return status > fmi3Warning; }

static ListResult *list_result(fmi3Status status, const void *items, size_t count) {
    ListResult *result = pass(1, sizeof *result);
    *result = (ListResult){.is_error = fails(status)};
    if (result->is_error)
        result->is.status = (uint8_t)status;
    else {
        result->is.list.items = items;
        result->is.list.count = count;
    }
    return result;
}

static NumberResult *number_result(fmi3Status status, size_t number) {
    NumberResult *result = pass(1, sizeof *result);
    *result = (NumberResult){.is_error = fails(status)};
    if (result->is_error)
        result->is.status = (uint8_t)status;
    else
        result->is.number = number;
    return result;
}

/* ---- instances --------------------------------------------------------------------------------
 */

/* What a handle of the host stands for. */
typedef struct {
    fmi3Instance fmu;
    size_t name_size;
    char name[]; /* as the host gave it */
} Instance;

typedef struct {
    uint8_t is_there;
    Instance *instance;
} OptionalInstance;

__attribute__((import_module("fmi:fmi3/callbacks@3.0.0"), import_name("log-message"))) void
host_log_message(const char *name, size_t name_size, uint32_t status, const char *category,
                 size_t category_size, const char *message, size_t message_size);

/* The draft's callback has no environment, but the instance's name. */
static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message) {
    const Instance *self = environment;
    host_log_message(self->name, self->name_size, (uint32_t)status, category, strlen(category),
                     message, strlen(message));
}

static fmi3Status refuse(Instance *self, const char *message) {
    log_message(self, fmi3Error, "logStatusError", message);
    return fmi3Error;
}

static Instance *prepare(String name) {
    Instance *self = malloc(sizeof *self + name.size);
    if (self == NULL)
        __builtin_trap();
    *self = (Instance){.name_size = name.size};
    memcpy(self->name, name.bytes, name.size);
    return self;
}

EXPORT("free-instance") void free_instance(Instance *self) {
    if (self->fmu != NULL)
        fmi3FreeInstance(self->fmu);
    free(self);
}

static OptionalInstance *finish(Instance *self) {
    OptionalInstance *result = pass(1, sizeof *result);
    bool is_there = self->fmu != NULL;
    if (!is_there)
        free_instance(self);
    *result = (OptionalInstance){is_there, is_there ? self : NULL};
    return result;
}

/* The component's maker puts the host's handle in the place of the instance's address.
 *
 * A component cannot leave an import to the host's choice, and a host for Model Exchange has no
 * intermediate updates to offer: so there are none here. */
EXPORT("instantiate-co-simulation")
OptionalInstance *instantiate_co_simulation(const char *name, size_t name_size, const char *token,
                                            size_t token_size, uint32_t visible,
                                            uint32_t logging_on, uint32_t event_mode_used,
                                            uint32_t early_return_allowed,
                                            const fmi3ValueReference required[], size_t count) {
    (void)required;
    String given = {name, name_size};
    Instance *self = prepare(given);
    if (count > 0)
        refuse(self, "fmi3InstantiateCoSimulation: required-intermediate-variables must be empty: "
                     "this component calls back for no intermediate update");
    else
        self->fmu = fmi3InstantiateCoSimulation(
            text(given), text((String){token, token_size}), NULL, visible != 0, logging_on != 0,
            event_mode_used != 0, early_return_allowed != 0, NULL, 0, self, log_message, NULL);
    return finish(self);
}

EXPORT("instantiate-model-exchange")
OptionalInstance *instantiate_model_exchange(const char *name, size_t name_size, const char *token,
                                             size_t token_size, uint32_t visible,
                                             uint32_t logging_on) {
    String given = {name, name_size};
    Instance *self = prepare(given);
    self->fmu = fmi3InstantiateModelExchange(text(given), text((String){token, token_size}), NULL,
                                             visible != 0, logging_on != 0, self, log_message);
    return finish(self);
}

EXPORT("get-version") String *get_version(void) {
    String *version = pass(1, sizeof *version);
    *version = string_of(fmi3GetVersion());
    return version;
}

EXPORT("set-debug-logging")
fmi3Status set_debug_logging(const Instance *self, uint32_t logging_on, const String categories[],
                             size_t count) {
    fmi3String *names = pass(count, sizeof *names);
    for (size_t i = 0; i < count; ++i)
        names[i] = text(categories[i]);
    return fmi3SetDebugLogging(self->fmu, logging_on != 0, count, names);
}

/* ---- modes -------------------------------------------------------------------------------------
 */

EXPORT("enter-initialization-mode")
fmi3Status enter_initialization_mode(const Instance *self, uint32_t has_tolerance, double tolerance,
                                     double start_time, uint32_t has_stop_time, double stop_time) {
    return fmi3EnterInitializationMode(self->fmu, has_tolerance != 0, tolerance, start_time,
                                       has_stop_time != 0, stop_time);
}

#define MODE(name, function)                                                                       \
    EXPORT(name) fmi3Status call_##function(const Instance *self) { return function(self->fmu); }

MODE("exit-initialization-mode", fmi3ExitInitializationMode)
MODE("enter-event-mode", fmi3EnterEventMode)
MODE("enter-step-mode", fmi3EnterStepMode)
MODE("enter-continuous-time-mode", fmi3EnterContinuousTimeMode)
MODE("enter-configuration-mode", fmi3EnterConfigurationMode)
MODE("exit-configuration-mode", fmi3ExitConfigurationMode)
MODE("evaluate-discrete-states", fmi3EvaluateDiscreteStates)
MODE("terminate", fmi3Terminate)
MODE("reset", fmi3Reset)

typedef struct {
    uint8_t is_error;
    union {
        struct {
            bool new_discrete_states_needed, terminate_simulation, nominals_changed, values_changed;
            bool next_event_time_defined;
            double next_event_time;
        } info;
        uint8_t status;
    } is;
} DiscreteStatesResult;

EXPORT("update-discrete-states")
DiscreteStatesResult *update_discrete_states(const Instance *self) {
    DiscreteStatesResult *result = pass(1, sizeof *result);
    memset(result, 0, sizeof *result);
    fmi3Status status = fmi3UpdateDiscreteStates(
        self->fmu, &result->is.info.new_discrete_states_needed,
        &result->is.info.terminate_simulation, &result->is.info.nominals_changed,
        &result->is.info.values_changed, &result->is.info.next_event_time_defined,
        &result->is.info.next_event_time);
    result->is_error = fails(status);
    if (result->is_error)
        result->is.status = (uint8_t)status;
    return result;
}

/* ---- values ------------------------------------------------------------------------------------
 */

#define VALUES(name, type)                                                                         \
    EXPORT("get-" name)                                                                            \
    ListResult *get_##type(const Instance *self, const fmi3ValueReference references[],            \
                           size_t count) {                                                         \
        fmi3##type *values = pass(count, sizeof *values);                                          \
        return list_result(fmi3Get##type(self->fmu, references, count, values, count), values,     \
                           count);                                                                 \
    }                                                                                              \
    EXPORT("set-" name)                                                                            \
    fmi3Status set_##type(const Instance *self, const fmi3ValueReference references[],             \
                          size_t count, const fmi3##type values[], size_t value_count) {           \
        return fmi3Set##type(self->fmu, references, count, values, value_count);                   \
    }

VALUES("float32", Float32)
VALUES("float64", Float64)
VALUES("int8", Int8)
VALUES("int16", Int16)
VALUES("int32", Int32)
VALUES("int64", Int64)
VALUES("uint8", UInt8)
VALUES("uint16", UInt16)
VALUES("uint32", UInt32)
VALUES("uint64", UInt64)
VALUES("boolean", Boolean)

/* Strings, binaries and clocks: the FMU has none, so that it answers for none of them, refuses any,
 * and looks at no value. As many are asked for as there are of both lists. */

#define NO_GETTER(name, function, ...)                                                             \
    EXPORT(name)                                                                                   \
    ListResult *call_##function(const Instance *self, const fmi3ValueReference references[],       \
                                size_t count) {                                                    \
        return list_result(function(self->fmu, references, count, __VA_ARGS__), NULL, 0);          \
    }

#define NO_SETTER(name, function, ...)                                                             \
    EXPORT(name)                                                                                   \
    fmi3Status call_##function(const Instance *self, const fmi3ValueReference references[],        \
                               size_t count, const void *values, size_t value_count) {             \
        (void)values;                                                                              \
        return function(self->fmu, references, count + value_count, __VA_ARGS__);                  \
    }

NO_GETTER("get-string", fmi3GetString, NULL, 0)
NO_SETTER("set-string", fmi3SetString, NULL, 0)
NO_GETTER("get-binary", fmi3GetBinary, NULL, NULL, 0)
NO_SETTER("set-binary", fmi3SetBinary, NULL, NULL, 0)
NO_GETTER("get-clock", fmi3GetClock, NULL)
NO_SETTER("set-clock", fmi3SetClock, NULL)
NO_GETTER("get-interval-decimal", fmi3GetIntervalDecimal, NULL, NULL)
NO_SETTER("set-interval-decimal", fmi3SetIntervalDecimal, NULL)
NO_GETTER("get-interval-fraction", fmi3GetIntervalFraction, NULL, NULL, NULL)
NO_SETTER("set-interval-fraction", fmi3SetIntervalFraction, NULL, NULL)
NO_GETTER("get-shift-decimal", fmi3GetShiftDecimal, NULL)
NO_SETTER("set-shift-decimal", fmi3SetShiftDecimal, NULL)
NO_GETTER("get-shift-fraction", fmi3GetShiftFraction, NULL, NULL)
NO_SETTER("set-shift-fraction", fmi3SetShiftFraction, NULL, NULL)

/* ---- states ------------------------------------------------------------------------------------
 */

/* Saved and serialized at once. */
EXPORT("get-fmu-state") ListResult *get_fmu_state(const Instance *self) {
    fmi3FMUState state = NULL;
    size_t size = 0;
    uint8_t *bytes = NULL;
    fmi3Status status = fmi3GetFMUState(self->fmu, &state);
    if (status == fmi3OK)
        status = fmi3SerializedFMUStateSize(self->fmu, state, &size);
    if (status == fmi3OK) {
        bytes = pass(size, 1);
        status = fmi3SerializeFMUState(self->fmu, state, bytes, size);
    }
    if (state != NULL)
        fmi3FreeFMUState(self->fmu, &state);
    return list_result(status, bytes, size);
}

EXPORT("set-fmu-state")
fmi3Status set_fmu_state(const Instance *self, const uint8_t bytes[], size_t size) {
    fmi3FMUState state = NULL;
    fmi3Status status = fmi3DeserializeFMUState(self->fmu, bytes, size, &state);
    if (status == fmi3OK)
        status = fmi3SetFMUState(self->fmu, state);
    if (state != NULL)
        fmi3FreeFMUState(self->fmu, &state);
    return status;
}

/* ---- derivatives and dependencies ---------------------------------------------------------------
 */

EXPORT("get-directional-derivative")
ListResult *get_directional_derivative(const Instance *self, const fmi3ValueReference unknowns[],
                                       size_t unknown_count, const fmi3ValueReference knowns[],
                                       size_t known_count, const double seed[], size_t seed_count) {
    double *values = pass(unknown_count, sizeof *values);
    fmi3Status status =
        fmi3GetDirectionalDerivative(self->fmu, unknowns, unknown_count, knowns, known_count, seed,
                                     seed_count, values, unknown_count);
    return list_result(status, values, unknown_count);
}

EXPORT("get-adjoint-derivative")
ListResult *get_adjoint_derivative(const Instance *self, const fmi3ValueReference unknowns[],
                                   size_t unknown_count, const fmi3ValueReference knowns[],
                                   size_t known_count, const double seed[], size_t seed_count) {
    double *values = pass(known_count, sizeof *values);
    fmi3Status status =
        fmi3GetAdjointDerivative(self->fmu, unknowns, unknown_count, knowns, known_count, seed,
                                 seed_count, values, known_count);
    return list_result(status, values, known_count);
}

typedef struct {
    fmi3ValueReference reference;
    uint32_t order;
} Request;

EXPORT("get-output-derivatives")
ListResult *get_output_derivatives(const Instance *self, const Request requests[], size_t count) {
    double *values = pass(count, sizeof *values);
    fmi3ValueReference *references = pass(count, sizeof *references);
    fmi3Int32 *orders = pass(count, sizeof *orders);
    for (size_t i = 0; i < count; ++i) {
        references[i] = requests[i].reference;
        orders[i] = requests[i].order <= INT32_MAX ? (fmi3Int32)requests[i].order : INT32_MAX;
    }
    return list_result(
        fmi3GetOutputDerivatives(self->fmu, references, count, orders, values, count), values,
        count);
}

/* The draft has it from FMI 2.0; in FMI 3.0 there is no such function. */
EXPORT("set-input-derivatives")
fmi3Status set_input_derivatives(Instance *self, const Request requests[], size_t count,
                                 const double values[], size_t value_count) {
    (void)requests;
    (void)values;
    return count + value_count == 0
               ? fmi3OK
               : refuse(self, "set-input-derivatives: FMI 3.0 has no derivatives of inputs; set "
                              "crank.w and crank.a beside crank.phi");
}

EXPORT("get-number-of-variable-dependencies")
NumberResult *get_number_of_variable_dependencies(const Instance *self,
                                                  fmi3ValueReference reference) {
    size_t number = 0;
    return number_result(fmi3GetNumberOfVariableDependencies(self->fmu, reference, &number),
                         number);
}

/* The FMU refuses it: modelDescription.xml lists them. */
EXPORT("get-variable-dependencies")
ListResult *get_variable_dependencies(const Instance *self, fmi3ValueReference dependent) {
    return list_result(fmi3GetVariableDependencies(self->fmu, dependent, NULL, NULL, NULL, NULL, 0),
                       NULL, 0);
}

/* ---- Model Exchange
 * ------------------------------------------------------------------------------ */

EXPORT("set-time") fmi3Status set_time(const Instance *self, double time) {
    return fmi3SetTime(self->fmu, time);
}

EXPORT("set-continuous-states")
fmi3Status set_continuous_states(const Instance *self, const double states[], size_t count) {
    return fmi3SetContinuousStates(self->fmu, states, count);
}

typedef fmi3Status CountFunction(fmi3Instance fmu, size_t *count);
typedef fmi3Status VectorFunction(fmi3Instance fmu, fmi3Float64 values[], size_t count);

static ListResult *vector(const Instance *self, CountFunction *count_of, VectorFunction *get) {
    size_t count = 0;
    double *values = NULL;
    fmi3Status status = count_of(self->fmu, &count);
    if (status == fmi3OK) {
        values = pass(count, sizeof *values);
        status = get(self->fmu, values, count);
    }
    return list_result(status, values, count);
}

#define VECTOR(name, function, count_function)                                                     \
    EXPORT(name) ListResult *call_##function(const Instance *self) {                               \
        return vector(self, count_function, function);                                             \
    }

VECTOR("get-continuous-states", fmi3GetContinuousStates, fmi3GetNumberOfContinuousStates)
VECTOR("get-continuous-state-derivatives", fmi3GetContinuousStateDerivatives,
       fmi3GetNumberOfContinuousStates)
VECTOR("get-nominals-of-continuous-states", fmi3GetNominalsOfContinuousStates,
       fmi3GetNumberOfContinuousStates)
VECTOR("get-event-indicators", fmi3GetEventIndicators, fmi3GetNumberOfEventIndicators)

#define NUMBER(name, function)                                                                     \
    EXPORT(name) NumberResult *call_##function(const Instance *self) {                             \
        size_t number = 0;                                                                         \
        return number_result(function(self->fmu, &number), number);                                \
    }

NUMBER("get-number-of-continuous-states", fmi3GetNumberOfContinuousStates)
NUMBER("get-number-of-event-indicators", fmi3GetNumberOfEventIndicators)

typedef struct {
    uint8_t is_error;
    union {
        struct {
            bool enter_event_mode, terminate_simulation;
        } step;
        uint8_t status;
    } is;
} CompletedStepResult;

EXPORT("completed-integrator-step")
CompletedStepResult *completed_integrator_step(const Instance *self, uint32_t no_set_state_prior) {
    CompletedStepResult *result = pass(1, sizeof *result);
    memset(result, 0, sizeof *result);
    fmi3Status status = fmi3CompletedIntegratorStep(self->fmu, no_set_state_prior != 0,
                                                    &result->is.step.enter_event_mode,
                                                    &result->is.step.terminate_simulation);
    result->is_error = fails(status);
    if (result->is_error)
        result->is.status = (uint8_t)status;
    return result;
}

/* ---- the communication step
 * ----------------------------------------------------------------------- */

typedef struct {
    uint8_t is_error;
    union {
        struct {
            double last_successful_time;
            bool event_handling_needed, terminate_simulation, early_return;
        } step;
        uint8_t status;
    } is;
} StepResult;

/* A step discarded answers that status; the draft's result has then no room for its time. */
EXPORT("do-step")
StepResult *do_step(const Instance *self, double time, double step, uint32_t no_set_state_prior) {
    StepResult *result = pass(1, sizeof *result);
    memset(result, 0, sizeof *result);
    fmi3Status status =
        fmi3DoStep(self->fmu, time, step, no_set_state_prior != 0,
                   &result->is.step.event_handling_needed, &result->is.step.terminate_simulation,
                   &result->is.step.early_return, &result->is.step.last_successful_time);
    result->is_error = fails(status);
    if (result->is_error)
        result->is.status = (uint8_t)status;
    return result;
}
/* NOLINTEND(misc-use-internal-linkage) */
