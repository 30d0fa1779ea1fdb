/* FMI 3.0's terms, for adaptor.h: what the host gives with an instance, and how it is used. */
#ifndef FMI3_HOST_H
#define FMI3_HOST_H

#include "fmi3Functions.h"

#include <stdlib.h>

typedef struct {
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
    fmi3IntermediateUpdateCallback intermediate_update; /* NULL where the host wants none */
    bool can_return_early, has_event_mode;              /* the host allows it */
} Host;

static inline void *host_allocate(const Host *host, size_t size) {
    (void)host;
    return calloc(1, size);
}

static inline void host_release(const Host *host, void *memory) {
    (void)host;
    free(memory);
}

static inline void host_log(const Host *host, const char *name, fmi3Status status,
                            const char *category, const char *message) {
    (void)name;
    if (host->logger != NULL)
        host->logger(host->environment, status, category, message);
}

#define FMI(name) fmi3##name
#define TOKEN_NAME "instantiation token"
#define MESSAGE_ESCAPE '#'
#define CATEGORIES_ADD_UP true

#endif
