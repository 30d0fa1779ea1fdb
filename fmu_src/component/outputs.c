#include "outputs.h"

#include "factors.h"
#include "locals.h"
#include "pose.h"
#include "variables.h"

/* Equations have two kinds of products: those with masses in them, and the others (interface.toml).
 */
#define NOTHING(c, P, n, Q)

/* A bit for each derivative of the pose that an equation needs. */
#define NEED(c, P, n, Q) | POSE_BIT(POSE_NEEDS_##P(n))
#define NEEDS_OF_OUTPUT(NAME) EQUATION_##NAME(NEED, NOTHING)
#define NEEDS_OF_MASSES(NAME) EQUATION_##NAME(NOTHING, NEED)
#define NEEDS_OF_GROUP(NAME) (0 INTERFACE_OUTPUTS_OF_##NAME(NEEDS_OF_OUTPUT))
#define NEEDS_OF_GROUP_WITH_MASSES(NAME) (0 INTERFACE_OUTPUTS_OF_##NAME(NEEDS_OF_MASSES))
#define GROUP_IF_POSE(NAME) | (NEEDS_OF_GROUP(NAME) > 0 ? EVALUATION_##NAME : 0)
#define GROUP_IF_FIRST(NAME) | (NEEDS_OF_GROUP(NAME) >= 2 ? EVALUATION_##NAME : 0)
#define GROUP_IF_SECOND(NAME) | (NEEDS_OF_GROUP(NAME) >= 4 ? EVALUATION_##NAME : 0)
#define LOCAL_GROUP(NAME) | EVALUATION_##NAME
#define GROUP_IF_MASSES(NAME) | (NEEDS_OF_GROUP_WITH_MASSES(NAME) > 0 ? EVALUATION_##NAME : 0)
#define GROUP_IF_SECOND_OF_MASSES(NAME)                                                            \
    | (NEEDS_OF_GROUP_WITH_MASSES(NAME) >= 4 ? EVALUATION_##NAME : 0)

#define MASS_PRODUCT(c, P, n, Q) | 1
#define MASS_PRODUCTS_OF(NAME) EQUATION_##NAME(NOTHING, MASS_PRODUCT)
#define GROUP_HAS_MASSES(NAME) ((0 INTERFACE_OUTPUTS_OF_##NAME(MASS_PRODUCTS_OF)) > 0)
#define GROUP_WITH_MASSES(NAME) | (GROUP_HAS_MASSES(NAME) ? EVALUATION_##NAME : 0)

/* The groups that need the pose, and its first, second derivative by phi; and those that, where
 * there is mass, need its jets, and these to the second order; those that masses are in at all; and
 * those of locals. */
enum {
    NEED_POSE = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_POSE),
    NEED_FIRST = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_FIRST),
    NEED_SECOND = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_SECOND),
    NEED_MASSES = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_MASSES),
    LOCALS = 0 INTERFACE_LOCAL_GROUPS(LOCAL_GROUP),
    WITH_MASSES = 0 INTERFACE_OUTPUT_GROUPS(GROUP_WITH_MASSES),
    NEED_SECOND_OF_MASSES = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_SECOND_OF_MASSES),
};

static int order_for(uint32_t evaluations) {
    if (evaluations & NEED_SECOND)
        return 2;
    return evaluations & NEED_FIRST ? 1 : 0;
}

/* NOLINTBEGIN(bugprone-macro-parentheses): the terms of a sum */
#define ADD(c, P, n, Q)                                                                            \
    +(c) * (pose_factor(component, POSE_##P, n) * motion_factor(component, MOTION_##Q, 0))
/* NOLINTEND(bugprone-macro-parentheses) */
#define COMPUTE(NAME) value[VARIABLE_##NAME] = EQUATION_##NAME(ADD, NOTHING);
#define COMPUTE_GROUP(NAME)                                                                        \
    if (evaluations & EVALUATION_##NAME) {                                                         \
        INTERFACE_OUTPUTS_OF_##NAME(COMPUTE)                                                       \
    }

#define ADD_MASSES(NAME) value[VARIABLE_##NAME] += 0.0 EQUATION_##NAME(NOTHING, ADD);
#define ADD_MASSES_OF_GROUP(NAME)                                                                  \
    if (GROUP_HAS_MASSES(NAME) && evaluations & EVALUATION_##NAME) {                               \
        INTERFACE_OUTPUTS_OF_##NAME(ADD_MASSES)                                                    \
    }
/* What the masses add, where there are any. */
static COMPONENT_RARELY ComponentStatus add_masses(Component *component, uint32_t evaluations) {
    if (evaluations & NEED_MASSES) {
        int order = evaluations & NEED_SECOND_OF_MASSES ? 2 : 1;
        ComponentStatus status = pose_solve(component, order);
        if (status != COMPONENT_OK)
            return status;
        pose_solve_masses(component, order);
    }
    double *value = component->value;
    INTERFACE_OUTPUT_GROUPS(ADD_MASSES_OF_GROUP)
    return COMPONENT_OK;
}

ComponentStatus outputs_evaluate(Component *component, uint32_t evaluations) {
    int order = order_for(evaluations);
    if (component->pose.order >= 0) {
        linkage_differentiate(&component->linkage, &component->pose, order);
    } else if (evaluations & NEED_POSE) {
        ComponentStatus status = pose_solve(component, order);
        if (status != COMPONENT_OK)
            return status;
    }
    double *value = component->value;
    INTERFACE_OUTPUT_GROUPS(COMPUTE_GROUP)
    if (evaluations & WITH_MASSES) {
        pose_prepare(component); /* parameters or the state may be new: then has_mass is not */
        ComponentStatus status =
            component->inertia.has_mass ? add_masses(component, evaluations) : COMPONENT_OK;
        if (status != COMPONENT_OK)
            return status;
    }
    if (evaluations & LOCALS) {
        ComponentStatus status = locals_evaluate(component, evaluations);
        if (status != COMPONENT_OK)
            return status;
    }
    component->fresh |= evaluations;
    return COMPONENT_OK;
}

/* Says which of the values was wrong, once the loop that only sums up the faults saw one. */
static COMPONENT_RARELY ComponentStatus refuse_getting(Component *c, const uint32_t reference[]) {
    while (variable_is_known(*reference) && !variable_is_boolean(*reference))
        ++reference;
    return refuse_reference(c, *reference, "is a Boolean, not a real");
}

ComponentStatus component_get_real(Component *c, const uint32_t reference[], size_t count,
                                   double value[]) {
    uint32_t wanted = EVALUATION_NONE;
    for (size_t i = 0; i < count; ++i)
        wanted |= reference[i] <= INTERFACE_COUNT ? interface_evaluation[reference[i]]
                                                  : (uint32_t)EVALUATION_NOT_REAL;
    wanted &= ~c->fresh;
    if (wanted) {
        if (wanted & EVALUATION_NOT_REAL)
            return refuse_getting(c, reference);
        ComponentStatus status = outputs_evaluate(c, wanted);
        if (status != COMPONENT_OK)
            return status;
    }
    for (size_t i = 0; i < count; ++i)
        value[i] = c->value[reference[i]];
    return COMPONENT_OK;
}
