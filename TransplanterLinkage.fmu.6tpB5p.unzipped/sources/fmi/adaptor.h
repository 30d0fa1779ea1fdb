/* What the adaptors of the FMI versions share: the instance, its messages, which call is legal
 * when, and the services whose words are the same in each version. An adaptor includes this file
 * once, after it has said in its version's terms
 *
 *   FMI(name)       the name with the version's prefix: FMI(Status), FMI(Error), ...
 *   Host            what the host gave with the instance
 *   TOKEN_NAME      what the version calls the token
 *   MESSAGE_ESCAPE  the character that the version's messages have to double
 *   CATEGORIES_ADD_UP  whether choosing log categories leaves those not named as they were
 *   host_log, host_allocate, host_release
 *                   how to use it; a host without a logger is host_log's affair */
#ifndef ADAPTOR_H
#define ADAPTOR_H

#include "../component/component.h"

#include <string.h>

typedef struct {
    Component component;
    Host host;
    bool logs_events, logs_discards, mutes_errors;
    const char *name;                /* stands behind this struct */
} Instance;

/* ---- messages ---------------------------------------------------------------------------- */

/* The category of modelDescription.xml under which each status is logged. */
static inline const char *category_of(FMI(Status) status) {
    switch (status) {
    case FMI(Discard): return "logStatusDiscard";
    case FMI(Warning): return "logStatusWarning";
    case FMI(OK): return "logEvents";
    default: return "logStatusError";
    }
}

/* The message goes out complete: hosts written in other languages than C cannot read further
 * arguments. */
static COMPONENT_RARELY void say(const Instance *instance, FMI(Status) status, const char *function,
                                 const char *text) {
    char message[2 * COMPONENT_MESSAGE_SIZE];
    size_t length = 0;
    const char *const parts[] = {function, ": ", text};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i)
        for (const char *part = parts[i]; *part != '\0' && length + 2 < sizeof message; ++part) {
            message[length++] = *part;
            if (*part == MESSAGE_ESCAPE)
                message[length++] = *part;
        }
    message[length] = '\0';
    host_log(&instance->host, instance->name, status, category_of(status), message);
}

static COMPONENT_RARELY FMI(Status)
    refuse(const Instance *instance, const char *function, const char *text) {
    if (!instance->mutes_errors)
        say(instance, FMI(Error), function, text);
    return FMI(Error);
}

static COMPONENT_RARELY FMI(Status)
    discard(const Instance *instance, const char *function, const char *text) {
    if (instance->logs_discards)
        say(instance, FMI(Discard), function, text);
    return FMI(Discard);
}

static COMPONENT_RARELY FMI(Status)
    answer_refusal(const Instance *instance, ComponentStatus status, const char *function) {
    const char *text = instance->component.message;
    return status == COMPONENT_DISCARD ? discard(instance, function, text)
                                       : refuse(instance, function, text);
}

/* The component's status as FMI's, its message to the host's logger. */
static inline FMI(Status)
    answer(const Instance *instance, ComponentStatus status, const char *function) {
    return status == COMPONENT_OK ? FMI(OK) : answer_refusal(instance, status, function);
}

/* ---- which call is legal when -------------------------------------------------------------- */

/* A bit for each mode of each interface type. */
#define IN(mode) ((UINT32_C(1) << (mode)) * UINT32_C(0x10001))
#define ONLY_CO_SIMULATION(modes) ((modes) & UINT32_C(0xffff))
#define ONLY_MODEL_EXCHANGE(modes) ((modes) & UINT32_C(0xffff0000))

#define IN_INSTANTIATED IN(MODE_INSTANTIATED)
#define IN_INITIALIZATION IN(MODE_INITIALIZATION)
#define IN_EVENT IN(MODE_EVENT)
#define IN_CONTINUOUS_TIME IN(MODE_CONTINUOUS_TIME)
/* A refused step leaves the component as before it, so setting and stepping go on from there; the
 * standard asks a host to restore a state first, and that works as well. */
#define IN_STEP (IN(MODE_STEP) | IN(MODE_STEP_REFUSED))
#define IN_UPDATE_AT_START IN(MODE_UPDATE_AT_START)
#define IN_UPDATE_AT_END IN(MODE_UPDATE_AT_END)
#define IN_UPDATE (IN_UPDATE_AT_START | IN_UPDATE_AT_END)
#define IN_TERMINATED IN(MODE_TERMINATED)
/* During an intermediate update the step that calls back is not done: nothing may be pulled from
 * under it. */
