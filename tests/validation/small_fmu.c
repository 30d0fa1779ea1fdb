/* A small FMU to break: x' = u - x, y = k x + u^2, an event indicator z = x - 10, a text; for
 * FMI 2.0 or, with -DFMI3, 3.0; co-simulation and Model Exchange. The file resources/defect.txt in
 * the FMU names what is wrong with it, or what is odd and right; none there, and nothing is.
 * mutants.py says which check catches which. */
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef BINARY_VERSION
#ifdef FMI3
#define BINARY_VERSION "3.0"
#else
#define BINARY_VERSION "2.0"
#endif
#endif
#ifndef TYPES_PLATFORM
#define TYPES_PLATFORM "default"
#endif

#ifndef _WIN32
#include "hostile.h"
#else
static void misbehave(const char *how) { (void)how; }
#endif

#define EXPORT __attribute__((visibility("default")))
enum { OK, WARNING, DISCARD, ERROR };
enum { TIME, U, K, X, Y, DER_X, Z, COUNT };
enum { LABEL = 7 };

typedef void Update(void *, double, _Bool, _Bool, _Bool, _Bool, _Bool *, double *);
typedef void Log(void *, int, const char *, const char *);
typedef void LogWithName(void *, const char *, int, const char *, const char *, ...);

typedef struct {
    double value[COUNT];
    double slope_of_u;
    char label[16];
    char defect[32];
    _Bool logs, uses_events, may_return;
    Update *update;
    Log *log;                  /* of FMI 3.0 */
    LogWithName *log_of_named; /* of FMI 2.0 */
} Small;

static int steps_of_all; /* the defect "shared" */
static int instances;    /* the defect "second" */
static void *volatile lost;

static int has(const Small *small, const char *defect) {
    return strcmp(small->defect, defect) == 0;
}

static void start(Small *small) {
    small->value[TIME] = 0;
    small->slope_of_u = 0;
    strcpy(small->label, has(small, "text") ? "Set him!" : "Set me!");
    small->value[U] = 1;
    small->value[K] = has(small, "start") ? 3 : 2;
    if (!has(small, "reset"))
        small->value[X] = 0.5;
}

static void read_defect(Small *small, const char *folder) {
    char path[1024];
    size_t n = 0;
    if (strncmp(folder, "file://", 7) == 0)
        folder += 7;
    for (; *folder && n < 900; folder++) {
        unsigned code;
        if (*folder == '%' && sscanf(folder + 1, "%2x", &code) == 1)
            path[n++] = (char)code, folder += 2;
        else
            path[n++] = *folder;
    }
    strcpy(path + n, "/defect.txt");
    FILE *file = fopen(path, "r");
    if (file) {
        if (fscanf(file, "%31s", small->defect) != 1)
            small->defect[0] = 0;
        fclose(file);
    }
}

#ifdef NEW_GLIBC
#include <pthread.h>
static void *nothing(void *p) { return p; }
static void use_new_glibc(void) {
    pthread_t thread;
    if (pthread_create(&thread, NULL, nothing, NULL) == 0)
        pthread_join(thread, NULL);
}
#else
static void use_new_glibc(void) {}
#endif

static Small *make(const char *token, const char *folder) {
    Small *small = calloc(1, sizeof *small);
    read_defect(small, folder ? folder : "");
    use_new_glibc();
    if (has(small, "crash-at-start"))
        *(volatile int *)8 = 1;
    if (strcmp(token, "{small}") != 0 && !has(small, "token"))
        return free(small), NULL;
    _Bool once = has(small, "second") || has(small, "once-slope-error");
    if (has(small, "no-instance") || (once && instances))
        return free(small), NULL;
    if (has(small, "leak"))
        lost = memset(malloc(100000), 1, 100000);
    if (has(small, "small-leak"))
        lost = memset(malloc(500), 1, 500);
    small->value[X] = 0.5;
    start(small);
    instances++;
    return small;
}

static void dispose(Small *small) {
    if (has(small, "free"))
        *(volatile int *)8 = 1;
    instances--;
    free(small);
}

