#include "forces.h"

/* What a body's motion demands: the sum of the forces on it, and of their moments about its start.
 */
typedef struct {
    Vector force;
    double moment;
} Demand;

/* A vector that turns with a link, and the link's angular velocity and acceleration. */
typedef struct {
    Vector along; /* the link's unit vector, from the body's start */
    double speed, acceleration;
} Turn;

static Vector left_of(Vector a) { return (Vector){-a.y, a.x}; }

/* The second derivative by time of a vector z that turns so. */
static Vector turn_acceleration(Turn turn, Vector z) {
    return plus(scaled(-turn.speed * turn.speed, z), scaled(turn.acceleration, left_of(z)));
}

static Demand demand(LinkageBody body, Turn turn, Vector start_acceleration) {
    Vector centre = plus(scaled(body.x, turn.along), scaled(body.y, left_of(turn.along)));
    Vector force = scaled(body.m, plus(start_acceleration, turn_acceleration(turn, centre)));
    return (Demand){force, cross(centre, force) + body.J * turn.acceleration};
}

/* The force R with u x R = p and v x R = q. */
static Vector force_of_moments(Vector u, double p, Vector v, double q) {
    return scaled(1.0 / cross(u, v), minus(scaled(p, v), scaled(q, u)));
}

static Turn turn_of(Vector link, double length, const double rate[], LinkageLoad load) {
    return (Turn){scaled(1.0 / length, link), rate[1] * load.w,
                  rate[2] * load.w * load.w + rate[1] * load.a};
}

void linkage_forces(const Linkage *linkage, const LinkageMasses *masses, LinkagePose *pose,
                    LinkageLoad load, LinkageForces *forces) {
    const LinkageGeometry *g = &linkage->geometry;
    linkage_differentiate(linkage, pose, 2);
    if (pose->order == 2)
        linkage_complete_rates(linkage, pose);
    static const double clockwise_rate[] = {0.0, -1.0, 0.0};
    Vector oa = minus(pose->crank_cd, pose->base_turning), cd = pose->crank_cd, arm = pose->arm;
    Vector ab = linkage_first_link(&pose->abd), db = linkage_second_link(&pose->abd);
    Vector ef = linkage_first_link(&pose->efg), gf = linkage_second_link(&pose->efg);
    Vector tip = pose->nozzle; /* from E */

    Vector e_db = scaled(1.0 / g->L3, db);
    /* e(-phi), the quarter turns with it: what the cranks' initial directions are turned by */
    Vector clockwise = pose->clockwise;
    for (int n = 0; n < pose->quarters; ++n)
        clockwise = (Vector){clockwise.y, -clockwise.x};
    Turn of_oa = turn_of(turned(linkage->unit_oa, clockwise), 1.0, clockwise_rate, load);
    Turn of_cd = turn_of(turned(linkage->unit_cd, clockwise), 1.0, clockwise_rate, load);
    Turn of_ab = turn_of(ab, g->L2, pose->abd.first_rate, load);
    Turn of_de = turn_of(turned(linkage->unit_de, e_db), 1.0, pose->abd.second_rate, load);
    Turn of_ef = turn_of(ef, g->L6, pose->efg.first_rate, load);
    Turn of_gf = turn_of(gf, g->L7, pose->efg.second_rate, load);

    Vector at_a = plus(load.acceleration, turn_acceleration(of_oa, oa));
    Vector at_d = plus(load.acceleration, turn_acceleration(of_cd, cd));
    Vector at_e = plus(at_d, turn_acceleration(of_de, arm));
    Demand on_oa = demand(masses->OA, of_oa, load.acceleration);
    Demand on_cd = demand(masses->CD, of_cd, load.acceleration);
    Demand on_ab = demand(masses->AB, of_ab, at_a);
    Demand on_de = demand(masses->DE, of_de, at_d);
    Demand on_ef = demand(masses->EF, of_ef, at_e);
    Demand on_gf = demand(masses->GF, of_gf, load.acceleration);

    /* about E and about G, then about A and about D, only the force in the dyad's joint is unknown
     */
    forces->F = force_of_moments(ef, on_ef.moment - cross(tip, load.tip_force), gf, -on_gf.moment);
    forces->E = minus(minus(on_ef.force, forces->F), load.tip_force);
    forces->G = plus(on_gf.force, forces->F);
    forces->B = force_of_moments(ab, on_ab.moment, db, -(on_de.moment + cross(arm, forces->E)));
    forces->A = minus(on_ab.force, forces->B);
    forces->D = plus(plus(on_de.force, forces->B), forces->E);
    forces->O = plus(on_oa.force, forces->A);
    forces->C = plus(on_cd.force, forces->D);
    forces->torque_oa = -(on_oa.moment + cross(oa, forces->A));
    forces->torque_cd = -(on_cd.moment + cross(cd, forces->D));
}
