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

enum { LINKAGE_MAX_VARIED_ORDER = 2 };

/* Changes of what a pose gives, or the weights with which these count. */
typedef struct {
    Vector tip[LINKAGE_MAX_VARIED_ORDER + 1]; /* tip[n]: of the n-th derivative of J by phi */
    double angle;                             /* of the direction of the nozzle's axis */
    double transmission_abd, transmission_efg; /* of linkage_transmission, order 0 */
} LinkageVariation;

/* The first-order change of a pose at crank angle phi, and of the derivatives of its tip up to
 * `order`, under a change of the geometry. The pose has derivatives up to order + 1. */
INTERNAL void linkage_vary(const Linkage *linkage, const LinkagePose *pose, double phi, int order,
                           const LinkageGeometry *change, LinkageVariation *variation);

/* The transpose: the gradient by the geometry of the sum of all that `weight` names (tip[0] to
 * tip[order]), each times its weight. */
INTERNAL void linkage_gradient(const Linkage *linkage, const LinkagePose *pose, double phi,
                               int order, const LinkageVariation *weight,
                               LinkageGeometry *gradient);

#endif
