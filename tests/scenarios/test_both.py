"""`python -m scenarios`, which `make run` runs: the cycle while other processes plant."""

from __future__ import annotations

import pytest

from scenarios import __main__ as both
from scenarios.field_row import __main__ as field_row
from scenarios.field_row.partners.build import build
from scenarios.paper_cycle import __main__ as paper_cycle


@pytest.fixture
def few(fmu_files, tmp_path, monkeypatch):
    """The two reports into a folder, the row of one plant with few runs beside it."""
    build()
    for name, value in {"STEPS_MS": (10.0,), "TRUTH_MS": 5.0, "LIMIT_MS": 5.0, "TOLERANCES": (), "PLANTS": 1}.items():
        monkeypatch.setattr(field_row.row_study, name, value)
    rows = field_row.main
    arguments = ["--plants", "1", "--step", "10", "--output", str(tmp_path / "row")]
    monkeypatch.setattr(field_row, "main", lambda none, meanwhile: rows([*none, *arguments], meanwhile))
    return tmp_path


def test_the_cycle_is_shown_before_the_row(few, monkeypatch, capsys):
    monkeypatch.setattr(paper_cycle, "main", lambda none: print("the cycle") or 0)
    assert both.main([]) == 0
    said = capsys.readouterr().out
    assert said.startswith("the cycle\n") and "Tables and figures" in said
    assert {"row.png", "errors.png", "signals.csv", "field_row.md"} < {path.name for path in (few / "row").iterdir()}


def test_a_cycle_that_fails_gives_up_the_row(few, monkeypatch, capsys):
    monkeypatch.setattr(paper_cycle, "main", lambda none: 3)
    with pytest.raises(SystemExit) as end:
        both.main([])
    assert end.value.code == 3 and capsys.readouterr().out == ""
    assert list((few / "row").iterdir()) == []
