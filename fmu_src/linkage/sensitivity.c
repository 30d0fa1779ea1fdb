#include "sensitivity.h"

#include "direction.h"

#include <stddef.h>

/* ---- power series in a change of phi, cut off after the order wanted ---------------------- */

enum { TERMS = LINKAGE_MAX_VARIED_ORDER + 1 };

typedef struct {
    double at[TERMS];
} Series;

typedef struct {
    Vector at[TERMS];
} VectorSeries;

static const double FACTORIAL[TERMS] = {1.0, 1.0, 2.0};

/* Each term only where it is wanted, without loops: for so few the counting would cost more. */

static inline Series series_dot(int order, const VectorSeries *a, const VectorSeries *b) {
    Series sum = {{dot(a->at[0], b->at[0]), 0.0, 0.0}};
    if (order >= 1)
        sum.at[1] = dot(a->at[0], b->at[1]) + dot(a->at[1], b->at[0]);
    if (order >= 2)
        sum.at[2] = dot(a->at[0], b->at[2]) + dot(a->at[1], b->at[1]) + dot(a->at[2], b->at[0]);
    return sum;
}

/* The last coefficient of the dot product: where one factor is reversed, the sum over all terms of
 * the other one, each with its weight. */
static inline double total(int order, const VectorSeries *a, const VectorSeries *b) {
    double sum = dot(a->at[0], b->at[order]);
    if (order >= 1)
        sum += dot(a->at[1], b->at[order - 1]);
    if (order >= 2)
        sum += dot(a->at[2], b->at[0]);
    return sum;
}

/* into += factor a */
static inline void add(int order, VectorSeries *into, double factor, const VectorSeries *a) {
    into->at[0] = plus(into->at[0], scaled(factor, a->at[0]));
    if (order >= 1)
        into->at[1] = plus(into->at[1], scaled(factor, a->at[1]));
    if (order >= 2)
        into->at[2] = plus(into->at[2], scaled(factor, a->at[2]));
}

/* into += factor a */
static inline void add_product(int order, VectorSeries *into, const Series *factor,
                               const VectorSeries *a) {
    add(order, into, factor->at[0], a);
    if (order >= 1)
        into->at[1] = plus(into->at[1], scaled(factor->at[1], a->at[0]));
    if (order >= 2)
        into->at[2] = plus(into->at[2],
                           plus(scaled(factor->at[1], a->at[1]), scaled(factor->at[2], a->at[0])));
}

static inline Series product(int order, const Series *a, const Series *b) {
    Series result = {{a->at[0] * b->at[0], 0.0, 0.0}};
    if (order >= 1)
        result.at[1] = a->at[0] * b->at[1] + a->at[1] * b->at[0];
    if (order >= 2)
        result.at[2] = a->at[0] * b->at[2] + a->at[1] * b->at[1] + a->at[2] * b->at[0];
    return result;
}

/* A vector on a link whose angle has the derivatives rate[1], rate[2]. */
static inline VectorSeries turning(int order, const double *rate, Vector z) {
    VectorSeries series = {{z, {0.0, 0.0}, {0.0, 0.0}}};
    if (order >= 1)
        series.at[1] = (Vector){-rate[1] * z.y, rate[1] * z.x};
    if (order >= 2) {
        Vector second = {-0.5 * rate[1] * rate[1], 0.5 * rate[2]};
        series.at[2] = turned(second, z);
    }
    return series;
}

/* A quarter turn to the left: what a unit change of its angle does to each vector. */
static inline VectorSeries left(int order, const VectorSeries *a) {
    VectorSeries series = {{{-a->at[0].y, a->at[0].x}, {0.0, 0.0}, {0.0, 0.0}}};
    if (order >= 1)
        series.at[1] = (Vector){-a->at[1].y, a->at[1].x};
    if (order >= 2)
        series.at[2] = (Vector){-a->at[2].y, a->at[2].x};
    return series;
}

/* ---- dyads: base + second = first ----------------------------------------------------------- */

typedef struct {
    VectorSeries first, second;
    Series per_determinant; /* 1 / (first x second) */
    double per_first, per_second; /* 1 / length */
    double cosine; /* of the transmission angle */
} Dyad;

