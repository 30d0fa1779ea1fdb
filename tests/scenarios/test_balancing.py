"""Balance: torque and force over a turn, their gradients against differences, what the search reaches, bad input."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from scenarios.balancing import __main__ as balancing
from scenarios.balancing.machine import NAMES, Balancing, Machine
from scenarios.balancing.search import (
    HEAVIEST,
    REACH,
    STRETCH,
    WISHES,
    is_buildable,
    peak,
    rms,
    rms_by,
    room,
    room_by,
    search,
    sizes_by,
)
from scenarios.common.operating_point import PLANTING_SPEED
from scenarios.field_row.partners.build import build

SOME = Balancing(0.7, -0.05, 0.02, 900.0, 0.14, 0.05, 0.19)
STEPS = dict(zip(NAMES, (1e-4, 1e-5, 1e-5, 0.1, 1e-5, 1e-5, 1e-5), strict=True))


@pytest.fixture(scope="module")
def machine(fmu_file):
    build()
    with Machine(fmu_file) as found:
        yield found


def test_gradients_against_differences(machine):
    turn = machine.turn(SOME, PLANTING_SPEED)
    for column, (name, step) in enumerate(STEPS.items()):
        above, below = (
            machine.turn(replace(SOME, **{name: getattr(SOME, name) + sign * step}), PLANTING_SPEED, gradients=False)
            for sign in (1, -1)
        )
        for value, by in (("torque", turn.torque_by), ("force", turn.force_by)):
            differences = (getattr(above, value) - getattr(below, value)) / (2 * step)
            scale = max(1e-3, abs(differences).max())
            assert by[:, column] == pytest.approx(differences, abs=1e-5 * scale), (name, value)
        for goal in ("torque", "loaded", "force"):
            differences = (rms(above, goal) - rms(below, goal)) / (2 * step)
            assert rms_by(turn, goal)[column] == pytest.approx(differences, rel=1e-4, abs=1e-6), (name, goal)
        rooms = (room(replace(SOME, **{name: getattr(SOME, name) + sign * step}), machine) for sign in (1, -1))
        assert room_by(SOME)[:, column] == pytest.approx(np.subtract(*rooms) / (2 * step), abs=1e-4), name
    assert abs(sizes_by(turn, "torque")).max() > 0


def test_a_counterweight_is_a_body_of_the_crank(machine):
    """Two bodies as one: its own share of torque and force is that of a mass on a circle, whatever else turns."""
    b = replace(SOME, stiffness=0.0)
    without, turn = (machine.turn(each, PLANTING_SPEED, gradients=False) for each in (Balancing(), b))
    at = complex(b.x, b.y) * machine.joint / abs(machine.joint)
    assert turn.torque - without.torque == pytest.approx(b.mass * 9.80665 * np.imag(-1j * at), abs=1e-12)
    assert turn.force - without.force == pytest.approx(b.mass * PLANTING_SPEED**2 * at, abs=1e-11)


def test_a_spring_gives_back_what_it_took(machine):
    turned = machine.turn(SOME, PLANTING_SPEED, gradients=False)
    without = machine.turn(replace(SOME, stiffness=0.0), PLANTING_SPEED, gradients=False)
    taken = turned.torque - without.torque
    assert abs(taken).max() > 1 and abs(taken.mean()) < 1e-12
    assert turned.force == pytest.approx(without.force, abs=1e-12)


@pytest.mark.parametrize("wish", WISHES, ids=lambda wish: wish.key)
def test_the_search_makes_it_better_and_can_be_built(machine, wish):
    found = search(machine, PLANTING_SPEED, wish)
    measure = peak if wish.peak else rms
    before, after = (machine.turn(b, PLANTING_SPEED, gradients=False) for b in (Balancing(), found))
    assert measure(after, wish.goal) < 0.95 * measure(before, wish.goal)
    assert is_buildable(found, machine) and found.mass <= HEAVIEST * (1 + 1e-9) and found.reach <= REACH * (1 + 1e-6)
    rest = {name: getattr(found, name) for name in ("mass", "stiffness") if name not in wish.free}
    assert not any(rest.values())
    lengths = abs(machine.joint - complex(found.anchor_x, found.anchor_y))
    assert not found.stiffness or found.free - 1e-6 <= lengths.min() <= lengths.max() <= STRETCH * found.free + 1e-6


def test_no_neighbour_is_better(machine):
    """Of counterweights that can be built, round the one that was found for rms."""
    wish = WISHES[0]
    found = search(machine, PLANTING_SPEED, wish)
    least = rms(machine.turn(found, PLANTING_SPEED, gradients=False), wish.goal)
    for share in (0.8, 1.0):
        for turned in (-0.3, -0.1, 0.1, 0.3):
            at = complex(found.x, found.y) * np.exp(1j * turned)
            other = replace(found, mass=share * found.mass, x=at.real, y=at.imag)
            assert rms(machine.turn(other, PLANTING_SPEED, gradients=False), wish.goal) > least, (share, turned)


def test_what_cannot_be_built_is_told(machine):
    assert is_buildable(SOME, machine)
    for change in ({"mass": 3.0}, {"x": 0.2}, {"free": 0.2}, {"free": 0.06, "anchor_y": 0.3}, {"stiffness": 1e5}):
        assert not is_buildable(replace(SOME, **change), machine), change


def test_the_scene_writes_what_it_says(run_scene, machine, tmp_path):
    process = run_scene("balancing", "--rpm", "50", "--output", tmp_path / "new")
    assert process.returncode == 0, process.stderr
    assert process.stderr == ""
    names = {"balancing.md", "balancing.csv", "balancing.png"}
    assert {path.name for path in (tmp_path / "new").iterdir()} == names
    text = (tmp_path / "new" / "balancing.md").read_text(encoding="utf-8")
    assert "Worse with" in text and "nan" not in text.lower()
    unbalanced = balancing.figures_of(machine.turn(Balancing(), math.tau * 50 / 60, gradients=False))
    assert f"| nothing | {' | '.join(f'{value:.3g}' for value in unbalanced)} |" in text
    assert "50 turns a minute" in process.stdout


@pytest.mark.parametrize("rpm", ["0", "1e9", "fast", "nan"])
def test_speeds_that_cannot_be_are_refused(rpm, capsys):
    with pytest.raises(SystemExit):
        balancing.main(["--rpm", rpm])
    assert "give turns a minute from 10 to 300" in capsys.readouterr().err


def test_an_fmu_without_masses_is_refused(capsys, tmp_path):
    wrong = build()[0]
    assert balancing.main(["--fmu", str(wrong), "--output", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert "Drivetrain.fmu has no masses: it lacks body.OA.m" in said and said.count("\n") == 1
