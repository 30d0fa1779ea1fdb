/* Any sequence of FMI calls, legal or not: a fuzzer over the whole FMI 2.0 interface, linked with
 * the component itself so that sanitizers see into it.
 *
 *   fuzz SEED CALLS THREADS
 *
 * Each thread has instances of its own and makes CALLS random calls, with random and absurd
 * arguments. After each call it checks what the standard and the component promise:
 *   - the status is one that the call can return, and Error where the call is not legal now;
 *   - a call that is not OK leaves the state as it was, to the last byte (but for the mode of a
 *     discarded step);
 *   - outputs that were read are finite.
 * Prints how often each status came, exits with 1 at the first broken promise. */
#define _POSIX_C_SOURCE 200809L
#include "component/component.h"

#include "fmi2Functions.h"

#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INSTANCES = 3, SNAPSHOTS = 4, MOST_VALUES = 6, MOST_THREADS = 64, STATUSES = 5 };

/* ---- chance ------------------------------------------------------------------------------ */

typedef struct {
    uint64_t state;
} Chance;

/* Marsaglia's xorshift. */
static uint64_t draw(Chance *chance) {
    uint64_t x = chance->state;
    x ^= x << 13;
    x ^= x >> 7;
    x ^= x << 17;
    return chance->state = x;
}

static uint32_t below(Chance *chance, uint32_t limit) {
    return (uint32_t)((draw(chance) >> 16) % limit);
}

static double unit(Chance *chance) { return (double)(draw(chance) >> 11) * 0x1p-53; }

static double any_double(Chance *chance) {
    static const double odd[] = {0.0, -0.0, 1.0,   -1.0,  1e-320, 1e-9,
                                 1e6, 1e9,  1e154, 1e300, -1e308};
    uint64_t bits;
    double value;
    switch (below(chance, 8)) {
    case 0: return odd[below(chance, sizeof odd / sizeof odd[0])];
    case 1:
        bits = draw(chance);
        memcpy(&value, &bits, sizeof value);
        return value;
    case 2: return below(chance, 2) ? (double)NAN : (double)INFINITY;
    case 3: return 1e4 * (unit(chance) - 0.5);
    default: return 7.0 * (unit(chance) - 0.5);
    }
}

/* ---- what is fuzzed ------------------------------------------------------------------------ */

typedef struct {
    fmi2Component component;
    double time;
    bool expects_time; /* time is what the component counts from */
} Subject;

typedef struct {
    Chance chance;
    long calls;
    Subject subjects[INSTANCES];
    fmi2FMUstate snapshots[SNAPSHOTS]; /* of any instance */
    long counts[STATUSES];
    const char *broken; /* the promise that did not hold */
    const char *function;
} Fuzzer;

static void promise(Fuzzer *fuzzer, bool holds, const char *what) {
    if (!holds && fuzzer->broken == NULL)
        fuzzer->broken = what;
}

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    Fuzzer *fuzzer = environment;
    char text[512];
    va_list arguments;
    va_start(arguments, message);
    int length = vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
    promise(fuzzer, name != NULL && category != NULL && length > 0, "a message without words");
    promise(fuzzer, status != fmi2Fatal, "a fatal message");
}

static void create(Fuzzer *fuzzer, Subject *subject) {
    /* the component keeps what it needs of the callbacks: they live no longer than this call */
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, fuzzer};
    subject->component =
        fmi2Instantiate("fuzzed", fmi2CoSimulation, INTERFACE_TOKEN, NULL, &callbacks, fmi2False,
                        below(&fuzzer->chance, 2) ? fmi2True : fmi2False);
    subject->time = 0.0;
    promise(fuzzer, subject->component != NULL, "no instance");
}

static void state_of(const Subject *subject, ComponentState *state) {
    component_save((Component *)subject->component, state);
}

static ComponentMode mode_of(const Subject *subject) {
    return (ComponentMode)((Component *)subject->component)->settings.mode;
}

enum {
    INSTANTIATED = 1 << MODE_INSTANTIATED,
    INITIALIZATION = 1 << MODE_INITIALIZATION,
    STEP = 1 << MODE_STEP,
    REFUSED = 1 << MODE_STEP_REFUSED,
    TERMINATED = 1 << MODE_TERMINATED,
    ANY = INSTANTIATED | INITIALIZATION | STEP | REFUSED | TERMINATED
};

