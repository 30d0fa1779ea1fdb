"""What the row's linkage does on level ground at a steady speed: the figures that studies, sweeps and cycles have.

The row's own holes differ from them: its ridge is wavy, its mean height is the published linkage's, and its machine
starts, slows and stops.
"""

from __future__ import annotations

import math

from transplanter_linkage.measures import GEOMETRY, Operation, Turn

from scenarios.common.instance import FmuError, Refused
from scenarios.common.operating_point import PLANTING_SPEED, SPACING
from scenarios.common.turn import FmuSource
from scenarios.common.variants import PREFIX
from scenarios.field_row.run import start_value
from scenarios.field_row.system import System

LINKAGE = "linkage"  # the component to which a design belongs


def level(system: System) -> dict[str, float] | None:
    """The measures at the row's spacing and cruising speed, SI units, the ridge's surface as far above the lowest point
    as the published hole's; None where the linkage is another than this project's.
    """
    component = system.component(LINKAGE)
    spacing = start_value(system, "drivetrain.plant.spacing") or SPACING
    cruise = start_value(system, "drivetrain.speed.cruise")
    speed = 2 * math.pi * cruise / spacing if cruise else PLANTING_SPEED
    if component is None:
        return None
    try:
        with FmuSource(component.fmu) as source:
            depth = source.published_depth()
            set_ = {name: start_value(system, f"{LINKAGE}.{PREFIX}{name}") for name in GEOMETRY}
            source.set({name: value for name, value in set_.items() if value is not None})
            return Turn(source, Operation(spacing=spacing, w=speed, depth=depth)).measure()
    except (FmuError, Refused):
        return None
