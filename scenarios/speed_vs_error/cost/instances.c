/* A small FMI 2.0 host that steps many instances in turns, and measures what a step costs where
 * the instances are few or many.
 *
 *   instances LIBRARY GUID ROUNDS COUNTS...
 *
 * The first line printed is the bytes that the FMU asks the host for, for one instance. Each line
 * after it is one round: nanoseconds of a step with three inputs set and six outputs read, one
 * number for each count of instances. All of one count are stepped in the order of their creation,
 * each as often as the others. */
#define _GNU_SOURCE /* clock_gettime */
#include "component/interface.h"
#include "scenarios/common/loader.h"
#include "scenarios/speed_vs_error/cost/clock.h"

enum { MOST_COUNTS = 16, STEPS = 10000 /* a round, at least */ };
static const double H = 1e-3, SPEED = 6.8067840827778845; /* s; rad/s: one turn in 0.923 s */

static const fmi2ValueReference IN[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W, VARIABLE_CRANK_A};
static const fmi2ValueReference OUT[] = {VARIABLE_TIP_X,  VARIABLE_TIP_Y,  VARIABLE_TIP_VX,
                                         VARIABLE_TIP_VY, VARIABLE_TIP_AX, VARIABLE_TIP_AY};

static Fmu fmu;
static size_t allocated; /* bytes, in all */

static void *allocate(size_t count, size_t size) {
    allocated += count * size;
    return calloc(count, size);
}

typedef struct {
    size_t count;
    size_t steps; /* that each has done */
    fmi2Component *instances;
} Row;

static void create(Row *row, const char *guid) {
    static const fmi2CallbackFunctions callbacks = {print_message, allocate, free, NULL, NULL};
    row->instances = calloc(row->count, sizeof *row->instances);
    demand(row->instances != NULL, "no memory for the instances");
    for (size_t i = 0; i < row->count; ++i) {
        fmi2Component c = row->instances[i] =
            fmu.create("one", fmi2CoSimulation, guid, "", &callbacks, fmi2False, fmi2False);
        demand(c != NULL, "no instance");
        demand(fmu.setup(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
        demand(fmu.enter(c) == fmi2OK && fmu.leave(c) == fmi2OK, "initialize");
    }
}

static volatile double sink;

/* Nanoseconds of a step. */
static double measure(Row *row) {
    double value[6] = {0.0}, sum = 0.0, begin = now();
    size_t done = 0;
    for (; done < STEPS; done += row->count, ++row->steps) {
        double t = (double)row->steps * H, input[3] = {t * SPEED, SPEED, 0.01};
        for (size_t i = 0; i < row->count; ++i) {
            fmi2Component c = row->instances[i];
            int failed = fmu.set_real(c, IN, 3, input) != fmi2OK;
            failed |= fmu.do_step(c, t, H, fmi2True) != fmi2OK;
            failed |= fmu.get_real(c, OUT, 6, value) != fmi2OK;
            demand(!failed, "step");
            sum += value[0] + value[5];
        }
    }
    sink = sum;
    return (now() - begin) / (double)done;
}

int main(int count, char **arguments) {
    demand(count > 4 && count <= 4 + MOST_COUNTS, "usage: instances LIBRARY GUID ROUNDS COUNTS...");
    static Row rows[MOST_COUNTS];
    int of_rows = count - 4;
    fmu = load_fmu(arguments[1]);
    size_t total = 0;
    for (int k = 0; k < of_rows; ++k) {
        total += rows[k].count = strtoul(arguments[4 + k], NULL, 10);
        create(&rows[k], arguments[2]);
        measure(&rows[k]); /* once for nothing: the pages are there then */
    }
    printf("%g\n", (double)allocated / (double)total);
    for (int round = atoi(arguments[3]); round > 0; --round)
        for (int k = 0; k < of_rows; ++k)
            printf("%g%c", measure(&rows[k]), k + 1 < of_rows ? ',' : '\n');
    for (int k = 0; k < of_rows; ++k) {
        for (size_t i = 0; i < rows[k].count; ++i)
            fmu.release(rows[k].instances[i]);
        free(rows[k].instances);
    }
    return 0;
}
