/* The kinematics of the seven-bar planting linkage: geometry and crank angle in, position of
 * the nozzle's tip and its derivatives by the crank angle out.
 *
 * Pure functions over plain structs: no input or output, no globals, no allocation, no time.
 * Lengths in m, angles in rad. Axes are fixed to the machine: x forward, y up, origin O.
 *
 *   crank OA and crank CD turn together, clockwise; phi is the angle that they have turned
 *   A = L1 e(phi1 - phi)            D = C + L4 e(phi4 - phi)            e(t) = cos t + i sin t
 *   B closes the dyad ABD on the right of A->D:   |AB| = L2, |DB| = L3
 *   E = D + (L5/L3) e(-theta3) (B - D)
 *   F closes the dyad EFG on the right of E->G:   |EF| = L6, |GF| = L7
 *   J = (E+F)/2 - (L8 e(theta8) + L9 e(theta8+theta9)) (F-E)/L6         the tip
 *
 * Source: Chen Jianneng et al. 2010, doi:10.3969/j.issn.1000-1298.2010.12.010, equations (1)
 * to (8). The paper differentiates each angle by time and divides by sines and tangents that
 * vanish within the working cycle; here each order of derivative solves the same 2x2 system,
 * whose determinant vanishes at dead points only.
 *
 * Error: at most 2 times the summed effect that one unit in the last place of phi and of each
 * parameter has on the exact value, also beside a dead point; derivatives 3 and 4 lose more where
 * the base of a dyad is much shorter than its links (tests/fmi/test_accuracy.py), and derivatives
 * from 2 on where C lies much nearer to O than the cranks are long and ABD is near a dead point:
 * the dyad then turns with the cranks nearly as one body
 * (scenarios/speed_vs_error/hard_cases/geometries.py). */
#ifndef LINKAGE_H
#define LINKAGE_H

#include "plane.h"

/* An FMU is compiled as one file, in which the functions of its parts are static
 * (fmi/fmi2_fmu.c); compiled one by one, the parts are linked. */
#ifndef INTERNAL
#define INTERNAL
#endif

enum { LINKAGE_MAX_ORDER = 4 };

/* The geometry as a designer gives it; names as in the paper's table 1. */
typedef struct {
    double L1, L2, L3, L4, L5, L6, L7, L8, L9;
    double XC, YC, XG, YG;
    double phi1, phi4, theta3, theta8, theta9;
} LinkageGeometry;

/* What the triangle of a dyad needs of its two side lengths. The squares are unevaluated sums
 * high + low, exact to some 1e-32, so that near a dead point only the base is rounded. */
typedef struct {
    double sum_squared, sum_squared_low;               /* (first + second)^2 */
    double difference_squared, difference_squared_low; /* (first - second)^2 */
    double squares_difference;                         /* first^2 - second^2 */
    double first_squared, second_squared;
    double reciprocal_product;                         /* 1 / (first second) */
} LinkageSides;

/* A geometry made ready; linkage_prepare fills it, all else reads it. */
typedef struct {
    /* at phi = 0 and turned on, clockwise, by one, two and three quarter turns: */
    Vector crank_cd[4]; /* L4 e(phi4): D - C */
    Vector base_ad[4];  /* L4 e(phi4) - L1 e(phi1): D - A - C */
    Vector pivot_c;    /* C - O */
    Vector pivot_cg;   /* G - C */
    Vector arm;        /* (L5/L3) e(-theta3): E - D = arm (B - D) */
    Vector nozzle;     /* 1/2 - (L8 e(theta8) + L9 e(theta8+theta9))/L6: J - E = nozzle (F - E) */
    LinkageSides abd, efg;
    LinkageGeometry geometry;
    /* directions: of OA and CD at phi = 0; of DE over that of DB; of I->H and J->I over E->F's */
    Vector unit_oa, unit_cd, unit_de, unit_hi, unit_ij;
} Linkage;

