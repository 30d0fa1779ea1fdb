"""The FMI 3.0 FMU as a WebAssembly component, by the layered standard FMI-LS-WASM, which is a working draft yet.

Source: github.com/modelica/fmi-ls-wasm, docs/index.adoc and wit/, of July 2026. It has a world for co-simulation and
one for Model Exchange, and one file for both where they share a model identifier: ours exports the interfaces of both
worlds, and imports what both of them offer, which is the log.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from lxml import etree

from ..formats.ls_wasm import MANIFEST
from ..interface import Interface
from . import component_model as wasm
from .compiler import FMU_SOURCE, WEB_ASSEMBLY, WEB_ASSEMBLY_SOURCE, compile_module

VERSION = "0.1.0"  # the draft's own example: it has none yet
MANIFEST_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
CORE_SOURCES = (FMU_SOURCE[3], WEB_ASSEMBLY_SOURCE)
PAGES = 20  # of 64 KiB, to begin with: code's data and 1 MiB of stack
PACKAGE = "fmi:fmi3/{}@3.0.0"

TYPES = {
    "value-reference": "u32",
    "status": "enum<ok, warning, discard, error, fatal>",
    "interval-qualifier": "enum<interval-not-yet-known, interval-unchanged, interval-changed>",
    "dependency-kind": "enum<dependent, constant, fixed, tunable, discrete>",
    "fmu-state": "list<u8>",
    "interval-fraction": "record<counter: u64, resolution: u64>",
    "variable-dependency": "record<dependent-value-reference: value-reference, element-index-of-dependent: u32,"
    " independent-value-reference: value-reference, element-index-of-independent: u32, kind: dependency-kind>",
    "discrete-states-info": "record<new-discrete-states-needed: bool, terminate-simulation: bool,"
    " nominals-of-continuous-states-changed: bool, values-of-continuous-states-changed: bool,"
    " next-event-time-defined: bool, next-event-time: f64>",
}
LOG = "instance-name: string, status: status, category: string, message: string ->"

SCALARS = {"float32": "f32", "float64": "f64", "int8": "s8", "int16": "s16", "int32": "s32", "int64": "s64",
           "uint8": "u8", "uint16": "u16", "uint32": "u32", "uint64": "u64", "boolean": "bool", "string": "string",
           "binary": "list<u8>", "clock": "bool"}  # fmt: skip
REFERENCES = "value-references: list<value-reference>"
CLOCKS = {  # what is got, what is set, and the latter's name
    "interval-decimal": ("tuple<f64, interval-qualifier>", "f64", "intervals"),
    "interval-fraction": ("tuple<interval-fraction, interval-qualifier>", "interval-fraction", "intervals"),
    "shift-decimal": ("f64", "f64", "shifts"),
    "shift-fraction": ("interval-fraction", "interval-fraction", "shifts"),
}
REQUESTS = "requests: list<tuple<value-reference, u32>>"
VECTOR, NUMBER, STATUS = "-> result<list<f64>, status>", "-> result<u64, status>", "-> status"
DERIVATIVE = f"unknowns: list<value-reference>, knowns: list<value-reference>, seed: list<f64> {VECTOR}"

METHODS = {  # of both resources, without the argument `self`
    "set-debug-logging": "logging-on: bool, categories: list<string> -> status",
    "enter-initialization-mode": "tolerance: option<f64>, start-time: f64, stop-time: option<f64> -> status",
    "exit-initialization-mode": STATUS,
    "enter-event-mode": STATUS,
    "update-discrete-states": "-> result<discrete-states-info, status>",
    "terminate": STATUS,
    "reset": STATUS,
    "enter-configuration-mode": STATUS,
    "exit-configuration-mode": STATUS,
    **{f"get-{name}": f"{REFERENCES} -> result<list<{kind}>, status>" for name, kind in SCALARS.items()},
    **{f"set-{name}": f"{REFERENCES}, values: list<{kind}> -> status" for name, kind in SCALARS.items()},
    "get-number-of-variable-dependencies": f"vr: value-reference {NUMBER}",
    "get-variable-dependencies": "dependent: value-reference -> result<list<variable-dependency>, status>",
    "get-fmu-state": "-> result<fmu-state, status>",
    "set-fmu-state": "state: fmu-state -> status",
    "get-directional-derivative": DERIVATIVE,
    "get-adjoint-derivative": DERIVATIVE,
    **{f"get-{name}": f"{REFERENCES} -> result<list<{kind}>, status>" for name, (kind, _, _) in CLOCKS.items()},
    **{f"set-{name}": f"{REFERENCES}, {what}: list<{kind}> -> status" for name, (_, kind, what) in CLOCKS.items()},
    "evaluate-discrete-states": STATUS,
    "enter-step-mode": STATUS,
    "get-output-derivatives": f"{REQUESTS} {VECTOR}",
}
CO_SIMULATION = METHODS | {
    "set-input-derivatives": f"{REQUESTS}, values: list<f64> -> status",
    "do-step": "current-communication-point: f64, communication-step-size: f64,"
    " no-set-fmu-state-prior-to-current-point: bool -> result<do-step-result, status>",
}
MODEL_EXCHANGE = METHODS | {
    "enter-continuous-time-mode": STATUS,
    "set-time": "time: f64 -> status",
    "set-continuous-states": "continuous-states: list<f64> -> status",
    "get-continuous-state-derivatives": VECTOR,
    "get-event-indicators": VECTOR,
    "get-continuous-states": VECTOR,
    "get-nominals-of-continuous-states": VECTOR,
    "get-number-of-event-indicators": NUMBER,
    "get-number-of-continuous-states": NUMBER,
    "completed-integrator-step": "no-set-fmu-state-prior-to-current-point: bool"
    " -> result<completed-step-result, status>",
}
IDENTIFICATION = "instance-name: string, instantiation-token: string, visible: bool, logging-on: bool"
# The main module's functions that make instances, and how many arguments each takes: a string or list is two.
FACTORIES = {"instantiate-co-simulation": 10, "instantiate-model-exchange": 6}


def _interface(kind: str, result: str, fields: str, methods: dict[str, str], arguments: str) -> wasm.Interface:
    """The interface of one kind of instance. result: the name of the record of its own, with these fields."""
    resource = f"{kind}-instance"
    self = f"self: borrow<{resource}>, "
    functions = {f"[static]{resource}.instantiate-{kind}": f"{arguments} -> option<own<{resource}>>"}
    functions |= {f"[method]{resource}.{name}": (self + of).replace(", ->", " ->") for name, of in methods.items()}
    return wasm.Interface(
        PACKAGE.format(kind),
        tuple(name for name in TYPES if name != "dependency-kind"),  # the draft's interfaces use all others
        {result: f"record<{fields}>"},
        resource,
        {name: wasm.function_type(of) for name, of in functions.items()},
    )


INTERFACES = (
    wasm.Interface(PACKAGE.format("common"), functions={"get-version": wasm.function_type("-> string")}),
    _interface(
        "co-simulation", "do-step-result",
        "last-successful-time: f64, event-handling-needed: bool, terminate-simulation: bool, early-return: bool",
        CO_SIMULATION,
        f"{IDENTIFICATION}, event-mode-used: bool, early-return-allowed: bool,"
        " required-intermediate-variables: list<value-reference>",
    ),
    _interface(
        "model-exchange", "completed-step-result", "enter-event-mode: bool, terminate-simulation: bool",
        MODEL_EXCHANGE, IDENTIFICATION,
    ),
)  # fmt: skip


def component(core: bytes) -> bytes:
    """The component around the core module that fmi/web_assembly.c is compiled to."""
    builder = wasm.Builder()
    wasm.types_imported(builder, PACKAGE.format("types"), TYPES)
    callbacks = PACKAGE.format("callbacks")
    log = {"log-message": wasm.function_type(LOG)}
    host = wasm.functions_imported(builder, callbacks, ["status"], log)

    memory_instance = builder.core_instance(builder.core_module(wasm.memory_module(PAGES)), {})
    memory = builder.core_export(memory_instance, wasm.CORE_MEMORY, "memory")
    logging = builder.lowered(builder.exported(host, wasm.FUNCTION, "log-message"), memory)
    imports = {"env": memory_instance, callbacks: builder.core_functions({"log-message": logging})}
    main = builder.core_instance(builder.core_module(core), imports)

    destructor = builder.core_export(main, wasm.CORE_FUNCTION, "free-instance")
    handles = {}
    for interface in INTERFACES:
        if interface.resource:
            resource = builder.resource(interface.resource, destructor)
            (factory,) = (wasm.core_name(name) for name in interface.functions if name.startswith("[static]"))
            handles[factory] = builder.new_handle(resource)
    factory_module = builder.core_module(wasm.factory_module(FACTORIES, PAGES))
    given = {"main": main, "new": builder.core_functions(handles), "env": memory_instance}
    factories = builder.core_instance(factory_module, given)

    reallocate = builder.core_export(main, wasm.CORE_FUNCTION, "cabi_realloc")
    release = builder.core_export(main, wasm.CORE_FUNCTION, "release")
    for interface in INTERFACES:
        for name, written in interface.types.items():
            builder.scope.name(name, builder.scope.index(wasm.parse(written)))
        lifted = {}
        for name, kind in interface.functions.items():
            instance = factories if name.startswith("[static]") else main
            function = builder.core_export(instance, wasm.CORE_FUNCTION, wasm.core_name(name))
            lifted[name] = builder.lifted(function, kind, memory, reallocate, release)
        wasm.export_interface(builder, interface, TYPES, lifted)
    return builder.content()


def web_assembly_content(interface: Interface) -> dict[str, bytes]:
    """The files in the archive, by name: the component, and the layered standard's manifest."""
    with tempfile.TemporaryDirectory() as folder:
        core = Path(folder) / "core.wasm"
        # the component's memory is a module of its own
        options = ("-Wl,--import-memory", f"-Wl,--initial-memory={PAGES * wasm.PAGE}")
        compile_module(CORE_SOURCES, core, (), *options)
        made = component(core.read_bytes())
    name = f"binaries/{WEB_ASSEMBLY.folder}/{interface.model.name}{WEB_ASSEMBLY.suffix}"
    return {name: made, MANIFEST: _manifest()}


def _manifest() -> bytes:
    ls = {
        "name": "org.modelica.fmi-ls-wasm",
        "version": VERSION,
        "description": "FMI Layered Standard for WebAssembly",
    }
    attributes = {f"{{{MANIFEST_NAMESPACE}}}fmi-ls-{name}": value for name, value in ls.items()}
    root = etree.Element("fmiLayeredStandardManifest", attributes, nsmap={"fmi-ls": MANIFEST_NAMESPACE})
    made: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return made
