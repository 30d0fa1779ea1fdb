"""What a user would reach for: CasADi, numba, pylinkage, scipy, SymPy and MuJoCo, each as well used as we know how.

None is needed by the tests: `make bench` installs them. Each function below builds the ways of one package, and
raises ImportError where it is not installed. CasADi, SymPy and numba get the closed form with square roots
(no angle but the crank's), the best form for them, with the geometry as constants; CasADi and SymPy differentiate
it themselves.
"""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from scenarios.speed_vs_error.solving.in_c import Library
from scenarios.speed_vs_error.solving.way import GEOMETRY, MOTION, ORDERS, PEER, SPEED, Question, Way
from scenarios.speed_vs_error.yardstick import compile_library, host_platform, twin

_G = SimpleNamespace(**GEOMETRY)
# Numbers of the geometry that the closed form needs, as complex ones.
_CRANK_OA, _CRANK_CD = _G.L1 * np.exp(1j * _G.phi1), _G.L4 * np.exp(1j * _G.phi4)
_ARM = _G.L5 / _G.L3 * np.exp(-1j * _G.theta3)
_NOZZLE = 0.5 - np.exp(1j * _G.theta8) * (_G.L8 + _G.L9 * np.exp(1j * _G.theta9)) / _G.L6


COMPILED = (
    ("", "compiled as the core is", ()),
    (
        ", -ffast-math",
        "compiled for this very processor with -O3 and -ffast-math",
        ("-O3", "-mcpu=native", "-ffp-contract=fast", "-ffast-math"),
    ),
)  # how generated C is compiled: the end of its title, a remark, the flags beside the usual ones


def builders(library: Library, folder: Path) -> dict[str, Callable[[], list[Way]]]:
    """By the name of each package, what builds its ways."""
    return {
        "CasADi": lambda: casadi_ways(library, folder),
        "numba": numba_ways,
        "pylinkage": pylinkage_ways,
        "SymPy": sympy_ways,
        "scipy": scipy_ways,
        "MuJoCo": mujoco_ways,
    }


def build_all(library: Library, folder: Path) -> tuple[list[Way], list[tuple[str, str]]]:
    """The ways of all packages that there are; the others by name, with the reason."""
    return build_each(builders(library, folder))


def build_each(every: Mapping[str, Callable[[], list[Way]]]) -> tuple[list[Way], list[tuple[str, str]]]:
    """What can be built, by the name of each package; the others by name, with the reason."""
    found, missing = [], []
    for name, build in every.items():
        try:
            found += build()
        except ImportError as error:
            missing.append((name, f"not installed: {error}"))
        except Exception as error:  # noqa: BLE001 - whatever a package does on this machine, the table says it
            missing.append((name, f"failed: {(str(error).strip() or type(error).__name__).splitlines()[0]}"))
    return found, missing


def closed_form(phi, cos: Callable, sin: Callable, sqrt: Callable) -> tuple:
    """x and y of the tip, with the functions of any algebra."""
    return closed_loops(phi, cos, sin, sqrt)["tip"]


def closed_loops(phi, cos: Callable, sin: Callable, sqrt: Callable) -> dict[str, tuple]:
    """x and y of the tip, of the joints A, D and E, and of the vectors of the links AB, DB, EF and GF."""
    c, s = cos(phi), -sin(phi)

    def turned(z: complex, x, y) -> tuple:
        return float(z.real) * x - float(z.imag) * y, float(z.real) * y + float(z.imag) * x

    def joint(x, y, start: float, end: float) -> tuple:
        """The link from the end of the base (x, y) to the joint on its right."""
        square = x * x + y * y
        height = sqrt(((start + end) ** 2 - square) * (square - (start - end) ** 2)) / (2 * square)
        along = (start**2 - end**2 - square) / (2 * square)
        return along * x + height * y, along * y - height * x

    A_x, A_y = turned(_CRANK_OA, c, s)
    D_x, D_y = turned(_CRANK_CD, c, s)
    D_x, D_y = D_x + _G.XC, D_y + _G.YC
    DB_x, DB_y = joint(D_x - A_x, D_y - A_y, _G.L2, _G.L3)
    arm_x, arm_y = turned(_ARM, DB_x, DB_y)
    E_x, E_y = D_x + arm_x, D_y + arm_y
    GF_x, GF_y = joint(_G.XG - E_x, _G.YG - E_y, _G.L6, _G.L7)
    EF_x, EF_y = _G.XG + GF_x - E_x, _G.YG + GF_y - E_y
    nozzle_x, nozzle_y = turned(_NOZZLE, EF_x, EF_y)
    return {
        "tip": (E_x + nozzle_x, E_y + nozzle_y),
        "A": (A_x, A_y),
        "D": (D_x, D_y),
        "E": (E_x, E_y),
        "AB": (D_x + DB_x - A_x, D_y + DB_y - A_y),
        "DB": (DB_x, DB_y),
        "EF": (EF_x, EF_y),
        "GF": (GF_x, GF_y),
    }


