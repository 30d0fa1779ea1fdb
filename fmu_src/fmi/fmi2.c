/* FMI 2.0 co-simulation over the component: this file translates, it decides nothing but which
 * call is legal when (FMI 2.0.4, section 4.2.4). */
#include "../component/component.h"

#include "fmi2Functions.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    Component component;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    void (*release)(void *memory);
    void *(*allocate)(size_t count, size_t size);
    fmi2Boolean logs_events;
    char *name; /* stands behind this struct */
} Instance;

/* ---- messages ---------------------------------------------------------------------------- */

/* The category of modelDescription.xml under which each status is logged. */
static const char *category(fmi2Status status) {
    switch (status) {
    case fmi2Discard: return "logStatusDiscard";
    case fmi2Warning: return "logStatusWarning";
    case fmi2OK: return "logEvents";
    default: return "logStatusError";
    }
}

/* The message goes out complete, as a format without arguments: hosts written in other languages
 * than C cannot read those. */
static void say(const Instance *instance, fmi2Status status, const char *function,
                const char *text) {
    char format[2 * COMPONENT_MESSAGE_SIZE];
    size_t length = 0;
    const char *const parts[] = {function, ": ", text};
    if (instance->logger == NULL)
        return;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i)
        for (const char *part = parts[i]; *part != '\0' && length + 2 < sizeof format; ++part) {
            format[length++] = *part;
            if (*part == '%')
                format[length++] = '%';
        }
    format[length] = '\0';
    instance->logger(instance->environment, instance->name, status, category(status), format);
}

static fmi2Status refuse(const Instance *instance, const char *function, const char *text) {
    say(instance, fmi2Error, function, text);
    return fmi2Error;
}

static COMPONENT_RARELY fmi2Status answer_refusal(const Instance *instance, ComponentStatus status,
                                                  const char *function) {
    fmi2Status answered = status == COMPONENT_DISCARD ? fmi2Discard : fmi2Error;
    say(instance, answered, function, instance->component.message);
    return answered;
}

/* The component's status as FMI's, its message to the host's logger. */
static fmi2Status answer(const Instance *instance, ComponentStatus status, const char *function) {
    return status == COMPONENT_OK ? fmi2OK : answer_refusal(instance, status, function);
}

/* ---- which call is legal when -------------------------------------------------------------- */

enum {
    IN_INSTANTIATED = 1 << MODE_INSTANTIATED,
    IN_INITIALIZATION = 1 << MODE_INITIALIZATION,
    IN_STEP = 1 << MODE_STEP,
    IN_STEP_REFUSED = 1 << MODE_STEP_REFUSED,
    IN_TERMINATED = 1 << MODE_TERMINATED,
    IN_ANY = (1 << MODE_COUNT) - 1,

    /* A refused step leaves the component as before it, so setting and stepping go on from
     * there; the standard asks a host to restore a state first, and that works as well. */
    FOR_SETTING = IN_INSTANTIATED | IN_INITIALIZATION | IN_STEP | IN_STEP_REFUSED,
    FOR_GETTING = IN_INITIALIZATION | IN_STEP | IN_STEP_REFUSED | IN_TERMINATED,
    FOR_STEPPING = IN_STEP | IN_STEP_REFUSED,
    FOR_STATUS = IN_STEP | IN_STEP_REFUSED | IN_TERMINATED
};

static const char *const MODE_NAMES[MODE_COUNT] = {
    "before initialization",  "in initialization mode", "between steps",
    "after a discarded step", "after termination",
};

static bool is_legal(const Instance *instance, int modes) {
    return (modes >> instance->component.settings.mode) & 1;
}

/* Says why a call is not legal; returns NULL. */
static COMPONENT_RARELY Instance *refuse_call(const Instance *instance, int modes,
                                              const char *function) {
    if (instance != NULL && !is_legal(instance, modes)) {
        char text[80] = "not allowed ";
        strcat(text, MODE_NAMES[instance->component.settings.mode]);
        refuse(instance, function, text);
    } else if (instance != NULL) {
        refuse(instance, function, "an argument is NULL");
    }
    return NULL;
}

