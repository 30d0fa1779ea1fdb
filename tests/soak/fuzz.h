/* Any sequence of FMI calls, legal or not: the fuzzer of one FMI version, linked with the component
 * itself so that sanitizers see into it. fuzz.c (FMI 2.0) and fuzz3.c (FMI 3.0) make the calls.
 *
 *   fuzz SEED CALLS THREADS
 *
 * Each thread has instances of its own, of both interface types, and makes CALLS random calls, with
 * random and absurd arguments. After each call it checks what the standard and the component
 * promise:
 *   - the status is one that the call can return, and Error where the call is not legal now;
 *   - a call that is not OK leaves the state as it was, to the last byte (but for the mode of a
 *     discarded step);
 *   - outputs that were read are finite.
 * Prints how often each status came, exits with 1 at the first broken promise.
 *
 * A fuzzer includes this file after it has defined FMI(name), the name with the version's prefix.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include "component/component.h"

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
    Chance chance;
    long calls;
    void *subjects[INSTANCES];
    void *current; /* the one that is called */
    void *snapshots[SNAPSHOTS]; /* states of any instance */
    long counts[STATUSES];
    const char *broken; /* the promise that did not hold */
    const char *function;
} Fuzzer;

static void promise(Fuzzer *fuzzer, bool holds, const char *what) {
    if (!holds && fuzzer->broken == NULL)
        fuzzer->broken = what;
}

/* Modes of the one interface type, then of the other. */
#define MODE_BIT(mode, kind) (1U << ((mode) + 16 * (kind)))
#define BOTH(mode) (MODE_BIT(mode, KIND_CO_SIMULATION) | MODE_BIT(mode, KIND_MODEL_EXCHANGE))
enum {
    INSTANTIATED = BOTH(MODE_INSTANTIATED),
    INITIALIZATION = BOTH(MODE_INITIALIZATION),
    EVENT = BOTH(MODE_EVENT),
    CONTINUOUS = MODE_BIT(MODE_CONTINUOUS_TIME, KIND_MODEL_EXCHANGE),
    STEP = MODE_BIT(MODE_STEP, KIND_CO_SIMULATION)
        | MODE_BIT(MODE_STEP_REFUSED, KIND_CO_SIMULATION),
    TERMINATED = BOTH(MODE_TERMINATED),
    ANY = INSTANTIATED | INITIALIZATION | EVENT | CONTINUOUS | STEP | TERMINATED,
    CO_SIMULATION = 0xffff,
    MODEL_EXCHANGE = 0x7fff0000
};

static uint32_t place_of(void *subject) {
    const ComponentSettings *settings = &((Component *)subject)->settings;
    return MODE_BIT(settings->mode, settings->kind);
}

/* What a call is given: of the kind that gets somewhere, or absurd. */
typedef struct {
    bool is_tame;
    size_t count, other_count;
    uint32_t references[MOST_VALUES], others[MOST_VALUES];
    const uint32_t *vr; /* the references, or NULL */
    double values[MOST_VALUES], more[MOST_VALUES];
    int32_t integers[MOST_VALUES];
} Arguments;

static void any_arguments(Chance *chance, Arguments *a) {
    a->count = below(chance, MOST_VALUES);
    a->other_count = below(chance, MOST_VALUES);
    a->is_tame = below(chance, 4) > 0;
    a->vr = below(chance, 50) ? a->references : NULL;
    uint32_t parameters = below(chance, 4) == 0 ? VARIABLE_GEOMETRY_L1 : 0; /* set, or as knowns */
    for (int i = 0; i < MOST_VALUES; ++i) {
        a->references[i] = a->is_tame ? 2 + below(chance, INTERFACE_INPUT_COUNT)
                                      : below(chance, INTERFACE_COUNT + 4);
        if (a->is_tame && parameters)
            a->references[i] = parameters + below(chance, 18);
        a->others[i] = a->is_tame ? VARIABLE_TIP_X + below(chance, 16) : (uint32_t)draw(chance);
        a->values[i] = a->is_tame ? 2.0 * (unit(chance) - 0.5) : any_double(chance);
        if (a->is_tame && parameters) /* lengths with which the linkage may close */
            a->values[i] =
                interface_variables[a->references[i]].start * (1.0 + 0.2 * (unit(chance) - 0.5));
        a->more[i] = any_double(chance);
        a->integers[i] = a->is_tame ? 1 + (int32_t)below(chance, 2) : (int32_t)draw(chance);
    }
}

/* In each version: a new instance of a random type, or NULL; one random call, *legal_in saying
 * where it is legal; the end of an instance and of a state. */
static void *create(Fuzzer *fuzzer);
static FMI(Status) call(Fuzzer *fuzzer, void **subject, uint32_t *legal_in);
static void release(void *subject);
static void release_state(void *subject, void **state);

/* ---- one thread ------------------------------------------------------------------------------ */

static void *fuzz(void *argument) {
    Fuzzer *fuzzer = argument;
    for (int i = 0; i < INSTANCES; ++i)
        fuzzer->subjects[i] = create(fuzzer);
    for (long k = 0; k < fuzzer->calls && fuzzer->broken == NULL; ++k) {
        void **subject = &fuzzer->subjects[below(&fuzzer->chance, INSTANCES)];
        ComponentState before, after;
        component_save(*subject, &before);
        fuzzer->current = *subject;
        uint32_t place = place_of(*subject), legal_in;
        FMI(Status) status = call(fuzzer, subject, &legal_in);
        promise(fuzzer, status == FMI(OK) || status == FMI(Discard) || status == FMI(Error),
                "a status that no call returns");
        if (fuzzer->broken != NULL)
            break;
        fuzzer->counts[status] += 1;
        promise(fuzzer, status == FMI(Error) || (legal_in & place),
                "an illegal call that was not refused");
        if (status != FMI(OK)) {
            component_save(*subject, &after);
            if (after.settings.mode == MODE_STEP_REFUSED)
                after.settings.mode = before.settings.mode;
            promise(fuzzer, memcmp(&before, &after, sizeof before) == 0,
                    "a refused call that left a trace");
        }
    }
    for (int i = 0; i < SNAPSHOTS; ++i)
        release_state(fuzzer->subjects[0], &fuzzer->snapshots[i]);
    for (int i = 0; i < INSTANCES; ++i)
        release(fuzzer->subjects[i]);
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
    printf("OK %ld, Discard %ld, Error %ld\n", counts[FMI(OK)], counts[FMI(Discard)],
           counts[FMI(Error)]);
    return broken;
}

#endif
