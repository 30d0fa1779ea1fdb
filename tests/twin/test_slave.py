"""The twin's FMU against the native one, in the same host: same variables, same steps, same answers."""

from __future__ import annotations

import math
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException

from fmu_src.exporter.model_description import TWIN
from fmu_src.interface import Interface
from scenarios.common.operating_point import PLANTING_SPEED as SPEED

PROJECT_ROOT = Path(__file__).resolve().parents[2]
TWIN_FILE = PROJECT_ROOT / "build" / "twin" / "TransplanterLinkageTwin.fmu"

# absolute, in the units of the outputs: both round, the twin a little more (numpy's order of operations)
TOLERANCE = {
    "m": 2e-15,
    "m/s": 3e-14,
    "m/s2": 1e-12,
    "rad": 1e-14,
    "N.m": 1e-14,
    "N": 1e-12,
    "kg.m2": 1e-15,
    "1": 1e-14,
}


class Host:
    """One FMU in fmpy, driven step by step."""

    def __init__(self, file: Path, folder: Path) -> None:
        self.description = fmpy.read_model_description(str(file))
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.unit = {v.name: v.unit for v in self.description.modelVariables if v.causality == "output"}
        fmpy.extract(str(file), str(folder))
        self.fmu = fmpy.instantiate_fmu(str(folder), self.description, "CoSimulation")

    def start(self, at_step_end: bool = False, **parameters: float) -> None:
        self.fmu.reset()
        self.fmu.setupExperiment(startTime=0.0)
        self.set(parameters)
        self.fmu.setBoolean([self.reference["crank.at_step_end"]], [at_step_end])
        self.fmu.enterInitializationMode()

    def set(self, values: dict[str, float]) -> None:
        self.fmu.setReal([self.reference[name] for name in values], list(values.values()))

    def step(self, time: float, h: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=h)

    def outputs(self) -> dict[str, float]:
        return dict(zip(self.unit, self.fmu.getReal([self.reference[name] for name in self.unit]), strict=True))


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Host:
    if not TWIN_FILE.exists():
        pytest.fail(f"{TWIN_FILE.relative_to(PROJECT_ROOT)} is missing: run make build", pytrace=False)
    return Host(TWIN_FILE, tmp_path_factory.mktemp("twin"))


