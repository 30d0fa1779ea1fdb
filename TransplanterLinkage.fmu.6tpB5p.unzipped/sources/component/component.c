#include "component.h"

#include "message.h"
#include "outputs.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A host's time may be off the end of the last step by its own rounding: i*h against a sum, or
 * a clock that counts nanoseconds. */
static const double TIME_TOLERANCE_STEPS = 1e-6;      /* of the step */
static const double TIME_TOLERANCE_ULPS = 16 * DBL_EPSILON; /* of the time */

/* Refused steps in a row after which no other one is discarded but an error, for hosts that never
 * try the same one twice; bisecting down to the last bit takes a tenth of them. */
enum { MOST_DISCARDS = 1000 };

static const double GREATEST_VALUE = INTERFACE_GREATEST_VALUE;

/* ---- modes ------------------------------------------------------------------------------ */

/* Until the first step, outputs belong to the inputs as set. */
static bool has_stepped(Component *c) { return component_present(c)->last_step > 0.0; }

static const InputDerivatives *derivatives_of(const Component *c, uint32_t reference) {
    return &c->settings.input_derivatives[interface_variables[reference].input];
}

static CrankInput crank_input(const Component *c) {
    CrankInput input;
    input.phi = c->settings.real[VARIABLE_CRANK_PHI];
    input.w = c->settings.real[VARIABLE_CRANK_W];
    input.a = c->settings.real[VARIABLE_CRANK_A];
    input.at_step_end = c->settings.real[VARIABLE_CRANK_AT_STEP_END] > 0.0;
    input.smoothing = c->settings.real[VARIABLE_CRANK_SMOOTHING];
    input.has_derivatives = c->settings.derivatives_are_set != 0;
    if (input.has_derivatives) {
        input.phi_derivatives = *derivatives_of(c, VARIABLE_CRANK_PHI);
        input.w_derivatives = *derivatives_of(c, VARIABLE_CRANK_W);
        input.a_derivatives = *derivatives_of(c, VARIABLE_CRANK_A);
    }
    return input;
}

/* The force on the tip, and its derivatives, `ahead` seconds after the inputs' instant. */
static void set_force(const Component *c, double ahead, ComponentProgress *progress) {
    static const uint32_t references[2] = {VARIABLE_TIP_FX, VARIABLE_TIP_FY};
    double (*force)[2] = progress->force;
    if (!c->settings.derivatives_are_set) {
        memset(force, 0, sizeof progress->force);
        force[0][0] = c->settings.real[VARIABLE_TIP_FX];
        force[0][1] = c->settings.real[VARIABLE_TIP_FY];
        return;
    }
    for (int axis = 0; axis < 2; ++axis) {
        const InputDerivatives *derivatives = derivatives_of(c, references[axis]);
        int order = derivatives_order(derivatives);
        double first = order >= 1 ? derivatives->value[0] : 0.0;
        double second = order >= 2 ? derivatives->value[1] : 0.0;
        force[0][axis] =
            c->settings.real[references[axis]] + ahead * (first + ahead * (0.5 * second));
        force[1][axis] = first + ahead * second;
        force[2][axis] = second;
    }
}

/* From the motions as they are at the start. */
static void start_histories(ComponentProgress *progress, const CrankInput *input) {
    travel_start(&progress->travel, progress->travel.end);
    progress->crank = (Crank){.end = progress->crank.end};
    if (input->at_step_end) {
        /* the first step brings the samples of its end, so these count */
        crank_start(&progress->crank, input);
        progress->travel.samples = 1;
    }
}

/* The motions at the instant of the inputs: before the first step and in Model Exchange, the inputs
 * as they are. After a step, the rates that the host does not give stay as predicted, and so does
 * the travel, which is a state. */
