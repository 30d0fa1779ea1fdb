"""The interface table as C: fmu_src/component/interface.h and interface.c."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ..interface import Computed, Interface, InterfaceError, Parameter, Product, Unknown, Variable

BANNER = "/* Generated from fmu_src/interface.toml by `linkage-fmu generate`: edit that file, not this one. */\n"

NOT_REAL_BIT = 15  # above the EVALUATION_ bits


def header(interface: Interface) -> str:
    """interface.h: value references, kinds of access, what is computed together."""
    evaluations = _evaluations(interface.computed)
    if len(evaluations) > NOT_REAL_BIT:
        raise InterfaceError(f"interface.toml: more than {NOT_REAL_BIT} different group")
    return f"""{BANNER}#ifndef INTERFACE_H
#define INTERFACE_H

#include <stdint.h>

#ifndef INTERNAL /* see linkage.h */
#define INTERNAL
#endif
#ifndef INTERNAL_TABLE
#define INTERNAL_TABLE extern
#endif

#define INTERFACE_MODEL_IDENTIFIER "{interface.model.name}"

/* Hash of the interface; modelDescription.xml carries the same. */
#define INTERFACE_TOKEN "{interface.token}"

/* Names of the categories under which messages are logged. */
{"#define INTERFACE_LOG_CATEGORIES":<99}\\
    {", ".join(f'"{name}"' for name in interface.log_categories)}

/* Value references. */
enum {{
{_lines(f"    VARIABLE_{v.identifier.upper()} = {v.value_reference}," for v in interface.variables)}
    INTERFACE_COUNT = {len(interface.variables)},
    INTERFACE_INPUT_COUNT = {len(interface.of_kind("input"))},
    INTERFACE_SETTABLE_COUNT = {len(_settable(interface))}
}};

/* Outputs that are computed together: component_get_real computes what is read. */
enum {{
{_lines(f"    EVALUATION_{name.upper()} = {1 << bit}," for bit, name in enumerate(evaluations))}
    EVALUATION_NONE = 0,
    EVALUATION_NOT_REAL = 1 << {NOT_REAL_BIT} /* in the same place: no real at all */
}};

/* The outputs, and derivatives of states, that are computed together, and these groups:
 * OUTPUT(name), GROUP(name). */
{_lines(_group(interface, name) for name in _evaluations(interface.unknowns))}
{_groups("OUTPUT", interface.unknowns)}
{_groups("LOCAL", interface.of_kind("local"))}

/* Their equations: sums of PRODUCT(coefficient, factor of the pose, how often it is differentiated by
 * phi, factor of the motion), and, where masses are in it, MASS(the same). */
{_lines(_equation(v) for v in interface.unknowns)}

/* Inputs and parameters are within +- this, so that no output can overflow. */
#define INTERFACE_GREATEST_VALUE {interface.model.greatest_value!r}

/* When a variable may be set, as bits: until the end of initialization, from then on, and from then
 * on where the host integrates the continuous states (Model Exchange). */
enum {{
    ACCESS_READ_ONLY = 0,
    ACCESS_REAL_BEFORE_START = 1,
    ACCESS_REAL_LATER = 2,
    ACCESS_BOOLEAN_BEFORE_START = 4,
    ACCESS_BOOLEAN_LATER = 8,
    ACCESS_STATE_LATER = 16
}};

typedef struct {{
    const char *name;
    double start;
    double least, greatest; /* what it may be set to */
    double smallest;        /* the least magnitude of a value but 0 */
    int input; /* the number of an input among the inputs, else -1 */
    int is_output;
}} InterfaceVariable;

/* By value reference; number 0 is no variable. The last two are what every step looks up. */
INTERNAL_TABLE const InterfaceVariable interface_variables[INTERFACE_COUNT + 1];
INTERNAL_TABLE const uint16_t interface_evaluation[INTERFACE_COUNT + 1]; /* EVALUATION_ */
INTERNAL_TABLE const uint8_t interface_access[INTERFACE_COUNT + 1]; /* ACCESS_ */

/* The value references of what is set, by the host or by its steps, and not computed. */
INTERNAL_TABLE const uint8_t interface_settable[INTERFACE_SETTABLE_COUNT];

#endif
"""


def source(interface: Interface) -> str:
    """interface.c: the table of variables."""
    return f"""{BANNER}#include "interface.h"

#include "../linkage/mass.h"