/* One random call; *legal_in: the modes in which it is legal. */
static fmi2Status call(Fuzzer *fuzzer, Subject *subject, int *legal_in) {
    Chance *chance = &fuzzer->chance;
    fmi2Component c = subject->component;
    uint32_t references[MOST_VALUES], others[MOST_VALUES];
    double values[MOST_VALUES], more[MOST_VALUES];
    int32_t integers[MOST_VALUES];
    const char *strings[MOST_VALUES] = {NULL};
    size_t count = below(chance, MOST_VALUES), other_count = below(chance, MOST_VALUES);
    bool is_tame = below(chance, 4) > 0; /* sequences that get somewhere, most of the time */
    for (int i = 0; i < MOST_VALUES; ++i) {
        references[i] =
            is_tame ? 2 + below(chance, INTERFACE_INPUT_COUNT) : below(chance, INTERFACE_COUNT + 4);
        others[i] = is_tame ? 8 + below(chance, 16) : (uint32_t)draw(chance);
        values[i] = is_tame ? 2.0 * (unit(chance) - 0.5) : any_double(chance);
        more[i] = any_double(chance);
        integers[i] = is_tame ? 1 + (int32_t)below(chance, 2) : (int32_t)draw(chance);
    }
    const uint32_t *vr = below(chance, 50) ? references : NULL;
    fmi2FMUstate *slot = &fuzzer->snapshots[below(chance, SNAPSHOTS)];
    double step;
    fmi2Status status;
    *legal_in = ANY;

    switch (below(chance, 40)) {
    case 0:
        fuzzer->function = "fmi2SetupExperiment";
        *legal_in = INSTANTIATED;
        return fmi2SetupExperiment(c, fmi2True, values[0], is_tame ? 0.0 : more[1], fmi2False,
                                   more[2]);
    case 1:
    case 2:
        fuzzer->function = "fmi2EnterInitializationMode";
        *legal_in = INSTANTIATED;
        return fmi2EnterInitializationMode(c);
    case 3:
    case 4:
        fuzzer->function = "fmi2ExitInitializationMode";
        *legal_in = INITIALIZATION;
        return fmi2ExitInitializationMode(c);
    case 5:
        if (below(chance, 20))
            goto do_step;
        fuzzer->function = "fmi2Terminate";
        *legal_in = STEP | REFUSED;
        return fmi2Terminate(c);
    case 6:
        if (below(chance, 10))
            goto do_step;
        fuzzer->function = "fmi2Reset";
        return fmi2Reset(c);
    case 7:
    case 8:
    case 9:
    case 10:
        fuzzer->function = "fmi2SetReal";
        *legal_in = ANY & ~TERMINATED;
        return fmi2SetReal(c, vr, count, values);
    case 11:
        fuzzer->function = "fmi2SetBoolean";
        *legal_in = ANY & ~TERMINATED;
        references[0] = below(chance, 3) ? VARIABLE_CRANK_AT_STEP_END : references[0];
        return fmi2SetBoolean(c, vr, below(chance, 2), integers);
    case 12:
        fuzzer->function = "fmi2GetBoolean";
        *legal_in = ANY & ~INSTANTIATED;
        references[0] = below(chance, 3) ? VARIABLE_CRANK_AT_STEP_END : references[0];
        return fmi2GetBoolean(c, vr, below(chance, 2), integers);
    case 13:
    case 14:
    case 15:
    case 16:
        fuzzer->function = "fmi2GetReal";
        *legal_in = ANY & ~INSTANTIATED;
        status = fmi2GetReal(c, others, other_count, values);
        if (status == fmi2OK && is_tame)
            for (size_t i = 0; i < other_count; ++i)
                promise(fuzzer, !isnan(values[i]), "an output that is no number");
        return status;
    case 17:
        fuzzer->function = "fmi2GetInteger";
        *legal_in = ANY & ~INSTANTIATED;
        return fmi2GetInteger(c, vr, below(chance, 2), integers);
    case 18:
        fuzzer->function = "fmi2SetString";
        *legal_in = ANY & ~TERMINATED;
        return fmi2SetString(c, vr, below(chance, 2), strings);
    case 19:
    case 20:
        fuzzer->function = "fmi2SetRealInputDerivatives";
        *legal_in = ANY & ~TERMINATED;
        return fmi2SetRealInputDerivatives(c, vr, count, integers, values);
    case 21:
    case 22:
        fuzzer->function = "fmi2GetRealOutputDerivatives";
        *legal_in = ANY & ~INSTANTIATED & ~INITIALIZATION;
        return fmi2GetRealOutputDerivatives(c, others, other_count, integers, values);
    case 23:
    case 24:
        fuzzer->function = "fmi2GetDirectionalDerivative";
        *legal_in = ANY & ~INSTANTIATED;
        return fmi2GetDirectionalDerivative(c, others, other_count, vr, count, more, values);
    case 25:
    case 26:
        fuzzer->function = "fmi2GetFMUstate";
        return fmi2GetFMUstate(c, below(chance, 20) ? slot : NULL);
    case 27:
        if (below(chance, 3))
            goto do_step;
        fuzzer->function = "fmi2SetFMUstate";
        return fmi2SetFMUstate(c, *slot);
    case 28: fuzzer->function = "fmi2FreeFMUstate"; return fmi2FreeFMUstate(c, slot);
    case 29:
    case 30: {
        fuzzer->function = "fmi2DeSerializeFMUstate";
        size_t size = 0;
        if (*slot == NULL || fmi2SerializedFMUstateSize(c, *slot, &size) != fmi2OK)
            return fmi2OK;
        char *bytes = malloc(size);
        if (fmi2SerializeFMUstate(c, *slot, bytes, size) != fmi2OK)
            promise(fuzzer, false, "a state that cannot be serialized");
        if (below(chance, 2)) /* damaged */
            bytes[below(chance, (uint32_t)size)] ^= (char)(1 << below(chance, 8));
        fmi2FMUstate read = NULL;
        status = fmi2DeSerializeFMUstate(c, bytes,
                                         below(chance, 5) ? size : below(chance, (uint32_t)size),
                                         below(chance, 20) ? &read : NULL);
        promise(fuzzer, (status == fmi2OK) == (read != NULL),
                "a state from damaged bytes, or none");
        if (status == fmi2OK)
            promise(fuzzer, memcmp(read, *slot, sizeof(ComponentState)) == 0,
                    "a state that changed");
        fmi2FreeFMUstate(c, &read);
        free(bytes);
        return status;
    }
    case 31:
        fuzzer->function = "fmi2GetRealStatus";
        *legal_in = STEP | REFUSED | TERMINATED;
        return fmi2GetRealStatus(c, (fmi2StatusKind)below(chance, 5),
                                 below(chance, 5) ? values : NULL);
    case 32:
        fuzzer->function = "fmi2SetDebugLogging";
        strings[0] = below(chance, 2) ? "logAll" : NULL;
        return fmi2SetDebugLogging(c, fmi2True, below(chance, 2),
                                   below(chance, 5) ? strings : NULL);
    case 33:
        if (below(chance, 50))
            goto do_step;
        fuzzer->function = "fmi2FreeInstance";
        fmi2FreeInstance(c);
        create(fuzzer, subject);
        return fmi2OK;
    default:
    do_step:
        fuzzer->function = "fmi2DoStep";
        *legal_in = STEP | REFUSED;
        step = is_tame ? 0.02 * unit(chance) : more[3];
        return fmi2DoStep(c, is_tame ? ((Component *)c)->settings.real[VARIABLE_TIME] : more[4],
                          step, fmi2True);
    }
}