static void follow_inputs(Component *c) {
    const double *real = c->settings.real;
    ComponentProgress *progress = component_present(c);
    CrankInput input = crank_input(c);
    CrankMotion crank = crank_motion_of(&input);
    const InputDerivatives *speed = derivatives_of(c, VARIABLE_MACHINE_V);
    int order = derivatives_order(speed);
    MachineMotion machine = {real[VARIABLE_MACHINE_S], real[VARIABLE_MACHINE_V],
                             order >= 1 ? speed->value[0] : 0.0,
                             order >= 2 ? speed->value[1] : 0.0};
    if (has_stepped(c)) {
        const Crank *predicted = &progress->crank;
        if (predicted->source == SOURCE_ANGLE && (crank.w == 0.0 || predicted->doubt.is_ignored))
            crank.w = predicted->end.w;
        if (predicted->source != SOURCE_ACCELERATION && crank.a == 0.0) {
            crank.a = predicted->end.a;
            crank.jerk = predicted->end.jerk;
        }
        if (order == 0) {
            machine.a = progress->travel.end.a;
            machine.jerk = progress->travel.end.jerk;
        }
        machine.s = progress->travel.end.s;
        c->followed = *progress;
        progress = &c->followed;
        c->settings.follows_inputs = 1;
    }
    progress->crank.end = crank;
    progress->travel.end = machine;
    if (!has_stepped(c) && c->settings.mode == MODE_EVENT)
        start_histories(progress, &input);
    set_force(c, 0.0, progress);
    c->shown = progress;
    c->pose.order = -1;
    c->fresh = EVALUATION_NONE;
}

/* Whether inputs that are set now belong to the instant that the outputs belong to. */
static bool follows_inputs(Component *c) {
    return !has_stepped(c) || c->settings.follows_inputs || c->settings.mode == MODE_EVENT
           || c->settings.mode == MODE_UPDATE_AT_END;
}

void component_reset(Component *c, ComponentKind kind) {
    memset(c, 0, sizeof *c);
    for (uint32_t i = 1; i <= INTERFACE_COUNT; ++i)
        c->settings.real[i] = interface_variables[i].start;
    c->settings.kind = kind;
    c->settings.mode = MODE_INSTANTIATED;
    follow_inputs(c);
}

ComponentStatus component_set_experiment(Component *c, double start, bool stop_is_set,
                                         double stop) {
    if (!is_finite(start) || (stop_is_set && !(stop >= start && is_finite(stop)))) {
        message_write(c->message, sizeof c->message,
                      "start time %g s, stop time %g s: must be finite and in this order", start,
                      stop);
        return COMPONENT_ERROR;
    }
    c->settings.real[VARIABLE_TIME] = start;
    c->settings.stop_is_set = stop_is_set;
    c->settings.stop = stop_is_set ? stop : 0.0;
    return COMPONENT_OK;
}

ComponentStatus component_exit_initialization(Component *c, ComponentMode next) {
    if (outputs_solve(c, 0) != COMPONENT_OK)
        return COMPONENT_ERROR;
    CrankInput input = crank_input(c);
    start_histories(component_present(c), &input);
    c->settings.mode = next;
    return COMPONENT_OK;
}

/* ---- values ----------------------------------------------------------------------------- */

static COMPONENT_RARELY ComponentStatus refuse_reference(Component *c, uint32_t reference,
                                                         const char *demand) {
    if (reference < 1 || reference > INTERFACE_COUNT)
        message_write(c->message, sizeof c->message,
                      "value reference %u: unknown, the last one is %u", reference,
                      (unsigned)INTERFACE_COUNT);
    else
        message_write(c->message, sizeof c->message, "%s (value reference %u): %s",
                      interface_variables[reference].name, reference, demand);
    return COMPONENT_ERROR;
}

static COMPONENT_RARELY ComponentStatus refuse_value(Component *c, uint32_t reference,
                                                     double value) {
    const InterfaceVariable *variable = &interface_variables[reference];
    bool has_gap = variable->smallest > 0.0;
    message_write(c->message, sizeof c->message, "%s = %g: must be %sa finite number from %g to %g",
                  variable->name, value, has_gap ? "0 or " : "",
                  has_gap ? variable->smallest : variable->least, variable->greatest);
    return COMPONENT_ERROR;
}

