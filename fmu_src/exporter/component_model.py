"""WebAssembly components as bytes: a core module, and around it what gives its functions types and names.

Sources: the Component Model's Binary.md and CanonicalABI.md (github.com/WebAssembly/component-model, design/mvp) for
the binary format and for how values lie in memory; WebAssembly Core Specification 2.0, section 5, for modules. Types
are written much as in WIT: `result<list<f64>, status>`, `record<counter: u64, resolution: u64>`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import groupby
from operator import itemgetter

from ..formats.ls_wasm import COMPONENT

MODULE = b"\0asm\x01\0\0\0"

PRIMITIVES = {"bool": 0x7F, "s8": 0x7E, "u8": 0x7D, "s16": 0x7C, "u16": 0x7B, "s32": 0x7A, "u32": 0x79, "s64": 0x78,
              "u64": 0x77, "f32": 0x76, "f64": 0x75, "string": 0x73}  # fmt: skip
CORE_I32 = 0x7F
PAGE = 65536

# Binary.md: what an index is of, and the sections of a component.
FUNCTION, TYPE, INSTANCE = 1, 3, 5
CORE_FUNCTION, CORE_MEMORY, CORE_INSTANCE = 0x00, 0x02, 0x12
(CORE_MODULE_SECTION, CORE_INSTANCE_SECTION, COMPONENT_SECTION, INSTANCE_SECTION, ALIAS_SECTION, TYPE_SECTION,
 CANON_SECTION, IMPORT_SECTION, EXPORT_SECTION) = 1, 2, 4, 5, 6, 7, 8, 10, 11  # fmt: skip


# ---- bytes -----------------------------------------------------------------------------------------


def unsigned(number: int) -> bytes:
    """LEB128."""
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + unsigned(rest) if rest else bytes([low])


def index_of_type(number: int) -> bytes:
    """Signed LEB128, where negative numbers are the primitive types."""
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + index_of_type(rest) if rest or low & 0x40 else bytes([low])


def vector(items: Iterable[bytes]) -> bytes:
    listed = list(items)
    return unsigned(len(listed)) + b"".join(listed)


def sized(content: bytes) -> bytes:
    return unsigned(len(content)) + content


def text(name: str) -> bytes:
    return sized(name.encode())


def external(name: str) -> bytes:
    """A name by which components import and export."""
    return b"\0" + text(name)


# ---- types -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Type:
    """`name<label: part, ...>`: a primitive or named type has no parts; labels are "" where there are none.

    An enumeration's parts are its cases. A function's are its parameters, and labelled `->` its result.
    """

    name: str
    parts: tuple[tuple[str, Type], ...] = ()


TOKEN = re.compile(r"\s*([a-z][a-z0-9-]*|[<>,:])")


@cache
def parse(written: str) -> Type:
    """A type as WIT has it; raises ValueError."""
    tokens = TOKEN.findall(written)
    if not tokens or "".join(tokens) != re.sub(r"\s", "", written):
        raise ValueError(f"no type: {written}")
    tokens.append("")

    def part() -> tuple[str, Type]:
        label = tokens.pop(0) if tokens[1] == ":" else ""
        if label:
            tokens.pop(0)
        return label, whole()

    def whole() -> Type:
        name, parts = tokens.pop(0), []
        if tokens[0] == "<":
            while tokens[0] in ("<", ","):
                tokens.pop(0)
                parts.append(part())
            if tokens.pop(0) != ">":
                raise ValueError(f"no type: {written}")
        return Type(name, tuple(parts))

    found = whole()
    if tokens != [""]:
        raise ValueError(f"no type: {written}")
    return found


def function_type(written: str) -> Type:
    """A function's, from `name: type, ... -> type`, where either side may be empty."""
    parameters, _, result = (side.strip() for side in written.partition("->"))
    parts = parse(f"func<{parameters}>").parts if parameters else ()
    return Type("func", (*parts, ("->", parse(result))) if result else parts)


