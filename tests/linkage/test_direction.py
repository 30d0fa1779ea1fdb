"""fmu_src/linkage/direction.h: its constants, and its error against 60 digits."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest

from fmu_src.exporter.compiler import SOURCE_ROOT, compile_library, host_platform

HEADER = (SOURCE_ROOT / "linkage" / "direction.h").read_text()
ERROR_BOUND = 1e-16  # as direction.h states it
LIMIT = 2e8  # rad; libm beyond
TERMS = 6

Directions = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="module", autouse=True)
def sixty_digits():
    with mpmath.workdps(60):
        yield


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """direction_shim.c, compiled."""
    platform = host_platform()
    library = tmp_path_factory.mktemp("direction") / f"direction{platform.suffix}"
    compile_library((Path(__file__).with_name("direction_shim.c"),), library, platform)
    return ctypes.CDLL(str(library))


@pytest.fixture(scope="module")
def directions(shim: ctypes.CDLL) -> Directions:
    """cos and sin of an array of angles, by the C function."""

    def call(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angles = np.ascontiguousarray(angles, float)
        cosine, sine = np.empty_like(angles), np.empty_like(angles)
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (angles, cosine, sine)]
        shim.directions(ctypes.c_size_t(len(angles)), *pointers)
        return cosine, sine

    return call


def worst_error(directions: Directions, angles: np.ndarray) -> mpmath.mpf:
    return max(
        max(abs(mpmath.cos(mpmath.mpf(a)) - c), abs(mpmath.sin(mpmath.mpf(a)) - s))
        for a, c, s in zip(angles, *directions(angles), strict=True)
    )


def constants(name: str) -> list[float]:
    """The numbers of a constant of direction.h, scalar or array."""
    body = re.search(rf"{name}(?:\[\d\])? = ([^;]*);", HEADER).group(1)
    return [float(number) for number in re.findall(r"-?[\d.]+(?:e[+-]?\d+)?", body)]


def interpolate(function: Callable[[mpmath.mpf], mpmath.mpf], limit: mpmath.mpf) -> list[float]:
    """Coefficients of the polynomial through `function` at the Chebyshev nodes of [0, limit]."""
    nodes = [limit / 2 * (1 + mpmath.cos(mpmath.pi * (2 * j + 1) / (2 * TERMS))) for j in range(TERMS)]
    powers = mpmath.matrix([[node**k for k in range(TERMS)] for node in nodes])
    return [float(c) for c in mpmath.lu_solve(powers, mpmath.matrix([function(node) for node in nodes]))]


def test_polynomials_are_the_interpolation_they_are_said_to_be():
    limit = (mpmath.pi / 4) ** 2 * mpmath.mpf("1.0001")

    def tail(sign: int, first: int) -> Callable[[mpmath.mpf], mpmath.mpf]:
        return lambda z: mpmath.nsum(lambda k: sign * (-z) ** k / mpmath.factorial(2 * k + first), [0, 40])

    assert constants("DIRECTION_SIN") == interpolate(tail(-1, 3), limit)
    assert constants("DIRECTION_COS") == interpolate(tail(1, 4), limit)


def test_first_guess_of_an_angle_is_the_interpolation_it_is_said_to_be():
    coefficients = interpolate(lambda z: mpmath.atan(mpmath.sqrt(z)) / mpmath.sqrt(z), mpmath.mpf(1))
    assert constants("DIRECTION_ATAN") == coefficients
    t = np.linspace(0, 1, 2001)
    guess = t * np.polynomial.polynomial.polyval(t * t, coefficients)
    assert abs(guess - np.arctan(t)).max() < 3e-6


def test_angle_of_a_vector(shim: ctypes.CDLL):
    """In all octants and beside their edges, whatever the length; within one unit in the last place of pi."""
    turns = np.concatenate([np.random.default_rng(4).uniform(-np.pi, np.pi, 3000), np.arange(-8, 9) * (np.pi / 4)])
    turns = np.concatenate([turns, turns[-17:] + 1e-9, turns[-17:] - 1e-9])
    lengths = np.random.default_rng(5).uniform(0.1, 10, len(turns))
    x, y, found = lengths * np.cos(turns), lengths * np.sin(turns), np.empty(len(turns))
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (x, y, found)]
    shim.angles(ctypes.c_size_t(len(turns)), *pointers)
    exact = [mpmath.atan2(mpmath.mpf(b), mpmath.mpf(a)) for a, b in zip(x, y, strict=True)]
    assert max(abs(mpmath.mpf(f) - e) for f, e in zip(found, exact, strict=True)) < np.spacing(np.pi)


def test_parts_of_the_quarter_turn_add_up_and_leave_room_for_exact_products():
    high, middle, low = (constants(f"DIRECTION_QUARTER_{part}")[0] for part in ("HIGH", "MIDDLE", "LOW"))
    assert abs(mpmath.pi / 2 - high - middle - low) < 2e-33
    for part in (high, middle):
        numerator, _ = part.as_integer_ratio()
        assert numerator.bit_length() <= 25
    assert constants("DIRECTION_QUARTERS_PER_RADIAN") == [float(2 / mpmath.pi)]
    assert constants("DIRECTION_LIMIT") == [LIMIT]
    assert LIMIT * 2 / mpmath.pi < 2**28


@pytest.mark.parametrize("reach", [1e-300, 1e-8, 0.8, 7.0, 1e3, 1e6, LIMIT, 1e15, 1e300])
def test_error_is_below_the_stated_bound(directions: Directions, reach: float):
    angles = np.random.default_rng(1).uniform(-reach, reach, 1500)
    with mpmath.workdps(400 if reach > 1e100 else 60):
        assert worst_error(directions, angles) < ERROR_BOUND


def test_error_is_below_the_bound_beside_multiples_of_a_quarter_turn(directions: Directions):
    quarters = np.random.default_rng(2).integers(-(10**8), 10**8, 1500)
    angles = np.concatenate([quarters * (np.pi / 2), np.nextafter(quarters * (np.pi / 2), np.inf)])
    assert worst_error(directions, angles) < ERROR_BOUND


def test_octants_meet_without_a_gap(directions: Directions):
    """Beside the odd multiples of an eighth turn, where another polynomial takes over."""
    edges = (2 * np.arange(-40, 40) + 1) * (np.pi / 4)
    angles = np.concatenate([edges * (1 - 1e-15), edges, edges * (1 + 1e-15)])
    assert worst_error(directions, angles) < ERROR_BOUND


def test_zero_keeps_its_sign_and_what_is_no_number_stays_none(directions: Directions):
    cosine, sine = directions(np.array([0.0, -0.0, np.nan, np.inf, -np.inf]))
    assert cosine[:2].tolist() == [1.0, 1.0] and sine[:2].tolist() == [0.0, 0.0]
    assert np.isnan(cosine[2:]).all() and np.isnan(sine[2:]).all()


@pytest.mark.skipif(host_platform().name != "x86_64-linux", reason="the numbers of fesetround are the platform's")
@pytest.mark.parametrize("mode", [0x400, 0x800, 0xC00], ids=["down", "up", "to zero"])
def test_other_rounding_modes_cost_accuracy_but_not_sense(directions: Directions, mode: int):
    library = ctypes.CDLL("libm.so.6")
    angles = np.random.default_rng(3).uniform(-100, 100, 1000)
    library.fesetround(mode)
    try:
        cosine, sine = directions(angles)
    finally:
        library.fesetround(0)
    assert max(abs(cosine - np.cos(angles)).max(), abs(sine - np.sin(angles)).max()) < 1e-9