/* The instance, or NULL with a message where the call is not legal. */
static Instance *check_call(fmi2Component c, int modes, const char *function) {
    Instance *instance = c;
    return instance != NULL && is_legal(instance, modes) ? instance
                                                         : refuse_call(instance, modes, function);
}

/* The same for calls with arrays: none may be NULL where it has elements. */
static Instance *check_arrays(fmi2Component c, int modes, const char *function, size_t count,
                              const void *first, const void *second, const void *third) {
    Instance *instance = c;
    bool has_arrays = count == 0 || (first != NULL && second != NULL && third != NULL);
    return has_arrays && instance != NULL && is_legal(instance, modes)
               ? instance
               : refuse_call(instance, modes, function);
}

/* The same for calls with one pointer that must not be NULL. */
static Instance *check_pointer(fmi2Component c, int modes, const char *function,
                               const void *pointer) {
    return check_arrays(c, modes, function, 1, pointer, pointer, pointer);
}

/* ---- inquire, create, destroy --------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean loggingOn) {
    (void)fmuResourceLocation; /* the component needs no files */
    (void)visible;
    if (functions == NULL)
        return NULL;
    const char *name = instanceName == NULL ? "" : instanceName;
    Instance without_instance = {
        .logger = functions->logger,
        .environment = functions->componentEnvironment,
        .name = (char *)(size_t)(*name == '\0' ? INTERFACE_MODEL_IDENTIFIER : name),
    };
    const char *problem = NULL;
    if (*name == '\0')
        problem = "the instance name is missing or empty";
    else if (fmuType != fmi2CoSimulation)
        problem = "only fmi2CoSimulation is supported";
    else if (fmuGUID == NULL || strcmp(fmuGUID, INTERFACE_TOKEN) != 0)
        problem = "the GUID is not this FMU's, " INTERFACE_TOKEN ": modelDescription.xml and "
                  "binary are of different builds";
    if (problem != NULL) {
        refuse(&without_instance, "fmi2Instantiate", problem);
        return NULL;
    }

    /* A host that gives one of the two memory functions only cannot have meant it. */
    bool has_memory = functions->allocateMemory != NULL && functions->freeMemory != NULL;
    without_instance.allocate = has_memory ? functions->allocateMemory : calloc;
    without_instance.release = has_memory ? functions->freeMemory : free;
    size_t name_size = strlen(name) + 1;
    Instance *instance = without_instance.allocate(1, sizeof *instance + name_size);
    if (instance == NULL) {
        refuse(&without_instance, "fmi2Instantiate", "no memory");
        return NULL;
    }
    *instance = without_instance;
    instance->name = (char *)(instance + 1);
    memcpy(instance->name, name, name_size);
    instance->logs_events = loggingOn;
    component_reset(&instance->component);
    return instance;
}

void fmi2FreeInstance(fmi2Component c) {
    Instance *instance = c;
    if (instance != NULL)
        instance->release(instance);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    static const char *const known[] = {INTERFACE_LOG_CATEGORIES};
    Instance *instance = check_arrays(c, IN_ANY, "fmi2SetDebugLogging", nCategories, categories,
                                      categories, categories);
    if (instance == NULL)
        return fmi2Error;
    /* what went wrong is always told; the categories choose what else is */
    fmi2Boolean events = nCategories == 0;
    for (size_t i = 0; i < nCategories; ++i) {
        bool is_known = false;
        for (size_t k = 0; k < sizeof known / sizeof known[0]; ++k)
            is_known = is_known || (categories[i] != NULL && strcmp(categories[i], known[k]) == 0);
        if (!is_known)
            return refuse(instance, "fmi2SetDebugLogging",
                          "unknown category: modelDescription.xml lists them");
        events = events || strcmp(categories[i], "logEvents") == 0
                 || strcmp(categories[i], "logAll") == 0;
    }
    instance->logs_events = loggingOn && events;
    return fmi2OK;
}

