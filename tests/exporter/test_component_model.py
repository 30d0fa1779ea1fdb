"""The writer of components: numbers, types and sections as the binary format has them."""

from __future__ import annotations

import pytest

from fmu_src.exporter import component_model as wasm
from fmu_src.exporter.compiler import SOURCE_ROOT, compile_module
from fmu_src.exporter.component_model import Type


@pytest.mark.parametrize(
    ("number", "as_unsigned", "as_type"),
    [(0, "00", "00"), (63, "3f", "3f"), (64, "40", "c000"), (127, "7f", "ff00"), (128, "8001", "8001"),
     (8191, "ff3f", "ff3f"), (8192, "8040", "80c000"), (624485, "e58e26", "e58e26")],
)  # fmt: skip
def test_numbers(number, as_unsigned, as_type):
    """LEB128, unsigned and signed: WebAssembly Core Specification 2.0, section 5.2.2."""
    assert wasm.unsigned(number).hex() == as_unsigned
    assert wasm.index_of_type(number).hex() == as_type


def test_types_as_they_are_written():
    u32, f64 = Type("u32"), Type("f64")
    pair = Type("tuple", (("", u32), ("", f64)))
    assert wasm.parse("list<tuple<u32, f64>>") == Type("list", (("", pair),))
    assert wasm.parse("record<a-b: u32, c: list<f64>>").parts[0] == ("a-b", u32)
    assert wasm.function_type("a: u32, b: f64 -> u32") == Type("func", (("a", u32), ("b", f64), ("->", u32)))
    assert wasm.function_type("->") == Type("func") and wasm.function_type("a: u32 ->") == Type("func", (("a", u32),))


@pytest.mark.parametrize("written", ["list<u32", "list<u32>>", "u32 f64", "list<>", "A", "", "tuple<u32;f64>"])
def test_no_types(written):
    with pytest.raises(ValueError, match="no type"):
        wasm.parse(written)


def scope() -> tuple[wasm.Scope, list[str]]:
    defined: list[str] = []
    return wasm.Scope(lambda content: defined.append(content.hex())), defined


def test_a_type_is_defined_once_and_after_its_parts():
    """Binary.md, "Type Definitions": list 0x70, tuple 0x6f, result 0x6a, u32 0x79, f64 0x75, string 0x73."""
    space, defined = scope()
    assert space.index(wasm.parse("result<list<tuple<u32, f64>>, string>")) == 2
    assert space.index(wasm.parse("list<tuple<u32, f64>>")) == 1
    assert defined == ["6f027975", "7000", "6a01010173"]


def test_a_name_means_what_was_named_last():
    space, defined = scope()
    space.name("status", space.index(wasm.parse("enum<ok, error>")))
    assert space.index(wasm.parse("list<status>")) == 1
    space.name("status", space.entered())
    assert space.index(wasm.parse("list<status>")) == 3
    assert defined == ["6d02026f6b056572726f72", "7000", "7002"]
    with pytest.raises(ValueError, match="no-such"):
        space.index(wasm.parse("list<no-such>"))


def test_functions():
    """With and without a result."""
    space, defined = scope()
    space.index(wasm.function_type("a: u32 -> f64"))
    space.index(wasm.function_type("->"))
    assert defined == ["40010161790075", "40000100"]


def test_neighbours_share_a_section():
    builder = wasm.Builder()
    for module in (b"one", b"two"):
        builder.core_module(module)
    builder.scope.index(wasm.parse("list<u32>"))
    builder.scope.index(wasm.parse("list<f64>"))
    assert builder.content() == wasm.COMPONENT + b"\x01\x03one\x01\x03two" + b"\x07\x05\x02\x70\x79\x70\x75"


def test_the_module_has_the_same_bytes_from_another_folder(project_copy, tmp_path):
    """And exports what it is told to, for a caller that gives it nothing."""
    modules = []
    for number, root in enumerate((SOURCE_ROOT, project_copy / "fmu_src")):
        modules.append(tmp_path / str(number) / "linkage.wasm")
        compile_module((root / "fmi" / "fmi3_fmu.c",), modules[-1], ["fmi3DoStep", "malloc"])
    first, second = (module.read_bytes() for module in modules)
    assert first == second
    wasmtime = pytest.importorskip("wasmtime", reason="wasmtime, which reads modules, is not installed")
    module = wasmtime.Module(wasmtime.Engine(), first)
    assert {e.name for e in module.exports} == {"memory", "_initialize", "fmi3DoStep", "malloc"}
    assert not module.imports