static Dyad dyad_series(int order, const LinkageDyad *dyad, const LinkageSides *sides,
                        double first_length, double second_length) {
    Vector first = linkage_first_link(dyad), second = linkage_second_link(dyad);
    Dyad series = {
        .first = turning(order, dyad->first_rate, first),
        .second = turning(order, dyad->second_rate, second),
        .per_first = 1.0 / first_length,
        .per_second = 1.0 / second_length,
        .cosine = dot(first, second) * sides->reciprocal_product,
    };
    /* first x second = (i first) . second; its reciprocal term by term */
    VectorSeries across = left(order, &series.first);
    Series determinant = series_dot(order, &across, &series.second);
    series.per_determinant.at[0] = dyad->reciprocal_determinant;
    double *per = series.per_determinant.at;
    if (order >= 1)
        per[1] = -determinant.at[1] * per[0] * per[0];
    if (order >= 2)
        per[2] = -(determinant.at[1] * per[1] + determinant.at[2] * per[0]) * per[0];
    return series;
}

/* The angles by which the links turn when the base and the two lengths change: the change of
 * base + second - first, less that of the lengths, is i first . angle - i second . angle. */
static void vary_dyad(int order, const Dyad *dyad, VectorSeries base, double first_length,
                      double second_length, Series *first_angle, Series *second_angle) {
    add(order, &base, -first_length * dyad->per_first, &dyad->first);
    add(order, &base, second_length * dyad->per_second, &dyad->second);
    Series along_second = series_dot(order, &base, &dyad->second);
    Series along_first = series_dot(order, &base, &dyad->first);
    *first_angle = product(order, &along_second, &dyad->per_determinant);
    *second_angle = product(order, &along_first, &dyad->per_determinant);
}

/* The transpose: weights of the angles (reversed) into those of the base (reversed) and of the
 * lengths. */
static VectorSeries weigh_dyad(int order, const Dyad *dyad, const Series *first_angle,
                               const Series *second_angle, double *first_length,
                               double *second_length) {
    VectorSeries base = {{{0.0, 0.0}}};
    Series along_second = product(order, first_angle, &dyad->per_determinant);
    Series along_first = product(order, second_angle, &dyad->per_determinant);
    add_product(order, &base, &along_second, &dyad->second);
    add_product(order, &base, &along_first, &dyad->first);
    *first_length = -dyad->per_first * total(order, &base, &dyad->first);
    *second_length = dyad->per_second * total(order, &base, &dyad->second);
    return base;
}

/* ---- the linkage ------------------------------------------------------------------------------
 */

typedef struct {
    Dyad abd, efg;
    VectorSeries oa, cd, de, ef, hi, ij; /* unit vectors; hi, ij: from I to H, J to I */
    VectorSeries arm;                    /* E - D */
    VectorSeries oa_left, cd_left, arm_left, tool_left, hi_left, ij_left;
} Parts;

static void take_apart(const Linkage *linkage, const LinkagePose *pose, double phi, int order,
                       Parts *parts) {
    static const double clockwise_rate[TERMS] = {0.0, -1.0, 0.0};
    const LinkageGeometry *g = &linkage->geometry;
    const double *arm_rate = pose->abd.second_rate, *nozzle_rate = pose->efg.first_rate;
    Vector along = direction(phi), clockwise = {along.x, -along.y};
    parts->abd = dyad_series(order, &pose->abd, &linkage->abd, g->L2, g->L3);
    parts->efg = dyad_series(order, &pose->efg, &linkage->efg, g->L6, g->L7);
    parts->oa = turning(order, clockwise_rate, turned(linkage->unit_oa, clockwise));
    parts->cd = turning(order, clockwise_rate, turned(linkage->unit_cd, clockwise));
    Vector db = scaled(parts->abd.per_second, parts->abd.second.at[0]);
    Vector ef = scaled(parts->efg.per_first, parts->efg.first.at[0]);
    parts->de = turning(order, arm_rate, turned(linkage->unit_de, db));
    parts->ef = turning(order, nozzle_rate, ef);
    parts->hi = turning(order, nozzle_rate, turned(linkage->unit_hi, ef));
    parts->ij = turning(order, nozzle_rate, turned(linkage->unit_ij, ef));
    VectorSeries tool = turning(order, nozzle_rate, pose->nozzle);
    parts->arm = turning(order, arm_rate, pose->arm);
    parts->oa_left = left(order, &parts->oa);
    parts->cd_left = left(order, &parts->cd);
    parts->arm_left = left(order, &parts->arm);
    parts->tool_left = left(order, &tool);
    parts->hi_left = left(order, &parts->hi);
    parts->ij_left = left(order, &parts->ij);
}

/* ---- bodies -------------------------------------------------------------------------------------
 */

/* A body: its centre is at start + (x + iy) along, and its link turns as angle. */
typedef struct {
    VectorSeries start, along;
    Series angle; /* the constant is not needed */
} Body;

enum { BODIES = sizeof(LinkageMasses) / sizeof(LinkageBody) };

