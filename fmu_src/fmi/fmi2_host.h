/* FMI 2.0's terms, for adaptor.h: what the host gives with an instance, and how it is used. */
#ifndef FMI2_HOST_H
#define FMI2_HOST_H

#include "fmi2Functions.h"

#include <stdlib.h>

typedef struct {
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
} Host;

static inline void *host_allocate(const Host *host, size_t size) { return host->allocate(1, size); }

static inline void host_release(const Host *host, void *memory) { host->release(memory); }

/* The message is a format. */
static inline void host_log(const Host *host, const char *name, fmi2Status status,
                            const char *category, const char *message) {
    if (host->logger != NULL)
        host->logger(host->environment, name, status, category, message);
}

#define FMI(name) fmi2##name
#define TOKEN_NAME "GUID"
#define MESSAGE_ESCAPE '%'
#define CATEGORIES_ADD_UP false

#endif
