"""Results as users hold them: a few lines when printed, a picture in a notebook, a table, a file, a page.

They are the named tuples of the floors below, with what these floors may not do: draw and write.
"""

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxident import plot
from jaxident.diagnosis import diagnose as diagnosing
from jaxident.errors import InputError
from jaxident.estimation import identify as identifying
from jaxident.estimation import identify_motors
from jaxident.estimation import predict as predicting
from jaxident.estimation.uncertainty.verdict import Verdict, verdicts
from jaxident.files.atomic import make_folder, write_text
from jaxident.files.diagnosis import diagnosis_to_dict
from jaxident.files.json_text import format_json
from jaxident.files.models import save_model
from jaxident.files.predictions import write_prediction
from jaxident.log import Log, join
from jaxident.report.account import account_lines, account_section, draw_account
from jaxident.report.diagnosis import diagnosis_page
from jaxident.report.identification import COLUMNS, draw_fit, with_words, write_identification
from jaxident.report.lead import details, headline, lead
from jaxident.report.motors import lines_of, rows_of, write_motors
from jaxident.report.page import Figure, Table, fragment, write_page
from jaxident.report.parameters import told
from jaxident.report.words import error as size_of
from jaxident.report.words import plain_text


class Identification(identifying.Identification):
    """An identification with the logs that it was made from; fields as in `jaxident.estimation.identify`."""

    logs: list[Log]

    def _replace(self, **changes: Any) -> "Identification":
        """The same with some fields changed, and its logs."""
        return identified(super()._replace(**changes), self.logs)

    @property
    def verdicts(self) -> list[Verdict]:
        """Every parameter with its 95 % interval, and whether the input determines it."""
        return verdicts(self.model, max(float(np.max(np.abs(u))) for log in self.logs for u in log.command))

    def __repr__(self) -> str:
        rows = [(one.name, one.estimate, one.interval, one.unit, one.verdict) for one in map(told, self.verdicts)]
        return "\n".join([_counted(self), *_aligned(rows), *self.suspicions])

    def _repr_html_(self) -> str:
        figure, ax = plot.figure(size=(6.3, 4.6))
        self.plot(ax)
        picture = Figure(plot.image(figure), "measured and modelled path")
        table = Table(COLUMNS, [with_words(row) for row in self.verdicts])
        return fragment([_counted(self), picture, table, *self.suspicions])

    def to_dataframe(self) -> Any:
        """The parameters as a pandas data frame: estimate, low and high end of the 95 % interval, verdict, reason."""
        return _frame(Verdict._fields, self.verdicts)

    def plot(self, ax: Any = None) -> Any:
        """The measured path and the model's, run by run; returns the axes."""
        return draw_fit(self, join(self.logs), ax)

    def save(self, path: str | os.PathLike) -> None:
        """Write the model to a file, whole or not at all."""
        save_model(self.model, path)

    def report(self, path: str | os.PathLike) -> None:
        """Write the page of `jaxident identify --report`. InputError for the paper's method, which has none."""
        write_identification(self, self.logs, self.verdicts, path)


def identified(found: identifying.Identification, logs: Sequence[Log]) -> Identification:
    """What `identify` found in some logs, as a result."""
    result = Identification(*found)
    result.logs = list(logs)
    return result


def _counted(found: Identification) -> str:
    """One line: how many poses, and how much they determine."""
    poses = sum(int(np.isfinite(log.x).sum()) for log in found.logs)
    words = [row.verdict for row in found.verdicts]
    told = ", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words))
    ending = "" if bool(found.ok) else "; the fit did not converge: do not trust these numbers"
    return f"identified from {poses} poses in {sum(len(log.runs()) for log in found.logs)} runs: {told}{ending}"


class Motors(identify_motors.Motors):
    """Motors with the logs that they were found in; fields as in `jaxident.estimation.identify_motors`."""

    logs: list[Log]

    def __repr__(self) -> str:
        return "\n".join([*lines_of(self), *_aligned(rows_of(self, self.logs)), *identify_motors.against(self)])

    def save(self, path: str | os.PathLike) -> None:
        """Write the model to a file, whole or not at all."""
        save_model(self.model, path)

    def report(self, path: str | os.PathLike) -> None:
        """Write the page of `jaxident motors --report`."""
        write_motors(self, self.logs, path)


