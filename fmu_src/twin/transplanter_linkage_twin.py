"""The twin as an FMU: linkage.py and motion.py behind the variables of interface.toml.

PythonFMU loads this file inside the host; the files beside it come along in the FMU's resources. To change the
mechanism, edit linkage.py; to add an output, declare it in interface.toml: what has no line in `_update` is computed
by its equation there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

if TYPE_CHECKING or __package__:
    from ..interface import Computed, Parameter, Unknown, Variable, load_interface
    from . import dynamics
    from .linkage import Geometry, Solution, solve
    from .motion import Crank, CrankMotion, Travel
else:  # inside the FMU
    from transplanter_linkage_parts import dynamics
    from transplanter_linkage_parts.interface import Computed, Parameter, Unknown, Variable, load_interface
    from transplanter_linkage_parts.linkage import Geometry, Solution, solve
    from transplanter_linkage_parts.motion import Crank, CrankMotion, Travel

INTERFACE = load_interface()  # once: hosts may delete the unpacked FMU and load it again


class TransplanterLinkageTwin(Fmi2Slave):  # type: ignore[misc]  # PythonFMU has no types
    """One instance; the values of all variables are in `self.values` by name."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.description = INTERFACE.model.description + " (readable Python edition)"
        self.values: dict[str, Any] = {v.name: v.start if v.start is not None else 0.0 for v in INTERFACE.variables}
        self.geometry: Geometry | None = None
        self.crank, self.travel = Crank(), Travel()
        self.last_step = 0.0  # s; 0 before the first step
        self.force = (0.0, 0.0)
        for variable in INTERFACE.variables:
            self._register(variable)

    def _register(self, declared: Variable) -> None:
        """Register with the declared value reference, not the one that PythonFMU counts."""

        def read() -> Any:
            if isinstance(declared, Computed):
                self._update()
            return self.values[declared.name]

        def write(value: float) -> None:
            # Geometry checks its own values, when it is used
            is_geometry = declared.name.startswith("geometry.")
            if isinstance(declared, Parameter) and not is_geometry and not declared.accepts(value):
                raise ValueError(f"{declared.name} = {value:g}: must be {declared.demand}")
            self.values[declared.name] = value
            self.is_fresh = False

        variable = (Boolean if declared.type == "boolean" else Real)(
            declared.name,
            causality=Fmi2Causality.__members__.get(declared.kind, Fmi2Causality.local),  # the rest is local to it
            variability=Fmi2Variability.fixed if declared.kind == "parameter" else Fmi2Variability.continuous,
            initial=Fmi2Initial.exact if declared.kind == "parameter" or declared.is_state else None,
            description=declared.text,
            getter=read,
            setter=write if declared.start is not None else None,
        )
        variable.value_reference = declared.value_reference
        self.vars[declared.value_reference] = variable
        self.is_fresh = False

    def setup_experiment(  # as PythonFMU calls it
        self,
        start_time: float,
        stop_time: float | None = None,  # noqa: ARG002 - no use for it
        tolerance: float | None = None,  # noqa: ARG002 - nothing is iterated
    ) -> None:
        self.values["time"] = start_time

    def exit_initialization_mode(self) -> None:
        self._follow_inputs()
        self._solve(0)  # an impossible geometry or pose raises here
        self.travel = replace(self.travel, until_sample=self.travel.s)
        if self.values["crank.at_step_end"]:
            # the first step brings the samples of its end, so these count
            self.crank = self.crank.start(*self._crank_inputs())
            self.travel = replace(self.travel, sample=self.travel.v)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Carry crank and machine to the end of the step. Where no pose is there, UnreachablePose ends the run:
        hosts take what PythonFMU makes of a discarded step for a simulation that ended well.
        """
        at_end = self.values["crank.at_step_end"]
        gap = step_size if at_end else self.last_step
        smoothing = self.values["crank.smoothing"]
        crank = self.crank.advance(*self._crank_inputs(), gap, step_size, at_step_end=at_end, smoothing=smoothing)
        solve(self._geometry(), crank.end.phi, order=0)
        self.crank = crank
        self.travel = self.travel.advance(self.values["machine.v"], gap, step_size, at_end)
        self.force = (self.values["tip.fx"], self.values["tip.fy"])
        self.values["time"] = current_time + step_size
        self.last_step = step_size
        self.is_fresh = False
        return True

    def _crank_inputs(self) -> tuple[float, float, float]:
        return self.values["crank.phi"], self.values["crank.w"], self.values["crank.a"]

    def _follow_inputs(self) -> None:
        """Before the first step the outputs belong to the inputs as they are set."""
        self.geometry = None
        self.crank = replace(self.crank, end=CrankMotion(*self._crank_inputs()))
        self.travel = replace(self.travel, s=self.values["machine.s"], v=self.values["machine.v"])
        self.force = (self.values["tip.fx"], self.values["tip.fy"])

    def _geometry(self) -> Geometry:
        if self.geometry is None:
            prefix = "geometry."
            self.geometry = Geometry(
                **{name[len(prefix) :]: value for name, value in self.values.items() if name.startswith(prefix)}
            )
        return self.geometry

    def _solve(self, order: int) -> Solution:
        return solve(self._geometry(), self.crank.end.phi, order)

    def _update(self) -> None:
        """Compute the outputs, once after each change."""
        if self.is_fresh:
            return
        if self.last_step == 0:
            self._follow_inputs()
        solution, crank, travel = self._solve(2), self.crank.end, self.travel
        tip = solution.tip[0]
        velocity = solution.velocity(crank.w)
        acceleration = solution.acceleration(crank.w, crank.a)
        written_out = {
            "tip.x": tip.real,
            "tip.y": tip.imag,
            "tip.vx": velocity.real,
            "tip.vy": velocity.imag,
            "tip.ax": acceleration.real,
            "tip.ay": acceleration.imag,
            "tip.angle": solution.angle[0],
            "ground.x": travel.s + tip.real,
            "ground.y": tip.imag,
            "ground.vx": travel.v + velocity.real,
            "ground.vy": velocity.imag,
            "ground.ax": travel.a + acceleration.real,
            "ground.ay": acceleration.imag,
            "machine.s": travel.s,
            "der(machine.s)": travel.v,
            "assembly.margin": solution.margin,
        }
        moving = dynamics.move(self._geometry(), solution, dynamics.bodies_of(self.values))
        rest = [variable for variable in INTERFACE.unknowns if variable.name not in written_out]
        self.values |= written_out | self._by_equations(rest, solution, moving) | self._locals(solution, moving)
        self.is_fresh = True

    def _by_equations(
        self, variables: list[Unknown], solution: Solution, moving: dict[str, dynamics.MovingBody]
    ) -> dict[str, float]:
        """What is not written out above, by the equations in interface.toml."""
        moment = dynamics.moment(moving)
        pose = {
            "": (1.0,),
            "tip.x": tuple(tip.real for tip in solution.tip),
            "tip.y": tuple(tip.imag for tip in solution.tip),
            "tip.angle": solution.angle,
            "assembly.margin": (solution.margin,),
            "linkage.mass": (sum(b.body.m for b in moving.values()),),
            "linkage.inertia": tuple(dynamics.inertia(moving)),
            "linkage.moment.x": tuple(np.real(moment)),
            "linkage.moment.y": tuple(np.imag(moment)),
        }
        crank, travel = self.crank.end, self.travel
        motion = {"": 1.0, "crank.w": crank.w, "crank.w^2": crank.w**2, "crank.a": crank.a}
        motion |= {"machine.s": travel.s, "machine.v": travel.v, "machine.a": travel.a}
        motion |= dict(zip(("tip.fx", "tip.fy"), self.force, strict=True)) | {"gravity": self.values["gravity"]}
        return {
            v.name: sum(p.coefficient * pose[p.pose][p.order] * motion[p.motion] for p in v.equation) for v in variables
        }

    def _locals(self, solution: Solution, moving: dict[str, dynamics.MovingBody]) -> dict[str, float]:
        """What one looks at: points, energies, forces in the joints."""
        crank, travel, gravity = self.crank.end, self.travel, self.values["gravity"]
        mass = sum(b.body.m for b in moving.values())
        S, S1 = dynamics.moment(moving)[:2]
        values = {
            "linkage.kinetic": dynamics.inertia(moving)[0] * crank.w**2 / 2
            + crank.w * travel.v * S1.real
            + mass * travel.v**2 / 2,
            "linkage.potential": gravity * S.imag,
        }
        forces, values["crank.OA.tau"], values["crank.CD.tau"] = dynamics.joint_forces(
            solution, moving, crank.w, crank.a, travel.a + 1j * gravity, complex(*self.force)
        )
        for name, force in forces.items():
            values |= {f"joint.{name}.fx": force.real, f"joint.{name}.fy": force.imag}
        for name, point in solution.joints.items():
            if name != "O":
                values |= {f"joint.{name}.x": point.real, f"joint.{name}.y": point.imag}
        return values
