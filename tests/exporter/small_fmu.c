/* A small FMU to break: x' = u - x, y = k x + u^2, for FMI 2.0 or, with -DFMI3, 3.0; co-simulation
 * and Model Exchange. The file resources/defect.txt in the FMU names what is wrong with it; none
 * there, and nothing is. */
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))
enum { OK, WARNING, DISCARD, ERROR };
enum { TIME, U, K, X, Y, DER_X, COUNT };

typedef struct {
    double value[COUNT];
    char defect[32];
} Small;

static int steps_of_all; /* the defect "shared" */

static int has(const Small *small, const char *defect) {
    return strcmp(small->defect, defect) == 0;
}

static void start(Small *small) {
    small->value[TIME] = 0;
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
    small->value[X] = 0.5;
    start(small);
    return small;
}

static void compute(Small *small) {
    double *v = small->value;
    v[DER_X] = v[U] - v[X];
    v[Y] = v[K] * v[X] + v[U] * v[U];
    if (has(small, "process"))
        v[Y] += 1e-13 * (getpid() % 1000);
    if (has(small, "shared"))
        v[Y] += 1e-9 * steps_of_all;
    if (has(small, "nan") && v[TIME] > 0.3)
        v[Y] = 0.0 / (v[K] - v[K]);
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
    }
    small->value[X] += length * small->value[DER_X];
    small->value[TIME] = time + length;
    steps_of_all++;
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
    if (has(small, "slope"))
        *value = 0; /* returns OK, does nothing */
    return OK;
}

#ifndef FMI3

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT void *fmi2Instantiate(const char *name, int type, const char *token, const char *folder) {
    return (void)name, (void)type, make(token, folder);
}
EXPORT void fmi2FreeInstance(void *c) { free(c); }
EXPORT int fmi2SetupExperiment(void *c) { return c ? OK : ERROR; }
EXPORT int fmi2EnterInitializationMode(void *c) { return c ? OK : ERROR; }
EXPORT int fmi2ExitInitializationMode(void *c) { return c ? OK : ERROR; }
EXPORT int fmi2Terminate(void *c) { return c ? OK : ERROR; }
EXPORT int fmi2Reset(void *c) { return start(c), OK; }
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
EXPORT int fmi2DoStep(void *c, double time, double length) { return step(c, time, length); }
EXPORT int fmi2SetTime(void *c, double time) { return ((Small *)c)->value[TIME] = time, OK; }
EXPORT int fmi2SetContinuousStates(void *c, const double *x, size_t n) {
    if (has(c, "crash") && ((Small *)c)->value[TIME] > 0.3)
        *(volatile int *)8 = 1;
    return (void)n, ((Small *)c)->value[X] = *x, OK;
}
EXPORT int fmi2GetContinuousStates(void *c, double *x, size_t n) {
    return (void)n, *x = ((Small *)c)->value[X], OK;
}
EXPORT int fmi2GetDerivatives(void *c, double *dx, size_t n) {
    return (void)n, compute(c), steps_of_all++, *dx = ((Small *)c)->value[DER_X], OK;
}
EXPORT int fmi2GetEventIndicators(void) { return OK; }
EXPORT int fmi2GetNominalsOfContinuousStates(void *c, double *x) { return (void)c, *x = 1, OK; }
EXPORT int fmi2EnterEventMode(void) { return OK; }
EXPORT int fmi2EnterContinuousTimeMode(void) { return OK; }
EXPORT int fmi2NewDiscreteStates(void *c, void *info) { return (void)c, memset(info, 0, 32), OK; }
EXPORT int fmi2CompletedIntegratorStep(void *c, int no, int *event, int *end) {
    return (void)c, (void)no, *event = 0, *end = 0, OK;
}
#define NOT_HERE(name)                                                                             \
    EXPORT int name(void) { return ERROR; }
NOT_HERE(fmi2SetDebugLogging)
NOT_HERE(fmi2GetInteger)
NOT_HERE(fmi2GetBoolean)
NOT_HERE(fmi2GetString) NOT_HERE(fmi2SetInteger) NOT_HERE(fmi2SetBoolean) NOT_HERE(fmi2SetString)
    NOT_HERE(fmi2SetRealInputDerivatives) NOT_HERE(fmi2GetRealOutputDerivatives)
        NOT_HERE(fmi2CancelStep) NOT_HERE(fmi2GetStatus) NOT_HERE(fmi2GetRealStatus)
            NOT_HERE(fmi2GetIntegerStatus) NOT_HERE(fmi2GetBooleanStatus)
                NOT_HERE(fmi2GetStringStatus)

#else

typedef _Bool Bool;
EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder) {
    return (void)name, make(token, folder);
}
EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *folder) {
    return (void)name, make(token, folder);
}
EXPORT void fmi3FreeInstance(void *c) { free(c); }
EXPORT int fmi3EnterInitializationMode(void *c) { return c ? OK : ERROR; }
EXPORT int fmi3ExitInitializationMode(void *c) { return c ? OK : ERROR; }
EXPORT int fmi3Terminate(void *c) { return c ? OK : ERROR; }
EXPORT int fmi3Reset(void *c) { return start(c), OK; }
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
    return (void)no, *event = *end = *early = 0, *last = time + length, step(c, time, length);
}
EXPORT int fmi3SetTime(void *c, double time) { return ((Small *)c)->value[TIME] = time, OK; }
EXPORT int fmi3SetContinuousStates(void *c, const double *x, size_t n) {
    if (has(c, "crash") && ((Small *)c)->value[TIME] > 0.3)
        *(volatile int *)8 = 1;
    return (void)n, ((Small *)c)->value[X] = *x, OK;
}
EXPORT int fmi3GetContinuousStates(void *c, double *x, size_t n) {
    return (void)n, *x = ((Small *)c)->value[X], OK;
}
EXPORT int fmi3GetContinuousStateDerivatives(void *c, double *dx, size_t n) {
    return (void)n, compute(c), steps_of_all++, *dx = ((Small *)c)->value[DER_X], OK;
}
EXPORT int fmi3EnterEventMode(void) { return OK; }
EXPORT int fmi3EnterContinuousTimeMode(void) { return OK; }
EXPORT int fmi3UpdateDiscreteStates(void *c, Bool *again, Bool *end, Bool *nominals, Bool *values,
                                    Bool *next, double *t) {
    return (void)c, *again = *end = *nominals = *values = *next = 0, *t = 0, OK;
}
EXPORT int fmi3CompletedIntegratorStep(void *c, Bool no, Bool *event, Bool *end) {
    return (void)c, (void)no, *event = *end = 0, OK;
}
#define NOT_HERE(name)                                                                             \
    EXPORT int name(void) { return ERROR; }
#include "not_here.h" /* the others, by the test */

#endif

#ifdef FOREIGN_SYMBOL
                    EXPORT double helper(double x) {
    return 2 * x;
}
#endif
