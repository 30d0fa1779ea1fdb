#include "sensitivity.h"

#include "direction.h"
#include "plane.h"

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
    VectorSeries arm = turning(order, arm_rate, pose->arm),
                 tool = turning(order, nozzle_rate, pose->nozzle);
    parts->oa_left = left(order, &parts->oa);
    parts->cd_left = left(order, &parts->cd);
    parts->arm_left = left(order, &arm);
    parts->tool_left = left(order, &tool);
    parts->hi_left = left(order, &parts->hi);
    parts->ij_left = left(order, &parts->ij);
}

void linkage_vary(const Linkage *linkage, const LinkagePose *pose, double phi, int order,
                  const LinkageGeometry *change, LinkageVariation *variation) {
    const LinkageGeometry *g = &linkage->geometry;
    Parts parts;
    take_apart(linkage, pose, phi, order, &parts);
    Series ab, db, ef, gf; /* changes of the links' angles */

    VectorSeries e = {{{0.0, 0.0}}}; /* of D - C, then of E - C */
    add(order, &e, change->L4, &parts.cd);
    add(order, &e, g->L4 * change->phi4, &parts.cd_left);
    VectorSeries base = e;
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
}

/* linkage_vary from its end to its beginning. Weights of series are reversed, so that the weight
 * of a constant is the last one. */
void linkage_gradient(const Linkage *linkage, const LinkagePose *pose, double phi, int order,
                      const LinkageVariation *weight, LinkageGeometry *gradient) {
    const LinkageGeometry *g = &linkage->geometry;
    Parts parts;
    take_apart(linkage, pose, phi, order, &parts);
    double of_base; /* what a length adds through its dyad */

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
    VectorSeries base = weigh_dyad(order, &parts.efg, &ef, &gf, &of_base, &gradient->L7);
    gradient->L6 = of_base + 0.5 * total(order, &parts.ef, &tip);
    gradient->XG = base.at[order].x;
    gradient->YG = base.at[order].y;

    VectorSeries e = tip;
    add(order, &e, -1.0, &base);
    gradient->L5 = total(order, &parts.de, &e);
    Series db = series_dot(order, &parts.arm_left, &e), ab = {{0.0}};
    gradient->theta3 = -db.at[order];
    ab.at[order] += parts.abd.cosine * weight->transmission_abd;
    db.at[order] -= parts.abd.cosine * weight->transmission_abd;
    base = weigh_dyad(order, &parts.abd, &ab, &db, &gradient->L2, &gradient->L3);
    gradient->L1 = -total(order, &parts.oa, &base);
    gradient->phi1 = -g->L1 * total(order, &parts.oa_left, &base);
    add(order, &e, 1.0, &base);
    gradient->L4 = total(order, &parts.cd, &e);
    gradient->phi4 = g->L4 * total(order, &parts.cd_left, &e);
    gradient->XC = e.at[order].x;
    gradient->YC = e.at[order].y;
}
