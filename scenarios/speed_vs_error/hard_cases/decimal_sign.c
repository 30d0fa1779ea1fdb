/* A host in a country of another decimal sign, without that country's locale installed: this
 * program's snprintf and strtod, which stand before those of libc, write and read the sign given.
 * Prints the message of a step that the FMU refuses.
 *
 *   decimal_sign LIBRARY GUID SIGN */
#define _GNU_SOURCE
#include "scenarios/common/loader.h"

#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *sign = ".";

/* Copies a text, one sign for the other. */
static void exchange(const char *from, const char *old, const char *new, char *to, size_t size) {
    size_t length = 0;
    while (*from != '\0' && length + strlen(new) < size) {
        int is_sign = strncmp(from, old, strlen(old)) == 0;
        const char *piece = is_sign ? new : from;
        size_t count = is_sign ? strlen(new) : 1;
        memcpy(to + length, piece, count);
        length += count;
        from += is_sign ? strlen(old) : 1;
    }
    to[length] = '\0';
}

/* By these names to the linker, so that the FMU finds them before libc's. */
int print_with_sign(char *text, size_t size, const char *format, ...) __asm__("snprintf");
double read_with_sign(const char *text, char **end) __asm__("strtod");

int print_with_sign(char *text, size_t size, const char *format, ...) {
    char with_point[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(with_point, sizeof with_point, format, arguments);
    va_end(arguments);
    exchange(with_point, ".", sign, text, size);
    return (int)strlen(text);
}

double read_with_sign(const char *text, char **end) {
    double (*original)(const char *, char **);
    *(void **)&original = dlsym(RTLD_NEXT, "strtod");
    char with_point[512];
    if (end != NULL)
        *end = NULL; /* nobody here asks where the number ends */
    /* a point is no sign here: the number ends before it */
    size_t length = strcmp(sign, ".") == 0 ? strlen(text) : strcspn(text, ".");
    char until_point[512];
    memcpy(until_point, text, length);
    until_point[length] = '\0';
    exchange(until_point, sign, ".", with_point, sizeof with_point);
    return original(with_point, NULL);
}

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String message, ...) {
    (void)environment;
    (void)name;
    (void)status;
    (void)category;
    va_list arguments;
    va_start(arguments, message);
    vprintf(message, arguments);
    va_end(arguments);
    putchar('\n');
}

int main(int count, char **arguments) {
    if (count != 4)
        return 2;
    sign = arguments[3];
    void *library = open_library(arguments[1]);
    FIND(library, fmi2Instantiate);
    FIND(library, fmi2SetupExperiment);
    fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2Component c = fmi2Instantiate_("decimal_sign", fmi2CoSimulation, arguments[2], "",
                                       &callbacks, fmi2False, fmi2False);
    return c != NULL && fmi2SetupExperiment_(c, fmi2False, 0.0, 12.625, fmi2True, 0.1) == fmi2Error
               ? 0
               : 1;
}
