#include "outputs.h"

#include "../linkage/sensitivity.h"

#include "message.h"

#include <math.h>
#include <string.h>

/* ---- geometry and pose ----------------------------------------------------------------- */

/* values: by value reference, of which these are used; interface.c checks that they lie alike. */
static LinkageGeometry geometry_of(const double values[]) {
    LinkageGeometry geometry;
    memcpy(&geometry, &values[VARIABLE_GEOMETRY_L1], sizeof geometry);
    return geometry;
}

void outputs_prepare(Component *c) {
    if (c->linkage_is_ready)
        return;
    LinkageGeometry geometry = geometry_of(c->settings.real);
    linkage_prepare(&geometry, &c->linkage);
    c->linkage_is_ready = 1;
    c->pose.order = -1;
}

void outputs_explain_gap(Component *c, LinkageClosure closure, double phi, double gap) {
    bool is_abd = closure == LINKAGE_ABD_OPEN;
    const char *base = is_abd ? "AD" : "EG";
    if (gap == 0.0)
        message_write(c->message, sizeof c->message,
                      "the linkage is at a dead point, where velocities are infinite: dyad %s at "
                      "crank.phi = %g rad",
                      is_abd ? "ABD" : "EFG", phi);
    else
        message_write(c->message, sizeof c->message,
                      "the linkage cannot be closed: dyad %s at crank.phi = %g rad, where distance "
                      "%s is %G mm too %s for the two links",
                      is_abd ? "ABD" : "EFG", phi, base, 1000.0 * fabs(gap),
                      gap > 0.0 ? "long" : "short");
}

ComponentStatus outputs_solve(Component *c, int order) {
    outputs_prepare(c);
    if (c->pose.order < 0) {
        double phi = c->shown->crank.end.phi, gap;
        LinkageClosure closure = linkage_place(&c->linkage, phi, &c->pose, &gap);
        if (closure != LINKAGE_CLOSED) {
            outputs_explain_gap(c, closure, phi, gap);
            return COMPONENT_DISCARD;
        }
    }
    linkage_differentiate(&c->linkage, &c->pose, order);
    return COMPONENT_OK;
}

/* ---- from derivatives by the crank angle to derivatives by time ------------------------- */

/* The n-th time derivative of f(phi(t)), n = 0 to 4: f[k] is the k-th derivative by phi
 * (Faa di Bruno's formula; the crank's fourth derivative is 0 in its motion). */
static double by_time(int n, const double f[LINKAGE_MAX_ORDER + 1], CrankMotion m) {
    switch (n) {
    case 0: return f[0];
    case 1: return f[1] * m.w;
    case 2: return f[2] * m.w * m.w + f[1] * m.a;
    case 3: return (f[3] * m.w * m.w + 3.0 * f[2] * m.a) * m.w + f[1] * m.jerk;
    default:
        return (f[4] * m.w * m.w + 6.0 * f[3] * m.a) * m.w * m.w
               + f[2] * (3.0 * m.a * m.a + 4.0 * m.w * m.jerk);
    }
}

static double machine_by_time(int n, MachineMotion m) {
    switch (n) {
    case 0: return m.s;
    case 1: return m.v;
    case 2: return m.a;
    case 3: return m.jerk;
    default: return 0.0;
    }
}

enum {
    EVALUATION_MOTION = EVALUATION_POSITION | EVALUATION_VELOCITY | EVALUATION_ACCELERATION,
    EVALUATION_WITHOUT_POSE = EVALUATION_TRAVEL | EVALUATION_SPEED
};

/* ---- values: one function for each computed_by in interface.toml ------------------------- */

static void component_compute_position(Component *c, const ComponentProgress *now) {
    double *real = c->settings.real;
    double x = c->pose.tip[0].x, y = c->pose.tip[0].y;
    real[VARIABLE_TIP_X] = x;
    real[VARIABLE_TIP_Y] = y;
    real[VARIABLE_GROUND_X] = now->travel.end.s + x;
    real[VARIABLE_GROUND_Y] = y;
}

