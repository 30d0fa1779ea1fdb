/* The FMI 2.0 binary. */
#include "one_file.h"

#include "fmi2.c"
