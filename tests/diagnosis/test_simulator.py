"""A simulator in other units than the robot is refused with a word on which."""

import numpy as np
import pytest

from jaxident.diagnosis.simulator import check_units
from jaxident.errors import InputError
from jaxident.log import make_log


def drive(length=1.0, angle=1.0, command=1.0, rows=200):
    t = 0.05 * np.arange(rows)
    u = np.repeat([[0.5, 0.3], [-0.4, 0.6], [0.8, 0.8], [0.2, -0.9]], rows // 4, axis=0)
    v, w = 0.3 * u.sum(axis=1), 4.0 * (u[:, 0] - u[:, 1])
    theta = np.cumsum(0.05 * w)
    x, y = np.cumsum(0.05 * v * np.cos(theta)), np.cumsum(0.05 * v * np.sin(theta))
    return make_log(t, command * u[:, 0], command * u[:, 1], length * x, length * y, angle * theta)


def test_the_same_units_pass():
    check_units(drive(length=0.8, angle=1.2), drive())
    check_units([drive(), drive()], drive(length=2.0, angle=0.7))


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ({"length": 1000.0}, "moves 1e\\+03 times as fast .* are lengths"),
        ({"angle": 180.0 / np.pi}, "turns .* are angles"),
        ({"command": 100.0}, "moves 0.01 times"),
    ],
)
def test_other_units_are_told(units, words):
    with pytest.raises(InputError, match=words):
        check_units(drive(**units), drive())
