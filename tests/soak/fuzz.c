/* The fuzzer of FMI 2.0: see fuzz.h. */
#define _POSIX_C_SOURCE 200809L
#include "fmi2Functions.h"

#define FMI(name) fmi2##name
#include "fuzz.h"

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

static void *create(Fuzzer *fuzzer) {
    /* the component keeps what it needs of the callbacks: they live no longer than this call */
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, fuzzer};
    void *subject = fmi2Instantiate(
        "fuzzed", below(&fuzzer->chance, 3) ? fmi2CoSimulation : fmi2ModelExchange, INTERFACE_TOKEN,
        NULL, &callbacks, fmi2False, below(&fuzzer->chance, 2) ? fmi2True : fmi2False);
    promise(fuzzer, subject != NULL, "no instance");
    return subject;
}

static void release(void *subject) { fmi2FreeInstance(subject); }

static void release_state(void *subject, void **state) { fmi2FreeFMUstate(subject, state); }

/* One random call; *legal_in: the modes in which it is legal. */
static fmi2Status call(Fuzzer *fuzzer, void **subject, uint32_t *legal_in) {
    Chance *chance = &fuzzer->chance;
    fmi2Component c = *subject;
    Arguments a;
    any_arguments(chance, &a);
    const char *strings[MOST_VALUES] = {NULL};
    fmi2Boolean flags[2];
    fmi2EventInfo info;
    fmi2FMUstate *slot = &fuzzer->snapshots[below(chance, SNAPSHOTS)];
    double step;
    fmi2Status status;
    *legal_in = ANY;

    switch (below(chance, 50)) {
    case 0:
        fuzzer->function = "fmi2SetupExperiment";
        *legal_in = INSTANTIATED;
        return fmi2SetupExperiment(c, fmi2True, a.values[0], a.is_tame ? 0.0 : a.more[1], fmi2False,
                                   a.more[2]);
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
        *legal_in = STEP | EVENT | CONTINUOUS;
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
        return fmi2SetReal(c, a.vr, a.count, a.values);
    case 11:
        fuzzer->function = "fmi2SetBoolean";
        *legal_in = ANY & ~TERMINATED;
        a.references[0] = below(chance, 3) ? VARIABLE_CRANK_AT_STEP_END : a.references[0];
        return fmi2SetBoolean(c, a.vr, below(chance, 2), a.integers);
    case 12:
        fuzzer->function = "fmi2GetBoolean";
        *legal_in = ANY & ~INSTANTIATED;
        a.references[0] = below(chance, 3) ? VARIABLE_CRANK_AT_STEP_END : a.references[0];
        return fmi2GetBoolean(c, a.vr, below(chance, 2), a.integers);
    case 13:
    case 14:
    case 15:
    case 16:
        fuzzer->function = "fmi2GetReal";
        *legal_in = ANY & ~INSTANTIATED;
        status = fmi2GetReal(c, a.others, a.other_count, a.values);
        if (status == fmi2OK && a.is_tame)
            for (size_t i = 0; i < a.other_count; ++i)
                promise(fuzzer, !isnan(a.values[i]), "an output that is no number");
        return status;
    case 17:
        fuzzer->function = "fmi2GetInteger";
        *legal_in = ANY & ~INSTANTIATED;
        return fmi2GetInteger(c, a.vr, below(chance, 2), a.integers);
    case 18:
        fuzzer->function = "fmi2SetString";
        *legal_in = ANY & ~TERMINATED;
        return fmi2SetString(c, a.vr, below(chance, 2), strings);
    case 19:
    case 20:
        fuzzer->function = "fmi2SetRealInputDerivatives";
        *legal_in = ANY & ~TERMINATED & CO_SIMULATION;
        return fmi2SetRealInputDerivatives(c, a.vr, a.count, a.integers, a.values);
    case 21:
    case 22:
        fuzzer->function = "fmi2GetRealOutputDerivatives";
        *legal_in = STEP | (TERMINATED & CO_SIMULATION);
        return fmi2GetRealOutputDerivatives(c, a.others, a.other_count, a.integers, a.values);
    case 23:
    case 24:
        fuzzer->function = "fmi2GetDirectionalDerivative";
        *legal_in = ANY & ~INSTANTIATED;
        return fmi2GetDirectionalDerivative(c, a.others, a.other_count, a.vr, a.count, a.more,
                                            a.values);
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
        *legal_in = STEP | (TERMINATED & CO_SIMULATION);
        return fmi2GetRealStatus(c, (fmi2StatusKind)below(chance, 5),
                                 below(chance, 5) ? a.values : NULL);
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
        *subject = create(fuzzer);
        return fmi2OK;
    case 34:
    case 35:
        fuzzer->function = "fmi2EnterContinuousTimeMode";
        *legal_in = EVENT & MODEL_EXCHANGE;
        return fmi2EnterContinuousTimeMode(c);
    case 36:
        fuzzer->function = "fmi2EnterEventMode";
        *legal_in = (EVENT | CONTINUOUS) & MODEL_EXCHANGE;
        return fmi2EnterEventMode(c);
    case 37:
        fuzzer->function = "fmi2NewDiscreteStates";
        *legal_in = EVENT & MODEL_EXCHANGE;
        return fmi2NewDiscreteStates(c, below(chance, 5) ? &info : NULL);
    case 38:
        fuzzer->function = "fmi2SetTime";
        *legal_in = (EVENT | CONTINUOUS) & MODEL_EXCHANGE;
        return fmi2SetTime(c, a.values[0]);
    case 39:
        fuzzer->function = "fmi2SetContinuousStates";
        *legal_in = CONTINUOUS;
        return fmi2SetContinuousStates(c, below(chance, 5) ? a.values : NULL, below(chance, 3));
    case 40:
        fuzzer->function = "fmi2GetDerivatives";
        *legal_in = ANY & ~INSTANTIATED & MODEL_EXCHANGE;
        return fmi2GetDerivatives(c, below(chance, 5) ? a.values : NULL, below(chance, 3));
    case 41:
        fuzzer->function = "fmi2GetContinuousStates";
        *legal_in = ANY & ~INSTANTIATED & MODEL_EXCHANGE;
        return fmi2GetContinuousStates(c, below(chance, 5) ? a.values : NULL, below(chance, 3));
    case 42:
        fuzzer->function = "fmi2CompletedIntegratorStep";
        *legal_in = CONTINUOUS;
        return fmi2CompletedIntegratorStep(c, fmi2True, below(chance, 5) ? &flags[0] : NULL,
                                           &flags[1]);
    default:
    do_step:
        fuzzer->function = "fmi2DoStep";
        *legal_in = STEP;
        step = a.is_tame ? 0.02 * unit(chance) : a.more[3];
        return fmi2DoStep(c, a.is_tame ? ((Component *)c)->settings.real[VARIABLE_TIME] : a.more[4],
                          step, fmi2True);
    }
}
