#include "linkage.h"

#include "direction.h"
#include "turning.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

static const double QUARTER_TURN = 1.57079632679489661923;

/* ---- exact sums and products (Dekker 1971, doi:10.1007/BF01397083) --------------------- */

/* high + low = (a + b)^2 to twice the working precision. */
static void square_of_sum(double a, double b, double *high, double *low) {
    /* the sum and its rounding error */
    double sum = a + b;
    double from_b = sum - a;
    double sum_error = (a - (sum - from_b)) + (b - from_b);
    /* 2^27 + 1 splits 53 bits into 26 + 26, whose products are exact */
    double split = 134217729.0 * sum;
    double head = split - (split - sum), tail = sum - head;
    *high = sum * sum;
    *low = ((head * head - *high) + 2.0 * head * tail) + tail * tail + 2.0 * sum * sum_error;
}

/* ---- dyads ----------------------------------------------------------------------------- */

static void prepare_sides(double first, double second, LinkageSides *sides) {
    square_of_sum(first, second, &sides->sum_squared, &sides->sum_squared_low);
    square_of_sum(first, -second, &sides->difference_squared, &sides->difference_squared_low);
    sides->squares_difference = (first - second) * (first + second);
    sides->first_squared = first * first;
    sides->second_squared = second * second;
    sides->reciprocal_product = 1.0 / (first * second);
}

/* Solves the triangle of a dyad; false where the dyad cannot close, or closes at a dead point.
 * 16 area^2 = ((first+second)^2 - base^2) (base^2 - (first-second)^2): the factored form of
 * Heron's formula, whose differences are rounded in base^2 alone. */
static inline bool solve_triangle(const LinkageSides *sides, Vector base, LinkageDyad *dyad) {
    double base_squared = dot(base, base);
    double stretch = (sides->sum_squared - base_squared) + sides->sum_squared_low;
    double fold = (base_squared - sides->difference_squared) - sides->difference_squared_low;
    dyad->base = base;
    dyad->base_squared = base_squared;
    if (!(stretch > 0.0 && fold > 0.0))
        return false;
    dyad->four_areas = sqrt(stretch * fold);
    dyad->per_area = 0.5 / base_squared;
    dyad->along_first = (sides->squares_difference + base_squared) * dyad->per_area;
    dyad->along_second = (sides->squares_difference - base_squared) * dyad->per_area;
    return true;
}

/* (along - i height) z: what is on a link, where z is what it would be on the base. The root is
 * multiplied last, since everything waits for it. */
static inline Vector on_link(double along, const LinkageDyad *dyad, Vector z) {
    double right = dyad->per_area * z.y, left = dyad->per_area * z.x;
    return (Vector){along * z.x + dyad->four_areas * right, along * z.y - dyad->four_areas * left};
}

/* By how much the base is too long (positive) or too short (negative) for the two links. */
static double dyad_gap(const LinkageSides *sides, Vector base) {
    double length = hypot(base.x, base.y);
    double stretched = sqrt(sides->sum_squared), folded = sqrt(sides->difference_squared);
    return length >= 0.5 * (stretched + folded) ? length - stretched : length - folded;
}

/* The n-th derivative of base + second = first, times first and times second: a 2x2 system with
 * the same determinant at every order. The functions below it solve for one of the rates each.
 * No link is drawn for that: link . base^(n) = along base_along - base_across for both, and
 * (i second) . first = four_areas / 2. */
static inline void take_base_derivative(int n, Vector base_derivative, LinkageDyad *dyad) {
    if (n == 1) {
        dyad->height = dyad->four_areas * dyad->per_area;
        dyad->reciprocal_determinant = -2.0 / dyad->four_areas;
    }
    if (n == 2)
        dyad->links_product = (dyad->along_first * dyad->along_second + dyad->height * dyad->height)
                              * dyad->base_squared;
    dyad->base_along = dot(dyad->base, base_derivative);
    dyad->base_across = dyad->height * cross(dyad->base, base_derivative);
}

static inline void solve_first_rate(int n, const LinkageSides *sides, LinkageDyad *dyad) {
    double moment = dyad->along_second * dyad->base_along - dyad->base_across;
    if (n > 1) {
        Vector first = known_part(n, dyad->first_rate), second = known_part(n, dyad->second_rate);
        moment += second.x * sides->second_squared - first.x * dyad->links_product;
        if (n > 2)
            moment += 0.5 * dyad->four_areas * first.y;
    }
    dyad->first_rate[n] = moment * dyad->reciprocal_determinant;
}

static inline void solve_second_rate(int n, const LinkageSides *sides, LinkageDyad *dyad) {
    double moment = dyad->along_first * dyad->base_along - dyad->base_across;
    if (n > 1) {
        Vector first = known_part(n, dyad->first_rate), second = known_part(n, dyad->second_rate);
        moment += second.x * dyad->links_product - first.x * sides->first_squared;
        if (n > 2)
            moment += 0.5 * dyad->four_areas * second.y;
    }
    dyad->second_rate[n] = moment * dyad->reciprocal_determinant;
}

/* ---- the linkage ----------------------------------------------------------------------- */

