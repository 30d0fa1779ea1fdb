"""Some of the histories of histories.py for each thing that a host may give."""

from __future__ import annotations

import pytest

from tests.soak import histories

COUNT = 2500


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return histories.build(tmp_path_factory.mktemp("histories"))


@pytest.mark.parametrize("smoothing", histories.WINDOWS)
@pytest.mark.parametrize("given", histories.PROMISED)
def test_no_position_is_much_worse_than_holding(program, given, smoothing):
    found = histories.worst(program, given, smoothing, False, 0, COUNT)
    assert found.beyond == 0, f"history {found.history}: {found.times_holding:.3g} times what holding misses by"


@pytest.mark.parametrize("given", histories.PROMISED)
def test_inputs_of_the_steps_end_are_taken_as_they_are(program, given):
    assert histories.worst(program, given, 0.0, True, 0, COUNT).times_holding < 1e-3
