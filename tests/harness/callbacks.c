/* The logger that a host in Python cannot write itself: FMI's takes a variable number of
 * arguments. It formats each message and hands it to the function that the component environment
 * points to. */
#include "fmi2FunctionTypes.h"

#include <stdarg.h>
#include <stdio.h>

typedef void Receiver(fmi2String instance, fmi2Status status, fmi2String category,
                      fmi2String message);

__attribute__((visibility("default"))) void log_to_receiver(fmi2ComponentEnvironment environment,
                                                            fmi2String instance, fmi2Status status,
                                                            fmi2String category, fmi2String message,
                                                            ...);

void log_to_receiver(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                     fmi2String category, fmi2String message, ...) {
    Receiver **receiver = environment;
    char text[4096];
    va_list arguments;
    va_start(arguments, message);
    vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
    (*receiver)(instance, status, category, text);
}
