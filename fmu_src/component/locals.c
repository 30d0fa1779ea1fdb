#include "locals.h"

#include "../linkage/forces.h"

#include "pose.h"

/* The reference of a point's, or a force's, x; y follows. */
static void put(Component *c, uint32_t reference, Vector v) {
    c->value[reference] = v.x;
    c->value[reference + 1] = v.y;
}

static void locals_points(Component *c) {
    const Linkage *linkage = &c->linkage;
    const LinkageGeometry *g = &linkage->geometry;
    const LinkagePose *pose = &c->pose;
    Vector at_c = linkage->pivot_c, at_d = plus(at_c, pose->crank_cd);
    Vector at_a = minus(pose->crank_cd, pose->base_turning), at_e = plus(at_c, pose->joint_e[0]);
    Vector ef = linkage_first_link(&pose->efg), at_f = plus(at_e, ef);
    Vector at_h = scaled(0.5, plus(at_e, at_f));
    put(c, VARIABLE_JOINT_A_X, at_a);
    put(c, VARIABLE_JOINT_B_X, plus(at_d, linkage_second_link(&pose->abd)));
    put(c, VARIABLE_JOINT_C_X, at_c);
    put(c, VARIABLE_JOINT_D_X, at_d);
    put(c, VARIABLE_JOINT_E_X, at_e);
    put(c, VARIABLE_JOINT_F_X, at_f);
    put(c, VARIABLE_JOINT_G_X, (Vector){g->XG, g->YG});
    put(c, VARIABLE_JOINT_H_X, at_h);
    put(c, VARIABLE_JOINT_I_X, minus(at_h, scaled(g->L8 / g->L6, turned(linkage->unit_hi, ef))));
    put(c, VARIABLE_JOINT_J_X, pose->tip[0]);
}

/* T = Jr w^2/2 + w v S.x' + M v^2/2, over ground; V = gravity S.y. */
static void locals_energy(Component *c) {
    const LinkageMassJets *jets = &c->mass_jets;
    double w = c->shown->crank.end.w, v = c->shown->travel.end.v;
    pose_solve_masses(c, 1);
    c->value[VARIABLE_LINKAGE_KINETIC] =
        0.5 * jets->inertia[0] * w * w + w * v * jets->moment[1].x + 0.5 * c->inertia.total * v * v;
    c->value[VARIABLE_LINKAGE_POTENTIAL] = c->value[VARIABLE_GRAVITY] * jets->moment[0].y;
}

static void locals_forces(Component *c) {
    const Motion *now = c->shown;
    LinkageForces forces;
    LinkageLoad load = {now->crank.end.w,
                        now->crank.end.a,
                        {now->travel.end.a, c->value[VARIABLE_GRAVITY]},
                        {now->force[0][0], now->force[0][1]}};
    linkage_forces(&c->linkage, &c->inertia.masses, &c->pose, load, &forces);
    put(c, VARIABLE_JOINT_O_FX, forces.O);
    put(c, VARIABLE_JOINT_A_FX, forces.A);
    put(c, VARIABLE_JOINT_B_FX, forces.B);
    put(c, VARIABLE_JOINT_C_FX, forces.C);
    put(c, VARIABLE_JOINT_D_FX, forces.D);
    put(c, VARIABLE_JOINT_E_FX, forces.E);
    put(c, VARIABLE_JOINT_F_FX, forces.F);
    put(c, VARIABLE_JOINT_G_FX, forces.G);
    c->value[VARIABLE_CRANK_OA_TAU] = forces.torque_oa;
    c->value[VARIABLE_CRANK_CD_TAU] = forces.torque_cd;
}

ComponentStatus locals_evaluate(Component *c, uint32_t evaluations) {
    ComponentStatus status = pose_solve(c, 0);
    if (status != COMPONENT_OK)
        return status;
    if (evaluations & EVALUATION_POINTS)
        locals_points(c);
    if (evaluations & EVALUATION_ENERGY)
        locals_energy(c);
    if (evaluations & EVALUATION_FORCES)
        locals_forces(c);
    return COMPONENT_OK;
}
