"""Parameters are told in short units, with as many digits as their intervals allow."""

import math

import pytest

from jaxident.estimation.uncertainty.verdict import Verdict
from jaxident.report.parameters import interval, told


@pytest.mark.parametrize(
    ("name", "ends", "texts"),
    [
        ("rate_1", (0.673251, 0.656928, 0.689574), ("0.673", "[0.657, 0.690]", "1/s")),
        ("gain_22", (-76.079, -76.1024, -76.0556), ("-76.079", "[-76.102, -76.056]", "rad/s²/unit")),
        ("position", (0.000504, 0.0004974, 0.0005106), ("0.5040", "[0.4974, 0.5106]", "mm")),
        ("heading", (0.00493496, 0.00484632, 0.00502361), ("4.935", "[4.846, 5.024]", "mrad")),
        ("slip_heading", (-2.6e-7, -0.694, 0.694), ("0.00", "[-0.69, 0.69]", "rad/s^1.5")),
        ("delta_11", (7.1181e-5, 7.09e-5, 7.15e-5), ("7.118e-05", "[7.09e-05, 7.15e-05]", "m/unit")),
        ("gain_21", (12345.6, 11111.0, 13580.0), ("12300", "[11100, 13600]", "rad/s²/unit")),
        ("rate_1", (2.0, 2.0, 2.0), ("2", "[2, 2]", "1/s")),
        ("rate_1", (2.0, math.nan, math.nan), ("2", "[nan, nan]", "1/s")),
    ],
)
def test_digits_follow_the_interval(name, ends, texts):
    row = told(Verdict(name, *ends, "determined"))
    assert (row.estimate, row.interval, row.unit) == texts


def test_a_loose_number_says_why():
    assert told(Verdict("rate_1", 1.0, 0.0, 2.0, "weak", "it moves too little")).verdict == "weak: it moves too little"


def test_another_interval_is_told_in_the_same_unit():
    assert interval("position", 0.000497, 0.000511) == "[0.4970, 0.5110]"
