"""Fixtures of this room."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fmu_src.validation import subject
from fmu_src.validation.process import Probe


class Shared:
    """A probe that many FMUs are given in turn, for starting one takes longer than most jobs."""

    outlived = 0

    def __init__(self, probe: Probe) -> None:
        self.start, self.do = probe.start, probe.do

    def close(self) -> None: ...

    def remove(self) -> None: ...


@pytest.fixture(scope="session")
def kept_probes(tmp_path_factory) -> Iterator[list[Probe]]:
    made = [Probe(tmp_path_factory.mktemp("probe"), 60.0) for _ in range(2)]
    yield made
    for probe in made:
        probe.remove()


@pytest.fixture
def shared_probes(kept_probes, monkeypatch) -> None:
    """The next FMU that is validated is run in processes that are there already."""
    shared = iter(map(Shared, kept_probes))
    monkeypatch.setattr(subject, "Probe", lambda *_: next(shared))