bool component_accepts(uint32_t reference, double value) {
    const InterfaceVariable *variable = &interface_variables[reference];
    return value >= variable->least && value <= variable->greatest
           && (value == 0.0 || fabs(value) >= variable->smallest);
}

static bool is_known(uint32_t reference) { return reference - 1 < INTERFACE_COUNT; }

static bool is_boolean(uint32_t reference) {
    return is_known(reference) && interface_evaluation[reference] == EVALUATION_NOT_REAL;
}

static bool is_geometry(uint32_t reference) {
    return reference >= VARIABLE_GEOMETRY_L1 && reference <= VARIABLE_GEOMETRY_THETA9;
}

/* An output, or the derivative of a state. */
static bool is_computed(uint32_t reference) {
    return is_known(reference)
           && (interface_evaluation[reference] & ~(uint32_t)EVALUATION_NOT_REAL) != 0;
}

/* The ACCESS_ bits of which a variable must have one to be set now. */
static uint32_t real_access_now(const Component *c) {
    if (c->settings.mode <= MODE_INITIALIZATION)
        return ACCESS_REAL_BEFORE_START;
    return c->settings.kind == KIND_MODEL_EXCHANGE ? ACCESS_REAL_LATER | ACCESS_STATE_LATER
                                                   : ACCESS_REAL_LATER;
}

static uint32_t boolean_access_now(const Component *c) {
    return c->settings.mode <= MODE_INITIALIZATION ? ACCESS_BOOLEAN_BEFORE_START
                                                   : ACCESS_BOOLEAN_LATER;
}

static COMPONENT_RARELY ComponentStatus refuse_setting(Component *c, uint32_t reference) {
    const char *demand = "can be set until the end of initialization only";
    if (interface_access[reference] == ACCESS_READ_ONLY)
        demand = "cannot be set";
    else if (interface_access[reference] & ACCESS_STATE_LATER)
        demand = "can be set until the end of initialization, and later in Model Exchange only";
    return refuse_reference(c, reference, demand);
}

/* Says which of the values was wrong, once the loop that only sums up the faults saw one. */
static COMPONENT_RARELY ComponentStatus refuse_getting(Component *c, const uint32_t reference[]) {
    while (is_known(*reference) && !is_boolean(*reference))
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
        value[i] = c->settings.real[reference[i]];
    return COMPONENT_OK;
}

static COMPONENT_RARELY ComponentStatus refuse_values(Component *c, const uint32_t reference[],
                                                      const double value[]) {
    for (;; ++reference, ++value) {
        if (!is_known(*reference) || is_boolean(*reference))
            return refuse_reference(c, *reference, "is a Boolean, not a real");
        if (!(interface_access[*reference] & real_access_now(c)))
            return refuse_setting(c, *reference);
        if (!component_accepts(*reference, *value))
            return refuse_value(c, *reference, *value);
    }
}

ComponentStatus component_set_real(Component *c, const uint32_t reference[], size_t count,
                                   const double value[]) {
    uint32_t access = real_access_now(c);
    for (size_t i = 0; i < count; ++i)
        if (!(reference[i] <= INTERFACE_COUNT && (interface_access[reference[i]] & access)
              && fabs(value[i]) <= GREATEST_VALUE))
            return refuse_values(c, reference, value);
    if (access == ACCESS_REAL_BEFORE_START)
        for (size_t i = 0; i < count; ++i)
            if (!component_accepts(reference[i], value[i]))
                return refuse_values(c, reference, value);
    for (size_t i = 0; i < count; ++i)
        c->settings.real[reference[i]] = value[i];
    if (follows_inputs(c)) {
        for (size_t i = 0; i < count; ++i)
            if (is_geometry(reference[i])) /* before the end of initialization */
                c->linkage_is_ready = 0;
        follow_inputs(c);
    }
    return COMPONENT_OK;
}