#define IN_ANY                                                                                     \
    (IN_INSTANTIATED | IN_INITIALIZATION | IN_EVENT | IN_CONTINUOUS_TIME | IN_STEP | IN_TERMINATED)
#define IN_INITIALIZED (IN_EVENT | IN_CONTINUOUS_TIME | IN_STEP)

static inline bool is_legal(const Instance *instance, uint32_t modes) {
    const ComponentSettings *settings = &instance->component.settings;
    return (modes >> (settings->mode + 16 * settings->kind)) & 1;
}

/* Says why a call is not legal; returns NULL. */
static COMPONENT_RARELY Instance *refuse_call(const Instance *instance, uint32_t modes,
                                              const char *function) {
    static const char *const names[MODE_COUNT] = {
        "before initialization",
        "in initialization mode",
        "in event mode",
        "in continuous-time mode",
        "between steps",
        "after a discarded step",
        "in an intermediate update at the start of a step",
        "in an intermediate update at the end of a step",
        "after termination",
    };
    if (instance != NULL && !is_legal(instance, modes)) {
        char text[96] = "not allowed ";
        bool is_co_simulation = instance->component.settings.kind == KIND_CO_SIMULATION;
        bool is_of_other_kind =
            is_co_simulation ? !ONLY_CO_SIMULATION(modes) : !ONLY_MODEL_EXCHANGE(modes);
        strcat(text, is_of_other_kind
                         ? (is_co_simulation ? "in Co-Simulation, " : "in Model Exchange, ")
                         : "");
        strcat(text, names[instance->component.settings.mode]);
        refuse(instance, function, text);
    } else if (instance != NULL) {
        refuse(instance, function, "an argument is NULL");
    }
    return NULL;
}

/* The instance, or NULL with a message where the call is not legal. */
static inline Instance *check_call(void *c, uint32_t modes, const char *function) {
    Instance *instance = c;
    return instance != NULL && is_legal(instance, modes) ? instance
                                                         : refuse_call(instance, modes, function);
}

/* The same for calls with arrays: none may be NULL where it has elements. */
static inline Instance *check_arrays(void *c, uint32_t modes, const char *function, size_t count,
                                     const void *first, const void *second, const void *third) {
    Instance *instance = c;
    bool has_arrays = count == 0 || (first != NULL && second != NULL && third != NULL);
    return has_arrays && instance != NULL && is_legal(instance, modes)
               ? instance
               : refuse_call(instance, modes, function);
}

/* The same for calls with one pointer that must not be NULL. */
static inline Instance *check_pointer(void *c, uint32_t modes, const char *function,
                                      const void *pointer) {
    return check_arrays(c, modes, function, 1, pointer, pointer, pointer);
}

/* There are no variables of some types: none of them is fine, any of them is unknown. */
static inline FMI(Status) check_none(void *c, uint32_t modes, const char *function, size_t count) {
    Instance *instance = check_call(c, modes, function);
    if (instance == NULL)
        return FMI(Error);
    return count == 0 ? FMI(OK) : refuse(instance, function, "there are no variables of this type");
}

/* ---- create, log ----------------------------------------------------------------------------- */

/* A new instance; NULL, with a message, where the host asks for what there is not. */
static inline Instance *instantiate(const Host *host, ComponentKind kind, const char *name,
                                    const char *token, bool logging, const char *function) {
    bool has_name = name != NULL && *name != '\0';
    Instance without_instance = {.host = *host,
                                 .name = has_name ? name : INTERFACE_MODEL_IDENTIFIER};
    const char *problem = NULL;
    if (!has_name)
        problem = "the instance name is missing or empty";
    else if (token == NULL || strcmp(token, INTERFACE_TOKEN) != 0)
        problem = "the " TOKEN_NAME " is not this FMU's, " INTERFACE_TOKEN
                  ": modelDescription.xml and binary are of different builds";
    size_t name_size = strlen(without_instance.name) + 1;
    Instance *instance = problem == NULL ? host_allocate(host, sizeof *instance + name_size) : NULL;
    if (instance == NULL) {
        refuse(&without_instance, function, problem == NULL ? "no memory" : problem);
        return NULL;
    }
    *instance = without_instance;
    instance->name = memcpy(instance + 1, name, name_size);
    instance->logs_events = instance->logs_discards = logging;
    component_reset(&instance->component, kind);
    return instance;
}

