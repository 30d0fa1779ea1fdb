/* The FMI 2.0 binary as one file: the compiler sees all of it at once, inlines across the rooms,
 * and only the functions of the standard are left outside. A step is a tenth faster for it. */
#define INTERNAL static

#include "../linkage/linkage.c"

#include "../component/message.c"

#include "../component/interface.c"

#include "../component/crank.c"

#include "../component/travel.c"

#include "../component/outputs.c"

#include "../component/component.c"

#include "../component/serialize.c"

#include "fmi2.c"
