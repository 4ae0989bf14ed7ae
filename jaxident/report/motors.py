"""Motors by their wheel speeds: the table, some lines, and a page."""

from collections.abc import Sequence
from importlib.metadata import version
from os import PathLike

import numpy as np

from jaxident import plot
from jaxident.estimation.identify_motors import ORDER, Motors
from jaxident.estimation.uncertainty.verdict import verdicts_of
from jaxident.log import Log, join
from jaxident.report.origin import origin_section
from jaxident.report.page import PHONE, Figure, Page, Section, Table, write_page
from jaxident.report.parameters import told
from jaxident.report.words import SPACE, percent, plain_text

SHOWN = 15.0
"""Seconds that the picture shows."""


def rows_of(found: Motors, logs: Sequence[Log]) -> list[tuple[str, ...]]:
    """A row per parameter of the drive: name, estimate, interval, unit, verdict; logs: in which they were found."""
    model, largest = found.model, float(np.nanmax(np.abs(np.stack(join(logs).command))))
    values = np.array([*np.asarray(found.drive.rate), *np.ravel(found.drive.gain), *np.asarray(model.dead_zone)])
    covariance = np.asarray(model.covariance)[: len(ORDER), : len(ORDER)]
    rows = [told(row) for row in verdicts_of(ORDER, values, covariance, largest)]
    return [(one.name, one.estimate, one.interval, one.unit, one.verdict) for one in rows]


def lines_of(found: Motors) -> list[str]:
    """Delay, lag, noise and what is explained, a sentence each."""
    lag = 1.0 / np.asarray(found.drive.rate)
    late = (
        f"The wheels answer {1e3 * found.delay:.0f} ms (standard deviation {1e3 * found.delay_deviation:.2g} ms) after "
        "a command"
        if found.delay
        else "The wheels answer a command at once"
    )
    coloured = (
        f" Residuals hang together: {found.every:.0f} rows say as much as one, and the intervals are the wider for it."
        if found.every > 1.5
        else ""
    )
    return [
        f"{late}, then with a lag of {lag[0]:.2g} s together and {lag[1]:.2g} s against each other.",
        plain_text(
            f"The model explains {percent(found.explained[0])} of their mean speed and {percent(found.explained[1])} "
            f"of their difference; {found.sensor.noise:.2g} rad/s of each wheel are left.{coloured}"
        ),
    ]


def write_motors(found: Motors, logs: Sequence[Log], path: str | PathLike) -> None:
    """Write the page of one identification of motors."""
    log = join(logs)
    heads = ("parameter", "estimate", f"95{SPACE}% interval", "unit", "this input")
    table = Table(heads, rows_of(found, logs), CAPTION)
    sections = [
        Section("What the wheels did", [_picture(found, log)]),
        Section("Parameters", [table]),
        *origin_section(found.model.provenance.origin),
    ]
    lead = " ".join(lines_of(found))
    write_page(Page("The motors", lead, sections, f"jaxident {version('jaxident')}", NEXT), path)


CAPTION = "The robot that these motors would make, if no wheel ever slipped: speed v, turn rate w."
NEXT = "Drive on the ground and run `jaxident diagnose LOGS --model MODEL`: what it finds is not the motors."
PICTURE = "Measured and modelled wheel speeds as speed and turn rate of the robot, where the model misses most."


def _picture(found: Motors, log: Log) -> Figure:
    """The stretch of SHOWN seconds on which the model misses most."""
    sensor = found.sensor
    units = np.array([[sensor.radius], [2.0 * sensor.radius / sensor.track]])
    missed = np.nan_to_num(np.sum((found.measured - found.modelled) ** 2, axis=0))
    begins, worst, here = 0, -1.0, slice(0, 2)
    for run in log.runs():
        t, own = np.asarray(run.t), np.cumsum(np.append(0.0, missed[begins : begins + len(run.t)]))
        ends = np.searchsorted(t, t + SHOWN)
        lost = own[ends] - own[:-1]
        first = int(np.argmax(lost))
        if lost[first] > worst:
            worst, here = float(lost[first]), slice(begins + first, begins + int(ends[first]))
        begins += len(t)
    t, known = np.asarray(log.t)[here], np.isfinite(found.measured[0, here])
    figure, axes = plot.figure(3, 1, size=(PHONE, 4.6), share_x=True)
    plot.wheel_speeds(
        None, (t[known], units * found.measured[:, here][:, known]), (t, np.stack(log.command)[:, here]),
        modelled={"model": (t[known], units * found.modelled[:, here][:, known])}, axes=axes,
    )  # fmt: skip
    return Figure(plot.image(figure), "Commands and wheel speeds, measured and modelled", PICTURE)
