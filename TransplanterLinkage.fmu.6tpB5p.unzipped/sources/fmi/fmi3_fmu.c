/* The FMI 3.0 binary. */
#include "one_file.h"

#include "fmi3.c"
