/* Random step histories of the crank, as ugly as hosts make them and worse: how far off the angle
 * is after a step, against what holding it would have missed by.
 *
 *   histories WHAT SMOOTHING AT_STEP_END FIRST COUNT
 *
 * WHAT: what the host gives, by its place in GIVEN. Prints the worst of COUNT histories from number
 * FIRST on, as a multiple of the most that holding misses by in that history (a jump counts, and
 * the motion that goes on there is no fault), the history's number, and how many of them are worse
 * than 2.5.
 *
 * A history is one motion in pieces, each a parabola with a swing upon it. Where one ends the crank
 * jumps, stops, turns back, runs on with another speed or acceleration. Steps are even, grow or
 * shrink by up to 40 each, are random over three decades, long and tiny in turn, or clusters down
 * to 1e-9 s. Linked with the component, whose crank is read as it is. */
#include "component/component.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STEPS = 200, TAIL = 24, MOST_REGULAR = 14 };
static const double PI = 3.14159265358979323846, TURN = 6.28318530717958647693;
static const double MOST = 2.5;
static const double LONGEST = 5e-2, SHORTEST = 1e-9; /* s */
static const double PLANTING_SPEED = 6.807, GREATEST_SPEED = 60.0; /* rad/s */
static const double NOISE = 0.2;                                   /* of a speed */

typedef enum {
    ANGLE,
    SPEED,
    ACCELERATION,
    ONE_DERIVATIVE,
    TWO_DERIVATIVES,
    CHANGING,        /* now this, now that of those above */
    NOISY_ANGLE,     /* by up to 0.01 rad */
    COARSE_ANGLE,    /* counted, 120 to 6000 a turn */
    NOISY_SPEED,     /* by up to a fifth */
    SPEED_FALLS_TO_0, /* for some time */
    SPEED_IN_RPM
} Given;

/* ---- chance -------------------------------------------------------------------------------------
 */

static uint64_t seed; /* splitmix64 */

