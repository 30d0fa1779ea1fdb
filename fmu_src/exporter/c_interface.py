"""The interface table as C: fmu_src/component/interface.h and interface.c."""

from __future__ import annotations

from collections.abc import Iterable

from ..interface import Interface, Variable

BANNER = "/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */\n"

ACCESS = {"independent": "READ_ONLY", "input": "INPUT", "output": "READ_ONLY", "parameter": "BEFORE_START"}
BOOLEAN_BIT = 0x80  # beside the EVALUATION_ bits


def header(interface: Interface) -> str:
    """interface.h: value references, kinds of access, what is computed together."""
    inputs = interface.of_kind("input")
    references = [v.value_reference for v in inputs]
    if references != list(range(references[0], references[0] + len(references))):
        raise ValueError("interface.toml: the inputs must stand together")
    return f"""{BANNER}#ifndef INTERFACE_H
#define INTERFACE_H

#include <stdint.h>

#define INTERFACE_MODEL_IDENTIFIER "{interface.model.name}"

/* Hash of the interface; modelDescription.xml carries the same. */
#define INTERFACE_TOKEN "{interface.token}"

/* Value references. */
enum {{
{_lines(f"    VARIABLE_{v.identifier.upper()} = {v.value_reference}," for v in interface.variables)}
    INTERFACE_COUNT = {len(interface.variables)},
    INTERFACE_FIRST_INPUT = {references[0]},
    INTERFACE_INPUT_COUNT = {len(inputs)}
}};

/* Outputs that are computed together: component_get_real computes what is read. */
enum {{
{_lines(f"    EVALUATION_{name.upper()} = {1 << bit}," for bit, name in enumerate(_evaluations(interface)))}
    EVALUATION_NONE = 0,
    EVALUATION_NOT_REAL = {BOOLEAN_BIT} /* in the same place: no real at all */
}};

/* When a variable may be set, as bits: until the end of initialization, and from then on. */
enum {{ ACCESS_READ_ONLY = 0, ACCESS_BEFORE_START = 1, ACCESS_LATER = 2, ACCESS_INPUT = 3 }};

typedef struct {{
    const char *name;
    double start;
    int is_output;
}} InterfaceVariable;

/* By value reference; number 0 is no variable. The last two are what every step looks up. */
extern const InterfaceVariable interface_variables[INTERFACE_COUNT + 1];
extern const uint8_t interface_evaluation[INTERFACE_COUNT + 1]; /* EVALUATION_ */
extern const uint8_t interface_access[INTERFACE_COUNT + 1];     /* ACCESS_ of reals, else 0 */
extern const uint8_t interface_boolean_access[INTERFACE_COUNT + 1]; /* of Booleans, else 0 */

#endif
"""


def source(interface: Interface) -> str:
    """interface.c: the table of variables."""
    return f"""{BANNER}#include "interface.h"

const InterfaceVariable interface_variables[INTERFACE_COUNT + 1] = {{
    {{"(no variable)", 0.0, 0}},
{_lines(f'    {{"{v.name}", {float(v.start or 0.0)!r}, {int(v.kind == "output")}}},' for v in interface.variables)}
}};

const uint8_t interface_evaluation[INTERFACE_COUNT + 1] = {{
    EVALUATION_NOT_REAL, /* (no variable) */
{_lines(f"    EVALUATION_{_evaluation(v)}, /* {v.name} */" for v in interface.variables)}
}};

const uint8_t interface_access[INTERFACE_COUNT + 1] = {{
    ACCESS_READ_ONLY, /* (no variable) */
{_lines(f"    ACCESS_{_access(v, 'real')}, /* {v.name} */" for v in interface.variables)}
}};

const uint8_t interface_boolean_access[INTERFACE_COUNT + 1] = {{
    ACCESS_READ_ONLY, /* (no variable) */
{_lines(f"    ACCESS_{_access(v, 'boolean')}, /* {v.name} */" for v in interface.variables)}
}};
"""


def _evaluation(v: Variable) -> str:
    return "NOT_REAL" if v.type == "boolean" else (v.computed_by or "none").upper()


def _access(v: Variable, type_: str) -> str:
    if v.type != type_:
        return "READ_ONLY"
    is_state = v.kind == "output" and v.start is not None
    return "BEFORE_START" if is_state else ACCESS[v.kind]


def _evaluations(interface: Interface) -> list[str]:
    return list(dict.fromkeys(v.computed_by for v in interface.of_kind("output")))


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines)
