"""The interface table as C: fmu_src/component/interface.h and interface.c."""

from __future__ import annotations

from collections.abc import Iterable

from ..interface import Interface, Variable

BANNER = "/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */\n"

ACCESS = {"independent": "READ_ONLY", "input": "INPUT", "output": "READ_ONLY", "parameter": "BEFORE_START"}


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
    EVALUATION_NONE = 0
}};

typedef enum {{
    ACCESS_READ_ONLY,
    ACCESS_INPUT,       /* may be set at any time */
    ACCESS_BEFORE_START /* may be set until the end of initialization */
}} InterfaceAccess;

typedef struct {{
    const char *name;
    double start;
    uint8_t is_boolean;
    uint8_t access;     /* InterfaceAccess */
    uint8_t is_output;
    uint8_t evaluation; /* EVALUATION_ of an output */
}} InterfaceVariable;

/* By value reference; number 0 is no variable. */
extern const InterfaceVariable interface_variables[INTERFACE_COUNT + 1];

#endif
"""


def source(interface: Interface) -> str:
    """interface.c: the table of variables."""
    return f"""{BANNER}#include "interface.h"

const InterfaceVariable interface_variables[INTERFACE_COUNT + 1] = {{
    {{"(no variable)", 0.0, 0, ACCESS_READ_ONLY, 0, EVALUATION_NONE}},
{_lines(_row(v) for v in interface.variables)}
}};
"""


def _row(v: Variable) -> str:
    start = repr(float(v.start or 0.0))
    access = "BEFORE_START" if v.kind == "output" and v.start is not None else ACCESS[v.kind]
    evaluation = (v.computed_by or "none").upper()
    return (
        f'    {{"{v.name}", {start}, {int(v.type == "boolean")}, ACCESS_{access}, '
        f"{int(v.kind == 'output')}, EVALUATION_{evaluation}}},"
    )


def _evaluations(interface: Interface) -> list[str]:
    return list(dict.fromkeys(v.computed_by for v in interface.of_kind("output")))


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines)
