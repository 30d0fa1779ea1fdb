#include "linkage.h"

#include "direction.h"
#include "plane.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

static const double QUARTER_TURN = 1.57079632679489661923;

/* The n-th derivative of a e(-phi) is (-i)^n a e(-phi). */
static inline Vector clockwise_derivative(int n, Vector a) {
    switch (n & 3) {
    case 0: return a;
    case 1: return (Vector){a.y, -a.x};
    case 2: return (Vector){-a.x, -a.y};
    default: return (Vector){-a.y, a.x};
    }
}

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

/* The triangle of a dyad, joint on the right of its base: the links are
 * (along - i height) base, where height = four_areas * per_area. */
typedef struct {
    double along_first, along_second;
    double four_areas, per_area;
} Triangle;

/* Solves the triangle; false where the dyad cannot close, or closes at a dead point.
 * 16 area^2 = ((first+second)^2 - base^2) (base^2 - (first-second)^2): the factored form of
 * Heron's formula, whose differences are rounded in base^2 alone. */
static inline bool solve_triangle(const LinkageSides *sides, Vector base, Triangle *triangle) {
    double base_squared = dot(base, base);
    double stretch = (sides->sum_squared - base_squared) + sides->sum_squared_low;
    double fold = (base_squared - sides->difference_squared) - sides->difference_squared_low;
    if (!(stretch > 0.0 && fold > 0.0))
        return false;
    triangle->four_areas = sqrt(stretch * fold);
    triangle->per_area = 0.5 / base_squared;
    triangle->along_first = (sides->squares_difference + base_squared) * triangle->per_area;
    triangle->along_second = (sides->squares_difference - base_squared) * triangle->per_area;
    return true;
}

/* (along - i height) z: what is on a link, where z is what it would be on the base. The root is
 * multiplied last, since everything waits for it. */
static inline Vector on_link(double along, const Triangle *triangle, Vector z) {
    Vector right = {triangle->per_area * z.y, -triangle->per_area * z.x};
    return plus(scaled(along, z), scaled(triangle->four_areas, right));
}

static inline void keep_dyad(const Triangle *triangle, Vector base, LinkageDyad *dyad) {
    dyad->first = on_link(triangle->along_first, triangle, base);
    dyad->second = on_link(triangle->along_second, triangle, base);
    dyad->determinant = -0.5 * triangle->four_areas;
}

/* By how much the base is too long (positive) or too short (negative) for the two links. */
static double dyad_gap(const LinkageSides *sides, Vector base) {
    double length = hypot(base.x, base.y);
    double stretched = sqrt(sides->sum_squared), folded = sqrt(sides->difference_squared);
    return length >= 0.5 * (stretched + folded) ? length - stretched : length - folded;
}

/* A link z of rates rate[] has z^(n) = (known + i rate[n]) z; `known` follows from lower orders
 * (Faa di Bruno's formula for e(angle)). At order 1 it is zero, at order 2 real: n is constant
 * where these functions are inlined, so that nothing is spent on those zeros. */
static inline Vector known_part(int n, const double *rate) {
    double w = rate[1];
    switch (n) {
    case 1: return (Vector){0.0, 0.0};
    case 2: return (Vector){-w * w, 0.0};
    case 3: return (Vector){-3.0 * w * rate[2], -w * w * w};
    default:
        return (Vector){w * w * w * w - 4.0 * w * rate[3] - 3.0 * rate[2] * rate[2],
                        -6.0 * w * w * rate[2]};
    }
}

static inline Vector times_known(int n, Vector known, Vector z) {
    return n <= 2 ? scaled(known.x, z) : turned(known, z);
}

/* The n-th derivative of z. */
static inline Vector link_derivative(int n, const double *rate, Vector z) {
    Vector across = {-rate[n] * z.y, rate[n] * z.x};
    return n == 1 ? across : plus(times_known(n, known_part(n, rate), z), across);
}

/* The n-th derivative of base + second = first, times first and times second: a 2x2 system
 * with the same determinant at every order. Each function solves for one of the two rates. */
static inline void solve_first_rate(int n, const LinkageSides *sides, Vector base_derivative,
                                    LinkageDyad *dyad) {
    double moment = dot(dyad->second, base_derivative);
    if (n > 1) {
        Vector known_first = known_part(n, dyad->first_rate);
        Vector known_second = known_part(n, dyad->second_rate);
        Vector rest = minus(base_derivative, times_known(n, known_first, dyad->first));
        moment = dot(dyad->second, rest) + known_second.x * sides->second_squared;
    }
    dyad->first_rate[n] = moment * dyad->reciprocal_determinant;
}

