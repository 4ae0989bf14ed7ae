"""Tables from marks, intervals, the seal, and the shrink on fresh runs."""

import json
import sys

import numpy as np
import pytest
from support.withheld_cases import model_of
from withheld.protocol import cases, seal
from withheld.protocol.diagnose import diagnose
from withheld.scoring.calibration import calibration_error
from withheld.scoring.fresh import fresh_runs, local_motion, true_shrink
from withheld.scoring.intervals import bootstrap, wilson
from withheld.scoring.judge import added, judge, shrinkable
from withheld.scoring.misses import misses
from withheld.scoring.table import table

import jaxident as ji


def test_wilson_by_hand():
    """Newcombe 1998, table I: 81 of 263."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20)[0] == 0.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_bootstrap_of_a_mean():
    values = np.random.default_rng(0).normal(size=400)
    low, high = bootstrap(values, np.mean)
    assert (high - low) / 2 == pytest.approx(1.96 / 20, rel=0.1)


def test_calibration_error():
    tops = np.array([[0.95, 1]] * 9 + [[0.95, 0]] + [[0.55, 0]] * 10, float)
    assert calibration_error(tops) == pytest.approx(0.5 * 0.05 + 0.5 * 0.55)


def marks(kind, count, **more):
    base = {
        "kind": kind, "verdict": "effects", "claimed": True, "unexplained": False, "right": True, "strict": True,
        "some": True, "extra": False, "site": True, "channel": None, "top": (0.8, True), "probability_of_truth": 0.8,
        "strength": [0.5], "selected": ["slope"], "hidden": 1, "named": 1, "extras": 0,
    }  # fmt: skip
    return [base | more for _ in range(count)]


def test_table():
    given = marks("none", 20, claimed=False) + marks("none", 1) + marks("single", 9, shrink=0.9, interval=[0.8, 1.0])
    given += marks("single", 1, right=False, shrink=0.5, interval=[0.6, 0.7]) + marks("outside", 4, unexplained=True)
    rows = {row["row"]: row for row in table(given)}
    assert rows["effect claimed when there is none"]["value"] == pytest.approx(1 / 21)
    assert rows["one effect: named"]["value"] == pytest.approx(0.9)
    assert rows["one effect: named"]["interval"] == pytest.approx(wilson(9, 10))
    assert rows["outside the catalogue: told as unexplained"]["value"] == 1.0
    assert rows["two effects: both named"]["value"] is None
    assert rows["shrink achieved over achievable, median"]["value"] == pytest.approx(0.9)
    assert rows["shrink inside its 90 % interval"]["value"] == pytest.approx(0.9)
    assert rows["first hypothesis: probability less share right"]["value"] == pytest.approx(-0.2)


def rows_of(given):
    return {row["row"]: row for row in table(given)}


def test_many_count_effects_and_mixed_count_cases():
    given = marks("many", 3, hidden=4, named=4) + marks("many", 1, hidden=5, named=1, extras=2, unexplained=True)
    given += marks("mixed", 3, unexplained=True) + marks("mixed", 1, some=False, extras=1)
    rows = rows_of(given)
    assert rows["four or five effects: share named"]["value"] == pytest.approx(13 / 17)
    assert rows["four or five effects: false extras a case"]["value"] == 0.5
    assert rows["one of the catalogue beside one outside: the first named"]["value"] == 0.75
    assert rows["one of the catalogue beside one outside: the rest told"]["value"] == 0.75
    assert rows["in the catalogue: something unexplained told"]["value"] == 0.25  # of the many; mixed has a rest


def test_the_worst_tenth_of_the_shrink():
    given = [mark for k in range(11) for mark in marks("many" if k % 2 else "pair", 1, shrink=np.float64(k / 10))]
    given += marks("mixed", 1, shrink=np.nan) + marks("mixed", 1, shrink=-50.0)
    rows = rows_of(given)
    assert rows["shrink achieved over achievable, worst tenth"]["value"] == pytest.approx(0.1)
    assert rows["shrink achieved over achievable, median"]["value"] == pytest.approx(0.5)
    mixed = "one of the catalogue beside one outside: shrink achieved over achievable, median"
    assert rows[mixed]["value"] == -1.0  # twice as far off, or not finite, is as bad as any


def test_chance_alone_leaves_nothing_to_shrink():
    assert not shrinkable({"effects": [{"name": "outliers"}, {"name": "lost_commands"}]})
    assert shrinkable({"effects": [{"name": "outliers"}, {"name": "slope"}]})


def test_marks_from_other_programs(tmp_path):
    """Shares and promises of cases that are scored; others are left aside."""
    shares = {"rows": [{"interval": [0.1, 0.3], "true": 0.2}, {"interval": [0.1, 0.3], "true": 0.4}]}
    (tmp_path / "shares.json").write_text(json.dumps({"case_1": shares, "case_9": shares}))
    (tmp_path / "promise.json").write_text(json.dumps({"case_1": {"fresh": 8.0, "promised": 2.0}}))
    more = added(["case_1", "case_2"], tmp_path / "shares.json", tmp_path / "promise.json")
    assert more == {"case_1": {"shares": [True, False], "promise": 4.0}, "case_2": {}}
    rows = rows_of(marks("single", 1, **more["case_1"]) + marks("single", 1))
    assert rows["true share of an effect inside its 90 % interval"]["value"] == 0.5
    assert rows["error on fresh runs over that promised: above 3"]["value"] == 1.0
    assert rows["error on fresh runs over that promised: above 3"]["cases"] == 1


def test_a_sealed_answer_opens_with_its_key_only(tmp_path):
    plain, key = tmp_path / "answers.json", tmp_path / "key"
    plain.write_text('{"case_001": "slope"}')
    digest = seal.seal(plain, tmp_path / "sealed", key)
    assert not plain.exists()
    assert b"slope" not in (tmp_path / "sealed" / "answers.sealed").read_bytes()
    assert (tmp_path / "sealed" / "SEAL").read_text().startswith(digest)
    assert json.loads(seal.unseal(tmp_path / "sealed", key)) == {"case_001": "slope"}
    key.write_bytes(bytes(32))
    with pytest.raises(ValueError, match="not this key"):
        seal.unseal(tmp_path / "sealed", key)


@pytest.mark.slow
def test_the_true_model_shrinks_the_gap_to_nothing():
    """Both simulators under the same effects, from reported poses that the marker has moved."""
    case = cases.describe(3, "single", ["marker_offset", "motor_lag", "payload_change"], slip=True, sim=None)
    runs = fresh_runs(case, count=2)
    found = true_shrink(case, model_of(case, effects=False), model_of(case), 1.0, runs)
    assert found["before"] > 1.0
    assert found["shrink"] > 0.999


def test_fresh_runs_know_no_chance():
    """A delay that jitters has its mean, a lost command arrives."""
    case = cases.describe(4, "pair", ["transport_delay", "lost_commands"], slip=True, sim=None, other=True)
    assert case["effects"][0]["parameters"]["form"] == 1.0
    steady = cases.describe(4, "single", ["transport_delay"], slip=True, sim=None)
    for (jittered, _), (expected, _) in zip(fresh_runs(case, count=2), fresh_runs(steady, count=2), strict=True):
        np.testing.assert_array_equal(jittered.pose, expected.pose)


def test_local_motion_is_in_the_frame_of_its_start():
    pose = np.array([[1.0, 2.0, np.pi / 2], [1.0, 3.0, 3.1], [0.0, 3.0, -3.1]])
    assert local_motion(pose, 2) == pytest.approx(np.array([[1.0, 1.0, 2 * np.pi - 3.1 - np.pi / 2]]))


def test_diagnoses_are_run_and_judged(tmp_path):
    """A program that always says `slope`, and fails on the second case."""
    answers = {
        "case_1": cases.describe(1, "single", ["slope"], slip=False, sim=None),
        "case_2": cases.describe(2, "none", [], slip=False, sim=None),
    }
    for name in answers:
        (tmp_path / "cases" / name).mkdir(parents=True)
    program = tmp_path / "program.py"
    program.write_text(
        "import json, sys, pathlib\n"
        "if sys.argv[1].endswith('2'): sys.exit('no')\n"
        "said = {'verdict': 'effects', 'selected': ['slope'], 'causes': [], 'probability': None}\n"
        "pathlib.Path(sys.argv[2], 'diagnosis.json').write_text(json.dumps(said))\n"
    )
    command = f"{sys.executable} {program} {{case}} {{out}}"
    for _ in range(2):
        done = diagnose(tmp_path / "cases", tmp_path / "found", command, jobs=2)
    assert [each["exit_code"] for each in done] == [0, 1]
    tables = judge(answers, {"slope": tmp_path / "found"}, tmp_path / "scores")
    rows = {row["row"]: row["value"] for row in tables["batch"]["slope"]}
    assert rows["one effect: named"] == 1.0
    assert rows["failed"] == 0.5
    assert (tmp_path / "scores" / "confusion_batch_slope.png").exists()
    assert "one effect: named" in (tmp_path / "scores" / "table.md").read_text()
    assert "slope (0.13)" in (tmp_path / "scores" / "misses.md").read_text()


def test_every_miss_is_a_row():
    answer = {"effects": [{"name": "slope"}], "strength": [0.5], "slip": 0.01, "inputs": "multilevel"}
    right = {"kind": "single", "right": True, "site": True, "channel": None, "claimed": True, "selected": ["slope"]}
    right |= {"unexplained": False}
    marks = {"case_1": right, "case_2": right | {"site": False, "interval": [0.2, 0.4], "shrink": 0.5}}
    rows = misses(dict.fromkeys(marks, answer), marks).splitlines()
    said = "site, shrink 0.200 to 0.400 said, 0.500 true"
    assert rows[2:] == [f"| 2 | single | slope (0.50) | yes | multilevel | slope | {said} |"]


def test_a_case_written_is_a_log_of_the_package(tmp_path):
    case = cases.describe(5, "single", ["frozen_frames"], slip=True, sim="near")
    runs = [run | {key: run[key][:40] for key in ("u", "slip")} for run in cases.plan(case)]
    logs = cases.simulate_runs(runs)
    cases.write_case(tmp_path, logs)
    assert sorted(path.name for path in tmp_path.iterdir())[:2] == ["real_1.csv.gz", "real_2.csv.gz"]
    assert len(list(tmp_path.glob("sim_*"))) == cases.SIM_RUNS
    log = ji.read_log(tmp_path / "real_2.csv.gz")
    assert np.asarray(log.x) == pytest.approx(logs[1][:, 3], abs=1e-6)
    again = cases.simulate_runs([run | {key: run[key][:40] for key in ("u", "slip")} for run in cases.plan(case)])
    assert np.array_equal(again[1], logs[1], equal_nan=True)
