/* A host that loads the FMUs of both versions side by side, runs instances of both interface types
 * of each in turns, frees and unloads them: again and again.
 *
 *   loads LIBRARY LIBRARY_OF_FMI_3 TOKEN TIMES
 *
 * Demands that both versions and both types give the same bits for the same inputs. Prints how many
 * blocks of memory more are out after the last time than after the tenth, and how often memory was
 * allocated while the instances ran. */
#define _GNU_SOURCE
#include "component/interface.h"
#include "heap.h"
#include "scenarios/common/loader.h"

#include "fmi3Functions.h"

#include <stdbool.h>
#include <string.h>

enum { STEPS = 50, INPUTS = 5, OUTPUTS = VARIABLE_ASSEMBLY_MARGIN - VARIABLE_TIP_X + 1 };

static const uint32_t in[INPUTS] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W, VARIABLE_CRANK_A,
                                    VARIABLE_TIP_FX, VARIABLE_TIP_FY};

static long run(const char *path2, const char *path3, const char *token) {
    void *library2 = open_library(path2), *library3 = open_library(path3);
    static const fmi2CallbackFunctions callbacks = {print_message, NULL, NULL, NULL, NULL};
    FIND(library2, fmi2Instantiate);
    FIND(library2, fmi2SetupExperiment);
    FIND(library2, fmi2EnterInitializationMode);
    FIND(library2, fmi2ExitInitializationMode);
    FIND(library2, fmi2SetBoolean);
    FIND(library2, fmi2SetReal);
    FIND(library2, fmi2GetReal);
    FIND(library2, fmi2DoStep);
    FIND(library2, fmi2FreeInstance);
    FIND(library3, fmi3InstantiateCoSimulation);
    FIND(library3, fmi3InstantiateModelExchange);
    FIND(library3, fmi3EnterInitializationMode);
    FIND(library3, fmi3ExitInitializationMode);
    FIND(library3, fmi3SetBoolean);
    FIND(library3, fmi3SetFloat64);
    FIND(library3, fmi3GetFloat64);
    FIND(library3, fmi3GetDirectionalDerivative);
    FIND(library3, fmi3GetAdjointDerivative);
    FIND(library3, fmi3GetOutputDerivatives);
    FIND(library3, fmi3EnterEventMode);
    FIND(library3, fmi3EnterStepMode);
    FIND(library3, fmi3DoStep);
    FIND(library3, fmi3GetFMUState);
    FIND(library3, fmi3SetFMUState);
    FIND(library3, fmi3FreeFMUState);
    FIND(library3, fmi3FreeInstance);

    fmi2Component cs2 = fmi2Instantiate_("a", fmi2CoSimulation, token, "", &callbacks, 0, 0);
    fmi2Component me2 = fmi2Instantiate_("b", fmi2ModelExchange, token, "", &callbacks, 0, 0);
    fmi3Instance cs3 = fmi3InstantiateCoSimulation_("a", token, NULL, false, false, true, false,
                                                    NULL, 0, NULL, NULL, NULL);
    fmi3Instance me3 = fmi3InstantiateModelExchange_("b", token, NULL, false, false, NULL, NULL);
    demand(cs2 && me2 && cs3 && me3, "no instance");
    static const uint32_t at_step_end = VARIABLE_CRANK_AT_STEP_END;
    static const fmi2Boolean yes2 = fmi2True;
    static const fmi3Boolean yes3 = fmi3True;
    int failed = fmi2SetBoolean_(cs2, &at_step_end, 1, &yes2) != fmi2OK;
    failed |= fmi3SetBoolean_(cs3, &at_step_end, 1, &yes3, 1) != fmi3OK;
    for (int i = 0; i < 2; ++i) {
        fmi2Component c2 = i ? me2 : cs2;
        fmi3Instance c3 = i ? me3 : cs3;
        failed |= fmi2SetupExperiment_(c2, fmi2False, 0.0, 0.0, fmi2False, 0.0) != fmi2OK;
        failed |= fmi2EnterInitializationMode_(c2) != fmi2OK;
        failed |= fmi2ExitInitializationMode_(c2) != fmi2OK;
        failed |= fmi3EnterInitializationMode_(c3, false, 0.0, 0.0, false, 0.0) != fmi3OK;
        failed |= fmi3ExitInitializationMode_(c3) != fmi3OK;
    }
    failed |= fmi3EnterStepMode_(cs3) != fmi3OK;
    demand(!failed, "initialize");

    uint32_t out[OUTPUTS];
    for (unsigned i = 0; i < OUTPUTS; ++i)
        out[i] = VARIABLE_TIP_X + i;
    fmi3FMUState state = NULL;
    demand(fmi3GetFMUState_(cs3, &state) == fmi3OK, "a state to use again");
    long allocations_before = allocations;
    for (int i = 0; i < STEPS; ++i) {
        double t = i * 1e-3, last, found[4][OUTPUTS], derivatives[OUTPUTS];
        double inputs[INPUTS] = {6.8 * t * (1.0 + t), 6.8 * (1.0 + 2.0 * t), 13.6, 10.0, -80.0};
        int32_t order[OUTPUTS];
        for (int k = 0; k < OUTPUTS; ++k)
            order[k] = 1 + k % 2;
        bool event, terminate, early;
        failed |= fmi2SetReal_(cs2, in, INPUTS, inputs) != fmi2OK;
        failed |= fmi3SetFloat64_(cs3, in, INPUTS, inputs, INPUTS) != fmi3OK;
        failed |= fmi2SetReal_(me2, in, INPUTS, inputs) != fmi2OK;
        failed |= fmi3SetFloat64_(me3, in, INPUTS, inputs, INPUTS) != fmi3OK;
        failed |= fmi2DoStep_(cs2, t, 1e-3, fmi2True) != fmi2OK;
        failed |= fmi3DoStep_(cs3, t, 1e-3, true, &event, &terminate, &early, &last) != fmi3OK;
        failed |= fmi2GetReal_(cs2, out, OUTPUTS, found[0]) != fmi2OK;
        failed |= fmi3GetFloat64_(cs3, out, OUTPUTS, found[1], OUTPUTS) != fmi3OK;
        failed |= fmi2GetReal_(me2, out, OUTPUTS, found[2]) != fmi2OK;
        failed |= fmi3GetFloat64_(me3, out, OUTPUTS, found[3], OUTPUTS) != fmi3OK;
        failed |=
            fmi3GetOutputDerivatives_(cs3, out, OUTPUTS, order, derivatives, OUTPUTS) != fmi3OK;
        failed |= fmi3GetDirectionalDerivative_(cs3, out, OUTPUTS, in, INPUTS, inputs, INPUTS,
                                                derivatives, OUTPUTS)
                  != fmi3OK;
        failed |= fmi3GetAdjointDerivative_(cs3, out, OUTPUTS, in, INPUTS, found[0], OUTPUTS,
                                            derivatives, INPUTS)
                  != fmi3OK;
        failed |= fmi3EnterEventMode_(cs3) != fmi3OK || fmi3EnterStepMode_(cs3) != fmi3OK;
        failed |= fmi3GetFMUState_(cs3, &state) != fmi3OK || fmi3SetFMUState_(cs3, state) != fmi3OK;
        failed |=
            fmi3DoStep_(cs3, -1.0, 1e-3, true, &event, &terminate, &early, &last) != fmi3Error;
        demand(!failed, "a call did not do what it should");
        for (int other = 1; other < 4; ++other)
            demand(memcmp(found[0], found[other], sizeof found[0]) == 0,
                   "versions or interface types differ");
    }
    long while_running = allocations - allocations_before;
    fmi3FreeFMUState_(cs3, &state);
    fmi2FreeInstance_(cs2);
    fmi2FreeInstance_(me2);
    fmi3FreeInstance_(cs3);
    fmi3FreeInstance_(me3);
    demand(dlclose(library2) == 0 && dlclose(library3) == 0, "unloading");
    return while_running;
}

int main(int count, char **arguments) {
    demand(count == 5, "usage: loads LIBRARY LIBRARY_OF_FMI_3 TOKEN TIMES");
    long settled = 0, while_running = 0;
    for (int i = 0; i < atoi(arguments[4]); ++i) {
        while_running += run(arguments[1], arguments[2], arguments[3]);
        if (i == 9)
            settled = allocations - releases;
    }
    printf("%ld %ld\n", allocations - releases - settled, while_running);
    return 0;
}