@pytest.fixture(scope="module")
def native(fmu_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Host:
    return Host(fmu_file, tmp_path_factory.mktemp("native"))


def assert_agree(twin: Host, native: Host, factor: float = 1.0) -> None:
    ours, theirs = twin.outputs(), native.outputs()
    worst = {
        name: abs(ours[name] - theirs[name]) / (factor * TOLERANCE[unit])
        for name, unit in twin.unit.items()
        if abs(ours[name] - theirs[name]) > factor * TOLERANCE[unit]
    }
    assert not worst, f"beyond the tolerance by these factors: {worst}"


def angle(t: float) -> float:
    """Crank angle with a ripple of 10 % in speed at 3 Hz."""
    return SPEED * (t + 0.1 * (1 - math.cos(6 * math.pi * t)) / (6 * math.pi))


def speed(t: float) -> float:
    return SPEED * (1 + 0.1 * math.sin(6 * math.pi * t))


def acceleration(t: float) -> float:
    return SPEED * 0.1 * 6 * math.pi * math.cos(6 * math.pi * t)


def test_variables_are_those_of_the_interface(twin: Host, native: Host, interface: Interface):
    def facts(host: Host) -> list[tuple]:
        return [
            (v.name, v.valueReference, v.causality, v.variability, v.initial, v.type, v.unit, v.start, v.description)
            for v in host.description.modelVariables
        ]

    assert facts(twin) == facts(native)
    assert twin.description.modelName == interface.model.name + TWIN.suffix


@pytest.mark.parametrize("at_step_end", [False, True], ids=["step start", "step end"])
@pytest.mark.parametrize("given", [("phi",), ("phi", "w"), ("phi", "w", "a")], ids=" ".join)
def test_steps_agree_on_every_rung(twin: Host, native: Host, given: tuple[str, ...], at_step_end: bool):
    """Also over varying steps, with a force, a changing machine speed, and the angle modulo one turn."""
    signal = {"phi": angle, "w": speed, "a": acceleration}
    steps = [0.01, 0.01, 0.004, 0.02, 0.01, 0.013] * 20
    for host in (twin, native):
        host.start(at_step_end, **{"machine.s": 3.0, "geometry.L1": 0.052})
        host.fmu.exitInitializationMode()
    assert_agree(twin, native)
    time = 0.0
    for number, h in enumerate(steps):
        at = time + h if at_step_end else time
        values = {f"crank.{name}": signal[name](at) for name in given}
        values["crank.phi"] = math.fmod(values["crank.phi"], 2 * math.pi)
        values |= {"machine.v": 0.43 + 0.1 * math.sin(at), "tip.fx": 10 * math.cos(at), "tip.fy": 20.0}
        for host in (twin, native):
            host.set(values)
            host.step(time, h)
        time += h
        # differences of angles over a step amplify their rounding: by 1/h in speed, 1/h^2 in acceleration
        amplified = 1.0 if "a" in given else 30.0 if "w" in given else 3e3
        assert_agree(twin, native, amplified)
        assert number < 3 or native.outputs()["tip.x"] != 0


@pytest.mark.parametrize("at_step_end", [False, True], ids=["step start", "step end"])
@pytest.mark.parametrize("smoothing", [0.0, 0.004, 0.03, 0.2])
@pytest.mark.parametrize("given", [("phi",), ("phi", "w"), ("phi", "w", "a")], ids=" ".join)
def test_noise_and_jumps_agree(twin: Host, native: Host, given: tuple[str, ...], smoothing: float, at_step_end: bool):
    """Noisy samples whose rates jump now and then, over varying steps, with and without smoothing.

    The crank stands still before its rates begin to be given.
    """
    for host in (twin, native):
        host.start(at_step_end, **{"crank.smoothing": smoothing})
        host.fmu.exitInitializationMode()
    time, phi = 0.0, 0.0
    for number in range(150):
        h = (0.01, 0.01, 0.01, 0.01, 0.004, 0.02, 0.0003)[number // 7 % 7]
        w, a = (3.0, 6.0, -2.0)[number // 30 % 3], (0.0, 1.5)[number // 40 % 2]
        noise = 1e-3 * math.sin(1e3 * number)  # no ties where it is judged whether a slope jumped
        if 20 <= number < 30:
            w = a = noise = 0.0
        signal = {"phi": (phi + noise) % (2 * math.pi), "w": w + a * time + noise, "a": a}
        for host in (twin, native):
            host.set({f"crank.{name}": signal[name] for name in given if name == "phi" or number >= 30})
            host.step(time, h)
        time, phi = time + h, phi + w * h
        # a fit's normal equations lose what its least squares keep; over 0.3 ms, 1/h^2 is 1e7
        assert_agree(twin, native, 3e8 if smoothing or given == ("phi",) else 3e4)


@pytest.mark.parametrize("at_step_end", [False, True], ids=["step start", "step end"])
@pytest.mark.parametrize("begin", [(0, 0), (1, 1), (1, 9), (7, 9), (9, 7)], ids="w at {0[0]}, a at {0[1]}".format)
@pytest.mark.parametrize("from_rest", [False, True], ids=["running", "from rest"])
def test_rates_that_are_given_later_agree(
    twin: Host, native: Host, begin: tuple[int, int], from_rest: bool, at_step_end: bool
):
    """crank.w and crank.a begin to be given at some step; before, and at rest, they are 0."""
    h, jerk = 0.01, 40.0
    for host in (twin, native):
        host.start(at_step_end)
        host.fmu.exitInitializationMode()
    for number in range(16):
        time = number * h
        at = time + h if at_step_end else time
        if from_rest:
            phi, w, a = jerk * at**3 / 6, jerk * at**2 / 2, jerk * at
        else:
            phi, w, a = angle(at), speed(at), acceleration(at)
        values = {"crank.phi": phi}
        values |= {"crank.w": w} if number >= begin[0] else {}
        values |= {"crank.a": a} if number >= begin[1] else {}
        for host in (twin, native):
            host.set(values)
            host.step(time, h)
        assert_agree(twin, native, 3e3)


def test_before_the_first_step_outputs_follow_the_inputs(twin: Host, native: Host):
    for host in (twin, native):
        host.start()
        host.set({"crank.phi": 2.5, "crank.w": 3.0, "crank.a": -1.0, "machine.v": 0.4, "tip.fx": 3.0})
    assert_agree(twin, native)
    for host in (twin, native):
        host.set({"crank.phi": 1.0})
    assert_agree(twin, native)


def test_unreachable_pose_ends_the_run_and_changes_nothing(twin: Host):
    """What PythonFMU makes of an exception is fmi2Fatal (4)."""
    twin.start(**{"geometry.L2": 0.11, "geometry.L3": 0.08})
    twin.set({"crank.w": SPEED})
    twin.fmu.exitInitializationMode()
    before, time, h, status = twin.outputs(), 0.0, 0.02, 0
    while status == 0 and time < 2:
        twin.set({"crank.phi": SPEED * time})
        try:
            twin.step(time, h)
            before, time = twin.outputs(), time + h
        except FMICallException as refused:
            status = refused.status
    assert status == 4
    assert twin.outputs() == before


@pytest.mark.parametrize("parameter", ["geometry.L1", "geometry.L2"])
def test_impossible_geometry_is_refused(twin: Host, parameter: str):
    twin.start(**{parameter: -0.05})
    with pytest.raises(FMICallException):
        twin.fmu.exitInitializationMode()


def test_runs_again_from_a_new_folder_in_the_same_process():
    """Hosts unpack an FMU for each run and delete it afterwards."""
    for _ in range(2):
        result = fmpy.simulate_fmu(str(TWIN_FILE), stop_time=0.01, output_interval=0.005, output=["tip.x"])
        assert result["tip.x"][0] < 0
