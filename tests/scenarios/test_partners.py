"""The partners of the field row, each for its physics, as Python objects; and their FMUs, for the standard."""

from __future__ import annotations

import json
import math
import random
import zipfile
from collections.abc import Callable

import pytest
from fmpy.validation import validate_fmu
from pythonfmu import Fmi2Slave

from scenarios.field_row.partners import drivetrain as drivetrain_module
from scenarios.field_row.partners.build import build
from scenarios.field_row.partners.conveyor import GRAVITY, Conveyor
from scenarios.field_row.partners.drivetrain import Drivetrain
from scenarios.field_row.partners.planting_partner import BASE_UNITS, Partner
from scenarios.field_row.partners.soil import Soil

PARTNERS = (Drivetrain, Conveyor, Soil)


def started(kind: type[Partner], **values: float) -> Partner:
    """A partner with these values (names with _ for .), initialized at t = 0."""
    partner = kind(instance_name="one")
    for name, value in values.items():
        dotted = next(n for n in partner.value if n.replace(".", "_") == name)
        partner.value[dotted] = value
    partner.setup_experiment(0.0)
    partner.enter_initialization_mode()
    partner.exit_initialization_mode()
    return partner


# --- drivetrain ---------------------------------------------------------------------------------


def drive(
    partner: Partner,
    stop: float,
    step: float,
    tau: Callable[[float], float] = lambda t: 0.0,
    fx: Callable[[float], float] = lambda t: 0.0,
) -> dict[str, float]:
    for i in range(round(stop / step)):
        partner.value["crank.tau_bias"], partner.value["machine.fx"] = tau(i * step), fx(i * step)
        partner.do_step(i * step, step)
    return dict(partner.value)


def test_the_crank_turns_once_in_each_spacing():
    v = drive(started(Drivetrain, plant_spacing=0.35, disturbance_share=0.1), 12.0, 0.01)
    turned = v["crank.phi"] + math.pi / 2 + v["shaft.tau"] / 2000.0  # with the shaft's twist: the wheel's angle
    assert v["machine.s"] > 4
    assert turned == pytest.approx(math.tau * v["machine.s"] / 0.35, abs=1e-2)  # damping's share of shaft.tau


def test_the_speed_starts_cruises_and_stops():
    partner = started(Drivetrain, speed_headland=10.0, disturbance_share=0.0)
    cruise = partner.value["speed.cruise"]
    assert [partner.speed(t) / cruise for t in (0.0, 1.5, 5.0, 10.0, 11.5, 20.0)] == pytest.approx([0, 1, 1, 1, 0, 0])
    assert partner.speed(0.75) == pytest.approx(cruise / 2)
    # the way is that of cruising from the first to the second ramp's begin
    assert drive(partner, 12.0, 0.01)["machine.s"] == pytest.approx(10 * cruise, rel=1e-9)


def test_a_constant_torque_twists_the_shaft():
    v = drive(started(Drivetrain, disturbance_share=0.0), 8.0, 0.01, tau=lambda t: 12.0)
    unloaded = drive(started(Drivetrain, disturbance_share=0.0), 8.0, 0.01)
    assert unloaded["crank.phi"] - v["crank.phi"] == pytest.approx(12.0 / 2000.0, rel=1e-6)
    assert v["shaft.tau"] == pytest.approx(12.0, rel=1e-6)