static void say(Small *small) {
    if (!small->logs)
        return;
    const char *category = has(small, "category")      ? "logNothing"
                           : has(small, "no-category") ? NULL
                                                       : "logEvents";
    const char *text = has(small, "latin-1") ? "zur\xfc"
                                               "ck"
                                             : "a step";
    if (small->log)
        small->log(NULL, OK, category, text);
    if (small->log_of_named)
        small->log_of_named(NULL, "small", OK, category, text);
}

static void compute(Small *small) {
    double *v = small->value;
    v[DER_X] = v[U] - v[X];
    v[Z] = v[X] - 10;
    if (has(small, "hidden"))
        v[DER_X] += 0.1 * v[K];
    if (has(small, "nonlinear"))
        v[DER_X] += 0.1 * v[U] * v[U];
    if (has(small, "bent"))
        v[DER_X] += 0.1 * v[X] * v[X];
    if (has(small, "deaf-rate"))
        v[DER_X] = -v[X];
    v[Y] = v[K] * v[X] + v[U] * v[U];
    if (has(small, "process"))
        v[Y] += 1e-13 * (getpid() % 1000);
    if (has(small, "shared"))
        v[Y] += 1e-9 * steps_of_all;
    if (has(small, "nan") && v[TIME] > 0.3)
        v[Y] = 0.0 / (v[K] - v[K]);
    if (has(small, "infinite") && v[TIME] > 0.3)
        v[Y] = 1.0 / (v[K] - v[K]);
    if (has(small, "high") && v[TIME] > 0.3)
        v[Y] = 1001;
    if (has(small, "low") && v[TIME] > 0.3)
        v[Y] = -1001;
}

/* Of the states, their derivatives or the event indicators of Model Exchange. */
static int fill(Small *small, double *values, int which, const char *defect) {
    compute(small);
    values[0] = small->value[which];
    if (has(small, defect))
        values[0] += 0.01;
    return OK;
}

static int fill_indicators(Small *small, double *values) {
    if (!has(small, "fewer-indicators"))
        fill(small, values, Z, "");
    if (has(small, "more-indicators"))
        values[1] = 1;
    return OK;
}

static int set_time(Small *small, double time) {
    if (!has(small, "standing-time"))
        small->value[TIME] = time;
    return OK;
}

static int set_states(Small *small, const double *x) {
    if (!has(small, "standing-state"))
        small->value[X] = *x;
    return OK;
}

static int begin(Small *small, const char *defect) {
    if (has(small, "strict") && small->value[U] != 1)
        return ERROR;
    return has(small, defect) ? ERROR : OK;
}

static int wants_to_end(Small *small) { return has(small, "ends") && small->value[TIME] > 0.6; }

static int output_slope(Small *small, size_t n, const int *order, double *values) {
    compute(small);
    for (size_t i = 0; i < n; i++)
        values[i] = order[i] == 1 ? small->value[K] * small->value[DER_X] : 0;
    if (has(small, "output-slope-zero"))
        memset(values, 0, n * sizeof *values);
    if (has(small, "output-slope-sign"))
        values[0] = -values[0];
    if (has(small, "output-slope-nan"))
        values[0] = 0.0 / (small->value[K] - small->value[K]);
    return has(small, "output-slope-error") ? ERROR : OK;
}

static int get(Small *small, const uint32_t *references, size_t count, double *values) {
    compute(small);
    for (size_t i = 0; i < count; i++) {
        if (references[i] >= COUNT)
            return ERROR;
        values[i] = small->value[references[i]];
    }
    return OK;
}

static int set(Small *small, const uint32_t *references, size_t count, const double *values) {
    for (size_t i = 0; i < count; i++) {
        if (references[i] >= Y)
            return ERROR;
        if (references[i] == U)
            small->slope_of_u = 0;
        small->value[references[i]] = values[i];
    }
    return OK;
}