static inline void free_instance(void *c, const char *function) {
    Instance *instance = c;
    if (instance == NULL) /* ignored: FMI 2.0.4, section 2.1.5; FMI 3.0, section 2.3.1 */
        return;
    if (!is_legal(instance, IN_ANY))
        refuse_call(instance, IN_ANY, function);
    else
        host_release(&instance->host, instance);
}

/* Which messages the logger gets.
 *
 * FMI 2.0.4, section 2.1.5: the categories named and no others, all where none is named. So a host
 * that names categories and leaves out the errors is not told of these either.
 *
 * FMI 3.0 (CATEGORIES_ADD_UP), section 2.3.1: those named, the others stay as they were.
 *
 * Errors are told else, also where logging is off. FMI 2.0.4, section 2.1.3, says that the logger
 * was called where a function returns an error. FMI 3.0.2, section 2.3.1, forbids any call of the
 * logger where loggingOn is false; 3.0.3, section 2.2.4, takes that back: an error should be told
 * whatever the settings, all else not. A host without it learns nothing but that something failed,
 * and one that wants silence gives no logger. */
static inline FMI(Status) set_logging(void *c, bool logging, size_t count,
                                      const char *const categories[], const char *function) {
    static const char *const known[] = {INTERFACE_LOG_CATEGORIES};
    Instance *instance =
        check_arrays(c, IN_ANY | IN_UPDATE, function, count, categories, categories, categories);
    if (instance == NULL)
        return FMI(Error);
    bool events = count == 0, discards = count == 0, errors = count == 0;
    for (size_t i = 0; i < count; ++i) {
        const char *category = categories[i];
        bool is_known = false;
        for (size_t k = 0; k < sizeof known / sizeof known[0]; ++k)
            is_known = is_known || (category != NULL && strcmp(category, known[k]) == 0);
        if (!is_known)
            return refuse(instance, function, "unknown category: modelDescription.xml lists them");
        bool is_all = strcmp(category, "logAll") == 0;
        events = events || is_all || strcmp(category, category_of(FMI(OK))) == 0;
        discards = discards || is_all || strcmp(category, category_of(FMI(Discard))) == 0;
        errors = errors || is_all || strcmp(category, category_of(FMI(Error))) == 0;
    }
    if (events || !CATEGORIES_ADD_UP)
        instance->logs_events = logging && events;
    if (discards || !CATEGORIES_ADD_UP)
        instance->logs_discards = logging && discards;
    instance->mutes_errors = logging && !errors && !CATEGORIES_ADD_UP;
    return FMI(OK);
}

/* ---- Booleans -------------------------------------------------------------------------------- */

/* All or none: every reference is looked at before a value is. */
static inline FMI(Status) check_booleans(Instance *instance, const uint32_t references[],
                                         size_t count, bool are_set, const char *function) {
    return answer(instance,
                  component_check_booleans(&instance->component, references, count, are_set),
                  function);
}

/* ---- state ------------------------------------------------------------------------------------
 */

static inline FMI(Status) get_state(void *c, void **state, const char *function) {
    Instance *instance = check_pointer(c, IN_ANY, function, state);
    if (instance == NULL)
        return FMI(Error);
    if (*state == NULL)
        *state = host_allocate(&instance->host, sizeof(ComponentState));
    if (*state == NULL)
        return refuse(instance, function, "no memory");
    component_save(&instance->component, *state);
    return FMI(OK);
}

static inline FMI(Status) set_state(void *c, const ComponentState *state, const char *function) {
    Instance *instance = check_pointer(c, IN_ANY, function, state);
    if (instance == NULL)
        return FMI(Error);
    if (state->settings.kind != instance->component.settings.kind)
        return refuse(instance, function,
                      "the state is of an instance of the other interface type");
    component_restore(&instance->component, state);
    return FMI(OK);
}

static inline FMI(Status) free_state(void *c, void **state, const char *function) {
    Instance *instance = check_call(c, IN_ANY, function);
    if (instance == NULL)
        return FMI(Error);
    if (state != NULL && *state != NULL) { /* NULL is ignored: FMI 2.0.4, section 2.1.8 */
        host_release(&instance->host, *state);
        *state = NULL;
    }
    return FMI(OK);
}

