"""interface.toml: mistakes in it are found when it is read, and the message names the variable."""

from __future__ import annotations

import re

import pytest

from fmu_src.interface import INTERFACE_FILE, InterfaceError, load_interface

TOML = INTERFACE_FILE.read_text(encoding="utf-8")


def line(name: str) -> str:
    """The one line that declares this variable."""
    (found,) = re.findall(rf'^ *\{{ name = "{re.escape(name)}".*$', TOML, flags=re.MULTILINE)
    return found


MISTAKES = {
    # what: (variable, what to replace in its line, by what, what the message says besides)
    "a name twice": ("tip.y", 'name = "tip.y"', 'name = "tip.x"', "tip.x: .*twice"),
    "no name": ("tip.y", 'name = "tip.y", ', "", "number 9"),
    "no kind": ("tip.y", 'kind = "output", ', "", "kind"),
    "unknown kind": ("tip.y", '"output"', '"local"', "local"),
    "unknown unit": ("tip.vy", '"m/s"', '"furlong"', "furlong"),
    "input without a start": ("crank.w", "start = 0.0, ", "", "start"),
    "parameter without a start": ("geometry.L5", "start = 0.24, ", "", "start"),
    "no text": ("machine.v", re.search(r', text = ".*"', line("machine.v")).group(), "", "text"),
    "dependency on nothing": ("tip.x", '["crank.phi"]', '["crank.psi"]', "crank.psi"),
    "dependency on an output": ("tip.x", '["crank.phi"]', '["tip.y"]', "tip.y"),
    "unknown dependency kind": ("ground.vx", "machine.v:constant", "machine.v:sometimes", "sometimes"),
    "initial dependency on nothing": ("tip.x", 'initially = ["tip"]', 'initially = ["geometry.L99"]', "geometry.L99"),
    "initial dependency on an input": ("tip.x", 'initially = ["tip"]', 'initially = ["crank.w"]', "crank.w"),
    "output without an equation": ("tip.x", 'equation = "tip.x", ', "", "equation"),
    "output without a group": ("tip.x", 'group = "position", ', "", "group"),
    "input that is computed": ("crank.a", "start = 0.0", 'start = 0.0, group = "angle"', "group"),
    "unknown factor": ("tip.vx", " crank.w", " crank.q", "'crank.q' is a second factor of its kind, or none of tip.x"),
    "two factors of a kind": ("tip.vx", " crank.w", " tip.y", "'tip.y' is a second factor"),
    "product of nothing": ("tip.ax", " crank.a", " crank.a + ", "a product has factors"),
    "too many primes": ("tip.x", '= "tip.x", d', """= "tip.x\'\'\'", d""", "at most 2 primes"),
    "output with a range": ("tip.x", "initially", "range = [0.0, 1.0], initially", "range"),
    "start beyond the range": ("geometry.L2", "start = 0.105", "start = 2e6", "start 2e.06 is not from 1e-06 to 1e.06"),
    "start in the gap": ("geometry.L1", "start = 0.05", "start = 1e-9", "start 1e-09 is not 0 or from 1e-06 to 1e.06"),
    "range without a gap's lower side": ("geometry.L1", "range = [0.0", "range = [1e-3", "smallest"),
    "start that is no real": ("machine.v", "start = 0.0", "start = 0", "start = 0 must be a number with a decimal"),
    "Boolean with a unit": ("geometry.L9", "start = 0.2, range = [0.0, 1e6], smallest = 1e-6", "start = true", "unit"),
    "derivative of no state": ("der(machine.s)", 'of = "machine.s"', 'of = "tip.x"', "tip.x"),
    "unknown key": ("crank.a", "start = 0.0", "start = 0.0, minimum = 0.0", "minimum"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake(tmp_path, mistake):
    name, old, new, said = MISTAKES[mistake]
    right = line(name)
    assert right.count(old) == 1
    path = tmp_path / "interface.toml"
    path.write_text(TOML.replace(right, right.replace(old, new)), encoding="utf-8")
    with pytest.raises(InterfaceError, match=said) as raised:
        load_interface(path)
    expected = {"a name twice": "tip.x", "no name": "number 9"}.get(mistake, name)
    assert str(raised.value).startswith(f"interface.toml: {expected}: ")


def test_all_is_well_as_it_is():
    """One line for each variable, in the order of value references; a copy reads the same."""
    interface = load_interface()
    assert len(re.findall(r"^ *\{ name = ", TOML, flags=re.MULTILINE)) == len(interface.variables)
    for number, variable in enumerate(interface.variables, 1):
        assert variable.value_reference == number
        assert interface[variable.name] is variable
        assert line(variable.name)
