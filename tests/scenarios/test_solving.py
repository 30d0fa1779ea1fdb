"""The comparison of ways: its truth, its errors, its ratios and what it says of them; each way that is there."""

from __future__ import annotations

import csv
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from fmu_src.oracle.tables import rows
from scenarios.speed_vs_error.solving import __main__ as command
from scenarios.speed_vs_error.solving import in_python, measure, peers, report, way
from scenarios.speed_vs_error.solving.in_c import Library
from scenarios.speed_vs_error.solving.measure import ALIKE, Cell
from scenarios.speed_vs_error.solving.way import CORE, ORDERS, OURS, PEER, SPEED, Way
from tests.conftest import PROJECT_ROOT

TWIN = PROJECT_ROOT / "build" / "twin" / "TransplanterLinkageTwin.fmu"
PHI = way.angles(200)
# Worst errors that a way may have: mm, mm/s, mm/s2.
EXACT = (2e-12, 1e-11, 2e-10)
BOUNDS = {
    "printed": (2e-12, 1e-9, 5e-9), "printed_arrays": (2e-12, 1e-9, 5e-9),  # near their poles
    "naive": (2e-12, 5e-4, 5e-3), "table": (1e-10, 2e-7, 1e-3),
    "pylinkage": (1e-10, 1e-9, 1e-8), "mujoco": (3, 150, 2500), "scipy": (1e-10, 1e-9, 1e-8),
    "sympy_arrays": (1e-11, 1e-9, 1e-8), "sympy_calls": (1e-11, 1e-9, 1e-8),
}  # fmt: skip
PEERS = {
    "CasADi": "casadi",
    "numba": "numba",
    "pylinkage": "pylinkage",
    "SymPy": "sympy",
    "scipy": "scipy",
    "MuJoCo": "mujoco",
}  # by the module that each needs


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return way.truth(PHI)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("solving")


@pytest.fixture(scope="module")
def library(folder: Path) -> Library:
    return Library(folder)


# ---- the truth and the errors ----------------------------------------------------------


def test_the_truth_is_that_of_the_reference_tables():
    some = rows("nominal")[::40]
    found = way.truth(np.array([row.phi for row in some]))
    for row, answers in zip(some, found, strict=True):
        for n, pair in enumerate(row.exact[:3]):
            for component, (head, low) in zip(pair, answers[2 * n : 2 * n + 2], strict=True):
                true = component * (way.mpf(SPEED) ** n)
                assert abs(way.mpf(head) + way.mpf(low) - true) <= abs(true) * way.mpf(10) ** -15
                assert head == pytest.approx(float(true), rel=1e-15)


def test_errors_are_distances_from_the_truth(exact):
    assert max(way.worst_errors(exact[:, :, 0], exact)) < 1e-11  # the truth rounded to doubles
    assert min(way.worst_errors(exact[:, :, 0], exact)) > 0  # what was rounded away counts
    moved = exact[:, :, 0].copy()
    moved[7, 2] += 3e-6  # m/s
    moved[7, 3] -= 4e-6
    position, velocity, acceleration = way.worst_errors(moved, exact)
    assert velocity == pytest.approx(5e-3, rel=1e-6) and max(position, acceleration) < 1e-11
    assert len(way.worst_errors(moved[:, :4], exact)) == 2


def test_angles_go_round_once():
    phi = way.angles()
    assert len(phi) == 2000 and np.ptp(np.diff(phi)) < 1e-14 and phi[-1] - phi[0] < 2 * np.pi


# ---- each way --------------------------------------------------------------------------


def check(one: Way, exact: np.ndarray) -> None:
    """Its answers at every order are within its bounds, and it can be timed."""
    for order in ORDERS:
        errors, why = measure.verify(one, order, PHI, exact)
        assert not why, f"{one.title}: {why}"
        assert len(errors) == order + 1
        assert all(error <= bound for error, bound in zip(errors, BOUNDS.get(one.key, EXACT), strict=False)), (
            one.title,
            errors,
        )
        assert one.nanoseconds(PHI[:20], order) > 0


def test_ways_in_c_and_python(library, folder, fmu_file, exact):
    ways = [*library.ways(fmu_file), *in_python.ways()]
    assert len({one.key for one in ways}) == len(ways) == 8
    for one in ways:
        check(one, exact)


@pytest.mark.parametrize("twin", [False, True], ids=["FMU", "twin"])
def test_ways_in_fmpy(folder, fmu_file, exact, twin):
    with in_python.in_fmpy(TWIN if twin else fmu_file, folder / str(twin), "fmpy", "fmpy") as one:
        check(one, exact)


def test_the_table_pays_for_its_speed_with_its_errors(library, folder, exact):
    core, table = (library.way(key, key, OURS) for key in (CORE, "table"))
    ours, theirs = (way.worst_errors(one.evaluate(PHI, 2), exact) for one in (core, table))
    assert theirs[0] > 10 * ours[0] and theirs[1] > 1e3 * ours[1] and theirs[2] > 1e5 * ours[2]


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_that_is_installed_gives_right_answers(name, library, folder, exact):
    pytest.importorskip(PEERS[name], reason="only make bench installs it")
    for one in peers.builders(library, folder)[name]():
        check(one, exact)


