/* An FMU's library loaded into a small C host, of any FMI version; for FMI 2.0 the functions that a
 * step needs, by name. All C hosts, of the scenarios and of the tests, load through this file.
 * POSIX and Windows. */
#ifndef LOADER_H
#define LOADER_H

#include "fmi2Functions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#endif

/* Ends the host where a thing that must hold does not. */
static inline void demand(int holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "%s\n", what);
        exit(1);
    }
}

static inline void *open_library(const char *path) {
#if defined(_WIN32)
    void *library = (void *)LoadLibraryA(path);
#else
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
#endif
    demand(library != NULL, "the library does not load");
    return library;
}

/* Finds a function and writes its address to the function pointer that `function` points to. */
static inline void load_function(void *library, const char *name, void *function) {
#if defined(_WIN32)
    FARPROC address = GetProcAddress((HMODULE)library, name);
#else
    void *address = dlsym(library, name);
#endif
    demand(address != NULL, name);
    memcpy(function, &address, sizeof address); /* ISO C has no cast to a function pointer */
}

/* Declares name_, a pointer to an FMI function of its own type, and finds it. */
#define FIND(library, name)                                                                        \
    name##TYPE *name##_;                                                                           \
    load_function(library, #name, &name##_)

/* ---- FMI 2.0 ---- */

typedef struct {
    fmi2InstantiateTYPE *create;
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

static inline Fmu load_fmu(const char *path) {
    Fmu fmu;
    void *library = fmu.library = open_library(path);
    load_function(library, "fmi2Instantiate", &fmu.create);
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
        fmu->create("host", fmi2CoSimulation, guid, "", &callbacks, fmi2False, fmi2False);
    demand(instance != NULL, "no instance");
    return instance;
}

#endif
