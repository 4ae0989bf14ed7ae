"""Two folders of diagnoses side by side."""

import json

import numpy as np
import pytest
from withheld import compare
from withheld.scoring.intervals import matched
from withheld.scoring.rows import ROWS

ROW = {row.label: row for row in ROWS}
NAMED, SHARE = ROW["one effect: named"], ROW["four or five effects: share named"]


def single(right):
    return {"kind": "single", "right": right}


def test_a_difference_in_pairs_is_surer_than_of_two_sets():
    """Nine of ten cases are alike in both; the interval of the difference knows it."""
    hard = np.random.default_rng(0).random(400) < 0.5
    first = [single(bool(h)) for h in hard]
    second = [single(bool(h) or k % 10 == 0) for k, h in enumerate(hard)]
    found = compare.paired(NAMED, first, second)
    gain = np.mean([b["right"] - a["right"] for a, b in zip(first, second, strict=True)])
    assert found["first"] == pytest.approx(hard.mean())
    assert found["difference"] == pytest.approx(gain)
    half = 1.96 * np.sqrt(gain * (1.0 - gain) / 400)
    assert found["interval"] == pytest.approx([gain - half, gain + half], abs=0.01)
    assert found["cases"] == 400


def test_matched_shares_cover():
    """2000 samples of 40 pairs, 5 % gained, 15 % lost: the interval holds the difference in 95 % of them or more."""
    rng, held = np.random.default_rng(1), 0
    for _ in range(2000):
        kind = rng.choice(3, 40, p=[0.8, 0.05, 0.15])
        first, second = np.where(kind == 2, 1.0, 0.0), np.where(kind == 1, 1.0, 0.0)
        low, high = matched(first, second)
        held += low <= -0.1 <= high
    assert 0.94 < held / 2000 < 0.985
    assert matched(np.ones(20), np.ones(20)) == pytest.approx((-1.96 / 22, 1.96 / 22), abs=1e-4)


def test_a_row_is_taken_over_cases_that_bear_on_it_in_both():
    shrink = ROW["shrink achieved over achievable, median"]
    first = [{"kind": "pair", "shrink": 0.9}, {"kind": "pair", "shrink": 0.5}, {"kind": "none"}]
    second = [{"kind": "pair", "shrink": 0.7}, {"kind": "pair"}, {"kind": "none"}]
    found = compare.paired(shrink, first, second)
    assert (found["first"], found["second"], found["cases"]) == (0.9, 0.7, 1)
    assert compare.paired(NAMED, first, second)["difference"] is None


def test_a_share_of_effects_is_a_ratio_of_sums():
    many = {"kind": "many", "hidden": 4}
    found = compare.paired(SHARE, [many | {"named": 1}] * 3, [many | {"named": 3}] * 3)
    assert (found["difference"], found["interval"]) == (0.5, [0.5, 0.5])


def test_the_page_of_two_folders(tmp_path, monkeypatch, capsys):
    """The second names the slope and the first does not; a case that only one has come to is left out."""
    effect = {"name": "slope", "parameters": {}, "sites": ["contact"]}
    answer = {
        "generator": "batch", "kind": "single", "effects": [effect], "accepted": [["slope"]], "channels": ["along"],
        "strength": [0.4], "inputs": "multilevel",
    }  # fmt: skip
    (tmp_path / "answers.json").write_text(json.dumps({"cases": {f"case_{k}": answer for k in range(3)}}))
    for method, name, count in (("old", "turn_loss", 3), ("new", "slope", 2)):
        for k in range(count):
            folder = tmp_path / method / f"case_{k}"
            folder.mkdir(parents=True)
            said = {"verdict": "effects", "selected": [name], "causes": [], "probability": None}
            (folder / "diagnosis.json").write_text(json.dumps(said))
            (folder / "process.json").write_text(json.dumps({"seconds": 1.0}))
    found = [f"{name}={tmp_path / name}" for name in ("old", "new")]
    words = ["compare", "--answers", str(tmp_path / "answers.json"), "--found", *found, "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", [*words, "--quick"])
    compare.main()
    page = capsys.readouterr().out
    assert page.strip() == (tmp_path / "out" / "comparison.md").read_text().strip()
    assert "| one effect: named | 0 | 1 | +1 (-0.193 to +1) | 2 | at least 0.95 |" in page
    assert (
        "| 1 | single | slope (0.40) | turn_loss (wrong: name, site, channel) | slope (wrong: site, channel) |" in page
    )
