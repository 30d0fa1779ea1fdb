/* A polynomial fitted to all samples of a signal, the older the lighter: what the samples of a
 * noisy signal are continued with. Weighted least squares, carried on from sample to sample in
 * constant time and memory; steps may vary. While there are no more samples than coefficients, or
 * where the window is shorter than the steps, it is the polynomial through the samples.
 *
 * Times here count in units of the samples' time constant. Plain data: 8-byte members only. */
#ifndef FIT_H
#define FIT_H

#include "samples.h"

enum { FIT_MAX_DEGREE = 3 };

/* At the newest sample. */
typedef struct {
    double coefficient[FIT_MAX_DEGREE + 1]; /* of the powers of time; the first lies relative to
                                             * the newest sample, so that turns cost no digits */
    double moment[2 * FIT_MAX_DEGREE + 1];  /* sums of weight times powers of time */
    int64_t count;                          /* of samples, at most degree + 2 */
    int64_t useless; /* of the last samples: those that holding the signal would have met as well */
    double noise; /* by how much the others lay off what the fit expected, of late */
    double missed, moved; /* by how much the last few samples lay off, and how far they moved */
    double met; /* the longest time over which it met a sample, since one that spoke against it */
    double slope; /* of the signal over that time, its magnitude */
} Fit;

/* A sample is no noise where it lies this many times farther off than others did of late, and the
 * fit useless where it is off by this share of the sample's change; twice in a row, and it begins
 * anew. */
static const double FIT_OUTLIER = 8.0, FIT_USELESS = 0.5;
enum { FIT_MOST_USELESS = 2 };
/* Nor is a fit to this many samples and more, of which the last few lie so much farther off than
 * they move: whiteness of noise alone makes it 0.7 to 1. */
static const double FIT_MANY = 10.0, FIT_WORSE = 1.5, FIT_FEW = 1.0 / 4.0;
/* It met one that is off by less than this share of its change, and is believed for that time,
 * somewhat longer, and a slope so many times as steep. */
static const double FIT_MET = 0.1, FIT_LONGEST = 1.25, FIT_STEEPEST = 2.0;
static const double FIT_LEARNING = 1.0 / 16.0; /* of the noise, from one sample */

/* What remains of the weight of a sample after `time`: e^-time to third order, in arithmetic that
 * is the same everywhere. Steps beyond the window would leave one sample alone: a sixteenth keeps
 * the polynomial through the last ones. */
static inline double fit_fade(double time) {
    double root = 1.0 + 0.25 * time;
    double fade = 1.0 / (root * root * (root * root));
    return fade > 0.0625 ? fade : 0.0625;
}

/* The first column of the inverse of the n x n matrix of moments, moment[row + column]: what one
 * more sample, off by 1, changes the coefficients by. Cholesky's method without roots. Where
 * samples lie so close together that rounding ate a pivot, the higher coefficients stay. */
static inline void fit_gain(const double moment[], int n, double gain[]) {
    double lower[FIT_MAX_DEGREE + 1][FIT_MAX_DEGREE + 1], pivot[FIT_MAX_DEGREE + 1];
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j <= i; ++j) {
            double rest = moment[i + j];
            for (int k = 0; k < j; ++k)
                rest -= lower[i][k] * lower[j][k] * pivot[k];
            if (j < i)
                lower[i][j] = rest / pivot[j];
            else
                pivot[i] = rest;
        }
        if (!(pivot[i] > 1e-13 * moment[2 * i]))
            n = i;
    }
    for (int i = 0; i < n; ++i) {
        gain[i] = i == 0 ? 1.0 : 0.0;
        for (int k = 0; k < i; ++k)
            gain[i] -= lower[i][k] * gain[k];
    }
    for (int i = n - 1; i >= 0; --i) {
        gain[i] /= pivot[i];
        for (int k = i + 1; k < n; ++k)
            gain[i] -= lower[k][i] * gain[k];
    }
}

