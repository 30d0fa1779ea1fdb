/* A drive from another house: other names, other units, no states; it turns at constant speed.
 *
 * 0 load.torque (input, N.cm)   1 shaft.angle (output, deg)   2 shaft.speed (output, rpm)
 * 3 way.speed (output, km/h)   4 turns.per_minute (parameter, rpm)   5 plants.apart (parameter, mm)
 * 6 breaks.at (parameter, s): from then on each step is an error   7 shaft.torque (output, N.cm)
 *
 * With SI defined: its twin, of which all of these are in rad, rad/s, m/s, m and N.m.
 */
#include "fmi2Functions.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#ifdef SI /* of each unit */
#define DEG 0.017453292519943295
#define RPM 0.10471975511965977
#define KM_H 0.2777777777777778
#define MM 0.001
#define N_CM 0.01
#else
#define DEG 1.0
#define RPM 1.0
#define KM_H 1.0
#define MM 1.0
#define N_CM 1.0
#endif

enum { LOAD, ANGLE, SPEED, WAY_SPEED, TURNS, APART, BREAKS, TORQUE, COUNT };

typedef struct {
    double value[COUNT], time;
    const fmi2CallbackFunctions *callbacks;
} Drive;

static void show(Drive *drive) {
    const double rpm = drive->value[TURNS] / RPM, apart = drive->value[APART] / MM;
    drive->value[SPEED] = drive->value[TURNS];
    drive->value[ANGLE] = (-90.0 + 6.0 * rpm * drive->time) * DEG;
    drive->value[WAY_SPEED] = apart * rpm * 60e-6 * KM_H;
    drive->value[TORQUE] = drive->value[LOAD] + 50.0 * N_CM; /* its own friction */
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
    Drive *drive = calloc(1, sizeof *drive);
    drive->callbacks = callbacks;
    drive->value[TURNS] = 65.0 * RPM;
    drive->value[APART] = 400.0 * MM;
    drive->value[BREAKS] = 1e9;
    return drive;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Drive *)c)->time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return (void)c, fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return (void)c, fmi2OK; }

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference *references, size_t count,
                       const fmi2Real *values) {
    for (size_t i = 0; i < count; i++)
        ((Drive *)c)->value[references[i]] = values[i];
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference *references, size_t count,
                       fmi2Real *values) {
    show(c);
    for (size_t i = 0; i < count; i++)
        values[i] = ((Drive *)c)->value[references[i]];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_return) {
    (void)no_return;
    Drive *drive = c;
    if (time + step > drive->value[BREAKS]) {
        drive->callbacks->logger(drive->callbacks->componentEnvironment, "drive", fmi2Error,
                                 "error", "the shear pin is broken");
        return fmi2Error;
    }
    drive->time = time + step;
    return fmi2OK;
}

/* Asked for by hosts when they load the library; nothing of it is offered. */
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
#define REFUSE(name, ...)                                                                          \
    fmi2Status name(fmi2Component c, __VA_ARGS__) { return (void)c, (void)a, fmi2Error; }
#define A_LIST(type) const fmi2ValueReference *a, size_t n, type v
#pragma clang diagnostic ignored "-Wunused-parameter"
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String names[]) {
    return fmi2OK;
}
REFUSE(fmi2GetInteger, A_LIST(fmi2Integer *))
REFUSE(fmi2GetBoolean, A_LIST(fmi2Boolean *))
REFUSE(fmi2GetString, A_LIST(fmi2String *))
REFUSE(fmi2SetInteger, A_LIST(const fmi2Integer *))
REFUSE(fmi2SetBoolean, A_LIST(const fmi2Boolean *))
REFUSE(fmi2SetString, A_LIST(const fmi2String *))
REFUSE(fmi2GetFMUstate, fmi2FMUstate *a)
REFUSE(fmi2SetFMUstate, fmi2FMUstate a)
REFUSE(fmi2FreeFMUstate, fmi2FMUstate *a)
REFUSE(fmi2SerializedFMUstateSize, fmi2FMUstate a, size_t *size)
REFUSE(fmi2SerializeFMUstate, fmi2FMUstate a, fmi2Byte bytes[], size_t size)
REFUSE(fmi2DeSerializeFMUstate, const fmi2Byte a[], size_t size, fmi2FMUstate *state)
REFUSE(fmi2GetDirectionalDerivative, A_LIST(const fmi2ValueReference *), size_t m,
       const fmi2Real *x, fmi2Real *y)
REFUSE(fmi2SetRealInputDerivatives, A_LIST(const fmi2Integer *), const fmi2Real *x)
REFUSE(fmi2GetRealOutputDerivatives, A_LIST(const fmi2Integer *), fmi2Real *x)
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
REFUSE(fmi2GetStatus, const fmi2StatusKind a, fmi2Status *value)
REFUSE(fmi2GetRealStatus, const fmi2StatusKind a, fmi2Real *value)
REFUSE(fmi2GetIntegerStatus, const fmi2StatusKind a, fmi2Integer *value)
REFUSE(fmi2GetBooleanStatus, const fmi2StatusKind a, fmi2Boolean *value)
REFUSE(fmi2GetStringStatus, const fmi2StatusKind a, fmi2String *value)
