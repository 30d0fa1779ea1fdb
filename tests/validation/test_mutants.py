"""Every mutant of the catalogue is caught by the check that it names, for the reason that it names."""

from __future__ import annotations

import re

import pytest

from fmu_src.validation.subject import Options
from fmu_src.validation.table import FAILED, NAMES, WARNED, validate
from tests.validation.mutants import ERROR, MUTANTS, PAGE, Mutant, page


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
@pytest.mark.usefixtures("shared_probes")
def test_mutant(mutant: Mutant, tmp_path):
    path = tmp_path / "Mutant.fmu"
    mutant.write(path)
    results = {result.title: result for result in validate(path, Options(skip=frozenset(NAMES) - mutant.checks))}
    result = results[mutant.check]
    assert result.outcome == (FAILED if mutant.level == ERROR else WARNED), (result, results)
    said = "\n".join(result.problems if mutant.level == ERROR else result.advice)
    assert re.search(mutant.says, said), said


def test_the_catalogue_is_what_it_says():
    names = [mutant.name for mutant in MUTANTS]
    assert len(set(names)) == len(names) and len({mutant.what for mutant in MUTANTS}) >= 90


def test_the_page_is_of_this_catalogue():
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m tests.validation.mutants"
