/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */
#include "interface.h"

const InterfaceVariable interface_variables[INTERFACE_COUNT + 1] = {
    {"(no variable)", 0.0, 0},
    {"time", 0.0, 0},
    {"crank.phi", 0.0, 0},
    {"crank.w", 0.0, 0},
    {"crank.a", 0.0, 0},
    {"machine.v", 0.0, 0},
    {"tip.fx", 0.0, 0},
    {"tip.fy", 0.0, 0},
    {"tip.x", 0.0, 1},
    {"tip.y", 0.0, 1},
    {"tip.vx", 0.0, 1},
    {"tip.vy", 0.0, 1},
    {"tip.ax", 0.0, 1},
    {"tip.ay", 0.0, 1},
    {"tip.angle", 0.0, 1},
    {"ground.x", 0.0, 1},
    {"ground.y", 0.0, 1},
    {"ground.vx", 0.0, 1},
    {"ground.vy", 0.0, 1},
    {"ground.ax", 0.0, 1},
    {"ground.ay", 0.0, 1},
    {"machine.s", 0.0, 1},
    {"crank.tau", 0.0, 1},
    {"assembly.margin", 0.0, 1},
    {"geometry.L1", 0.05, 0},
    {"geometry.L2", 0.105, 0},
    {"geometry.L3", 0.105, 0},
    {"geometry.L4", 0.018, 0},
    {"geometry.L5", 0.24, 0},
    {"geometry.L6", 0.07, 0},
    {"geometry.L7", 0.25, 0},
    {"geometry.L8", 0.055, 0},
    {"geometry.L9", 0.2, 0},
    {"geometry.XC", 0.115, 0},
    {"geometry.YC", -0.055, 0},
    {"geometry.XG", 0.107, 0},
    {"geometry.YG", -0.115, 0},
    {"geometry.phi1", 2.111848394913139, 0},
    {"geometry.phi4", 5.427973973702365, 0},
    {"geometry.theta3", 0.4886921905584123, 0},
    {"geometry.theta8", 1.8325957145940461, 0},
    {"geometry.theta9", 1.3962634015954636, 0},
    {"crank.at_step_end", 0.0, 0},
};

const uint8_t interface_evaluation[INTERFACE_COUNT + 1] = {
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
};

const uint8_t interface_access[INTERFACE_COUNT + 1] = {
    ACCESS_READ_ONLY, /* (no variable) */
    ACCESS_READ_ONLY, /* time */
    ACCESS_INPUT, /* crank.phi */
    ACCESS_INPUT, /* crank.w */
    ACCESS_INPUT, /* crank.a */
    ACCESS_INPUT, /* machine.v */
    ACCESS_INPUT, /* tip.fx */
    ACCESS_INPUT, /* tip.fy */
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
    ACCESS_BEFORE_START, /* machine.s */
    ACCESS_READ_ONLY, /* crank.tau */
    ACCESS_READ_ONLY, /* assembly.margin */
    ACCESS_BEFORE_START, /* geometry.L1 */
    ACCESS_BEFORE_START, /* geometry.L2 */
    ACCESS_BEFORE_START, /* geometry.L3 */
    ACCESS_BEFORE_START, /* geometry.L4 */
    ACCESS_BEFORE_START, /* geometry.L5 */
    ACCESS_BEFORE_START, /* geometry.L6 */
    ACCESS_BEFORE_START, /* geometry.L7 */
    ACCESS_BEFORE_START, /* geometry.L8 */
    ACCESS_BEFORE_START, /* geometry.L9 */
    ACCESS_BEFORE_START, /* geometry.XC */
    ACCESS_BEFORE_START, /* geometry.YC */
    ACCESS_BEFORE_START, /* geometry.XG */
    ACCESS_BEFORE_START, /* geometry.YG */
    ACCESS_BEFORE_START, /* geometry.phi1 */
    ACCESS_BEFORE_START, /* geometry.phi4 */
    ACCESS_BEFORE_START, /* geometry.theta3 */
    ACCESS_BEFORE_START, /* geometry.theta8 */
    ACCESS_BEFORE_START, /* geometry.theta9 */
    ACCESS_READ_ONLY, /* crank.at_step_end */
};

const uint8_t interface_boolean_access[INTERFACE_COUNT + 1] = {
    ACCESS_READ_ONLY, /* (no variable) */
    ACCESS_READ_ONLY, /* time */
    ACCESS_READ_ONLY, /* crank.phi */
    ACCESS_READ_ONLY, /* crank.w */
    ACCESS_READ_ONLY, /* crank.a */
    ACCESS_READ_ONLY, /* machine.v */
    ACCESS_READ_ONLY, /* tip.fx */
    ACCESS_READ_ONLY, /* tip.fy */
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
    ACCESS_READ_ONLY, /* machine.s */
    ACCESS_READ_ONLY, /* crank.tau */
    ACCESS_READ_ONLY, /* assembly.margin */
    ACCESS_READ_ONLY, /* geometry.L1 */
    ACCESS_READ_ONLY, /* geometry.L2 */
    ACCESS_READ_ONLY, /* geometry.L3 */
    ACCESS_READ_ONLY, /* geometry.L4 */
    ACCESS_READ_ONLY, /* geometry.L5 */
    ACCESS_READ_ONLY, /* geometry.L6 */
    ACCESS_READ_ONLY, /* geometry.L7 */
    ACCESS_READ_ONLY, /* geometry.L8 */
    ACCESS_READ_ONLY, /* geometry.L9 */
    ACCESS_READ_ONLY, /* geometry.XC */
    ACCESS_READ_ONLY, /* geometry.YC */
    ACCESS_READ_ONLY, /* geometry.XG */
    ACCESS_READ_ONLY, /* geometry.YG */
    ACCESS_READ_ONLY, /* geometry.phi1 */
    ACCESS_READ_ONLY, /* geometry.phi4 */
    ACCESS_READ_ONLY, /* geometry.theta3 */
    ACCESS_READ_ONLY, /* geometry.theta8 */
    ACCESS_READ_ONLY, /* geometry.theta9 */
    ACCESS_BEFORE_START, /* crank.at_step_end */
};