/* ---- modes ---------------------------------------------------------------------------------- */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined; /* the kinematics is exact to rounding */
    (void)tolerance;
    Instance *instance = check_call(c, IN_INSTANTIATED, "fmi2SetupExperiment");
    if (instance == NULL)
        return fmi2Error;
    return answer(
        instance,
        component_set_experiment(&instance->component, startTime, stopTimeDefined != 0, stopTime),
        "fmi2SetupExperiment");
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Instance *instance = check_call(c, IN_INSTANTIATED, "fmi2EnterInitializationMode");
    if (instance == NULL)
        return fmi2Error;
    return answer(instance, component_enter_initialization(&instance->component),
                  "fmi2EnterInitializationMode");
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Instance *instance = check_call(c, IN_INITIALIZATION, "fmi2ExitInitializationMode");
    if (instance == NULL)
        return fmi2Error;
    return answer(instance, component_exit_initialization(&instance->component),
                  "fmi2ExitInitializationMode");
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Instance *instance = check_call(c, FOR_STEPPING, "fmi2Terminate");
    if (instance == NULL)
        return fmi2Error;
    component_terminate(&instance->component);
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    Instance *instance = check_call(c, IN_ANY, "fmi2Reset");
    if (instance == NULL)
        return fmi2Error;
    component_reset(&instance->component);
    return fmi2OK;
}

/* ---- values --------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       fmi2Real value[]) {
    Instance *instance = check_arrays(c, FOR_GETTING, "fmi2GetReal", nvr, vr, value, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance, component_get_real(&instance->component, vr, nvr, value),
                  "fmi2GetReal");
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       const fmi2Real value[]) {
    Instance *instance = check_arrays(c, FOR_SETTING, "fmi2SetReal", nvr, vr, value, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance, component_set_real(&instance->component, vr, nvr, value),
                  "fmi2SetReal");
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Boolean value[]) {
    Instance *instance = check_arrays(c, FOR_GETTING, "fmi2GetBoolean", nvr, vr, value, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance, component_get_boolean(&instance->component, vr, nvr, value),
                  "fmi2GetBoolean");
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Boolean value[]) {
    Instance *instance = check_arrays(c, FOR_SETTING, "fmi2SetBoolean", nvr, vr, value, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance, component_set_boolean(&instance->component, vr, nvr, value),
                  "fmi2SetBoolean");
}

/* There are no variables of the other types: none of them is fine, any of them is unknown. */
static fmi2Status check_none(fmi2Component c, int modes, const char *function, size_t count) {
    Instance *instance = check_call(c, modes, function);
    if (instance == NULL)
        return fmi2Error;
    return count == 0 ? fmi2OK : refuse(instance, function, "there are no variables of this type");
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return check_none(c, FOR_GETTING, "fmi2GetInteger", nvr);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Integer value[]) {
    (void)vr;
    (void)value;
    return check_none(c, FOR_SETTING, "fmi2SetInteger", nvr);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         fmi2String value[]) {
    (void)vr;
    (void)value;
    return check_none(c, FOR_GETTING, "fmi2GetString", nvr);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                         const fmi2String value[]) {
    (void)vr;
    (void)value;
    return check_none(c, FOR_SETTING, "fmi2SetString", nvr);
}

/* ---- derivatives ---------------------------------------------------------------------------- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    static const char function[] = "fmi2SetRealInputDerivatives";
    Instance *instance = check_arrays(c, FOR_SETTING, function, nvr, vr, order, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance,
                  component_set_input_derivatives(&instance->component, vr, nvr, order, value),
                  function);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    static const char function[] = "fmi2GetRealOutputDerivatives";
    Instance *instance =
        check_arrays(c, FOR_GETTING & ~IN_INITIALIZATION, function, nvr, vr, order, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance,
                  component_get_output_derivatives(&instance->component, vr, nvr, order, value),
                  function);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                        size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    static const char function[] = "fmi2GetDirectionalDerivative";
    if (check_arrays(c, FOR_GETTING, function, nUnknown, vUnknown_ref, dvUnknown, dvUnknown)
        == NULL)
        return fmi2Error;
    Instance *instance =
        check_arrays(c, FOR_GETTING, function, nKnown, vKnown_ref, dvKnown, dvKnown);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance,
                  component_get_directional_derivative(&instance->component, vUnknown_ref, nUnknown,
                                                       vKnown_ref, nKnown, dvKnown, dvUnknown),
                  function);
}

/* ---- the communication step --------------------------------------------------------------------
 */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    Instance *instance = check_call(c, FOR_STEPPING, "fmi2DoStep");
    if (instance == NULL)
        return fmi2Error;
    Component *component = &instance->component;
    ComponentStatus status =
        component_do_step(component, currentCommunicationPoint, communicationStepSize);
    if (status == COMPONENT_OK && component->has_news && instance->logs_events)
        say(instance, fmi2OK, "fmi2DoStep", component->message);
    return answer(instance, status, "fmi2DoStep");
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    Instance *instance = c;
    if (instance == NULL)
        return fmi2Error;
    return refuse(instance, "fmi2CancelStep",
                  "no step is in progress: fmi2DoStep waits for its end");
}

