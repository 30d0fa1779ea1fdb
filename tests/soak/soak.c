/* A season of planting: one instance stepped many times, its travel and its tip held against the
 * closed form as it goes.
 *
 *   soak LIBRARY GUID STEPS
 *
 * Steps of 1 ms at 65 plants a minute and 400 mm; the host's time is i h, not a sum. Prints the
 * worst difference of machine.s in units in its last place, and of the tip in what one unit in
 * the last place of the crank's angle moves it. */
#include "component/interface.h"
#include "scenarios/common/loader.h"

#include <math.h>

enum { CHECKS = 1000 };
static const double H = 1e-3, SPEED = 6.8067840827778845, MACHINE_SPEED = 0.43333333333333335;

static double last_place(double value) { return nextafter(fabs(value), INFINITY) - fabs(value); }

int main(int count, char **arguments) {
    demand(count == 4, "usage: soak LIBRARY GUID STEPS");
    static const fmi2ValueReference in[] = {VARIABLE_CRANK_PHI, VARIABLE_CRANK_W,
                                            VARIABLE_MACHINE_V};
    static const fmi2ValueReference out[] = {VARIABLE_TIP_X, VARIABLE_TIP_Y, VARIABLE_MACHINE_S,
                                             VARIABLE_TIME};
    Fmu fmu = load_fmu(arguments[1]);
    fmi2Component stepped = new_instance(&fmu, arguments[2]);
    fmi2Component exact = new_instance(&fmu, arguments[2]); /* stays where outputs follow inputs */
    demand(fmu.setup(exact, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "setup");
    demand(fmu.enter(exact) == fmi2OK, "enter");
    demand(fmu.setup(stepped, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "setup");
    demand(fmu.enter(stepped) == fmi2OK && fmu.leave(stepped) == fmi2OK, "initialize");

    long steps = atol(arguments[3]), every = steps / CHECKS > 0 ? steps / CHECKS : 1;
    double worst_travel = 0.0, worst_tip = 0.0, worst_time = 0.0;
    for (long i = 0; i < steps; ++i) {
        double t = (double)i * H, input[] = {SPEED * t, SPEED, MACHINE_SPEED};
        demand(fmu.set_real(stepped, in, 3, input) == fmi2OK, "set");
        demand(fmu.do_step(stepped, t, H, fmi2True) == fmi2OK, "step");
        if ((i + 1) % every != 0)
            continue;
        double found[4], wanted[2], end = (double)(i + 1) * H, phi = SPEED * end;
        demand(fmu.get_real(stepped, out, 4, found) == fmi2OK, "get");
        demand(fmu.set_real(exact, in, 1, &phi) == fmi2OK, "set");
        demand(fmu.get_real(exact, out, 2, wanted) == fmi2OK, "get");
        double travel = MACHINE_SPEED * end;
        double reach = 0.3 * last_place(phi) + 1e-16; /* m; the tip moves 0.27 m a radian at most */
        worst_travel = fmax(worst_travel, fabs(found[2] - travel) / last_place(travel));
        worst_tip = fmax(worst_tip, hypot(found[0] - wanted[0], found[1] - wanted[1]) / reach);
        worst_time = fmax(worst_time, fabs(found[3] - end) / last_place(end));
    }
    printf("travel %.2f tip %.2f time %.2f\n", worst_travel, worst_tip, worst_time);
    fmu.release(stepped);
    fmu.release(exact);
    return 0;
}