void linkage_prepare(const LinkageGeometry *g, Linkage *linkage) {
    linkage->geometry = *g;
    linkage->unit_oa = direction(g->phi1);
    linkage->unit_cd = direction(g->phi4);
    linkage->unit_de = direction(-g->theta3);
    Vector crank_oa = scaled(g->L1, linkage->unit_oa), crank_cd = scaled(g->L4, linkage->unit_cd);
    for (int n = 0; n < 4; ++n) { /* by n quarter turns: as the derivatives go round */
        linkage->crank_cd[n] = clockwise_derivative(n, crank_cd);
        linkage->base_ad[n] = clockwise_derivative(n, minus(crank_cd, crank_oa));
    }
    linkage->pivot_c = (Vector){g->XC, g->YC};
    linkage->pivot_cg = (Vector){g->XG - g->XC, g->YG - g->YC};
    linkage->arm = scaled(g->L5 / g->L3, linkage->unit_de);
    /* e(theta8 + theta9) as a product: the sum of the angles would be rounded once more */
    linkage->unit_hi = direction(g->theta8);
    linkage->unit_ij = turned(linkage->unit_hi, direction(g->theta9));
    Vector tool =
        plus(scaled(g->L8 / g->L6, linkage->unit_hi), scaled(g->L9 / g->L6, linkage->unit_ij));
    linkage->nozzle = (Vector){0.5 - tool.x, -tool.y};
    prepare_sides(g->L2, g->L3, &linkage->abd);
    prepare_sides(g->L6, g->L7, &linkage->efg);
}

LinkageClosure linkage_place(const Linkage *linkage, double phi, LinkagePose *pose, double *gap) {
    LinkageDyad *abd = &pose->abd, *efg = &pose->efg;
    unsigned quarters;
    Vector along = direction_within_quarter(phi, &quarters), clockwise = {along.x, -along.y};
    pose->order = pose->jets_order = -1;
    pose->clockwise = clockwise;
    pose->quarters = (int)quarters;
    pose->crank_cd = turned(linkage->crank_cd[quarters], clockwise);
    pose->base_turning = turned(linkage->base_ad[quarters], clockwise);

    Vector base = plus(linkage->pivot_c, pose->base_turning); /* A->D */
    if (!solve_triangle(&linkage->abd, base, abd)) {
        if (gap != NULL)
            *gap = dyad_gap(&linkage->abd, base);
        return LINKAGE_ABD_OPEN;
    }
    pose->arm = on_link(abd->along_second, abd, turned(linkage->arm, abd->base));
    pose->joint_e[0] = plus(pose->crank_cd, pose->arm);

    base = minus(minus(linkage->pivot_cg, pose->crank_cd), pose->arm); /* E->G, soonest so */
    if (!solve_triangle(&linkage->efg, base, efg)) {
        if (gap != NULL)
            *gap = dyad_gap(&linkage->efg, base);
        return LINKAGE_EFG_OPEN;
    }
    pose->nozzle = on_link(efg->along_first, efg, turned(linkage->nozzle, efg->base));
    pose->tip[0] = plus(plus(linkage->pivot_c, pose->joint_e[0]), pose->nozzle);
    pose->order = 0;
    return LINKAGE_CLOSED;
}

/* Derivative n from all lower ones. Links AB and GF carry nothing further: their rates of
 * order n - 1 are needed, and computed, only now. */
static inline void differentiate_once(int n, const Linkage *linkage, LinkagePose *pose) {
    LinkageDyad *abd = &pose->abd, *efg = &pose->efg;
    if (n > 1) {
        solve_first_rate(n - 1, &linkage->abd, abd);
        solve_second_rate(n - 1, &linkage->efg, efg);
    }
    take_base_derivative(n, clockwise_derivative(n, pose->base_turning), abd);
    solve_second_rate(n, &linkage->abd, abd);
    pose->joint_e[n] =
        derivative_beyond(n, clockwise_derivative(n, pose->crank_cd), abd->second_rate, pose->arm);
    take_base_derivative(n, scaled(-1.0, pose->joint_e[n]), efg);
    solve_first_rate(n, &linkage->efg, efg);
    pose->tip[n] = derivative_beyond(n, pose->joint_e[n], efg->first_rate, pose->nozzle);
    pose->order = n;
}

void linkage_differentiate(const Linkage *linkage, LinkagePose *pose, int order) {
    int there = pose->order;
    if (there >= order)
        return;
    /* constant orders, so that the compiler drops what is zero at each */
    if (there < 1)
        differentiate_once(1, linkage, pose);
    if (there < 2 && order >= 2)
        differentiate_once(2, linkage, pose);
    if (order < 3)
        return;
    if (there < 3)
        differentiate_once(3, linkage, pose);
    if (there < 4 && order >= 4)
        differentiate_once(4, linkage, pose);
}

void linkage_complete_rates(const Linkage *linkage, LinkagePose *pose) {
    if (pose->order < 1)
        return;
    solve_first_rate(pose->order, &linkage->abd, &pose->abd);
    solve_second_rate(pose->order, &linkage->efg, &pose->efg);
}

Vector linkage_first_link(const LinkageDyad *dyad) {
    return on_link(dyad->along_first, dyad, dyad->base);
}

Vector linkage_second_link(const LinkageDyad *dyad) {
    return on_link(dyad->along_second, dyad, dyad->base);
}

double linkage_nozzle_angle(const Linkage *linkage, const LinkagePose *pose) {
    Vector upward = turned(linkage->unit_ij, linkage_first_link(&pose->efg));
    /* i times I->J is forward where the nozzle points straight down */
    return direction_angle((Vector){upward.y, -upward.x}) - QUARTER_TURN;
}

double linkage_transmission(const LinkageSides *sides, const LinkageDyad *dyad, int order) {
    double sine = 0.5 * dyad->four_areas * sides->reciprocal_product;
    if (order == 0)
        return sine;
    /* the angle between the links grows by the difference of their rates */
    double cosine = dyad->links_product * sides->reciprocal_product;
    double rate = dyad->second_rate[1] - dyad->first_rate[1];
    if (order == 1)
        return -cosine * rate;
    return -cosine * (dyad->second_rate[2] - dyad->first_rate[2]) - sine * rate * rate;
}
