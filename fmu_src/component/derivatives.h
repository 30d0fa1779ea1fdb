/* The derivatives of outputs: by time, and by inputs, machine.s and parameters, forward and in
 * reverse. Each is a loop over the products of the output's equation (equations.h). */
#ifndef DERIVATIVES_H
#define DERIVATIVES_H

#include "instance.h"

/* Time derivatives of outputs, orders 1 and 2, at the instant that the outputs belong to. */
INTERNAL ComponentStatus component_get_output_derivatives(Component *component,
                                                          const uint32_t reference[], size_t count,
                                                          const int32_t order[], double value[]);

/* sensitivity[i] = sum over k of d unknown[i] / d known[k] times seed[k], at the instant that
 * the outputs belong to. Unknowns: outputs and der(machine.s). Knowns: inputs, machine.s, time and,
 * in initialization mode, the parameters of the geometry. */
INTERNAL ComponentStatus component_get_directional_derivative(
    Component *component, const uint32_t unknown[], size_t unknown_count, const uint32_t known[],
    size_t known_count, const double seed[], double sensitivity[]);

/* The other way about: sensitivity[k] = sum over i of seed[i] times d unknown[i] / d known[k]. */
INTERNAL ComponentStatus component_get_adjoint_derivative(
    Component *component, const uint32_t unknown[], size_t unknown_count, const uint32_t known[],
    size_t known_count, const double seed[], double sensitivity[]);

#endif
