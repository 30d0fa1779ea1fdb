"""Each C header can be opened alone: it includes what it needs, so an editor and a reader understand it by itself."""

from __future__ import annotations

import pytest

from fmu_src.exporter.compiler import SOURCE_ROOT, host_platform, run_compiler

# one file for the compiler, not for people: it includes all sources
HEADERS = [path for path in sorted(SOURCE_ROOT.rglob("*.h")) if path.name != "one_file.h"]
# a header's functions are for the file that includes it
UNUSED = ("-Wno-unused-function", "-Wno-unused-const-variable")


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: path.relative_to(SOURCE_ROOT).as_posix())
def test_header_stands_alone(header, tmp_path):
    run_compiler(host_platform(), *UNUSED, "-c", "-x", "c", str(header), "-o", str(tmp_path / "header.o"))
