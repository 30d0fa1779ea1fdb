/* A crank drive as an FMI 2.0 co-simulation FMU, for hosts that take inputs from other FMUs alone:
 * phi(t) = SPEED (t + SHARE (1 - cos PULSE t)/PULSE), its derivatives, and the machine's speed
 * TRAVEL phi'. Value references 1 to 4 are these outputs; partner.py defines the four numbers.
 * Nothing can be set, and no service is offered; hosts want to find all the functions. */
#include "fmi2Functions.h"

#include <math.h>
#include <stdlib.h>

#pragma GCC visibility push(default)
#pragma GCC diagnostic ignored "-Wunused-parameter"

#define ANSWER(status, name, ...)                                                                  \
    fmi2Status name(fmi2Component time, __VA_ARGS__) { return status; }
#define CALL(status, name)                                                                         \
    fmi2Status name(fmi2Component time) { return status; }
#define MANY const fmi2ValueReference references[], size_t count

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

/* The instance is its time. */
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token,
                              fmi2String resources, const fmi2CallbackFunctions *callbacks,
                              fmi2Boolean visible, fmi2Boolean logging) {
    return calloc(1, sizeof(double));
}

void fmi2FreeInstance(fmi2Component time) { free(time); }

fmi2Status fmi2SetupExperiment(fmi2Component time, fmi2Boolean tolerant, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stops, fmi2Real stop) {
    *(double *)time = start;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component time, fmi2Real from, fmi2Real step, fmi2Boolean no_return) {
    *(double *)time = from + step;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component time, const fmi2ValueReference references[], size_t count,
                       fmi2Real values[]) {
    double t = *(double *)time;
    double w = SPEED * (1 + SHARE * sin(PULSE * t));
    const double outputs[] = {SPEED * (t + SHARE * (1 - cos(PULSE * t)) / PULSE), w,
                              SPEED * SHARE * PULSE * cos(PULSE * t), TRAVEL * w};
    for (size_t i = 0; i < count; ++i) {
        if (references[i] < 1 || references[i] > 4)
            return fmi2Error;
        values[i] = outputs[references[i] - 1];
    }
    return fmi2OK;
}

CALL(fmi2OK, fmi2EnterInitializationMode)
CALL(fmi2OK, fmi2ExitInitializationMode)
CALL(fmi2OK, fmi2Terminate)
CALL(fmi2OK, fmi2Reset)
CALL(fmi2Error, fmi2CancelStep)
ANSWER(fmi2OK, fmi2SetDebugLogging, fmi2Boolean on, size_t count, const fmi2String categories[])
ANSWER(fmi2Error, fmi2GetInteger, MANY, fmi2Integer values[])
ANSWER(fmi2Error, fmi2GetBoolean, MANY, fmi2Boolean values[])
ANSWER(fmi2Error, fmi2GetString, MANY, fmi2String values[])
ANSWER(fmi2Error, fmi2SetReal, MANY, const fmi2Real values[])
ANSWER(fmi2Error, fmi2SetInteger, MANY, const fmi2Integer values[])
ANSWER(fmi2Error, fmi2SetBoolean, MANY, const fmi2Boolean values[])
ANSWER(fmi2Error, fmi2SetString, MANY, const fmi2String values[])
ANSWER(fmi2Error, fmi2SetRealInputDerivatives, MANY, const fmi2Integer orders[], const fmi2Real v[])
ANSWER(fmi2Error, fmi2GetRealOutputDerivatives, MANY, const fmi2Integer orders[], fmi2Real v[])
ANSWER(fmi2Error, fmi2GetFMUstate, fmi2FMUstate *state)
ANSWER(fmi2Error, fmi2SetFMUstate, fmi2FMUstate state)
ANSWER(fmi2Error, fmi2FreeFMUstate, fmi2FMUstate *state)
ANSWER(fmi2Error, fmi2SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
ANSWER(fmi2Error, fmi2SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
ANSWER(fmi2Error, fmi2DeSerializeFMUstate, const fmi2Byte b[], size_t size, fmi2FMUstate *state)
ANSWER(fmi2Error, fmi2GetDirectionalDerivative, const fmi2ValueReference unknown[], size_t unknowns,
       const fmi2ValueReference known[], size_t knowns, const fmi2Real dk[], fmi2Real du[])
ANSWER(fmi2Error, fmi2GetStatus, const fmi2StatusKind kind, fmi2Status *value)
ANSWER(fmi2Error, fmi2GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
ANSWER(fmi2Error, fmi2GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
ANSWER(fmi2Error, fmi2GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
ANSWER(fmi2Error, fmi2GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
