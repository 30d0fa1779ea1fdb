"""The C sources in the FMU: what any C99 compiler needs to make its binary.

One file is to be compiled, sources/TransplanterLinkage.c; it includes the others, so that only the functions of
FMI are left outside (FMI 3.0, section 2.4.10 recommends it so). FMI 2.0 lists it in modelDescription.xml, FMI 3.0
in sources/buildDescription.xml. The headers of FMI are the importer's, as both standards say.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

import fmpy
from lxml import etree

from ..interface import Interface
from .compiler import SOURCE_ROOT

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3BuildDescription.xsd"
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def source_name(interface: Interface) -> str:
    """The file to compile, in the folder sources."""
    return f"{interface.model.name}.c"


def source_content(interface: Interface, version: int) -> dict[str, bytes]:
    """The files in the archive, by name. version: 2 or 3, FMI 2.0 or 3.0."""
    main = f"fmi/fmi{version}_fmu.c"
    included = _with_included(main, of_another=f"fmi/fmi{5 - version}_")
    content = {source_name(interface): _entry(interface, version, main).encode()} | included
    if version == 3:
        content["buildDescription.xml"] = _build_description(interface)
    return {f"sources/{name}": data for name, data in content.items()}


def _with_included(main: str, of_another: str) -> dict[str, bytes]:
    """A file and all of this project that it includes, by their names below fmu_src.

    of_another: how the names of the files begin that are for another version, which conditions leave out.
    """
    found: dict[str, bytes] = {}
    names = [main]
    while names:
        name = names.pop()
        path = SOURCE_ROOT / name
        if name.startswith(of_another):
            continue
        if name not in found and path.is_file():  # what is not there is a header of FMI
            found[name] = path.read_bytes()
            folder = posixpath.dirname(name)
            names += [posixpath.normpath(posixpath.join(folder, n)) for n in INCLUDE.findall(found[name].decode())]
    return found


def _entry(interface: Interface, version: int, main: str) -> str:
    prefix, model = f"FMI{version}_FUNCTION_PREFIX", interface.model.name
    override = f"FMI{version}_OVERRIDE_FUNCTION_PREFIX"
    return f"""/* {model}: compile this file, which includes all the others, with any C99 compiler and the
 * headers of FMI {version}.0 on its path; link the C mathematics library where it is one of its own. */

/* Products and sums are rounded one by one, so that every platform computes the same (gcc: -std=c99). */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

/* Linked with others into one program, the functions carry the model's name; in a shared library, which the
 * importer tells by {override}, they do not. */
#if !defined({override}) && !defined({prefix})
#define {prefix} {model}_
#endif

#include "{main}"
"""


def _build_description(interface: Interface) -> bytes:
    root = etree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = etree.SubElement(root, "BuildConfiguration", modelIdentifier=interface.model.name)
    files = etree.SubElement(configuration, "SourceFileSet", language="C99")
    etree.SubElement(files, "SourceFile", name=source_name(interface))
    etree.SubElement(files, "PreprocessorDefinition", name="FMI3_OVERRIDE_FUNCTION_PREFIX", optional="true",
                     description="Functions without the model's name before theirs: for a shared library")  # fmt: skip
    etree.SubElement(configuration, "Library", name="m", external="true",
                     description="The C mathematics library, where it is one of its own")  # fmt: skip
    etree.XMLSchema(etree.parse(str(SCHEMA))).assertValid(root)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
