"""What all pictures have in common, and the files that they become."""

import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.text import Text

from jaxident import plot
from jaxident.errors import InputError

T = np.arange(30.0)
LONG_NAMES = {f"an estimator with quite a long name {number}": np.ones((2, 3)) + number for number in range(5)}
PICTURES = {
    "dead_zone": lambda log: plot.dead_zone([0.25, 0.2], label=["right wheel of the robot", "left wheel of the robot"]),
    "commands": lambda log: plot.commands(log, dead_zone=(0.25, 0.2)),
    "path": plot.path,
    "prediction_error": lambda log: plot.prediction_error(T, np.ones((4, 30)), np.ones((4, 30))),
    "convergence": lambda log: plot.convergence(T, np.ones((30, 2)), np.ones((30, 2)), names=["alpha_1", "delta_11"]),
    "error_against_noise": lambda log: plot.error_against_noise([1e-4, 1e-3], LONG_NAMES, truth=0.0, label="alpha_1"),
}


@pytest.mark.parametrize("name", PICTURES)
def test_legends_hide_nothing_and_text_can_be_read(name, log):
    axes = np.ravel(PICTURES[name](log))
    figure = axes[0].figure
    figure.canvas.draw()
    legends = [*figure.legends, *(ax.get_legend() for ax in axes if ax.get_legend())]
    assert len(legends) == 1
    box = legends[0].get_window_extent()
    assert box.y0 >= max(ax.bbox.y1 for ax in axes)
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= figure.bbox.y1
    assert min(text.get_fontsize() for text in figure.findobj(Text) if text.get_text()) >= 9.0


def test_matplotlib_is_loaded_when_something_is_drawn():
    code = "import sys, jaxident.plot; assert 'matplotlib' not in sys.modules; jaxident.plot.figure()"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_save_writes_the_kind_of_the_name_twice_alike_and_closes(tmp_path, kind, start):
    for name in ("one", "two"):
        ax = plot.dead_zone(0.2)
        plot.save(ax.figure, tmp_path / f"{name}.{kind}")
        assert not pyplot.fignum_exists(ax.figure.number)
    content = (tmp_path / f"one.{kind}").read_bytes()
    assert content.startswith(start)
    assert content == (tmp_path / f"two.{kind}").read_bytes()


def test_save_refuses_another_ending_and_a_folder_that_is_not_there(tmp_path):
    figure, _ = plot.figure()
    with pytest.raises(InputError, match=r"picture\.jpg.*\.png"):
        plot.save(figure, tmp_path / "picture.jpg")
    with pytest.raises(InputError, match="does not exist"):
        plot.save(figure, tmp_path / "missing" / "picture.png")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_picture_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'pie'"):
        plot.pie  # noqa: B018
    assert "path" in dir(plot)


def test_a_backend_that_loads_with_the_first_picture_keeps_what_it_sets(monkeypatch):
    made = pyplot.figure

    def load_and_make(*args, **settings):
        matplotlib.interactive(True)  # as the backend of a notebook does, which shows each cell's pictures by it
        return made(*args, **settings)

    monkeypatch.setattr(pyplot, "figure", load_and_make)
    try:
        plot.dead_zone([0.2])
        assert matplotlib.is_interactive()
    finally:
        matplotlib.interactive(False)
        pyplot.close("all")