static int step(Small *small, double time, double length) {
    compute(small);
    if (time > 0.3) {
        if (has(small, "crash"))
            *(volatile int *)8 = 1;
        if (has(small, "abort"))
            abort();
        if (has(small, "exit"))
            printf("no license\n"), fflush(stdout), exit(3);
        if (has(small, "error"))
            return ERROR;
        if (has(small, "stop"))
            raise(SIGSTOP);
        while (has(small, "hang"))
            usleep(1000);
        misbehave(small->defect);
    }
    if (has(small, "only-one-length") && (length < 0.049 || length > 0.051))
        return ERROR;
    if (has(small, "own-length"))
        length = 0.05;
    if (!has(small, "standing-state"))
        small->value[X] += length * (small->value[DER_X] + 0.5 * length * small->slope_of_u);
    if (!has(small, "standing-time"))
        small->value[TIME] = has(small, "late-time") ? time : time + length;
    steps_of_all++;
    say(small);
    return OK;
}

static int save(Small *small, void **state) {
    if (!*state)
        *state = malloc(sizeof *small);
    memcpy(*state, small, sizeof *small);
    return OK;
}

static int restore(Small *small, const Small *state) {
    double x = small->value[X];
    memcpy(small, state, sizeof *small);
    if (has(small, "state"))
        small->value[X] = x;
    return OK;
}

/* The defect "serialized": what is kept in the process, here in its environment, is of no use to
 * another. */
static int serialize(const Small *state, char *bytes) {
    Small copy = *state;
    if (has(state, "serialized")) {
        char text[32];
        snprintf(text, sizeof text, "%a", copy.value[X]);
        setenv("SMALL_FMU_X", text, 1);
        copy.value[X] = 0;
    }
    memcpy(bytes, &copy, sizeof copy);
    return OK;
}

static int deserialize(const char *bytes, void **state) {
    Small *small = malloc(sizeof *small);
    memcpy(small, bytes, sizeof *small);
    const char *kept = getenv("SMALL_FMU_X");
    if (has(small, "serialized"))
        small->value[X] = kept ? strtod(kept, NULL) : 0;
    *state = small;
    return OK;
}

static int slope(Small *small, uint32_t unknown, uint32_t known, double *value) {
    compute(small);
    *value = 0;
    if (unknown == Y && known == U)
        *value = 2 * small->value[U];
    if (unknown == Y && known == X)
        *value = small->value[K];
    if (unknown == DER_X && known == U && !has(small, "slope-of-rate"))
        *value = 1;
    if (unknown == DER_X && known == X)
        *value = -1;
    if (has(small, "slope-sign"))
        *value = -*value;
    if (has(small, "slope-error") || has(small, "once-slope-error"))
        return ERROR;
    if (has(small, "slope"))
        *value = 0; /* returns OK, does nothing */
    return OK;
}

#ifndef FMI3

