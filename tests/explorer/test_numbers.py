"""What the page computes is what the native FMU computes, to the bit; its figures are those of the scenarios."""

from __future__ import annotations

import base64
import math
import random
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from fmu_src.interface import Interface
from scenarios.common import measures
from scenarios.common.instance import Refused
from scenarios.common.linkage import LinkageFmu
from tests.explorer.conftest import settled, until
from tests.harness.host import DISCARD, OK, Instance
from tests.harness.masses import MASSES

DESIGNS, ANGLES = 1000, 10
OPERATION = ("crank.w", "plant.spacing")

# Poses of designs: all outputs as bytes, or the message of the refusal, a design and angle each.
POSES = """(designs) => designs.map(({values, angles}) => {
    window.explorer.set(values);
    return {
        speed: window.explorer.get("machine.v"),
        poses: angles.map((phi) => {
            try {
                const found = window.explorer.pose(phi);
                const bytes = new Uint8Array(new Float64Array(Object.values(found)).buffer);
                return [Object.keys(found).join(), btoa(String.fromCharCode(...bytes))];
            } catch (problem) {
                return ["", problem.message];
            }
        }),
    };
})"""


@pytest.fixture
def version() -> int:
    """The FMI version of what `new` gives: that of the page's kernel."""
    return 3


def some_designs(interface: Interface, count: int) -> Iterator[dict[str, Any]]:
    """Designs around the published one, some of which cannot close, each with angles of which some are large."""
    draw = random.Random(14)
    parameters = [v for v in interface.of_kind("parameter") if v.unit and v.name != "crank.smoothing"]
    for k in range(count):
        spread = draw.choice((0.01, 0.1, 0.3))
        values = {v.name: v.start * (1 + spread * draw.uniform(-1, 1)) for v in parameters}
        values |= {"crank.w": draw.uniform(0.1, 20), "plant.spacing": draw.uniform(0, 1)}
        reach = draw.choice((7.0, 1e3, 2e8))
        yield {"values": values, "angles": [draw.uniform(-reach, reach) for _ in range(ANGLES)], "number": k}


def native_poses(instance: Instance, design: dict[str, Any], speed: float, names: list[str]) -> Iterator[bytes | str]:
    """The same from the native FMU: in initialization mode, with what the page sets."""
    values = {name: value for name, value in design["values"].items() if name != "plant.spacing"}
    instance.set(values | {"machine.v": speed})
    for phi in design["angles"]:
        travel = design["values"]["plant.spacing"] * phi / (2 * math.pi)
        instance.set({"crank.phi": phi, "machine.s": travel})
        status, found = instance.try_get(names)
        if status == OK:
            yield np.array(found).tobytes()
        else:
            assert status == DISCARD
            yield instance.messages[-1].text.partition(": ")[2]


def test_ten_thousand_poses_to_the_bit(page, new: Callable[..., Instance], interface: Interface):
    """Random designs and angles, those that cannot be reached too, which are refused with the same words."""
    names = [v.name for v in interface.of_kind("output")]
    designs = list(some_designs(interface, DESIGNS))
    native = new().setup().enter()
    compared = refused = 0
    for start in range(0, DESIGNS, 100):
        batch = designs[start : start + 100]
        for design, answer in zip(batch, page.evaluate(POSES, batch), strict=True):
            read = next((given.split(",") for given, _ in answer["poses"] if given), names)
            expected = native_poses(native, design, answer["speed"], read)
            for (given, text), own in zip(answer["poses"], expected, strict=True):
                assert (base64.b64decode(text) if given else text) == own, design
                compared, refused = compared + 1, refused + (not given)
    assert compared == DESIGNS * ANGLES and compared / 100 < refused < compared / 2


