/* The masses that move with the linkage: reflected inertia and first moment of mass, with their
 * derivatives by the crank angle. All that the dynamics of one degree of freedom need:
 *
 *   inertia  Jr(phi) = sum of m |c'|^2 + J theta'^2    kg m2, as the cranks feel it
 *   moment   S(phi)  = sum of m c                      kg m, relative to O; c the centres of mass
 *
 * Sums over the six moving bodies; a prime is a derivative by phi, theta the angle of a body's
 * link. The kinetic energy is Jr w^2/2 where the machine stands, the potential energy g S.y
 * (Lagrange's equation gives the torque; interface.toml has it).
 *
 * Each moment of a link turns with it, so S is a sum of five turning vectors, and Jr a quadratic
 * form of the links' rates whose coefficients are dot products of these vectors and the cranks. */
#ifndef MASS_H
#define MASS_H

#include "linkage.h"

#include <stdbool.h>

/* A body: mass in kg; its centre, in m, along the link from its first-named joint and to the left
 * of its direction; moment of inertia about that centre in kg m2. */
typedef struct {
    double m, x, y, J;
} LinkageBody;

/* Cranks OA and CD, link AB, the plate BDE (along DE), link EF with the nozzle, rocker GF. */
typedef struct {
    LinkageBody OA, CD, AB, DE, EF, GF;
} LinkageMasses;

/* Masses made ready for a geometry; linkage_prepare_masses fills it, all else reads it. */
typedef struct {
    bool has_mass; /* else all that follows is 0, and nothing need be computed */
    LinkageMasses masses;
    double total;     /* kg */
    Vector moment_fixed;     /* the constant part of S */
    Vector moment_cranks[4]; /* of what turns with the cranks, at phi = 0 and turned as Linkage's */
    Vector ab, de, ef, gf; /* moments over the links AB, DB, EF, GF, as complex numbers */
    /* about the joint that the body turns around; the cranks' with the joints that they carry, the
     * plate's with E */
    double inertia_cranks, inertia_ab, inertia_de, inertia_ef, inertia_gf;
} LinkageInertia;

/* What has been computed for one pose, up to the derivatives that its jets_order tells: inertia to
 * jets_order - 1, moment to jets_order. */
typedef struct {
    double inertia[LINKAGE_MAX_ORDER];
    Vector moment[LINKAGE_MAX_ORDER + 1];
} LinkageMassJets;

/* Makes masses ready; the linkage is. */
INTERNAL void linkage_prepare_masses(const Linkage *linkage, const LinkageMasses *masses,
                                     LinkageInertia *inertia);

/* Computes the jets of a pose up to `order`, 1 to LINKAGE_MAX_ORDER; the pose is raised to it where
 * it is not there yet. */
INTERNAL void linkage_differentiate_masses(const Linkage *linkage, const LinkageInertia *inertia,
                                           LinkagePose *pose, int order, LinkageMassJets *jets);

#endif