# ---- CasADi ----------------------------------------------------------------------------


def adopt_generated(library: Library, folder: Path, functions: Mapping[int, Any]) -> Iterator[tuple[str, str]]:
    """Generate C of CasADi's functions, by the order of each, compile it in two ways and give it to the library.

    Yields for each what its title ends with, and a remark.
    """
    import casadi

    generator = casadi.CodeGenerator("generated.c", {"with_header": False})
    for function in functions.values():
        generator.add(function)
    generator.generate(f"{folder}/")
    target = host_platform()
    for which, (suffix, remark, flags) in enumerate(COMPILED):
        path = folder / f"generated_{which}{target.suffix}"
        compile_library((folder / "generated.c",), path, target, "-w", "-fvisibility=default", *flags)
        generated = ctypes.CDLL(str(path))
        for order, function in functions.items():
            library.adopt(which, order, getattr(generated, function.name()))
        yield suffix, remark


def casadi_ways(library: Library, folder: Path) -> list[Way]:
    import casadi

    name = f"CasADi {casadi.__version__}"
    phi = casadi.SX.sym("phi")
    rows = [casadi.vertcat(*closed_form(phi, casadi.cos, casadi.sin, casadi.sqrt))]
    for _ in ORDERS[1:]:
        rows.append(casadi.jacobian(rows[-1], phi) * SPEED)
    functions = [casadi.Function(f"tip_{n}", [phi], [casadi.cse(casadi.vertcat(*rows[: n + 1]))]) for n in ORDERS]
    found = [
        library.way(f"casadi_c_{which}", f"{name}, generated C{suffix}", PEER, remark, c_name=f"generated_{which}")
        for which, (suffix, remark) in enumerate(
            adopt_generated(library, folder, dict(zip(ORDERS, functions, strict=True)))
        )
    ]

    def one_by_one(angles: np.ndarray, order: int) -> np.ndarray:
        f = functions[order]
        return np.array([f(angle).full()[:, 0] for angle in angles.tolist()])

    mapped: dict[tuple[int, int], casadi.Function] = {}

    def all_at_once(angles: np.ndarray, order: int) -> np.ndarray:
        key = (order, len(angles))
        if key not in mapped:
            mapped[key] = functions[order].map(len(angles))
        return mapped[key](angles[None, :]).full().T

    return [
        *found,
        Way("casadi_map", f"{name} in Python, mapped", PEER, all_at_once, remark="all angles in one call"),
        Way("casadi_calls", f"{name} in Python, angle by angle", PEER, one_by_one),
    ]


# ---- numba -----------------------------------------------------------------------------


def dyad_in_numba(compiled: Callable) -> tuple[Callable, Callable, Callable]:
    """A dyad's links, their rates and bends by the crank angle; `compiled` is the decorator that compiles each."""

    @compiled
    def joint(x, y, start, end):
        square = x * x + y * y
        area = math.sqrt(((start + end) ** 2 - square) * (square - (start - end) ** 2))
        height, half = 0.5 * area / square, 0.5 / square
        p = half * (start**2 - end**2 + square)
        q = half * (start**2 - end**2 - square)
        return p * x + height * y, p * y - height * x, q * x + height * y, q * y - height * x, -2.0 / area

    @compiled
    def first_rates(p_x, p_y, q_x, q_y, inverse, dx, dy):  # noqa: PLR0917 - numba has no others
        return (q_x * dx + q_y * dy) * inverse, (p_x * dx + p_y * dy) * inverse

    @compiled
    def second_rates(p_x, p_y, q_x, q_y, inverse, dx, dy, p_rate, q_rate, p_length, q_length):  # noqa: PLR0917 - as above
        """As fmu_src/twin/linkage.py: dot products take the other link's rate away."""
        known_p, known_q = -p_rate * p_rate, -q_rate * q_rate
        p_bend = (q_x * (dx - known_p * p_x) + q_y * (dy - known_p * p_y) + known_q * q_length**2) * inverse
        q_bend = (p_x * (dx + known_q * q_x) + p_y * (dy + known_q * q_y) - known_p * p_length**2) * inverse
        return p_bend, q_bend

    return joint, first_rates, second_rates


