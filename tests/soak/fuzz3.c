/* The fuzzer of FMI 3.0: see fuzz.h. Its hosts are called back within steps, where they make random
 * calls as well. */
#define _POSIX_C_SOURCE 200809L
#include "fmi3Functions.h"

#define FMI(name) fmi3##name
#include "fuzz.h"

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                   fmi3String message) {
    Fuzzer *fuzzer = environment;
    promise(fuzzer, category != NULL && message != NULL && *message != '\0',
            "a message without words");
    promise(fuzzer, status != fmi3Fatal, "a fatal message");
}

/* Reads and sets, as is allowed and not; nothing here may pull the instance from under the step. */
static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean set_requested,
                   fmi3Boolean get_allowed, fmi3Boolean finished, fmi3Boolean can_return,
                   fmi3Boolean *early, fmi3Float64 *early_time) {
    Fuzzer *fuzzer = environment;
    fmi3Instance c = fuzzer->current;
    Arguments a;
    any_arguments(&fuzzer->chance, &a);
    fmi3FMUState *slot = &fuzzer->snapshots[below(&fuzzer->chance, SNAPSHOTS)];
    promise(fuzzer, isfinite(time) && get_allowed && finished != set_requested,
            "an update that does not know what it is");
    switch (below(&fuzzer->chance, 8)) {
    case 0:
    case 1:
    case 2:
        promise(fuzzer,
                fmi3SetFloat64(c, a.vr, a.count, a.values, a.count) == fmi3Error || set_requested,
                "setting that was not requested");
        break;
    case 3: fmi3GetFloat64(c, a.others, a.other_count, a.values, a.other_count); break;
    case 4:
        fmi3GetOutputDerivatives(c, a.others, a.other_count, a.integers, a.values, a.other_count);
        break;
    case 5:
        promise(fuzzer,
                fmi3Reset(c) == fmi3Error && fmi3Terminate(c) == fmi3Error
                    && fmi3GetFMUState(c, slot) == fmi3Error
                    && fmi3SetFMUState(c, *slot) == fmi3Error,
                "a step whose instance was taken away");
        break;
    case 6: fmi3FreeInstance(c); break; /* refused */
    default: break;
    }
    if (can_return && below(&fuzzer->chance, 3) == 0) {
        *early = fmi3True;
        *early_time = a.is_tame ? time + 0.01 * unit(&fuzzer->chance) : a.more[0];
    }
}

static void *create(Fuzzer *fuzzer) {
    Chance *chance = &fuzzer->chance;
    bool logs = below(chance, 2), events = below(chance, 2);
    void *subject =
        below(chance, 3)
            ? fmi3InstantiateCoSimulation("fuzzed", INTERFACE_TOKEN, NULL, fmi3False, logs, events,
                                          below(chance, 2), NULL, 0, fuzzer, logger,
                                          below(chance, 3) ? update : NULL)
            : fmi3InstantiateModelExchange("fuzzed", INTERFACE_TOKEN, NULL, fmi3False, logs, fuzzer,
                                           logger);
    promise(fuzzer, subject != NULL, "no instance");
    return subject;
}

static void release(void *subject) { fmi3FreeInstance(subject); }

static void release_state(void *subject, void **state) { fmi3FreeFMUState(subject, state); }

