#include "mass.h"

#include "direction.h"
#include "turning.h"

#include <string.h>

/* ---- preparation ----------------------------------------------------------------------------- */

/* m (x + iy), the moment of a body over the unit vector of its link. */
static Vector body_moment(LinkageBody b) { return (Vector){b.m * b.x, b.m * b.y}; }

/* About the joint from which x and y are measured. */
static double body_inertia(LinkageBody b) { return b.J + b.m * (b.x * b.x + b.y * b.y); }

static bool body_has_mass(LinkageBody b) { return b.m != 0.0 || b.J != 0.0; }

void linkage_prepare_masses(const Linkage *linkage, const LinkageMasses *masses,
                            LinkageInertia *inertia) {
    const LinkageGeometry *g = &linkage->geometry;
    const LinkageMasses b = *masses;
    double on_crank_cd = b.DE.m + b.EF.m; /* what D carries: the plate, and with it EF */
    *inertia = (LinkageInertia){
        .has_mass = body_has_mass(b.OA) || body_has_mass(b.CD) || body_has_mass(b.AB)
                    || body_has_mass(b.DE) || body_has_mass(b.EF) || body_has_mass(b.GF),
        .masses = b,
        .total = b.OA.m + b.CD.m + b.AB.m + b.DE.m + b.EF.m + b.GF.m,
        .moment_fixed = plus(scaled(b.CD.m + on_crank_cd, linkage->pivot_c),
                             scaled(b.GF.m, (Vector){g->XG, g->YG})),
        .ab = scaled(1.0 / g->L2, body_moment(b.AB)),
        .de = scaled(1.0 / g->L3, turned(linkage->unit_de, body_moment(b.DE))),
        .ef = scaled(1.0 / g->L6, body_moment(b.EF)),
        .gf = scaled(1.0 / g->L7, body_moment(b.GF)),
        .inertia_cranks = body_inertia(b.OA) + body_inertia(b.CD) + b.AB.m * g->L1 * g->L1
                          + on_crank_cd * g->L4 * g->L4,
        .inertia_ab = body_inertia(b.AB),
        .inertia_de = body_inertia(b.DE) + b.EF.m * g->L5 * g->L5,
        .inertia_ef = body_inertia(b.EF),
        .inertia_gf = body_inertia(b.GF),
    };
    Vector oa = plus(body_moment(b.OA), (Vector){b.AB.m * g->L1, 0.0});
    Vector cd = plus(body_moment(b.CD), (Vector){on_crank_cd * g->L4, 0.0});
    Vector moment = plus(turned(oa, linkage->unit_oa), turned(cd, linkage->unit_cd));
    for (int n = 0; n < 4; ++n)
        inertia->moment_cranks[n] = clockwise_derivative(n, moment);
}

/* ---- jets: a value and its derivatives by phi --------------------------------------------------
 */

enum { JET_TERMS = LINKAGE_MAX_ORDER };

typedef struct {
    double at[JET_TERMS];
} Jet;

/* The product of two, up to derivative n (Leibniz). */
static inline Jet jet_product(int n, Jet a, Jet b) {
    Jet c = {{a.at[0] * b.at[0]}};
    if (n >= 1)
        c.at[1] = a.at[0] * b.at[1] + a.at[1] * b.at[0];
    if (n >= 2)
        c.at[2] = (a.at[0] * b.at[2] + a.at[2] * b.at[0]) + 2.0 * (a.at[1] * b.at[1]);
    if (n >= 3)
        c.at[3] =
            (a.at[0] * b.at[3] + a.at[3] * b.at[0]) + 3.0 * (a.at[1] * b.at[2] + a.at[2] * b.at[1]);
    return c;
}

/* into += factor a */
static inline void jet_add(int n, Jet *into, double factor, Jet a) {
    into->at[0] += factor * a.at[0];
    if (n >= 1)
        into->at[1] += factor * a.at[1];
    if (n >= 2)
        into->at[2] += factor * a.at[2];
    if (n >= 3)
        into->at[3] += factor * a.at[3];
}

/* a - b */
static inline Jet jet_difference(int n, Jet a, Jet b) {
    jet_add(n, &a, -1.0, b);
    return a;
}

/* The rate of a link's angle, and its derivatives. */
static inline Jet jet_of_rate(int n, const double rate[LINKAGE_MAX_ORDER + 1]) {
    return (Jet){{rate[1], n >= 1 ? rate[2] : 0.0, n >= 2 ? rate[3] : 0.0, n >= 3 ? rate[4] : 0.0}};
}

/* a . b of two vectors, of which b turns against a at the rate `turning`. */
static inline Jet jet_dot(int n, Vector a, Vector b, Jet turning) {
    Jet along = {{dot(a, b)}}, across = {{cross(a, b)}};
    if (n >= 1) {
        along.at[1] = -turning.at[0] * across.at[0];
        across.at[1] = turning.at[0] * along.at[0];
    }
    if (n >= 2) {
        along.at[2] = -(turning.at[1] * across.at[0] + turning.at[0] * across.at[1]);
        across.at[2] = turning.at[1] * along.at[0] + turning.at[0] * along.at[1];
    }
    if (n >= 3)
        along.at[3] = -((turning.at[2] * across.at[0] + turning.at[0] * across.at[2])
                        + 2.0 * (turning.at[1] * across.at[1]));
    return along;
}

