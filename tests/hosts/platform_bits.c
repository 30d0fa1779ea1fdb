/* What the FMU answers as a co-simulation, to the last bit, for a fixed sequence of calls: LIBRARY
 * TOKEN. Compiled with -DFMI=2 or -DFMI=3. One line a call on standard output: what, status, and
 * each number as its 16 hexadecimal digits; messages as they are. The inputs come from integers and
 * the four operations of arithmetic alone, so that they are the same on every platform;
 * foreign_platforms.py compares the lines. POSIX and Windows. */
#include "scenarios/common/loader.h"
#if FMI == 3
#include "fmi3Functions.h"
#endif

#include <stdint.h>

/* Value references, and how many of each kind follow each other. */
enum { PHI = 2, INPUTS = 6, FIRST_OUTPUT = 8, FIRST_OUTPUTS = 16, MACHINE_S = 21 };
enum { FIRST_PARAMETER = 24, PARAMETERS = 18, AT_STEP_END = 42, SMOOTHING };
enum { FIRST_MASS = 45, MASSES = 25 /* of 6 bodies, 4 each, and gravity */ };
enum {
    OUTPUT_OF_MASSES = 70,
    OUTPUTS_OF_MASSES = 4,
    FIRST_LOCAL = 74,
    LOCALS = 40,
    REFERENCES = 114
};
enum { OUTPUTS = FIRST_OUTPUTS + OUTPUTS_OF_MASSES };
/* Inputs, machine.s, and in initialization geometry and masses. */
enum { KNOWNS = INPUTS + 1 + PARAMETERS + MASSES };
enum { GEOMETRIES = 40, STEPS = 250, DISCARD = 2 /* in both versions */ };

static void *library;
static unsigned references[REFERENCES], outputs[OUTPUTS], knowns[KNOWNS];

typedef void (*Function)(void);

static Function function(const char *name) {
    Function found;
    load_function(library, name, &found);
    return found;
}

/* ---- the two versions of FMI -------------------------------------------------------------- */

#if FMI == 3

#define CALL(name) ((fmi3##name##TYPE *)function("fmi3" #name))
#define CALL_STATE(name) ((fmi3##name##FMUStateTYPE *)function("fmi3" #name "FMUState"))
typedef fmi3FMUState State;
typedef fmi3Status Status;

static void tell_message(fmi3InstanceEnvironment environment, fmi3Status status,
                         fmi3String category, fmi3String message) {
    (void)environment;
    printf("message %d %s %s\n", (int)status, category, message);
}

static void *begin(const char *token) {
    return CALL(InstantiateCoSimulation)("bits", token, "", false, true, false, false, NULL, 0,
                                         NULL, tell_message, NULL);
}

static Status enter(void *c) {
    return CALL(EnterInitializationMode)(c, false, 0.0, 0.0, false, 0.0);
}

static Status set(void *c, int first, size_t count, const double values[]) {
    return CALL(SetFloat64)(c, references + first, count, values, count);
}

static Status get(void *c, int first, size_t count, double values[]) {
    return CALL(GetFloat64)(c, references + first, count, values, count);
}

static Status set_flag(void *c, int reference, int value) {
    bool flag = value != 0;
    return CALL(SetBoolean)(c, references + reference, 1, &flag, 1);
}

/* FMI 3.0 has no derivatives of inputs. */
static Status set_slopes(void *c, const double slopes[2]) {
    (void)c, (void)slopes;
    return fmi3OK;
}

static Status get_slopes(void *c, const unsigned of[], size_t count, const int orders[],
                         double values[]) {
    return CALL(GetOutputDerivatives)(c, of, count, orders, values, count);
}

static Status get_forward(void *c, const unsigned of[], size_t count, const double seeds[],
                          double values[OUTPUTS]) {
    return CALL(GetDirectionalDerivative)(c, outputs, OUTPUTS, of, count, seeds, count, values,
                                          OUTPUTS);
}

static Status get_adjoint(void *c, const unsigned of[], size_t count, const double seeds[OUTPUTS],
                          double values[]) {
    return CALL(GetAdjointDerivative)(c, outputs, OUTPUTS, of, count, seeds, OUTPUTS, values,
                                      count);
}

static Status step(void *c, double time, double h) {
    bool event, terminate, early;
    double last;
    return CALL(DoStep)(c, time, h, true, &event, &terminate, &early, &last);
}

#else

#define CALL(name) ((fmi2##name##TYPE *)function("fmi2" #name))
#define CALL_STATE(name) ((fmi2##name##FMUstateTYPE *)function("fmi2" #name "FMUstate"))
typedef fmi2FMUstate State;
typedef fmi2Status Status;

