/* A small FMI 2.0 host that measures what a communication step costs in several uses: which
 * inputs it sets, whether with input derivatives, which outputs and directional derivatives it
 * reads. It knows the FMU by value references alone.
 *
 *   use_cost LIBRARY GUID ROUNDS
 *
 * Standard input: one use a line, numbers apart by spaces, each list with its length before it:
 *
 *   flags   Booleans set to true before initialization
 *   window  value reference and value of a real set before initialization
 *   inputs  value reference and value, by turns: the first is the crank's angle, whose value here
 *           is its speed in rad/s: it turns evenly; the others are set to the same value each step
 *   order   0, or up to which order input derivatives of the angle are set (its speed, then 0)
 *   outputs value references, read in one call
 *   unknown value references of the directional derivatives by the crank's angle, in one call
 *
 * Rounds of all uses are interleaved. Each line printed is one round: nanoseconds of libm's
 * sincos, then of a step of each use. */
#define _GNU_SOURCE /* clock_gettime */
#include "scenarios/common/loader.h"
#include "scenarios/speed_vs_error/cost/clock.h"

#include <math.h>

enum { STEPS = 1000, USES = 32, LENGTH = 32 };
static const double H = 1e-3; /* s */

typedef struct {
    size_t flags, inputs, outputs, unknowns;
    int order;
    fmi2ValueReference flag[LENGTH], input[LENGTH], output[LENGTH], unknown[LENGTH];
    double value[LENGTH], window_value;
    fmi2ValueReference window;
} Use;

static fmi2SetupExperimentTYPE *setup;
static fmi2EnterInitializationModeTYPE *enter;
static fmi2ExitInitializationModeTYPE *leave;
static fmi2SetBooleanTYPE *set_boolean;
static fmi2SetRealTYPE *set_real;
static fmi2SetRealInputDerivativesTYPE *set_derivatives;
static fmi2GetRealTYPE *get_real;
static fmi2GetDirectionalDerivativeTYPE *get_directional;
static fmi2DoStepTYPE *do_step;
static fmi2ResetTYPE *reset;
static fmi2Component instance;

static volatile double sink;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    (void)environment;
    (void)name;
    (void)status;
    (void)category;
    fprintf(stderr, "%s\n", message);
}

/* ---- uses ---- */

static size_t read_length(void) {
    size_t length;
    demand(scanf("%zu", &length) == 1 && length <= LENGTH, "a list is missing or too long");
    return length;
}

static size_t read_references(fmi2ValueReference *reference) {
    size_t length = read_length();
    for (size_t i = 0; i < length; ++i)
        demand(scanf("%u", &reference[i]) == 1, "a value reference is missing");
    return length;
}

/* False at the end of the input. */
static int read_use(Use *use) {
    if (scanf("%zu", &use->flags) != 1)
        return 0;
    demand(use->flags <= LENGTH, "too many flags");
    for (size_t i = 0; i < use->flags; ++i)
        demand(scanf("%u", &use->flag[i]) == 1, "a flag is missing");
    demand(scanf("%u %lf", &use->window, &use->window_value) == 2, "the window is missing");
    use->inputs = read_length();
    demand(use->inputs > 0, "a use needs the crank's angle");
    for (size_t i = 0; i < use->inputs; ++i)
        demand(scanf("%u %lf", &use->input[i], &use->value[i]) == 2, "an input is missing");
    demand(scanf("%d", &use->order) == 1 && use->order >= 0 && use->order <= 2, "bad order");
    use->outputs = read_references(use->output);
    use->unknowns = read_references(use->unknown);
    return 1;
}

/* ---- what is measured ---- */

static double measure_sincos(double speed) {
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double angle = (i + 1) * H * speed;
        sum += sin(angle) * cos(angle); /* one sincos to the compiler */
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

static double measure_steps(const Use *use) {
    static const fmi2Boolean yes[LENGTH] = {fmi2True, fmi2True, fmi2True, fmi2True};
    static const fmi2Integer orders[] = {1, 2};
    static const double seed = 1.0;
    double speed = use->value[0], input[LENGTH], output[LENGTH] = {0.0}, slope[LENGTH] = {0.0};
    const double derivative[] = {speed, 0.0};
    const fmi2ValueReference angle[] = {use->input[0], use->input[0]};
    for (size_t i = 0; i < use->inputs; ++i)
        input[i] = use->value[i];
    demand(reset(instance) == fmi2OK, "reset");
    demand(setup(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    if (use->flags > 0)
        demand(set_boolean(instance, use->flag, use->flags, yes) == fmi2OK, "flags");
    demand(set_real(instance, &use->window, 1, &use->window_value) == fmi2OK, "window");
    demand(enter(instance) == fmi2OK && leave(instance) == fmi2OK, "initialize");
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double t = i * H;
        input[0] = t * speed;
        int failed = set_real(instance, use->input, use->inputs, input) != fmi2OK;
        if (use->order > 0)
            failed |=
                set_derivatives(instance, angle, (size_t)use->order, orders, derivative) != fmi2OK;
        failed |= do_step(instance, t, H, fmi2True) != fmi2OK;
        if (use->outputs > 0)
            failed |= get_real(instance, use->output, use->outputs, output) != fmi2OK;
        if (use->unknowns > 0)
            failed |= get_directional(instance, use->unknown, use->unknowns, angle, 1, &seed, slope)
                      != fmi2OK;
        demand(!failed, "step");
        sum += output[0] + slope[0];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

int main(int count, char **arguments) {
    static Use uses[USES];
    demand(count == 4, "usage: use_cost LIBRARY GUID ROUNDS < USES");
    void *library = open_library(arguments[1]);
    fmi2InstantiateTYPE *instantiate;
    load_function(library, "fmi2Instantiate", &instantiate);
    load_function(library, "fmi2SetupExperiment", &setup);
    load_function(library, "fmi2EnterInitializationMode", &enter);
    load_function(library, "fmi2ExitInitializationMode", &leave);
    load_function(library, "fmi2SetBoolean", &set_boolean);
    load_function(library, "fmi2SetReal", &set_real);
    load_function(library, "fmi2SetRealInputDerivatives", &set_derivatives);
    load_function(library, "fmi2GetReal", &get_real);
    load_function(library, "fmi2GetDirectionalDerivative", &get_directional);
    load_function(library, "fmi2DoStep", &do_step);
    load_function(library, "fmi2Reset", &reset);
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    instance = instantiate("use_cost", fmi2CoSimulation, arguments[2], "", &callbacks, fmi2False,
                           fmi2False);
    demand(instance != NULL, "no instance");

    size_t used = 0;
    while (used < USES && read_use(&uses[used]))
        ++used;
    demand(used > 0, "no use");
    for (int round = atoi(arguments[3]); round > 0; --round) {
        printf("%g", measure_sincos(uses[0].value[0]));
        for (size_t i = 0; i < used; ++i)
            printf(",%g", measure_steps(&uses[i]));
        putchar('\n');
    }
    return 0;
}
