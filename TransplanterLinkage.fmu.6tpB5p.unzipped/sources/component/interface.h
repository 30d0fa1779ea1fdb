/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */
#ifndef INTERFACE_H
#define INTERFACE_H

#include <stdint.h>

#ifndef INTERNAL /* see linkage.h */
#define INTERNAL
#endif
#ifndef INTERNAL_TABLE
#define INTERNAL_TABLE extern
#endif

#define INTERFACE_MODEL_IDENTIFIER "TransplanterLinkage"

/* Hash of the interface; modelDescription.xml carries the same. */
#define INTERFACE_TOKEN "{11fb9f73-8504-6c65-7fcf-71f500a345e7}"

/* Names of the categories under which messages are logged. */
#define INTERFACE_LOG_CATEGORIES                                                                   \
    "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logAll"

/* Value references. */
enum {
    VARIABLE_TIME = 1,
    VARIABLE_CRANK_PHI = 2,
    VARIABLE_CRANK_W = 3,
    VARIABLE_CRANK_A = 4,
    VARIABLE_MACHINE_V = 5,
    VARIABLE_TIP_FX = 6,
    VARIABLE_TIP_FY = 7,
    VARIABLE_TIP_X = 8,
    VARIABLE_TIP_Y = 9,
    VARIABLE_TIP_VX = 10,
    VARIABLE_TIP_VY = 11,
    VARIABLE_TIP_AX = 12,
    VARIABLE_TIP_AY = 13,
    VARIABLE_TIP_ANGLE = 14,
    VARIABLE_GROUND_X = 15,
    VARIABLE_GROUND_Y = 16,
    VARIABLE_GROUND_VX = 17,
    VARIABLE_GROUND_VY = 18,
    VARIABLE_GROUND_AX = 19,
    VARIABLE_GROUND_AY = 20,
    VARIABLE_MACHINE_S = 21,
    VARIABLE_CRANK_TAU = 22,
    VARIABLE_ASSEMBLY_MARGIN = 23,
    VARIABLE_GEOMETRY_L1 = 24,
    VARIABLE_GEOMETRY_L2 = 25,
    VARIABLE_GEOMETRY_L3 = 26,
    VARIABLE_GEOMETRY_L4 = 27,
    VARIABLE_GEOMETRY_L5 = 28,
    VARIABLE_GEOMETRY_L6 = 29,
    VARIABLE_GEOMETRY_L7 = 30,
    VARIABLE_GEOMETRY_L8 = 31,
    VARIABLE_GEOMETRY_L9 = 32,
    VARIABLE_GEOMETRY_XC = 33,
    VARIABLE_GEOMETRY_YC = 34,
    VARIABLE_GEOMETRY_XG = 35,
    VARIABLE_GEOMETRY_YG = 36,
    VARIABLE_GEOMETRY_PHI1 = 37,
    VARIABLE_GEOMETRY_PHI4 = 38,
    VARIABLE_GEOMETRY_THETA3 = 39,
    VARIABLE_GEOMETRY_THETA8 = 40,
    VARIABLE_GEOMETRY_THETA9 = 41,
    VARIABLE_CRANK_AT_STEP_END = 42,
    VARIABLE_CRANK_SMOOTHING = 43,
    VARIABLE_DER_MACHINE_S = 44,
    INTERFACE_COUNT = 44,
    INTERFACE_INPUT_COUNT = 6
};

/* Outputs that are computed together: component_get_real computes what is read. */
enum {
    EVALUATION_POSITION = 1,
    EVALUATION_VELOCITY = 2,
    EVALUATION_ACCELERATION = 4,
    EVALUATION_ANGLE = 8,
    EVALUATION_TRAVEL = 16,
    EVALUATION_TORQUE = 32,
    EVALUATION_MARGIN = 64,
    EVALUATION_SPEED = 128,
    EVALUATION_NONE = 0,
    EVALUATION_NOT_REAL = 1 << 15 /* in the same place: no real at all */
};

/* Inputs and parameters are within +- this, so that no output can overflow. */
#define INTERFACE_GREATEST_VALUE 1e+60

/* When a variable may be set, as bits: until the end of initialization, from then on, and from then
 * on where the host integrates the continuous states (Model Exchange). */
enum {
    ACCESS_READ_ONLY = 0,
    ACCESS_REAL_BEFORE_START = 1,
    ACCESS_REAL_LATER = 2,
    ACCESS_BOOLEAN_BEFORE_START = 4,
    ACCESS_BOOLEAN_LATER = 8,
    ACCESS_STATE_LATER = 16
};

typedef struct {
    const char *name;
    double start;
    double least, greatest; /* what it may be set to */
    double smallest;        /* the least magnitude of a value but 0 */
    int input; /* the number of an input among the inputs, else -1 */
    int is_output;
} InterfaceVariable;

/* By value reference; number 0 is no variable. The last two are what every step looks up. */
INTERNAL_TABLE const InterfaceVariable interface_variables[INTERFACE_COUNT + 1];
INTERNAL_TABLE const uint16_t interface_evaluation[INTERFACE_COUNT + 1]; /* EVALUATION_ */
INTERNAL_TABLE const uint8_t interface_access[INTERFACE_COUNT + 1]; /* ACCESS_ */

#endif
