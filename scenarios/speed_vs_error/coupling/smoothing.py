"""What the smoothing of a noisy crank angle buys, and what it costs: crank.smoothing of the linkage FMU.

The angle alone is given: as an encoder of 20 bits reads it, where smoothing averages the counts, and exactly,
where the window only adds its lag. Everything else is as in `scenarios.speed_vs_error.coupling.measure`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from scenarios.common.instance import UnpackedFmu
from scenarios.speed_vs_error.coupling import measure as coupled
from scenarios.speed_vs_error.coupling.crank_profiles import PROFILES, Profile
from scenarios.speed_vs_error.coupling.measure import ANGLE, Coupling, Rung

WINDOWS_MS = (0.0, 2.0, 4.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0)
STEPS_MS = (0.1, 1.0, 5.0)
DURATION = 3.0  # s: thirty times the widest window
NOISY, EXACT = (replace(next(p for p in PROFILES if p.key == key), duration=DURATION) for key in ("encoder", "ripple"))


def smoothed(window_ms: float) -> Rung:
    """The angle alone, smoothed over a window."""
    return replace(
        ANGLE, key=f"smoothed_{window_ms:g}", title=f"angle smoothed over {window_ms:g} ms", smoothing=window_ms * 1e-3
    )


SMOOTHED = smoothed(12.0)


@dataclass(frozen=True)
class Smoothing:
    """Errors by window, for the noisy and the exact angle."""

    errors: Coupling

    @property
    def steps_ms(self) -> tuple[float, ...]:
        return self.errors.steps_ms

    def worst(self, profile: Profile, window_ms: float, step_ms: float, quantity: int) -> float:
        return float(self.errors.at(profile.key, smoothed(window_ms).key, step_ms).worst[quantity])

    def best_window(self, step_ms: float) -> float:
        """The window in ms with the least error of the acceleration, for the noisy angle."""
        return min(WINDOWS_MS, key=lambda window: self.worst(NOISY, window, step_ms, 2))


def step_count(steps_ms: Sequence[float]) -> int:
    """For a progress bar."""
    return coupled.step_count((NOISY, EXACT), [smoothed(window) for window in WINDOWS_MS], steps_ms)


def measure(fmu: UnpackedFmu, smallest_step_ms: float, done: Callable[[int], object]) -> Smoothing:
    """Drive both angles with every window; ``done`` is called with the steps taken."""
    steps = steps_from(smallest_step_ms)
    rungs = [smoothed(window) for window in WINDOWS_MS]
    return Smoothing(coupled.measure(fmu, (NOISY, EXACT), rungs, steps, done))


def steps_from(smallest_step_ms: float) -> tuple[float, ...]:
    return tuple(step for step in STEPS_MS if step >= smallest_step_ms)
