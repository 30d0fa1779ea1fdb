/* The outputs of an instance and their derivatives: every one is the jet of the pose, read with
 * the motion of the crank. Called by component.c; the modes and arguments are checked there. */
#ifndef OUTPUTS_H
#define OUTPUTS_H

#include "component.h"

/* Makes sure that the pose is there, with derivatives up to `order`. COMPONENT_ERROR where the
 * geometry is impossible, COMPONENT_DISCARD where the pose cannot be reached. */
INTERNAL ComponentStatus outputs_solve(Component *component, int order);

/* Computes the outputs of the EVALUATION_ bits into component->settings.real. */
INTERNAL ComponentStatus outputs_evaluate(Component *component, uint32_t evaluations);

/* Whether the functions below know the derivatives of an output, or of der(machine.s). One that is
 * declared in interface.toml and forgotten there is to be refused, not answered. */
INTERNAL bool outputs_have_derivatives(uint32_t reference);
/* COMPONENT_ERROR, with the message that they do not. */
INTERNAL ComponentStatus outputs_refuse_derivative(Component *component, uint32_t reference);

/* The derivative of an output by time, order 1 or 2. */
INTERNAL ComponentStatus outputs_time_derivative(Component *component, uint32_t reference,
                                                 int order, double *value);

/* The first-order change of the outputs of the EVALUATION_ bits under a change of the inputs, of
 * machine.s and, by_geometry, of the geometry. known, change: by value reference; changes that are
 * not asked for stay as they were. */
INTERNAL ComponentStatus outputs_vary(Component *component, uint32_t evaluations, bool by_geometry,
                                      const double known[], double change[]);

/* The transpose: the gradient, by these, of the outputs of the EVALUATION_ bits times their
 * weights, summed up. The weights of all other outputs are 0. */
INTERNAL ComponentStatus outputs_gradient(Component *component, uint32_t evaluations,
                                          bool by_geometry, const double weight[],
                                          double gradient[]);

/* The message that the pose at crank angle phi cannot be reached. */
INTERNAL void outputs_explain_gap(Component *component, LinkageClosure closure, double phi,
                                  double gap);

/* Makes the geometry ready where it was set anew. */
INTERNAL void outputs_prepare(Component *component);

#endif
