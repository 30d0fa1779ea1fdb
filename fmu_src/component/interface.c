/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */
#include "interface.h"

#include "../linkage/mass.h"

#include <stddef.h>

/* Geometry and masses are read as one piece each out of a list of values: their members stand in the
 * order of their value references, or an array here has a negative size. */
typedef char L1_is_in_place
    [offsetof(LinkageGeometry, L1) == 0 * sizeof(double) ? 1 : -1];
typedef char L2_is_in_place
    [offsetof(LinkageGeometry, L2) == 1 * sizeof(double) ? 1 : -1];
typedef char L3_is_in_place
    [offsetof(LinkageGeometry, L3) == 2 * sizeof(double) ? 1 : -1];
typedef char L4_is_in_place
    [offsetof(LinkageGeometry, L4) == 3 * sizeof(double) ? 1 : -1];
typedef char L5_is_in_place
    [offsetof(LinkageGeometry, L5) == 4 * sizeof(double) ? 1 : -1];
typedef char L6_is_in_place
    [offsetof(LinkageGeometry, L6) == 5 * sizeof(double) ? 1 : -1];
typedef char L7_is_in_place
    [offsetof(LinkageGeometry, L7) == 6 * sizeof(double) ? 1 : -1];
typedef char L8_is_in_place
    [offsetof(LinkageGeometry, L8) == 7 * sizeof(double) ? 1 : -1];
typedef char L9_is_in_place
    [offsetof(LinkageGeometry, L9) == 8 * sizeof(double) ? 1 : -1];
typedef char XC_is_in_place
    [offsetof(LinkageGeometry, XC) == 9 * sizeof(double) ? 1 : -1];
typedef char YC_is_in_place
    [offsetof(LinkageGeometry, YC) == 10 * sizeof(double) ? 1 : -1];
typedef char XG_is_in_place
    [offsetof(LinkageGeometry, XG) == 11 * sizeof(double) ? 1 : -1];
typedef char YG_is_in_place
    [offsetof(LinkageGeometry, YG) == 12 * sizeof(double) ? 1 : -1];
typedef char phi1_is_in_place
    [offsetof(LinkageGeometry, phi1) == 13 * sizeof(double) ? 1 : -1];
typedef char phi4_is_in_place
    [offsetof(LinkageGeometry, phi4) == 14 * sizeof(double) ? 1 : -1];
typedef char theta3_is_in_place
    [offsetof(LinkageGeometry, theta3) == 15 * sizeof(double) ? 1 : -1];
typedef char theta8_is_in_place
    [offsetof(LinkageGeometry, theta8) == 16 * sizeof(double) ? 1 : -1];
typedef char theta9_is_in_place
    [offsetof(LinkageGeometry, theta9) == 17 * sizeof(double) ? 1 : -1];
typedef char OA_m_is_in_place
    [offsetof(LinkageMasses, OA.m) == 0 * sizeof(double) ? 1 : -1];
typedef char OA_x_is_in_place
    [offsetof(LinkageMasses, OA.x) == 1 * sizeof(double) ? 1 : -1];
typedef char OA_y_is_in_place
    [offsetof(LinkageMasses, OA.y) == 2 * sizeof(double) ? 1 : -1];
typedef char OA_J_is_in_place
    [offsetof(LinkageMasses, OA.J) == 3 * sizeof(double) ? 1 : -1];
typedef char CD_m_is_in_place
    [offsetof(LinkageMasses, CD.m) == 4 * sizeof(double) ? 1 : -1];
typedef char CD_x_is_in_place
    [offsetof(LinkageMasses, CD.x) == 5 * sizeof(double) ? 1 : -1];
typedef char CD_y_is_in_place
    [offsetof(LinkageMasses, CD.y) == 6 * sizeof(double) ? 1 : -1];
typedef char CD_J_is_in_place
    [offsetof(LinkageMasses, CD.J) == 7 * sizeof(double) ? 1 : -1];
typedef char AB_m_is_in_place
    [offsetof(LinkageMasses, AB.m) == 8 * sizeof(double) ? 1 : -1];