# ---- verified before timed -------------------------------------------------------------


def _raises(phi: np.ndarray, order: int) -> np.ndarray:
    raise RuntimeError("no licence\nsecond line")


@pytest.mark.parametrize(("evaluate", "why"), [
    (_raises, "failed: no licence"),
    (lambda phi, order: np.full((len(phi), 2 * (order + 1)), np.nan), "wrong: position off by nan mm"),
    (lambda phi, order: np.zeros((len(phi), 2 * order + 2)), "wrong: position off by 465 mm, where it is at most 465"),
    (lambda phi, order: np.zeros((3, 2)), r"wrong: \(3, 2\) numbers instead of"),
], ids=["raises", "nan", "zero", "shape"])  # fmt: skip
def test_wrong_answers_are_reported_and_not_timed(library, exact, evaluate, why):
    def never(phi: np.ndarray, order: int) -> float:
        raise AssertionError("timed though wrong")

    core = library.way(CORE, "core", OURS)
    bad = Way("bad", "bad", PEER, evaluate, never)
    cells = measure.measure([core, bad], library.way("sincos", "", ""), PHI, exact, 3)
    bad = [cell for cell in cells if cell.way.key == "bad"]
    assert len(bad) == 3 and all(re.match(why, cell.why) and not len(cell.times) for cell in bad)
    assert any(re.search(r"^Not timed: bad \((wrong|failed)", sentence) for sentence in report.findings(cells, []))
    assert report.table_rows(cells)[-1][:2] == ("bad", why.partition(":")[0])


def test_each_way_is_measured_beside_the_core(library, exact):
    """A machine that becomes three times as slow after each measurement of a way changes no ratio."""
    slowness = {"now": 1.0}

    def true(phi: np.ndarray, order: int) -> np.ndarray:
        return exact[: len(phi), : 2 * (order + 1), 0]

    def slow_time(phi: np.ndarray, order: int) -> float:
        slowness["now"] *= 3
        return 2.5 * slowness["now"] / 3

    core = Way(CORE, CORE, OURS, true, lambda phi, order: slowness["now"])
    slow = [Way(key, key, PEER, true, slow_time) for key in ("one", "other")]
    cells = measure.measure([core, *slow], library.way("sincos", "", ""), PHI, exact, 5)
    for one in cells:
        assert one.ratio == pytest.approx(1.0 if one.way is core else 2.5)
        assert one.of_core.quartiles == pytest.approx((one.ratio, one.ratio))


def test_the_ratio_is_the_median_of_ratios():
    one = Way("way", "way", PEER, lambda phi, order: phi)
    assert Cell(one, 0, (1.0,), *np.array([[2.0, 200.0, 10.0], [1.0, 100.0, 1.0], [1.0, 1.0, 5.0]])).ratio == 2
    assert (
        Cell(one, 0, (1.0,), *np.array([[2.0, 200.0, 10.0], [1.0, 100.0, 1.0], [1.0, 1.0, 5.0]])).of_sincos.median == 2
    )


# ---- who wins --------------------------------------------------------------------------


def cell(key: str, ratios: list[float], factor: float, order: int = 2) -> Cell:
    """A way with these ratios in three rounds and so many times the core's error."""
    ones = np.ones(len(ratios))
    return Cell(
        Way(key, key, PEER, lambda phi, order: phi),
        order,
        tuple(factor * error for error in EXACT[: order + 1]),
        np.array(ratios) * ones,
        ones,
        ones,
    )


CORES = [cell(CORE, [1, 1, 1], 1, order) for order in ORDERS]


@pytest.mark.parametrize(("rival", "kind"), [
    (cell("peer", [0.7, 0.8, 0.9], 1), "defeats"),
    (cell("peer", [0.7, 0.8, 0.9], ALIKE), "defeats"),
    (cell("peer", [0.7, 0.8, 0.9], 1.01 * ALIKE), "faster"),
    (cell("peer", [0.7, 0.9, 1.5], 1), "draws"),
    (cell("peer", [1.4, 1.2, 0.9], 1), "draws"),
    (cell("peer", [0.7, 0.9, 1.5], 1.01 * ALIKE), "unsure"),
    (cell("peer", [0.8] * 10 + [1.1] * 2, 1), "draws"),
    (cell("peer", [1.1, 1.2, 1.3], 0.4), "sharper"),
    (cell("peer", [1.1, 1.2, 1.3], 1), None),
], ids=["defeat", "alike", "less accurate", "draw", "draw, rather slower", "unsure", "drift", "sharper",
        "slower"])  # fmt: skip
def test_who_beats_the_core(rival, kind):
    found = measure.wins([*CORES, rival])
    assert {name for name in ("defeats", "draws", "faster", "unsure", "sharper") if getattr(found, name)} == (
        {kind} - {None}
    )


def test_one_quantity_that_is_worse_is_no_equal_accuracy():
    errors = (EXACT[0], EXACT[1], 10 * EXACT[2])
    rival = Cell(Way("peer", "peer", PEER, lambda phi, order: phi), 2, errors, *np.array([[0.5], [1.0], [1.0]]))
    assert measure.wins([*CORES, rival]).faster == (rival,)


