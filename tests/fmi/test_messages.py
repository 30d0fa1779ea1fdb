"""Messages: for the user of a host, in declared categories, the same in every country.

That each message of each test has a declared category, a status that fits it, and a text, is checked where instances
are freed (tests/conftest.py).
"""

from __future__ import annotations

import locale
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_char_p, c_int32

import pytest
from fmpy import fmi2
from lxml import etree

from tests.conftest import HARD_CASES
from tests.harness.host import DISCARD, ERROR, OK, Instance
from tests.harness.life import OPEN, OPEN_ANGLE


def provoke(instance: Instance) -> list[int]:
    """An error, an event, a Discard and an error again."""
    statuses = [instance.call("fmi2ExitInitializationMode")]
    instance.initialize(OPEN)
    instance.step(0.0, 0.25, {"crank.phi": 0.1}).step(0.25, 0.25, {"crank.phi": 3.5})
    instance.set({"crank.phi": OPEN_ANGLE})
    return statuses + [instance.try_step(0.5, 0.25) for _ in range(2)]


EXPECTED = [(ERROR, "logStatusError"), (OK, "logEvents"), (DISCARD, "logStatusDiscard"), (ERROR, "logStatusError")]


def test_each_status_in_its_category(new):
    """FMI 2.0.4, section 2.2.4: the standard categories."""
    instance = new("seed row 3", logging=True)
    assert provoke(instance) == [ERROR, DISCARD, ERROR]
    assert [(message.status, message.category) for message in instance.messages[:1]] == EXPECTED[:1]
    assert set(EXPECTED) == {(message.status, message.category) for message in instance.messages}
    assert {message.instance for message in instance.messages} == {"seed row 3"}


def categories(instance: Instance, on: bool, *names: str) -> int:
    return instance.call("fmi2SetDebugLogging", on, len(names), (c_char_p * len(names))(*[n.encode() for n in names]))


EVERY = {"logEvents", "logStatusDiscard", "logStatusError"}


@pytest.mark.parametrize(
    ("on", "names", "told"),
    [
        (True, [], EVERY),
        (True, ["logAll"], EVERY),
        (True, ["logEvents"], {"logEvents"}),
        (True, ["logStatusDiscard"], {"logStatusDiscard"}),
        (True, ["logStatusError", "logEvents"], {"logStatusError", "logEvents"}),
        (True, ["logStatusError", "logStatusDiscard", "logStatusWarning"], {"logStatusError", "logStatusDiscard"}),
        (True, ["logStatusWarning"], set()),
        (False, [], {"logStatusError"}),
        (False, ["logAll"], {"logStatusError"}),
        (False, ["logStatusDiscard"], {"logStatusError"}),
    ],
)
@pytest.mark.parametrize("at_first", [True, False])
def test_categories_choose(new, at_first, on, names, told):
    """FMI 2.0.4, section 2.1.5: the categories named and no others. Where logging is off, an error is still told: its
    status alone would help nobody (section 2.1.3).
    """
    instance = new(logging=at_first)
    assert categories(instance, on, *names) == OK
    assert provoke(instance) == [ERROR, DISCARD, ERROR]
    assert {message.category for message in instance.messages} == told
    buffer = c_int32()
    assert instance.call("fmi2GetIntegerStatus", 0, byref(buffer)) == DISCARD
    assert {message.category for message in instance.messages} == told


def test_the_last_choice_of_categories_holds(new):
    instance = new()
    for names, told in (["logEvents"], {"logEvents"}), (["logStatusError"], {"logStatusError"}), ([], EVERY):
        assert categories(instance, True, *names) == OK
        instance.messages.clear()
        provoke(instance)
        assert {message.category for message in instance.messages} == told
        assert instance.call("fmi2Reset") == OK


def test_every_category_can_be_chosen(new, fmu):
    root = etree.parse(str(fmu.folder / "modelDescription.xml")).getroot()
    declared = [category.get("name") for category in root.iter("Category")]
    assert len(declared) == 5
    for name in declared:
        assert categories(new(), True, name) == OK


def test_no_logger(new):
    """A host need not listen."""
    instance = new(with_logger=False, logging=True)
    assert provoke(instance) == [ERROR, DISCARD, ERROR]
    assert new(with_logger=False, guid="{wrong}").component is None


def test_names_are_no_formats(new):
    """A name is the user's: printf must not read it as a format."""
    instance = new("100%s %n %d", logging=True)
    provoke(instance)
    assert {message.instance for message in instance.messages} == {"100%s %n %d"}


def test_message_is_complete_without_arguments(fmu):
    """A host in another language than C sees the format alone; ctypes gives it as it is."""
    slave, heard = fmu.load(), []
    logger = fmi2.fmi2CallbackLoggerTYPE(lambda *arguments: heard.append(arguments[4].decode()))
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = logger
    slave.fmi2Instantiate(b"", fmi2.fmi2CoSimulation, b"", None, byref(callbacks), 0, 0)
    assert heard == ["fmi2Instantiate: the instance name is missing or empty"]


def test_numbers_can_be_read_back(new):
    """As many digits as it takes to tell a number from its neighbours, not more."""
    instance = new().setup().enter()
    for value in (-0.1, 1e7 / 3, 1e-7, 2.0**60):
        assert instance.try_set({"geometry.L2": value}) == ERROR
        text = instance.last_message.text.split(" = ")[1].split(":")[0]
        assert float(text) == value and len(text) <= len(repr(value)), text


# ---- the decimal point ---------------------------------------------------------------------------


@contextmanager
def numbers_as_in(name: str) -> Iterator[None]:
    before = locale.setlocale(locale.LC_NUMERIC)
    try:
        locale.setlocale(locale.LC_NUMERIC, name)
        yield
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)


def refused_start(instance: Instance) -> str:
    assert instance.call("fmi2SetupExperiment", False, 0.0, 12.625, True, 0.1) == ERROR
    return instance.last_message.text


SAID = "fmi2SetupExperiment: start time 12.625 s, stop time 0.1 s: must be finite and in this order"


def test_the_decimal_point_in_every_locale_of_this_machine(new):
    """Whatever the host has set: C.UTF-8 at least, those with a comma where they are installed."""
    names = ["C", "C.UTF-8", "", "de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "es_ES.UTF-8", "fa_IR.UTF-8", "German"]
    tried = 0
    for name in names:
        try:
            with numbers_as_in(name):
                assert refused_start(new()) == SAID, name
            tried += 1
        except locale.Error:
            pass  # not installed
    assert tried


@pytest.mark.skipif(sys.platform == "win32", reason="a program's snprintf does not replace that of a DLL")
@pytest.mark.parametrize("sign", [".", ",", "\N{ARABIC DECIMAL SEPARATOR}"])
def test_the_decimal_point_under_any_decimal_sign(fmu, compile_host, sign):
    """A host whose C library writes and reads another sign, even one of two bytes, still gets a point."""
    command = [compile_host("decimal_sign", HARD_CASES), fmu.library, fmu.description.guid, sign]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
    assert (done.returncode, done.stdout.strip()) == (0, SAID)