static inline FMI(Status)
    get_serialized_size(void *c, const void *state, size_t *size, const char *function) {
    Instance *instance = check_arrays(c, IN_ANY, function, 1, state, size, size);
    if (instance == NULL)
        return FMI(Error);
    *size = component_serialized_size();
    return FMI(OK);
}

static inline FMI(Status) serialize_state(void *c, const ComponentState *state, void *bytes,
                                          size_t size, const char *function) {
    Instance *instance = check_arrays(c, IN_ANY, function, 1, state, bytes, bytes);
    if (instance == NULL)
        return FMI(Error);
    if (size < component_serialized_size())
        return refuse(instance, function, "the buffer is too small");
    component_serialize(state, bytes);
    return FMI(OK);
}

/* Unlike get_state, this has no use for what *state is on entry: it is an output alone (FMI 2.0.4,
 * section 2.1.8; FMI 3.0.2, section 2.2.7.4), and hosts leave there what they like. */
static inline FMI(Status)
    deserialize_state(void *c, const void *bytes, size_t size, void **state, const char *function) {
    Instance *instance = check_arrays(c, IN_ANY, function, 1, bytes, state, state);
    if (instance == NULL)
        return FMI(Error);
    ComponentState read;
    ComponentStatus status = component_deserialize(&instance->component, bytes, size, &read);
    if (status != COMPONENT_OK)
        return answer(instance, status, function);
    void *copy = host_allocate(&instance->host, sizeof read);
    if (copy == NULL)
        return refuse(instance, function, "no memory");
    *state = memcpy(copy, &read, sizeof read);
    return FMI(OK);
}

/* ---- Model Exchange ----------------------------------------------------------------------------
 */

/* From one mode to another, where nothing but the mode changes. */
static inline FMI(Status)
    change_mode(void *c, uint32_t from, ComponentMode to, const char *function) {
    Instance *instance = check_call(c, from, function);
    if (instance == NULL)
        return FMI(Error);
    instance->component.settings.mode = to;
    return FMI(OK);
}

static inline FMI(Status) set_time(void *c, double time, const char *function) {
    Instance *instance =
        check_call(c, ONLY_MODEL_EXCHANGE(IN_EVENT | IN_CONTINUOUS_TIME), function);
    if (instance == NULL)
        return FMI(Error);
    return answer(instance, component_set_time(&instance->component, time), function);
}

/* The instance, where it has as many continuous states, or event indicators, as the host says. */
static inline Instance *check_count(void *c, uint32_t modes, size_t count, size_t wanted,
                                    const void *values, const char *function) {
    Instance *instance =
        check_arrays(c, ONLY_MODEL_EXCHANGE(modes), function, count, values, values, values);
    if (instance != NULL && count != wanted) {
        refuse(instance, function,
               wanted == 0 ? "there are no event indicators" : "there is one continuous state");
        return NULL;
    }
    return instance;
}

/* The continuous state of Model Exchange, its derivative and its nominal value. */
enum { CONTINUOUS_STATES = 1, EVENT_INDICATORS = 0 };
static const double NOMINAL_TRAVEL = 1.0; /* m */

static inline FMI(Status)
    set_continuous_states(void *c, const double states[], size_t count, const char *function) {
    Instance *instance =
        check_count(c, IN_CONTINUOUS_TIME, count, CONTINUOUS_STATES, states, function);
    if (instance == NULL)
        return FMI(Error);
    return answer(instance, component_set_travel(&instance->component, states[0]), function);
}

/* The value of one variable: the continuous state, or its derivative. */
static inline FMI(Status) get_continuous(void *c, uint32_t modes, uint32_t reference,
                                         double values[], size_t count, const char *function) {
    Instance *instance = check_count(c, modes, count, CONTINUOUS_STATES, values, function);
    if (instance == NULL)
        return FMI(Error);
    return answer(instance, component_get_real(&instance->component, &reference, 1, values),
                  function);
}

static inline FMI(Status)
    get_nominals(void *c, uint32_t modes, double nominals[], size_t count, const char *function) {
    Instance *instance = check_count(c, modes, count, CONTINUOUS_STATES, nominals, function);
    if (instance == NULL)
        return FMI(Error);
    nominals[0] = NOMINAL_TRAVEL;
    return FMI(OK);
}

#endif
