"""The robots with hidden effects: without one they are the package's robot, with one they are not."""

import dataclasses

import numpy as np
import pytest

import jaxident as ji
from experiments.unlisted.measure import achieved, as_logs, table, true_model
from experiments.unlisted.page import law_of, write
from experiments.unlisted.robots import KINDS, RUNS, draw_robot, drive
from jaxident.diagnosis.account.discovered import Shown
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.discovery.fit import as_law
from jaxident.diagnosis.discovery.forms import form_of
from jaxident.diagnosis.discovery.search import discover
from jaxident.diagnosis.laws.kinds import Kind
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.files.diagnosis import law_to_dict
from jaxident.robot.model import Discovered

KNOTS = np.linspace(-1.0, 1.0, 4)
SURFACE = Discovered("acceleration along", "v", "x", KNOTS, np.arange(16.0).reshape(4, 4), np.ones((4, 4)), "y", KNOTS)
OF_A_WHEEL = Discovered("push of the left wheel", "1", "own angle", KNOTS, KNOTS**2, np.ones(4), period=0.1,
                        half_track=-0.2)  # fmt: skip
CURVE = Discovered("acceleration along", "1", "v", KNOTS, KNOTS**2, np.ones(4))


def errors(kind: str, size: float = 1.0) -> float:
    """Root mean square distance [m] of runs with camera noise from the package's robot without noise."""
    robot = draw_robot(np.random.default_rng(3))
    model = dataclasses.replace(true_model(robot), noise=None)
    apart = []
    for whole in as_logs(drive(robot, kind, size, 2, 5, first=200.0)):
        log = whole.rows(0, 121)
        start = ji.State(log.x[0], log.y[0], log.theta[0], 0.0, 0.0)
        made = ji.simulate(model, log, start=start)
        apart.append(np.hypot(np.asarray(made.x) - log.x, np.asarray(made.y) - log.y))
    return float(np.sqrt(np.mean(np.square(apart))))


def test_a_robot_without_an_effect_is_the_packages():
    assert errors("nothing") < 0.012  # the heading's noise at the start, over 6 s, and slip


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("nothing", "bumps", "cogs", "oval")])
def test_an_effect_moves_the_robot(kind):
    assert errors(kind, 3.0) > 1.5 * errors("nothing")


def test_a_law_reads_back_from_what_a_diagnosis_tells():
    for law in (SURFACE, CURVE, OF_A_WHEEL):
        kind = Kind(law.acts_on, law.times, law.signal, law.second_signal)
        back = law_of(law_to_dict(Shown(kind, law, tuple([1] * law.value.size), 0.1, 0.01, None)))
        assert (back.signal, back.second_signal, back.times) == (law.signal, law.second_signal, law.times)
        np.testing.assert_array_equal(back.value, law.value)
        np.testing.assert_array_equal(back.at, law.at)
        assert (back.period, back.half_track) == (law.period, law.half_track)


def test_table_and_page_tell_of_every_robot(tmp_path):
    law = law_to_dict(Shown(Kind("acceleration along", "v", "x", "y"), SURFACE, tuple(range(16)), 0.1, 0.01, None))
    row = {"kind": "patch", "seed": 1, "size": 1.0, "seconds": 9.0, "verdict": "partly", "named": [], "laws": [law],
           "nominal": 103.0, "corrected": 28.0, "known": 3.0}  # fmt: skip
    assert achieved(row) == pytest.approx(0.75)
    assert "| patch | 1 |" in table([row])
    write([row, row | {"kind": "nothing", "laws": [], "nominal": 3.1}], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "75 %" in page
    assert "nothing to take" in page


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "kind"),
    [
        ("patch", Kind("acceleration along", "v", "x", "y")),
        ("saddle", Kind("acceleration along", "cos heading", "x", "y")),
        ("hot", Kind("push of each wheel", "own push", "own heat 3 s")),
        ("castor", Kind("acceleration along", "v", "since reversal 0.3 s")),
        ("rub", Kind("acceleration along", "v", "time")),
        ("coupled", Kind("acceleration in heading", "w", "v")),
        ("late", Kind("push of each wheel", "own change 0.03 s", "v")),
        ("brakes", Kind("push of each wheel", "1", "own speed", "own push")),
    ],
)
def test_the_law_that_is_found_first_acts_where_the_hidden_effect_does(hidden, kind):
    robot = draw_robot(np.random.default_rng([1, 1]))
    logs = as_logs(drive(robot, hidden, 1.0, RUNS, 1002))
    found = discover(find_effects(prepare(logs, None))[1])
    assert found
    # weak brakes are named as a drag and a traction limit; the first law mends that drag, the second is the true one
    assert found[1 if hidden == "brakes" else 0].curves[-1].kind == kind
    if hidden == "patch":
        law = as_law(found[0].curves[0])
        form = form_of(law, found[0].curves[0].density)
        assert form is not None
        assert np.hypot(form.parameters["x0"] - 0.2, form.parameters["y0"] + 0.1) < 0.1
        assert abs(form.parameters["radius"] - 0.35) < 0.1
