#include "travel.h"

void travel_start(Travel *travel, double s, double v) {
    *travel = (Travel){.end = {s, v, 0.0, 0.0}, .v = v, .sum = s};
}

void travel_advance(const Travel *before, const SampleTimes *times, double v,
                    const InputDerivatives *derivatives, bool at_step_end, double h,
                    Travel *restrict after) {
    static const double SIXTH = 1.0 / 6.0;
    double distance = 0.0, slope = 0.0, curvature = 0.0;
    if (before->has_sample) {
        distance = before->ahead_is_known ? before->ahead
                                          : 0.5 * (before->v + v) * times->gap[0];
        slope = (v - before->v) * times->per_span[0];
    }
    /* the sum, and what its rounding would lose (Knuth's two-sum) */
    double sum = before->sum + distance;
    double from_distance = sum - before->sum;
    double lost = (before->sum - (sum - from_distance)) + (distance - from_distance);
    double sum_low = before->sum_low + lost;

    bool is_known = derivatives->order > 0;
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
        .has_sample = 1,
        .sum = sum,
        .sum_low = sum_low,
        .ahead = ahead,
        .ahead_is_known = is_known && !at_step_end,
    };
}
