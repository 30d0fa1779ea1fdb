/* FMI 2.0 over the component, for co-simulation and Model Exchange: this file translates, it
 * decides nothing but which call is legal when (FMI 2.0.4, sections 3.2.3 and 4.2.4). */
#define FMI_VERSION 2
#include "adaptor.h"

#define FOR_SETTING (IN_INSTANTIATED | IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS_TIME | IN_STEP)
#define FOR_GETTING (IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS_TIME | IN_STEP | IN_TERMINATED)
#define FOR_STATUS ONLY_CO_SIMULATION(IN_STEP | IN_TERMINATED)

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
    /* A host that gives one of the two memory functions only cannot have meant it. */
    bool has_memory = functions->allocateMemory != NULL && functions->freeMemory != NULL;
    Host host = {
        .logger = functions->logger,
        .environment = functions->componentEnvironment,
        .allocate = has_memory ? functions->allocateMemory : calloc,
        .release = has_memory ? functions->freeMemory : free,
    };
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation) {
        Instance none = {.host = host, .name = INTERFACE_MODEL_IDENTIFIER};
        refuse(&none, "fmi2Instantiate", "fmi2Type must be fmi2ModelExchange or fmi2CoSimulation");
        return NULL;
    }
    ComponentKind kind = fmuType == fmi2ModelExchange ? KIND_MODEL_EXCHANGE : KIND_CO_SIMULATION;
    Instance *instance =
        instantiate(&host, kind, instanceName, fmuGUID, loggingOn != 0, "fmi2Instantiate");
    /* Which categories loggingOn stands for is open until the host names some: a Discard is told
     * either way, for fmi2Discard says that the logger was called (FMI 2.0.4, section 2.1.3). */
    if (instance != NULL)
        instance->logs_discards = true;
    return instance;
}

void fmi2FreeInstance(fmi2Component c) { free_instance(c, "fmi2FreeInstance"); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    return set_logging(c, loggingOn != 0, nCategories, categories, "fmi2SetDebugLogging");
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
    return change_mode(c, IN_INSTANTIATED, MODE_INITIALIZATION, "fmi2EnterInitializationMode");
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Instance *instance = check_call(c, IN_INITIALIZATION, "fmi2ExitInitializationMode");
    if (instance == NULL)
        return fmi2Error;
    bool is_co_simulation = component_kind(&instance->component) == KIND_CO_SIMULATION;
    return answer(instance,
                  component_exit_initialization(&instance->component,
                                                is_co_simulation ? MODE_STEP : MODE_EVENT),
                  "fmi2ExitInitializationMode");
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return change_mode(c, IN_INITIALIZED, MODE_TERMINATED, "fmi2Terminate");
}