static fmi2Status refuse_status(const Instance *instance, const char *function) {
    say(instance, fmi2Discard, function, "there is no such status");
    return fmi2Discard;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetStatus", value);
    if (instance == NULL)
        return fmi2Error;
    if (s != fmi2DoStepStatus)
        return refuse_status(instance, "fmi2GetStatus");
    *value = instance->component.settings.mode == MODE_STEP_REFUSED ? fmi2Discard : fmi2OK;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetRealStatus", value);
    if (instance == NULL)
        return fmi2Error;
    if (s != fmi2LastSuccessfulTime)
        return refuse_status(instance, "fmi2GetRealStatus");
    *value = instance->component.settings.real[VARIABLE_TIME];
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetIntegerStatus", value);
    return instance == NULL ? fmi2Error : refuse_status(instance, "fmi2GetIntegerStatus");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetBooleanStatus", value);
    if (instance == NULL)
        return fmi2Error;
    if (s != fmi2Terminated)
        return refuse_status(instance, "fmi2GetBooleanStatus");
    *value = fmi2False; /* the component never asks to end a simulation */
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetStringStatus", value);
    if (instance == NULL)
        return fmi2Error;
    if (s != fmi2PendingStatus)
        return refuse_status(instance, "fmi2GetStringStatus");
    *value = ""; /* no step is ever pending */
    return fmi2OK;
}

/* ---- state --------------------------------------------------------------------------------------
 */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *instance = check_pointer(c, IN_ANY, "fmi2GetFMUstate", FMUstate);
    if (instance == NULL)
        return fmi2Error;
    if (*FMUstate == NULL)
        *FMUstate = instance->allocate(1, sizeof(ComponentState));
    if (*FMUstate == NULL)
        return refuse(instance, "fmi2GetFMUstate", "no memory");
    component_save(&instance->component, *FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    Instance *instance = check_pointer(c, IN_ANY, "fmi2SetFMUstate", FMUstate);
    if (instance == NULL)
        return fmi2Error;
    component_restore(&instance->component, FMUstate);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Instance *instance = check_call(c, IN_ANY, "fmi2FreeFMUstate");
    if (instance == NULL)
        return fmi2Error;
    if (FMUstate != NULL && *FMUstate != NULL) { /* NULL is ignored: FMI 2.0.4, section 2.1.8 */
        instance->release(*FMUstate);
        *FMUstate = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    Instance *instance =
        check_arrays(c, IN_ANY, "fmi2SerializedFMUstateSize", 1, FMUstate, size, size);
    if (instance == NULL)
        return fmi2Error;
    *size = component_serialized_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[],
                                 size_t size) {
    static const char function[] = "fmi2SerializeFMUstate";
    Instance *instance = check_arrays(c, IN_ANY, function, 1, FMUstate, serializedState, FMUstate);
    if (instance == NULL)
        return fmi2Error;
    if (size < component_serialized_size())
        return refuse(instance, function, "the buffer is too small");
    component_serialize(FMUstate, (uint8_t *)serializedState);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    static const char function[] = "fmi2DeSerializeFMUstate";
    Instance *instance = check_arrays(c, IN_ANY, function, 1, serializedState, FMUstate, FMUstate);
    if (instance == NULL)
        return fmi2Error;
    ComponentState state;
    ComponentStatus status =
        component_deserialize(&instance->component, (const uint8_t *)serializedState, size, &state);
    if (status != COMPONENT_OK)
        return answer(instance, status, function);
    if (*FMUstate == NULL)
        *FMUstate = instance->allocate(1, sizeof state);
    if (*FMUstate == NULL)
        return refuse(instance, function, "no memory");
    memcpy(*FMUstate, &state, sizeof state);
    return fmi2OK;
}
