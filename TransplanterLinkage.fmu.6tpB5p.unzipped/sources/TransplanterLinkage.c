/* TransplanterLinkage: compile this file, which includes all the others, with any C99 compiler and the
 * headers of FMI 3.0 on its path; link the C mathematics library where it is one of its own. */

/* Products and sums are rounded one by one, so that every platform computes the same (gcc: -std=c99). */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

/* Linked with others into one program, the functions carry the model's name; in a shared library, which the
 * importer tells by FMI3_OVERRIDE_FUNCTION_PREFIX, they do not. */
#if !defined(FMI3_OVERRIDE_FUNCTION_PREFIX) && !defined(FMI3_FUNCTION_PREFIX)
#define FMI3_FUNCTION_PREFIX TransplanterLinkage_
#endif

#include "fmi/fmi3_fmu.c"
