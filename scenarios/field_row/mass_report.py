"""What the masses do to a row, in tables and sentences."""

from __future__ import annotations

import math

import numpy as np
from rich.console import Console

from scenarios.common import reports
from scenarios.field_row import mass_study
from scenarios.field_row.mass_study import HANDS, MassStudy


def by_hand(found: MassStudy) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: what a soft drive makes of what it is handed over."""
    steps = [f"{step:g} ms" for step in mass_study.STEPS_MS]
    headings = ("handed over", *(f"error at {step} / mrad" for step in steps), "order")
    lines = []
    for hand in HANDS:
        worst = [found.coupling.worst[hand.key, 1e-3 * step] for step in mass_study.STEPS_MS]
        texts = (f"{1e3 * value:.2g}" if math.isfinite(value) else "diverges" for value in worst)
        order = found.coupling.order(hand.key)
        lines.append((hand.title, *texts, f"{order:.1f}" if math.isfinite(order) else "-"))
    return headings, lines


def borders(found: MassStudy) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: the least inertia of the drive with which its coupling stays bounded."""
    headings = ("handed over", *(f"at {step:g} ms / kg·m²" for step in mass_study.STEPS_MS))
    return headings, [
        (hand.title, *(f"{found.coupling.border[hand.key, 1e-3 * step]:.2g}" for step in mass_study.STEPS_MS))
        for hand in HANDS
        if hand.torque
    ]


WITH_MASSES = ("", "without masses", "with masses")


def with_masses_beside(found: MassStudy) -> list[tuple[str, str, str]]:
    """Lines under WITH_MASSES: a row of few plants on even ground speed, in its middle turn and as a whole."""
    records = found.without, found.heavy

    def ends(name: str, unit: str, scale: float = 1.0) -> tuple[str, str]:
        texts = (f"{scale * r[name].min() + 0.0:.3g} to {scale * r[name].max() + 0.0:.3g} {unit}" for r in records)
        return tuple(texts)

    uneven = []
    for record in records:
        w = mass_study.middle_turn(record)[1]
        uneven.append(f"{100 * np.ptp(w) / w.mean():.2g} %")
    off = (f"{100 * abs(r.imbalance).max() / r['drivetrain.energy.tractor'][-1]:.2g} %" for r in records)
    return [
        ("torque of the linkage on the crank", *ends("linkage.crank.tau", "N·m")),
        ("torque in the shaft", *ends("drivetrain.shaft.tau", "N·m")),
        ("force of the linkage on the machine, forward", *ends("linkage.machine.fx", "N")),
        ("... upward", *ends("linkage.machine.fy", "N")),
        ("pull of the tractor", *ends("drivetrain.machine.pull", "N")),
        ("crank's speed in a turn, greatest less least, of its mean", *uneven),
        ("energy swinging in the links", "none", f"{np.ptp(found.heavy.links):.3g} J"),
        ("energy not accounted for, of the tractor's work", *off),
    ]


def findings(found: MassStudy) -> list[str]:
    """What the masses do, in sentences."""
    coupling, shares = found.coupling, found.shares
    mean = coupling.speed[1]
    diverged = [step for (key, step), worst in coupling.worst.items() if key == "torque" and math.isinf(worst)]
    rpm = [60 / math.tau * w for w in coupling.speed]
    return [
        (
            "The masses are assumptions: links of steel and aluminium with sections drawn in "
            f"`scenarios/common/masses.py`, {found.mass:.2f} kg in all."
        ),
        (
            f"In a turn, inertia takes {shares['inertia'].min():.1f} to {shares['inertia'].max():.1f} N·m of the "
            f"crank, weight {shares['weight'].min():.1f} to {shares['weight'].max():.1f}, the soil "
            f"{shares['soil'].min():.1f} to {shares['soil'].max():.1f}; all together "
            f"{sum(shares.values()).min():.1f} to {sum(shares.values()).max():.1f}."
        ),
        (
            f"A drive of {mass_study.LIGHT:g} kg·m² that gives way by {mass_study.SLOPE:g} N·m per rad/s runs between "
            f"{rpm[0]:.0f} and {rpm[2]:.0f} turns a minute "
            f"({100 * (coupling.speed[2] - coupling.speed[0]) / mean:.0f} % of its mean) with these links, without "
            "any soil."
        ),
        (
            "Given `crank.inertia` and `crank.tau_bias` it keeps order "
            f"{coupling.order('inertia'):.1f}. Given `crank.tau`, which contains the acceleration of the last step, it "
            + (f"diverges at {', '.join(f'{1e3 * step:g}' for step in diverged)} ms. " if diverged else "stays. ")
            + "Its last acceleration comes back in each step times up to crank.inertia / J, here "
            f"{coupling.largest / mass_study.LIGHT:.1f}, and more where it goes on as a straight line: shorter steps "
            "do not help, only a drive heavier than the linkage, whose greatest inertia is "
            f"{coupling.largest:.3f} kg·m²."
        ),
    ]


def show(console: Console, found: MassStudy) -> None:
    """Print the tables and what they say."""
    reports.show_table(console, "What masses do", WITH_MASSES, with_masses_beside(found))
    reports.show_table(console, "A soft, light drive: error of its angle", *by_hand(found))
    reports.show_table(console, "Inertia below which it diverges", *borders(found))
    for sentence in findings(found):
        console.print(f"- {sentence}", markup=False)


def section(found: MassStudy) -> list[str]:
    """The report's lines on the masses."""
    return [
        "## Masses",
        "",
        (
            f"A row of {mass_study.PLANTS} plants without and with masses, on even ground speed, in steps of "
            f"{1e3 * mass_study.STEP:g} ms."
        ),
        "",
        *(f"- {sentence}" for sentence in findings(found)),
        "",
        reports.markdown_table(WITH_MASSES, with_masses_beside(found)),
        "![Torque in its shares](masses.png)",
        "",
        "### What the drive is handed over",
        "",
        "The worst error of the crank's angle, against the one differential equation of drive and linkage:",
        "",
        reports.markdown_table(*by_hand(found)),
        (
            "The least inertia of the drive with which the coupling stays bounded for a turn, sought by "
            f"{mass_study.HALVINGS} halvings from {mass_study.LIGHTEST:g} to {mass_study.HEAVIEST:g} kg·m²:"
        ),
        "",
        reports.markdown_table(*borders(found)),
        "![Error over step, and border of stability](drive.png)",
        "",
    ]