fmi2Status fmi2Reset(fmi2Component c) {
    Instance *instance = check_call(c, IN_ANY, "fmi2Reset");
    if (instance == NULL)
        return fmi2Error;
    component_reset(&instance->component, component_kind(&instance->component));
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

static bool has_state(const fmi2ValueReference vr[], size_t nvr) {
    for (size_t i = 0; i < nvr; ++i)
        if (vr[i] == VARIABLE_MACHINE_S)
            return true;
    return false;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       const fmi2Real value[]) {
    Instance *instance = check_arrays(c, FOR_SETTING, "fmi2SetReal", nvr, vr, value, value);
    if (instance == NULL)
        return fmi2Error;
    /* FMI 2.0.4, section 3.2.3, notes 4 and 5: states in continuous-time mode, not in event mode */
    if (component_mode(&instance->component) == MODE_EVENT && has_state(vr, nvr))
        return refuse(instance, "fmi2SetReal",
                      "machine.s: a continuous state cannot be set in event mode");
    return answer(instance, component_set_real(&instance->component, vr, nvr, value),
                  "fmi2SetReal");
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Boolean value[]) {
    Instance *instance = check_arrays(c, FOR_GETTING, "fmi2GetBoolean", nvr, vr, value, value);
    if (instance == NULL || check_booleans(instance, vr, nvr, false, "fmi2GetBoolean") != fmi2OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; ++i)
        value[i] = component_get_boolean(&instance->component, vr[i]);
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Boolean value[]) {
    Instance *instance = check_arrays(c, FOR_SETTING, "fmi2SetBoolean", nvr, vr, value, value);
    if (instance == NULL || check_booleans(instance, vr, nvr, true, "fmi2SetBoolean") != fmi2OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; ++i)
        component_set_boolean(&instance->component, vr[i], value[i] != 0);
    return fmi2OK;
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
    Instance *instance =
        check_arrays(c, ONLY_CO_SIMULATION(FOR_SETTING), function, nvr, vr, order, value);
    if (instance == NULL)
        return fmi2Error;
    return answer(instance,
                  component_set_input_derivatives(&instance->component, vr, nvr, order, value),
                  function);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    static const char function[] = "fmi2GetRealOutputDerivatives";
    Instance *instance = check_arrays(c, ONLY_CO_SIMULATION(IN_STEP | IN_TERMINATED), function, nvr,
                                      vr, order, value);
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

/* ---- Model Exchange ------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    return change_mode(c, ONLY_MODEL_EXCHANGE(IN_EVENT | IN_CONTINUOUS_TIME), MODE_EVENT,
                       "fmi2EnterEventMode");
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    Instance *instance =
        check_pointer(c, ONLY_MODEL_EXCHANGE(IN_EVENT), "fmi2NewDiscreteStates", eventInfo);
    if (instance == NULL)
        return fmi2Error;
    *eventInfo = (fmi2EventInfo){0}; /* there are no discrete states and no events */
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    return change_mode(c, ONLY_MODEL_EXCHANGE(IN_EVENT), MODE_CONTINUOUS_TIME,
                       "fmi2EnterContinuousTimeMode");
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c,
                                       fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode,
                                       fmi2Boolean *terminateSimulation) {
    static const char function[] = "fmi2CompletedIntegratorStep";
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (check_arrays(c, ONLY_MODEL_EXCHANGE(IN_CONTINUOUS_TIME), function, 1, enterEventMode,
                     terminateSimulation, terminateSimulation)
        == NULL)
        return fmi2Error;
    *enterEventMode = fmi2False;
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { return set_time(c, time, "fmi2SetTime"); }

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    return set_continuous_states(c, x, nx, "fmi2SetContinuousStates");
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    return get_continuous(c, FOR_GETTING, VARIABLE_DER_MACHINE_S, derivatives, nx,
                          "fmi2GetDerivatives");
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    return check_count(c, FOR_GETTING, ni, EVENT_INDICATORS, eventIndicators,
                       "fmi2GetEventIndicators")
                   == NULL
               ? fmi2Error
               : fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    return get_continuous(c, FOR_GETTING, VARIABLE_MACHINE_S, x, nx, "fmi2GetContinuousStates");
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    return get_nominals(c, IN_INSTANTIATED | FOR_GETTING, x_nominal, nx,
                        "fmi2GetNominalsOfContinuousStates");
}

/* ---- the communication step ------------------------------------------------------------------ */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    Instance *instance = check_call(c, ONLY_CO_SIMULATION(IN_STEP), "fmi2DoStep");
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
    return discard(instance, function, "there is no such status");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetStatus", value);
    if (instance == NULL)
        return fmi2Error;
    if (s != fmi2DoStepStatus)
        return refuse_status(instance, "fmi2GetStatus");
    *value = component_mode(&instance->component) == MODE_STEP_REFUSED ? fmi2Discard : fmi2OK;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    Instance *instance = check_pointer(c, FOR_STATUS, "fmi2GetRealStatus", value);
    if (instance == NULL)
        return fmi2Error;
    if (s != fmi2LastSuccessfulTime)
        return refuse_status(instance, "fmi2GetRealStatus");
    *value = component_time(&instance->component);
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

/* ---- state ------------------------------------------------------------------------------------
 */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return get_state(c, FMUstate, "fmi2GetFMUstate");
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    return set_state(c, FMUstate, "fmi2SetFMUstate");
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return free_state(c, FMUstate, "fmi2FreeFMUstate");
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    return get_serialized_size(c, FMUstate, size, "fmi2SerializedFMUstateSize");
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[],
                                 size_t size) {
    return serialize_state(c, FMUstate, serializedState, size, "fmi2SerializeFMUstate");
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    return deserialize_state(c, serializedState, size, FMUstate, "fmi2DeSerializeFMUstate");
}