ComponentStatus component_check_booleans(Component *c, const uint32_t reference[], size_t count,
                                         bool are_set) {
    for (size_t i = 0; i < count; ++i) {
        if (!is_boolean(reference[i]))
            return refuse_reference(c, reference[i], "is a real, not a Boolean");
        if (are_set && !(interface_access[reference[i]] & boolean_access_now(c)))
            return refuse_setting(c, reference[i]);
    }
    return COMPONENT_OK;
}

ComponentStatus component_set_time(Component *c, double time) {
    if (!is_finite(time))
        return refuse_value(c, VARIABLE_TIME, time);
    /* Beyond the stop time as well, though FMI has "an error where the host computes past it" (FMI
     * 2.0.4, section 2.1.6; FMI 3.0.2, section 2.3.2): solvers that interpolate, CVODES in FMPy
     * and CasADi among them, step over the end and come back. To refuse would make them useless;
     * nothing here depends on the time, so to answer harms nobody. A step of Co-Simulation beyond
     * the stop time is an error. */
    c->settings.real[VARIABLE_TIME] = time;
    return COMPONENT_OK;
}

ComponentStatus component_set_travel(Component *c, double travel) {
    if (!(fabs(travel) <= GREATEST_VALUE))
        return refuse_value(c, VARIABLE_MACHINE_S, travel);
    c->settings.real[VARIABLE_MACHINE_S] = travel;
    follow_inputs(c);
    return COMPONENT_OK;
}

/* ---- derivatives ------------------------------------------------------------------------ */

static COMPONENT_RARELY ComponentStatus refuse_order(Component *c, uint32_t reference,
                                                     int32_t order) {
    message_write(c->message, sizeof c->message, "%s: derivative of order %g; orders 1 and 2 exist",
                  interface_variables[reference].name, (double)order);
    return COMPONENT_ERROR;
}

static bool has_order(int32_t order) { return order >= 1 && order <= COMPONENT_MAX_DERIVATIVE; }

static bool is_input(uint32_t reference) {
    return is_known(reference) && interface_variables[reference].input >= 0;
}

static bool is_output(uint32_t reference) {
    return is_known(reference) && interface_variables[reference].is_output;
}

ComponentStatus component_set_input_derivatives(Component *c, const uint32_t reference[],
                                                size_t count, const int32_t order[],
                                                const double value[]) {
    for (size_t i = 0; i < count; ++i) {
        if (!is_input(reference[i]))
            return refuse_reference(c, reference[i], "is no input");
        if (!has_order(order[i]))
            return refuse_order(c, reference[i], order[i]);
        if (!(fabs(value[i]) <= GREATEST_VALUE))
            return refuse_value(c, reference[i], value[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        InputDerivatives *input =
            &c->settings.input_derivatives[interface_variables[reference[i]].input];
        input->value[order[i] - 1] = value[i];
        input->is_set[order[i] - 1] = 1;
        c->settings.derivatives_are_set = 1;
    }
    if (follows_inputs(c))
        follow_inputs(c);
    return COMPONENT_OK;
}

ComponentStatus component_get_output_derivatives(Component *c, const uint32_t reference[],
                                                 size_t count, const int32_t order[],
                                                 double value[]) {
    for (size_t i = 0; i < count; ++i) {
        if (!is_output(reference[i]))
            return refuse_reference(c, reference[i], "is no output");
        if (!has_order(order[i]))
            return refuse_order(c, reference[i], order[i]);
    }
    /* a first pass for the status, so that values are all given or none */
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t i = 0; i < count; ++i) {
            double derivative;
            ComponentStatus status =
                outputs_time_derivative(c, reference[i], order[i], &derivative);
            if (status != COMPONENT_OK)
                return status;
            if (pass == 1)
                value[i] = derivative;
        }
    }
    return COMPONENT_OK;
}

/* Refuses, with a message, what is no unknown or no known now, and seeds that are no numbers. Else
 * sums up what is to be evaluated, and whether by the geometry. Parameters are knowns in
 * initialization mode alone, where they may change: FMI 2.0.4, sections 2.1.9 and 2.2.8
 * (InitialUnknowns); FMI 3.0, section 2.2, "Getting Partial Derivatives". The independent variable
 * is a known in every mode (there, and FMI 3.0, section 2.4.8); nothing depends on the time itself,
 * so that all derivatives by it are 0. */
