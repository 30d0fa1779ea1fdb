"""What the readable edition says of masses, where pages quote it; its values are the native FMU's (test_slave.py)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fmu_src.exporter.reference import definitions
from fmu_src.interface import load_interface
from fmu_src.twin import dynamics
from fmu_src.twin.linkage import Geometry, solve


def test_the_figures_that_the_pages_tell():
    """Of the example, at a steady 65 turns a minute, without soil: connecting.md, "Masses"."""
    (example,) = (of for of in definitions(load_interface()) if of.name == "with_masses")
    phi, w = np.linspace(0, math.tau, 7201), 65 * math.tau / 60
    bodies = dynamics.bodies_of(example.parameters)
    moving = dynamics.move(Geometry(), solve(Geometry(), phi), bodies)
    inertia, slope = dynamics.inertia(moving)
    torque = slope * w**2 / 2 + 9.80665 * dynamics.moment(moving)[1].imag
    assert [round(float(value), 4) for value in (inertia.min(), inertia.max())] == [0.0008, 0.1126]
    assert [round(float(value), 1) for value in (torque.min(), torque.max())] == [-10.2, 3.0]
    assert sum(body.m for body in bodies.values()) == pytest.approx(3.45)