typedef char AB_x_is_in_place
    [offsetof(LinkageMasses, AB.x) == 9 * sizeof(double) ? 1 : -1];
typedef char AB_y_is_in_place
    [offsetof(LinkageMasses, AB.y) == 10 * sizeof(double) ? 1 : -1];
typedef char AB_J_is_in_place
    [offsetof(LinkageMasses, AB.J) == 11 * sizeof(double) ? 1 : -1];
typedef char DE_m_is_in_place
    [offsetof(LinkageMasses, DE.m) == 12 * sizeof(double) ? 1 : -1];
typedef char DE_x_is_in_place
    [offsetof(LinkageMasses, DE.x) == 13 * sizeof(double) ? 1 : -1];
typedef char DE_y_is_in_place
    [offsetof(LinkageMasses, DE.y) == 14 * sizeof(double) ? 1 : -1];
typedef char DE_J_is_in_place
    [offsetof(LinkageMasses, DE.J) == 15 * sizeof(double) ? 1 : -1];
typedef char EF_m_is_in_place
    [offsetof(LinkageMasses, EF.m) == 16 * sizeof(double) ? 1 : -1];
typedef char EF_x_is_in_place
    [offsetof(LinkageMasses, EF.x) == 17 * sizeof(double) ? 1 : -1];
typedef char EF_y_is_in_place
    [offsetof(LinkageMasses, EF.y) == 18 * sizeof(double) ? 1 : -1];
typedef char EF_J_is_in_place
    [offsetof(LinkageMasses, EF.J) == 19 * sizeof(double) ? 1 : -1];
typedef char GF_m_is_in_place
    [offsetof(LinkageMasses, GF.m) == 20 * sizeof(double) ? 1 : -1];
typedef char GF_x_is_in_place
    [offsetof(LinkageMasses, GF.x) == 21 * sizeof(double) ? 1 : -1];
typedef char GF_y_is_in_place
    [offsetof(LinkageMasses, GF.y) == 22 * sizeof(double) ? 1 : -1];
typedef char GF_J_is_in_place
    [offsetof(LinkageMasses, GF.J) == 23 * sizeof(double) ? 1 : -1];
typedef char geometry_is_complete
    [sizeof(LinkageGeometry) == 18 * sizeof(double) ? 1 : -1];
typedef char masses_are_complete
    [sizeof(LinkageMasses) == 24 * sizeof(double) ? 1 : -1];

