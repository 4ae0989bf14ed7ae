"""What every question has: a robot, a camera, and an answer of one sentence with its picture."""

import dataclasses
from typing import NamedTuple

import jaxident as ji
from jaxident.report.page import Figure

PERIOD, ROWS, HOLD = 1 / 30, 300, 10
"""Seconds from row to row, rows of a run, rows that a command lasts."""
CAMERA = ji.Noise(position=5e-4, heading=5e-3)


class Answer(NamedTuple):
    """One sentence, and the picture that it comes from."""

    sentence: str
    picture: Figure


def plain_robot() -> ji.Model:
    """The published robot without coupling of its two speeds."""
    published = ji.load_model("published")
    return dataclasses.replace(published, dynamics=published.physical._replace(coupling=None))


def picture(figure, alt: str) -> Figure:
    """A drawing as a picture of the page; alt says what it shows to those who cannot see it."""
    return Figure(ji.plot.image(figure), alt)
