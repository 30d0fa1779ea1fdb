"""The exact inputs and results of the experiments that the FMU carries, in 50-digit arithmetic.

    python -m fmu_src.oracle.reference_results

writes them beside fmu_src/reference/experiments.toml, each number as the double nearest to the exact one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from mpmath import mp, mpf

from fmu_src.exporter.reference import Definition, definitions, file_of
from fmu_src.interface import Interface, load_interface
from fmu_src.oracle.dynamics import Dynamics
from fmu_src.oracle.oracle import Oracle

DIGITS = 50


def inputs(of: Definition, t: mpf) -> dict[str, mpf]:
    """The inputs at this time: the law in experiments.toml."""
    w, ripple, p = mpf(of.w), mpf(of.ripple), 2 * mp.pi * mpf(of.ripple_frequency)
    swing = ripple * (1 - mp.cos(p * t)) / p if ripple else 0
    return {
        "crank.phi": mpf(of.phi_0) + w * (t + swing),
        "crank.w": w * (1 + ripple * mp.sin(p * t)),
        "crank.a": w * ripple * p * mp.cos(p * t),
        "machine.v": mpf(of.v),
        "tip.fx": mpf(of.force[0]),
        "tip.fy": mpf(of.force[1]),
    }


def outputs(of: Definition, t: mpf, oracle: Oracle, dynamics: Dynamics) -> dict[str, mpf]:
    """All outputs at this time, and the energies."""
    phi, w, a, v, fx, fy = inputs(of, t).values()
    (x, y), (dx, dy), (ddx, ddy) = oracle.tip(phi, 2)
    vx, vy, ax, ay, s = dx * w, dy * w, ddx * w**2 + dx * a, ddy * w**2 + dy * a, v * t
    return {
        "tip.x": x, "tip.y": y, "tip.vx": vx, "tip.vy": vy, "tip.ax": ax, "tip.ay": ay,
        "tip.angle": oracle.nozzle_angle(phi, 0)[0],
        "ground.x": s + x, "ground.y": y, "ground.vx": v + vx, "ground.vy": vy, "ground.ax": ax, "ground.ay": ay,
        "machine.s": s, "assembly.margin": oracle.margin(phi, 0)[0],
        **dynamics.outputs(phi, w, a, (v, 0), (fx, fy)),
    }  # fmt: skip


def reference_files(interface: Interface) -> dict[Path, str]:
    """What the tables beside experiments.toml must contain."""
    files = {}
    for of in definitions(interface):
        changed = {name.partition(".")[2]: value for name, value in of.parameters.items()}
        oracle = Oracle({name: changed.get(name, value) for name, value in interface.geometry.items()})
        masses = {name: changed.get(name, value) for name, value in interface.masses.items()}
        dynamics = Dynamics(oracle, masses, interface.gravity)
        with mp.workdps(DIGITS):
            given = ({"time": t} | inputs(of, t) for t in map(mpf, of.input_times))
            exact = ({"time": t} | outputs(of, t, oracle, dynamics) for t in map(mpf, of.result_times))
            files[file_of(of, "in")] = table([v.name for v in interface.of_kind("input")], given)
            files[file_of(of, "ref")] = table([v.name for v in interface.of_kind("output")], exact)
    return files


def table(names: list[str], rows: Iterable[Mapping[str, mpf]]) -> str:
    lines = [",".join(["time", *names])]
    lines += (",".join(repr(float(row[name]) + 0.0) for name in ["time", *names]) for row in rows)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for path, content in reference_files(load_interface()).items():
        path.write_text(content, encoding="ascii")