def test_the_shaft_swings_with_its_own_frequency():
    """Released from a torque, damped: w = sqrt(k/J - (c/2J)^2), and the decay of exp(-c/2J t)."""
    partner = started(Drivetrain, speed_ramp=1e6, shaft_c=1.0)  # the wheel all but stands
    for i in range(5000):
        partner.value["crank.tau_bias"] = 10.0
        partner.do_step(i * 1e-3, 1e-3)
    partner.memory["loads"] = None
    partner.memory["slopes"] = (0.0, 0.0, 0.0)
    partner.value["crank.tau_bias"] = 0.0
    rest, samples = partner.value["crank.phi"] + 10.0 / 2000.0, []
    for i in range(400):
        partner.do_step(5 + i * 1e-3, 1e-3)
        samples.append(partner.value["crank.phi"] - rest)
    decay = 1.0 / (2 * 0.2)
    w = math.sqrt(2000.0 / 0.2 - decay**2)
    exact = [
        -0.005 * math.exp(-decay * t) * (math.cos(w * t) + decay / w * math.sin(w * t))
        for t in (i * 1e-3 for i in range(1, 401))
    ]
    assert max(abs(a - b) for a, b in zip(samples, exact, strict=True)) < 1e-6


def test_the_inertia_of_the_linkage_turns_with_the_crank():
    """Given apart or as the crank's own, it makes the same motion; what it stores, the linkage has been given."""
    own = started(Drivetrain, crank_J=0.2 + 0.07)
    apart = started(Drivetrain, crank_J=0.2, crank_inertia=0.07)
    v, own_v = (
        drive(apart, 3.0, 4e-3, tau=lambda t: 4 * math.sin(9 * t)),
        drive(own, 3.0, 4e-3, tau=lambda t: 4 * math.sin(9 * t)),
    )
    for name in ("crank.phi", "crank.w", "crank.a", "shaft.tau", "machine.pull", "energy.tractor"):
        assert v[name] == pytest.approx(own_v[name], rel=1e-12), name
    kinetic = 0.07 * v["crank.w"] ** 2 / 2
    assert v["energy.crank"] - own_v["energy.crank"] == pytest.approx(kinetic, rel=1e-6)
    assert own_v["energy.stored"] - v["energy.stored"] == pytest.approx(kinetic, rel=1e-6)


def test_the_drivetrains_power_balances_to_its_integrators_error(monkeypatch):
    def imbalance(substep: float) -> float:
        monkeypatch.setattr(drivetrain_module, "SUBSTEP", substep)
        partner = started(Drivetrain)
        v = drive(partner, 3.0, 8e-3, tau=lambda t: 6 + 5 * math.sin(31 * t), fx=lambda t: -9 * math.cos(17 * t))
        drag = v["energy.tractor"] - v["energy.crank"] - v["energy.shaft"] - v["energy.stored"]
        return drag - work_of_fx(partner)

    def work_of_fx(partner: Partner) -> float:
        """-fx*v, with fx the straight line through its samples that the partner takes, by Simpson's rule."""
        total, last = 0.0, None
        for i in range(375):
            t, h = i * 8e-3, 8e-3
            fx = -9 * math.cos(17 * t)
            slope = 0.0 if last is None else (fx - last) / h
            last = fx
            for k in range(16):
                a, d = t + k * h / 16, h / 16
                power = [-(fx + slope * (x - t)) * partner.speed(x) for x in (a, a + d / 2, a + d)]
                total += d / 6 * (power[0] + 4 * power[1] + power[2])
        return total

    fine, coarse = abs(imbalance(0.5e-3)), abs(imbalance(4e-3))
    assert fine < 2e-7  # J, of about 60
    assert coarse / fine > 8**3.5  # order 4


def test_the_pull_pays_for_wheel_and_linkage():
    partner = started(Drivetrain, disturbance_share=0.0)
    v = drive(partner, 6.0, 0.01, tau=lambda t: 8.0, fx=lambda t: -20.0)
    assert v["machine.pull"] == pytest.approx(8.0 * math.tau / 0.4 + 20.0, rel=1e-5)


# --- conveyor -----------------------------------------------------------------------------------

NOZZLE = {"tip.x": -0.15, "tip.y": -0.2, "tip.angle": -math.pi / 2}  # upright, its mouth at (-0.15, 0)