/* One random call; *legal_in: where it is legal. */
static fmi3Status call(Fuzzer *fuzzer, void **subject, uint32_t *legal_in) {
    Chance *chance = &fuzzer->chance;
    fmi3Instance c = *subject;
    Arguments a;
    any_arguments(chance, &a);
    fmi3Boolean flags[5] = {false, true};
    fmi3Float64 time;
    fmi3FMUState *slot = &fuzzer->snapshots[below(chance, SNAPSHOTS)];
    const uint32_t set = ANY & ~TERMINATED, derivatives = ANY & ~INSTANTIATED;
    double *one = below(chance, 5) ? a.values : NULL;
    size_t one_count = below(chance, 8) ? 1 : below(chance, 3);
    size_t wrong = below(chance, 20) ? 0 : 1; /* too many values */
    fmi3Status status;
    double step;
    *legal_in = ANY;

    switch (below(chance, 60)) {
    case 0:
    case 1:
    case 2:
        fuzzer->function = "fmi3EnterInitializationMode";
        *legal_in = INSTANTIATED;
        return fmi3EnterInitializationMode(c, true, a.values[0], a.is_tame ? 0.0 : a.more[1], false,
                                           a.more[2]);
    case 3:
    case 4:
    case 5:
        fuzzer->function = "fmi3ExitInitializationMode";
        *legal_in = INITIALIZATION;
        return fmi3ExitInitializationMode(c);
    case 6:
    case 7:
    case 8:
        fuzzer->function = "fmi3EnterStepMode";
        *legal_in = EVENT & CO_SIMULATION;
        return fmi3EnterStepMode(c);
    case 9:
        fuzzer->function = "fmi3EnterEventMode";
        *legal_in = CONTINUOUS | STEP;
        return fmi3EnterEventMode(c);
    case 10:
        fuzzer->function = "fmi3EnterContinuousTimeMode";
        *legal_in = EVENT & MODEL_EXCHANGE;
        return fmi3EnterContinuousTimeMode(c);
    case 11:
        if (below(chance, 20))
            goto do_step;
        fuzzer->function = "fmi3Terminate";
        *legal_in = STEP | EVENT | CONTINUOUS;
        return fmi3Terminate(c);
    case 12:
        if (below(chance, 10))
            goto do_step;
        fuzzer->function = "fmi3Reset";
        return fmi3Reset(c);
    case 13:
    case 14:
    case 15:
    case 16:
        fuzzer->function = "fmi3SetFloat64";
        *legal_in = set;
        return fmi3SetFloat64(c, a.vr, a.count, a.values, a.count + wrong);
    case 17:
        fuzzer->function = "fmi3SetBoolean";
        *legal_in = set;
        a.references[0] = below(chance, 3) ? VARIABLE_CRANK_AT_STEP_END : a.references[0];
        return fmi3SetBoolean(c, a.vr, 1, flags, 1);
    case 18:
        fuzzer->function = "fmi3GetBoolean";
        a.references[0] = below(chance, 3) ? VARIABLE_CRANK_AT_STEP_END : a.references[0];
        return fmi3GetBoolean(c, a.vr, 1, flags, 1);
    case 19:
    case 20:
    case 21:
    case 22:
        fuzzer->function = "fmi3GetFloat64";
        status = fmi3GetFloat64(c, a.others, a.other_count, a.values, a.other_count + wrong);
        if (status == fmi3OK && a.is_tame)
            for (size_t i = 0; i < a.other_count; ++i)
                promise(fuzzer, !isnan(a.values[i]), "an output that is no number");
        return status;
    case 23:
        fuzzer->function = "fmi3GetInt32";
        return fmi3GetInt32(c, a.vr, below(chance, 2), a.integers, below(chance, 2));
    case 24:
        fuzzer->function = "fmi3GetClock";
        *legal_in = EVENT;
        return fmi3GetClock(c, a.vr, below(chance, 2), flags);
    case 25:
    case 26:
        fuzzer->function = "fmi3GetOutputDerivatives";
        *legal_in = (EVENT | STEP | TERMINATED) & CO_SIMULATION;
        return fmi3GetOutputDerivatives(c, a.others, a.other_count, a.integers, a.values,
                                        a.other_count + wrong);
    case 27:
    case 28:
        fuzzer->function = "fmi3GetDirectionalDerivative";
        *legal_in = derivatives;
        return fmi3GetDirectionalDerivative(c, a.others, a.other_count, a.vr, a.count, a.more,
                                            a.count + wrong, a.values, a.other_count);
    case 29:
    case 30:
        fuzzer->function = "fmi3GetAdjointDerivative";
        *legal_in = derivatives;
        return fmi3GetAdjointDerivative(c, a.others, a.other_count, a.vr, a.count, a.more,
                                        a.other_count, a.values, a.count + wrong);
    case 31:
    case 32:
        fuzzer->function = "fmi3GetFMUState";
        return fmi3GetFMUState(c, below(chance, 20) ? slot : NULL);
    case 33:
        if (below(chance, 3))
            goto do_step;
        fuzzer->function = "fmi3SetFMUState";
        return fmi3SetFMUState(c, *slot);
    case 34: fuzzer->function = "fmi3FreeFMUState"; return fmi3FreeFMUState(c, slot);
    case 35: {
        fuzzer->function = "fmi3DeserializeFMUState";
        size_t size = 0;
        if (*slot == NULL || fmi3SerializedFMUStateSize(c, *slot, &size) != fmi3OK)
            return fmi3OK;
        fmi3Byte *bytes = malloc(size);
        if (fmi3SerializeFMUState(c, *slot, bytes, size) != fmi3OK)
            promise(fuzzer, false, "a state that cannot be serialized");
        if (below(chance, 2)) /* damaged */
            bytes[below(chance, (uint32_t)size)] ^= (fmi3Byte)(1 << below(chance, 8));
        fmi3FMUState read = NULL;
        status = fmi3DeserializeFMUState(c, bytes,
                                         below(chance, 5) ? size : below(chance, (uint32_t)size),
                                         below(chance, 20) ? &read : NULL);
        promise(fuzzer, (status == fmi3OK) == (read != NULL),
                "a state from damaged bytes, or none");
        fmi3FreeFMUState(c, &read);
        free(bytes);
        return status;
    }
    case 36:
        fuzzer->function = "fmi3UpdateDiscreteStates";
        *legal_in = EVENT;
        return fmi3UpdateDiscreteStates(c, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4],
                                        below(chance, 5) ? &time : NULL);
    case 37:
        fuzzer->function = "fmi3SetTime";
        *legal_in = (EVENT | CONTINUOUS) & MODEL_EXCHANGE;
        return fmi3SetTime(c, a.values[0]);
    case 38:
        fuzzer->function = "fmi3SetContinuousStates";
        *legal_in = CONTINUOUS;
        return fmi3SetContinuousStates(c, one, one_count);
    case 39:
        fuzzer->function = "fmi3GetContinuousStateDerivatives";
        *legal_in = derivatives & MODEL_EXCHANGE;
        return fmi3GetContinuousStateDerivatives(c, one, one_count);
    case 40:
        fuzzer->function = "fmi3GetContinuousStates";
        *legal_in = derivatives & MODEL_EXCHANGE;
        return fmi3GetContinuousStates(c, one, one_count);
    case 41:
        fuzzer->function = "fmi3CompletedIntegratorStep";
        *legal_in = CONTINUOUS;
        return fmi3CompletedIntegratorStep(c, true, one == NULL ? NULL : &flags[0], &flags[1]);
    case 42:
        fuzzer->function = "fmi3EnterConfigurationMode";
        *legal_in = 0;
        return fmi3EnterConfigurationMode(c);
    case 43:
        fuzzer->function = "fmi3SetDebugLogging";
        return fmi3SetDebugLogging(c, flags[1], 0, NULL);
    case 44:
        if (below(chance, 50))
            goto do_step;
        fuzzer->function = "fmi3FreeInstance";
        fmi3FreeInstance(c);
        *subject = create(fuzzer);
        return fmi3OK;
    default:
    do_step:
        fuzzer->function = "fmi3DoStep";
        *legal_in = STEP;
        step = a.is_tame ? 0.02 * unit(chance) : a.more[3];
        time = a.is_tame ? ((Component *)c)->settings.real[VARIABLE_TIME] : a.more[4];
        return fmi3DoStep(c, time, step, true, &flags[0], &flags[1], &flags[2], &time);
    }
}
