"""The figures of the report on speed and error.

Errors are in mm, mm/s and mm/s2, both axes logarithmic. One line is one rung, in a palette
that the colour-blind can tell apart (Okabe and Ito), with a marker of its own.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from scenarios.common.figures import (
    BLACK,
    BLUE,
    GREEN,
    NOTE,
    ORANGE,
    PINK,
    SKY,
    STYLE,
    VERMILLION,
    save_all,
)
from scenarios.speed_vs_error.cost.use_cost import BASE, Costs, Use
from scenarios.speed_vs_error.coupling.crank_profiles import Profile
from scenarios.speed_vs_error.coupling.measure import QUANTITIES, RUNGS, SOLVING, Coupling
from scenarios.speed_vs_error.coupling.smoothing import EXACT, NOISY, WINDOWS_MS, Smoothing

UNITS = ("mm", "mm/s", "mm/s²")
# Colour, marker, its size and the line's dashes: larger marks lie below smaller ones.
LOOKS = {
    "held": (BLACK, "s", 5.0, "-"),
    "derivative_1": (ORANGE, "v", 6.0, "-"),
    "derivatives_2": (SKY, "^", 6.0, "-"),
    "angle": (GREEN, "o", 6.0, "-"),
    "angle_speed": (BLUE, "D", 5.5, "-"),
    "angle_speed_acceleration": (VERMILLION, "o", 3.2, "--"),
    "at_step_end": (PINK, "x", 5.5, ":"),
}


def draw_all(
    output: Path,
    coupling: Coupling,
    smoothing: Smoothing,
    *,
    profiles: Sequence[Profile],
    reference: str,
    c_host: Costs | None,
    fmpy_host: Costs,
    uses: Sequence[Use],
) -> list[Path]:
    """Write the figures and return their paths; ``reference`` is the profile of the speed figure."""
    figures: dict[str, Callable[[], Figure]] = {
        f"error_of_{quantity}": lambda n=n: draw_errors(coupling, profiles, n) for n, quantity in enumerate(QUANTITIES)
    }
    title = next(p.title for p in profiles if p.key == reference)
    figures["error_over_speed"] = lambda: draw_speed(coupling, reference, title, c_host, fmpy_host)
    figures["smoothing"] = lambda: draw_smoothing(smoothing)
    if c_host is not None:
        figures["uses"] = lambda: draw_uses(c_host, uses)
    return save_all(output, figures)


def _line(axes: Axes, rung: str, x: np.ndarray, errors: np.ndarray, quantity: int, label: str) -> None:
    colour, marker, size, dashes = LOOKS[rung]
    axes.plot(
        x,
        np.maximum(errors, SOLVING[quantity]) * 1e3,
        dashes,
        color=colour,
        marker=marker,
        markersize=size,
        linewidth=1.4,
        markeredgewidth=1.3 if marker == "x" else 0.5,
        label=label,
        clip_on=False,
    )


def _error_axis(axes: Axes, quantity: int, highest: float) -> None:
    """From the solving error up to a decade above the highest, in m or its rates."""
    axes.set_yscale("log")
    axes.set_ylim(SOLVING[quantity] * 1e3, 10 ** np.ceil(np.log10(highest * 1e3)))
    axes.yaxis.set_major_locator(LogLocator(base=10, numticks=9))
    axes.yaxis.set_minor_locator(NullLocator())


def draw_errors(coupling: Coupling, profiles: Sequence[Profile], quantity: int) -> Figure:
    """Worst error over step: one panel a profile."""
    figure, grid = plt.subplots(2, 3, figsize=(11.0, 7.4), sharex=True, sharey=True)
    steps = np.array(coupling.steps_ms)
    highest = max(error.worst[quantity] for error in coupling.all)
    for axes, profile in zip(grid.flat, profiles, strict=True):
        exact = []
        for rung in RUNGS:
            errors = coupling.worst(profile.key, rung.key, quantity)
            if np.all(errors <= SOLVING[quantity]):
                exact.append(rung.key)
            else:
                _line(axes, rung.key, steps, errors, quantity, rung.title)
        axes.set_xscale("log")
        _error_axis(axes, quantity, highest)
        axes.xaxis.set_major_locator(FixedLocator(steps))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_title(profile.title, loc="left")
        # Those that are exact at every step would hide each other on the lower edge: their marks stand there instead.
        if exact:
            axes.text(0.03, 0.12, "exact:", transform=axes.transAxes, va="center", fontsize=8.5, color=NOTE)
            for k, key in enumerate(exact):
                colour, marker, size, _ = LOOKS[key]
                axes.plot(
                    0.17 + 0.065 * k,
                    0.12,
                    marker,
                    transform=axes.transAxes,
                    color=colour,
                    markersize=max(size, 4.5),
                    markeredgewidth=1.5 if marker == "x" else 0.5,
                    clip_on=False,
                )
    for axes in grid[1]:
        axes.set_xlabel("communication step / ms")
    for axes in grid[:, 0]:
        axes.set_ylabel(f"worst error / {UNITS[quantity]}")
    figure.suptitle(
        f"Tip {QUANTITIES[quantity]}: worst error over the communication step, after the start-up",
        x=0.012,
        ha="left",
        fontsize=11,
    )
    handles = [
        Line2D([], [], linestyle=dashes, color=colour, marker=marker, markersize=size, label=rung.title)
        for rung, (colour, marker, size, dashes) in ((rung, LOOKS[rung.key]) for rung in RUNGS)
    ]
    figure.legend(handles=handles, loc="lower center", ncols=4, bbox_to_anchor=(0.5, 0.03), title="What the host gives")
    figure.text(
        0.5,
        0.012,
        "On the lower edge, or named there by its mark alone: exact, or as small as the solving error.",
        ha="center",
        color=NOTE,
        fontsize=8,
    )
    figure.tight_layout(rect=(0, 0.13, 1, 0.985))
    return figure


def write_headline(path: Path, coupling: Coupling, profile: Profile, tolerance: float) -> None:
    """The one figure that the documentation shows: worst position error over the step, as SVG.

    Its description holds the numbers drawn, so that a test can tell when they are no longer true.
    ``tolerance`` in m is drawn as a line.
    """
    with plt.rc_context(STYLE | {"svg.hashsalt": "headline", "svg.fonttype": "none", "font.family": "sans-serif"}):
        figure, axes = plt.subplots(figsize=(8.6, 4.6))
        steps = np.array(coupling.steps_ms)
        drawn = {}
        for rung in RUNGS:
            errors = coupling.worst(profile.key, rung.key)
            if np.all(errors <= SOLVING[0]):
                continue
            drawn[rung.key] = [float(f"{error:.4g}") for error in errors]
            _line(axes, rung.key, steps, errors, 0, "")
            order = coupling.order(profile.key, rung.key)
            axes.annotate(
                f"{rung.title}, order {order:.0f}",
                (steps[0], errors[0] * 1e3),
                xytext=(9, 0),
                textcoords="offset points",
                va="center",
                fontsize=8.5,
                color=LOOKS[rung.key][0],
                annotation_clip=False,
            )
        axes.axhline(tolerance * 1e3, color=NOTE, linewidth=0.8, linestyle="--")
        axes.annotate(
            f"{tolerance * 1e6:g} µm",
            (steps[0], tolerance * 1e3),
            xytext=(24, 0),
            va="center",
            textcoords="offset points",
            fontsize=8.5,
            color=NOTE,
        )
        axes.set(xscale="log", xlabel="communication step / ms", ylabel="worst error of the tip / mm")
        _error_axis(axes, 0, max(max(errors) for errors in drawn.values()))
        axes.set_ylim(bottom=1e-11)
        axes.xaxis.set_major_locator(FixedLocator(steps))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.invert_xaxis()  # where steps are short the lines lie apart, for their names
        axes.set_title(f"What the host gives of the crank: {profile.title}", loc="left")
        figure.tight_layout(rect=(0, 0, 0.99, 1))
        figure.savefig(
            path,
            metadata={
                "Date": None,
                "Creator": "make figure",
                "Description": json.dumps({"steps_ms": list(coupling.steps_ms), "position_m": drawn}),
            },
        )
        plt.close(figure)


def draw_speed(coupling: Coupling, profile: str, title: str, c_host: Costs | None, fmpy_host: Costs) -> Figure:
    """Worst position error over steps a second and over the host's time."""
    hosts = [("C host", c_host)] if c_host is not None else []
    hosts.append(("fmpy", fmpy_host))
    figure, panels = plt.subplots(1, 1 + len(hosts), figsize=(3.7 * (1 + len(hosts)), 4.9), sharey=True, squeeze=False)
    rates = 1e3 / np.array(coupling.steps_ms)  # 1/s
    for rung in RUNGS:
        errors = coupling.worst(profile, rung.key)
        order = coupling.order(profile, rung.key)
        label = rung.title + (f" (order {order:.1f})" if np.isfinite(order) else " (exact)")
        _line(panels[0, 0], rung.key, rates, errors, 0, label)
        for axes, (_, costs) in zip(panels[0, 1:], hosts, strict=True):
            _line(axes, rung.key, rates / 1e3 * costs.ratio(rung.key, "held"), errors, 0, label)
    for axes in panels.flat:
        axes.set_xscale("log")
        first, last = np.log10(axes.get_xlim())
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if last - first < 2.5 else (1,)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        _error_axis(axes, 0, max(error.worst[0] for error in coupling.all if error.profile == profile))
    panels[0, 0].set(xlabel="communication steps a second", ylabel="worst error of the tip / mm")
    panels[0, 0].set_title("Steps", loc="left")
    for axes, (name, _) in zip(panels[0, 1:], hosts, strict=True):
        axes.set_xlabel("host time (held at 1 ms = 1)")
        axes.set_title(f"Time of a step in {'a ' if name == 'C host' else ''}{name}", loc="left")
    figure.suptitle(f"Error against speed: {title} (on the lower edge: exact)", x=0.012, ha="left", fontsize=11)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, bbox_to_anchor=(0.5, 0.0))
    figure.tight_layout(rect=(0, 0.17, 1, 0.985))
    return figure


