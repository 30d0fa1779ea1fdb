/* The values of what is computed: when they are first read, and no more of them than is. */
#ifndef OUTPUTS_H
#define OUTPUTS_H

#include "instance.h"

/* Values by reference: `count` of them, all or none. Reading what needs a pose that cannot be
 * reached is COMPONENT_DISCARD. */
INTERNAL ComponentStatus component_get_real(Component *component, const uint32_t reference[],
                                            size_t count, double value[]);

/* Computes the variables of the EVALUATION_ bits into component->value. COMPONENT_DISCARD where the
 * pose cannot be reached. */
INTERNAL ComponentStatus outputs_evaluate(Component *component, uint32_t evaluations);

#endif
