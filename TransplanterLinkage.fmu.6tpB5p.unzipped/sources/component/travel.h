/* The machine's travel: the integral of its speed, from one sample a step.
 *
 * Between samples the speed is taken as the line through them (trapezoidal rule); beyond the
 * newest it continues with the host's input derivatives or, without them, with the smaller of the
 * last two slopes (0 where they differ in sign, so that a jump is not carried on; the first slope
 * counts alone), until the next sample says what it was. Error: order 2 in the step over any
 * distance. The sum is carried in two doubles: the rounding of a season of steps does not add up.
 */
#ifndef TRAVEL_H
#define TRAVEL_H

#include "samples.h"

#ifndef INTERNAL /* see linkage.h */
#define INTERNAL
#endif

#include <stdbool.h>

/* Distance in m and its derivatives by time. */
typedef struct {
    double s, v, a, jerk;
} MachineMotion;

/* Plain data: 8-byte members only. */
typedef struct {
    MachineMotion end;         /* the motion at the end of the last step */
    double v, slope;           /* the newest sample of the speed, and the slope that led to it */
    int64_t samples;           /* how many there were: 0, 1, or more (2) */
    int64_t stands_still;      /* as long as the speed stays 0, nothing changes */
    double sum, sum_low;       /* the distance up to the newest sample */
    double ahead;              /* what was added beyond it up to the end of the last step */
    int64_t ahead_is_known;    /* it came from input derivatives: keep it */
} Travel;

/* Here and at this speed; no sample yet. */
INTERNAL void travel_start(Travel *travel, MachineMotion now);

/* Takes the speed's sample of a step of h > 0 seconds, `gap` seconds after the last one if there
 * is one, and travels from before to its end. */
INTERNAL void travel_advance(const Travel *before, double gap, double v,
                             const InputDerivatives *derivatives, bool at_step_end, double h,
                             Travel *restrict after);

#endif
