/* Ways of solving the linkage in C, called and timed alike: the core as the FMU is compiled, the
 * paper's equations, two position solutions that somebody in a hurry would write, the FMU itself,
 * and functions that somebody else generated. Each gives position, velocity and acceleration of
 * the tip (m, m/s, m/s2: x, y of each) at one crank angle, up to the order asked for, with the
 * crank at a constant speed. POSIX. */
#define _GNU_SOURCE /* sincos, clock_gettime */
#define INTERNAL static
#include "component/interface.h"
#include "linkage/linkage.c"
#include "linkage/mass.c"
#include "scenarios/common/loader.h"

#include <time.h>

#define EXPORTED __attribute__((visibility("default")))
#define INLINE inline __attribute__((always_inline)) /* so that the order is known */

enum { ORDERS = 3 };

static LinkageGeometry geometry;
static double speed; /* rad/s, in the working direction */

/* ---- the core ---- */

static Linkage linkage;

static INLINE void core(double phi, int order, double *out) {
    LinkagePose pose;
    linkage_place(&linkage, phi, &pose, NULL);
    linkage_differentiate(&linkage, &pose, order);
    out[0] = pose.tip[0].x;
    out[1] = pose.tip[0].y;
    if (order >= 1) {
        out[2] = speed * pose.tip[1].x;
        out[3] = speed * pose.tip[1].y;
    }
    if (order >= 2) {
        out[4] = speed * speed * pose.tip[2].x;
        out[5] = speed * speed * pose.tip[2].y;
    }
}

/* ---- inverse dynamics by the core: torque, inertia and bias of the masses that were given ---- */

typedef struct {
    double crank_a, gravity, force_x, force_y; /* rad/s2, m/s2, N on the tip */
} Load;

static double masses[sizeof(LinkageMasses) / sizeof(double)];
static LinkageInertia inertia;
static Load load_on;

static INLINE void core_dynamics(double phi, int order, double *out) {
    LinkagePose pose;
    LinkageMassJets jets;
    linkage_place(&linkage, phi, &pose, NULL);
    linkage_differentiate_masses(&linkage, &inertia, &pose, order, &jets);
    double bias = 0.5 * jets.inertia[1] * speed * speed + load_on.gravity * jets.moment[1].y
                  - load_on.force_x * pose.tip[1].x - load_on.force_y * pose.tip[1].y;
    out[0] = bias + jets.inertia[0] * load_on.crank_a;
    out[1] = jets.inertia[0];
    out[2] = bias;
}

/* ---- the paper's equations, mended where the print is wrong ----
 * Numbers in brackets are the paper's; fmu_src/oracle/printed_equations.py has them one by one.
 * Each sine and cosine is computed once; what does not change is computed beforehand. */