static ComponentStatus check_derivative(Component *c, const uint32_t unknown[],
                                        size_t unknown_count, const uint32_t known[],
                                        size_t known_count, const double seed[], bool is_adjoint,
                                        uint32_t *evaluations, bool *by_geometry) {
    *evaluations = EVALUATION_NONE;
    *by_geometry = false;
    for (size_t i = 0; i < unknown_count; ++i) {
        if (!is_computed(unknown[i]))
            return refuse_reference(c, unknown[i], "is no output: no derivative of it");
        if (!outputs_have_derivatives(unknown[i]))
            return outputs_refuse_derivative(c, unknown[i]);
        if (is_adjoint && !(fabs(seed[i]) <= GREATEST_VALUE))
            return refuse_value(c, unknown[i], seed[i]);
        *evaluations |= interface_evaluation[unknown[i]];
    }
    for (size_t k = 0; k < known_count; ++k) {
        bool is_parameter = is_geometry(known[k]);
        if (is_parameter && c->settings.mode != MODE_INITIALIZATION)
            return refuse_reference(c, known[k],
                                    "derivatives by parameters exist in initialization mode only");
        if (!is_parameter && !is_input(known[k]) && known[k] != VARIABLE_MACHINE_S
            && known[k] != VARIABLE_TIME)
            return refuse_reference(c, known[k], "is no input: no derivative by it");
        if (!is_adjoint && !(fabs(seed[k]) <= GREATEST_VALUE))
            return refuse_value(c, known[k], seed[k]);
        *by_geometry = *by_geometry || is_parameter;
    }
    return COMPONENT_OK;
}

ComponentStatus component_get_directional_derivative(Component *c, const uint32_t unknown[],
                                                     size_t unknown_count, const uint32_t known[],
                                                     size_t known_count, const double seed[],
                                                     double sensitivity[]) {
    double direction[INTERFACE_COUNT + 1] = {0.0}, change[INTERFACE_COUNT + 1] = {0.0};
    uint32_t evaluations;
    bool by_geometry;
    ComponentStatus status = check_derivative(c, unknown, unknown_count, known, known_count, seed,
                                              false, &evaluations, &by_geometry);
    if (status != COMPONENT_OK)
        return status;
    for (size_t k = 0; k < known_count; ++k)
        direction[known[k]] += seed[k];
    status = outputs_vary(c, evaluations, by_geometry, direction, change);
    if (status != COMPONENT_OK)
        return status;
    for (size_t i = 0; i < unknown_count; ++i)
        sensitivity[i] = change[unknown[i]];
    return COMPONENT_OK;
}

ComponentStatus component_get_adjoint_derivative(Component *c, const uint32_t unknown[],
                                                 size_t unknown_count, const uint32_t known[],
                                                 size_t known_count, const double seed[],
                                                 double sensitivity[]) {
    double weight[INTERFACE_COUNT + 1] = {0.0}, gradient[INTERFACE_COUNT + 1] = {0.0};
    uint32_t evaluations;
    bool by_geometry;
    ComponentStatus status = check_derivative(c, unknown, unknown_count, known, known_count, seed,
                                              true, &evaluations, &by_geometry);
    if (status != COMPONENT_OK)
        return status;
    for (size_t i = 0; i < unknown_count; ++i)
        weight[unknown[i]] += seed[i];
    status = outputs_gradient(c, evaluations, by_geometry, weight, gradient);
    if (status != COMPONENT_OK)
        return status;
    for (size_t k = 0; k < known_count; ++k)
        sensitivity[k] = gradient[known[k]];
    return COMPONENT_OK;
}

/* ---- the communication step ---------------------------------------------------------------- */

/* The crank's jerk, and a force, may be larger by many orders than what they are multiplied with.
 */
