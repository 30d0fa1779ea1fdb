/* FMI 3.0 over the component, for co-simulation and Model Exchange: this file translates, it
 * decides nothing but which call is legal when (FMI 3.0, sections 2.3, 3.2 and 4.2).
 *
 * In a step the host is called back twice, if it wants to be: at its beginning, where it may ask
 * to return early, and at its end, where it may give the inputs of that instant; the outputs then
 * follow them. In Event Mode likewise. So a host has two legal ways to outputs without lag. */
#include "fmi3Functions.h"

#include <stdlib.h>

typedef struct {
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
    fmi3IntermediateUpdateCallback intermediate_update; /* NULL where the host wants none */
    bool can_return_early, has_event_mode;              /* the host allows it */
} Host;

static void *host_allocate(const Host *host, size_t size) {
    (void)host;
    return calloc(1, size);
}

static void host_release(const Host *host, void *memory) {
    (void)host;
    free(memory);
}

static void host_log(const Host *host, const char *name, fmi3Status status, const char *category,
                     const char *message) {
    (void)name;
    if (host->logger != NULL)
        host->logger(host->environment, status, category, message);
}

#define FMI(name) fmi3##name
#define TOKEN_NAME "instantiation token"
#define MESSAGE_ESCAPE '#'
#define CATEGORIES_ADD_UP true
#include "adaptor.h"

#define FOR_SETTING                                                                                \
    (IN_INSTANTIATED | IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS_TIME | IN_STEP                 \
     | IN_UPDATE_AT_END)
#define FOR_GETTING (FOR_SETTING | IN_UPDATE_AT_START | IN_TERMINATED)
#define FOR_DERIVATIVES                                                                            \
    (IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS_TIME | IN_STEP | IN_TERMINATED)

/* ---- inquire, create, destroy --------------------------------------------------------------- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)resourcePath; /* the component needs no files */
    (void)visible;
    Host host = {.logger = logMessage, .environment = instanceEnvironment, .has_event_mode = true};
    return instantiate(&host, KIND_MODEL_EXCHANGE, instanceName, instantiationToken, loggingOn,
                       "fmi3InstantiateModelExchange");
}

/* Whether each of these may be touched in an intermediate update: all inputs and outputs. */
static bool are_intermediate(const fmi3ValueReference references[], size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (references == NULL || references[i] < 1 || references[i] > INTERFACE_COUNT)
            return false;
        const InterfaceVariable *variable = &interface_variables[references[i]];
        if (variable->input < 0 && !variable->is_output)
            return false;
    }
    return true;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    static const char function[] = "fmi3InstantiateCoSimulation";
    (void)resourcePath; /* the component needs no files */
    (void)visible;
    Host host = {
        .logger = logMessage,
        .environment = instanceEnvironment,
        .intermediate_update = intermediateUpdate,
        .can_return_early = earlyReturnAllowed,
        .has_event_mode = eventModeUsed,
    };
    Instance *instance = instantiate(&host, KIND_CO_SIMULATION, instanceName, instantiationToken,
                                     loggingOn, function);
    if (instance != NULL
        && !are_intermediate(requiredIntermediateVariables, nRequiredIntermediateVariables)) {
        refuse(instance, function,
               "requiredIntermediateVariables names a variable that is neither input nor output");
        host_release(&host, instance);
        return NULL;
    }
    return instance;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instanceName;
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    Instance none = {.host = {.logger = logMessage, .environment = instanceEnvironment}};
    refuse(&none, "fmi3InstantiateScheduledExecution",
           "there are no clocks to schedule: Co-Simulation and Model Exchange are supported");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) { free_instance(instance, "fmi3FreeInstance"); }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    return set_logging(instance, loggingOn, nCategories, categories, "fmi3SetDebugLogging");
}