static INLINE void printed(double turned_by, int order, double *out) {
    const LinkageGeometry *g = &geometry;
    double phi = -turned_by, dphi1 = -speed, dphi4 = -speed;
    double c1 = cos(g->phi1 + phi), s1 = sin(g->phi1 + phi);
    double c4 = cos(g->phi4 + phi), s4 = sin(g->phi4 + phi);
    double X_A = g->L1 * c1, Y_A = g->L1 * s1;                               /* (1) */
    double X_D = g->XC + g->L4 * c4, Y_D = g->YC + g->L4 * s4;               /* (2) */
    double a = X_D - X_A, b = Y_D - Y_A;                                     /* (4) */
    double c = (a * a + b * b + g->L3 * g->L3 - g->L2 * g->L2) / (2 * g->L3);
    double phi3 = 2 * atan((b - sqrt(a * a + b * b - c * c)) / (a - c));
    double c3 = cos(phi3), s3 = sin(phi3);
    double phi5 = phi3 - g->theta3, c5 = cos(phi5), s5 = sin(phi5);          /* (5) */
    double X_E = X_D + g->L5 * c5, Y_E = Y_D + g->L5 * s5;
    double e_x = X_E - g->XG, e_y = Y_E - g->YG, square = e_x * e_x + e_y * e_y; /* (6) */
    double alpha = acos((square + g->L7 * g->L7 - g->L6 * g->L6) / (2 * g->L7 * sqrt(square)));
    double phi7 = alpha + atan2(e_y, e_x), c7 = cos(phi7), s7 = sin(phi7);
    double X_F = g->XG + g->L7 * c7, Y_F = g->YG + g->L7 * s7;               /* (7) */
    double phi6 = atan2(Y_F - Y_E, X_F - X_E);
    double phi8 = phi6 - 2 * QUARTER_TURN + g->theta8, phi9 = phi8 + g->theta9;
    double c8 = cos(phi8), s8 = sin(phi8), c9 = cos(phi9), s9 = sin(phi9);
    out[0] = (X_E + X_F) / 2 + g->L8 * c8 + g->L9 * c9;                      /* (8) */
    out[1] = (Y_E + Y_F) / 2 + g->L8 * s8 + g->L9 * s9;
    if (order < 1)
        return;

    double phi2 = atan2(Y_D + g->L3 * s3 - Y_A, X_D + g->L3 * c3 - X_A);     /* (3) */
    double c2 = cos(phi2), s2 = sin(phi2), c6 = cos(phi6), s6 = sin(phi6);
    double t3 = tan(phi3), s67 = sin(phi6 - phi7);
    double dphi2 = (g->L1 * dphi1 * s1 - g->L4 * dphi4 * s4 - g->L1 * dphi1 * c1 * t3
                    + g->L4 * dphi4 * c4 * t3)
                   / (g->L2 * c2 * t3 - g->L2 * s2);                         /* (10), mended */
    double dphi3 =
        (g->L1 * dphi1 * s1 + g->L2 * dphi2 * s2 - g->L4 * dphi4 * s4) / (g->L3 * s3); /* (11) */
    double dX_E = -g->L4 * dphi4 * s4 - g->L5 * dphi3 * s5; /* (12), mended */
    double dY_E = g->L4 * dphi4 * c4 + g->L5 * dphi3 * c5;
    double dphi6 = (dX_E * c7 + dY_E * s7) / (g->L6 * s67); /* (14) */
    double dphi7 = (dX_E * c6 + dY_E * s6) / (g->L7 * s67); /* (15) */
    double dX_F = -g->L7 * dphi7 * s7, dY_F = g->L7 * dphi7 * c7; /* (13) */
    out[2] = (dX_E + dX_F) / 2 - g->L8 * dphi6 * s8 - g->L9 * dphi6 * s9; /* (16) */
    out[3] = (dY_E + dY_F) / 2 + g->L8 * dphi6 * c8 + g->L9 * dphi6 * c9;
    if (order < 2)
        return;

    double t2 = tan(phi2), c67 = cos(phi6 - phi7);
    double w2 = dphi2 * dphi2, w3 = dphi3 * dphi3, w6 = dphi6 * dphi6, w7 = dphi7 * dphi7;
    double d = -g->L4 * dphi4 * dphi4 * c4 - g->L3 * w3 * c3; /* (18) */
    double e = -g->L1 * dphi1 * dphi1 * c1 - g->L2 * w2 * c2;
    double f = -g->L4 * dphi4 * dphi4 * s4 - g->L3 * w3 * s3;
    double g_ = -g->L1 * dphi1 * dphi1 * s1 - g->L2 * w2 * s2;
    double ddphi3 = (e - d + (g_ - f) * t2) / (g->L3 * c3 * t2 - g->L3 * s3); /* (19) */
    double ddX_E = -g->L4 * dphi4 * dphi4 * c4 - g->L5 * ddphi3 * s5 - g->L5 * w3 * c5;
    double ddY_E =
        -g->L4 * dphi4 * dphi4 * s4 + g->L5 * ddphi3 * c5 - g->L5 * w3 * s5; /* (20), m. */
    double ddphi6 =
        (ddX_E * c7 + ddY_E * s7 - g->L6 * w6 * c67 + g->L7 * w7) / (g->L6 * s67); /* (22) */
    double ddphi7 = (ddX_E * c6 + ddY_E * s6 - g->L6 * w6 + g->L7 * w7 * c67)
                    / (g->L7 * s67); /* (23), mended */
    double ddX_F = -g->L7 * ddphi7 * s7 - g->L7 * w7 * c7; /* (24) */
    double ddY_F = g->L7 * ddphi7 * c7 - g->L7 * w7 * s7;
    out[4] = (ddX_E + ddX_F) / 2 - g->L8 * ddphi6 * s8 - g->L8 * w6 * c8 /* (25) */
             - g->L9 * ddphi6 * s9 - g->L9 * w6 * c9;
    out[5] = (ddY_E + ddY_F) / 2 + g->L8 * ddphi6 * c8 - g->L8 * w6 * s8 + g->L9 * ddphi6 * c9
             - g->L9 * w6 * s9;
}

