#include "state.h"

#include "inputs.h"
#include "message.h"
#include "variables.h"

#include <string.h>

/* ---- saved and restored -------------------------------------------------------------------- */

void component_save(Component *c, ComponentState *state) {
    state->settings = c->settings;
    state->motion = *component_present(c);
    for (size_t i = 0; i < INTERFACE_SETTABLE_COUNT; ++i) {
        uint32_t reference = interface_settable[i];
        state->set[i] =
            reference == VARIABLE_MACHINE_S ? state->motion.travel.end.s : c->value[reference];
    }
}

void component_restore(Component *c, const ComponentState *state) {
    for (size_t i = 0; i < INTERFACE_SETTABLE_COUNT; ++i)
        c->value[interface_settable[i]] = state->set[i];
    c->settings = state->settings;
    *component_present(c) = state->motion;
    c->shown = component_present(c);
    c->linkage_is_ready = 0;
    c->pose.order = -1;
    c->fresh = EVALUATION_NONE;
    if (c->settings.follows_inputs)
        inputs_follow(c);
}

/* ---- as bytes: header and payload, each an array of 8-byte words ------------------------------
 */

enum { FORMAT_VERSION = 5 };

typedef struct {
    uint64_t magic, version, interface, payload_size, checksum;
} Header;

/* "TLINKAGE" in little-endian order; another byte order reads another number. */
static const uint64_t MAGIC = UINT64_C(0x4547414b4e494c54);

/* Another layout is another FORMAT_VERSION: this array has a negative size when members come or
 * go besides variables, whose number is in the interface's token. */
typedef char
    state_has_this_layout[sizeof(ComponentState)
                                  == 8 * (INTERFACE_SETTABLE_COUNT + 4 * INTERFACE_INPUT_COUNT + 68)
                              ? 1
                              : -1];

/* Fowler, Noll and Vo's hash FNV-1a of 64 bits. */
static uint64_t hash(const uint8_t bytes[], size_t size) {
    uint64_t value = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < size; ++i)
        value = (value ^ bytes[i]) * UINT64_C(0x100000001b3);
    return value;
}

static uint64_t interface_hash(void) {
    return hash((const uint8_t *)INTERFACE_TOKEN, sizeof INTERFACE_TOKEN - 1);
}

size_t component_serialized_size(void) { return sizeof(Header) + sizeof(ComponentState); }

void component_serialize(const ComponentState *state, uint8_t bytes[]) {
    Header header = {MAGIC, FORMAT_VERSION, interface_hash(), sizeof *state, 0};
    memcpy(bytes + sizeof header, state, sizeof *state);
    header.checksum = hash(bytes + sizeof header, sizeof *state);
    memcpy(bytes, &header, sizeof header);
}

static bool is_within(int64_t value, int64_t lowest, int64_t highest) {
    return value >= lowest && value <= highest;
}

/* The checksum guards against damage; this, against bytes that were never saved by us. */
static bool is_sound(const ComponentState *state) {
    const ComponentSettings *settings = &state->settings;
    const Motion *motion = &state->motion;
    bool is_step = settings->mode == MODE_STEP || settings->mode == MODE_STEP_REFUSED;
    bool sound =
        is_within(settings->kind, KIND_CO_SIMULATION, KIND_MODEL_EXCHANGE)
        && is_within(settings->mode, 0, MODE_COUNT - 1) && settings->mode != MODE_UPDATE_AT_START
        && settings->mode != MODE_UPDATE_AT_END
        && !(is_step && settings->kind == KIND_MODEL_EXCHANGE)
        && !(settings->mode == MODE_CONTINUOUS_TIME && settings->kind == KIND_CO_SIMULATION)
        && is_within(motion->crank.source, SOURCE_ANGLE, SOURCE_ACCELERATION)
        && is_within(motion->crank.samples.count, 0, 4)
        && is_within(motion->crank.fit.count, 0, FIT_MAX_DEGREE + 2) && motion->last_step >= 0.0
        && motion_is_bounded(motion) && motion_has_bounded_force(motion);
    for (size_t i = 0; i < INTERFACE_SETTABLE_COUNT; ++i)
        if (interface_access[interface_settable[i]] == ACCESS_REAL_BEFORE_START)
            sound = sound && component_accepts(interface_settable[i], state->set[i]);
    /* numbers, all of them: small integers, read as doubles, are as well */
    for (size_t i = 0; i < sizeof *state / sizeof(double); ++i) {
        double word;
        memcpy(&word, (const uint8_t *)state + i * sizeof word, sizeof word);
        sound = sound && is_finite(word);
    }
    return sound;
}

ComponentStatus component_deserialize(Component *c, const uint8_t bytes[], size_t size,
                                      ComponentState *state) {
    Header header;
    ComponentState read;
    const char *reason = NULL;
    if (size != component_serialized_size()) {
        message_write(c->message, sizeof c->message, "serialized state of %u bytes: must be %u",
                      (unsigned)size, (unsigned)component_serialized_size());
        return COMPONENT_ERROR;
    }
    memcpy(&header, bytes, sizeof header);
    memcpy(&read, bytes + sizeof header, sizeof read);
    if (header.magic != MAGIC)
        reason = "these bytes are no state of this component";
    else if (header.version != FORMAT_VERSION)
        reason = "it has another format version";
    else if (header.interface != interface_hash() || header.payload_size != sizeof read)
        reason = "it is from a component with another interface";
    else if (header.checksum != hash(bytes + sizeof header, sizeof read))
        reason = "it is damaged: the checksum does not fit";
    else if (!is_sound(&read))
        reason = "its content makes no sense";
    if (reason != NULL) {
        message_write(c->message, sizeof c->message, "serialized state: %s", reason);
        return COMPONENT_ERROR;
    }
    *state = read;
    return COMPONENT_OK;
}
