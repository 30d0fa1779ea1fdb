/* An FMU's library loaded into a small C host: the functions that a step needs. POSIX. */
#ifndef LOADER_H
#define LOADER_H

#include "fmi2Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    fmi2InstantiateTYPE *instantiate;
    fmi2SetupExperimentTYPE *setup;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2SetRealTYPE *set_real;
    fmi2GetRealTYPE *get_real;
    fmi2DoStepTYPE *do_step;
    fmi2ResetTYPE *reset;
    fmi2FreeInstanceTYPE *release;
    void *library; /* for what few hosts need */
} Fmu;

static void demand(int holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "%s\n", what);
        exit(1);
    }
}

static void load_function(void *library, const char *name, void *function) {
    void *address = dlsym(library, name);
    demand(address != NULL, name);
    /* ISO C has no cast from void * to a function pointer; POSIX says how to do without */
    *(void **)function = address;
}

static inline Fmu load_fmu(const char *path) {
    Fmu fmu;
    void *library = fmu.library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    demand(library != NULL, "the library does not load");
    load_function(library, "fmi2Instantiate", &fmu.instantiate);
    load_function(library, "fmi2SetupExperiment", &fmu.setup);
    load_function(library, "fmi2EnterInitializationMode", &fmu.enter);
    load_function(library, "fmi2ExitInitializationMode", &fmu.leave);
    load_function(library, "fmi2SetReal", &fmu.set_real);
    load_function(library, "fmi2GetReal", &fmu.get_real);
    load_function(library, "fmi2DoStep", &fmu.do_step);
    load_function(library, "fmi2Reset", &fmu.reset);
    load_function(library, "fmi2FreeInstance", &fmu.release);
    return fmu;
}

static inline void print_message(fmi2ComponentEnvironment environment, fmi2String name,
                                 fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)environment;
    (void)status;
    fprintf(stderr, "%s: %s: %s\n", name, category, message);
}

static inline fmi2Component new_instance(const Fmu *fmu, const char *guid) {
    static const fmi2CallbackFunctions callbacks = {print_message, calloc, free, NULL, NULL};
    fmi2Component instance =
        fmu->instantiate("host", fmi2CoSimulation, guid, "", &callbacks, fmi2False, fmi2False);
    demand(instance != NULL, "no instance");
    return instance;
}

#endif
