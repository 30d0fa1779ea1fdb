#include "outputs.h"

#include "pose.h"
#include "variables.h"

/* A bit for each derivative of the pose that an equation needs. */
#define NEED(c, P, n, Q) | (POSE_NEEDS_##P(n) < 0 ? 0 : 1 << (POSE_NEEDS_##P(n) & 7))
#define NEEDS_OF_OUTPUT(NAME) EQUATION_##NAME(NEED)
#define NEEDS_OF_GROUP(NAME) (0 INTERFACE_OUTPUTS_OF_##NAME(NEEDS_OF_OUTPUT))
#define GROUP_IF_POSE(NAME) | (NEEDS_OF_GROUP(NAME) > 0 ? EVALUATION_##NAME : 0)
#define GROUP_IF_FIRST(NAME) | (NEEDS_OF_GROUP(NAME) >= 2 ? EVALUATION_##NAME : 0)
#define GROUP_IF_SECOND(NAME) | (NEEDS_OF_GROUP(NAME) >= 4 ? EVALUATION_##NAME : 0)

/* The groups that need the pose, and its first, second derivative by phi. */
enum {
    NEED_POSE = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_POSE),
    NEED_FIRST = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_FIRST),
    NEED_SECOND = 0 INTERFACE_OUTPUT_GROUPS(GROUP_IF_SECOND),
};

static int order_for(uint32_t evaluations) {
    if (evaluations & NEED_SECOND)
        return 2;
    return evaluations & NEED_FIRST ? 1 : 0;
}

#define ADD(c, P, n, Q)                                                                            \
    +(c) * (pose_factor(component, POSE_##P, n) * motion_factor(now, MOTION_##Q, 0))
#define COMPUTE(NAME) value[VARIABLE_##NAME] = EQUATION_##NAME(ADD);
#define COMPUTE_GROUP(NAME)                                                                        \
    if (evaluations & EVALUATION_##NAME) {                                                         \
        INTERFACE_OUTPUTS_OF_##NAME(COMPUTE)                                                       \
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
    const Motion *now = component->shown;
    double *value = component->value;
    INTERFACE_OUTPUT_GROUPS(COMPUTE_GROUP)
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