static void component_compute_velocity(Component *c, const ComponentProgress *now) {
    double *real = c->settings.real;
    double w = now->crank.end.w;
    double vx = c->pose.tip[1].x * w, vy = c->pose.tip[1].y * w;
    real[VARIABLE_TIP_VX] = vx;
    real[VARIABLE_TIP_VY] = vy;
    real[VARIABLE_GROUND_VX] = now->travel.end.v + vx;
    real[VARIABLE_GROUND_VY] = vy;
}

static void component_compute_acceleration(Component *c, const ComponentProgress *now) {
    double *real = c->settings.real;
    const Vector *tip = c->pose.tip;
    double w_squared = now->crank.end.w * now->crank.end.w, a = now->crank.end.a;
    double ax = tip[2].x * w_squared + tip[1].x * a, ay = tip[2].y * w_squared + tip[1].y * a;
    real[VARIABLE_TIP_AX] = ax;
    real[VARIABLE_TIP_AY] = ay;
    real[VARIABLE_GROUND_AX] = now->travel.end.a + ax;
    real[VARIABLE_GROUND_AY] = ay;
}

static void component_compute_angle(Component *c) {
    c->settings.real[VARIABLE_TIP_ANGLE] = linkage_nozzle_angle(&c->linkage, &c->pose);
}

static void component_compute_travel(Component *c, const ComponentProgress *now) {
    c->settings.real[VARIABLE_MACHINE_S] = now->travel.end.s;
}

static void component_compute_speed(Component *c, const ComponentProgress *now) {
    c->settings.real[VARIABLE_DER_MACHINE_S] = now->travel.end.v;
}

/* Virtual work: tau w + F . v = 0 for the massless linkage. */
static void component_compute_torque(Component *c, const ComponentProgress *now) {
    const double *force = now->force[0];
    Vector first = c->pose.tip[1];
    c->settings.real[VARIABLE_CRANK_TAU] = 0.0 - (force[0] * first.x + force[1] * first.y);
}

/* Whether the dyad ABD is the one nearer to its dead point. */
static bool is_near_abd(const Component *c) {
    return linkage_transmission(&c->linkage.abd, &c->pose.abd, 0)
           <= linkage_transmission(&c->linkage.efg, &c->pose.efg, 0);
}

static double transmission(const Component *c, int order) {
    return is_near_abd(c) ? linkage_transmission(&c->linkage.abd, &c->pose.abd, order)
                          : linkage_transmission(&c->linkage.efg, &c->pose.efg, order);
}

static void component_compute_margin(Component *c) {
    c->settings.real[VARIABLE_ASSEMBLY_MARGIN] = transmission(c, 0);
}

/* The highest derivative by phi that the values of some EVALUATION_ bits need. */
static int order_for(uint32_t evaluations) {
    if (evaluations & EVALUATION_ACCELERATION)
        return 2;
    return evaluations & (EVALUATION_VELOCITY | EVALUATION_TORQUE) ? 1 : 0;
}

ComponentStatus outputs_evaluate(Component *c, uint32_t evaluations) {
    int order = order_for(evaluations);
    if (c->pose.order >= 0) {
        linkage_differentiate(&c->linkage, &c->pose, order);
    } else if (evaluations & ~(uint32_t)EVALUATION_WITHOUT_POSE) {
        ComponentStatus status = outputs_solve(c, order);
        if (status != COMPONENT_OK)
            return status;
    }
    const ComponentProgress *now = c->shown;
    if (evaluations & EVALUATION_POSITION)
        component_compute_position(c, now);
    if (evaluations & EVALUATION_VELOCITY)
        component_compute_velocity(c, now);
    if (evaluations & EVALUATION_ACCELERATION)
        component_compute_acceleration(c, now);
    if (evaluations > EVALUATION_MOTION) {
        if (evaluations & EVALUATION_ANGLE)
            component_compute_angle(c);
        if (evaluations & EVALUATION_TRAVEL)
            component_compute_travel(c, now);
        if (evaluations & EVALUATION_SPEED)
            component_compute_speed(c, now);
        if (evaluations & EVALUATION_TORQUE)
            component_compute_torque(c, now);
        if (evaluations & EVALUATION_MARGIN)
            component_compute_margin(c);
    }
    c->fresh |= evaluations;
    return COMPONENT_OK;
}