static void tell_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                         fmi2String category, fmi2String message, ...) {
    (void)environment, (void)name;
    printf("message %d %s %s\n", (int)status, category, message);
}

static void *begin(const char *token) {
    static const fmi2CallbackFunctions callbacks = {tell_message, calloc, free, NULL, NULL};
    return CALL(Instantiate)("bits", fmi2CoSimulation, token, "", &callbacks, fmi2False, fmi2True);
}

static Status enter(void *c) {
    CALL(SetupExperiment)(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    return CALL(EnterInitializationMode)(c);
}

static Status set(void *c, int first, size_t count, const double values[]) {
    return CALL(SetReal)(c, references + first, count, values);
}

static Status get(void *c, int first, size_t count, double values[]) {
    return CALL(GetReal)(c, references + first, count, values);
}

static Status set_flag(void *c, int reference, int value) {
    return CALL(SetBoolean)(c, references + reference, 1, &value);
}

static Status set_slopes(void *c, const double slopes[2]) {
    static const int orders[] = {1, 2};
    static const unsigned both[] = {PHI, PHI};
    return CALL(SetRealInputDerivatives)(c, both, 2, orders, slopes);
}

static Status get_slopes(void *c, const unsigned of[], size_t count, const int orders[],
                         double values[]) {
    return CALL(GetRealOutputDerivatives)(c, of, count, orders, values);
}

static Status get_forward(void *c, const unsigned of[], size_t count, const double seeds[],
                          double values[OUTPUTS]) {
    return CALL(GetDirectionalDerivative)(c, outputs, OUTPUTS, of, count, seeds, values);
}

/* FMI 2.0 has no adjoint derivatives. */
static Status get_adjoint(void *c, const unsigned of[], size_t count, const double seeds[OUTPUTS],
                          double values[]) {
    (void)c, (void)of, (void)count, (void)seeds, (void)values;
    return fmi2OK;
}

static Status step(void *c, double time, double h) { return CALL(DoStep)(c, time, h, fmi2True); }

#endif

/* ---- the same numbers everywhere ---------------------------------------------------------- */

/* From -1 up to 1, in steps of 2^-31. */
static double draw(void) {
    static uint64_t seed = 65;
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(uint32_t)(seed >> 32) / 2147483648.0 - 1.0;
}

static void show(const char *what, Status status, const double values[], int count) {
    printf("%s %d", what, (int)status);
    for (int i = 0; i < count; ++i) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        printf(" %08lx%08lx", (unsigned long)(bits >> 32), (unsigned long)(bits & 0xffffffff));
    }
    printf("\n");
}

/* ---- calls -------------------------------------------------------------------------------- */

static void show_outputs(void *c) {
    double values[FIRST_OUTPUTS] = {0}, of_masses[OUTPUTS_OF_MASSES + LOCALS] = {0};
    Status status = get(c, FIRST_OUTPUT, FIRST_OUTPUTS, values);
    show("outputs", status, values, FIRST_OUTPUTS);
    status = get(c, OUTPUT_OF_MASSES, OUTPUTS_OF_MASSES + LOCALS, of_masses);
    show("of masses", status, of_masses, OUTPUTS_OF_MASSES + LOCALS);
}

/* Along each known alone, then along all at once; the other way about; by time. */
static void show_derivatives(void *c, size_t count) {
    static const double one = 1.0;
    unsigned of[2 * OUTPUTS];
    int orders[2 * OUTPUTS];
    double values[2 * OUTPUTS] = {0}, seeds[KNOWNS], gradient[KNOWNS] = {0}, weights[OUTPUTS];
    for (int i = 0; i < 2 * OUTPUTS; ++i) {
        of[i] = outputs[i % OUTPUTS];
        orders[i] = 1 + i / OUTPUTS;
    }
    show("by time", get_slopes(c, of, 2 * OUTPUTS, orders, values), values, 2 * OUTPUTS);
    for (int i = 0; i < KNOWNS; ++i)
        seeds[i] = draw();
    for (size_t i = 0; i < count; ++i)
        show("along", get_forward(c, knowns + i, 1, &one, values), values, OUTPUTS);
    show("along all", get_forward(c, knowns, count, seeds, values), values, OUTPUTS);
    for (int k = 0; k < OUTPUTS; ++k) {
        for (int i = 0; i < OUTPUTS; ++i)
            weights[i] = i == k;
        show("gradient", get_adjoint(c, knowns, count, weights, gradient), gradient, (int)count);
    }
    for (int i = 0; i < OUTPUTS; ++i)
        weights[i] = draw();
    show("adjoint", get_adjoint(c, knowns, count, weights, gradient), gradient, (int)count);
}