def turn(partner: Partner, stop: float, step: float = 0.01, w: float = 6.8, **nozzle: float) -> Partner:
    for i in range(round(stop / step)):
        partner.value |= {**NOZZLE, **nozzle, "crank.phi": -0.5 + w * i * step}
        partner.do_step(i * step, step)
    return partner


def conveyor(**values: float) -> Partner:
    return started(
        Conveyor,
        **{"crank_phi": -0.5, "tip_x": -0.15, "tip_y": -0.2, "cups_empty_rate": 0.0, "flap_scatter": 0.0, **values},
    )


def test_the_seedling_falls_freely_into_a_resting_mouth():
    partner, opened, fall = conveyor(nozzle_shuts=100.0), 0.5 / 6.8, math.sqrt(2 * 0.13 / GRAVITY)
    caught_at, heights = None, {}
    for i in range(400):
        partner.value |= {**NOZZLE, "crank.phi": -0.5 + 6.8 * i * 1e-3}
        partner.do_step(i * 1e-3, 1e-3)
        heights[i + 1] = partner.value["seedling.y"]
        if partner.value["seedling.in_nozzle"] and caught_at is None:
            caught_at = (i + 1) * 1e-3
    assert caught_at == pytest.approx(opened + fall, abs=2.1e-3)  # told after the next step
    for k in (100, 150, 200):
        assert heights[k] == pytest.approx(0.13 - GRAVITY / 2 * (k * 1e-3 - opened) ** 2, abs=1e-12)
    assert partner.value["seedlings.caught"] == 1


@pytest.mark.parametrize("beside", [0.0, 0.017, 0.018, -0.017, -0.018])
def test_a_seedling_is_caught_by_its_place_over_the_mouth(beside):
    """Half the mouth less half the plug: 17.5 mm."""
    partner = turn(conveyor(flap_x=-0.15 + beside), 0.5)
    assert partner.value["seedling.offset"] == pytest.approx(beside, abs=1e-12)
    assert partner.value["seedlings.caught"] == (abs(beside) < 0.0175)
    assert partner.value["seedlings.missed"] == (abs(beside) > 0.0175)
    assert partner.value["seedling.in_nozzle"] == (abs(beside) < 0.0175)


def test_a_leaning_nozzle_has_its_mouth_elsewhere():
    lean = math.radians(10)
    partner = turn(conveyor(), 0.5, **{"tip.angle": -math.pi / 2 + lean})
    assert partner.value["seedling.offset"] == pytest.approx(0.2 * math.sin(lean), abs=1e-12)
    assert partner.value["seedlings.missed"] == 1


def test_the_offset_hardly_depends_on_the_step():
    def offset(step: float) -> float:
        partner = conveyor()
        for i in range(round(0.5 / step)):
            t = i * step
            partner.value |= {
                "crank.phi": -0.5 + 6.8 * t,
                "tip.x": -0.15 - 0.1 * t * t,
                "tip.y": -0.2 - 0.4 * t,
                "tip.angle": -math.pi / 2 - 0.5 * t,
            }
            partner.do_step(t, step)
        return partner.value["seedling.offset"]

    assert abs(offset(0.01) - offset(0.0005)) < 2e-5


def test_the_seedling_stays_until_the_nozzle_shuts_and_the_ring_keeps_step():
    partner, was, changes = conveyor(), False, []
    for i in range(2000):
        phi = -0.5 + 6.8 * i * 1e-3
        partner.value |= {**NOZZLE, "crank.phi": phi}
        partner.do_step(i * 1e-3, 1e-3)
        if partner.value["seedling.in_nozzle"] != was:
            was = not was
            changes.append((was, phi % math.tau))
    assert [c[0] for c in changes] == [True, False, True, False]
    assert changes[1][1] == pytest.approx(4.2, abs=0.01) == changes[3][1]
    assert partner.value["cup.angle"] == pytest.approx((-0.5 + 6.8 * 2.0) / 8, rel=1e-12)
    assert partner.value["cups.opened"] == 3 == partner.value["seedlings.caught"] + 1  # the third is falling