def numba_ways() -> list[Way]:
    import numba

    L2, L3, L6, L7 = _G.L2, _G.L3, _G.L6, _G.L7
    XC, YC, XG, YG, speed = _G.XC, _G.YC, _G.XG, _G.YG, SPEED
    base_x, base_y = float((_CRANK_CD - _CRANK_OA).real), float((_CRANK_CD - _CRANK_OA).imag)
    crank_x, crank_y = float(_CRANK_CD.real), float(_CRANK_CD.imag)
    arm_x, arm_y, nozzle_x, nozzle_y = (float(v) for z in (_ARM, _NOZZLE) for v in (z.real, z.imag))

    def build(order: int, fastmath: bool) -> tuple[Callable, Callable]:
        compiled = numba.njit(inline="always", fastmath=fastmath)

        joint, first_rates, second_rates = dyad_in_numba(compiled)

        @compiled
        def solve(phi):
            c, s = math.cos(phi), -math.sin(phi)
            turning_x, turning_y = base_x * c - base_y * s, base_x * s + base_y * c
            crank_x_, crank_y_ = crank_x * c - crank_y * s, crank_x * s + crank_y * c
            p_x, p_y, q_x, q_y, inverse = joint(XC + turning_x, YC + turning_y, L2, L3)
            a_x, a_y = arm_x * q_x - arm_y * q_y, arm_x * q_y + arm_y * q_x
            E_x, E_y = XC + crank_x_ + a_x, YC + crank_y_ + a_y
            u_x, u_y, v_x, v_y, inverse_2 = joint(XG - E_x, YG - E_y, L6, L7)
            n_x, n_y = nozzle_x * u_x - nozzle_y * u_y, nozzle_x * u_y + nozzle_y * u_x
            x, y, dx, dy, ddx, ddy = E_x + n_x, E_y + n_y, 0.0, 0.0, 0.0, 0.0
            if order >= 1:
                p_rate, q_rate = first_rates(p_x, p_y, q_x, q_y, inverse, turning_y, -turning_x)
                dE_x, dE_y = crank_y_ - q_rate * a_y, -crank_x_ + q_rate * a_x
                u_rate, v_rate = first_rates(u_x, u_y, v_x, v_y, inverse_2, -dE_x, -dE_y)
                dx, dy = dE_x - u_rate * n_y, dE_y + u_rate * n_x
            if order >= 2:
                _, q_bend = second_rates(p_x, p_y, q_x, q_y, inverse, -turning_x, -turning_y, p_rate, q_rate, L2, L3)
                ddE_x = -crank_x_ - q_bend * a_y - q_rate * q_rate * a_x
                ddE_y = -crank_y_ + q_bend * a_x - q_rate * q_rate * a_y
                u_bend, _ = second_rates(u_x, u_y, v_x, v_y, inverse_2, -ddE_x, -ddE_y, u_rate, v_rate, L6, L7)
                ddx = ddE_x - u_bend * n_y - u_rate * u_rate * n_x
                ddy = ddE_y + u_bend * n_x - u_rate * u_rate * n_y
            return x, y, speed * dx, speed * dy, speed * speed * ddx, speed * speed * ddy

        @numba.njit(fastmath=fastmath)
        def answer(angles, out):
            for i in range(len(angles)):
                row = solve(angles[i])
                for k in range(2 * (order + 1)):
                    out[i, k] = row[k]

        @numba.njit(fastmath=fastmath)
        def add_up(angles):
            total = 0.0
            for angle in angles:
                x, y, dx, dy, ddx, ddy = solve(angle)
                total += (x + y) + (dx + dy) + (ddx + ddy)
            return total

        return answer, add_up

    return ways_of_numba(build, "the twin's equations, a compiled loop over all angles")


# ---- pylinkage -------------------------------------------------------------------------


