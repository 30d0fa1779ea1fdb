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

/* The derivative of an output by time, order 1 or 2. */
INTERNAL ComponentStatus outputs_time_derivative(Component *component, uint32_t reference,
                                                 int order, double *value);

/* The partial derivative of an output by an input, all else as it is. */
INTERNAL ComponentStatus outputs_partial_derivative(Component *component, uint32_t unknown,
                                                    uint32_t known, double *value);

/* The message that the pose at crank angle phi cannot be reached. */
INTERNAL void outputs_explain_gap(Component *component, LinkageClosure closure, double phi,
                                  double gap);

/* COMPONENT_ERROR, with the parameter and its value in the message, where no linkage has such
 * a geometry. */
INTERNAL ComponentStatus outputs_prepare(Component *component);

#endif