/* How the bodies' starts and links change, or the weights of these: as series, in the order of
 * LinkageMasses. */
typedef struct {
    VectorSeries start[BODIES];
    Series angle[BODIES];
} BodyVariation;

static Series angle_of(int order, const double *rate) {
    return (Series){{0.0, rate[1], order >= 2 ? 0.5 * rate[2] : 0.0}};
}

static VectorSeries sum_of(int order, VectorSeries a, const VectorSeries *b) {
    add(order, &a, 1.0, b);
    return a;
}

static void take_bodies(const Linkage *linkage, const LinkagePose *pose, int order,
                        const Parts *parts, Body body[BODIES]) {
    static const double clockwise_rate[TERMS] = {0.0, -1.0, 0.0};
    const LinkageGeometry *g = &linkage->geometry;
    const LinkageDyad *abd = &pose->abd, *efg = &pose->efg;
    VectorSeries none = {{{0.0, 0.0}}}, c = {{{g->XC, g->YC}}}, a = none, d = c, ab = none,
                 gf = none;
    add(order, &a, g->L1, &parts->oa);
    add(order, &d, g->L4, &parts->cd);
    add(order, &ab, parts->abd.per_first, &parts->abd.first);
    add(order, &gf, parts->efg.per_second, &parts->efg.second);
    Series cranks = angle_of(order, clockwise_rate);
    body[0] = (Body){none, parts->oa, cranks};
    body[1] = (Body){c, parts->cd, cranks};
    body[2] = (Body){a, ab, angle_of(order, abd->first_rate)};
    body[3] = (Body){d, parts->de, angle_of(order, abd->second_rate)};
    body[4] = (Body){sum_of(order, d, &parts->arm), parts->ef, angle_of(order, efg->first_rate)};
    body[5] = (Body){{{{g->XG, g->YG}}}, gf, angle_of(order, efg->second_rate)};
}

/* (x + iy) a. */
static VectorSeries placed(int order, double x, double y, const VectorSeries *a) {
    VectorSeries series = {{{0.0, 0.0}}}, across = left(order, a);
    add(order, &series, x, a);
    add(order, &series, y, &across);
    return series;
}

/* Jr and Jr' are made of c' = c1 + 2 c2 phi, and so on: of the terms of order 1 and 2. */
static void vary_bodies(const LinkageMasses *masses, int order, const Body body[BODIES],
                        const LinkageMasses *mass_change, const BodyVariation *varied,
                        LinkageVariation *variation) {
    const LinkageBody *all = &masses->OA, *changes = &mass_change->OA;
    for (int i = 0; i < BODIES; ++i) {
        LinkageBody b = all[i], change = changes[i];
        VectorSeries arm = placed(order, b.x, b.y, &body[i].along);
        VectorSeries c = sum_of(order, body[i].start, &arm), dc = varied->start[i];
        VectorSeries arm_left = left(order, &arm);
        VectorSeries moved = placed(order, change.x, change.y, &body[i].along);
        add_product(order, &dc, &varied->angle[i], &arm_left);
        add(order, &dc, 1.0, &moved);
        const double *t = body[i].angle.at, *dt = varied->angle[i].at;
        variation->mass += change.m;
        for (int n = 0; n <= order; ++n)
            variation->moment[n] =
                plus(variation->moment[n],
                     scaled(FACTORIAL[n], plus(scaled(b.m, dc.at[n]), scaled(change.m, c.at[n]))));
        if (order >= 1)
            variation->inertia[0] += 2.0 * (b.m * dot(c.at[1], dc.at[1]) + b.J * t[1] * dt[1])
                                     + change.m * dot(c.at[1], c.at[1]) + change.J * t[1] * t[1];
        if (order >= 2)
            variation->inertia[1] +=
                4.0
                * (b.m * (dot(c.at[1], dc.at[2]) + dot(c.at[2], dc.at[1]))
                   + b.J * (t[1] * dt[2] + t[2] * dt[1]) + change.m * dot(c.at[1], c.at[2])
                   + change.J * t[1] * t[2]);
    }
}

