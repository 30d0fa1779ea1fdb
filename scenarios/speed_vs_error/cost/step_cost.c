/* A small host of FMI 2.0 and 3.0 that measures what a communication step costs, against the bare
 * core evaluated in the same process. Rounds of all measurements are interleaved; each line printed
 * is one round: nanoseconds per evaluation or step, in the order of the heading.
 *
 *   step_cost LIBRARY LIBRARY_OF_FMI_3 GUID ROUNDS MASSES...
 *
 * MASSES: body.OA.m, body.OA.x and so on, in the order of their value references. */
#define _GNU_SOURCE /* sincos, clock_gettime */
#include "component/interface.h"
#include "linkage/linkage.h"
#include "scenarios/common/loader.h"
#include "scenarios/speed_vs_error/cost/clock.h"

#include "fmi3Functions.h"

#include <math.h>
#include <stdbool.h>

enum { STEPS = 2000 };
static const double H = 1e-3, SPEED = 6.8067840827778845; /* one turn in 0.923 s */

enum { OUTPUTS = 6, PARAMETERS = VARIABLE_GEOMETRY_THETA9 - VARIABLE_GEOMETRY_L1 + 1 };
static const fmi2ValueReference IN[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W, VARIABLE_CRANK_A};
static const fmi2ValueReference OUT[] = {VARIABLE_TIP_X,  VARIABLE_TIP_Y,  VARIABLE_TIP_VX,
                                         VARIABLE_TIP_VY, VARIABLE_TIP_AX, VARIABLE_TIP_AY};
enum { DRIVE_OUTPUTS = 3, MASSES = VARIABLE_GRAVITY - VARIABLE_BODY_OA_M };
static const fmi2ValueReference FOR_DRIVE[] = {VARIABLE_CRANK_TAU, VARIABLE_CRANK_INERTIA,
                                               VARIABLE_CRANK_TAU_BIAS};
static double mass[MASSES];

static Fmu fmu;
static fmi2Component instance;

static volatile double sink;

/* ---- what is measured ---- */