def motors(found: identify_motors.Motors, logs: Sequence[Log]) -> Motors:
    """What `identify_motors` found in some logs, as a result."""
    result = Motors(*found)
    result.logs = list(logs)
    return result


class Diagnosis(diagnosing.Diagnosis):
    """A diagnosis; fields as in `jaxident.diagnosis.diagnose`."""

    def __repr__(self) -> str:
        return "\n".join([lead(self), *account_lines(self.account)])

    def _repr_html_(self) -> str:
        return fragment([headline(self), *account_section(self.account, details(self)).blocks])

    def to_dataframe(self) -> Any:
        """The account as a pandas data frame: part, root mean squares in position [m] and heading [rad], share of the
        mean squared error, and its 90 % interval."""
        rows = [(row.part, row.rms_position, row.rms_heading, row.share, *row.interval) for row in self.account.rows]
        return _frame(("part", "rms_position", "rms_heading", "share", "low", "high"), rows)

    def plot(self, ax: Any = None) -> Any:
        """Who causes how much of the error: the account as a waterfall; returns the axes. InputError where no stretch
        of the logs was left to judge by."""
        if not self.account.rows:
            raise InputError("plot: this diagnosis has no account, no stretch of the logs was left to judge by")
        return draw_account(self.account, ax)

    def save(self, folder: str | os.PathLike) -> None:
        """Write diagnosis.json, both models and report.html to a folder, as `jaxident diagnose --out` does, but for
        their origin: only a command knows from which files it was called."""
        make_folder(folder)
        save_model(self.nominal_model, os.path.join(folder, "nominal_model.json"))
        save_model(self.corrected_model, os.path.join(folder, "corrected_model.json"))
        self.report(os.path.join(folder, "report.html"))
        write_text(os.path.join(folder, "diagnosis.json"), format_json(diagnosis_to_dict(self)))

    def report(self, path: str | os.PathLike, name: str = "the logs") -> None:
        """Write the page of `jaxident diagnose`; `name` stands in its title."""
        write_page(diagnosis_page(self, name), path)


def diagnosed(found: diagnosing.Diagnosis, *_: Any) -> Diagnosis:
    """What `diagnose` found, as a result."""
    return Diagnosis(*found)


class Prediction(predicting.Prediction):
    """Free runs with the log that they are held against; fields as in `jaxident.estimation.predict`."""

    log: Log

    def _replace(self, **changes: Any) -> "Prediction":
        """The same with some fields changed, and its log."""
        return predicted(super()._replace(**changes), self.log)

    @property
    def error(self) -> dict[str, Any]:
        """How far the runs end from the measured poses, as `prediction_error` says."""
        return predicting.prediction_error(self, self.log)

    def __repr__(self) -> str:
        error = self.error
        lines = [f"{error['starts']} free runs of {error['seconds']:.4g} s, {error['compared']} end at a measured pose"]
        if error["compared"]:
            told = (
                f"{plain_text(size_of((error[f'position_{kind}'], error[f'heading_{kind}'])))} {word}"
                for kind, word in (("rms", "root mean square"), ("median", "median"), ("expected", "expected"))
            )
            lines.append(f"error there: {', '.join(told)}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        figure, ax = plot.figure(size=(6.3, 4.6))
        self.plot(ax)
        return fragment([*repr(self).splitlines(), Figure(plot.image(figure), "measured and predicted path")])

    def to_dataframe(self) -> Any:
        """The columns of `jaxident predict --out` as a pandas data frame."""
        names = [name for name in self._fields if name != "run_up"]
        return _frame(names, zip(*(np.asarray(getattr(self, name)).tolist() for name in names), strict=True))

    def plot(self, ax: Any = None) -> Any:
        """The measured path and the predicted ones; returns the axes."""
        return plot.path(self.log, self, ax=ax)

    def save(self, path: str | os.PathLike) -> None:
        """Write the predictions to a CSV file, whole or not at all."""
        write_prediction(self, path)


def predicted(found: predicting.Prediction, log: Log) -> Prediction:
    """What `predict` found along a log, as a result."""
    result = Prediction(*found)
    result.log = log
    return result


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of text with their columns one below the other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def _frame(columns: Sequence[str], rows: Any) -> Any:
    """A pandas data frame; pandas is loaded only here."""
    import pandas

    return pandas.DataFrame(list(rows), columns=list(columns))
