"""The field row as one run of a parameter study.

`python -m scenarios.sweep --scene scenarios.field_row.scene:planted_row` runs the study. Every worker process of the
study imports this module, so that it imports little.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenarios.common.instance import Refused
from scenarios.common.operating_point import MACHINE_SPEED, SPACING
from scenarios.field_row import run
from scenarios.field_row.system import SystemFault, load_system

PLANTS = 3
STEP = 5e-3  # s: communication step


def planted_row(
    fmu: Path,
    parameters: Mapping[str, float],
    *,
    spacing: float = SPACING,
    cruise: float = MACHINE_SPEED,
) -> dict[str, float]:
    """The field row of scenarios/field_row/row.toml with this linkage: PLANTS plants, ``cruise`` is in m/s.

    ``hole`` and ``depth`` in m, ``posture`` (the seedling's lean out of the vertical, either way) in rad and ``speed``
    over ground at depth in m/s are means of the holes; ``acceleration`` is the tip's greatest in m/s2,
    ``work`` the tractor's in J a plant. Needs the project where it runs: its workers load the partners' FMUs.
    """
    system = load_system()
    system = replace(
        system, components=tuple(replace(c, fmu=fmu) if c.name == "linkage" else c for c in system.components)
    )
    row = run.row_of(
        system.with_parameters(
            {
                "drivetrain.plant.spacing": spacing,
                "drivetrain.speed.cruise": cruise,
                **{f"linkage.{name}": value for name, value in parameters.items()},
            }
        ),
        PLANTS,
    )
    try:
        record = run.run(
            row.system,
            "extrapolated",
            STEP,
            row.stop,
            watched={**run.WATCHED, "linkage.tip.ax": "m/s2", "linkage.tip.ay": "m/s2"},
        )
    except SystemFault as fault:
        raise Refused(str(fault)) from fault
    holes = record.holes
    if not holes:
        raise Refused("the tip never went into the soil and out again")
    return {
        "hole": float(np.mean([hole.length for hole in holes])),
        "posture": float(np.mean([abs(hole.lean) for hole in holes])),
        "acceleration": float(np.hypot(record["linkage.tip.ax"], record["linkage.tip.ay"]).max()),
        "depth": float(np.mean([hole.depth for hole in holes])),
        "speed": float(np.mean([hole.speed for hole in holes])),
        "work": float(record["drivetrain.energy.tractor"][-1]) / len(holes),
    }