INTERNAL const InterfaceVariable interface_variables[INTERFACE_COUNT + 1] = {
    {"(no variable)", 0.0, 0.0, 0.0, 0.0, -1, 0},
    {"time", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"crank.phi", 0.0, -1e+60, 1e+60, 0.0, 0, 0},
    {"crank.w", 0.0, -1e+60, 1e+60, 0.0, 1, 0},
    {"crank.a", 0.0, -1e+60, 1e+60, 0.0, 2, 0},
    {"machine.v", 0.0, -1e+60, 1e+60, 0.0, 3, 0},
    {"tip.fx", 0.0, -1e+60, 1e+60, 0.0, 4, 0},
    {"tip.fy", 0.0, -1e+60, 1e+60, 0.0, 5, 0},
    {"tip.x", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"tip.y", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"tip.vx", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"tip.vy", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"tip.ax", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"tip.ay", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"tip.angle", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"ground.x", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"ground.y", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"ground.vx", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"ground.vy", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"ground.ax", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"ground.ay", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"machine.s", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"crank.tau", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"assembly.margin", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"geometry.L1", 0.05, 0.0, 1000000.0, 1e-06, -1, 0},
    {"geometry.L2", 0.105, 1e-06, 1000000.0, 0.0, -1, 0},
    {"geometry.L3", 0.105, 1e-06, 1000000.0, 0.0, -1, 0},
    {"geometry.L4", 0.018, 0.0, 1000000.0, 1e-06, -1, 0},
    {"geometry.L5", 0.24, 0.0, 1000000.0, 1e-06, -1, 0},
    {"geometry.L6", 0.07, 1e-06, 1000000.0, 0.0, -1, 0},
    {"geometry.L7", 0.25, 1e-06, 1000000.0, 0.0, -1, 0},
    {"geometry.L8", 0.055, 0.0, 1000000.0, 1e-06, -1, 0},
    {"geometry.L9", 0.2, 0.0, 1000000.0, 1e-06, -1, 0},
    {"geometry.XC", 0.115, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"geometry.YC", -0.055, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"geometry.XG", 0.107, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"geometry.YG", -0.115, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"geometry.phi1", 2.111848394913139, -1e+60, 1e+60, 0.0, -1, 0},
    {"geometry.phi4", 5.427973973702365, -1e+60, 1e+60, 0.0, -1, 0},
    {"geometry.theta3", 0.4886921905584123, -1e+60, 1e+60, 0.0, -1, 0},
    {"geometry.theta8", 1.8325957145940461, -1e+60, 1e+60, 0.0, -1, 0},
    {"geometry.theta9", 1.3962634015954636, -1e+60, 1e+60, 0.0, -1, 0},
    {"crank.at_step_end", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"crank.smoothing", 0.0, 0.0, 1000.0, 0.0, -1, 0},
    {"der(machine.s)", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"body.OA.m", 0.0, 0.0, 1000000.0, 0.0, -1, 0},
    {"body.OA.x", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.OA.y", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.OA.J", 0.0, 0.0, 1000000000000.0, 0.0, -1, 0},
    {"body.CD.m", 0.0, 0.0, 1000000.0, 0.0, -1, 0},
    {"body.CD.x", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.CD.y", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.CD.J", 0.0, 0.0, 1000000000000.0, 0.0, -1, 0},
    {"body.AB.m", 0.0, 0.0, 1000000.0, 0.0, -1, 0},
    {"body.AB.x", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.AB.y", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.AB.J", 0.0, 0.0, 1000000000000.0, 0.0, -1, 0},
    {"body.DE.m", 0.0, 0.0, 1000000.0, 0.0, -1, 0},
    {"body.DE.x", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.DE.y", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.DE.J", 0.0, 0.0, 1000000000000.0, 0.0, -1, 0},
    {"body.EF.m", 0.0, 0.0, 1000000.0, 0.0, -1, 0},
    {"body.EF.x", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.EF.y", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.EF.J", 0.0, 0.0, 1000000000000.0, 0.0, -1, 0},
    {"body.GF.m", 0.0, 0.0, 1000000.0, 0.0, -1, 0},
    {"body.GF.x", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.GF.y", 0.0, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"body.GF.J", 0.0, 0.0, 1000000000000.0, 0.0, -1, 0},
    {"gravity", 9.80665, -1000000.0, 1000000.0, 0.0, -1, 0},
    {"crank.inertia", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"crank.tau_bias", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"machine.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"machine.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 1},
    {"linkage.kinetic", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"linkage.potential", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.A.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.A.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.B.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.B.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.C.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.C.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.D.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.D.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.E.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.E.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.F.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.F.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.G.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.G.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.H.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.H.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.I.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.I.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.J.x", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.J.y", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.O.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.O.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.A.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.A.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.B.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.B.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.C.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.C.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.D.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.D.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.E.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.E.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.F.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.F.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.G.fx", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"joint.G.fy", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"crank.OA.tau", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
    {"crank.CD.tau", 0.0, -1e+60, 1e+60, 0.0, -1, 0},
};

INTERNAL const uint16_t interface_evaluation[INTERFACE_COUNT + 1] = {
    EVALUATION_NOT_REAL, /* (no variable) */
    EVALUATION_NONE, /* time */
    EVALUATION_NONE, /* crank.phi */
    EVALUATION_NONE, /* crank.w */
    EVALUATION_NONE, /* crank.a */
    EVALUATION_NONE, /* machine.v */
    EVALUATION_NONE, /* tip.fx */
    EVALUATION_NONE, /* tip.fy */
    EVALUATION_POSITION, /* tip.x */
    EVALUATION_POSITION, /* tip.y */
    EVALUATION_VELOCITY, /* tip.vx */
    EVALUATION_VELOCITY, /* tip.vy */
    EVALUATION_ACCELERATION, /* tip.ax */
    EVALUATION_ACCELERATION, /* tip.ay */
    EVALUATION_ANGLE, /* tip.angle */
    EVALUATION_POSITION, /* ground.x */
    EVALUATION_POSITION, /* ground.y */
    EVALUATION_VELOCITY, /* ground.vx */
    EVALUATION_VELOCITY, /* ground.vy */
    EVALUATION_ACCELERATION, /* ground.ax */
    EVALUATION_ACCELERATION, /* ground.ay */
    EVALUATION_TRAVEL, /* machine.s */
    EVALUATION_TORQUE, /* crank.tau */
    EVALUATION_MARGIN, /* assembly.margin */
    EVALUATION_NONE, /* geometry.L1 */
    EVALUATION_NONE, /* geometry.L2 */
    EVALUATION_NONE, /* geometry.L3 */
    EVALUATION_NONE, /* geometry.L4 */
    EVALUATION_NONE, /* geometry.L5 */
    EVALUATION_NONE, /* geometry.L6 */
    EVALUATION_NONE, /* geometry.L7 */
    EVALUATION_NONE, /* geometry.L8 */
    EVALUATION_NONE, /* geometry.L9 */
    EVALUATION_NONE, /* geometry.XC */
    EVALUATION_NONE, /* geometry.YC */
    EVALUATION_NONE, /* geometry.XG */
    EVALUATION_NONE, /* geometry.YG */
    EVALUATION_NONE, /* geometry.phi1 */
    EVALUATION_NONE, /* geometry.phi4 */
    EVALUATION_NONE, /* geometry.theta3 */
    EVALUATION_NONE, /* geometry.theta8 */
    EVALUATION_NONE, /* geometry.theta9 */
    EVALUATION_NOT_REAL, /* crank.at_step_end */
    EVALUATION_NONE, /* crank.smoothing */
    EVALUATION_SPEED, /* der(machine.s) */
    EVALUATION_NONE, /* body.OA.m */
    EVALUATION_NONE, /* body.OA.x */
    EVALUATION_NONE, /* body.OA.y */
    EVALUATION_NONE, /* body.OA.J */
    EVALUATION_NONE, /* body.CD.m */
    EVALUATION_NONE, /* body.CD.x */
    EVALUATION_NONE, /* body.CD.y */
    EVALUATION_NONE, /* body.CD.J */
    EVALUATION_NONE, /* body.AB.m */
    EVALUATION_NONE, /* body.AB.x */
    EVALUATION_NONE, /* body.AB.y */
    EVALUATION_NONE, /* body.AB.J */
    EVALUATION_NONE, /* body.DE.m */
    EVALUATION_NONE, /* body.DE.x */
    EVALUATION_NONE, /* body.DE.y */
    EVALUATION_NONE, /* body.DE.J */
    EVALUATION_NONE, /* body.EF.m */
    EVALUATION_NONE, /* body.EF.x */
    EVALUATION_NONE, /* body.EF.y */
    EVALUATION_NONE, /* body.EF.J */
    EVALUATION_NONE, /* body.GF.m */
    EVALUATION_NONE, /* body.GF.x */
    EVALUATION_NONE, /* body.GF.y */
    EVALUATION_NONE, /* body.GF.J */
    EVALUATION_NONE, /* gravity */
    EVALUATION_INERTIA, /* crank.inertia */
    EVALUATION_TORQUE, /* crank.tau_bias */
    EVALUATION_REACTION, /* machine.fx */
    EVALUATION_REACTION, /* machine.fy */
    EVALUATION_ENERGY, /* linkage.kinetic */
    EVALUATION_ENERGY, /* linkage.potential */
    EVALUATION_POINTS, /* joint.A.x */
    EVALUATION_POINTS, /* joint.A.y */
    EVALUATION_POINTS, /* joint.B.x */
    EVALUATION_POINTS, /* joint.B.y */
    EVALUATION_POINTS, /* joint.C.x */
    EVALUATION_POINTS, /* joint.C.y */
    EVALUATION_POINTS, /* joint.D.x */
    EVALUATION_POINTS, /* joint.D.y */
    EVALUATION_POINTS, /* joint.E.x */
    EVALUATION_POINTS, /* joint.E.y */
    EVALUATION_POINTS, /* joint.F.x */
    EVALUATION_POINTS, /* joint.F.y */
    EVALUATION_POINTS, /* joint.G.x */
    EVALUATION_POINTS, /* joint.G.y */
    EVALUATION_POINTS, /* joint.H.x */
    EVALUATION_POINTS, /* joint.H.y */
    EVALUATION_POINTS, /* joint.I.x */
    EVALUATION_POINTS, /* joint.I.y */
    EVALUATION_POINTS, /* joint.J.x */
    EVALUATION_POINTS, /* joint.J.y */
    EVALUATION_FORCES, /* joint.O.fx */
    EVALUATION_FORCES, /* joint.O.fy */
    EVALUATION_FORCES, /* joint.A.fx */
    EVALUATION_FORCES, /* joint.A.fy */
    EVALUATION_FORCES, /* joint.B.fx */
    EVALUATION_FORCES, /* joint.B.fy */
    EVALUATION_FORCES, /* joint.C.fx */
    EVALUATION_FORCES, /* joint.C.fy */
    EVALUATION_FORCES, /* joint.D.fx */
    EVALUATION_FORCES, /* joint.D.fy */
    EVALUATION_FORCES, /* joint.E.fx */
    EVALUATION_FORCES, /* joint.E.fy */
    EVALUATION_FORCES, /* joint.F.fx */
    EVALUATION_FORCES, /* joint.F.fy */
    EVALUATION_FORCES, /* joint.G.fx */
    EVALUATION_FORCES, /* joint.G.fy */
    EVALUATION_FORCES, /* crank.OA.tau */
    EVALUATION_FORCES, /* crank.CD.tau */
};

INTERNAL const uint8_t interface_access[INTERFACE_COUNT + 1] = {
    ACCESS_READ_ONLY, /* (no variable) */
    ACCESS_READ_ONLY, /* time */
    ACCESS_REAL_BEFORE_START | ACCESS_REAL_LATER, /* crank.phi */
    ACCESS_REAL_BEFORE_START | ACCESS_REAL_LATER, /* crank.w */
    ACCESS_REAL_BEFORE_START | ACCESS_REAL_LATER, /* crank.a */
    ACCESS_REAL_BEFORE_START | ACCESS_REAL_LATER, /* machine.v */
    ACCESS_REAL_BEFORE_START | ACCESS_REAL_LATER, /* tip.fx */
    ACCESS_REAL_BEFORE_START | ACCESS_REAL_LATER, /* tip.fy */
    ACCESS_READ_ONLY, /* tip.x */
    ACCESS_READ_ONLY, /* tip.y */
    ACCESS_READ_ONLY, /* tip.vx */
    ACCESS_READ_ONLY, /* tip.vy */
    ACCESS_READ_ONLY, /* tip.ax */
    ACCESS_READ_ONLY, /* tip.ay */
    ACCESS_READ_ONLY, /* tip.angle */
    ACCESS_READ_ONLY, /* ground.x */
    ACCESS_READ_ONLY, /* ground.y */
    ACCESS_READ_ONLY, /* ground.vx */
    ACCESS_READ_ONLY, /* ground.vy */
    ACCESS_READ_ONLY, /* ground.ax */
    ACCESS_READ_ONLY, /* ground.ay */
    ACCESS_REAL_BEFORE_START | ACCESS_STATE_LATER, /* machine.s */
    ACCESS_READ_ONLY, /* crank.tau */
    ACCESS_READ_ONLY, /* assembly.margin */
    ACCESS_REAL_BEFORE_START, /* geometry.L1 */
    ACCESS_REAL_BEFORE_START, /* geometry.L2 */
    ACCESS_REAL_BEFORE_START, /* geometry.L3 */
    ACCESS_REAL_BEFORE_START, /* geometry.L4 */
    ACCESS_REAL_BEFORE_START, /* geometry.L5 */
    ACCESS_REAL_BEFORE_START, /* geometry.L6 */
    ACCESS_REAL_BEFORE_START, /* geometry.L7 */
    ACCESS_REAL_BEFORE_START, /* geometry.L8 */
    ACCESS_REAL_BEFORE_START, /* geometry.L9 */
    ACCESS_REAL_BEFORE_START, /* geometry.XC */
    ACCESS_REAL_BEFORE_START, /* geometry.YC */
    ACCESS_REAL_BEFORE_START, /* geometry.XG */
    ACCESS_REAL_BEFORE_START, /* geometry.YG */
    ACCESS_REAL_BEFORE_START, /* geometry.phi1 */
    ACCESS_REAL_BEFORE_START, /* geometry.phi4 */
    ACCESS_REAL_BEFORE_START, /* geometry.theta3 */
    ACCESS_REAL_BEFORE_START, /* geometry.theta8 */
    ACCESS_REAL_BEFORE_START, /* geometry.theta9 */
    ACCESS_BOOLEAN_BEFORE_START, /* crank.at_step_end */
    ACCESS_REAL_BEFORE_START, /* crank.smoothing */
    ACCESS_READ_ONLY, /* der(machine.s) */
    ACCESS_REAL_BEFORE_START, /* body.OA.m */
    ACCESS_REAL_BEFORE_START, /* body.OA.x */
    ACCESS_REAL_BEFORE_START, /* body.OA.y */
    ACCESS_REAL_BEFORE_START, /* body.OA.J */
    ACCESS_REAL_BEFORE_START, /* body.CD.m */
    ACCESS_REAL_BEFORE_START, /* body.CD.x */
    ACCESS_REAL_BEFORE_START, /* body.CD.y */
    ACCESS_REAL_BEFORE_START, /* body.CD.J */
    ACCESS_REAL_BEFORE_START, /* body.AB.m */
    ACCESS_REAL_BEFORE_START, /* body.AB.x */
    ACCESS_REAL_BEFORE_START, /* body.AB.y */
    ACCESS_REAL_BEFORE_START, /* body.AB.J */
    ACCESS_REAL_BEFORE_START, /* body.DE.m */
    ACCESS_REAL_BEFORE_START, /* body.DE.x */
    ACCESS_REAL_BEFORE_START, /* body.DE.y */
    ACCESS_REAL_BEFORE_START, /* body.DE.J */
    ACCESS_REAL_BEFORE_START, /* body.EF.m */
    ACCESS_REAL_BEFORE_START, /* body.EF.x */
    ACCESS_REAL_BEFORE_START, /* body.EF.y */
    ACCESS_REAL_BEFORE_START, /* body.EF.J */
    ACCESS_REAL_BEFORE_START, /* body.GF.m */
    ACCESS_REAL_BEFORE_START, /* body.GF.x */
    ACCESS_REAL_BEFORE_START, /* body.GF.y */
    ACCESS_REAL_BEFORE_START, /* body.GF.J */
    ACCESS_REAL_BEFORE_START, /* gravity */
    ACCESS_READ_ONLY, /* crank.inertia */
    ACCESS_READ_ONLY, /* crank.tau_bias */
    ACCESS_READ_ONLY, /* machine.fx */
    ACCESS_READ_ONLY, /* machine.fy */
    ACCESS_READ_ONLY, /* linkage.kinetic */
    ACCESS_READ_ONLY, /* linkage.potential */
    ACCESS_READ_ONLY, /* joint.A.x */
    ACCESS_READ_ONLY, /* joint.A.y */
    ACCESS_READ_ONLY, /* joint.B.x */
    ACCESS_READ_ONLY, /* joint.B.y */
    ACCESS_READ_ONLY, /* joint.C.x */
    ACCESS_READ_ONLY, /* joint.C.y */
    ACCESS_READ_ONLY, /* joint.D.x */
    ACCESS_READ_ONLY, /* joint.D.y */
    ACCESS_READ_ONLY, /* joint.E.x */
    ACCESS_READ_ONLY, /* joint.E.y */
    ACCESS_READ_ONLY, /* joint.F.x */
    ACCESS_READ_ONLY, /* joint.F.y */
    ACCESS_READ_ONLY, /* joint.G.x */
    ACCESS_READ_ONLY, /* joint.G.y */
    ACCESS_READ_ONLY, /* joint.H.x */
    ACCESS_READ_ONLY, /* joint.H.y */
    ACCESS_READ_ONLY, /* joint.I.x */
    ACCESS_READ_ONLY, /* joint.I.y */
    ACCESS_READ_ONLY, /* joint.J.x */
    ACCESS_READ_ONLY, /* joint.J.y */
    ACCESS_READ_ONLY, /* joint.O.fx */
    ACCESS_READ_ONLY, /* joint.O.fy */
    ACCESS_READ_ONLY, /* joint.A.fx */
    ACCESS_READ_ONLY, /* joint.A.fy */
    ACCESS_READ_ONLY, /* joint.B.fx */
    ACCESS_READ_ONLY, /* joint.B.fy */
    ACCESS_READ_ONLY, /* joint.C.fx */
    ACCESS_READ_ONLY, /* joint.C.fy */
    ACCESS_READ_ONLY, /* joint.D.fx */
    ACCESS_READ_ONLY, /* joint.D.fy */
    ACCESS_READ_ONLY, /* joint.E.fx */
    ACCESS_READ_ONLY, /* joint.E.fy */
    ACCESS_READ_ONLY, /* joint.F.fx */
    ACCESS_READ_ONLY, /* joint.F.fy */
    ACCESS_READ_ONLY, /* joint.G.fx */
    ACCESS_READ_ONLY, /* joint.G.fy */
    ACCESS_READ_ONLY, /* crank.OA.tau */
    ACCESS_READ_ONLY, /* crank.CD.tau */
};

INTERNAL const uint8_t interface_settable[INTERFACE_SETTABLE_COUNT] = {
    VARIABLE_TIME,
    VARIABLE_CRANK_PHI,
    VARIABLE_CRANK_W,
    VARIABLE_CRANK_A,
    VARIABLE_MACHINE_V,
    VARIABLE_TIP_FX,
    VARIABLE_TIP_FY,
    VARIABLE_MACHINE_S,
    VARIABLE_GEOMETRY_L1,
    VARIABLE_GEOMETRY_L2,
    VARIABLE_GEOMETRY_L3,
    VARIABLE_GEOMETRY_L4,
    VARIABLE_GEOMETRY_L5,
    VARIABLE_GEOMETRY_L6,
    VARIABLE_GEOMETRY_L7,
    VARIABLE_GEOMETRY_L8,
    VARIABLE_GEOMETRY_L9,
    VARIABLE_GEOMETRY_XC,
    VARIABLE_GEOMETRY_YC,
    VARIABLE_GEOMETRY_XG,
    VARIABLE_GEOMETRY_YG,
    VARIABLE_GEOMETRY_PHI1,
    VARIABLE_GEOMETRY_PHI4,
    VARIABLE_GEOMETRY_THETA3,
    VARIABLE_GEOMETRY_THETA8,
    VARIABLE_GEOMETRY_THETA9,
    VARIABLE_CRANK_AT_STEP_END,
    VARIABLE_CRANK_SMOOTHING,
    VARIABLE_BODY_OA_M,
    VARIABLE_BODY_OA_X,
    VARIABLE_BODY_OA_Y,
    VARIABLE_BODY_OA_J,
    VARIABLE_BODY_CD_M,
    VARIABLE_BODY_CD_X,
    VARIABLE_BODY_CD_Y,
    VARIABLE_BODY_CD_J,
    VARIABLE_BODY_AB_M,
    VARIABLE_BODY_AB_X,
    VARIABLE_BODY_AB_Y,
    VARIABLE_BODY_AB_J,
    VARIABLE_BODY_DE_M,
    VARIABLE_BODY_DE_X,
    VARIABLE_BODY_DE_Y,
    VARIABLE_BODY_DE_J,
    VARIABLE_BODY_EF_M,
    VARIABLE_BODY_EF_X,
    VARIABLE_BODY_EF_Y,
    VARIABLE_BODY_EF_J,
    VARIABLE_BODY_GF_M,
    VARIABLE_BODY_GF_X,
    VARIABLE_BODY_GF_Y,
    VARIABLE_BODY_GF_J,
    VARIABLE_GRAVITY,
};
