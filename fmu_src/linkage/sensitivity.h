/* How a pose changes with the geometry: its derivatives by each of the 18 parameters, exact to
 * rounding, along one direction (linkage_vary) or all at once (linkage_gradient). Each costs one
 * sweep over the two dyads, however many parameters there are.
 *
 * A change of the geometry turns the links of a dyad by angles that solve the same 2x2 system as
 * the rates by the crank angle (linkage.c). The derivatives of the tip by phi change as well: all
 * quantities are power series in a change of phi, and the sweep is done in their arithmetic. The
 * sweep backwards is its transpose; a product of series, transposed, is the same product of the
 * series with their coefficients in reverse order. */
#ifndef SENSITIVITY_H
#define SENSITIVITY_H

#include "linkage.h"
#include "mass.h"

enum { LINKAGE_MAX_VARIED_ORDER = 2 };

/* Changes of what a pose gives, or the weights with which these count. */
typedef struct {
    Vector tip[LINKAGE_MAX_VARIED_ORDER + 1]; /* tip[n]: of the n-th derivative of J by phi */
    double angle;                             /* of the direction of the nozzle's axis */
    double transmission_abd, transmission_efg; /* of linkage_transmission, order 0 */
    double mass;                              /* of the total mass */
    double inertia[LINKAGE_MAX_VARIED_ORDER]; /* of the jets of LinkageMassJets */
    Vector moment[LINKAGE_MAX_VARIED_ORDER + 1];
} LinkageVariation;

/* The first-order change of a pose at crank angle phi, and of the derivatives of its tip up to
 * `order`, under a change of the geometry. The pose has derivatives up to order + 1.
 *
 * With masses, not NULL, also that of its mass jets, moment up to `order` and inertia up to
 * order - 1, under a change of the masses besides (the one of the geometry alone where there are
 * none: they stay 0). */
INTERNAL void linkage_vary(const Linkage *linkage, const LinkageMasses *masses,
                           const LinkagePose *pose, double phi, int order,
                           const LinkageGeometry *change, const LinkageMasses *mass_change,
                           LinkageVariation *variation);

/* The transpose: the gradient by the geometry and, with masses, by these of the sum of all that
 * `weight` names (up to `order`), each times its weight. */
INTERNAL void linkage_gradient(const Linkage *linkage, const LinkageMasses *masses,
                               const LinkagePose *pose, double phi, int order,
                               const LinkageVariation *weight, LinkageGeometry *gradient,
                               LinkageMasses *mass_gradient);

#endif