/* ---- one pose ----------------------------------------------------------------------------------
 */

/* The moments of all that turns, as vectors: of the cranks, and of the links. */
typedef struct {
    Vector cranks, ab, de, ef, gf;
} Moments;

static inline Vector moment_derivative(int n, const LinkagePose *pose, Moments m) {
    Vector sum = clockwise_derivative(n, m.cranks);
    sum = derivative_beyond(n, sum, pose->abd.first_rate, m.ab);
    sum = derivative_beyond(n, sum, pose->abd.second_rate, m.de);
    sum = derivative_beyond(n, sum, pose->efg.first_rate, m.ef);
    return derivative_beyond(n, sum, pose->efg.second_rate, m.gf);
}

/* n: the highest derivative. */
static inline Jet inertia_jet(int n, const LinkageInertia *inertia, const LinkagePose *pose,
                              Moments m) {
    static const Jet cranks = {{-1.0}};
    Jet rate_ab = jet_of_rate(n, pose->abd.first_rate),
        rate_de = jet_of_rate(n, pose->abd.second_rate),
        rate_ef = jet_of_rate(n, pose->efg.first_rate),
        rate_gf = jet_of_rate(n, pose->efg.second_rate);
    /* A - O is D - C less the turning part of the base AD */
    Vector oa = minus(pose->crank_cd, pose->base_turning);
    Jet oa_ab = jet_dot(n, oa, m.ab, jet_difference(n, rate_ab, cranks));
    Jet cd_de = jet_dot(n, pose->crank_cd, m.de, jet_difference(n, rate_de, cranks));
    Jet cd_ef = jet_dot(n, pose->crank_cd, m.ef, jet_difference(n, rate_ef, cranks));
    Jet de_ef = jet_dot(n, pose->arm, m.ef, jet_difference(n, rate_ef, rate_de));
    /* rate_ab (I rate_ab - 2 oa_ab) + rate_de (I rate_de - 2 cd_de) + ... */
    Jet sum = {{inertia->inertia_cranks}}, factor = {{0.0}};
    jet_add(n, &factor, inertia->inertia_ab, rate_ab);
    jet_add(n, &factor, -2.0, oa_ab);
    jet_add(n, &sum, 1.0, jet_product(n, rate_ab, factor));
    factor = (Jet){{0.0}};
    jet_add(n, &factor, inertia->inertia_de, rate_de);
    jet_add(n, &factor, -2.0, cd_de);
    jet_add(n, &factor, 2.0, jet_product(n, rate_ef, de_ef));
    jet_add(n, &sum, 1.0, jet_product(n, rate_de, factor));
    factor = (Jet){{0.0}};
    jet_add(n, &factor, inertia->inertia_ef, rate_ef);
    jet_add(n, &factor, -2.0, cd_ef);
    jet_add(n, &sum, 1.0, jet_product(n, rate_ef, factor));
    jet_add(n, &sum, inertia->inertia_gf, jet_product(n, rate_gf, rate_gf));
    return sum;
}

static inline void mass_jets(int order, const LinkageInertia *inertia, LinkagePose *pose,
                             LinkageMassJets *jets) {
    Moments m = {
        .cranks = turned(inertia->moment_cranks[pose->quarters], pose->clockwise),
        .ab = turned(inertia->ab, linkage_first_link(&pose->abd)),
        .de = plus(turned(inertia->de, linkage_second_link(&pose->abd)),
                   scaled(inertia->masses.EF.m, pose->arm)),
        .ef = turned(inertia->ef, linkage_first_link(&pose->efg)),
        .gf = turned(inertia->gf, linkage_second_link(&pose->efg)),
    };
    Jet reflected = inertia_jet(order - 1, inertia, pose, m);
    memcpy(jets->inertia, reflected.at, sizeof jets->inertia);
    jets->moment[0] =
        plus(plus(plus(inertia->moment_fixed, m.cranks), plus(m.ab, m.de)), plus(m.ef, m.gf));
    jets->moment[1] = moment_derivative(1, pose, m);
    if (order >= 2)
        jets->moment[2] = moment_derivative(2, pose, m);
    if (order >= 3)
        jets->moment[3] = moment_derivative(3, pose, m);
    if (order >= 4)
        jets->moment[4] = moment_derivative(4, pose, m);
    pose->jets_order = order;
}

void linkage_differentiate_masses(const Linkage *linkage, const LinkageInertia *inertia,
                                  LinkagePose *pose, int order, LinkageMassJets *jets) {
    if (pose->jets_order >= order)
        return;
    linkage_differentiate(linkage, pose, order);
    if (pose->order == order)
        linkage_complete_rates(linkage, pose);
    /* constant orders, so that the compiler drops what is zero at each */
    switch (order) {
    case 1: mass_jets(1, inertia, pose, jets); break;
    case 2: mass_jets(2, inertia, pose, jets); break;
    case 3: mass_jets(3, inertia, pose, jets); break;
    default: mass_jets(4, inertia, pose, jets); break;
    }
}