/* A dyad in one pose: two links from the ends of a base to their common joint, on the right of
 * the base. As complex numbers, first = (along_first - i height) base, and second likewise.
 * rate[n] is the n-th derivative, by phi, of the link's angle; the rates of AB and GF, which
 * carry nothing further, are there one order later than those of DB and EF. */
typedef struct {
    Vector base;                      /* A->D, E->G */
    double base_squared;
    double along_first, along_second; /* the links' parts along the base, over its length */
    double four_areas, per_area;      /* of the triangle; height = four_areas per_area */
    double height; /* over the base's length; from order 1 on, as what follows */
    double reciprocal_determinant; /* 1 / (first x second), negative */
    double base_along, base_across; /* base . base^(n), height (base x base^(n)): n the order */
    double links_product; /* first . second, from order 2 on */
    double first_rate[LINKAGE_MAX_ORDER + 1]; /* of AB, EF */
    double second_rate[LINKAGE_MAX_ORDER + 1]; /* of DB, GF */
} LinkageDyad;

/* One pose and what has been computed of it. Fields beyond `order` hold nothing. */
typedef struct {
    int order; /* highest derivative of tip that is there; -1: no pose */
    int jets_order; /* likewise of its LinkageMassJets, where these are asked for; -1: none */
    Vector tip[LINKAGE_MAX_ORDER + 1]; /* J - O and its derivatives by phi: m, m/rad, ... */
    Vector joint_e[LINKAGE_MAX_ORDER + 1]; /* E - C and its derivatives by phi */
    Vector clockwise; /* e(-phi), but for the quarter turns in it */
    int quarters;     /* 0 to 3 */
    Vector crank_cd, base_turning; /* the turning parts of D and of the base AD */
    Vector arm, nozzle; /* E - D and J - E */
    LinkageDyad abd, efg;
} LinkagePose;

typedef enum { LINKAGE_CLOSED, LINKAGE_ABD_OPEN, LINKAGE_EFG_OPEN } LinkageClosure;

/* Makes a geometry ready. Lengths L2, L3, L6, L7 must be positive, all values finite; the
 * caller checks. */
INTERNAL void linkage_prepare(const LinkageGeometry *geometry, Linkage *linkage);

/* Solves the pose at crank angle phi (any finite value): tip[0]; order becomes 0.
 * A dyad that cannot close, or closes at a dead point exactly (where velocities are infinite),
 * is named in the result; `pose` then holds no pose (order -1) and `*gap`, where not NULL, the
 * length in m by which the base is too long (> 0), or too short (< 0), for the two links. */
INTERNAL LinkageClosure linkage_place(const Linkage *linkage, double phi, LinkagePose *pose,
                                      double *gap);

/* Raises a solved pose to derivatives up to `order` (at most LINKAGE_MAX_ORDER); what is there
 * already is kept. */
INTERNAL void linkage_differentiate(const Linkage *linkage, LinkagePose *pose, int order);

/* The rates of AB and GF at the pose's own order, which nothing else needs. */
INTERNAL void linkage_complete_rates(const Linkage *linkage, LinkagePose *pose);

/* A dyad's links as vectors: from the start of the base to the joint, AB or EF; from its end, DB or
 * GF. The pose is solved; no derivative is needed. */
INTERNAL Vector linkage_first_link(const LinkageDyad *dyad);
INTERNAL Vector linkage_second_link(const LinkageDyad *dyad);

/* Direction of the nozzle axis I->J in rad, counter-clockwise from forward, in (-3pi/2, pi/2]:
 * the turn around straight down. Its derivatives by phi are pose->efg.first_rate[1...order]. */
INTERNAL double linkage_nozzle_angle(const Linkage *linkage, const LinkagePose *pose);

/* |sine| of the transmission angle of a dyad, 0 at a dead point and 1 where the links are
 * square (order 0), or its derivative by phi (order 1 or 2, less than that of the pose). */
INTERNAL double linkage_transmission(const LinkageSides *sides, const LinkageDyad *dyad, int order);

#endif