/* ---- one thread ------------------------------------------------------------------------------ */

static void *fuzz(void *argument) {
    Fuzzer *fuzzer = argument;
    for (int i = 0; i < INSTANCES; ++i)
        create(fuzzer, &fuzzer->subjects[i]);
    for (long k = 0; k < fuzzer->calls && fuzzer->broken == NULL; ++k) {
        Subject *subject = &fuzzer->subjects[below(&fuzzer->chance, INSTANCES)];
        ComponentState before, after;
        state_of(subject, &before);
        int mode = 1 << mode_of(subject), legal_in;
        fmi2Status status = call(fuzzer, subject, &legal_in);
        promise(fuzzer, status == fmi2OK || status == fmi2Discard || status == fmi2Error,
                "a status that no call returns");
        if (fuzzer->broken != NULL)
            break;
        fuzzer->counts[status] += 1;
        promise(fuzzer, status == fmi2Error || (legal_in & mode),
                "an illegal call that was not refused");
        if (status != fmi2OK) {
            state_of(subject, &after);
            if (after.settings.mode == MODE_STEP_REFUSED)
                after.settings.mode = before.settings.mode;
            promise(fuzzer, memcmp(&before, &after, sizeof before) == 0,
                    "a refused call that left a trace");
        }
    }
    for (int i = 0; i < SNAPSHOTS; ++i)
        fmi2FreeFMUstate(fuzzer->subjects[0].component, &fuzzer->snapshots[i]);
    for (int i = 0; i < INSTANCES; ++i)
        fmi2FreeInstance(fuzzer->subjects[i].component);
    return NULL;
}

int main(int count, char **arguments) {
    static Fuzzer fuzzers[MOST_THREADS];
    pthread_t threads[MOST_THREADS];
    if (count != 4) {
        fputs("usage: fuzz SEED CALLS THREADS\n", stderr);
        return 2;
    }
    int number = atoi(arguments[3]);
    if (number < 1 || number > MOST_THREADS)
        return 2;
    for (int i = 0; i < number; ++i) {
        fuzzers[i].chance.state = strtoull(arguments[1], NULL, 10) * 2654435761U
                                  + 88172645463325252U + (uint64_t)i * 362436069U;
        fuzzers[i].calls = atol(arguments[2]);
        if (pthread_create(&threads[i], NULL, fuzz, &fuzzers[i]) != 0)
            return 2;
    }
    long counts[STATUSES] = {0};
    int broken = 0;
    for (int i = 0; i < number; ++i) {
        pthread_join(threads[i], NULL);
        for (int s = 0; s < STATUSES; ++s)
            counts[s] += fuzzers[i].counts[s];
        if (fuzzers[i].broken != NULL) {
            printf("%s: %s\n", fuzzers[i].function, fuzzers[i].broken);
            broken = 1;
        }
    }
    printf("OK %ld, Discard %ld, Error %ld\n", counts[fmi2OK], counts[fmi2Discard],
           counts[fmi2Error]);
    return broken;
}
