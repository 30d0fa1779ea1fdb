/* A host with a floating-point environment of its own: other rounding modes, denormal numbers
 * flushed to zero, exceptions that end the process. The FMU must work in it, and leave it.
 *
 *   environment LIBRARY GUID
 *
 * A story of calls is told once in the environment that C starts with, then in each other one.
 * Prints, for each, its name, the greatest deviation of any output from the first telling (over
 * the output's own greatest value, or 1), and how many calls changed the environment; for the
 * exceptions, the call in which one struck, if any. GNU, x86-64. */
#define _GNU_SOURCE
#include "component/interface.h"
#include "scenarios/common/loader.h"

#include <fenv.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <string.h>
#include <xmmintrin.h>

enum {
    OUTPUTS = VARIABLE_ASSEMBLY_MARGIN - VARIABLE_TIP_X + 1,
    MOST_ROWS = 4000,
    STATE_SIZE = 8192
};
enum { FLAGS = 0x3f, FLUSH_TO_ZERO = 0x8000, DENORMALS_ARE_ZERO = 0x40 };

static Fmu fmu;
static fmi2GetRealOutputDerivativesTYPE *get_output_derivatives;
static fmi2SetRealInputDerivativesTYPE *set_input_derivatives;
static fmi2GetDirectionalDerivativeTYPE *get_directional_derivative;
static fmi2GetFMUstateTYPE *get_state;
static fmi2SetFMUstateTYPE *set_state;
static fmi2FreeFMUstateTYPE *free_state;
static fmi2SerializedFMUstateSizeTYPE *serialized_size;
static fmi2SerializeFMUstateTYPE *serialize;
static fmi2DeSerializeFMUstateTYPE *deserialize;

static const char *calling = "nothing";
static int changes;
static unsigned environment; /* the control bits that the host has set */

static unsigned control(void) { return _mm_getcsr() & ~(unsigned)FLAGS; }