EXPORT const char *fmi2GetTypesPlatform(void) { return TYPES_PLATFORM; }
EXPORT const char *fmi2GetVersion(void) { return BINARY_VERSION; }
EXPORT void *fmi2Instantiate(const char *name, int type, const char *token, const char *folder,
                             LogWithName **callbacks, int visible, int logs) {
    (void)name, (void)type, (void)visible;
    Small *small = make(token, folder);
    if (small)
        small->log_of_named = *callbacks, small->logs = logs != 0;
    return small;
}
EXPORT void fmi2FreeInstance(void *c) { dispose(c); }
EXPORT int fmi2SetupExperiment(void *c) { return begin(c, "setup"); }
EXPORT int fmi2EnterInitializationMode(void *c) { return begin(c, "enter"); }
EXPORT int fmi2ExitInitializationMode(void *c) { return begin(c, "leave"); }
EXPORT int fmi2Terminate(void *c) { return has(c, "terminate") ? ERROR : OK; }
EXPORT int fmi2Reset(void *c) { return start(c), has(c, "reset-error") ? ERROR : OK; }
EXPORT int fmi2SetDebugLogging(void *c, int on) {
    return ((Small *)c)->logs = on != 0, has(c, "logging") ? ERROR : OK;
}
EXPORT int fmi2GetString(void *c, const uint32_t *r, size_t n, const char **v) {
    return n != 1 || *r != LABEL ? ERROR : (*v = ((Small *)c)->label, OK);
}
EXPORT int fmi2SetString(void *c, const uint32_t *r, size_t n, const char *const *v) {
    return n != 1 || *r != LABEL ? ERROR : (strncpy(((Small *)c)->label, *v, 15), OK);
}
EXPORT int fmi2SetRealInputDerivatives(void *c, const uint32_t *r, size_t n, const int *order,
                                       const double *v) {
    if (n != 1 || *r != U || *order != 1 || has(c, "input-slope-error"))
        return ERROR;
    if (!has(c, "input-slope"))
        ((Small *)c)->slope_of_u = *v;
    return OK;
}
EXPORT int fmi2GetRealOutputDerivatives(void *c, const uint32_t *r, size_t n, const int *order,
                                        double *v) {
    return (void)r, output_slope(c, n, order, v);
}
EXPORT int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    return *value = kind == 3 && wants_to_end(c), OK;
}
EXPORT int fmi2GetReal(void *c, const uint32_t *r, size_t n, double *v) { return get(c, r, n, v); }
EXPORT int fmi2SetReal(void *c, const uint32_t *r, size_t n, const double *v) {
    return set(c, r, n, v);
}
EXPORT int fmi2GetFMUstate(void *c, void **s) { return save(c, s); }
EXPORT int fmi2SetFMUstate(void *c, void *s) { return restore(c, s); }
EXPORT int fmi2FreeFMUstate(void *c, void **s) { return (void)c, free(*s), *s = NULL, OK; }
EXPORT int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) {
    return (void)c, (void)s, *n = sizeof(Small), OK;
}
EXPORT int fmi2SerializeFMUstate(void *c, void *s, char *b, size_t n) {
    return (void)c, (void)n, serialize(s, b);
}
EXPORT int fmi2DeSerializeFMUstate(void *c, const char *b, size_t n, void **s) {
    return (void)c, (void)n, deserialize(b, s);
}
#ifndef LACKS_DIRECTIONAL_DERIVATIVE
EXPORT int fmi2GetDirectionalDerivative(void *c, const uint32_t *u, size_t m, const uint32_t *k,
                                        size_t n, const double *seed, double *v) {
    return (void)m, (void)n, (void)seed, slope(c, *u, *k, v);
}
#endif
EXPORT int fmi2DoStep(void *c, double time, double length) {
    int status = step(c, time, length);
    return status == OK && wants_to_end(c) ? DISCARD : status;
}
EXPORT int fmi2SetTime(void *c, double time) { return set_time(c, time); }
EXPORT int fmi2SetContinuousStates(void *c, const double *x, size_t n) {
    if (has(c, "crash") && ((Small *)c)->value[TIME] > 0.3)
        *(volatile int *)8 = 1;
    return (void)n, set_states(c, x);
}
EXPORT int fmi2GetContinuousStates(void *c, double *x, size_t n) {
    return (void)n, fill(c, x, X, "other-state");
}
EXPORT int fmi2GetDerivatives(void *c, double *dx, size_t n) {
    return (void)n, steps_of_all++, fill(c, dx, DER_X, "other-rate");
}
EXPORT int fmi2GetEventIndicators(void *c, double *z) { return fill_indicators(c, z); }
EXPORT int fmi2GetNominalsOfContinuousStates(void *c, double *x) {
    return *x = has(c, "nominal") ? 0 : 1, OK;
}
EXPORT int fmi2EnterEventMode(void) { return OK; }
EXPORT int fmi2EnterContinuousTimeMode(void) { return OK; }
EXPORT int fmi2NewDiscreteStates(void *c, void *info) {
    memset(info, 0, 32);
    *(int *)info = has(c, "endless");
    return OK;
}
EXPORT int fmi2CompletedIntegratorStep(void *c, int no, int *event, int *end) {
    return (void)no, *event = 0, *end = wants_to_end(c), OK;
}
#define NOT_HERE(name)                                                                             \
    EXPORT int name(void) { return ERROR; }
