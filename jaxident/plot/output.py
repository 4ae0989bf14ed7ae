"""From a figure to a file."""

import io
import pathlib

import matplotlib
from matplotlib import pyplot
from matplotlib.figure import Figure

from jaxident.errors import InputError
from jaxident.files.atomic import Target, write_bytes
from jaxident.plot.style import STYLE

RESOLUTION = 150
"""Pixels per inch of a picture, and of what is heavy in a vector file."""

_UNDATED = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
"""Kinds of file, and what keeps the time of writing out of them: equal pictures give equal files."""


def save(figure: Figure, path: Target) -> None:
    """Write a figure as PNG (150 dots per inch), PDF or SVG by the file's ending, and close it.

    The file appears whole or not at all. InputError for another ending or a target that cannot be written.
    """
    kind = pathlib.Path(path).suffix.lower().removeprefix(".")
    if kind not in _UNDATED:
        raise InputError(f"{path}: the name of a picture ends in .png, .pdf or .svg")
    write_bytes(path, image(figure, kind))


def image(figure: Figure, kind: str = "png") -> bytes:
    """A figure as the content of a file of kind "png", "pdf" or "svg", for a report; closes the figure."""
    with matplotlib.rc_context(STYLE):
        stream = io.BytesIO()
        figure.savefig(stream, format=kind, dpi=RESOLUTION, metadata=_UNDATED[kind])
    pyplot.close(figure)
    return stream.getvalue()
