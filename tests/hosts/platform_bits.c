/* What the FMU answers, to the last bit, for a fixed sequence of calls: LIBRARY TOKEN. One line a
 * call on standard output: what, status, and each number as its 16 hexadecimal digits; messages as
 * they are. The inputs come from integers and the four operations of arithmetic alone, so that they
 * are the same on every platform; foreign_platforms.py compares the lines. POSIX and Windows. */
#include "fmi2Functions.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
static void *load(const char *path) { return (void *)LoadLibraryA(path); }
static void *find(void *library, const char *name) {
    FARPROC address = GetProcAddress((HMODULE)library, name);
    void *found;
    memcpy(&found, &address, sizeof found);
    return found;
}
#else
#include <dlfcn.h>
static void *load(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *find(void *library, const char *name) { return dlsym(library, name); }
#endif

enum {
    FIRST_INPUT = 2,
    INPUTS = 6,
    FIRST_OUTPUT = 8,
    OUTPUTS = 16,
    FIRST_PARAMETER = 24,
    PARAMETERS = 18,
    AT_STEP_END = 42,
    GEOMETRIES = 40,
    STEPS = 250
};

#define FUNCTIONS(each)                                                                            \
    each(Instantiate) each(FreeInstance) each(SetupExperiment) each(EnterInitializationMode)       \
        each(ExitInitializationMode) each(Reset) each(GetReal) each(SetReal) each(SetBoolean)      \
            each(SetRealInputDerivatives) each(GetRealOutputDerivatives)                           \
                each(GetDirectionalDerivative) each(DoStep) each(GetFMUstate) each(FreeFMUstate)   \
                    each(SerializedFMUstateSize) each(SerializeFMUstate)
#define DECLARE(name) static fmi2##name##TYPE *name;
FUNCTIONS(DECLARE)

static void need(void *library, const char *name, void *function) {
    void *address = find(library, name);
    if (address == NULL) {
        fprintf(stderr, "%s is not there\n", name);
        exit(1);
    }
    memcpy(function, &address, sizeof address);
}

/* ---- the same numbers everywhere ---------------------------------------------------------------
 */

static uint64_t seed = 65;

/* From -1 up to 1, in steps of 2^-31. */
static double draw(void) {
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(uint32_t)(seed >> 32) / 2147483648.0 - 1.0;
}

static void show(const char *what, fmi2Status status, const double values[], int count) {
    printf("%s %d", what, (int)status);
    for (int i = 0; i < count; ++i) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        printf(" %08lx%08lx", (unsigned long)(bits >> 32), (unsigned long)(bits & 0xffffffff));
    }
    printf("\n");
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                          fmi2String category, fmi2String message, ...) {
    (void)environment;
    printf("message %s %d %s %s\n", name, (int)status, category, message);
}

/* ---- calls ---------------------------------------------------------------------------------- */

static fmi2ValueReference references[AT_STEP_END + 1];

static void show_outputs(fmi2Component c) {
    double values[OUTPUTS] = {0};
    fmi2Status status = GetReal(c, references + FIRST_OUTPUT, OUTPUTS, values);
    show("outputs", status, values, OUTPUTS);
}

static void show_derivatives(fmi2Component c) {
    static const fmi2Integer orders[] = {1, 1, 2, 2, 1};
    static const fmi2ValueReference of[] = {8, 9, 8, 9, 21};
    const double one = 1.0;
    double values[10] = {0}, by_angle[10] = {0};
    fmi2Status status = GetRealOutputDerivatives(c, of, 5, orders, values);
    show("output derivatives", status, values, 5);
    status = GetDirectionalDerivative(c, references + FIRST_OUTPUT, 7, references + FIRST_INPUT, 1,
                                      &one, by_angle);
    show("directional derivatives", status, by_angle, 7);
}

static void show_state(fmi2Component c) {
    fmi2FMUstate state = NULL;
    size_t size = 0;
    GetFMUstate(c, &state);
    SerializedFMUstateSize(c, state, &size);
    unsigned char *bytes = calloc(size, 1);
    fmi2Status status = SerializeFMUstate(c, state, (fmi2Byte *)bytes, size);
    printf("state %d %lu ", (int)status, (unsigned long)size);
    for (size_t i = 0; i < size; ++i)
        printf("%02x", bytes[i]);
    printf("\n");
    free(bytes);
    FreeFMUstate(c, &state);
}

/* One geometry along one motion; `way` says what of the crank is given. */
static void play(fmi2Component c, int geometry) {
    int way = geometry % 4;
    fmi2Boolean at_step_end = geometry % 5 == 4;
    double h = 1.0 / (1 << (4 + geometry % 8)), speed = 5.0 + 3.0 * draw(), phi = 100.0 * draw();
    double parameters[PARAMETERS] = {0}, values[INPUTS];
    Reset(c);
    SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    show("enter", EnterInitializationMode(c), NULL, 0);
    show("parameters", GetReal(c, references + FIRST_PARAMETER, PARAMETERS, parameters), parameters,
         PARAMETERS);
    for (int i = 0; i < PARAMETERS;
         ++i) /* the later ones so far off that some poses cannot close */
        parameters[i] *= 1.0 + geometry * 0.006 * draw();
    show("parameters", SetReal(c, references + FIRST_PARAMETER, PARAMETERS, parameters), parameters,
         PARAMETERS);
    SetBoolean(c, references + AT_STEP_END, 1, &at_step_end);
    for (int step = -1; step < STEPS; ++step) {
        double w = speed * (1.0 + 0.3 * draw()), a = 20.0 * draw();
        const double given[INPUTS] = {phi,      way > 0 ? w : 0.0, way > 1 ? a : 0.0,
                                      0.06 * w, 30.0 * draw(),     100.0 * draw()};
        memcpy(values, given, sizeof values);
        if (SetReal(c, references + FIRST_INPUT, INPUTS, values) > fmi2Warning)
            printf("inputs refused\n");
        if (step < 0) {
            show_outputs(c);
            show("leave", ExitInitializationMode(c), NULL, 0);
            continue;
        }
        if (way == 3) {
            static const fmi2Integer orders[] = {1, 2};
            static const fmi2ValueReference both[] = {FIRST_INPUT, FIRST_INPUT};
            const double slopes[] = {w, a};
            SetRealInputDerivatives(c, both, 2, orders, slopes);
        }
        fmi2Status status = DoStep(c, step * h, h, fmi2True);
        show("step", status, values, INPUTS);
        if (status > fmi2Warning)
            return;
        show_outputs(c);
        if (step % 10 == 0)
            show_derivatives(c);
        if (step % 50 == 0)
            show_state(c);
        phi += w * h;
    }
}

int main(int count, char *arguments[]) {
    static const fmi2CallbackFunctions callbacks = {print_message, calloc, free, NULL, NULL};
    if (count != 3)
        return 2;
    void *library = load(arguments[1]);
    if (library == NULL) {
        fprintf(stderr, "%s does not load\n", arguments[1]);
        return 1;
    }
#define NEED(name) need(library, "fmi2" #name, &name);
    FUNCTIONS(NEED)
    for (fmi2ValueReference i = 0; i <= AT_STEP_END; ++i)
        references[i] = i;
    fmi2Component c =
        Instantiate("bits", fmi2CoSimulation, arguments[2], "", &callbacks, fmi2False, fmi2True);
    if (c == NULL)
        return 1;
    for (int geometry = 0; geometry < GEOMETRIES; ++geometry)
        play(c, geometry);
    FreeInstance(c);
    printf("done\n");
    return 0;
}
