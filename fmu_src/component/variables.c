#include "variables.h"

#include "message.h"

#include <math.h>

bool component_accepts(uint32_t reference, double value) {
    const InterfaceVariable *variable = &interface_variables[reference];
    return value >= variable->least && value <= variable->greatest
           && (value == 0.0 || fabs(value) >= variable->smallest);
}

ComponentStatus refuse_reference(Component *c, uint32_t reference, const char *demand) {
    if (!variable_is_known(reference))
        message_write(c->message, sizeof c->message,
                      "value reference %u: unknown, the last one is %u", reference,
                      (unsigned)INTERFACE_COUNT);
    else
        message_write(c->message, sizeof c->message, "%s (value reference %u): %s",
                      interface_variables[reference].name, reference, demand);
    return COMPONENT_ERROR;
}

ComponentStatus refuse_value(Component *c, uint32_t reference, double value) {
    const InterfaceVariable *variable = &interface_variables[reference];
    bool has_gap = variable->smallest > 0.0;
    message_write(c->message, sizeof c->message, "%s = %g: must be %sa finite number from %g to %g",
                  variable->name, value, has_gap ? "0 or " : "",
                  has_gap ? variable->smallest : variable->least, variable->greatest);
    return COMPONENT_ERROR;
}

ComponentStatus refuse_order(Component *c, uint32_t reference, int32_t order) {
    message_write(c->message, sizeof c->message, "%s: derivative of order %g; orders 1 and 2 exist",
                  interface_variables[reference].name, (double)order);
    return COMPONENT_ERROR;
}