def test_findings_name_the_winner_with_its_error_and_the_next_behind():
    lost = report.findings([*CORES, cell("fast", [0.5, 0.5, 0.5], 2)], [])
    assert (
        "Position, velocity and acceleration: **the core is beaten, at its own accuracy, by fast (0.50 of the "
        "core's time; position error 2, velocity error 2, acceleration error 2 times the core's)**"
    ) in lost[2]
    slower, coarse = cell("next", [1.25] * 3, 1), cell("coarse", [0.5, 0.5, 0.5], 2000)
    kept = report.findings([*CORES, coarse, slower], [("numba", "not installed")])
    assert "faster than every way of its accuracy" in kept[2] and "the next is next (1.25" in kept[2]
    assert "Faster, but less accurate: coarse (0.50 of the core's time; position error 2000" in kept[2]
    assert kept[-1] == "Missing: numba (not installed)."


def test_no_verdict_on_time_where_the_rounds_scatter_across_the_core():
    rival, coarse = cell("rival", [1.3, 0.9, 1.2], 1), cell("coarse", [0.8, 1.2, 0.9], 2000)
    said = report.findings([*CORES, rival, coarse], [])[2]
    assert "neither faster nor slower, at the core's accuracy, is rival (1.05 to 1.25 of the core's time" in said
    assert "Less accurate, and within the scatter neither faster nor slower: coarse" in said
    assert not any(claim in said for claim in ("the core is faster", "is beaten", "Nothing less accurate is faster"))


# ---- what is written -------------------------------------------------------------------


def test_peers_that_are_not_there_are_named(library, folder, monkeypatch):
    for module in PEERS.values():
        monkeypatch.setitem(sys.modules, module, None)
    found, missing = peers.build_all(library, folder)
    assert found == [] and [name for name, _ in missing] == list(PEERS)
    assert all(why.startswith("not installed") for _, why in missing)


def test_a_peer_that_breaks_is_named(library, folder, monkeypatch):
    def broken() -> list[Way]:
        raise OSError("no such processor")

    monkeypatch.setattr(peers, "builders", lambda *_: {"numba": broken})
    assert peers.build_all(library, folder) == ([], [("numba", "failed: no such processor")])


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, fmu_file: Path) -> Path:
    """A short run as a user starts it, without the peers."""
    output = tmp_path_factory.mktemp("reports") / "new"
    assert (
        command.main(
            [
                "--rounds",
                "3",
                "--angles",
                "40",
                "--without-peers",
                "--output",
                str(output),
                "--fmu",
                str(fmu_file),
                "--twin",
                str(TWIN),
            ]
        )
        == 0
    )
    return output


def test_files_have_every_way_at_every_order(written):
    assert sorted(path.name for path in written.iterdir()) == ["solving.csv", "solving.md", "solving.png"]
    with (written / "solving.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert len(table) == 10 * len(ORDERS) + 1
    for row in table[:-1]:
        assert float(row["of_core"]) > 0 and float(row["position_error_mm"]) > 0 and row["remark"] == ""
    assert {row["of_core"] for row in table if row["key"] == CORE} == {"1.0000"}
    assert table[-1]["remark"].startswith("missing")
    text = (written / "solving.md").read_text(encoding="utf-8")
    assert text.startswith("## Solving\n") and "Measured on: " in text and "(solving.png)" in text
    assert "| exact core, C | 1.00 | 1.00 | 1.00 |" in text and "Missing: peers (left out)." in text
    assert " 40 angles " in text


@pytest.mark.parametrize("arguments", [["--fmu", "no.fmu"], ["--rounds", "1"], ["--angles", "3"]])
def test_what_cannot_be_measured_is_refused_in_one_line(arguments, capsys):
    assert command.main(arguments) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize(("value", "text"), [
    (6.3e-13, "6.3e-13"), (8.7e-8, "8.7e-8"), (0.0123, "0.012"), (743.0, "740"),
])  # fmt: skip
def test_error(value, text):
    assert report.error_text(value) == text


# ---- what is installed for it ----------------------------------------------------------


def pinned(name: str) -> set[tuple[str, str]]:
    """Package and version with its marker, as a lock has them."""
    text = (PROJECT_ROOT / name).read_text(encoding="ascii")
    return set(re.findall(r"^([\w.-]+)==(\S+(?: ; [^\\]*\S)?) \\$", text, re.MULTILINE))


def test_the_peers_lock_agrees_with_the_project_s_own():
    ours, theirs = pinned("requirements.lock"), pinned("requirements-bench.lock")
    assert set(PEERS.values()) <= {package for package, _ in theirs}
    assert {package for package, _ in ours} & {*PEERS.values()} <= {"casadi", "scipy"}, (
        "of the peers a host of others and the sweep need these alone"
    )
    shared = {package for package, _ in ours} & {package for package, _ in theirs}
    assert "numpy" in shared
    own, other = (
        {(package, version.partition(" ")[0]) for package, version in lock if package in shared}
        for lock in (ours, theirs)
    )
    assert other <= own
