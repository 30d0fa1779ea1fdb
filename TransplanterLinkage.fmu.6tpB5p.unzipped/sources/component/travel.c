#include "travel.h"

#include <math.h>

void travel_start(Travel *travel, MachineMotion now) {
    *travel = (Travel){.end = now, .v = now.v, .sum = now.s};
}

void travel_advance(const Travel *before, double gap, double v, const InputDerivatives *derivatives,
                    bool at_step_end, double h, Travel *restrict after) {
    static const double SIXTH = 1.0 / 6.0;
    bool is_known = derivatives_order(derivatives) > 0;
    if (v == 0.0 && before->stands_still && !is_known) {
        *after = *before; /* also where no speed is connected: a scene pays for what it needs */
        return;
    }
    double distance = 0.0, to_sample = 0.0;
    if (before->samples > 0) {
        distance = before->ahead_is_known ? before->ahead : 0.5 * (before->v + v) * gap;
        to_sample = v == before->v ? 0.0 : (v - before->v) / gap;
    }
    double slope = to_sample, curvature = 0.0;
    if (before->samples > 1)
        slope = smaller_slope(to_sample, before->slope);
    else if (samples_are_close(gap, h))
        slope = 0.0;
    /* the sum, and what its rounding would lose (Knuth's two-sum) */
    double sum = before->sum + distance;
    double from_distance = sum - before->sum;
    double lost = (before->sum - (sum - from_distance)) + (distance - from_distance);
    double sum_low = before->sum_low + lost;

    if (is_known) {
        slope = derivatives->value[0];
        curvature = derivatives->value[1];
    }
    double beyond = at_step_end ? 0.0 : h;
    double ahead = beyond * (v + beyond * (0.5 * slope + beyond * (SIXTH * curvature)));
    *after = (Travel){
        .end = {sum + (sum_low + ahead), v + beyond * (slope + beyond * (0.5 * curvature)),
                slope + beyond * curvature, curvature},
        .v = v,
        .slope = to_sample,
        .samples = before->samples > 0 ? 2 : 1,
        .stands_still =
            !is_known && before->samples > 0 && v == 0.0 && slope == 0.0 && to_sample == 0.0,
        .sum = sum,
        .sum_low = sum_low,
        .ahead = ahead,
        .ahead_is_known = is_known && !at_step_end,
    };
}