@pytest.mark.parametrize("rate", [0.0, 0.3, 1.0])
def test_cups_are_empty_at_their_rate_and_by_their_seed(rate):
    def counts(seed: int) -> tuple[int, int, int, int]:
        v = turn(conveyor(cups_empty_rate=rate, cups_seed=seed), 200 * math.tau / 6.8 - 0.5).value
        return v["cups.opened"], v["cups.empty"], v["seedlings.caught"], v["seedlings.missed"]

    opened, empty, caught, missed = counts(1)
    assert opened == 200 == empty + caught + missed + (opened - empty - caught - missed)
    assert abs(empty - rate * opened) <= 3 * math.sqrt(opened * rate * (1 - rate))
    assert counts(1) == counts(1)
    assert rate in (0.0, 1.0) or counts(1) != counts(2)


def test_a_seedling_that_the_next_one_overtakes_is_missed():
    partner = turn(conveyor(flap_y=30.0), 2.5)
    assert partner.value["seedlings.missed"] == partner.value["cups.opened"] - 1 == 2


# --- soil ---------------------------------------------------------------------------------------


def flat() -> Partner:
    return started(Soil, ridge_wave=0.0, ridge_height=0.0)


def test_no_force_acts_outside_and_the_soil_always_takes_power():
    soil, chance = started(Soil), random.Random(5)
    inside = 0
    for _ in range(20_000):
        x, y = chance.uniform(-10, 10), chance.uniform(-0.5, -0.2)
        vx, vy = (10 ** chance.uniform(-6, 1) * chance.choice((-1, 1)) for _ in "xy")
        fx, fy = soil.force(x, y, vx, vy, chance.uniform(-math.pi, math.pi))
        if y >= soil.ridge(x):
            assert (fx, fy) == (0.0, 0.0)
        else:
            inside += 1
            assert fx * vx + fy * vy < 0
    assert 5_000 < inside < 15_000


def test_the_end_resists_as_pressure_and_sinkage_say():
    """Straight down, fast, without skin: A (kc/b + kphi) z^n."""
    soil = started(Soil, ridge_wave=0.0, ridge_height=0.0, nozzle_girth=0.0)
    for z in (1e-3, 0.05, 0.1):
        fx, fy = soil.force(0.0, -z, 0.0, -50.0, -math.pi / 2)
        assert fx == pytest.approx(0, abs=1e-12)
        assert fy == pytest.approx(6e-4 * (990 / 0.015 + 1528430) * z**1.1, rel=1e-5)
    assert abs(soil.force(0.0, -0.1, 0.0, 50.0, -math.pi / 2)[1]) < 1e-12  # nothing holds its end back


def test_the_side_resists_with_the_passive_pressure():
    """Rankine's, straight forward, upright: b (Kp gamma z^2/2 + 2 c sqrt(Kp) z)."""
    fx, fy = flat().force(0.0, -0.08, 50.0, 0.0, -math.pi / 2)
    kp = (1 + math.sin(math.radians(28))) / (1 - math.sin(math.radians(28)))
    assert fx == pytest.approx(-0.04 * (kp * 13000 * 0.08**2 / 2 + 2 * 1040 * math.sqrt(kp) * 0.08), rel=1e-5)
    assert fy == pytest.approx(0, abs=1e-12)


def dig(soil: Partner, step: float, at_end: bool = False, seedling: bool = True) -> dict[str, float]:
    """A tip that moves on y = 0.1 cos(2 pi t) - 0.03, x = 0.3 t + 0.1 t^2, from t = 0 to 1.1."""

    def put(t: float) -> None:
        w = math.tau
        soil.value |= {
            "ground.x": 0.3 * t + 0.1 * t * t,
            "ground.vx": 0.3 + 0.2 * t,
            "ground.ax": 0.2,
            "ground.y": 0.1 * math.cos(w * t) - 0.03,
            "ground.vy": -0.1 * w * math.sin(w * t),
            "ground.ay": -0.1 * w * w * math.cos(w * t),
            "tip.angle": -math.pi / 2 - 0.4 * (t - 0.4),
            "seedling.in_nozzle": seedling,
        }

    put(0.0)
    soil.exit_initialization_mode()
    for i in range(round(1.1 / step)):
        put((i + at_end) * step)
        soil.do_step(i * step, step)
    return dict(soil.value)


