/* A small FMI 2.0 host that measures what a communication step costs, against the bare core
 * evaluated in the same process. Rounds of all measurements are interleaved; each line printed
 * is one round: nanoseconds per evaluation or step, in the order of the heading.
 *
 *   step_cost LIBRARY GUID ROUNDS */
#define _GNU_SOURCE /* sincos, clock_gettime, dlopen */
#include "component/interface.h"
#include "linkage/linkage.h"
#include "loader.h"

#include <math.h>
#include <time.h>

enum { STEPS = 2000 };
static const double H = 1e-3, SPEED = 6.8067840827778845; /* one turn in 0.923 s */

static Fmu fmu;
static fmi2Component instance;

static volatile double sink;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

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

static Linkage linkage;

static double measure_core(int order) {
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        LinkagePose pose;
        if (linkage_place(&linkage, (i + 1) * H * SPEED, &pose, NULL) != LINKAGE_CLOSED)
            continue;
        linkage_differentiate(&linkage, &pose, order);
        sum += pose.tip[0].x + pose.tip[0].y;
        if (order >= 1)
            sum += SPEED * pose.tip[1].x + SPEED * pose.tip[1].y;
        if (order >= 2)
            sum += SPEED * SPEED * pose.tip[2].x + SPEED * SPEED * pose.tip[2].y;
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

/* Steps with `inputs` of phi, w, a set and `outputs` of x, y, vx, vy, ax, ay read. */
static double measure_steps(size_t inputs, size_t outputs) {
    static const fmi2ValueReference in[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W, VARIABLE_CRANK_A};
    static const fmi2ValueReference out[] = {VARIABLE_TIP_X,  VARIABLE_TIP_Y,  VARIABLE_TIP_VX,
                                             VARIABLE_TIP_VY, VARIABLE_TIP_AX, VARIABLE_TIP_AY};
    double value[6] = {0.0}, input[3] = {0.0, SPEED, 0.01};
    demand(fmu.reset(instance) == fmi2OK, "reset");
    demand(fmu.setup(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    demand(fmu.enter(instance) == fmi2OK && fmu.leave(instance) == fmi2OK, "initialize");
    double sum = 0.0, begin = now();
    for (int i = 0; i < STEPS; ++i) {
        double t = i * H;
        input[0] = t * SPEED;
        int failed = fmu.set_real(instance, in, inputs, input) != fmi2OK;
        failed |= fmu.do_step(instance, t, H, fmi2True) != fmi2OK;
        if (outputs > 0)
            failed |= fmu.get_real(instance, out, outputs, value) != fmi2OK;
        demand(!failed, "step");
        sum += value[0] + value[5];
    }
    sink = sum;
    return (now() - begin) / STEPS;
}

int main(int count, char **arguments) {
    demand(count == 4, "usage: step_cost LIBRARY GUID ROUNDS");
    fmu = load_fmu(arguments[1]);
    instance = new_instance(&fmu, arguments[2]);

    LinkageGeometry geometry;
    double *parameter = (double *)&geometry;
    for (size_t i = 0; i < sizeof geometry / sizeof *parameter; ++i)
        parameter[i] = interface_variables[VARIABLE_GEOMETRY_L1 + i].start;
    linkage_prepare(&geometry, &linkage);

    puts("sincos,core_0,core_1,core_2,step_phi_w_a_get_6,step_phi_w_get_6,step_phi_get_6,"
         "step_phi_w_a_get_4,step_phi_w_a_get_2,step_phi_w_a_get_0");
    for (int round = atoi(arguments[3]); round > 0; --round)
        printf("%g,%g,%g,%g,%g,%g,%g,%g,%g,%g\n", measure_sincos(), measure_core(0),
               measure_core(1), measure_core(2), measure_steps(3, 6), measure_steps(2, 6),
               measure_steps(1, 6), measure_steps(3, 4), measure_steps(3, 2), measure_steps(3, 0));
    return 0;
}