/* ---- modes ---------------------------------------------------------------------------------- */

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    static const char function[] = "fmi3EnterInitializationMode";
    (void)toleranceDefined; /* the kinematics is exact to rounding */
    (void)tolerance;
    Instance *self = check_call(instance, IN_INSTANTIATED, function);
    if (self == NULL)
        return fmi3Error;
    ComponentStatus status =
        component_set_experiment(&self->component, startTime, stopTimeDefined, stopTime);
    if (status == COMPONENT_OK)
        self->component.settings.mode = MODE_INITIALIZATION;
    return answer(self, status, function);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    static const char function[] = "fmi3ExitInitializationMode";
    Instance *self = check_call(instance, IN_INITIALIZATION, function);
    if (self == NULL)
        return fmi3Error;
    ComponentMode next = self->host.has_event_mode ? MODE_EVENT : MODE_STEP;
    return answer(self, component_exit_initialization(&self->component, next), function);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    static const char function[] = "fmi3EnterEventMode";
    Instance *self = check_call(instance, IN_CONTINUOUS_TIME | IN_STEP, function);
    if (self == NULL)
        return fmi3Error;
    if (!self->host.has_event_mode)
        return refuse(self, function, "the instance was made with eventModeUsed false");
    return change_mode(self, IN_CONTINUOUS_TIME | IN_STEP, MODE_EVENT, function);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    return change_mode(instance, ONLY_CO_SIMULATION(IN_EVENT), MODE_STEP, "fmi3EnterStepMode");
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    return change_mode(instance, ONLY_MODEL_EXCHANGE(IN_EVENT), MODE_CONTINUOUS_TIME,
                       "fmi3EnterContinuousTimeMode");
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    return change_mode(instance, IN_INITIALIZED, MODE_TERMINATED, "fmi3Terminate");
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    Instance *self = check_call(instance, IN_ANY, "fmi3Reset");
    if (self == NULL)
        return fmi3Error;
    component_reset(&self->component, (ComponentKind)self->component.settings.kind);
    return fmi3OK;
}

static fmi3Status refuse_configuration(fmi3Instance instance, const char *function) {
    Instance *self = check_call(instance, IN_ANY, function);
    if (self == NULL)
        return fmi3Error;
    return refuse(self, function, "there are no structural parameters");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    return refuse_configuration(instance, "fmi3EnterConfigurationMode");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    return refuse_configuration(instance, "fmi3ExitConfigurationMode");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    /* there are none; without providesEvaluateDiscreteStates the call does nothing */
    return check_call(instance, IN_EVENT, "fmi3EvaluateDiscreteStates") == NULL ? fmi3Error
                                                                                : fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    static const char function[] = "fmi3UpdateDiscreteStates";
    if (check_arrays(instance, IN_EVENT, function, 1, discreteStatesNeedUpdate, terminateSimulation,
                     nominalsOfContinuousStatesChanged)
            == NULL
        || check_arrays(instance, IN_EVENT, function, 1, valuesOfContinuousStatesChanged,
                        nextEventTimeDefined, nextEventTime)
               == NULL)
        return fmi3Error;
    *discreteStatesNeedUpdate = fmi3False; /* there are no discrete states and no events */
    *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = fmi3False;
    *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0.0;
    return fmi3OK;
}

/* ---- values --------------------------------------------------------------------------------- */

/* The instance, where a call on variables is legal: each is a scalar and has one value. */
static inline Instance *check_values(fmi3Instance instance, uint32_t modes, const char *function,
                                     const fmi3ValueReference references[], size_t count,
                                     const void *values, size_t value_count) {
    Instance *self = check_arrays(instance, modes, function, count, references, values, values);
    if (self != NULL && value_count != count) {
        refuse(self, function, "as many values as value references are needed: all are scalars");
        return NULL;
    }
    return self;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues) {
    static const char function[] = "fmi3GetFloat64";
    Instance *self = check_values(instance, FOR_GETTING, function, valueReferences,
                                  nValueReferences, values, nValues);
    if (self == NULL)
        return fmi3Error;
    return answer(self,
                  component_get_real(&self->component, valueReferences, nValueReferences, values),
                  function);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues) {
    static const char function[] = "fmi3SetFloat64";
    Instance *self = check_values(instance, FOR_SETTING, function, valueReferences,
                                  nValueReferences, values, nValues);
    if (self == NULL)
        return fmi3Error;
    return answer(self,
                  component_set_real(&self->component, valueReferences, nValueReferences, values),
                  function);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Boolean values[], size_t nValues) {
    static const char function[] = "fmi3GetBoolean";
    Instance *self = check_values(instance, FOR_GETTING, function, valueReferences,
                                  nValueReferences, values, nValues);
    if (self == NULL
        || check_booleans(self, valueReferences, nValueReferences, false, function) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < nValues; ++i)
        values[i] = component_get_boolean(&self->component, valueReferences[i]);
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Boolean values[], size_t nValues) {
    static const char function[] = "fmi3SetBoolean";
    Instance *self = check_values(instance, FOR_SETTING, function, valueReferences,
                                  nValueReferences, values, nValues);
    if (self == NULL
        || check_booleans(self, valueReferences, nValueReferences, true, function) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < nValues; ++i)
        component_set_boolean(&self->component, valueReferences[i], values[i]);
    return fmi3OK;
}

