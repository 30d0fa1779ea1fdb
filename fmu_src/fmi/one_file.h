/* A binary as one file: the compiler sees all of it at once, inlines across the rooms, and only the
 * functions of the standard are left outside. A step is a tenth faster for it. */
#if defined(__GNUC__)
#define INTERNAL static __attribute__((unused)) /* a version of FMI need not use them all */
#else
#define INTERNAL static
#endif
#define INTERNAL_TABLE static

#include "../linkage/linkage.c"

#include "../linkage/mass.c"

#include "../linkage/sensitivity.c"

#include "../linkage/forces.c"

#include "../component/message.c"

#include "../component/interface.c"

#include "../component/crank.c"

#include "../component/travel.c"

#include "../component/motion.c"

#include "../component/variables.c"

#include "../component/pose.c"

#include "../component/inputs.c"

#include "../component/factors.c"

#include "../component/locals.c"

#include "../component/outputs.c"

#include "../component/derivatives.c"

#include "../component/step.c"

#include "../component/state.c"

#include "../component/component.c"