static inline void solve_second_rate(int n, const LinkageSides *sides, Vector base_derivative,
                                     LinkageDyad *dyad) {
    double moment = dot(dyad->first, base_derivative);
    if (n > 1) {
        Vector known_first = known_part(n, dyad->first_rate);
        Vector known_second = known_part(n, dyad->second_rate);
        Vector rest = plus(base_derivative, times_known(n, known_second, dyad->second));
        moment = dot(dyad->first, rest) - known_first.x * sides->first_squared;
    }
    dyad->second_rate[n] = moment * dyad->reciprocal_determinant;
}

/* ---- the linkage ----------------------------------------------------------------------- */

void linkage_prepare(const LinkageGeometry *g, Linkage *linkage) {
    linkage->geometry = *g;
    linkage->unit_oa = direction(g->phi1);
    linkage->unit_cd = direction(g->phi4);
    linkage->unit_de = direction(-g->theta3);
    linkage->crank_cd = scaled(g->L4, linkage->unit_cd);
    linkage->base_ad = minus(linkage->crank_cd, scaled(g->L1, linkage->unit_oa));
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
    Triangle triangle;
    Vector along = direction(phi), clockwise = {along.x, -along.y};
    pose->order = -1;
    pose->crank_cd = turned(linkage->crank_cd, clockwise);
    pose->base_turning = turned(linkage->base_ad, clockwise);

    Vector base = plus(linkage->pivot_c, pose->base_turning); /* A->D */
    if (!solve_triangle(&linkage->abd, base, &triangle)) {
        if (gap != NULL)
            *gap = dyad_gap(&linkage->abd, base);
        return LINKAGE_ABD_OPEN;
    }
    keep_dyad(&triangle, base, &pose->abd);
    pose->arm = on_link(triangle.along_second, &triangle, turned(linkage->arm, base));
    pose->joint_e[0] = plus(pose->crank_cd, pose->arm);

    base = minus(linkage->pivot_cg, pose->joint_e[0]); /* E->G */
    if (!solve_triangle(&linkage->efg, base, &triangle)) {
        if (gap != NULL)
            *gap = dyad_gap(&linkage->efg, base);
        return LINKAGE_EFG_OPEN;
    }
    keep_dyad(&triangle, base, &pose->efg);
    pose->nozzle = on_link(triangle.along_first, &triangle, turned(linkage->nozzle, base));
    pose->tip[0] = plus(linkage->pivot_c, plus(pose->joint_e[0], pose->nozzle));
    pose->order = 0;
    return LINKAGE_CLOSED;
}

/* Derivative n from all lower ones. Links AB and GF carry nothing further: their rates of
 * order n - 1 are needed, and computed, only now. */
static inline void differentiate_once(int n, const Linkage *linkage, LinkagePose *pose) {
    LinkageDyad *abd = &pose->abd, *efg = &pose->efg;
    if (n == 1) {
        abd->reciprocal_determinant = 1.0 / abd->determinant;
        efg->reciprocal_determinant = 1.0 / efg->determinant;
    } else {
        solve_first_rate(n - 1, &linkage->abd, clockwise_derivative(n - 1, pose->base_turning),
                         abd);
        solve_second_rate(n - 1, &linkage->efg, scaled(-1.0, pose->joint_e[n - 1]), efg);
    }
    solve_second_rate(n, &linkage->abd, clockwise_derivative(n, pose->base_turning), abd);
    pose->joint_e[n] = plus(clockwise_derivative(n, pose->crank_cd),
                            link_derivative(n, abd->second_rate, pose->arm));
    solve_first_rate(n, &linkage->efg, scaled(-1.0, pose->joint_e[n]), efg);
    pose->tip[n] = plus(pose->joint_e[n], link_derivative(n, efg->first_rate, pose->nozzle));
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

double linkage_nozzle_angle(const Linkage *linkage, const LinkagePose *pose) {
    Vector upward = turned(linkage->unit_ij, pose->efg.first);
    /* i times I->J is forward where the nozzle points straight down */
    return atan2(-upward.x, upward.y) - QUARTER_TURN;
}

double linkage_transmission(const LinkageSides *sides, const LinkageDyad *dyad, int order) {
    double sine = -dyad->determinant * sides->reciprocal_product;
    if (order == 0)
        return sine;
    /* the angle between the links grows by the difference of their rates */
    double cosine = dot(dyad->first, dyad->second) * sides->reciprocal_product;
    double rate = dyad->second_rate[1] - dyad->first_rate[1];
    if (order == 1)
        return -cosine * rate;
    return -cosine * (dyad->second_rate[2] - dyad->first_rate[2]) - sine * rate * rate;
}