def pylinkage_ways() -> list[Way]:
    from pylinkage import Crank, FixedDyad, Ground, Linkage, RRRDyad

    def build(step: float, first: float) -> tuple[Linkage, int]:
        """The linkage half a step before the first angle."""
        before = first - step
        O, C, G = Ground(0.0, 0.0, name="O"), Ground(_G.XC, _G.YC, name="C"), Ground(_G.XG, _G.YG, name="G")
        A = Crank(O, _G.L1, -step, _G.phi1 - before, name="A")
        D = Crank(C, _G.L4, -step, _G.phi4 - before, name="D")
        points = _points(before)
        B = RRRDyad(A.output, D.output, _G.L2, _G.L3, *points["B"], name="B")
        E = FixedDyad(D.output, B, _G.L5, -_G.theta3, name="E")
        F = RRRDyad(E, G, _G.L6, _G.L7, *points["F"], name="F")
        J = FixedDyad(E, F, _G.L6 * abs(_NOZZLE), float(np.angle(_NOZZLE)), name="J")
        components = [O, C, G, A, D, B, E, F, J]
        linkage = Linkage(components)
        for crank in (A, D):
            linkage.set_input_velocity(crank, -SPEED, 0.0)
        return linkage, components.index(J)

    ready: dict[tuple[float, float], tuple] = {}

    def evaluate(angles: np.ndarray, order: int) -> np.ndarray:
        key = (float(angles[1] - angles[0]), float(angles[0]))
        if key not in ready:
            linkage, tip = build(*key)
            linkage.compile()
            ready[key] = linkage, tip, linkage.get_coords()
        linkage, tip, start = ready[key]
        linkage.set_coords(start)
        if order == 0:
            return linkage.step_fast(len(angles))[:, tip]
        moved = linkage.step_fast_with_kinematics(len(angles))[: order + 1]
        return np.concatenate([derivative[:, tip] for derivative in moved], axis=1)

    return [
        Way(
            "pylinkage",
            f"pylinkage {version('pylinkage')}",
            PEER,
            evaluate,
            remark="its compiled steps by an even angle; it computes velocities and accelerations together",
        )
    ]


def _points(phi: float) -> dict[str, tuple[float, float]]:
    """Where joints are, as a start for those who search."""
    return {name: (float(z.real), float(z.imag)) for name, z in twin.solve(twin.Geometry(), phi, 0).joints.items()}


# ---- SymPy -----------------------------------------------------------------------------


def sympy_ways() -> list[Way]:
    import sympy

    phi = sympy.Symbol("phi", real=True)
    rows = list(closed_form(phi, sympy.cos, sympy.sin, sympy.sqrt))
    functions = []
    for n in ORDERS:
        if n:
            rows += [sympy.diff(row, phi) * SPEED for row in rows[-2:]]
        functions.append([sympy.lambdify(phi, rows, modules=module, cse=True) for module in ("numpy", "math")])

    name = f"SymPy {sympy.__version__}, lambdify"
    return [
        Way(
            "sympy_arrays",
            f"{name}, numpy arrays",
            PEER,
            lambda angles, order: np.stack(functions[order][0](angles), axis=-1),
            remark="all angles at once",
        ),
        Way(
            "sympy_calls",
            f"{name}, angle by angle",
            PEER,
            lambda angles, order: np.array([functions[order][1](angle) for angle in angles.tolist()]),
        ),
    ]


# ---- scipy -----------------------------------------------------------------------------