/* ---- derivatives ------------------------------------------------------------------------ */

/* The outputs that are the n-th time derivative of a coordinate of the tip. */
typedef struct {
    bool is_one, is_x, is_ground;
    int order;
} TipOutput;

static TipOutput tip_output(uint32_t reference) {
    switch (reference) {
    case VARIABLE_TIP_X: return (TipOutput){true, true, false, 0};
    case VARIABLE_TIP_Y: return (TipOutput){true, false, false, 0};
    case VARIABLE_TIP_VX: return (TipOutput){true, true, false, 1};
    case VARIABLE_TIP_VY: return (TipOutput){true, false, false, 1};
    case VARIABLE_TIP_AX: return (TipOutput){true, true, false, 2};
    case VARIABLE_TIP_AY: return (TipOutput){true, false, false, 2};
    case VARIABLE_GROUND_X: return (TipOutput){true, true, true, 0};
    case VARIABLE_GROUND_Y: return (TipOutput){true, false, true, 0};
    case VARIABLE_GROUND_VX: return (TipOutput){true, true, true, 1};
    case VARIABLE_GROUND_VY: return (TipOutput){true, false, true, 1};
    case VARIABLE_GROUND_AX: return (TipOutput){true, true, true, 2};
    case VARIABLE_GROUND_AY: return (TipOutput){true, false, true, 2};
    default: return (TipOutput){false, false, false, 0};
    }
}

bool outputs_have_derivatives(uint32_t reference) {
    switch (reference) {
    case VARIABLE_TIP_ANGLE:
    case VARIABLE_MACHINE_S:
    case VARIABLE_DER_MACHINE_S:
    case VARIABLE_CRANK_TAU:
    case VARIABLE_ASSEMBLY_MARGIN: return true;
    default: return tip_output(reference).is_one;
    }
}

ComponentStatus outputs_refuse_derivative(Component *c, uint32_t reference) {
    message_write(c->message, sizeof c->message, "%s: its derivatives are not known",
                  interface_variables[reference].name);
    return COMPONENT_ERROR;
}

static void coordinate(const LinkagePose *pose, bool is_x, int from, double f[]) {
    for (int k = from; k <= pose->order; ++k)
        f[k - from] = is_x ? pose->tip[k].x : pose->tip[k].y;
}

ComponentStatus outputs_time_derivative(Component *c, uint32_t reference, int order,
                                        double *value) {
    CrankMotion crank = c->shown->crank.end;
    MachineMotion machine = c->shown->travel.end;
    if (reference == VARIABLE_MACHINE_S) {
        *value = machine_by_time(order, machine);
        return COMPONENT_OK;
    }
    TipOutput tip = tip_output(reference);
    /* torque and transmission need one derivative by phi more than the order by time */
    int depth = tip.is_one ? tip.order + order : order + 1;
    ComponentStatus status = outputs_solve(c, depth);
    if (status != COMPONENT_OK)
        return status;

    double f[LINKAGE_MAX_ORDER + 1] = {0.0};
    if (tip.is_one) {
        coordinate(&c->pose, tip.is_x, 0, f);
        *value = by_time(depth, f, crank);
        if (tip.is_ground && tip.is_x)
            *value += machine_by_time(depth, machine);
    } else if (reference == VARIABLE_TIP_ANGLE) {
        *value = by_time(order, c->pose.efg.first_rate, crank);
    } else if (reference == VARIABLE_ASSEMBLY_MARGIN) {
        f[1] = transmission(c, 1);
        f[2] = order > 1 ? transmission(c, 2) : 0.0;
        *value = by_time(order, f, crank);
    } else if (reference == VARIABLE_CRANK_TAU) { /* -(F . r'), by the product rule */
        double power = 0.0;
        for (int axis = 0; axis < 2; ++axis) {
            coordinate(&c->pose, axis == 0, 1, f);
            double binomial = 1.0;
            for (int k = 0; k <= order; ++k) {
                power += binomial * c->shown->force[order - k][axis] * by_time(k, f, crank);
                binomial = binomial * (order - k) / (k + 1);
            }
        }
        *value = 0.0 - power;
    } else {
        return outputs_refuse_derivative(c, reference);
    }
    return COMPONENT_OK;
}