class Scope:
    """An index space of types as it fills: a component's, or that of an instance's type."""

    def __init__(self, define: Callable[[bytes], None]) -> None:
        """define: takes a type's definition down."""
        self._define = define
        self._count = 0
        self._known: dict[Type, int] = {}

    def entered(self) -> int:
        """The index of a type that came in otherwise than by `add`: imported, exported or aliased."""
        self._count += 1
        return self._count - 1

    def name(self, name: str, index: int) -> None:
        """From now on this is what `name` means."""
        self._known = {of: place for of, place in self._known.items() if not of.parts}
        self._known[Type(name)] = index

    def add(self, content: bytes) -> int:
        self._define(content)
        return self.entered()

    def index(self, of: Type) -> int:
        """Where a type stands, entered with all that it is made of where it is not there yet."""
        if of not in self._known:
            self._known[of] = self.add(self._definition(of))
        return self._known[of]

    def value(self, of: Type) -> bytes:
        return bytes([PRIMITIVES[of.name]]) if of.name in PRIMITIVES else index_of_type(self.index(of))

    def _definition(self, of: Type) -> bytes:
        parts = [part for _, part in of.parts]
        labelled = [(label, part) for label, part in of.parts if label != "->"]
        match of.name:
            case "enum":
                return b"\x6d" + vector(text(part.name) for part in parts)
            case "own" | "borrow":
                return bytes([0x69 if of.name == "own" else 0x68]) + unsigned(self.index(parts[0]))
            case "result":
                return b"\x6a" + b"".join(b"\x01" + self.value(part) for part in parts)
            case "list" | "option":
                return bytes([0x70 if of.name == "list" else 0x6B]) + self.value(parts[0])
            case "tuple":
                return b"\x6f" + vector(map(self.value, parts))
            case "record":
                return b"\x72" + vector(text(label) + self.value(part) for label, part in labelled)
            case "func":
                parameters = vector(text(label) + self.value(part) for label, part in labelled)
                has_result = len(labelled) < len(parts)
                return b"\x40" + parameters + (b"\0" + self.value(parts[-1]) if has_result else b"\x01\0")
        if of.name in PRIMITIVES:
            return self.value(of)
        raise ValueError(f"no type of this name: {of.name}")


# ---- components --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Interface:
    """What a component exports under one name.

    used: the named types of the imported interface of types that its functions and own types name;
    types: its own; resource: the name of its one resource, or ""; functions: their types by name.
    """

    name: str
    used: tuple[str, ...] = ()
    types: Mapping[str, str] = field(default_factory=dict)
    resource: str = ""
    functions: Mapping[str, Type] = field(default_factory=dict)


