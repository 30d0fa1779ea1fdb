/* The local variables: what one looks at. A group of them is computed when one is read. */
#ifndef LOCALS_H
#define LOCALS_H

#include "instance.h"

/* Computes the locals of the EVALUATION_ bits into component->value. COMPONENT_DISCARD where the
 * pose cannot be reached. */
INTERNAL ComponentStatus locals_evaluate(Component *component, uint32_t evaluations);

#endif
