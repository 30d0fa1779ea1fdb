"""Builds the small FMU of small_fmu.c, whole or broken."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
from fmpy.fmi3 import FMU3Model, FMU3ScheduledExecution, FMU3Slave

from fmu_src.exporter.archive import write_archive
from fmu_src.exporter.compiler import compile_library, host_platform

SOURCE = Path(__file__).with_name("small_fmu.c")
FOREIGN_STYLE = ("-Wno-missing-prototypes", "-Wno-unused-function")

FMI2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Small" guid="{small}" variableNamingConvention="structured"
    numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="Small" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
      providesDirectionalDerivative="true"/>
  <CoSimulation modelIdentifier="Small" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"
      canSerializeFMUstate="true" providesDirectionalDerivative="true" canInterpolateInputs="true"
      maxOutputDerivativeOrder="1"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/><DisplayUnit name="mm" factor="1000"/></Unit>
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit></UnitDefinitions>
  <LogCategories><Category name="logEvents"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.05"/>
  <ModelVariables>
    <ScalarVariable name="time" valueReference="0" causality="independent" variability="continuous"><Real/>
    </ScalarVariable>
    <ScalarVariable name="u" valueReference="1" causality="input"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed"><Real start="2"/>
    </ScalarVariable>
    <ScalarVariable name="x" valueReference="3" causality="local" initial="exact"><Real start="0.5" min="-50"
      max="50" unit="m" displayUnit="mm"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="4" causality="output" initial="calculated"><Real min="-1000" max="1000"/>
    </ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="5" causality="local" initial="calculated"><Real derivative="4"
      unit="m/s"/></ScalarVariable>
    <ScalarVariable name="z" valueReference="6" causality="local" initial="calculated"><Real/></ScalarVariable>
    <ScalarVariable name="label" valueReference="7" causality="parameter" variability="fixed"><String start="Set me!"/>
    </ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="5" dependencies="2 4" dependenciesKind="dependent fixed"/></Outputs>
    <Derivatives><Unknown index="6" dependencies="2 4" dependenciesKind="constant constant"/></Derivatives>
    <InitialUnknowns><Unknown index="5" dependencies="2 3 4"/><Unknown index="6" dependencies="2 4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""
FMI3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Small" instantiationToken="{small}"
    variableNamingConvention="structured">
  <ModelExchange modelIdentifier="Small" canGetAndSetFMUState="true" canSerializeFMUState="true"
      providesDirectionalDerivatives="true"/>
  <CoSimulation modelIdentifier="Small" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"
      canSerializeFMUState="true" providesDirectionalDerivatives="true" providesAdjointDerivatives="true"
      maxOutputDerivativeOrder="1" hasEventMode="true" providesIntermediateUpdate="true"
      canReturnEarlyAfterIntermediateUpdate="true"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/><DisplayUnit name="mm" factor="1000"/></Unit>
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit></UnitDefinitions>
  <LogCategories><Category name="logEvents"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.05"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="u" valueReference="1" causality="input" start="1"/>
    <Float64 name="k" valueReference="2" causality="parameter" variability="fixed" start="2"/>
    <Float64 name="x" valueReference="3" causality="local" initial="exact" start="0.5" min="-50" max="50" unit="m"
      displayUnit="mm"/>
    <Float64 name="y" valueReference="4" causality="output" initial="calculated" min="-1000" max="1000"
      intermediateUpdate="true"/>
    <Float64 name="der(x)" valueReference="5" causality="local" initial="calculated" derivative="3" unit="m/s"/>
    <Float64 name="z" valueReference="6" causality="local" initial="calculated"/>
    <String name="label" valueReference="7" causality="parameter" variability="fixed"><Start value="Set me!"/></String>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="4" dependencies="1 3" dependenciesKind="dependent fixed"/>
    <ContinuousStateDerivative valueReference="5" dependencies="1 3" dependenciesKind="constant constant"/>
    <InitialUnknown valueReference="4" dependencies="1 2 3"/>
    <InitialUnknown valueReference="5" dependencies="1 3"/>
    <EventIndicator valueReference="6"/>
  </ModelStructure>
</fmiModelDescription>
"""


@cache
def library(edition: str, *options: str, target: str | None = None) -> bytes:
    """The compiled binary for this machine."""
    with TemporaryDirectory() as folder:
        if edition == "3.0":
            named = {name for class_ in (FMU3Model, FMU3Slave, FMU3ScheduledExecution) for name in dir(class_)}
            here = set(re.findall(r"\b(fmi3\w+)\(", SOURCE.read_text()))
            lines = (f"NOT_HERE({name})\n" for name in sorted(named - here) if name.startswith("fmi3"))
            (Path(folder) / "not_here.h").write_text("".join(lines))
            options = (*options, "-DFMI3", "-I", folder)
        platform = host_platform()
        file = Path(folder) / f"Small{platform.suffix}"
        chosen = platform if target is None else replace(platform, target=target)
        compile_library((SOURCE,), file, chosen, "-D_GNU_SOURCE", *FOREIGN_STYLE, *options)
        return file.read_bytes()


def content(edition: str, defect: str | None = None, *options: str, target: str | None = None) -> dict[str, bytes]:
    """The files of the FMU by their names; `defect` is one that small_fmu.c knows."""
    folder = fmpy.platform if edition == "2.0" else fmpy.platform_tuple
    files = {
        "modelDescription.xml": (FMI2 if edition == "2.0" else FMI3).encode(),
        f"binaries/{folder}/Small{fmpy.sharedLibraryExtension}": library(edition, *options, target=target),
    }
    if defect is not None:
        files["resources/defect.txt"] = defect.encode()
    return files


def write(path: Path, files: dict[str, bytes]) -> Path:
    write_archive(path, files)
    return path