@pytest.mark.parametrize("at_end", [False, True])
def test_the_hole_is_where_the_path_says(at_end):
    enters = math.acos(0.3) / math.tau
    leaves = 1 - enters
    soil = started(Soil, ridge_wave=0.0, ridge_height=0.0, inputs_at_step_end=at_end)
    v = dig(soil, 0.01, at_end)
    assert v["hole.count"] == 1
    assert v["hole.entry"] == pytest.approx(0.3 * enters + 0.1 * enters**2, abs=1e-6)
    assert v["hole.exit"] == pytest.approx(0.3 * leaves + 0.1 * leaves**2, abs=1e-6)
    assert v["hole.length"] == v["hole.exit"] - v["hole.entry"]
    assert v["hole.depth"] == pytest.approx(0.13, abs=1e-8)
    assert v["plant.x"] == pytest.approx(0.3 * 0.5 + 0.1 * 0.25, abs=1e-6)
    assert v["hole.speed"] == pytest.approx(0.4, abs=1e-6)
    assert v["plant.lean"] == pytest.approx(0.04, abs=1e-9)  # forward: the nozzle's upper end ahead of its tip
    assert (v["plant.count"], v["plant.in_hole"]) == (1, True)


def test_a_hole_without_a_seedling_is_no_plant():
    v = dig(flat(), 0.01, seedling=False)
    assert (v["hole.count"], v["plant.count"], v["plant.in_hole"]) == (1, 0, False)


def test_the_soil_books_the_work_of_its_force():
    def work(step: float, at_end: bool) -> float:
        soil = started(Soil, ridge_wave=0.0, ridge_height=0.0, inputs_at_step_end=at_end)
        return dig(soil, step, at_end)["energy.soil"]

    fine, coarse, at_end = work(0.0005, False), work(0.01, False), work(0.01, True)
    assert fine > 1.0
    assert coarse == pytest.approx(fine, rel=2e-3)
    assert at_end == pytest.approx(coarse, rel=1e-9)


def test_the_force_is_that_of_the_steps_end():
    """Where the tip will be then, by its acceleration: of order 3 in the place."""
    errors = []
    for step in (0.02, 0.01):
        ridge = {"ridge_wave": 0.02, "ridge_wavelength": 0.5}  # steep: the place along it counts, too
        soil, soil_at_end = started(Soil, **ridge), started(Soil, **ridge, inputs_at_step_end=True)
        worst = 0.0
        for i in range(round(0.5 / step)):
            for partner, t in ((soil, i * step), (soil_at_end, (i + 1) * step)):
                w = math.tau
                partner.value |= {
                    "ground.x": 0.3 * t + 3 * t * t,
                    "ground.vx": 0.3 + 6 * t,
                    "ground.ax": 6.0,
                    "ground.y": 0.1 * math.cos(w * t) - 0.03,
                    "ground.vy": -0.1 * w * math.sin(w * t),
                    "ground.ay": -0.1 * w * w * math.cos(w * t),
                }
                partner.do_step(i * step, step)
            worst = max(worst, abs(soil.value["tip.depth"] - soil_at_end.value["tip.depth"]))
        errors.append(worst)
    assert errors[0] / errors[1] == pytest.approx(8, rel=0.1)


# --- all ----------------------------------------------------------------------------------------