/* Makes sure that the pose has all derivatives by phi that derivatives of these outputs need: one
 * more than the outputs themselves. */
static ComponentStatus solve_for_derivatives(Component *c, uint32_t evaluations) {
    int order = order_for(evaluations) + 1;
    if (!(evaluations & ~(uint32_t)EVALUATION_WITHOUT_POSE))
        return COMPONENT_OK;
    return outputs_solve(c, order < 2 && evaluations & EVALUATION_MARGIN ? 2 : order);
}

static Vector combine(double a, Vector u, double b, Vector v) {
    return (Vector){a * u.x + b * v.x, a * u.y + b * v.y};
}

ComponentStatus outputs_vary(Component *c, uint32_t evaluations, bool by_geometry,
                             const double known[], double change[]) {
    ComponentStatus status = solve_for_derivatives(c, evaluations);
    if (status != COMPONENT_OK)
        return status;
    const ComponentProgress *now = c->shown;
    const Vector *tip = c->pose.tip;
    CrankMotion crank = now->crank.end;
    int order = order_for(evaluations);
    double by_phi = known[VARIABLE_CRANK_PHI], by_w = known[VARIABLE_CRANK_W];
    LinkageVariation varied = {.angle = 0.0};
    if (by_geometry && evaluations & ~(uint32_t)EVALUATION_WITHOUT_POSE) {
        LinkageGeometry geometry = geometry_of(known);
        linkage_vary(&c->linkage, &c->pose, crank.phi, order, &geometry, &varied);
    }
    change[VARIABLE_MACHINE_S] = known[VARIABLE_MACHINE_S];
    change[VARIABLE_DER_MACHINE_S] = known[VARIABLE_MACHINE_V];
    if (evaluations & EVALUATION_POSITION) {
        Vector r = combine(by_phi, tip[1], 1.0, varied.tip[0]);
        change[VARIABLE_TIP_X] = r.x;
        change[VARIABLE_GROUND_X] = r.x + known[VARIABLE_MACHINE_S];
        change[VARIABLE_TIP_Y] = change[VARIABLE_GROUND_Y] = r.y;
    }
    if (order < 1 && !(evaluations & (EVALUATION_ANGLE | EVALUATION_MARGIN)))
        return COMPONENT_OK;
    Vector first = order >= 1 ? combine(by_phi, tip[2], 1.0, varied.tip[1]) : (Vector){0.0, 0.0};
    if (evaluations & EVALUATION_VELOCITY) {
        Vector v = combine(crank.w, first, by_w, tip[1]);
        change[VARIABLE_TIP_VX] = v.x;
        change[VARIABLE_GROUND_VX] = v.x + known[VARIABLE_MACHINE_V];
        change[VARIABLE_TIP_VY] = change[VARIABLE_GROUND_VY] = v.y;
    }
    if (evaluations & EVALUATION_ACCELERATION) {
        Vector second = combine(by_phi, tip[3], 1.0, varied.tip[2]);
        Vector a = combine(crank.w * crank.w, second, crank.a, first);
        Vector by_rates = combine(2.0 * crank.w * by_w, tip[2], known[VARIABLE_CRANK_A], tip[1]);
        change[VARIABLE_TIP_AX] = change[VARIABLE_GROUND_AX] = a.x + by_rates.x;
        change[VARIABLE_TIP_AY] = change[VARIABLE_GROUND_AY] = a.y + by_rates.y;
    }
    if (evaluations & EVALUATION_TORQUE)
        change[VARIABLE_CRANK_TAU] =
            0.0
            - (now->force[0][0] * first.x + now->force[0][1] * first.y
               + known[VARIABLE_TIP_FX] * tip[1].x + known[VARIABLE_TIP_FY] * tip[1].y);
    if (evaluations & EVALUATION_ANGLE)
        change[VARIABLE_TIP_ANGLE] = by_phi * c->pose.efg.first_rate[1] + varied.angle;
    if (evaluations & EVALUATION_MARGIN)
        change[VARIABLE_ASSEMBLY_MARGIN] =
            by_phi * transmission(c, 1)
            + (is_near_abd(c) ? varied.transmission_abd : varied.transmission_efg);
    return COMPONENT_OK;
}

