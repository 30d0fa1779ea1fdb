"""What measured times allow to be said: sides, figures and noise, from made-up measurements; names beside curves."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.text import Text

from scenarios.common import figures
from scenarios.common.timing import Ratios, noise, ratio_text
from scenarios.speed_vs_error.__main__ import dearest_rung
from scenarios.speed_vs_error.cost import instances, step_cost
from scenarios.speed_vs_error.cost.use_cost import Costs
from scenarios.speed_vs_error.coupling.measure import RUNGS


@pytest.mark.parametrize(
    ("rounds", "side"),
    [
        ([0.8] * 9, -1),
        ([1.2] * 9, 1),
        ([1.0] * 9, 0),
        ([0.8, 0.9, 1.2, 1.4] * 9, 0),  # the middle half reaches across
        ([0.8, 0.8, 0.8, 0.8, 9.0] * 9, -1),  # an outlier in each five
        ([0.9] * 50 + [1.02] * 10, 0),  # the last third says otherwise
        ([0.8, 0.9], -1),
        ([], 0),
    ],
    ids=["below", "above", "equal", "scatter", "outliers", "drift", "two rounds", "none"],
)
def test_a_side_is_taken_only_where_each_third_of_the_rounds_takes_it(rounds: list[float], side: int) -> None:
    assert Ratios(np.array(rounds)).side() == side
    assert Ratios(2 * np.array(rounds)).side(2.0) == side
    assert Ratios(1 / np.array(rounds)).side() == -side


@pytest.mark.parametrize(
    ("rounds", "text"),
    [
        ([1.48, 1.5, 1.52], "1.50"),
        ([1.2, 1.5, 2.9], "1.35 to 2.20"),
        ([2.0, 2.2, 2.21, 3.9, 3.95], "2.20 to 3.90"),
    ],
)
def test_a_figure_stands_alone_only_where_it_is_steady(rounds: list[float], text: str) -> None:
    assert str(Ratios(np.array(rounds))) == text


@pytest.mark.parametrize(("value", "text"), [(0.2812, "0.28"), (9.994, "9.99"), (68.13, "68"), (2634.0, "2 630")])
def test_ratio(value: float, text: str) -> None:
    assert ratio_text(value) == text


def test_noise_names_scatter_and_who_else_ran() -> None:
    quiet = noise([1.0] * 50, "sincos", 0.9, 4, 2)
    assert quiet == (
        "Noise: sincos took 1.00 to 1.00 times its median in nine rounds of ten; 0.9 programs wanted the 4 threads."
    )
    busy = noise([1.0, 1.0, 1.0, 1.5], "sincos", 3.2, 2, 2)
    assert "1.00 to 1.4" in busy and busy.endswith(
        "3.2 programs wanted the 2 threads: others ran beside, 2 threads share a core."
    )
    assert (
        noise([2.0], "sincos", None, 1, 1) == "Noise: sincos took 1.00 to 1.00 times its median in nine rounds of ten."
    )


# --- the reports that judge by it -----------------------------------------------------------


def step_rounds(core: list[float], step: list[float], sincos: float = 10.0) -> list[dict[str, float]]:
    """With masses a step takes 90 ns."""
    return [
        {"sincos": sincos, "core_2": c, step_cost.STEP: s, step_cost.FOR_DRIVE: 90.0}
        for c, s in zip(core, step, strict=True)
    ]


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ([60.0, 61.0, 62.0], ("is kept", "not kept", "is kept")),
        ([80.0, 81.0, 82.0], ("not kept", "not kept", "is kept")),
        ([50.0, 75.0, 90.0], ("not to be told", "not to be told", "not to be told")),
        ([55.0, 56.0, 56.2], ("is kept", "is kept", "not kept")),
    ],
    ids=["in cores", "neither", "noise", "both"],
)
def test_bounds_of_a_step_are_judged_by_what_was_measured(step: list[float], said: tuple[str, str, str]) -> None:
    verdicts = step_cost.verdicts(step_rounds([50.0] * 3, step))
    assert len(verdicts) == 3 and all(words in verdict for words, verdict in zip(said, verdicts, strict=True))
    assert "the bound of 1.4" in verdicts[0] and "the bound of 5.8" in verdicts[1]
    assert "the bound of 1.6" in verdicts[2] and "torque, inertia and bias" in verdicts[2]


@pytest.mark.parametrize(
    ("size", "times", "said"),
    [
        (2048, [14.0, 14.5, 14.9], ("2048 bytes, within the 2048", "is kept")),
        (2049, [16.0, 17.0, 18.0], ("2049 bytes, above the 2048", "is not kept")),
        (9, [10.0, 15.0, 20.0], ("9 bytes, within", "1.25 to 1.75 times", "not to be told")),
    ],
    ids=["kept", "not kept", "noise"],
)
def test_many_instances_are_judged_by_what_was_measured(size: int, times: list[float], said: tuple[str, ...]) -> None:
    rounds = {1: np.full(3, 10.0), 100_000: np.array(times)}
    text = " ".join(instances.sentences(instances.Instances(rounds, size)))
    assert "One of 100 000 instances" in text
    assert all(words.replace("10.0 to 20.0 times", "1.25 to 1.75 times") in text for words in said), text


def test_the_bound_of_the_core_is_its_chain() -> None:
    rounds = [{"multiplication": 1.0, "core_2": 60.0, "core_2_chain": 100.0}] * 3
    assert "100 multiplications long, 400 cycles at 4 each" in step_cost.chain(rounds, "Intel(R) Xeon")
    assert "300 cycles at 3 each" in step_cost.chain(rounds, "AMD EPYC")
    assert "100 multiplications long. In a loop" in (other := step_cost.chain(rounds, "another"))
    assert "one takes 0.60 of that" in other


def test_the_dearest_rung_is_named_only_where_times_are_steady() -> None:
    steady = Costs({rung.key: np.full(30, 1.0 + 0.1 * k) for k, rung in enumerate(RUNGS)})
    assert dearest_rung(steady) == ": the step is what costs, no rung costs more than 1.8 times the held step"
    drifting = dict(steady.rounds) | {"angle": np.repeat([1.0, 1.0, 3.0], 10)}
    drifting[RUNGS[0].key] = np.full(30, 1.0)
    noisy = drifting | {"angle": np.concatenate([np.full(24, 1.2), np.full(6, 5.0)])}
    assert dearest_rung(Costs(noisy)) == ""


# --- names beside curves ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("places", "moved"),
    [
        ([0.0, 100.0], [0.0, 100.0]),
        ([50.0, 50.0], [45.0, 55.0]),
        ([0.0, 50.0, 51.0, 52.0], [0.0, 41.0, 51.0, 61.0]),
    ],
)
def test_names_move_no_more_than_they_must(places: list[float], moved: list[float]) -> None:
    assert figures.spread(places, 10) == pytest.approx(moved)


def test_names_of_ends_that_coincide_do_not_overlap() -> None:
    figure, axes = plt.subplots()
    axes.set(xlim=(0, 2), ylim=(0, 1))
    figures.name_ends(axes, [(1.0, 0.5, "one", "k"), (1.0, 0.5, "other", "k"), (0.8, 0.52, "third", "k")])
    figure.draw_without_rendering()
    boxes = [Text.get_window_extent(text) for text in axes.texts]  # without their leading lines
    assert len(boxes) == 3
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    plt.close(figure)