static const double JERK_SCALE = 1e180; /* leaves 1e128 */
static const double GREATEST_FORCE = 1e120;

/* Inlined, so that each step pays three comparisons: a sum is not finite where one of its terms is
 * not. */
static inline bool motion_is_bounded(const ComponentProgress *progress) {
    CrankMotion crank = progress->crank.end;
    MachineMotion machine = progress->travel.end;
    return fabs(crank.w) <= GREATEST_VALUE && fabs(crank.a) <= GREATEST_VALUE
           && is_finite((crank.phi + machine.s) + (machine.v + JERK_SCALE * crank.jerk));
}

/* Forces without derivatives are as set. */
static bool force_is_bounded(const ComponentProgress *progress) {
    double sum = 0.0;
    for (int order = 0; order <= COMPONENT_MAX_DERIVATIVE; ++order)
        sum += fabs(progress->force[order][0]) + fabs(progress->force[order][1]);
    return sum <= GREATEST_FORCE;
}

bool component_is_bounded(const ComponentProgress *progress) {
    return motion_is_bounded(progress) && force_is_bounded(progress);
}

ComponentStatus component_check_step(Component *c, double time, double step) {
    double expected = c->settings.real[VARIABLE_TIME];
    double tolerance = TIME_TOLERANCE_STEPS * step + TIME_TOLERANCE_ULPS * fabs(expected);
    if (!(step > 0.0 && step <= DBL_MAX)) {
        message_write(c->message, sizeof c->message,
                      "communication step size %g s: must be positive and finite", step);
        return COMPONENT_ERROR;
    }
    if (!(fabs(time - expected) <= tolerance)) {
        message_write(c->message, sizeof c->message,
                      "communication point %g s: the last step ended at %g s, %g s off", time,
                      expected, fabs(time - expected));
        return COMPONENT_ERROR;
    }
    if (c->settings.stop_is_set && !(time + step <= c->settings.stop + tolerance)) {
        message_write(c->message, sizeof c->message,
                      "a step from %g s to %g s: goes %g s beyond the stop time", time, time + step,
                      time + step - c->settings.stop);
        return COMPONENT_ERROR;
    }
    return COMPONENT_OK;
}

/* A step whose crank angle cannot be had: Discard at first, Error when it is tried again as it
 * was or after many others. */
static COMPONENT_RARELY ComponentStatus refuse_step(Component *c, double time, double step,
                                                    double phi, LinkageClosure closure,
                                                    double gap) {
    outputs_explain_gap(c, closure, phi, gap);
    bool again = c->refusals > 0 && c->refused_time == time && c->refused_step == step
                 && c->refused_phi == phi;
    bool is_error = again || c->refusals >= MOST_DISCARDS - 1;
    if (is_error) {
        size_t length = strlen(c->message);
        message_write(c->message + length, sizeof c->message - length,
                      again ? "; the same step was discarded before"
                            : "; %u steps in a row were discarded before",
                      (unsigned)(MOST_DISCARDS - 1));
    }
    if (c->refusals < MOST_DISCARDS)
        c->refusals += 1;
    c->settings.mode = MODE_STEP_REFUSED;
    /* linkage_place left no pose: that of the last step is computed anew when it is read */
    c->fresh = EVALUATION_NONE;
    c->refused_time = time;
    c->refused_step = step;
    c->refused_phi = phi;
    return is_error ? COMPONENT_ERROR : COMPONENT_DISCARD;
}

static COMPONENT_RARELY void explain_news(Component *c, int noticed, double from, double to,
                                          double time) {
    if (noticed & CRANK_SPEED_IGNORED) {
        message_write(
            c->message, sizeof c->message,
            "crank.w = %g rad/s at %g s is not how crank.phi moves, from %g rad to %g rad: "
            "crank.w is ignored until they agree",
            c->settings.real[VARIABLE_CRANK_W], time, from, to);
        return;
    }
    message_write(c->message, sizeof c->message,
                  noticed & CRANK_RESTARTED
                      ? "crank.phi jumps from %g rad to %g rad at %g s: its history restarts"
                      : "crank.phi goes from %g rad to %g rad at %g s: taken as continuing over "
                        "whole turns",
                  from, to, time);
}

