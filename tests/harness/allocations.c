/* A host that counts what is taken from the heap. It prints two numbers: how often memory was
 * allocated while the FMU was instantiated, and while it went through 10000 steps in which every
 * function of a running slave is called, one of them in vain.
 *
 *   allocations LIBRARY GUID */
#define _GNU_SOURCE
#include "component/interface.h"
#include "heap.h"
#include "scenarios/common/loader.h"

/* ---- the host ---- */

enum { STEPS = 10000, INPUTS = 6, OUTPUTS = VARIABLE_ASSEMBLY_MARGIN - VARIABLE_TIP_X + 1 };

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    (void)environment;
    (void)name;
    (void)status;
    (void)category;
    (void)message;
}

int main(int count, char **arguments) {
    demand(count == 3, "usage: allocations LIBRARY GUID");
    void *library = open_library(arguments[1]);
    FIND(library, fmi2Instantiate);
    FIND(library, fmi2SetupExperiment);
    FIND(library, fmi2EnterInitializationMode);
    FIND(library, fmi2ExitInitializationMode);
    FIND(library, fmi2SetReal);
    FIND(library, fmi2GetReal);
    FIND(library, fmi2SetRealInputDerivatives);
    FIND(library, fmi2GetRealOutputDerivatives);
    FIND(library, fmi2GetDirectionalDerivative);
    FIND(library, fmi2DoStep);
    FIND(library, fmi2GetRealStatus);
    FIND(library, fmi2GetFMUstate);
    FIND(library, fmi2SetFMUstate);
    FIND(library, fmi2SerializedFMUstateSize);
    FIND(library, fmi2SerializeFMUstate);

    fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, NULL}; /* memory from the heap */
    long before = allocations;
    fmi2Component c = fmi2Instantiate_("allocations", fmi2CoSimulation, arguments[2], "",
                                       &callbacks, fmi2False, fmi2True);
    long while_instantiating = allocations - before;
    demand(c != NULL, "no instance");

    static const fmi2ValueReference input[INPUTS] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W,
                                                     VARIABLE_CRANK_A,   VARIABLE_MACHINE_V,
                                                     VARIABLE_TIP_FX,    VARIABLE_TIP_FY};
    fmi2ValueReference output[OUTPUTS];
    fmi2Integer order[OUTPUTS];
    for (unsigned i = 0; i < OUTPUTS; ++i) {
        output[i] = VARIABLE_TIP_X + i;
        order[i] = 1 + (fmi2Integer)(i % 2);
    }
    fmi2Real value[OUTPUTS], seed[INPUTS] = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
    static fmi2Byte serialized[8192];
    fmi2FMUstate state = NULL;
    size_t size;
    demand(fmi2SetupExperiment_(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    demand(fmi2EnterInitializationMode_(c) == fmi2OK, "enter");
    demand(fmi2ExitInitializationMode_(c) == fmi2OK, "exit");
    demand(fmi2GetFMUstate_(c, &state) == fmi2OK, "a state to use again");

    before = allocations;
    for (int i = 0; i < STEPS; ++i) {
        double t = i * 1e-3;
        double speed = i < STEPS / 2 ? 0.0 : 5.0;
        fmi2Real inputs[INPUTS] = {5.0 * t * (1.0 + t), speed, 0.0, 0.4, 10.0, -80.0};
        int failed = fmi2SetReal_(c, input, INPUTS, inputs) != fmi2OK;
        if (i % 3 == 0)
            failed |= fmi2SetRealInputDerivatives_(c, input, INPUTS, order, seed) != fmi2OK;
        failed |= fmi2DoStep_(c, t, 1e-3, fmi2False) != fmi2OK;
        failed |= fmi2GetReal_(c, output, OUTPUTS, value) != fmi2OK;
        failed |= fmi2GetRealOutputDerivatives_(c, output, OUTPUTS, order, value) != fmi2OK;
        failed |=
            fmi2GetDirectionalDerivative_(c, output, OUTPUTS, input, INPUTS, seed, value) != fmi2OK;
        failed |= fmi2GetRealStatus_(c, fmi2LastSuccessfulTime, value) != fmi2OK;
        failed |= fmi2GetFMUstate_(c, &state) != fmi2OK;
        failed |= fmi2SerializedFMUstateSize_(c, state, &size) != fmi2OK;
        failed |= size > sizeof serialized;
        failed |= fmi2SerializeFMUstate_(c, state, serialized, size) != fmi2OK;
        failed |= fmi2SetFMUstate_(c, state) != fmi2OK;
        /* refused, with numbers in the message */
        failed |= fmi2DoStep_(c, t - 0.123456789, 1e-3, fmi2False) != fmi2Error;
        demand(!failed, "a call did not do what it should");
    }
    printf("%ld %ld\n", while_instantiating, allocations - before);
    return 0;
}