/* The transpose; the weights in *weighed are not reversed. */
static void weigh_bodies(const LinkageMasses *masses, int order, const Body body[BODIES],
                         const LinkageVariation *weight, BodyVariation *weighed,
                         LinkageMasses *mass_gradient) {
    const LinkageBody *all = &masses->OA;
    LinkageBody *gradients = &mass_gradient->OA;
    const double of_first = order >= 1 ? weight->inertia[0] : 0.0,
                 of_second = order >= 2 ? weight->inertia[1] : 0.0;
    for (int i = 0; i < BODIES; ++i) {
        LinkageBody b = all[i];
        VectorSeries arm = placed(order, b.x, b.y, &body[i].along);
        VectorSeries c = sum_of(order, body[i].start, &arm), arm_left = left(order, &arm);
        VectorSeries along_left = left(order, &body[i].along);
        const double *t = body[i].angle.at;
        VectorSeries w = {{{0.0, 0.0}}}; /* weight of c */
        LinkageBody gradient = {.m = weight->mass};
        for (int n = 0; n <= order; ++n) {
            w.at[n] = scaled(b.m * FACTORIAL[n], weight->moment[n]);
            gradient.m += FACTORIAL[n] * dot(weight->moment[n], c.at[n]);
        }
        Series turn = {{0.0}};
        if (order >= 1) {
            w.at[1] = plus(w.at[1], scaled(2.0 * b.m * of_first, c.at[1]));
            turn.at[1] = 2.0 * b.J * of_first * t[1];
            gradient.m += of_first * dot(c.at[1], c.at[1]);
            gradient.J += of_first * t[1] * t[1];
        }
        if (order >= 2) {
            double four = 4.0 * of_second;
            w.at[1] = plus(w.at[1], scaled(b.m * four, c.at[2]));
            w.at[2] = plus(w.at[2], scaled(b.m * four, c.at[1]));
            turn.at[1] += b.J * four * t[2];
            turn.at[2] += b.J * four * t[1];
            gradient.m += four * dot(c.at[1], c.at[2]);
            gradient.J += four * t[1] * t[2];
        }
        for (int n = 0; n <= order; ++n) {
            gradient.x += dot(w.at[n], body[i].along.at[n]);
            gradient.y += dot(w.at[n], along_left.at[n]);
            for (int k = 0; k <= n; ++k)
                turn.at[k] += dot(w.at[n], arm_left.at[n - k]);
        }
        weighed->start[i] = w;
        weighed->angle[i] = turn;
        gradients[i] = gradient;
    }
}

/* into += a, whose terms are the other way about. */
static void add_reversed(int order, VectorSeries *into, const VectorSeries *a) {
    for (int n = 0; n <= order; ++n)
        into->at[order - n] = plus(into->at[order - n], a->at[n]);
}

static void add_reversed_angle(int order, Series *into, const Series *a) {
    for (int n = 0; n <= order; ++n)
        into->at[order - n] += a->at[n];
}

/* ---- the sweeps ---------------------------------------------------------------------------------
 */

void linkage_vary(const Linkage *linkage, const LinkageMasses *masses, const LinkagePose *pose,
                  double phi, int order, const LinkageGeometry *change,
                  const LinkageMasses *mass_change, LinkageVariation *variation) {
    const LinkageGeometry *g = &linkage->geometry;
    Parts parts;
    take_apart(linkage, pose, phi, order, &parts);
    Series ab, db, ef, gf; /* changes of the links' angles */

    VectorSeries e = {{{0.0, 0.0}}}; /* of D - C, then of E - C */
    add(order, &e, change->L4, &parts.cd);
    add(order, &e, g->L4 * change->phi4, &parts.cd_left);
    VectorSeries base = e, d = e;
    base.at[0] = plus(base.at[0], (Vector){change->XC, change->YC});
    add(order, &base, -change->L1, &parts.oa);
    add(order, &base, -g->L1 * change->phi1, &parts.oa_left);
    vary_dyad(order, &parts.abd, base, change->L2, change->L3, &ab, &db);

    Series arm = db;
    arm.at[0] -= change->theta3;
    add(order, &e, change->L5, &parts.de);
    add_product(order, &e, &arm, &parts.arm_left);
    base = (VectorSeries){{{change->XG - change->XC, change->YG - change->YC}}};
    add(order, &base, -1.0, &e);
    vary_dyad(order, &parts.efg, base, change->L6, change->L7, &ef, &gf);

    VectorSeries tip = e;
    double theta89 = change->theta8 + change->theta9;
    tip.at[0] = plus(tip.at[0], (Vector){change->XC, change->YC});
    add_product(order, &tip, &ef, &parts.tool_left);
    add(order, &tip, 0.5 * change->L6, &parts.ef);
    add(order, &tip, -change->L8, &parts.hi);
    add(order, &tip, -change->L9, &parts.ij);
    add(order, &tip, -g->L8 * change->theta8, &parts.hi_left);
    add(order, &tip, -g->L9 * theta89, &parts.ij_left);

    for (int n = 0; n <= order; ++n)
        variation->tip[n] = scaled(FACTORIAL[n], tip.at[n]);
    variation->angle = ef.at[0] + theta89;
    variation->transmission_abd = -parts.abd.cosine * (db.at[0] - ab.at[0]);
    variation->transmission_efg = -parts.efg.cosine * (gf.at[0] - ef.at[0]);
    if (masses == NULL)
        return;

    Body body[BODIES];
    take_bodies(linkage, pose, order, &parts, body);
    VectorSeries none = {{{0.0, 0.0}}}, c = {{{change->XC, change->YC}}}, a = none;
    add(order, &a, change->L1, &parts.oa);
    add(order, &a, g->L1 * change->phi1, &parts.oa_left);
    BodyVariation varied = {
        .start =
            {none, c, a, sum_of(order, c, &d), sum_of(order, c, &e), {{{change->XG, change->YG}}}},
        .angle = {{{change->phi1}}, {{change->phi4}}, ab, arm, ef, gf},
    };
    vary_bodies(masses, order, body, mass_change, &varied, variation);
}