/* A flat signal at its newest sample: `before` without its slopes, or nothing. */
static inline void fit_restart(Fit *fit, bool was_flat) {
    static const Fit nothing;
    if (!was_flat)
        *fit = nothing;
    fit->met = 0.0;
    for (int i = 0; i <= FIT_MAX_DEGREE; ++i)
        fit->coefficient[i] = 0.0;
}

/* Whether it says anything of what lies `ahead`: no farther than MOST_GROWTH times what its samples
 * span. */
static inline bool fit_reaches(const Fit *fit, double ahead) {
    return ahead * ahead * fit->moment[0] <= MOST_GROWTH * MOST_GROWTH * fit->moment[2];
}

/* Whether the fit, which now has been tried on a sample, is to be believed for the next `ahead`. */
static inline bool fit_is_proven(const Fit *fit, double ahead, int degree) {
    return fit->count > degree + 1 && fit->useless == 0 && fit_reaches(fit, ahead);
}

/* Where it ends `ahead`, above the newest sample. */
static inline double fit_change(const Fit *fit, double ahead) {
    const double *c = fit->coefficient;
    return c[0] + ahead * (c[1] + ahead * (c[2] + ahead * c[3]));
}

/* What a sample tells of the fit that expected it `off`. Of noise, the second useless one tells the
 * most that its change shows: little after a jump. */
static inline void fit_try(Fit *fit, double gap, double off, double change) {
    bool is_useless = off > FIT_OUTLIER * fit->noise && off > FIT_USELESS * change;
    fit->useless = is_useless ? fit->useless + 1 : 0;
    if (is_useless)
        fit->met = 0.0;
    else if (off < FIT_MET * change && gap >= fit->met) {
        fit->met = gap;
        fit->slope = change / gap;
    }
    if (fit->useless != 1)
        fit->noise += FIT_LEARNING * (fmin(off, is_useless ? change : off) - fit->noise);
    fit->missed += FIT_FEW * (off - fit->missed);
    fit->moved += FIT_FEW * (change - fit->moved);
}

/* Whether holding the signal would do better. */
static inline bool fit_is_worse(const Fit *fit) {
    return fit->useless >= FIT_MOST_USELESS
           || (fit->moment[0] > FIT_MANY && fit->missed > FIT_WORSE * fit->moved);
}

/* Adds a sample `gap` after the newest one and `change` above it. */
static inline void fit_add(Fit *fit, double gap, double change, int degree) {
    double *c = fit->coefficient, *m = fit->moment;
    int count = fit->count <= degree ? (int)fit->count + 1 : degree + 1;
    if (fit->count > 0) {
        /* seen from the new sample's time: the polynomial by Horner's rule, the moments likewise */
        for (int i = 0; i < degree; ++i)
            for (int j = degree - 1; j >= i; --j)
                c[j] += gap * c[j + 1];
        c[0] -= change;
        if (!fit_reaches(fit, gap)) {
            fit->count = count - 1; /* what it expects here is no test of it */
        } else if (fit->count > degree) {
            fit_try(fit, gap, fabs(c[0]), fabs(change));
            if (fit_is_worse(fit)) {
                *fit = (Fit){.moment = {1.0}, .count = 1, .noise = fit->noise};
                return;
            }
        }
        for (int i = 1; i <= 2 * degree; ++i)
            for (int j = 2 * degree; j >= i; --j)
                m[j] -= gap * m[j - 1];
        double fade = fit_fade(gap);
        for (int i = 0; i <= 2 * degree; ++i)
            m[i] *= fade;
    }
    m[0] += 1.0;
    double gain[FIT_MAX_DEGREE + 1] = {0.0};
    fit_gain(m, count, gain);
    double off = -c[0];
    for (int i = 0; i < count; ++i)
        c[i] += gain[i] * off;
    fit->count += fit->count <= degree + 1;
}

#endif