/* fmi3Get... and fmi3Set... of a type of which there are no variables. */
#define NO_VARIABLES(type)                                                                         \
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],    \
                             size_t nValueReferences, fmi3##type values[], size_t nValues) {       \
        (void)valueReferences;                                                                     \
        (void)values;                                                                              \
        return check_none(instance, FOR_GETTING, "fmi3Get" #type, nValueReferences + nValues);     \
    }                                                                                              \
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],    \
                             size_t nValueReferences, const fmi3##type values[], size_t nValues) { \
        (void)valueReferences;                                                                     \
        (void)values;                                                                              \
        return check_none(instance, FOR_SETTING, "fmi3Set" #type, nValueReferences + nValues);     \
    }

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues) {
    (void)valueReferences;
    (void)valueSizes;
    (void)values;
    return check_none(instance, FOR_GETTING, "fmi3GetBinary", nValueReferences + nValues);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues) {
    (void)valueReferences;
    (void)valueSizes;
    (void)values;
    return check_none(instance, FOR_SETTING, "fmi3SetBinary", nValueReferences + nValues);
}

/* ---- clocks: there are none ----------------------------------------------------------------- */

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, fmi3Clock values[]) {
    (void)valueReferences;
    (void)values;
    return check_none(instance, IN_EVENT, "fmi3GetClock", nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, const fmi3Clock values[]) {
    (void)valueReferences;
    (void)values;
    return check_none(instance, IN_EVENT, "fmi3SetClock", nValueReferences);
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences;
    (void)intervals;
    (void)qualifiers;
    return check_none(instance, IN_INITIALIZATION | IN_EVENT, "fmi3GetIntervalDecimal",
                      nValueReferences);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return check_none(instance, IN_INITIALIZATION | IN_EVENT, "fmi3GetIntervalFraction",
                      nValueReferences);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, fmi3Float64 shifts[]) {
    (void)valueReferences;
    (void)shifts;
    return check_none(instance, IN_INITIALIZATION, "fmi3GetShiftDecimal", nValueReferences);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[]) {
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return check_none(instance, IN_INITIALIZATION, "fmi3GetShiftFraction", nValueReferences);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, const fmi3Float64 intervals[]) {
    (void)valueReferences;
    (void)intervals;
    return check_none(instance, IN_INITIALIZATION | IN_EVENT, "fmi3SetIntervalDecimal",
                      nValueReferences);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance,
                                   const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return check_none(instance, IN_INITIALIZATION | IN_EVENT, "fmi3SetIntervalFraction",
                      nValueReferences);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, const fmi3Float64 shifts[]) {
    (void)valueReferences;
    (void)shifts;
    return check_none(instance, IN_INITIALIZATION, "fmi3SetShiftDecimal", nValueReferences);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) {
    (void)valueReferences;
    (void)counters;
    (void)resolutions;
    return check_none(instance, IN_INITIALIZATION, "fmi3SetShiftFraction", nValueReferences);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime) {
    (void)clockReference;
    (void)activationTime;
    return check_none(instance, IN_ANY, "fmi3ActivateModelPartition", 1);
}

/* ---- derivatives and dependencies -------------------------------------------------------------
 */

static fmi3Status refuse_dependencies(fmi3Instance instance, const char *function) {
    Instance *self = check_call(instance, IN_ANY, function);
    if (self == NULL)
        return fmi3Error;
    return refuse(self, function,
                  "providesPerElementDependencies is false: modelDescription.xml lists them all");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance,
                                               fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    (void)valueReference;
    (void)nDependencies;
    return refuse_dependencies(instance, "fmi3GetNumberOfVariableDependencies");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[], size_t nDependencies) {
    (void)dependent;
    (void)elementIndicesOfDependent;
    (void)independents;
    (void)elementIndicesOfIndependents;
    (void)dependencyKinds;
    (void)nDependencies;
    return refuse_dependencies(instance, "fmi3GetVariableDependencies");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t nValues) {
    static const char function[] = "fmi3GetOutputDerivatives";
    uint32_t modes = ONLY_CO_SIMULATION(IN_EVENT | IN_STEP | IN_UPDATE | IN_TERMINATED);
    Instance *self =
        check_values(instance, modes, function, valueReferences, nValueReferences, values, nValues);
    if (self == NULL
        || check_arrays(instance, modes, function, nValueReferences, orders, orders, orders)
               == NULL)
        return fmi3Error;
    return answer(self,
                  component_get_output_derivatives(&self->component, valueReferences,
                                                   nValueReferences, orders, values),
                  function);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t nUnknowns, const fmi3ValueReference knowns[],
                                        size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                        fmi3Float64 sensitivity[], size_t nSensitivity) {
    static const char function[] = "fmi3GetDirectionalDerivative";
    Instance *self =
        check_values(instance, FOR_DERIVATIVES, function, knowns, nKnowns, seed, nSeed);
    if (self == NULL
        || check_values(instance, FOR_DERIVATIVES, function, unknowns, nUnknowns, sensitivity,
                        nSensitivity)
               == NULL)
        return fmi3Error;
    return answer(self,
                  component_get_directional_derivative(&self->component, unknowns, nUnknowns,
                                                       knowns, nKnowns, seed, sensitivity),
                  function);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t nUnknowns, const fmi3ValueReference knowns[],
                                    size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                    fmi3Float64 sensitivity[], size_t nSensitivity) {
    static const char function[] = "fmi3GetAdjointDerivative";
    Instance *self =
        check_values(instance, FOR_DERIVATIVES, function, unknowns, nUnknowns, seed, nSeed);
    if (self == NULL
        || check_values(instance, FOR_DERIVATIVES, function, knowns, nKnowns, sensitivity,
                        nSensitivity)
               == NULL)
        return fmi3Error;
    return answer(self,
                  component_get_adjoint_derivative(&self->component, unknowns, nUnknowns, knowns,
                                                   nKnowns, seed, sensitivity),
                  function);
}

/* ---- Model Exchange ------------------------------------------------------------------------- */

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance,
                                       fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode,
                                       fmi3Boolean *terminateSimulation) {
    static const char function[] = "fmi3CompletedIntegratorStep";
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    if (check_arrays(instance, ONLY_MODEL_EXCHANGE(IN_CONTINUOUS_TIME), function, 1, enterEventMode,
                     terminateSimulation, terminateSimulation)
        == NULL)
        return fmi3Error;
    *enterEventMode = fmi3False;
    *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    return set_time(instance, time, "fmi3SetTime");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    return set_continuous_states(instance, continuousStates, nContinuousStates,
                                 "fmi3SetContinuousStates");
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    return get_continuous(instance, FOR_DERIVATIVES, VARIABLE_MACHINE_S, continuousStates,
                          nContinuousStates, "fmi3GetContinuousStates");
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    return get_continuous(instance, FOR_DERIVATIVES, VARIABLE_DER_MACHINE_S, derivatives,
                          nContinuousStates, "fmi3GetContinuousStateDerivatives");
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates) {
    return get_nominals(instance, FOR_DERIVATIVES, nominals, nContinuousStates,
                        "fmi3GetNominalsOfContinuousStates");
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[],
                                  size_t nEventIndicators) {
    return check_count(instance, FOR_DERIVATIVES, nEventIndicators, EVENT_INDICATORS,
                       eventIndicators, "fmi3GetEventIndicators")
                   == NULL
               ? fmi3Error
               : fmi3OK;
}