/* ---- two circles intersected by angles, and finite differences ---- */

/* Direction from q to the joint of links |p joint| and |q joint|, on the right of p to q. */
static double link_angle(double p_x, double p_y, double q_x, double q_y, double p_length,
                         double q_length) {
    double x = p_x - q_x, y = p_y - q_y, base = sqrt(x * x + y * y);
    return atan2(y, x)
           + acos((q_length * q_length + base * base - p_length * p_length)
                  / (2 * q_length * base));
}

static void naive_position(double phi, double *out) {
    const LinkageGeometry *g = &geometry;
    double A_x = g->L1 * cos(g->phi1 - phi), A_y = g->L1 * sin(g->phi1 - phi);
    double D_x = g->XC + g->L4 * cos(g->phi4 - phi), D_y = g->YC + g->L4 * sin(g->phi4 - phi);
    double phi5 = link_angle(A_x, A_y, D_x, D_y, g->L2, g->L3) - g->theta3;
    double E_x = D_x + g->L5 * cos(phi5), E_y = D_y + g->L5 * sin(phi5);
    double phi7 = link_angle(E_x, E_y, g->XG, g->YG, g->L6, g->L7);
    double F_x = g->XG + g->L7 * cos(phi7), F_y = g->YG + g->L7 * sin(phi7);
    double phi8 = atan2(F_y - E_y, F_x - E_x) - 2 * QUARTER_TURN + g->theta8;
    double phi9 = phi8 + g->theta9;
    out[0] = (E_x + F_x) / 2 + g->L8 * cos(phi8) + g->L9 * cos(phi9);
    out[1] = (E_y + F_y) / 2 + g->L8 * sin(phi8) + g->L9 * sin(phi9);
}

/* The steps of central differences: at them, their error and the rounding's are alike. */
static INLINE void naive(double phi, int order, double *out) {
    const double step = order == 1 ? 1e-5 : 2e-4;
    double before[2], after[2];
    naive_position(phi, out);
    if (order < 1)
        return;
    naive_position(phi - step, before);
    naive_position(phi + step, after);
    for (int i = 0; i < 2; ++i) {
        out[2 + i] = (after[i] - before[i]) * (speed / (2 * step));
        if (order >= 2)
            out[4 + i] =
                ((after[i] - out[i]) - (out[i] - before[i])) * (speed * speed / (step * step));
    }
}

/* ---- a table of the tip's curve: quintic between nodes that have two derivatives ---- */

enum { NODES = 512, TERMS = 6 };
static double coefficient[NODES][TERMS][2];
static const double TURN = 6.28318530717958647693;

static void fill_table(void) {
    const double width = TURN / (double)NODES;
    double node[2][2 * ORDERS];
    for (int k = 0; k < NODES; ++k) {
        for (int side = 0; side < 2; ++side)
            core((k + side) * width, 2, node[side]);
        for (int i = 0; i < 2; ++i) {
            double value[2], slope[2], bend[2]; /* by the fraction of the interval */
            for (int side = 0; side < 2; ++side) {
                value[side] = node[side][i];
                slope[side] = node[side][2 + i] * width / speed;
                bend[side] = node[side][4 + i] * (width / speed) * (width / speed);
            }
            double rise = value[1] - value[0] - slope[0] - bend[0] / 2;
            double turn = slope[1] - slope[0] - bend[0], curl = bend[1] - bend[0];
            coefficient[k][0][i] = value[0];
            coefficient[k][1][i] = slope[0];
            coefficient[k][2][i] = bend[0] / 2;
            coefficient[k][3][i] = 10 * rise - 4 * turn + curl / 2;
            coefficient[k][4][i] = -15 * rise + 7 * turn - curl;
            coefficient[k][5][i] = 6 * rise - 3 * turn + curl / 2;
        }
    }
}

static INLINE void table(double phi, int order, double *out) {
    const double per_radian = (double)NODES / TURN;
    double place = phi * per_radian;
    long below = (long)place;
    below -= (double)below > place;
    double t = place - (double)below;
    const double (*c)[2] = coefficient[below & (NODES - 1)];
    for (int i = 0; i < 2; ++i) {
        out[i] =
            c[0][i] + t * (c[1][i] + t * (c[2][i] + t * (c[3][i] + t * (c[4][i] + t * c[5][i]))));
        if (order >= 1)
            out[2 + i] =
                (c[1][i]
                 + t * (2 * c[2][i] + t * (3 * c[3][i] + t * (4 * c[4][i] + t * 5 * c[5][i]))))
                * (per_radian * speed);
        if (order >= 2)
            out[4 + i] = (2 * c[2][i] + t * (6 * c[3][i] + t * (12 * c[4][i] + t * 20 * c[5][i])))
                         * (per_radian * speed) * (per_radian * speed);
    }
}