def draw_smoothing(smoothing: Smoothing) -> Figure:
    """Worst errors over the window, of position and acceleration, for the noisy and the exact angle."""
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 4.0))
    windows = np.array(WINDOWS_MS)
    for axes, quantity in zip(panels, (0, 2), strict=True):
        for step, colour in zip(smoothing.steps_ms, (BLUE, VERMILLION, GREEN), strict=False):
            for profile, dashes, marker in ((NOISY, "-", "o"), (EXACT, ":", "x")):
                errors = [smoothing.worst(profile, window, step, quantity) * 1e3 for window in WINDOWS_MS]
                axes.plot(
                    windows,
                    errors,
                    dashes,
                    marker=marker,
                    markersize=4.5,
                    color=colour,
                    label=f"{step:g} ms, {'20-bit encoder' if profile is NOISY else 'exact angle'}",
                )
        axes.set_yscale("log")
        axes.set_xlabel("crank.smoothing / ms (0: none)")
        axes.set_ylabel(f"worst error / {UNITS[quantity]}")
        axes.set_title(QUANTITIES[quantity], loc="left")
    figure.suptitle(
        "The angle alone, smoothed: what it buys where the angle is noisy, and costs where it is not",
        x=0.012,
        ha="left",
        fontsize=11,
    )
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, bbox_to_anchor=(0.5, 0.0))
    figure.tight_layout(rect=(0, 0.13, 1, 0.985))
    return figure


def draw_uses(costs: Costs, uses: Sequence[Use]) -> Figure:
    """What a step costs by what is read, in times of one that reads positions."""
    figure, axes = plt.subplots(figsize=(8.0, 3.4))
    ratios = np.array([costs.ratio(use.key, BASE) for use in uses])
    quartiles = np.array([costs.spread(use.key, BASE) for use in uses])
    whiskers = np.maximum(np.abs(quartiles.T - ratios), 0)
    places = np.arange(len(uses))
    axes.barh(places, ratios, color=BLUE, height=0.62, xerr=whiskers, error_kw={"ecolor": BLACK, "capsize": 2})
    for place, ratio, (_, high) in zip(places, ratios, quartiles, strict=True):
        axes.text(max(ratio, high) + 0.06, place, f"{ratio:.2f}", va="center")
    axes.set_yticks(places, [use.title for use in uses])
    axes.set_xlim(0, 1.1 * max(ratios.max(), quartiles.max()))
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("time of a step (reading positions = 1); whiskers: middle half of the rounds")
    axes.set_title("What a step pays for what is read, in a C host", loc="left")
    figure.tight_layout()
    return figure