ComponentStatus component_do_step(Component *c, double time, double step) {
    ComponentStatus status = component_check_step(c, time, step);
    if (status != COMPONENT_OK)
        return status;
    outputs_prepare(c);

    const ComponentProgress *before = component_present(c);
    ComponentProgress *after = &c->progress[1 - c->present];
    CrankInput input = crank_input(c);
    /* the time since the last sample: samples belong to the starts of steps, or to their ends */
    double gap = input.at_step_end ? step : before->last_step;
    bool is_close = samples_are_close(gap, step) && input.smoothing == 0.0;
    bool times_change = gap > 0.0 && (is_close || sample_times_change(&c->settings.times, gap));
    SampleTimes changed = {.are_equal = 0};
    const SampleTimes *times = &c->settings.times;
    const Crank *crank = &before->crank;
    Crank without_close;
    if (times_change) {
        changed = c->settings.times;
        if (is_close) {
            without_close = *crank;
            crank_drop_samples(&without_close, &changed, gap, step);
            crank = &without_close;
        } else {
            sample_times_add(&changed, gap);
        }
        times = &changed;
    }
    after->last_step = step;
    int noticed = crank_advance(crank, times, &input, step, &after->crank);
    travel_advance(&before->travel, gap, c->settings.real[VARIABLE_MACHINE_V],
                   derivatives_of(c, VARIABLE_MACHINE_V), input.at_step_end, step, &after->travel);
    set_force(c, input.at_step_end ? 0.0 : step, after);

    double phi = after->crank.end.phi;
    if (!motion_is_bounded(after)
        || (c->settings.derivatives_are_set && !force_is_bounded(after))) {
        message_write(c->message, sizeof c->message,
                      "a step of %g s ends at crank.phi = %g rad, crank.w = %g rad/s, crank.a = %g "
                      "rad/s2, machine.s = %g m, tip.fx = %g N, tip.fy = %g N: beyond all numbers",
                      step, phi, after->crank.end.w, after->crank.end.a, after->travel.end.s,
                      after->force[0][0], after->force[0][1]);
        return COMPONENT_ERROR;
    }
    double open_by;
    LinkageClosure closure = linkage_place(&c->linkage, phi, &c->pose, &open_by);
    if (closure != LINKAGE_CLOSED)
        return refuse_step(c, time, step, phi, closure, open_by);

    c->has_news = noticed != 0;
    if (noticed)
        explain_news(c, noticed, before->crank.phi, after->crank.phi, time);
    if (times_change)
        c->settings.times = changed;
    if (c->settings.derivatives_are_set) {
        memset(c->settings.input_derivatives, 0, sizeof c->settings.input_derivatives);
        c->settings.derivatives_are_set = 0;
    }
    c->present = 1 - c->present;
    c->shown = after;
    c->settings.follows_inputs = 0;
    c->settings.real[VARIABLE_TIME] = time + step;
    c->settings.mode = MODE_STEP;
    c->fresh = EVALUATION_NONE;
    c->refusals = 0;
    return COMPONENT_OK;
}

/* ---- state ---------------------------------------------------------------------------------- */

void component_save(Component *c, ComponentState *state) {
    state->settings = c->settings;
    state->progress = *component_present(c);
    for (uint32_t i = 1; i <= INTERFACE_COUNT; ++i)
        if (is_computed(i))
            state->settings.real[i] = 0.0;
    state->settings.real[VARIABLE_MACHINE_S] = state->progress.travel.end.s;
}

void component_restore(Component *c, const ComponentState *state) {
    c->settings = state->settings;
    *component_present(c) = state->progress;
    c->shown = component_present(c);
    c->linkage_is_ready = 0;
    c->pose.order = -1;
    c->fresh = EVALUATION_NONE;
    if (c->settings.follows_inputs)
        follow_inputs(c);
}
