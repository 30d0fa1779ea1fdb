#include "derivatives.h"

#include "factors.h"
#include "pose.h"
#include "variables.h"

#include <math.h>
#include <string.h>

/* ---- the equations as data ----------------------------------------------------------------- */

/* factor · P, differentiated `order` times by phi · Q. */
typedef struct {
    double factor;
    PoseFactor pose;
    int order;
    MotionFactor motion;
} Product;

/* What products need, as POSE_BITs: their derivatives, once and twice, and sweeps for their
 * changes.
 */
typedef struct {
    uint8_t derivatives[2];
    uint8_t sweeps;
} Needs;

typedef struct {
    const Product *products;
    size_t massless; /* how many there are before those with masses in them */
    size_t count;    /* in all; 0: this variable is not computed by an equation */
    Needs needs, needs_of_masses; /* of the ones and of the others */
} Equation;

#define PRODUCT(c, P, n, Q) {c, POSE_##P, n, MOTION_##Q},
#define ONE_MORE(c, P, n, Q) +1 /* NOLINT(bugprone-macro-parentheses): a term of a sum */
#define ONCE(c, P, n, Q) | POSE_BIT(POSE_NEEDS_##P((n) + 1))
#define TWICE(c, P, n, Q) | POSE_BIT(POSE_NEEDS_##P((n) + 2))
#define SWEEP(c, P, n, Q) | POSE_BIT(POSE_SWEEP_##P(n))
#define NONE(c, P, n, Q)
#define PRODUCTS(NAME) static const Product PRODUCTS_##NAME[] = {EQUATION_##NAME(PRODUCT, PRODUCT)};
#define EQUATION(NAME)                                                                             \
    [VARIABLE_##NAME] = {                                                                          \
        PRODUCTS_##NAME,                                                                           \
        0 EQUATION_##NAME(ONE_MORE, NONE),                                                         \
        sizeof PRODUCTS_##NAME / sizeof(Product),                                                  \
        {{0 EQUATION_##NAME(ONCE, NONE), 0 EQUATION_##NAME(TWICE, NONE)},                          \
         0 EQUATION_##NAME(SWEEP, NONE)},                                                          \
        {{0 EQUATION_##NAME(NONE, ONCE), 0 EQUATION_##NAME(NONE, TWICE)},                          \
         0 EQUATION_##NAME(NONE, SWEEP)},                                                          \
    },
#define PRODUCTS_OF_GROUP(NAME) INTERFACE_OUTPUTS_OF_##NAME(PRODUCTS)
#define EQUATIONS_OF_GROUP(NAME) INTERFACE_OUTPUTS_OF_##NAME(EQUATION)

INTERFACE_OUTPUT_GROUPS(PRODUCTS_OF_GROUP)
static const Equation equations[INTERFACE_COUNT + 1] = {
    INTERFACE_OUTPUT_GROUPS(EQUATIONS_OF_GROUP)};

static bool has_equation(uint32_t reference) {
    return variable_is_known(reference) && equations[reference].count > 0;
}

/* The equation of a variable, as far as it counts: without masses, the products with these are 0.
 */
static Equation equation_of(uint32_t reference, bool with_masses) {
    Equation equation = equations[reference];
    if (!with_masses)
        equation.count = equation.massless;
    return equation;
}

/* The greatest number in a set of POSE_BITs; -1 where it is empty. */
static int greatest_of(unsigned bits) {
    int greatest = -1;
    for (; bits != 0; bits >>= 1)
        ++greatest;
    return greatest;
}

/* Makes sure that the pose, and its masses, are there with as many derivatives by phi as the
 * equations of these variables need, differentiated `times` (1 or 2) more. *sweep: the order that a
 * sweep for their derivatives by parameters must have; -1 where none needs the pose. */
static ComponentStatus solve_for(Component *c, const uint32_t reference[], size_t count, int times,
                                 bool with_masses, int *sweep) {
    unsigned needs = 0, needs_of_masses = 0, sweeps = 0;
    for (size_t i = 0; i < count; ++i) {
        const Equation *equation = &equations[reference[i]];
        needs |= equation->needs.derivatives[times - 1];
        sweeps |= equation->needs.sweeps;
        if (with_masses) {
            needs_of_masses |= equation->needs_of_masses.derivatives[times - 1];
            sweeps |= equation->needs_of_masses.sweeps;
        }
    }
    *sweep = greatest_of(sweeps);
    /* linkage_vary wants one more */
    int needed = greatest_of(needs | needs_of_masses), least = *sweep < 0 ? -1 : *sweep + 1;
    needed = needed < least ? least : needed;
    ComponentStatus status = needed < 0 ? COMPONENT_OK : pose_solve(c, needed);
    if (status == COMPONENT_OK && needs_of_masses != 0)
        pose_solve_masses(c, greatest_of(needs_of_masses));
    return status;
}

/* ---- by time ------------------------------------------------------------------------------- */

/* The n-th time derivative, n = 0 to 2, of f(phi(t)), where f is a factor of the pose,
 * differentiated `order` times by phi (Faa di Bruno's formula). */
static double pose_by_time(const Component *c, PoseFactor factor, int order, int n) {
    CrankMotion m = c->shown->crank.end;
    switch (n) {
    case 0: return pose_factor(c, factor, order);
    case 1: return pose_factor(c, factor, order + 1) * m.w;
    default:
        return pose_factor(c, factor, order + 2) * (m.w * m.w)
               + pose_factor(c, factor, order + 1) * m.a;
    }
}

/* The n-th time derivative of an output, by the product rule. The pose has what it needs. */
static double by_time(const Component *c, Equation equation, int n) {
    double sum = 0.0;
    for (size_t i = 0; i < equation.count; ++i) {
        const Product *p = &equation.products[i];
        double binomial = 1.0;
        for (int k = 0; k <= n; ++k) {
            sum += binomial * p->factor
                   * (pose_by_time(c, p->pose, p->order, k) * motion_factor(c, p->motion, n - k));
            binomial = binomial * (n - k) / (k + 1);
        }
    }
    return sum;
}

ComponentStatus component_get_output_derivatives(Component *c, const uint32_t reference[],
                                                 size_t count, const int32_t order[],
                                                 double value[]) {
    int greatest = 0;
    for (size_t i = 0; i < count; ++i) {
        if (!variable_is_output(reference[i]))
            return refuse_reference(c, reference[i], "is no output");
        if (!has_order(order[i]))
            return refuse_order(c, reference[i], order[i]);
        greatest = order[i] > greatest ? order[i] : greatest;
    }
    int sweep;
    pose_prepare(c); /* the state may be new: then has_mass is not */
    bool with_masses = c->inertia.has_mass;
    ComponentStatus status = solve_for(c, reference, count, greatest, with_masses, &sweep);
    if (status != COMPONENT_OK)
        return status;
    for (size_t i = 0; i < count; ++i)
        value[i] = by_time(c, equation_of(reference[i], with_masses), order[i]);
    return COMPONENT_OK;
}

/* ---- by inputs, machine.s and parameters ----------------------------------------------------- */

/* What a call for derivatives takes. */
typedef struct {
    bool by_parameters; /* they are among the knowns */
    bool with_masses;   /* masses are given, or among the knowns */
    int sweep;          /* as in solve_for */
} Extent;

/* Refuses, with a message, what is no unknown or no known now, and seeds that are no numbers. Else
 * says whether parameters, and masses, are among the knowns. Parameters are so in initialization
 * mode alone, where they may change: FMI 2.0.4, sections 2.1.9 and 2.2.8 (InitialUnknowns);
 * FMI 3.0, section 2.2, "Getting Partial Derivatives". The independent variable is a known in every
 * mode (there, and FMI 3.0, section 2.4.8); nothing depends on the time itself, so that all
 * derivatives by it are 0. */
static ComponentStatus check_derivative(Component *c, const uint32_t unknown[],
                                        size_t unknown_count, const uint32_t known[],
                                        size_t known_count, const double seed[], bool is_adjoint,
                                        Extent *extent) {
    for (size_t i = 0; i < unknown_count; ++i) {
        if (!has_equation(unknown[i]))
            return refuse_reference(c, unknown[i], "is no output: no derivative of it");
        if (is_adjoint && !(fabs(seed[i]) <= INTERFACE_GREATEST_VALUE))
            return refuse_value(c, unknown[i], seed[i]);
    }
    for (size_t k = 0; k < known_count; ++k) {
        bool is_mass = variable_is_mass(known[k]);
        bool is_parameter = is_mass || variable_is_geometry(known[k]);
        if (is_parameter && c->settings.mode != MODE_INITIALIZATION)
            return refuse_reference(c, known[k],
                                    "derivatives by parameters exist in initialization mode only");
        if (!is_parameter && !variable_is_input(known[k]) && known[k] != VARIABLE_MACHINE_S
            && known[k] != VARIABLE_TIME)
            return refuse_reference(c, known[k], "is no input: no derivative by it");
        if (!is_adjoint && !(fabs(seed[k]) <= INTERFACE_GREATEST_VALUE))
            return refuse_value(c, known[k], seed[k]);
        extent->by_parameters = extent->by_parameters || is_parameter;
        extent->with_masses = extent->with_masses || is_mass;
    }
    return COMPONENT_OK;
}

/* Checks a call, and makes sure that the pose has what it takes. */
static ComponentStatus prepare_derivative(Component *c, const uint32_t unknown[],
                                          size_t unknown_count, const uint32_t known[],
                                          size_t known_count, const double seed[], bool is_adjoint,
                                          Extent *extent) {
    *extent = (Extent){.sweep = -1};
    ComponentStatus status =
        check_derivative(c, unknown, unknown_count, known, known_count, seed, is_adjoint, extent);
    if (status != COMPONENT_OK)
        return status;
    pose_prepare(c);
    extent->with_masses = extent->with_masses || c->inertia.has_mass;
    return solve_for(c, unknown, unknown_count, 1, extent->with_masses, &extent->sweep);
}

/* A direction of the knowns, and what the pose changes by along its parameters. */
typedef struct {
    const double *known; /* by value reference */
    double phi;
    LinkageVariation *pose;
    bool with_masses;
} Direction;

/* Of the n-th derivative of a factor of the pose by phi. */
static inline double pose_factor_change(const Component *c, Direction d, PoseFactor factor, int n) {
    return d.phi * pose_factor(c, factor, n + 1) + *pose_factor_variation(c, d.pose, factor, n);
}

/* The change of an output: what the pose brings, what the crank's rates bring, and all else, in
 * this order. Written out for each output and not looped over as data, since hosts ask for it in
 * each step: the compiler then knows the factors, and 13 outputs by crank.phi take 0.4 of the time.
 */
#define CHANGE_OF_POSE(c, P, n, Q)                                                                 \
    if (POSE_##P != POSE_ONE) {                                                                    \
        by_pose += (c)                                                                             \
                   * (motion_factor(component, MOTION_##Q, 0)                                      \
                      * pose_factor_change(component, d, POSE_##P, n));                            \
        if (motion_factor_is_of_crank(MOTION_##Q))                                                 \
            by_crank += (c)                                                                        \
                        * (pose_factor(component, POSE_##P, n)                                     \
                           * motion_factor_change(component, MOTION_##Q, d.known));                \
    }
#define CHANGE_OF_REST(c, P, n, Q)                                                                 \
    if (!motion_factor_is_of_crank(MOTION_##Q))                                                    \
        change += (c)                                                                              \
                  * (pose_factor(component, POSE_##P, n)                                           \
                     * motion_factor_change(component, MOTION_##Q, d.known));
#define CHANGE_OF_POSE_OF_MASSES(c, P, n, Q)                                                       \
    if (d.with_masses) {                                                                           \
        CHANGE_OF_POSE(c, P, n, Q)                                                                 \
    }
#define CHANGE_OF_REST_OF_MASSES(c, P, n, Q)                                                       \
    if (d.with_masses) {                                                                           \
        CHANGE_OF_REST(c, P, n, Q)                                                                 \
    }
#define CHANGE_OF_OUTPUT(NAME)                                                                     \
    case VARIABLE_##NAME:                                                                          \
        EQUATION_##NAME(CHANGE_OF_POSE, CHANGE_OF_POSE_OF_MASSES) change = by_pose + by_crank;     \
        EQUATION_##NAME(CHANGE_OF_REST, CHANGE_OF_REST_OF_MASSES) return change;
#define CHANGES_OF_GROUP(NAME) INTERFACE_OUTPUTS_OF_##NAME(CHANGE_OF_OUTPUT)

static double change_of(const Component *component, uint32_t reference, Direction d) {
    double by_pose = 0.0, by_crank = 0.0, change = 0.0;
    switch (reference) {
        INTERFACE_OUTPUT_GROUPS(CHANGES_OF_GROUP)
    default: return 0.0;
    }
}

ComponentStatus component_get_directional_derivative(Component *c, const uint32_t unknown[],
                                                     size_t unknown_count, const uint32_t known[],
                                                     size_t known_count, const double seed[],
                                                     double sensitivity[]) {
    double direction[INTERFACE_COUNT + 1] = {0.0};
    LinkageVariation varied = {.angle = 0.0};
    Extent extent;
    ComponentStatus status =
        prepare_derivative(c, unknown, unknown_count, known, known_count, seed, false, &extent);
    if (status != COMPONENT_OK)
        return status;
    for (size_t k = 0; k < known_count; ++k)
        direction[known[k]] += seed[k];
    if (extent.by_parameters && extent.sweep >= 0) {
        LinkageGeometry geometry;
        LinkageMasses masses;
        memcpy(&geometry, &direction[VARIABLE_GEOMETRY_L1], sizeof geometry);
        memcpy(&masses, &direction[VARIABLE_BODY_OA_M], sizeof masses);
        linkage_vary(&c->linkage, extent.with_masses ? &c->inertia.masses : NULL, &c->pose,
                     c->shown->crank.end.phi, extent.sweep, &geometry, &masses, &varied);
    }
    Direction d = {direction, direction[VARIABLE_CRANK_PHI], &varied, extent.with_masses};
    for (size_t i = 0; i < unknown_count; ++i)
        sensitivity[i] = change_of(c, unknown[i], d);
    return COMPONENT_OK;
}

/* Adds the weight of one output to those of what it is made of. */
static void weigh(const Component *c, Equation equation, double weight, LinkageVariation *of_pose,
                  double of_motion[MOTION_FACTOR_COUNT]) {
    for (size_t i = 0; i < equation.count; ++i) {
        const Product *p = &equation.products[i];
        double *variation = pose_factor_variation(c, of_pose, p->pose, p->order);
        double share = p->factor * weight;
        of_motion[p->motion] += share * pose_factor(c, p->pose, p->order);
        if (variation != NULL)
            *variation += share * motion_factor(c, p->motion, 0);
    }
}

ComponentStatus component_get_adjoint_derivative(Component *c, const uint32_t unknown[],
                                                 size_t unknown_count, const uint32_t known[],
                                                 size_t known_count, const double seed[],
                                                 double sensitivity[]) {
    double of_motion[MOTION_FACTOR_COUNT] = {0.0}, gradient[INTERFACE_COUNT + 1] = {0.0};
    LinkageVariation of_pose = {.angle = 0.0};
    Extent extent;
    ComponentStatus status =
        prepare_derivative(c, unknown, unknown_count, known, known_count, seed, true, &extent);
    if (status != COMPONENT_OK)
        return status;
    for (size_t i = 0; i < unknown_count; ++i)
        weigh(c, equation_of(unknown[i], extent.with_masses), seed[i], &of_pose, of_motion);
    factors_gradient_by_motion(c, of_motion, gradient);
    if (extent.sweep >= 0) {
        gradient[VARIABLE_CRANK_PHI] = factors_gradient_by_phi(c, &of_pose, extent.sweep);
        if (extent.by_parameters) {
            LinkageGeometry geometry;
            LinkageMasses masses = {.OA = {.m = 0.0}};
            linkage_gradient(&c->linkage, extent.with_masses ? &c->inertia.masses : NULL, &c->pose,
                             c->shown->crank.end.phi, extent.sweep, &of_pose, &geometry, &masses);
            memcpy(&gradient[VARIABLE_GEOMETRY_L1], &geometry, sizeof geometry);
            memcpy(&gradient[VARIABLE_BODY_OA_M], &masses, sizeof masses);
        }
    }
    for (size_t k = 0; k < known_count; ++k)
        sensitivity[k] = gradient[known[k]];
    return COMPONENT_OK;
}
