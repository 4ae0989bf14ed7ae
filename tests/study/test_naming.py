"""What the diagnoses of a study name, counted on trials whose names are known."""

import csv

import numpy as np
import pytest
from support.studies import SMALL
from support.trials import invented

from jaxident.diagnosis.decide import VERDICTS
from jaxident.effects.catalogue import CATALOGUE
from jaxident.files.summary import write_naming
from jaxident.report.sweep import write_study
from jaxident.robot.model import Effect
from jaxident.study.design import EffectSet
from jaxident.study.naming import in_force, naming
from jaxident.study.sight import Choice
from jaxident.study.statistics import summarise

LAG, LOSS, SLOPE = (list(CATALOGUE).index(name) for name in ("motor_lag", "turn_loss", "slope"))
STUDY = SMALL._replace(
    estimators=(*SMALL.estimators, Choice("told", "diagnose")),
    effects=(EffectSet("none"), EffectSet("lag", (Effect("motor_lag", {"time_constant": 0.1}),))),
    seeds=4,
)


@pytest.fixture(scope="module")
def trials():
    """Four trials a cell. At the low noise the lag is named in all, with a turn loss in one; at the high noise in two
    of the three logs that are not refused. Without an effect a slope is claimed once."""
    made = invented(STUDY)
    made["verdict"][:], made["named"][:] = -1, np.nan
    told, named = (made[name].isel(estimator=1).squeeze().transpose("effect", "noise", "seed", ...).values
                   for name in ("verdict", "named"))  # fmt: skip
    told[:], named[:] = VERDICTS.index("no_gap"), 0.0
    told[1, 0], named[1, 0, :, LAG], named[1, 0, 2, LOSS] = VERDICTS.index("effects"), 1.0, 1.0
    told[1, 1, :2], named[1, 1, :2, LAG] = VERDICTS.index("partly"), 1.0
    told[1, 1, 3], named[1, 1, 3] = -1, np.nan
    told[0, 1, 0], named[0, 1, 0, SLOPE] = VERDICTS.index("effects"), 1.0
    assert int(made["named"].sum()) == 8, "these are views of what is returned"
    alike = made["alike"].isel(estimator=1).squeeze().transpose("effect", "noise", "seed", ...).values
    named[0, 1, 0, LOSS] = 0.0
    alike[0, 1, 0, LAG] = 1.0  # a wrong name for nothing stays wrong
    named[1, 1, 2, LOSS], alike[1, 1, 2, LAG] = 1.0, 1.0
    return made.assign(takes_part=0.9 * made["named"])


def test_names_are_counted_by_what_is_in_force(trials):
    found = naming(trials)
    assert found["estimator"].values.tolist() == ["told"]
    found = found.squeeze()
    lag = found.sel(effect="lag")
    assert lag["diagnosed"].values.tolist() == [4, 3]
    assert lag["all_named"].values == pytest.approx([1.0, 2.0 / 3.0])
    assert lag["right"].values == pytest.approx([0.75, 2.0 / 3.0])
    assert lag["right_or_alike"].values == pytest.approx([0.75, 1.0]), "an extra name is wrong whatever it looks like"
    assert lag["false_names"].values == pytest.approx([0.25, 1.0 / 3.0])
    assert lag["claimed"].values == pytest.approx([1.0, 2.0 / 3.0])
    assert lag["share_named"].sel(catalogue="turn_loss").values == pytest.approx([0.25, 1.0 / 3.0])
    assert lag["takes_part"].sel(catalogue="motor_lag").values == pytest.approx([0.9, 0.6])
    none = found.sel(effect="none")
    assert none["right"].values == pytest.approx([1.0, 0.75])
    assert none["right_or_alike"].values == pytest.approx([1.0, 0.75])
    assert none["claimed"].values == pytest.approx([0.0, 0.25])


def test_standard_errors_are_those_of_a_mean(trials):
    found = naming(trials).squeeze().sel(effect="lag")
    assert found["right_se"].values[0] == pytest.approx(np.std([1, 1, 0, 1], ddof=1) / 2.0)
    assert found["right_se"].values[1] == pytest.approx(np.std([1, 1, 0], ddof=1) / np.sqrt(3.0))


def test_what_acts_is_read_from_the_study(trials):
    there = in_force(trials)
    assert there.sel(effect="lag").sum() == 1
    assert bool(there.sel(effect="lag", catalogue="motor_lag").squeeze())
    assert not there.sel(effect="none").any()


def test_a_study_without_diagnoses_names_nothing():
    assert naming(invented(SMALL)) is None


def test_the_tables_hold_what_was_counted(trials, tmp_path):
    write_naming(naming(trials), tmp_path / "cells.csv", tmp_path / "effects.csv")
    with open(tmp_path / "cells.csv") as cells, open(tmp_path / "effects.csv") as effects:
        whole, each = (list(csv.DictReader(stream)) for stream in (cells, effects))
    assert [(row["effect"], row["noise"], float(row["right"])) for row in whole if row["effect"] == "lag"] == [
        ("lag", "1e-06", 0.75), ("lag", "0.0001", pytest.approx(2.0 / 3.0)),
    ]  # fmt: skip
    named = {(row["effect"], row["noise"], row["named_effect"]): float(row["share_named"]) for row in each}
    assert named["none", "0.0001", "slope"] == 0.25
    assert ("none", "1e-06", "slope") not in named, "what neither acts nor is named has no row"
    assert named["lag", "0.0001", "motor_lag"] == pytest.approx(2.0 / 3.0)


def test_the_page_tells_of_names(trials, tmp_path):
    write_study(STUDY, trials, summarise(trials), tmp_path / "index.html", naming(trials))
    text = (tmp_path / "index.html").read_text()
    assert "told is right in 12 of 15 trials (13 with look-alikes); 3 names are wrong" in text
    assert "What the diagnoses name" in text


def test_a_study_whose_logs_were_all_refused_has_a_page(trials, tmp_path):
    none = trials.copy(deep=True)
    none["verdict"][:], none["named"][:] = -1, np.nan
    found = naming(none)
    assert int(found["diagnosed"].sum()) == 0
    write_naming(found, tmp_path / "cells.csv", tmp_path / "effects.csv")
    write_study(STUDY, none, summarise(none), tmp_path / "index.html", found)
    text = (tmp_path / "index.html").read_text()
    assert "told is right in 0 of 0 trials" in text
    assert ">nan" not in text