/* ---- the FMU: three inputs set, a step, 2 to 6 outputs read; crank.at_step_end is true, so that
 * the answer is that of the angle given ---- */

static Fmu fmu;
static fmi2Component instance;
static double moment, angle; /* s, rad: where the last step ended */

static INLINE void step_and_read(double phi, double a, const fmi2ValueReference *read, size_t count,
                                 double *out) {
    static const fmi2ValueReference in[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W, VARIABLE_CRANK_A};
    double input[] = {phi, speed, a};
    int failed = fmu.set_real(instance, in, 3, input) != fmi2OK;
    /* As long as the crank takes to turn so far: a speed that the angles contradict is ignored. */
    double turned = phi > angle ? phi - angle : phi - angle + TURN, step = turned / speed;
    failed |= fmu.do_step(instance, moment, step, fmi2True) != fmi2OK;
    failed |= fmu.get_real(instance, read, count, out) != fmi2OK;
    demand(!failed, "step");
    moment += step;
    angle = phi;
}

static INLINE void fmu_step(double phi, int order, double *out) {
    static const fmi2ValueReference tip[] = {VARIABLE_TIP_X,  VARIABLE_TIP_Y,  VARIABLE_TIP_VX,
                                             VARIABLE_TIP_VY, VARIABLE_TIP_AX, VARIABLE_TIP_AY};
    step_and_read(phi, 0.0, tip, 2 * ((size_t)order + 1), out);
}

static INLINE void fmu_dynamics(double phi, int order, double *out) {
    static const fmi2ValueReference drive[] = {VARIABLE_CRANK_TAU, VARIABLE_CRANK_INERTIA,
                                               VARIABLE_CRANK_TAU_BIAS};
    step_and_read(phi, load_on.crank_a, drive, (size_t)order + 1, out);
}

/* ---- libm's sincos, the measure ---- */

static INLINE void libm(double phi, int order, double *out) {
    (void)order;
    sincos(phi, &out[0], &out[1]);
}

/* ---- functions as CasADi generates them: int f(arguments, results, work, work, memory) ---- */

typedef int Generated(const double **, double **, long long *, double *, int);
enum { FOREIGN = 2 };
static Generated *generated[FOREIGN][ORDERS];

static INLINE void call_generated(int which, int order, double phi, double *out) {
    const double *arguments[] = {&phi};
    double *results[] = {out};
    generated[which][order](arguments, results, NULL, NULL, 0);
}
static INLINE void generated_0(double phi, int order, double *out) {
    call_generated(0, order, phi, out);
}
static INLINE void generated_1(double phi, int order, double *out) {
    call_generated(1, order, phi, out);
}

/* ---- what Python calls ---- */

/* Every way becomes a loop over angles for each order, in which it is inlined as far as it can be.
 */
typedef struct {
    void (*answer)(const double *phi, size_t count, double *out);
    double (*add_up)(const double *phi, size_t count);
} Loops;

#define DEFINE_LOOPS(way, order, width)                                                            \
    static void answer_##way##_##order(const double *phi, size_t count, double *out) {             \
        for (size_t i = 0; i < count; ++i)                                                         \
            way(phi[i], order, out + (width) * i);                                                 \
    }                                                                                              \
    static double add_up_##way##_##order(const double *phi, size_t count) {                        \
        double sum = 0.0;                                                                          \
        for (size_t i = 0; i < count; ++i) {                                                       \
            double out[2 * ORDERS] = {0.0};                                                        \
            way(phi[i], order, out);                                                               \
            sum += (out[0] + out[1]) + (out[2] + out[3]) + (out[4] + out[5]);                      \
        }                                                                                          \
        return sum;                                                                                \
    }
#define DEFINE_WAY(way) DEFINE_LOOPS(way, 0, 2) DEFINE_LOOPS(way, 1, 4) DEFINE_LOOPS(way, 2, 6)
#define DEFINE_DYNAMICS(way) DEFINE_LOOPS(way, 2, 3) /* at order 2 alone */
#define LOOPS(way, order) {answer_##way##_##order, add_up_##way##_##order}
#define WAY(way) {LOOPS(way, 0), LOOPS(way, 1), LOOPS(way, 2)}
#define DYNAMICS(way) {{NULL, NULL}, {NULL, NULL}, LOOPS(way, 2)}

