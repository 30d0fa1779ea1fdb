#include "travel.h"

/* sum + sum_low += distance, keeping what rounding would lose (Knuth's two-sum). */
static void add(Travel *travel, double distance) {
    double total = travel->sum + distance;
    double from_distance = total - travel->sum;
    double lost = (travel->sum - (total - from_distance)) + (distance - from_distance);
    travel->sum_low += lost;
    travel->sum = total;
}

void travel_start(Travel *travel, double s, double v, bool is_sample) {
    *travel = (Travel){.end = {s, v, 0.0, 0.0}, .v = v, .has_sample = is_sample, .sum = s};
}

void travel_advance(Travel *travel, const SampleTimes *times, double v,
                    const InputDerivatives *derivatives, bool at_step_end, double h) {
    static const double SIXTH = 1.0 / 6.0;
    double slope = 0.0, curvature = 0.0;
    if (travel->has_sample) {
        double since = 0.5 * (travel->v + v) * times->gap[0];
        add(travel, travel->ahead_is_known ? travel->ahead : since);
        slope = (v - travel->v) * times->per_span[0];
    }
    travel->v = v;
    travel->has_sample = 1;
    if (derivatives->order > 0) {
        slope = derivatives->value[0];
        curvature = derivatives->value[1];
    }
    double beyond = at_step_end ? 0.0 : h;
    travel->ahead = beyond * (v + beyond * (0.5 * slope + beyond * (SIXTH * curvature)));
    travel->ahead_is_known = !at_step_end && derivatives->order > 0;
    travel->end = (MachineMotion){
        travel->sum + (travel->sum_low + travel->ahead),
        v + beyond * (slope + beyond * (0.5 * curvature)),
        slope + beyond * curvature,
        curvature,
    };
}
