/* What a page cannot give in JavaScript: the logger of FMI is a C function. This one hands each
 * message on to the page, which gives `page_log` when it instantiates the module. The FMU itself is
 * compiled beside it, unchanged. */
#include "fmi3FunctionTypes.h"

void page_log(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String message);
/* NOLINTNEXTLINE(misc-use-internal-linkage): the page calls it */
fmi3LogMessageCallback page_logger(void);

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message) {
    (void)category; /* the status says as much */
    page_log(environment, status, message);
}

fmi3LogMessageCallback page_logger(void) { return log_message; }
