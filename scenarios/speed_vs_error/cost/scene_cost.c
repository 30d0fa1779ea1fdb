/* A small FMI 2.0 host that measures what a communication step costs in several scenes: which
 * inputs it sets, whether with input derivatives, which outputs and directional derivatives it
 * reads. It knows the FMU by value references alone.
 *
 *   scene_cost LIBRARY GUID ROUNDS
 *
 * Standard input: one scene a line, numbers apart by spaces, each list with its length before it:
 *
 *   flags   Booleans set to true before initialization
 *   window  value reference and value of a real set before initialization
 *   inputs  value reference and value, by turns: the first is the crank's angle, whose value here
 *           is its speed in rad/s: it turns evenly; the others are set to the same value each step
 *   order   0, or up to which order input derivatives of the angle are set (its speed, then 0)
 *   outputs value references, read in one call
 *   unknown value references of the directional derivatives by the crank's angle, in one call
 *
 * Rounds of all scenes are interleaved. Each line printed is one round: nanoseconds of libm's
 * sincos, then of a step of each scene. */
#define _GNU_SOURCE /* clock_gettime */
#include "scenarios/common/loader.h"

#include <math.h>
#include <time.h>

enum { STEPS = 1000, SCENES = 32, LENGTH = 32 };
static const double H = 1e-3; /* s */

typedef struct {
    size_t flags, inputs, outputs, unknowns;
    int order;
    fmi2ValueReference flag[LENGTH], input[LENGTH], output[LENGTH], unknown[LENGTH];
    double value[LENGTH], window_value;
    fmi2ValueReference window;
} Scene;

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

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    (void)environment;
    (void)name;
    (void)status;
    (void)category;
    fprintf(stderr, "%s\n", message);
}

/* ---- scenes ---- */

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
static int read_scene(Scene *scene) {
    if (scanf("%zu", &scene->flags) != 1)
        return 0;
    demand(scene->flags <= LENGTH, "too many flags");
    for (size_t i = 0; i < scene->flags; ++i)
        demand(scanf("%u", &scene->flag[i]) == 1, "a flag is missing");
    demand(scanf("%u %lf", &scene->window, &scene->window_value) == 2, "the window is missing");
    scene->inputs = read_length();
    demand(scene->inputs > 0, "a scene needs the crank's angle");
    for (size_t i = 0; i < scene->inputs; ++i)
        demand(scanf("%u %lf", &scene->input[i], &scene->value[i]) == 2, "an input is missing");
    demand(scanf("%d", &scene->order) == 1 && scene->order >= 0 && scene->order <= 2, "bad order");
    scene->outputs = read_references(scene->output);
    scene->unknowns = read_references(scene->unknown);
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

static double measure_steps(const Scene *scene) {
    static const fmi2Boolean yes[LENGTH] = {fmi2True, fmi2True, fmi2True, fmi2True};
    static const fmi2Integer orders[] = {1, 2};
    static const double seed = 1.0;
    double speed = scene->value[0], input[LENGTH], output[LENGTH] = {0.0}, slope[LENGTH] = {0.0};
    const double derivative[] = {speed, 0.0};
    const fmi2ValueReference angle[] = {scene->input[0], scene->input[0]};
    for (size_t i = 0; i < scene->inputs; ++i)
        input[i] = scene->value[i];
    demand(reset(instance) == fmi2OK, "reset");
    demand(setup(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    if (scene->flags > 0)
        demand(set_boolean(instance, scene->flag, scene->flags, yes) == fmi2OK, "flags");
    demand(set_real(instance, &scene->window, 1, &scene->window_value) == fmi2OK, "window");
    demand(enter(instance) == fmi2OK && leave(instance) == fmi2OK, "initialize");
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double t = i * H;
        input[0] = t * speed;
        int failed = set_real(instance, scene->input, scene->inputs, input) != fmi2OK;
        if (scene->order > 0)
            failed |= set_derivatives(instance, angle, (size_t)scene->order, orders, derivative)
                      != fmi2OK;
        failed |= do_step(instance, t, H, fmi2True) != fmi2OK;
        if (scene->outputs > 0)
            failed |= get_real(instance, scene->output, scene->outputs, output) != fmi2OK;
        if (scene->unknowns > 0)
            failed |=
                get_directional(instance, scene->unknown, scene->unknowns, angle, 1, &seed, slope)
                != fmi2OK;
        demand(!failed, "step");
        sum += output[0] + slope[0];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

int main(int count, char **arguments) {
    static Scene scenes[SCENES];
    demand(count == 4, "usage: scene_cost LIBRARY GUID ROUNDS < SCENES");
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
    instance = instantiate("scene_cost", fmi2CoSimulation, arguments[2], "", &callbacks, fmi2False,
                           fmi2False);
    demand(instance != NULL, "no instance");

    size_t used = 0;
    while (used < SCENES && read_scene(&scenes[used]))
        ++used;
    demand(used > 0, "no scene");
    for (int round = atoi(arguments[3]); round > 0; --round) {
        printf("%g", measure_sincos(scenes[0].value[0]));
        for (size_t i = 0; i < used; ++i)
            printf(",%g", measure_steps(&scenes[i]));
        putchar('\n');
    }
    return 0;
}