def scipy_ways() -> list[Way]:
    """The loop equations in four link angles, by root finding; their rates by linear equations."""
    import scipy
    from scipy.optimize import fsolve

    def loops(q: np.ndarray, phi: float) -> list[float]:
        a, b, e, f = q  # of AB, DB, EF, GF
        D_x, D_y = _G.XC + _G.L4 * math.cos(_G.phi4 - phi), _G.YC + _G.L4 * math.sin(_G.phi4 - phi)
        E_x, E_y = D_x + _G.L5 * math.cos(b - _G.theta3), D_y + _G.L5 * math.sin(b - _G.theta3)
        return [
            _G.L1 * math.cos(_G.phi1 - phi) + _G.L2 * math.cos(a) - D_x - _G.L3 * math.cos(b),
            _G.L1 * math.sin(_G.phi1 - phi) + _G.L2 * math.sin(a) - D_y - _G.L3 * math.sin(b),
            E_x + _G.L6 * math.cos(e) - _G.XG - _G.L7 * math.cos(f),
            E_y + _G.L6 * math.sin(e) - _G.YG - _G.L7 * math.sin(f),
        ]

    def slopes(q: np.ndarray, _phi: float) -> np.ndarray:
        a, b, e, f = q
        return np.array(
            [
                [-_G.L2 * math.sin(a), _G.L3 * math.sin(b), 0, 0],
                [_G.L2 * math.cos(a), -_G.L3 * math.cos(b), 0, 0],
                [0, -_G.L5 * math.sin(b - _G.theta3), -_G.L6 * math.sin(e), _G.L7 * math.sin(f)],
                [0, _G.L5 * math.cos(b - _G.theta3), _G.L6 * math.cos(e), -_G.L7 * math.cos(f)],
            ]
        )

    def tip(q: np.ndarray, phi: float, order: int) -> list[float]:
        """The tip's derivatives by phi: a sum of turning vectors, each with its rate and bend."""
        angles = [_G.phi4 - phi, q[1] - _G.theta3, q[2]]
        vectors = [_G.L4 * _unit(angles[0]), _G.L5 * _unit(angles[1]), _G.L6 * _NOZZLE * _unit(angles[2])]
        z = complex(_G.XC, _G.YC) + sum(vectors)
        found = [z.real, z.imag]
        if order == 0:
            return found
        jacobian = slopes(q, phi)
        crank_a, crank_d = _G.L1 * _unit(_G.phi1 - phi), vectors[0]
        right = -1j * crank_d
        moved = right + 1j * crank_a  # D' - A'
        rate = np.linalg.solve(jacobian, [moved.real, moved.imag, -right.real, -right.imag])
        rates = (-1.0, rate[1], rate[2])
        z = sum(1j * w * v for w, v in zip(rates, vectors, strict=True)) * SPEED
        found += [z.real, z.imag]
        if order == 1:
            return found
        turning = [
            length * _unit(angle) * w**2 for length, angle, w in zip((_G.L2, _G.L3, _G.L6, _G.L7), q, rate, strict=True)
        ]
        first = crank_a - crank_d + turning[0] - turning[1]
        second = crank_d + vectors[1] * rate[1] ** 2 + turning[2] - turning[3]
        bend = np.linalg.solve(jacobian, [first.real, first.imag, second.real, second.imag])
        bends = (0.0, bend[1], bend[2])
        z = sum((1j * b - w * w) * v for w, b, v in zip(rates, bends, vectors, strict=True)) * SPEED**2
        return [*found, z.real, z.imag]

    def evaluate(angles: np.ndarray, order: int) -> np.ndarray:
        points = {name: complex(*point) for name, point in _points(float(angles[0])).items()}
        q = np.angle(
            [points["B"] - points["A"], points["B"] - points["D"], points["F"] - points["E"], points["F"] - points["G"]]
        )
        answers = []
        for phi in angles.tolist():
            q = fsolve(loops, q, phi, slopes, xtol=1e-12)
            answers.append(tip(q, phi, order))
        return np.array(answers)

    return [
        Way(
            "scipy",
            f"scipy {scipy.__version__}, fsolve",
            PEER,
            evaluate,
            remark="loop equations, from the last root, with their Jacobian; rates by linear equations",
        )
    ]


def _unit(angle: float) -> complex:
    return complex(math.cos(angle), math.sin(angle))


# ---- MuJoCo ----------------------------------------------------------------------------