static fmi3Status get_number(fmi3Instance instance, size_t *number, size_t value,
                             const char *function) {
    if (check_pointer(instance, ONLY_MODEL_EXCHANGE(IN_INSTANTIATED | FOR_DERIVATIVES), function,
                      number)
        == NULL)
        return fmi3Error;
    *number = value;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    return get_number(instance, nEventIndicators, EVENT_INDICATORS,
                      "fmi3GetNumberOfEventIndicators");
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    return get_number(instance, nContinuousStates, CONTINUOUS_STATES,
                      "fmi3GetNumberOfContinuousStates");
}

/* ---- the communication step ------------------------------------------------------------------ */

/* Calls the host back, at the start or at the end of a step. Returns the time to which the host now
 * wants to step: `end`, or an earlier one. */
static double update(Instance *self, ComponentMode mode, double time, double end) {
    int64_t mode_of_step = self->component.settings.mode;
    bool is_at_end = mode == MODE_UPDATE_AT_END;
    bool may_return = self->host.can_return_early && !is_at_end;
    fmi3Boolean is_early = fmi3False;
    fmi3Float64 early_time = end;
    self->component.settings.mode = mode;
    /* at the end the inputs that the host gives may still change the outputs */
    self->host.intermediate_update(self->host.environment, time, is_at_end, fmi3True, !is_at_end,
                                   may_return, &is_early, &early_time);
    self->component.settings.mode = mode_of_step;
    return may_return && is_early && early_time < end ? early_time : end;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    static const char function[] = "fmi3DoStep";
    (void)noSetFMUStatePriorToCurrentPoint; /* nothing is kept for going back */
    Instance *self = check_arrays(instance, ONLY_CO_SIMULATION(IN_STEP), function, 1,
                                  eventHandlingNeeded, terminateSimulation, earlyReturn);
    if (self == NULL || check_pointer(instance, IN_STEP, function, lastSuccessfulTime) == NULL)
        return fmi3Error;
    Component *component = &self->component;
    double time = currentCommunicationPoint, step = communicationStepSize;
    *eventHandlingNeeded = fmi3False; /* nothing happens but at the host's will */
    *terminateSimulation = fmi3False;
    *earlyReturn = fmi3False;
    *lastSuccessfulTime = component->settings.real[VARIABLE_TIME];

    ComponentStatus status = COMPONENT_OK;
    bool is_early = false;
    if (self->host.intermediate_update != NULL) {
        status = component_check_step(component, time, step);
        if (status == COMPONENT_OK) {
            double wanted = update(self, MODE_UPDATE_AT_START, time, time + step);
            is_early = wanted < time + step;
            if (is_early) { /* the host's time may be off by more than so short a step tolerates */
                time = component->settings.real[VARIABLE_TIME];
                step = wanted - time;
            }
        }
        if (is_early && !(step > 0.0)) { /* no step at all */
            *earlyReturn = fmi3True;
            return fmi3OK;
        }
    }
    if (status == COMPONENT_OK)
        status = component_do_step(component, time, step);
    if (status != COMPONENT_OK)
        return answer_refusal(self, status, function);
    if (component->has_news && self->logs_events)
        say(self, fmi3OK, function, component->message);
    *earlyReturn = is_early;
    *lastSuccessfulTime = component->settings.real[VARIABLE_TIME];
    if (self->host.intermediate_update != NULL)
        update(self, MODE_UPDATE_AT_END, *lastSuccessfulTime, *lastSuccessfulTime);
    return fmi3OK;
}

/* ---- state ------------------------------------------------------------------------------------
 */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return get_state(instance, FMUState, "fmi3GetFMUState");
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    return set_state(instance, FMUState, "fmi3SetFMUState");
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return free_state(instance, FMUState, "fmi3FreeFMUState");
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    return get_serialized_size(instance, FMUState, size, "fmi3SerializedFMUStateSize");
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size) {
    return serialize_state(instance, FMUState, serializedState, size, "fmi3SerializeFMUState");
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[],
                                   size_t size, fmi3FMUState *FMUState) {
    return deserialize_state(instance, serializedState, size, FMUState, "fmi3DeserializeFMUState");
}