NOT_HERE(fmi2GetInteger)
NOT_HERE(fmi2GetBoolean)
NOT_HERE(fmi2SetInteger)
NOT_HERE(fmi2SetBoolean)
NOT_HERE(fmi2CancelStep)
NOT_HERE(fmi2GetStatus)
NOT_HERE(fmi2GetRealStatus)
NOT_HERE(fmi2GetIntegerStatus)
NOT_HERE(fmi2GetStringStatus)

#else

typedef _Bool Bool;
EXPORT const char *fmi3GetVersion(void) { return BINARY_VERSION; }
EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder,
                                         Bool visible, Bool logs, Bool uses_events, Bool may_return,
                                         const uint32_t *required, size_t n, void *environment,
                                         Log *log, Update *update) {
    (void)name, (void)visible, (void)required, (void)n, (void)environment;
    Small *small = make(token, folder);
    if (small && has(small, "clocks") && !uses_events)
        return dispose(small), NULL;
    if (small) {
        small->log = log, small->logs = logs, small->update = update;
        small->uses_events = uses_events, small->may_return = may_return;
    }
    return small;
}
EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *folder,
                                          Bool visible, Bool logs, void *environment, Log *log) {
    (void)name, (void)visible, (void)environment;
    Small *small = make(token, folder);
    if (small)
        small->log = log, small->logs = logs;
    return small;
}
EXPORT void fmi3FreeInstance(void *c) { dispose(c); }
EXPORT int fmi3EnterInitializationMode(void *c) { return begin(c, "enter"); }
EXPORT int fmi3ExitInitializationMode(void *c) { return begin(c, "leave"); }
EXPORT int fmi3Terminate(void *c) { return has(c, "terminate") ? ERROR : OK; }
EXPORT int fmi3Reset(void *c) { return start(c), has(c, "reset-error") ? ERROR : OK; }
EXPORT int fmi3SetDebugLogging(void *c, Bool on) {
    return ((Small *)c)->logs = on, has(c, "logging") ? ERROR : OK;
}
EXPORT int fmi3GetString(void *c, const uint32_t *r, size_t n, const char **v) {
    return n != 1 || *r != LABEL ? ERROR : (*v = ((Small *)c)->label, OK);
}
EXPORT int fmi3SetString(void *c, const uint32_t *r, size_t n, const char *const *v) {
    return n != 1 || *r != LABEL ? ERROR : (strncpy(((Small *)c)->label, *v, 15), OK);
}
EXPORT int fmi3GetOutputDerivatives(void *c, const uint32_t *r, size_t n, const int *order,
                                    double *v) {
    return (void)r, output_slope(c, n, order, v);
}
EXPORT int fmi3GetAdjointDerivative(void *c, const uint32_t *u, size_t m, const uint32_t *k,
                                    size_t n, const double *seed, size_t l, double *v) {
    (void)m, (void)n, (void)l;
    int status = slope(c, *u, *k, v);
    *v *= has(c, "adjoint") ? -*seed : *seed;
    return has(c, "adjoint-error") ? ERROR : status;
}
EXPORT int fmi3GetNumberOfContinuousStates(void *c, size_t *n) {
    return *n = has(c, "count-of-states") ? 2 : 1, OK;
}
EXPORT int fmi3GetNumberOfEventIndicators(void *c, size_t *n) {
    return *n = has(c, "count-of-indicators") ? 0 : 1, OK;
}
EXPORT int fmi3GetEventIndicators(void *c, double *z, size_t n) {
    return (void)n, fill_indicators(c, z);
}
EXPORT int fmi3GetNominalsOfContinuousStates(void *c, double *x, size_t n) {
    return (void)n, *x = has(c, "nominal") ? 0 : 1, OK;
}
EXPORT int fmi3EnterStepMode(void *c) { return has(c, "step-mode") ? ERROR : OK; }
EXPORT int fmi3GetFloat64(void *c, const uint32_t *r, size_t n, double *v) {
    return get(c, r, n, v);
}
EXPORT int fmi3SetFloat64(void *c, const uint32_t *r, size_t n, const double *v) {
    return set(c, r, n, v);
}
EXPORT int fmi3GetFMUState(void *c, void **s) { return save(c, s); }
EXPORT int fmi3SetFMUState(void *c, void *s) { return restore(c, s); }
EXPORT int fmi3FreeFMUState(void *c, void **s) { return (void)c, free(*s), *s = NULL, OK; }
EXPORT int fmi3SerializedFMUStateSize(void *c, void *s, size_t *n) {
    return (void)c, (void)s, *n = sizeof(Small), OK;
}
EXPORT int fmi3SerializeFMUState(void *c, void *s, char *b, size_t n) {
    return (void)c, (void)n, serialize(s, b);
}
EXPORT int fmi3DeserializeFMUState(void *c, const char *b, size_t n, void **s) {
    return (void)c, (void)n, deserialize(b, s);
}
EXPORT int fmi3GetDirectionalDerivative(void *c, const uint32_t *u, size_t m, const uint32_t *k,
                                        size_t n, const double *seed, size_t l, double *v) {
    return (void)m, (void)n, (void)l, (void)seed, slope(c, *u, *k, v);
}
EXPORT int fmi3DoStep(void *c, double time, double length, Bool no, Bool *event, Bool *end,
                      Bool *early, double *last) {
    Small *small = c;
    Bool wants = 0;
    double until = time + length;
    (void)no, *event = *end = *early = 0;
    if (small->update && !has(small, "no-update")) {
        double now = has(small, "early-update") ? time - 1 : time;
        small->update(NULL, now, 0, !has(small, "unreadable"), 0, small->may_return, &wants,
                      &until);
        if (wants && until < time + length && !has(small, "no-return"))
            *early = 1, length = until - time;
    }
    if (has(small, "early") && length > 0.03) /* an event of its own half way */
        *early = 1, length /= 2;
    if (has(small, "early-for-ever"))
        return *early = 1, *last = time, OK;
    if (has(small, "lags")) /* own steps of 0.03 s */
        length = (double)(int)((time + length) / 0.03 + 1e-6) * 0.03 - time;
    int status = step(small, time, length);
    *last = has(small, "standing-end") ? time : time + length;
    *end = wants_to_end(small);
    return status;
}
EXPORT int fmi3SetTime(void *c, double time) { return set_time(c, time); }
EXPORT int fmi3SetContinuousStates(void *c, const double *x, size_t n) {
    if (has(c, "crash") && ((Small *)c)->value[TIME] > 0.3)
        *(volatile int *)8 = 1;
    return (void)n, set_states(c, x);
}
EXPORT int fmi3GetContinuousStates(void *c, double *x, size_t n) {
    return (void)n, fill(c, x, X, "other-state");
}
EXPORT int fmi3GetContinuousStateDerivatives(void *c, double *dx, size_t n) {
    return (void)n, steps_of_all++, fill(c, dx, DER_X, "other-rate");
}
EXPORT int fmi3EnterEventMode(void *c) { return has(c, "event-mode") ? ERROR : OK; }
EXPORT int fmi3EnterContinuousTimeMode(void) { return OK; }
EXPORT int fmi3UpdateDiscreteStates(void *c, Bool *again, Bool *end, Bool *nominals, Bool *values,
                                    Bool *next, double *t) {
    *again = *end = *nominals = *values = *next = 0, *t = 0;
    return *again = has(c, "endless"), OK;
}
EXPORT int fmi3CompletedIntegratorStep(void *c, Bool no, Bool *event, Bool *end) {
    return (void)no, *event = 0, *end = wants_to_end(c), OK;
}
#define NOT_HERE(name)                                                                             \
    EXPORT int name(void) { return ERROR; }
#include "not_here.h" /* the others, by the test */

#endif

#ifdef FOREIGN_SYMBOL
EXPORT double helper(double x) { return 2 * x; }
#endif