/* One call, after which the environment must be the host's. */
#define CALL(expression)                                                                           \
    do {                                                                                           \
        calling = #expression;                                                                     \
        fmi2Status status = expression;                                                            \
        changes += control() != environment;                                                       \
        demand(status == fmi2OK, #expression);                                                     \
    } while (0)

/* ---- the story ------------------------------------------------------------------------------- */

static double told[MOST_ROWS][OUTPUTS], first[MOST_ROWS][OUTPUTS];
static int rows;

static fmi2ValueReference outputs[OUTPUTS];
static const fmi2ValueReference inputs[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W, VARIABLE_CRANK_A,
                                            VARIABLE_MACHINE_V, VARIABLE_TIP_FX,  VARIABLE_TIP_FY};

static void tell(fmi2Component c) {
    demand(rows < MOST_ROWS, "a longer story than expected");
    CALL(fmu.get_real(c, outputs, OUTPUTS, told[rows++]));
}

static void set(fmi2Component c, fmi2ValueReference reference, double value) {
    CALL(fmu.set_real(c, &reference, 1, &value));
}

static void begin(fmi2Component c, double phi) {
    CALL(fmu.setup(c, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    CALL(fmu.enter(c));
    set(c, VARIABLE_CRANK_PHI, phi);
    tell(c);
}

/* Steps from rest, from standstill into motion, a wrap, a jump, steps of all sizes, forces. */
static void drive(fmi2Component c, int given) {
    double t = 0.0;
    begin(c, 1.0);
    CALL(fmu.leave(c));
    for (int i = 0; i < 240; ++i) {
        double h = i % 40 == 17 ? 1e-9 : i % 40 == 30 ? 0.1 : 1e-3 * (1 + i % 3);
        double w = i < 20 ? 0.0 : 6.8, phi = i < 20 ? 1.0 : 1.0 + 6.8 * t;
        if (i >= 120)
            phi = fmod(phi, 6.283185307179586);
        if (i >= 180)
            phi += 2.5; /* a jump */
        double value[] = {phi, w, i % 2 ? 0.0 : -0.0, 0.4 + 0.1 * t, 1e-310 * i, -80.0};
        CALL(fmu.set_real(c, inputs, 1, value));
        CALL(fmu.set_real(c, inputs + 3, 3, value + 3));
        if (given)
            CALL(fmu.set_real(c, inputs + 1, 2, value + 1));
        CALL(fmu.do_step(c, t, h, fmi2True));
        t += h;
        tell(c);
    }
}

static void differentiate(fmi2Component c) {
    fmi2Integer order[OUTPUTS];
    double value[OUTPUTS], seed[] = {1.0, -1.0, 0.0, 1e-310, 3.0, -0.0};
    for (int n = 1; n <= 2; ++n) {
        for (int i = 0; i < OUTPUTS; ++i)
            order[i] = n;
        CALL(get_output_derivatives(c, outputs, OUTPUTS, order, value));
    }
    CALL(get_directional_derivative(c, outputs, OUTPUTS, inputs, 6, seed, value));
    fmi2Integer both[] = {1, 2};
    fmi2ValueReference phi_twice[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_PHI};
    double rates[] = {0.5, 0.0};
    CALL(set_input_derivatives(c, phi_twice, 2, both, rates));
}

static void keep_and_restore(fmi2Component c) {
    static fmi2Byte bytes[STATE_SIZE];
    fmi2FMUstate state = NULL, read = NULL;
    size_t size;
    CALL(get_state(c, &state));
    CALL(serialized_size(c, state, &size));
    demand(size <= STATE_SIZE, "a larger state than expected");
    CALL(serialize(c, state, bytes, size));
    CALL(deserialize(c, bytes, size, &read));
    CALL(set_state(c, read));
    CALL(free_state(c, &state));
    CALL(free_state(c, &read));
    tell(c);
}

/* The neighbourhood of a dead point, at which a base of 1/4 m, exact in binary, is stretched
 * (is_fold: folded): down to 1e-12 m of it, and beyond, where there is no pose. */
static void approach(fmi2Component c, int is_fold) {
    static const fmi2ValueReference lengths[] = {
        VARIABLE_GEOMETRY_L1, VARIABLE_GEOMETRY_L4, VARIABLE_GEOMETRY_XC, VARIABLE_GEOMETRY_YC,
        VARIABLE_GEOMETRY_XG, VARIABLE_GEOMETRY_YG, VARIABLE_GEOMETRY_L6, VARIABLE_GEOMETRY_L7,
        VARIABLE_GEOMETRY_L5, VARIABLE_GEOMETRY_L3};
    static const double metres[] = {0.0, 0.0, 0.25, 0.0, 1.0, 0.0, 1.0, 1.0, 0.05, 0.125};
    begin(c, 0.0);
    CALL(fmu.set_real(c, lengths, sizeof metres / sizeof metres[0], metres));
    set(c, VARIABLE_CRANK_W, 1.0);
    for (int n = 1; n <= 12; ++n) {
        double gap = pow(10.0, -n), value;
        set(c, VARIABLE_GEOMETRY_L2, is_fold ? 0.375 - gap : 0.125 + gap);
        if (n <= 6)
            tell(c); /* nearer, other roundings of L2 itself are other linkages */
        else
            CALL(fmu.get_real(c, outputs, 1, &value));
    }
    for (int n = 1; n <= 12; ++n) {
        double beyond = n == 12 ? 0.0 : pow(10.0, -n), value;
        set(c, VARIABLE_GEOMETRY_L2, is_fold ? 0.375 + beyond : 0.125 - beyond);
        calling = "reading where there is no pose";
        demand(fmu.get_real(c, outputs, 1, &value) == fmi2Discard, calling);
        changes += control() != environment;
    }
}

static void tell_story(const char *guid) {
    rows = 0;
    calling = "fmi2Instantiate";
    fmi2Component c = new_instance(&fmu, guid);
    for (int given = 0; given < 2; ++given) {
        drive(c, given);
        differentiate(c);
        keep_and_restore(c);
        CALL(fmu.reset(c));
    }
    for (int is_fold = 0; is_fold < 2; ++is_fold) {
        approach(c, is_fold);
        CALL(fmu.reset(c));
    }
    calling = "fmi2FreeInstance";
    fmu.release(c);
    calling = "nothing";
}

/* ---- environments ------------------------------------------------------------------------------
 */

static double deviation(void) {
    double greatest[OUTPUTS], worst = 0.0;
    for (int i = 0; i < OUTPUTS; ++i)
        greatest[i] = 1.0;
    for (int row = 0; row < rows; ++row)
        for (int i = 0; i < OUTPUTS; ++i)
            greatest[i] = fmax(greatest[i], fabs(first[row][i]));
    for (int row = 0; row < rows; ++row)
        for (int i = 0; i < OUTPUTS; ++i)
            worst = fmax(worst, fabs(told[row][i] - first[row][i]) / greatest[i]);
    return worst;
}

static sigjmp_buf struck;

static void strike(int number) {
    (void)number;
    siglongjmp(struck, 1);
}

static void try_environment(const char *name, const char *guid, int rounding, unsigned set_bits,
                            int exceptions) {
    changes = 0;
    feclearexcept(FE_ALL_EXCEPT);
    fesetround(rounding);
    _mm_setcsr((_mm_getcsr() | set_bits) & ~(unsigned)FLAGS);
    if (exceptions)
        feenableexcept(exceptions);
    environment = control();
    const char *victim = "nothing";
    if (sigsetjmp(struck, 1) == 0)
        tell_story(guid);
    else
        victim = calling;
    fedisableexcept(FE_ALL_EXCEPT);
    fesetround(FE_TONEAREST);
    _mm_setcsr(_mm_getcsr() & ~(set_bits | (unsigned)FLAGS));
    printf("%s;%.3g;%d;%s\n", name, deviation(), changes, victim);
}

int main(int count, char **arguments) {
    demand(count == 3, "usage: environment LIBRARY GUID");
    fmu = load_fmu(arguments[1]);
    void *library = fmu.library;
    load_function(library, "fmi2GetRealOutputDerivatives", &get_output_derivatives);
    load_function(library, "fmi2SetRealInputDerivatives", &set_input_derivatives);
    load_function(library, "fmi2GetDirectionalDerivative", &get_directional_derivative);
    load_function(library, "fmi2GetFMUstate", &get_state);
    load_function(library, "fmi2SetFMUstate", &set_state);
    load_function(library, "fmi2FreeFMUstate", &free_state);
    load_function(library, "fmi2SerializedFMUstateSize", &serialized_size);
    load_function(library, "fmi2SerializeFMUstate", &serialize);
    load_function(library, "fmi2DeSerializeFMUstate", &deserialize);
    for (unsigned i = 0; i < OUTPUTS; ++i)
        outputs[i] = VARIABLE_TIP_X + i;
    struct sigaction action = {.sa_handler = strike};
    sigaction(SIGFPE, &action, NULL);

    const char *guid = arguments[2];
    environment = control();
    tell_story(guid);
    memcpy(first, told, sizeof first);
    try_environment("round to nearest, again", guid, FE_TONEAREST, 0, 0);
    try_environment("round upward", guid, FE_UPWARD, 0, 0);
    try_environment("round downward", guid, FE_DOWNWARD, 0, 0);
    try_environment("round toward zero", guid, FE_TOWARDZERO, 0, 0);
    try_environment("denormals to zero", guid, FE_TONEAREST, FLUSH_TO_ZERO | DENORMALS_ARE_ZERO, 0);
    try_environment("exceptions unmasked", guid, FE_TONEAREST, 0,
                    FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
    return 0;
}