static void show_state(void *c) {
    State state = NULL;
    size_t size = 0;
    CALL_STATE(Get)(c, &state);
#if FMI == 3
    CALL(SerializedFMUStateSize)(c, state, &size);
#else
    CALL(SerializedFMUstateSize)(c, state, &size);
#endif
    unsigned char *bytes = calloc(size, 1);
    Status status = CALL_STATE(Serialize)(c, state, (void *)bytes, size);
    printf("state %d ", (int)status);
    for (size_t i = 0; i < size; ++i)
        printf("%02x", bytes[i]);
    printf("\n");
    free(bytes);
    CALL_STATE(Free)(c, &state);
}

/* One geometry along one motion, until a pose cannot be reached. */
static void play(void *c, int geometry) {
    int given = geometry % 4; /* angle; and speed; and acceleration; the latter as derivatives */
    double h = 1.0 / (1 << (4 + geometry % 8)), speed = 5.0 + 3.0 * draw(), phi = 100.0 * draw();
    double parameters[PARAMETERS] = {0};
    CALL(Reset)(c);
    show("enter", enter(c), NULL, 0);
    show("nominal", get(c, FIRST_PARAMETER, PARAMETERS, parameters), parameters, PARAMETERS);
    for (int i = 0; i < PARAMETERS;
         ++i) /* the later ones so far off that some poses cannot close */
        parameters[i] *= 1.0 + geometry * 0.006 * draw();
    show("changed", set(c, FIRST_PARAMETER, PARAMETERS, parameters), parameters, PARAMETERS);
    double masses[MASSES];
    for (int i = 0; i < MASSES; ++i) /* m, x, y, J; every fourth geometry has none */
        masses[i] =
            geometry % 4 == 3 ? 0.0 : (i % 4 == 1 || i % 4 == 2 ? 0.1 : 0.5) * (1.0 + draw());
    show("masses", set(c, FIRST_MASS, MASSES, masses), masses, MASSES);
    show("at step end", set_flag(c, AT_STEP_END, geometry % 5 == 4), NULL, 0);
    const double window = geometry % 7 == 6 ? 10.0 * h : 0.0;
    show("smoothing", set(c, SMOOTHING, 1, &window), &window, 1);
    for (int i = -1; i < STEPS; ++i) {
        double w = speed * (1.0 + 0.3 * draw()), a = 20.0 * draw();
        const double inputs[INPUTS] = {phi,
                                       given == 1 || given == 2 ? w : 0.0,
                                       given == 2 ? a : 0.0,
                                       0.06 * w,
                                       30.0 * draw(),
                                       100.0 * draw()};
        const double slopes[] = {w, a};
        show("inputs", set(c, PHI, INPUTS, inputs), inputs, INPUTS);
        Status status;
        if (i < 0)
            show_derivatives(c, KNOWNS);
        if (given == 3 && i >= 0)
            show("slopes", set_slopes(c, slopes), NULL, 0);
        status = i < 0 ? CALL(ExitInitializationMode)(c) : step(c, i * h, h);
        show("step", status, NULL, 0);
        if ((int)status >= DISCARD)
            return;
        show_outputs(c);
        if (i % 10 == 0)
            show_derivatives(c, INPUTS + 1);
        if (i % 50 == 0)
            show_state(c);
        phi += i < 0 ? 0.0 : w * h;
    }
}

int main(int count, char *arguments[]) {
    if (count != 3)
        return 2;
    library = open_library(arguments[1]);
    for (unsigned i = 0; i < REFERENCES; ++i)
        references[i] = i;
    for (unsigned i = 0; i < OUTPUTS; ++i)
        outputs[i] = i < FIRST_OUTPUTS ? FIRST_OUTPUT + i : OUTPUT_OF_MASSES + i - FIRST_OUTPUTS;
    for (unsigned i = 0; i < KNOWNS; ++i)
        knowns[i] = i < INPUTS                 ? PHI + i
                    : i == INPUTS              ? MACHINE_S
                    : i <= INPUTS + PARAMETERS ? FIRST_PARAMETER + i - INPUTS - 1
                                               : FIRST_MASS + i - INPUTS - 1 - PARAMETERS;
    void *c = begin(arguments[2]);
    if (c == NULL)
        return 1;
    for (int geometry = 0; geometry < GEOMETRIES; ++geometry)
        play(c, geometry);
    CALL(FreeInstance)(c);
    printf("done\n");
    return 0;
}
