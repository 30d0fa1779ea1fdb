#include "travel.h"

/* sum + sum_low += distance, keeping what rounding would lose (Knuth's two-sum). */
static void add(Travel *travel, double distance) {
    double total = travel->sum + distance;
    double from_distance = total - travel->sum;
    double lost = (travel->sum - (total - from_distance)) + (distance - from_distance);
    travel->sum_low += lost;
    travel->sum = total;
}

void travel_start(Travel *travel, double s, double v) {
    *travel = (Travel){.end = {s, v, 0.0, 0.0}, .sum = s};
}

void travel_advance(Travel *travel, const SampleTimes *times, const Signal *v, bool at_step_end,
                    double h) {
    if (travel->v.count > 0)
        add(travel, travel->ahead_is_known ? travel->ahead
                                           : 0.5 * (travel->v.newest + v->value) * times->gap[0]);
    samples_add(&travel->v, times, v->value, v->value - travel->v.newest, 1);

    double slope = travel->v.difference[0], curvature = 0.0;
    if (v->derivatives > 0) {
        slope = v->derivative[0];
        curvature = v->derivative[1];
    }
    double beyond = at_step_end ? 0.0 : h;
    travel->ahead = beyond * (v->value + beyond * (0.5 * slope + beyond * (curvature / 6.0)));
    travel->ahead_is_known = !at_step_end && v->derivatives > 0;
    travel->end = (MachineMotion){
        travel->sum + (travel->sum_low + travel->ahead),
        v->value + beyond * (slope + beyond * (0.5 * curvature)),
        slope + beyond * curvature,
        curvature,
    };
}
