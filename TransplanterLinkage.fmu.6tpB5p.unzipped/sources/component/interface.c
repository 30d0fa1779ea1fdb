/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */
#include "interface.h"

#include "../linkage/linkage.h"

#include <stddef.h>

/* The geometry is read as one piece out of a list of values: its members stand in the order of
 * their value references, or an array here has a negative size. */
typedef char geometry_L1_is_in_place
    [offsetof(LinkageGeometry, L1) == 0 * sizeof(double) ? 1 : -1];
typedef char geometry_L2_is_in_place
    [offsetof(LinkageGeometry, L2) == 1 * sizeof(double) ? 1 : -1];
typedef char geometry_L3_is_in_place
    [offsetof(LinkageGeometry, L3) == 2 * sizeof(double) ? 1 : -1];
typedef char geometry_L4_is_in_place
    [offsetof(LinkageGeometry, L4) == 3 * sizeof(double) ? 1 : -1];
typedef char geometry_L5_is_in_place
    [offsetof(LinkageGeometry, L5) == 4 * sizeof(double) ? 1 : -1];
typedef char geometry_L6_is_in_place
    [offsetof(LinkageGeometry, L6) == 5 * sizeof(double) ? 1 : -1];
typedef char geometry_L7_is_in_place
    [offsetof(LinkageGeometry, L7) == 6 * sizeof(double) ? 1 : -1];
typedef char geometry_L8_is_in_place
    [offsetof(LinkageGeometry, L8) == 7 * sizeof(double) ? 1 : -1];
typedef char geometry_L9_is_in_place
    [offsetof(LinkageGeometry, L9) == 8 * sizeof(double) ? 1 : -1];
typedef char geometry_XC_is_in_place
    [offsetof(LinkageGeometry, XC) == 9 * sizeof(double) ? 1 : -1];
typedef char geometry_YC_is_in_place
    [offsetof(LinkageGeometry, YC) == 10 * sizeof(double) ? 1 : -1];
typedef char geometry_XG_is_in_place
    [offsetof(LinkageGeometry, XG) == 11 * sizeof(double) ? 1 : -1];
typedef char geometry_YG_is_in_place
    [offsetof(LinkageGeometry, YG) == 12 * sizeof(double) ? 1 : -1];
typedef char geometry_phi1_is_in_place
    [offsetof(LinkageGeometry, phi1) == 13 * sizeof(double) ? 1 : -1];
typedef char geometry_phi4_is_in_place
    [offsetof(LinkageGeometry, phi4) == 14 * sizeof(double) ? 1 : -1];
typedef char geometry_theta3_is_in_place
    [offsetof(LinkageGeometry, theta3) == 15 * sizeof(double) ? 1 : -1];
typedef char geometry_theta8_is_in_place
    [offsetof(LinkageGeometry, theta8) == 16 * sizeof(double) ? 1 : -1];
typedef char geometry_theta9_is_in_place
    [offsetof(LinkageGeometry, theta9) == 17 * sizeof(double) ? 1 : -1];
typedef char geometry_is_complete
    [sizeof(LinkageGeometry) == 18 * sizeof(double) ? 1 : -1];

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
};