static double measure_sincos(void) {
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double s, c;
        sincos((i + 1) * H * SPEED, &s, &c);
        sum += s * c;
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

/* One that waits for the last: a unit for chains of operations. */
static double measure_multiplication(void) {
    double product = 1.0, begin = now();
    for (int i = 0; i < STEPS; ++i)
        product *= 1.0 + 1e-9;
    sink = product;
    return (now() - begin) / STEPS;
}

static Linkage linkage;

/* waits: each angle waits for the last tip, though it does not change by it. */
static double measure_core(int order, bool waits) {
    double sum = 0.0, last = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        LinkagePose pose;
        if (linkage_place(&linkage, (i + 1) * H * SPEED + last, &pose, NULL) != LINKAGE_CLOSED)
            continue;
        linkage_differentiate(&linkage, &pose, order);
        sum += pose.tip[0].x + pose.tip[0].y;
        if (order >= 1)
            sum += SPEED * pose.tip[1].x + SPEED * pose.tip[1].y;
        if (order >= 2)
            sum += SPEED * SPEED * pose.tip[2].x + SPEED * SPEED * pose.tip[2].y;
        if (waits)
            last = 0.0 * pose.tip[order].x;
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

/* Steps with `inputs` of phi, w, a set and `outputs` of `read` read. */
static double measure_reading(const fmi2ValueReference *read, size_t inputs, size_t outputs,
                              bool with_masses) {
    double value[6] = {0.0}, input[3] = {0.0, SPEED, 0.01};
    demand(fmu.reset(instance) == fmi2OK, "reset");
    if (with_masses) {
        fmi2ValueReference of[MASSES];
        for (unsigned i = 0; i < MASSES; ++i)
            of[i] = VARIABLE_BODY_OA_M + i;
        demand(fmu.set_real(instance, of, MASSES, mass) == fmi2OK, "masses");
    }
    demand(fmu.setup(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    demand(fmu.enter(instance) == fmi2OK && fmu.leave(instance) == fmi2OK, "initialize");
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double t = i * H;
        input[0] = t * SPEED;
        int failed = fmu.set_real(instance, IN, inputs, input) != fmi2OK;
        failed |= fmu.do_step(instance, t, H, fmi2True) != fmi2OK;
        if (outputs > 0)
            failed |= fmu.get_real(instance, read, outputs, value) != fmi2OK;
        demand(!failed, "step");
        sum += value[0] + value[5];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

static double measure_steps(size_t inputs, size_t outputs) {
    return measure_reading(OUT, inputs, outputs, false);
}
static double measure_for_drive(void) { return measure_reading(FOR_DRIVE, 3, DRIVE_OUTPUTS, true); }

/* ---- FMI 3.0, and Model Exchange ---- */

static struct {
    fmi3InstantiateCoSimulationTYPE *instantiate;
    fmi3EnterInitializationModeTYPE *enter;
    fmi3ExitInitializationModeTYPE *leave;
    fmi3SetFloat64TYPE *set;
    fmi3GetFloat64TYPE *get;
    fmi3DoStepTYPE *do_step;
    fmi3ResetTYPE *reset;
    fmi3GetDirectionalDerivativeTYPE *directional;
    fmi3GetAdjointDerivativeTYPE *adjoint;
} fmu3;
static fmi3Instance instance3;

static void load_fmu3(const char *path, const char *token) {
    void *library = open_library(path);
    load_function(library, "fmi3InstantiateCoSimulation", &fmu3.instantiate);
    load_function(library, "fmi3EnterInitializationMode", &fmu3.enter);
    load_function(library, "fmi3ExitInitializationMode", &fmu3.leave);
    load_function(library, "fmi3SetFloat64", &fmu3.set);
    load_function(library, "fmi3GetFloat64", &fmu3.get);
    load_function(library, "fmi3DoStep", &fmu3.do_step);
    load_function(library, "fmi3Reset", &fmu3.reset);
    load_function(library, "fmi3GetDirectionalDerivative", &fmu3.directional);
    load_function(library, "fmi3GetAdjointDerivative", &fmu3.adjoint);
    instance3 = fmu3.instantiate("host", token, NULL, fmi3False, fmi3False, fmi3False, fmi3False,
                                 NULL, 0, NULL, NULL, NULL);
    demand(instance3 != NULL, "no instance of FMI 3.0");
}

static void enter3(void) {
    demand(fmu3.reset(instance3) == fmi3OK, "reset");
    demand(fmu3.enter(instance3, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK, "enter");
}

static double measure_steps3(void) {
    double value[OUTPUTS] = {0.0}, input[3] = {0.0, SPEED, 0.01};
    enter3();
    demand(fmu3.leave(instance3) == fmi3OK, "initialize");
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double t = i * H, last;
        bool event, terminate, early;
        input[0] = t * SPEED;
        int failed = fmu3.set(instance3, IN, 3, input, 3) != fmi3OK;
        failed |=
            fmu3.do_step(instance3, t, H, fmi3True, &event, &terminate, &early, &last) != fmi3OK;
        failed |= fmu3.get(instance3, OUT, OUTPUTS, value, OUTPUTS) != fmi3OK;
        demand(!failed, "step of FMI 3.0");
        sum += value[0] + value[5];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

/* In initialization mode: inputs set, outputs read and, forwards along all parameters or backwards
 * to all of them, their derivatives. */
static double measure_derivatives(bool forwards, bool backwards) {
    double value[OUTPUTS] = {0.0}, input[3] = {0.0, SPEED, 0.01};
    double seed[PARAMETERS] = {0.1, 0.2, 0.3}, found[PARAMETERS] = {0.0};
    fmi3ValueReference parameters[PARAMETERS];
    for (unsigned i = 0; i < PARAMETERS; ++i)
        parameters[i] = VARIABLE_GEOMETRY_L1 + i;
    enter3();
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        input[0] = i * H * SPEED;
        int failed = fmu3.set(instance3, IN, 3, input, 3) != fmi3OK;
        failed |= fmu3.get(instance3, OUT, OUTPUTS, value, OUTPUTS) != fmi3OK;
        if (forwards)
            failed |= fmu3.directional(instance3, OUT, OUTPUTS, parameters, PARAMETERS, seed,
                                       PARAMETERS, found, OUTPUTS)
                      != fmi3OK;
        if (backwards)
            failed |= fmu3.adjoint(instance3, OUT, OUTPUTS, parameters, PARAMETERS, seed, OUTPUTS,
                                   found, PARAMETERS)
                      != fmi3OK;
        demand(!failed, "derivatives");
        sum += value[0] + found[0];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

static fmi2Component exchanging;
static fmi2SetTimeTYPE *set_time;

static void start_model_exchange(const char *guid) {
    static const fmi2CallbackFunctions callbacks = {print_message, calloc, free, NULL, NULL};
    fmi2EnterContinuousTimeModeTYPE *enter;
    load_function(fmu.library, "fmi2EnterContinuousTimeMode", &enter);
    load_function(fmu.library, "fmi2SetTime", &set_time);
    exchanging = fmu.create("host", fmi2ModelExchange, guid, "", &callbacks, fmi2False, fmi2False);
    demand(exchanging != NULL, "no instance for Model Exchange");
    demand(fmu.setup(exchanging, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    demand(fmu.enter(exchanging) == fmi2OK && fmu.leave(exchanging) == fmi2OK, "initialize");
    demand(enter(exchanging) == fmi2OK, "continuous time");
}

static double measure_model_exchange(void) {
    double value[OUTPUTS] = {0.0}, input[3] = {0.0, SPEED, 0.01};
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double t = (i + 1) * H;
        input[0] = t * SPEED;
        int failed = set_time(exchanging, t) != fmi2OK;
        failed |= fmu.set_real(exchanging, IN, 3, input) != fmi2OK;
        failed |= fmu.get_real(exchanging, OUT, OUTPUTS, value) != fmi2OK;
        demand(!failed, "Model Exchange");
        sum += value[0] + value[5];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

int main(int count, char **arguments) {
    demand(count == 5 + MASSES, "usage: step_cost LIBRARY LIBRARY_OF_FMI_3 GUID ROUNDS MASSES...");
    for (int i = 0; i < MASSES; ++i)
        mass[i] = atof(arguments[5 + i]);
    fmu = load_fmu(arguments[1]);
    instance = new_instance(&fmu, arguments[3]);
    load_fmu3(arguments[2], arguments[3]);
    start_model_exchange(arguments[3]);

    LinkageGeometry geometry;
    double *parameter = (double *)&geometry;
    for (size_t i = 0; i < sizeof geometry / sizeof *parameter; ++i)
        parameter[i] = interface_variables[VARIABLE_GEOMETRY_L1 + i].start;
    linkage_prepare(&geometry, &linkage);

    puts("multiplication,sincos,core_0,core_1,core_2,core_2_chain,step_phi_w_a_get_6,step_phi_w_"
         "get_6,step_phi_get_6,"
         "step_phi_w_a_get_4,step_phi_w_a_get_2,step_phi_w_a_get_0,step_for_drive,step_fmi3,"
         "model_exchange,"
         "initializing,initializing_directional,initializing_adjoint");
    for (int round = atoi(arguments[4]); round > 0; --round) {
        printf("%g,%g,%g,%g,%g,%g,", measure_multiplication(), measure_sincos(),
               measure_core(0, false), measure_core(1, false), measure_core(2, false),
               measure_core(2, true));
        /* the versions in turns, now one and now the other first */
        double step3 = round % 2 ? measure_steps3() : 0.0, step2 = measure_steps(3, 6);
        step3 = round % 2 ? step3 : measure_steps3();
        printf("%g,%g,%g,%g,%g,%g,%g,", step2, measure_steps(2, 6), measure_steps(1, 6),
               measure_steps(3, 4), measure_steps(3, 2), measure_steps(3, 0), measure_for_drive());
        printf("%g,%g,%g,%g,%g\n", step3, measure_model_exchange(),
               measure_derivatives(false, false), measure_derivatives(true, false),
               measure_derivatives(false, true));
    }
    return 0;
}
