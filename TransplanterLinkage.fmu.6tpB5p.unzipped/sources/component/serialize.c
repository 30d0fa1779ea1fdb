/* A saved state as bytes: header and payload, each an array of 8-byte words. */
#include "component.h"
#include "message.h"

#include <string.h>

enum { FORMAT_VERSION = 3 };

typedef struct {
    uint64_t magic, version, interface, payload_size, checksum;
} Header;

/* "TLINKAGE" in little-endian order; another byte order reads another number. */
static const uint64_t MAGIC = UINT64_C(0x4547414b4e494c54);

/* Another layout is another FORMAT_VERSION: this array has a negative size when members come or
 * go besides variables, whose number is in the interface's token. */
typedef char state_has_this_layout
    [sizeof(ComponentState) == 8 * (INTERFACE_COUNT + 1 + 4 * INTERFACE_INPUT_COUNT + 65) ? 1 : -1];

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
    const ComponentProgress *progress = &state->progress;
    bool is_step = settings->mode == MODE_STEP || settings->mode == MODE_STEP_REFUSED;
    bool sound =
        is_within(settings->kind, KIND_CO_SIMULATION, KIND_MODEL_EXCHANGE)
        && is_within(settings->mode, 0, MODE_COUNT - 1) && settings->mode != MODE_UPDATE_AT_START
        && settings->mode != MODE_UPDATE_AT_END
        && !(is_step && settings->kind == KIND_MODEL_EXCHANGE)
        && !(settings->mode == MODE_CONTINUOUS_TIME && settings->kind == KIND_CO_SIMULATION)
        && is_within(progress->crank.source, SOURCE_ANGLE, SOURCE_ACCELERATION)
        && is_within(progress->crank.samples.count, 0, 4)
        && is_within(progress->crank.fit.count, 0, FIT_MAX_DEGREE + 2) && progress->last_step >= 0.0
        && component_is_bounded(progress);
    for (uint32_t i = 1; i <= INTERFACE_COUNT; ++i)
        if (!interface_variables[i].is_output && interface_access[i] == ACCESS_REAL_BEFORE_START)
            sound = sound && component_accepts(i, settings->real[i]);
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