DEFINE_WAY(libm)
DEFINE_WAY(core)
DEFINE_WAY(printed)
DEFINE_WAY(naive)
DEFINE_WAY(table)
DEFINE_WAY(fmu_step)
DEFINE_WAY(generated_0)
DEFINE_WAY(generated_1)
DEFINE_DYNAMICS(core_dynamics)
DEFINE_DYNAMICS(fmu_dynamics)
static INLINE void generated_dynamics_0(double phi, int order, double *out) {
    call_generated(0, order, phi, out);
}
static INLINE void generated_dynamics_1(double phi, int order, double *out) {
    call_generated(1, order, phi, out);
}
DEFINE_DYNAMICS(generated_dynamics_0)
DEFINE_DYNAMICS(generated_dynamics_1)
static const Loops ways[][ORDERS] = {WAY(libm),
                                     WAY(core),
                                     WAY(printed),
                                     WAY(naive),
                                     WAY(table),
                                     WAY(fmu_step),
                                     WAY(generated_0),
                                     WAY(generated_1),
                                     DYNAMICS(core_dynamics),
                                     DYNAMICS(fmu_dynamics),
                                     DYNAMICS(generated_dynamics_0),
                                     DYNAMICS(generated_dynamics_1)};

EXPORTED void prepare(const double *parameters, double crank_speed);
void prepare(const double *parameters, double crank_speed) {
    memcpy(&geometry, parameters, sizeof geometry);
    speed = crank_speed;
    linkage_prepare(&geometry, &linkage);
    fill_table();
}

/* In the order of the value references, and a Load; before an FMU is loaded. */
EXPORTED void give_masses(const double *values, const double *load);
void give_masses(const double *values, const double *load) {
    LinkageMasses given;
    memcpy(masses, values, sizeof masses);
    memcpy(&given, values, sizeof given);
    memcpy(&load_on, load, sizeof load_on);
    linkage_prepare_masses(&linkage, &given, &inertia);
}

/* What no measurement changes: masses, gravity and the force on the tip. */
static void load_instance(void) {
    const fmi2ValueReference other[] = {VARIABLE_GRAVITY, VARIABLE_TIP_FX, VARIABLE_TIP_FY};
    const double values[] = {load_on.gravity, load_on.force_x, load_on.force_y};
    demand(fmu.set_real(instance, other, 3, values) == fmi2OK, "load");
    for (unsigned i = 0; i < sizeof masses / sizeof *masses; ++i) {
        fmi2ValueReference of = VARIABLE_BODY_OA_M + i;
        demand(fmu.set_real(instance, &of, 1, &masses[i]) == fmi2OK, "masses");
    }
}

EXPORTED void load(const char *library, const char *guid, unsigned at_step_end);
void load(const char *library, const char *guid, unsigned at_step_end) {
    fmu = load_fmu(library);
    instance = new_instance(&fmu, guid);
    fmi2SetBooleanTYPE *set_boolean;
    load_function(fmu.library, "fmi2SetBoolean", &set_boolean);
    fmi2Boolean yes = fmi2True;
    demand(set_boolean(instance, &at_step_end, 1, &yes) == fmi2OK, "at_step_end");
    if (inertia.has_mass)
        load_instance();
    demand(fmu.setup(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    demand(fmu.enter(instance) == fmi2OK && fmu.leave(instance) == fmi2OK, "initialize");
}

EXPORTED void adopt(int which, int order, Generated *function);
void adopt(int which, int order, Generated *function) { generated[which][order] = function; }

/* Answers for `count` angles, 2 (order + 1) numbers each. */
EXPORTED void answer(int way, int order, const double *phi, size_t count, double *out);
void answer(int way, int order, const double *phi, size_t count, double *out) {
    ways[way][order].answer(phi, count, out);
}

static volatile double sink;

/* The processor's time of this thread, so that what else runs does not count. */
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* Nanoseconds an evaluation. */
EXPORTED double take_time(int way, int order, const double *phi, size_t count);
double take_time(int way, int order, const double *phi, size_t count) {
    double begin = now();
    sink = ways[way][order].add_up(phi, count);
    return (now() - begin) / (double)count;
}