@pytest.fixture(scope="module")
def linkage(fmu_files) -> Iterator[Callable[[float], LinkageFmu]]:
    """The native FMU over whole turns, for a plant spacing."""
    opened: list[LinkageFmu] = []

    def with_spacing(spacing: float) -> LinkageFmu:
        opened.append(LinkageFmu(fmu_files[2], spacing))
        return opened[-1]

    yield with_spacing
    for one in opened:
        one.close()


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"geometry.L1": 0.055},
        {"geometry.L4": 0.014, "plant.spacing": 0.3},
        {"geometry.L7": 0.24, "ridge.depth": 0.08},
    ],
    ids=str,
)
def test_figures_are_those_of_the_scenarios(page, linkage, values):
    """Found independently, between samples of a fine turn by the scenarios' measures."""
    page.evaluate("(values) => window.explorer.set(values)", values)
    found = page.evaluate("window.explorer.figures()")
    depth = values.get("ridge.depth", page.evaluate("window.explorer.get('ridge.depth')"))
    geometry = {name: value for name, value in values.items() if name.startswith("geometry.")}
    turn = linkage(values.get("plant.spacing", 0.4)).run(0.05, geometry)
    phi, static, dynamic = turn.phi_deg, turn.static_mm, turn.dynamic_mm
    top, bottom = measures.highest(phi, static.imag), measures.lowest(phi, static.imag)
    surface = bottom.value + depth * 1e3

    def at_bottom(signal: np.ndarray) -> float:
        return float(np.interp(bottom.phi_deg, phi, signal))

    hole = measures.hole(dynamic, surface)
    inside = (phi > 90) & (phi < 300) & (static.imag < surface)
    axis = dynamic[inside].real + (surface - dynamic[inside].imag) / np.tan(turn["tip.angle"][inside])
    ends = [*axis, hole.entry.real, hole.exit.real]
    assert found["height"] * 1e3 == pytest.approx(top.value - bottom.value, abs=1e-6)
    assert found["hole"] * 1e3 == pytest.approx(hole.size, abs=1e-3)
    assert found["swept"] * 1e3 == pytest.approx(max(ends) - min(ends), abs=2e-3)
    assert math.degrees(found["lean"]) == pytest.approx(math.degrees(at_bottom(turn["tip.angle"])) + 90, abs=1e-4)
    assert found["ground_speed"] == pytest.approx(at_bottom(turn["ground.vx"]), abs=1e-5)
    assert found["margin"] == pytest.approx(measures.lowest(phi, turn["assembly.margin"]).value, abs=1e-6)
    assert found["peak_acceleration"] == pytest.approx(measures.highest(phi, turn.acceleration).value, rel=1e-6)


def test_published_figures(page):
    """The 334.9 mm of the paper, within what rounded lengths do to it; its hole at the surface that gives it."""
    found = page.evaluate("window.explorer.figures()")
    assert found["height"] * 1e3 == pytest.approx(334.9, abs=1.5)
    assert found["hole"] * 1e3 == pytest.approx(46.7, abs=0.05)


DIFFERENCES = """({name, step}) => {
    const {explorer} = window;
    const middle = explorer.get(name);
    const sides = [step, -step].map((side) => { explorer.set({[name]: middle + side}); return explorer.figures(); });
    explorer.set({[name]: middle});
    return Object.fromEntries(Object.keys(sides[0]).map((key) => [key, (sides[0][key] - sides[1][key]) / (2 * step)]));
}"""


@pytest.mark.parametrize("is_held", [False, True], ids=["planting depth", "surface held"])
def test_derivatives_against_differences(page, is_held):
    """Every figure by every quantity, where the surface goes with the lowest point and where the machine holds it."""
    design = MASSES | {"geometry.L2": 0.106, "geometry.XG": 0.104}  # masses above 0, which is the least
    page.evaluate("(values) => window.explorer.set(values)", design)
    if is_held:
        page.locator("#surface-held").check()
        settled(page)
    gradients = page.evaluate("window.explorer.gradients()")
    names = list(gradients["hole"])
    assert ("ridge.y" in names) == is_held and len(names) >= 21
    for name in names:
        step = 1e-6 * max(abs(page.evaluate("(name) => window.explorer.get(name)", name)), 0.01)
        for key, by in page.evaluate(DIFFERENCES, {"name": name, "step": step}).items():
            assert gradients[key].get(name, 0.0) == pytest.approx(by, rel=2e-6, abs=2e-6), (key, name)


def test_stepped_as_a_master_steps_it(page, interface: Interface):
    """The second tab's errors are those that the scenario measures through FMI 2.0 with its own ripple."""
    from scenarios.common.instance import UnpackedFmu
    from scenarios.speed_vs_error.coupling.crank_profiles import PROFILES
    from scenarios.speed_vs_error.coupling.measure import RUNGS, measure
    from tests.conftest import FMU_FILES

    keys = {"held": "held", "angle": "angle", "angle_speed": "angle_speed",
            "angle_speed_acceleration": "angle_speed_acceleration"}  # fmt: skip
    ripple = next(profile for profile in PROFILES if profile.key == "ripple")
    with UnpackedFmu(FMU_FILES[2]) as fmu:
        measured = measure(fmu, [ripple], [rung for rung in RUNGS if rung.key in keys], [10.0], lambda steps: None)
    page.locator("#tab-coupling").click()
    until(page, "document.querySelector('[data-rung=at_step_end]').dataset.value !== undefined")
    for rung, key in keys.items():
        shown = float(page.locator(f"[data-rung={rung}]").get_attribute("data-value")) / 1e3
        assert shown == pytest.approx(measured.at("ripple", key, 10.0).worst[0], rel=1e-6), rung
    assert float(page.locator("[data-rung=at_step_end]").get_attribute("data-value")) == 0


def test_refusal_has_the_same_words_in_python(linkage):
    """What the page reads of the FMU's message is there: dyad, angle, millimetres."""
    with pytest.raises(Refused, match=r"dyad ABD at crank\.phi = \S+ rad, where distance AD is \S+ mm too long"):
        linkage(0.4).run(1.0, {"geometry.L1": 0.08})