class Builder:
    """The sections of a component as they fill, and how many there are of what they define."""

    def __init__(self) -> None:
        self._items: list[tuple[int, bytes]] = []
        self._counts: Counter[str] = Counter()
        self.scope = Scope(lambda content: self._items.append((TYPE_SECTION, content)))

    def add(self, section: int, content: bytes, kind: str) -> int:
        """The index that the new one has among those of its kind."""
        self._items.append((section, content))
        if kind == "type":
            return self.scope.entered()
        self._counts[kind] += 1
        return self._counts[kind] - 1

    def core_module(self, module: bytes) -> int:
        return self.add(CORE_MODULE_SECTION, module, "core module")

    def core_instance(self, module: int, imports: Mapping[str, int]) -> int:
        """imports: instances by the names of the modules that are imported."""
        given = vector(text(name) + bytes([CORE_INSTANCE]) + unsigned(index) for name, index in imports.items())
        return self.add(CORE_INSTANCE_SECTION, b"\0" + unsigned(module) + given, "core instance")

    def core_functions(self, functions: Mapping[str, int]) -> int:
        """A core instance that has these functions."""
        listed = vector(text(name) + bytes([CORE_FUNCTION]) + unsigned(index) for name, index in functions.items())
        return self.add(CORE_INSTANCE_SECTION, b"\x01" + listed, "core instance")

    def core_export(self, instance: int, sort: int, name: str) -> int:
        alias = bytes([0, sort, 1]) + unsigned(instance) + text(name)
        return self.add(ALIAS_SECTION, alias, f"core {sort}")

    def exported(self, instance: int, sort: int, name: str) -> int:
        alias = bytes([sort, 0]) + unsigned(instance) + text(name)
        return self.add(ALIAS_SECTION, alias, "type" if sort == TYPE else "function")

    def lowered(self, function: int, memory: int) -> int:
        """A function as a core function, which reads its arguments in `memory`; strings are UTF-8."""
        options = vector([b"\0", b"\x03" + unsigned(memory)])
        return self.add(CANON_SECTION, b"\x01\0" + unsigned(function) + options, f"core {CORE_FUNCTION}")

    def lifted(self, core: int, kind: Type, memory: int, reallocate: int, release: int) -> int:
        """A core function as a function of type `kind`. release: is called with its result when that has been read."""
        options = [b"\0", b"\x03" + unsigned(memory), b"\x04" + unsigned(reallocate), b"\x05" + unsigned(release)]
        definition = b"\0\0" + unsigned(core) + vector(options) + unsigned(self.scope.index(kind))
        return self.add(CANON_SECTION, definition, "function")

    def resource(self, name: str, destructor: int) -> int:
        """A type of which the host has handles, each for an i32."""
        index = self.scope.add(bytes([0x3F, CORE_I32, 1]) + unsigned(destructor))
        self.scope.name(name, index)
        return index

    def new_handle(self, resource: int) -> int:
        """The core function that makes a handle."""
        return self.add(CANON_SECTION, b"\x02" + unsigned(resource), f"core {CORE_FUNCTION}")

    def imported(self, name: str, what: bytes, kind: str) -> int:
        return self.add(IMPORT_SECTION, external(name) + what, kind)

    def export(self, name: str, sort: int, index: int, as_type: bytes | None = None) -> int:
        """as_type: what a function is described as, where its type names others than those exported."""
        described = b"\0" if as_type is None else b"\x01" + as_type
        kind = {FUNCTION: "function", TYPE: "type", INSTANCE: "instance"}[sort]
        return self.add(EXPORT_SECTION, external(name) + bytes([sort]) + unsigned(index) + described, kind)

    def content(self) -> bytes:
        made = [COMPONENT]
        for section, group in groupby(self._items, key=itemgetter(0)):
            items = [content for _, content in group]
            single = section in (CORE_MODULE_SECTION, COMPONENT_SECTION)
            made += [bytes([section]) + sized(item) for item in (items if single else [vector(items)])]
        return b"".join(made)


def equal_to(index: int) -> bytes:
    """The description of a type that is another one."""
    return bytes([TYPE, 0]) + unsigned(index)


SOME_RESOURCE = bytes([TYPE, 1])


def types_imported(builder: Builder, name: str, types: Mapping[str, str]) -> None:
    """Import an interface of nothing but types, and name them in the builder's scope."""
    declared: list[bytes] = []
    scope = Scope(lambda content: declared.append(b"\x01" + content))
    for of, written in types.items():
        declared.append(b"\x04" + external(of) + equal_to(scope.index(parse(written))))
        scope.name(of, scope.entered())
    instance = instance_imported(builder, name, declared)
    for of in types:
        builder.scope.name(of, builder.exported(instance, TYPE, of))


def functions_imported(builder: Builder, name: str, used: Iterable[str], functions: Mapping[str, Type]) -> int:
    """Import an interface of functions; returns the instance. used: as in Interface."""
    declared: list[bytes] = []
    scope = Scope(lambda content: declared.append(b"\x01" + content))
    for of in used:
        declared.append(b"\x02" + bytes([TYPE, 2, 1]) + unsigned(builder.scope.index(Type(of))))
        declared.append(b"\x04" + external(of) + equal_to(scope.entered()))
        scope.name(of, scope.entered())
    for of, kind in functions.items():
        index = scope.index(kind)
        declared.append(b"\x04" + external(of) + bytes([FUNCTION]) + unsigned(index))
    return instance_imported(builder, name, declared)


def instance_imported(builder: Builder, name: str, declared: list[bytes]) -> int:
    index = builder.scope.add(b"\x42" + vector(declared))
    return builder.imported(name, bytes([INSTANCE]) + unsigned(index), "instance")