def mujoco_ways() -> list[Way]:
    """Rigid bodies whose loops are closed by constraints, a time step from angle to angle at 65 turns a minute."""
    import mujoco

    def body(name: str, at: complex, inside: str, armature: float = 0.0) -> str:
        return (
            f'<body name="{name}" pos="{float(at.real)!r} {float(at.imag)!r} 0"><joint name="{name}" axis="0 0 1" '
            f'armature="{armature!r}"/><inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>'
            f"{inside}</body>"
        )

    def site(name: str, at: complex) -> str:
        return f'<site name="{name}" pos="{float(at.real)!r} {float(at.imag)!r} 0"/>'

    def build(step: float, first: float) -> tuple:
        """The model in motion at the angle before the first; at joint angle 0 a link lies along x."""
        before = first - step
        points = {name: complex(*point) for name, point in _points(before).items()}
        E_from_D, J_from_E = _ARM * _G.L3, _NOZZLE * _G.L6
        heavy = 1e4  # kg m2: cranks that nothing slows
        closed = f'solref="{2 * step / SPEED!r} 1" solimp="0.9999 0.9999 0.001"'  # as stiff as it can be
        xml = f"""<mujoco><compiler angle="radian"/>
          <option timestep="{step / SPEED!r}" gravity="0 0 0" integrator="implicitfast" iterations="50"
            tolerance="1e-14"><flag contact="disable"/></option>
          <worldbody>
            {body("OA", 0j, body("AB", _G.L1 + 0j, site("B_of_AB", _G.L2 + 0j)), armature=heavy)}
            {
            body(
                "CD",
                complex(_G.XC, _G.YC),
                body(
                    "DB",
                    _G.L4 + 0j,
                    site("B_of_DB", _G.L3 + 0j)
                    + body("EF", E_from_D, site("F_of_EF", _G.L6 + 0j) + site("J", J_from_E)),
                ),
                armature=heavy,
            )
        }
            {body("GF", complex(_G.XG, _G.YG), site("F_of_GF", _G.L7 + 0j))}
          </worldbody>
          <equality>
            <connect site1="B_of_AB" site2="B_of_DB" {closed}/>
            <connect site1="F_of_EF" site2="F_of_GF" {closed}/>
          </equality>
          <sensor><framepos objtype="site" objname="J"/><framelinvel objtype="site" objname="J"/>
            <framelinacc objtype="site" objname="J"/></sensor></mujoco>"""
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        of = {name: model.joint(name).qposadr[0] for name in ("OA", "AB", "CD", "DB", "EF", "GF")}
        angle = {name: float(np.angle(points[name[1]] - points[name[0]])) for name in of}
        carriers = {"AB": "OA", "DB": "CD", "EF": "DB"}
        for name, address in of.items():
            data.qpos[address] = angle[name] - (angle[carriers[name]] if name in carriers else 0.0)
        nudge = 1e-6  # rad: for the rates, by differences
        later = {name: complex(*point) for name, point in _points(before + nudge).items()}
        turned = {name: (later[name[1]] - later[name[0]]) / (points[name[1]] - points[name[0]]) for name in of}
        rate = {name: float(np.angle(turned[name])) * SPEED / nudge for name in of}
        for name, address in of.items():
            data.qvel[address] = rate[name] - (rate[carriers[name]] if name in carriers else 0.0)
        return model, data, of["OA"], of["CD"], data.qpos.copy(), data.qvel.copy()

    ready: dict[tuple[float, float], tuple] = {}

    def evaluate(angles: np.ndarray, order: int) -> np.ndarray:
        key = (float(angles[1] - angles[0]), float(angles[0]))
        if key not in ready:
            ready[key] = build(*key)
        model, data, oa, cd, qpos, qvel = ready[key]
        mujoco.mj_resetData(model, data)
        data.qpos, data.qvel = qpos, qvel
        mujoco.mj_step(model, data)  # to the first angle
        answers = np.empty((len(angles), 2 * (order + 1)))
        position, step = data.qpos, mujoco.mj_step
        sensed = data.sensordata.reshape(3, 3)[: order + 1, :2]
        for row, phi in zip(answers, angles.tolist(), strict=True):
            position[oa], position[cd] = _G.phi1 - phi, _G.phi4 - phi
            step(model, data)  # what it senses belongs to the step's start
            row[:] = sensed.ravel()
        return answers

    return [
        Way(
            "mujoco",
            f"MuJoCo {mujoco.__version__}",
            PEER,
            evaluate,
            remark="loops closed by connect constraints, a step a call; soft constraints are its nature",
        )
    ]


def ways_of_numba(
    build: Callable[[int, bool], tuple[Callable[..., Any], Callable[..., Any]]],
    remark: str,
    orders: Sequence[int] = ORDERS,
    question: Question = MOTION,
) -> list[Way]:
    """Without and with fastmath. ``build``: of an order, and whether with fastmath, the compiled loops that write the
    answers at all angles, and that add them up.
    """
    import numba

    def way(key: str, title: str, remark: str, fastmath: bool) -> Way:
        built = {order: build(order, fastmath) for order in orders}

        def evaluate(angles: np.ndarray, order: int) -> np.ndarray:
            out = np.empty((len(angles), question.width(order)))
            built[order][0](angles, out)
            return out

        def take_time(angles: np.ndarray, order: int) -> float:
            begin = time.thread_time_ns()
            built[order][1](angles)
            return (time.thread_time_ns() - begin) / len(angles)

        for order in orders:
            take_time(np.zeros(3), order)  # compiles
        return Way(key, title, PEER, evaluate, take_time, remark)

    name = f"numba {numba.__version__}"
    return [
        way("numba", name, remark, False),
        way("numba_fast", f"{name}, fastmath", "the same with fastmath; compiled for this very processor", True),
    ]
