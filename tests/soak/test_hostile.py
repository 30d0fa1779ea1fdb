"""Any sequence of calls, from any number of threads, and many steps: shortened runs of hostile.py."""

from __future__ import annotations

import pytest

from tests.soak import hostile


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("hostile")


@pytest.mark.parametrize("fmi", hostile.FUZZERS)
@pytest.mark.parametrize(
    ("sanitizer", "seeds", "calls", "threads"), [("memory", 4, 200_000, 1), ("threads", 2, 50_000, 4)]
)
def test_any_sequence_of_calls(folder, fmi, sanitizer, seeds, calls, threads):
    """No crash, no leak, no undefined behaviour, no race; refused calls leave no trace (see fuzz.h)."""
    try:
        program = hostile.build_fuzzer(folder, sanitizer, fmi)
    except hostile.NoSanitizer as reason:
        pytest.skip(str(reason))
    for seed in range(seeds):
        assert "Discard" in hostile.fuzz(program, seed, calls, threads)


def test_hours_of_planting_do_not_drift(folder, fmu_file):
    """Two hours and a quarter; the travel is the closed form to rounding, the time is the host's."""
    season = hostile.plant(folder, 8_000_000)
    assert season.travel <= 2 and season.tip <= 2 and season.time <= 1
