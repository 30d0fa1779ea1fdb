"""The one door from the scenarios to what lies below the FMU. All other scenarios know built FMUs and fmpy alone.

Speed and error are measured against what the FMU is made of: the exact answers of the oracle, the paper's equations,
the bare core compiled as the FMU is, the twin. What is needed of these is named here, and nowhere else.
"""

from __future__ import annotations

from fmu_src.exporter.compiler import (
    LINKAGE_SOURCES,
    SOURCE_ROOT,
    compile_library,
    compile_program,
    host_platform,
)
from fmu_src.interface import load_interface
from fmu_src.oracle import printed_equations
from fmu_src.oracle.dynamics import Dynamics
from fmu_src.oracle.oracle import Oracle, Pose, conditioning, error
from fmu_src.oracle.tables import rows as exact_rows
from fmu_src.twin import linkage as twin

__all__ = [
    "INTERFACE_SOURCE", "LINKAGE_SOURCES", "NOMINAL", "SOURCE_ROOT", "STANDARD_GRAVITY", "TOKEN", "TURN_TIME",
    "Dynamics", "Oracle", "Pose", "compile_library", "compile_program", "conditioning", "error", "exact_rows",
    "host_platform", "printed_equations", "twin",
]  # fmt: skip

INTERFACE_SOURCE = SOURCE_ROOT / "component" / "interface.c"
NOMINAL = load_interface().geometry
STANDARD_GRAVITY = load_interface().gravity  # m/s2
TURN_TIME = load_interface().model.turn_time  # s
TOKEN = load_interface().token