/* linkage_vary from its end to its beginning. Weights of series are reversed, so that the weight
 * of a constant is the last one. */
void linkage_gradient(const Linkage *linkage, const LinkageMasses *masses, const LinkagePose *pose,
                      double phi, int order, const LinkageVariation *weight,
                      LinkageGeometry *gradient, LinkageMasses *mass_gradient) {
    const LinkageGeometry *g = &linkage->geometry;
    Parts parts;
    take_apart(linkage, pose, phi, order, &parts);
    double of_base; /* what a length adds through its dyad */
    BodyVariation of_bodies = {.start = {{{{0.0, 0.0}}}}}; /* what bodies say of where they start */
    if (masses != NULL) {
        Body body[BODIES];
        take_bodies(linkage, pose, order, &parts, body);
        weigh_bodies(masses, order, body, weight, &of_bodies, mass_gradient);
    }
    const VectorSeries *of_start = of_bodies.start;
    const Series *of_angle = of_bodies.angle;

    VectorSeries tip = {{{0.0, 0.0}}};
    for (int n = 0; n <= order; ++n)
        tip.at[order - n] = scaled(FACTORIAL[n], weight->tip[n]);
    gradient->L8 = -total(order, &parts.hi, &tip);
    gradient->L9 = -total(order, &parts.ij, &tip);
    gradient->theta9 = weight->angle - g->L9 * total(order, &parts.ij_left, &tip);
    gradient->theta8 = gradient->theta9 - g->L8 * total(order, &parts.hi_left, &tip);

    Series ef = series_dot(order, &parts.tool_left, &tip), gf = {{0.0}};
    ef.at[order] += weight->angle + parts.efg.cosine * weight->transmission_efg;
    gf.at[order] -= parts.efg.cosine * weight->transmission_efg;
    add_reversed_angle(order, &ef, &of_angle[4]);
    add_reversed_angle(order, &gf, &of_angle[5]);
    VectorSeries base = weigh_dyad(order, &parts.efg, &ef, &gf, &of_base, &gradient->L7);
    gradient->L6 = of_base + 0.5 * total(order, &parts.ef, &tip);
    gradient->XG = base.at[order].x + of_start[5].at[0].x;
    gradient->YG = base.at[order].y + of_start[5].at[0].y;

    VectorSeries e = tip;
    add(order, &e, -1.0, &base);
    add_reversed(order, &e, &of_start[4]);
    gradient->L5 = total(order, &parts.de, &e);
    Series db = series_dot(order, &parts.arm_left, &e), ab = {{0.0}};
    add_reversed_angle(order, &db, &of_angle[3]);
    gradient->theta3 = -db.at[order];
    ab.at[order] += parts.abd.cosine * weight->transmission_abd;
    db.at[order] -= parts.abd.cosine * weight->transmission_abd;
    add_reversed_angle(order, &ab, &of_angle[2]);
    base = weigh_dyad(order, &parts.abd, &ab, &db, &gradient->L2, &gradient->L3);
    add(order, &e, 1.0, &base);
    add_reversed(order, &e, &of_start[3]);
    VectorSeries a = {{{0.0, 0.0}}};
    add_reversed(order, &a, &of_start[2]);
    add(order, &a, -1.0, &base);
    gradient->L1 = total(order, &parts.oa, &a);
    gradient->phi1 = g->L1 * total(order, &parts.oa_left, &a) + of_angle[0].at[0];
    gradient->L4 = total(order, &parts.cd, &e);
    gradient->phi4 = g->L4 * total(order, &parts.cd_left, &e) + of_angle[1].at[0];
    gradient->XC = e.at[order].x + of_start[1].at[0].x;
    gradient->YC = e.at[order].y + of_start[1].at[0].y;
}
