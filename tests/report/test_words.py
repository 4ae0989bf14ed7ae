"""Every number of a model has words and a unit; the glossary has every word that pages ask for."""

import pytest

from jaxident.estimation.uncertainty.verdict import NOISE_NAMES
from jaxident.origin import Input, Origin
from jaxident.report.glossary import glossary
from jaxident.report.origin import LETTERS, origin_section
from jaxident.report.terms import TERMS
from jaxident.report.words import NOMINAL, about, measured
from jaxident.robot.model import DIFFERENCE_ORDER


@pytest.mark.parametrize("name", [*NOMINAL, *NOISE_NAMES, *DIFFERENCE_ORDER])
def test_every_parameter_has_words_and_a_unit(name):
    meaning, unit = about(name)
    assert meaning
    assert bool(unit) != name.startswith("alpha")


def test_an_unknown_parameter_has_none():
    assert about("motor lag time_constant") == ("", "")


def test_the_glossary_is_in_order():
    assert list(TERMS) == sorted(TERMS, key=str.lower)
    assert glossary("gap").blocks[0].rows == [("gap", TERMS["gap"])]


def test_a_zero_has_no_sign():
    assert measured(-0.001, 0.32).startswith("0.00")


def test_long_commands_are_broken_as_a_shell_takes_them():
    words = ("diagnose", *(f"real_{k}.csv" for k in range(20)))
    made = Origin(words, "report.html", (Input("LOG", "real_1.csv", "ab" * 32),), (), None)
    command, table = origin_section(made)[0].blocks
    assert max(map(len, command.text.splitlines())) <= LETTERS + 2
    assert command.text.replace("\\\n", "").split() == ["jaxident", *words]
    assert table.rows[0][2] == "ab" * 8
