/* The forces in the joints, and what each crank takes: Newton's and Euler's equations of the six
 * bodies in closed form, dyad by dyad. Forces in N, torques in N m. */
#ifndef FORCES_H
#define FORCES_H

#include "mass.h"

/* What moves the linkage, and what acts on it. */
typedef struct {
    double w, a;         /* of the cranks, rad/s, rad/s2 */
    Vector acceleration; /* of the machine, less that of free fall: (machine's, gravity), m/s2 */
    Vector tip_force;    /* of the soil on the tip */
} LinkageLoad;

/* The force in each joint: at O, C and G by the machine on crank OA, crank CD, rocker GF; at A by
 * OA on AB; at D by CD on the plate BDE; at B by the plate on AB; at E by the plate on EF; at F by
 * GF on EF. Torques on the cranks, in the working direction: together, what the drive gives. */
typedef struct {
    Vector O, A, B, C, D, E, F, G;
    double torque_oa, torque_cd;
} LinkageForces;

/* The pose is raised to order 2 where it is not there yet. */
INTERNAL void linkage_forces(const Linkage *linkage, const LinkageMasses *masses, LinkagePose *pose,
                             LinkageLoad load, LinkageForces *forces);

#endif