def run_on(partner: Partner, begin: int, end: int) -> dict[str, float]:
    """Steps with inputs that wander through all that a partner does."""
    for i in range(begin, end):
        t = i * 0.01
        for name, value in {
            "crank.inertia": 0.05 + 0.04 * math.sin(7 * t),
            "crank.tau_bias": 5 * math.sin(9 * t),
            "machine.fx": -3.0,
            "crank.phi": 6.8 * t - 0.5,
            "tip.x": -0.15,
            "tip.y": -0.2,
            "tip.angle": -1.6,
            "ground.x": 0.4 * t,
            "ground.y": -0.3 + 0.2 * math.cos(6.8 * t),
            "ground.vx": 0.4,
            "ground.vy": -1.36 * math.sin(6.8 * t),
            "seedling.in_nozzle": True,
        }.items():
            if name in partner.value:
                partner.value[name] = value
        partner.do_step(t, 0.01)
    return dict(partner.value)


@pytest.mark.parametrize("kind", PARTNERS)
def test_a_restored_state_goes_on_as_before(kind):
    partner = started(kind)
    run_on(partner, 0, 117)
    state = partner._get_fmu_state()
    kept = json.dumps(state)
    first = run_on(partner, 117, 300)
    assert json.dumps(state) == kept  # the state is a copy
    partner._set_fmu_state(state)
    assert run_on(partner, 117, 300) == first


@pytest.mark.parametrize("kind", PARTNERS)
def test_every_variable_says_what_it_is(kind):
    for variable in kind.variables:
        assert len(variable.text) > 3, variable.name
        if type(variable.start) is float:
            assert variable.unit in BASE_UNITS, variable.name
    assert len({v.name for v in kind.variables}) == len(kind.variables)
    assert set(kind.positive) <= {v.name for v in kind.variables if v.kind in ("parameter", "tunable")}


@pytest.mark.parametrize(("kind", "name"), [(k, name) for k in PARTNERS for name in k.positive])
def test_an_impossible_parameter_is_named(kind, name):
    partner = kind(instance_name="one")
    partner.setup_experiment(0.0)
    partner.value[name] = 0
    with pytest.raises(ValueError, match=f"{name} is 0: it must be positive"):
        partner.exit_initialization_mode()


def test_the_fmus_keep_to_the_standard(tmp_path):
    for fmu in build(tmp_path):
        assert validate_fmu(str(fmu)) == []
    assert [p.name for p in tmp_path.iterdir() if p.suffix != ".fmu"] == []


def test_the_same_sources_give_the_same_bytes(tmp_path):
    once, again = build(tmp_path / "once"), build(tmp_path / "again")
    assert [fmu.read_bytes() for fmu in once] == [fmu.read_bytes() for fmu in again]
    with zipfile.ZipFile(once[0]) as archive:
        assert b"Permission is hereby granted" in archive.read("documentation/licenses/PythonFMU.txt")


@pytest.mark.parametrize("kind", PARTNERS)
def test_values_pass_as_pythonfmu_passes_them(kind):
    """Each type by its own functions, which PythonFMU's agree with; what is not of the type or no input is refused."""
    partner, plain = started(kind), Fmi2Slave
    functions = {float: ("real", 0.25), bool: ("boolean", True), int: ("integer", 3)}
    for reference, variable in enumerate(kind.variables):
        for type_, (name, value) in functions.items():
            get, was = getattr(partner, f"get_{name}"), partner.value[variable.name]
            if type_ is not type(variable.start):
                with pytest.raises(TypeError, match="not of type"):
                    get([reference])
                with pytest.raises(TypeError, match="not of type"):
                    getattr(partner, f"set_{name}")([reference], [value])
                continue
            assert get([reference]) == getattr(plain, f"get_{name}")(partner, [reference]) == [was]
            if variable.kind == "output":
                with pytest.raises(TypeError):
                    getattr(partner, f"set_{name}")([reference], [value])
                assert partner.value[variable.name] == was
            else:
                getattr(partner, f"set_{name}")([reference], [value])
                assert partner.value[variable.name] == value