#include <stddef.h>

/* Geometry and masses are read as one piece each out of a list of values: their members stand in the
 * order of their value references, or an array here has a negative size. */
{_lines(_in_place("LinkageGeometry", symbol, place) for place, symbol in enumerate(interface.geometry))}
{_lines(_in_place("LinkageMasses", symbol, place) for place, symbol in enumerate(interface.masses))}
typedef char geometry_is_complete
    [sizeof(LinkageGeometry) == {len(interface.geometry)} * sizeof(double) ? 1 : -1];
typedef char masses_are_complete
    [sizeof(LinkageMasses) == {len(interface.masses)} * sizeof(double) ? 1 : -1];

INTERNAL const InterfaceVariable interface_variables[INTERFACE_COUNT + 1] = {{
    {{"(no variable)", 0.0, 0.0, 0.0, 0.0, -1, 0}},
{_lines(_row(interface, v) for v in interface.variables)}
}};

INTERNAL const uint16_t interface_evaluation[INTERFACE_COUNT + 1] = {{
    EVALUATION_NOT_REAL, /* (no variable) */
{_lines(f"    EVALUATION_{_evaluation(v)}, /* {v.name} */" for v in interface.variables)}
}};

INTERNAL const uint8_t interface_access[INTERFACE_COUNT + 1] = {{
    ACCESS_READ_ONLY, /* (no variable) */
{_lines(f"    {_access(v)}, /* {v.name} */" for v in interface.variables)}
}};

INTERNAL const uint8_t interface_settable[INTERFACE_SETTABLE_COUNT] = {{
{_lines(f"    VARIABLE_{v.identifier.upper()}," for v in _settable(interface))}
}};
"""


def _in_place(struct: str, symbol: str, place: int) -> str:
    offset = f"offsetof({struct}, {symbol})"
    return f"typedef char {symbol.replace('.', '_')}_is_in_place\n    [{offset} == {place} * sizeof(double) ? 1 : -1];"


def _row(interface: Interface, v: Variable) -> str:
    inputs = [variable.name for variable in interface.of_kind("input")]
    number = inputs.index(v.name) if v.name in inputs else -1
    smallest = v.smallest if isinstance(v, Parameter) else 0.0
    fields = float(v.start or 0.0), *interface.limits(v), smallest, number, int(v.kind == "output")
    return f'    {{"{v.name}", {", ".join(map(repr, fields))}}},'


def _evaluation(v: Variable) -> str:
    if v.type == "boolean":
        return "NOT_REAL"
    return v.group.upper() if isinstance(v, Computed) else "NONE"


def _access(v: Variable) -> str:
    type_ = v.type.upper()
    if v.kind == "input":
        return f"ACCESS_{type_}_BEFORE_START | ACCESS_{type_}_LATER"
    if v.is_state:
        return f"ACCESS_{type_}_BEFORE_START | ACCESS_STATE_LATER"
    if v.kind == "parameter":
        return f"ACCESS_{type_}_BEFORE_START"
    return "ACCESS_READ_ONLY"


def _settable(interface: Interface) -> list[Variable]:
    return [v for v in interface.variables if v.start is not None or v.kind == "independent"]


def _group(interface: Interface, name: str) -> str:
    outputs = (f"OUTPUT({v.identifier.upper()})" for v in interface.unknowns if v.group == name)
    return f"#define INTERFACE_OUTPUTS_OF_{name.upper()}(OUTPUT) {' '.join(outputs)}"


def _equation(v: Unknown) -> str:
    return f"#define EQUATION_{v.identifier.upper()}(PRODUCT, MASS) {' '.join(map(_product, v.equation))}"


def _product(p: Product) -> str:
    return (
        f"{'MASS' if p.has_masses else 'PRODUCT'}({p.coefficient!r}, {_factor(p.pose)}, {p.order}, {_factor(p.motion)})"
    )


def _factor(name: str) -> str:
    return re.sub(r"\W+", "_", name.replace("^2", "_squared")).upper() or "ONE"


def _groups(what: str, variables: Sequence[Computed]) -> str:
    groups = (f"GROUP({name.upper()})" for name in _evaluations(variables))
    return f"#define INTERFACE_{what}_GROUPS(GROUP) {' '.join(groups)}"


def _evaluations(variables: Sequence[Computed]) -> list[str]:
    return list(dict.fromkeys(v.group for v in variables))


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines)