static double uniform(double low, double high) {
    uint64_t z = seed += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return low + (high - low) * ((double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0);
}

static double by_decades(double low, double high) { return exp(uniform(log(low), log(high))); }
static int one_of(int count) { return (int)uniform(0.0, count); }
static bool happens(double probability) { return uniform(0.0, 1.0) < probability; }
static double either_way(double value) { return happens(0.5) ? value : -value; }

/* ---- the motion, and the steps through which it is given ----------------------------------------
 */

typedef struct {
    double begin, phi, w, a;     /* s; rad and so on there */
    double swing, beat, swing_at; /* amplitude in rad, rad/s, phase at the begin */
} Piece;

static CrankMotion motion_of(const Piece *p, double time) {
    double t = time - p->begin, at = p->beat * t + p->swing_at;
    return (CrankMotion){
        p->phi + p->w * t + 0.5 * p->a * t * t + p->swing * (sin(at) - sin(p->swing_at)),
        p->w + p->a * t + p->swing * p->beat * cos(at),
        p->a - p->swing * p->beat * p->beat * sin(at),
        0.0,
    };
}

static double greatest_speed(const Piece *p, double time, double h) {
    double t = fmax(time - p->begin, 0.0);
    return fabs(p->w) + fabs(p->a) * (t + h) + fabs(p->swing) * p->beat;
}

typedef struct {
    double time, length;
    CrankMotion at, end;
    double goes;    /* rad, within it, to and fro */
    double jump;   /* rad, at its begin */
    double goes_on; /* rad, where something happens at its begin */
} Step;

typedef struct {
    Step step[MOST_STEPS];
    int count, regular; /* the steps from here on are */
} History;

/* What befalls the crank; returns by how much it jumps. */
static double befall(Piece *p, double time, double speed) {
    CrankMotion now = motion_of(p, time);
    *p = (Piece){.begin = time, .phi = now.phi, .w = now.w};
    double jump = 0.0;
    switch (one_of(8)) {
    case 0:
    case 1:
    case 2: jump = either_way(happens(0.5) ? uniform(0.01, 3.1) : by_decades(1e-4, 3.1)); break;
    case 3: p->w = 0.0; break;
    case 4: p->w = -now.w; break;
    case 5: p->w = speed * uniform(-1.0, 1.5); break;
    case 6: p->w = speed; break;
    default: p->a = uniform(-20.0, 20.0) * fabs(speed); break;
    }
    p->phi += jump;
    if (happens(0.4)) {
        p->beat = uniform(3.0, 60.0);
        p->swing = fabs(speed) * uniform(0.0, 0.5) / p->beat;
        p->swing_at = uniform(0.0, TURN);
    }
    return jump;
}

typedef struct {
    int kind;
    double usual, ratio, last;
    int tiny, left;
} Pattern;

static void begin_pattern(Pattern *p) {
    p->kind = one_of(7);
    p->left = 1 + one_of(MOST_REGULAR);
    p->tiny = one_of(4);
    double ratio = happens(0.5) ? uniform(1.05, 2.5) : by_decades(2.0, 40.0);
    p->ratio = p->kind == 1 ? ratio : 1.0 / ratio;
    if (p->kind == 0)
        p->last = p->usual = by_decades(1e-4, 2e-2);
}

static double next_length(Pattern *p, int i) {
    switch (p->kind) {
    case 1:
    case 2: return fmax(SHORTEST, fmin(LONGEST, p->last * p->ratio));
    case 3: return p->usual * by_decades(1e-2, 10.0);
    case 4: return i % 2 ? p->usual : p->usual * by_decades(1e-5, 1.0);
    case 5:
        return p->tiny == 0   ? 1e-9
               : p->tiny == 1 ? 1e-7
               : p->tiny == 2 ? 1e-6
                              : by_decades(1e-9, 1e-5);
    case 6: return i % (3 + p->tiny) ? p->usual : 0.05 * p->usual;
    default: return p->usual;
    }
}

static void play(History *history) {
    static const double FAR[] = {0.0, 1.0, 100.0, 408.0, 4080.0, 1e5, -1e6};
    double speed = happens(0.5) ? PLANTING_SPEED : either_way(by_decades(0.01, GREATEST_SPEED));
    double time = happens(0.3) ? by_decades(1.0, 1e5) : 0.0;
    Piece piece = {
        .begin = time, .phi = FAR[one_of(7)] + uniform(-4.0, 4.0), .w = happens(0.2) ? 0.0 : speed};
    Pattern pattern = {.usual = by_decades(1e-4, 2e-2), .left = 1 + one_of(12)};
    pattern.last = pattern.usual;
    history->regular = 5 + one_of(120);
    history->count = history->regular + TAIL;
    double before = 0.0;
    for (int i = 0; i < history->count; ++i) {
        if (i == history->regular)
            pattern = (Pattern){.usual = by_decades(2e-4, 2e-2), .left = TAIL + 1};
        else if (--pattern.left <= 0)
            begin_pattern(&pattern);
        Step *step = &history->step[i];
        *step = (Step){.time = time};
        bool something = i == 0 || (i < history->regular && happens(0.08));
        if (something && i > 0)
            step->jump = befall(&piece, time, speed);
        else if (fabs(motion_of(&piece, time).w) > GREATEST_SPEED) { /* slows down at once */
            piece = (Piece){.begin = time, .phi = motion_of(&piece, time).phi, .w = speed};
            something = true;
        }
        double h = next_length(&pattern, i);
        pattern.last = h;
        if (piece.swing != 0.0)
            h = fmin(h, 0.7 / piece.beat);
        double fast = greatest_speed(&piece, time, h);
        if (fast * h > 1.5)
            h = 1.5 / fast;
        step->length = h;
        step->at = motion_of(&piece, time);
        step->end = motion_of(&piece, time + h);
        for (int k = 0; k < 8; ++k)
            step->goes += fabs(motion_of(&piece, time + h * (k + 1) / 8.0).phi
                               - motion_of(&piece, time + h * k / 8.0).phi);
        fast = greatest_speed(&piece, time, h);
        if (something)
            step->goes_on = (fast + before) * h;
        before = fast;
        time += h;
    }
}

/* ---- the host -----------------------------------------------------------------------------------
 */

static void demand(ComponentStatus status, const Component *c) {
    if (status == COMPONENT_OK)
        return;
    fprintf(stderr, "%s\n", c->message);
    exit(2);
}

static void set(Component *c, uint32_t reference, double value) {
    demand(component_set_real(c, &reference, 1, &value), c);
}

static double wrapped(double phi, int wrap) {
    if (wrap == 1)
        return phi - TURN * floor(phi / TURN);
    return wrap == 2 ? remainder(phi, TURN) : phi;
}

/* Gives a step what belongs to `now`; returns by how much the angle given is off. */
static double give(Component *c, Given given, CrankMotion now, int wrap, double grain,
                   bool is_wrong) {
    double error = 0.0, w = now.w;
    if (given == NOISY_ANGLE)
        error = uniform(-grain, grain);
    if (given == COARSE_ANGLE)
        error = grain * floor(now.phi / grain) - now.phi;
    if (given == NOISY_SPEED)
        w *= 1.0 + uniform(-NOISE, NOISE);
    if (given == SPEED_FALLS_TO_0 && is_wrong)
        w = 0.0;
    if (given == SPEED_IN_RPM)
        w *= 30.0 / PI;
    bool has_speed = given == SPEED || given == ACCELERATION || given >= NOISY_SPEED;
    set(c, VARIABLE_CRANK_PHI, wrapped(now.phi + error, wrap));
    set(c, VARIABLE_CRANK_W, has_speed ? w : 0.0);
    set(c, VARIABLE_CRANK_A, given == ACCELERATION ? now.a : 0.0);
    if (given == ONE_DERIVATIVE || given == TWO_DERIVATIVES) {
        uint32_t of[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_PHI};
        int32_t order[] = {1, 2};
        double value[] = {now.w, now.a};
        demand(
            component_set_input_derivatives(c, of, given == ONE_DERIVATIVE ? 1 : 2, order, value),
            c);
    }
    return error;
}

/* How many times what holding misses by the worst position of the history is off. */
static double worst_times_holding(Component *c, const History *history, Given given,
                                  double smoothing, bool at_step_end) {
    int wrap = one_of(4), wrong = one_of(history->regular), right = wrong + one_of(60);
    double grain = given == COARSE_ANGLE ? by_decades(1e-3, 0.05) : by_decades(1e-6, 0.01);
    if (right > history->regular - 8)
        right = history->regular - 8;
    component_reset(c, KIND_CO_SIMULATION);
    demand(component_set_experiment(c, history->step[0].time, false, 0.0), c);
    c->settings.mode = MODE_INITIALIZATION;
    set(c, VARIABLE_CRANK_SMOOTHING, smoothing);
    component_set_boolean(c, VARIABLE_CRANK_AT_STEP_END, at_step_end);
    set(c, VARIABLE_CRANK_PHI, wrapped(history->step[0].at.phi, wrap));
    demand(component_exit_initialization(c, MODE_STEP), c);
    double off = 0.0, held = 0.0, goes_on = 0.0, error = 0.0, least = 0.0;
    Given changing = ANGLE;
    for (int i = 0; i < history->count; ++i) {
        const Step *step = &history->step[i];
        if (given == CHANGING && i < history->regular - 8 && happens(0.1))
            changing = (Given)one_of(CHANGING);
        double before = error;
        error = give(c, given == CHANGING ? changing : given, at_step_end ? step->end : step->at,
                     wrap, grain, i >= wrong && i < right);
        demand(component_do_step(c, step->time, step->length), c);
        double found = component_present(c)->crank.end.phi;
        off = fmax(off, fabs(remainder(found - step->end.phi, TURN)));
        double given_phi = step->at.phi + error;
        held = fmax(held, fmax(step->goes, fabs(step->end.phi - given_phi)));
        held = fmax(held, fabs(step->jump + error - before));
        goes_on = fmax(goes_on, step->goes_on);
        least = fmax(least, 1e-6 + 1e-14 * fabs(step->end.phi)); /* below, all is well */
    }
    return fmax(0.0, off - goes_on) / (held + least);
}

int main(int count, char **argument) {
    static Component component;
    static History history;
    if (count != 6) {
        fputs("usage: histories WHAT SMOOTHING AT_STEP_END FIRST COUNT\n", stderr);
        return 2;
    }
    Given given = (Given)atoi(argument[1]);
    double smoothing = atof(argument[2]), worst = 0.0;
    bool at_step_end = atoi(argument[3]) != 0;
    long first = atol(argument[4]), histories = atol(argument[5]), worst_one = first, over = 0;
    for (long n = first; n < first + histories; ++n) {
        seed = (uint64_t)n * 64 + (uint64_t)given;
        play(&history);
        double found = worst_times_holding(&component, &history, given, smoothing, at_step_end);
        over += found > MOST;
        if (!(found <= worst)) {
            worst = found;
            worst_one = n;
        }
    }
    printf("%.3f %ld %ld\n", worst, worst_one, over);
    return 0;
}