ComponentStatus outputs_gradient(Component *c, uint32_t evaluations, bool by_geometry,
                                 const double weight[], double gradient[]) {
    ComponentStatus status = solve_for_derivatives(c, evaluations);
    if (status != COMPONENT_OK)
        return status;
    const ComponentProgress *now = c->shown;
    CrankMotion crank = now->crank.end;
    int order = order_for(evaluations);
    gradient[VARIABLE_MACHINE_S] = weight[VARIABLE_MACHINE_S] + weight[VARIABLE_GROUND_X];
    gradient[VARIABLE_MACHINE_V] = weight[VARIABLE_DER_MACHINE_S] + weight[VARIABLE_GROUND_VX];
    if (!(evaluations & ~(uint32_t)EVALUATION_WITHOUT_POSE))
        return COMPONENT_OK;
    /* weights of the values, then of what they are made of: tip and its derivatives by phi */
    Vector r = {weight[VARIABLE_TIP_X] + weight[VARIABLE_GROUND_X],
                weight[VARIABLE_TIP_Y] + weight[VARIABLE_GROUND_Y]};
    Vector v = {weight[VARIABLE_TIP_VX] + weight[VARIABLE_GROUND_VX],
                weight[VARIABLE_TIP_VY] + weight[VARIABLE_GROUND_VY]};
    Vector a = {weight[VARIABLE_TIP_AX] + weight[VARIABLE_GROUND_AX],
                weight[VARIABLE_TIP_AY] + weight[VARIABLE_GROUND_AY]};
    Vector force = {now->force[0][0], now->force[0][1]};
    double tau = weight[VARIABLE_CRANK_TAU], margin = weight[VARIABLE_ASSEMBLY_MARGIN];
    Vector first = combine(crank.w, v, crank.a, a);
    LinkageVariation weights = {
        .tip = {r, combine(1.0, first, -tau, force), combine(crank.w * crank.w, a, 0.0, a)},
        .angle = weight[VARIABLE_TIP_ANGLE],
    };
    double by_phi = weights.angle * c->pose.efg.first_rate[1];
    if (evaluations & EVALUATION_MARGIN) {
        by_phi += margin * transmission(c, 1);
        *(is_near_abd(c) ? &weights.transmission_abd : &weights.transmission_efg) = margin;
    }
    const Vector *tip = c->pose.tip;
    for (int n = 0; n <= order; ++n)
        by_phi += weights.tip[n].x * tip[n + 1].x + weights.tip[n].y * tip[n + 1].y;
    gradient[VARIABLE_CRANK_PHI] = by_phi;
    gradient[VARIABLE_CRANK_W] = v.x * tip[1].x + v.y * tip[1].y;
    if (order >= 2)
        gradient[VARIABLE_CRANK_W] += 2.0 * crank.w * (a.x * tip[2].x + a.y * tip[2].y);
    gradient[VARIABLE_CRANK_A] = a.x * tip[1].x + a.y * tip[1].y;
    gradient[VARIABLE_TIP_FX] = -tau * tip[1].x;
    gradient[VARIABLE_TIP_FY] = -tau * tip[1].y;
    if (by_geometry) {
        LinkageGeometry geometry;
        linkage_gradient(&c->linkage, &c->pose, crank.phi, order, &weights, &geometry);
        memcpy(&gradient[VARIABLE_GEOMETRY_L1], &geometry, sizeof geometry);
    }
    return COMPONENT_OK;
}