def export_interface(
    builder: Builder, interface: Interface, types: Mapping[str, str], functions: Mapping[str, int]
) -> None:
    """Export functions of the builder under the interface's name, in its types.

    types: those of the imported interface, all; functions: indices by name. What an instance exports has to speak in
    types that it exports as well: a component inside takes both in and gives them out under their names.
    """
    inner, given = Builder(), []

    def take(name: str, what: bytes) -> None:
        inner.scope.name(name, inner.imported(f"import-type-{name}", what, "type"))
        given.append(text(f"import-type-{name}") + bytes([TYPE]) + unsigned(builder.scope.index(Type(name))))

    own = dict(interface.types)
    for name, written in (*((of, types[of]) for of in types if interface.used), *own.items()):
        take(name, equal_to(inner.scope.index(parse(written))))
    if interface.resource:
        take(interface.resource, SOME_RESOURCE)
    inside = {}
    for name, kind in interface.functions.items():
        plain = f"import-{core_name(name)}"
        inside[name] = inner.imported(plain, bytes([FUNCTION]) + unsigned(inner.scope.index(kind)), "function")
        given.append(text(plain) + bytes([FUNCTION]) + unsigned(functions[name]))
    for name in (*interface.used, *own, *filter(None, [interface.resource])):
        inner.scope.name(name, inner.export(name, TYPE, inner.scope.index(Type(name))))
    for name, kind in interface.functions.items():
        inner.export(name, FUNCTION, inside[name], bytes([FUNCTION]) + unsigned(inner.scope.index(kind)))

    component = builder.add(COMPONENT_SECTION, inner.content(), "component")
    instance = builder.add(INSTANCE_SECTION, b"\0" + unsigned(component) + vector(given), "instance")
    builder.export(interface.name, INSTANCE, instance)


def core_name(function: str) -> str:
    """What the core module calls a function: its name without the resource."""
    return function.rpartition(".")[2]


# ---- core modules --------------------------------------------------------------------------------------


def section(number: int, items: Iterable[bytes]) -> bytes:
    return bytes([number]) + sized(vector(items))


def core_function(parameters: Iterable[int], result: bool = True) -> bytes:
    """A function's type; its result is an i32."""
    return b"\x60" + vector(bytes([of]) for of in parameters) + (b"\x01\x7f" if result else b"\0")


def memory_module(pages: int) -> bytes:
    """A module of nothing but a memory, so that it is there before whatever uses it. pages: of 64 KiB."""
    return MODULE + section(5, [b"\0" + unsigned(pages)]) + section(7, [text("memory") + b"\x02\0"])


def factory_module(factories: Mapping[str, int], pages: int) -> bytes:
    """What makes a handle of the host for each instance that the main module makes.

    The main module's functions answer the address of an option: a flag, and 4 bytes on an instance. A resource's type
    must be there before handles of it are made, the destructor's module before the type; so the handle is put in the
    instance's place here, in functions of the same names. At its start the main module's initializer is run.

    factories: how many arguments, all of them i32, each of the main module's functions takes.
    """
    handle_type, start_type = len(factories), len(factories) + 1
    kinds = [core_function([CORE_I32] * count) for count in factories.values()]
    kinds += [core_function([CORE_I32]), core_function([], result=False)]
    imports = [text("main") + text(name) + b"\0" + unsigned(k) for k, name in enumerate(factories)]
    imports += [text("new") + text(name) + b"\0" + unsigned(handle_type) for name in factories]
    imports += [text("main") + text("_initialize") + b"\0" + unsigned(start_type)]
    imports += [text("env") + text("memory") + b"\x02\0" + unsigned(pages)]
    first = 2 * len(factories) + 1
    bodies = []
    for k, count in enumerate(factories.values()):
        local = b"\x20" + unsigned(count)  # the option's address
        code = b"".join(b"\x20" + unsigned(n) for n in range(count)) + b"\x10" + unsigned(k)  # call
        code += b"\x22" + unsigned(count) + b"\x2d\0\0" + b"\x04\x40"  # keep it; load the flag; if it is set,
        code += local + local + b"\x28\x02\x04" + b"\x10" + unsigned(len(factories) + k)  # load, make the handle,
        code += b"\x36\x02\x04" + b"\x0b" + local + b"\x0b"  # store
        bodies.append(sized(vector([b"\x01\x7f"]) + code))
    return (
        MODULE
        + section(1, kinds)
        + section(2, imports)
        + section(3, [unsigned(k) for k in range(len(factories))])
        + section(7, [text(name) + b"\0" + unsigned(first + k) for k, name in enumerate(factories)])
        + bytes([8])
        + sized(unsigned(first - 1))
        + section(10, bodies)
    )
