"""What a set draws: its kinds, and that a set of an earlier day is still the same one."""

import csv
import hashlib
import pathlib

import numpy as np
import pytest
from withheld.protocol.cases import LATER_FORMAT, write_answers
from withheld.protocol.outside import LATER_SITES, SITES
from withheld.protocol.sets import COUNTS, SINGLE_FRAMES, draw_set, names_of_kind

from jaxident.effects import CATALOGUE

SIMD = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
same_digits = pytest.mark.skipif(
    not {"AVX512_SKX", "X86_V4"} & set(SIMD),
    reason="the sets were drawn with numpy's functions for AVX-512; elsewhere last digits, and so the seal, differ",
)
SEALS = pathlib.Path(__file__).resolve().parents[2] / "experiments" / "withheld"


def seal(name):
    """SHA-256 of a set's answers: in its folder, of older sets in the table of their scores."""
    if (SEALS / name / "SEAL").exists():
        return (SEALS / name / "SEAL").read_text().split()[0]
    with (SEALS / "HISTORY.csv").open(newline="") as table:
        return next(row["SHA-256 of the answers"] for row in csv.DictReader(table) if row["set"] == name)


def digest(path, name, seed):
    """SHA-256 of the answers of a set, as `draw` writes them."""
    write_answers(path, {f"case_{k:03d}": case for k, case in enumerate(draw_set(name, seed), start=1)})
    return hashlib.sha256(path.read_bytes()).hexdigest()


@same_digits
@pytest.mark.parametrize(
    ("folder", "name", "seed"),
    [("sealed_3", "sealed", 2026112204), ("sealed_5", "sealed_half", 2026112302)],
)
def test_sealed_sets_are_drawn_as_they_were(folder, name, seed, tmp_path):
    assert seal(folder) == digest(tmp_path / "answers.json", name, seed)


@same_digits
def test_sealed_sets_of_the_engine_are_drawn_as_they_were(tmp_path):
    pytest.importorskip("mujoco")
    assert seal("sealed_engine_8") == digest(tmp_path / "answers.json", "sealed_engine", 2026112303)


@pytest.fixture(scope="module")
def drawn():
    return draw_set("development_many", 7)


def test_a_set_has_its_counts(drawn):
    kinds = [case["kind"] for case in drawn]
    assert {kind: kinds.count(kind) for kind in COUNTS["development_many"]} == COUNTS["development_many"]


def test_many_are_four_or_five_of_the_catalogue():
    cases = names_of_kind(np.random.default_rng(1), "many", 60, list(CATALOGUE), list(SITES))
    assert {len(names) for names in cases} == {4, 5}
    assert all(len(set(names)) == len(names) for names in cases)
    assert {name for names in cases for name in names} == CATALOGUE.keys() - set(SINGLE_FRAMES)


def test_mixed_is_one_of_the_catalogue_beside_one_outside(drawn):
    mixed = [case for case in drawn if case["kind"] == "mixed"]
    for case in mixed:
        known, unknown = (effect["name"] for effect in case["effects"])
        assert case["accepted"] == [[known]]
        assert known in CATALOGUE
        assert case["outside"] == [unknown]
        assert unknown in SITES
    assert {case["outside"][0] for case in mixed} == SITES.keys()  # 14 cases, seven effects


def test_further_kinds_are_told_in_the_answers(drawn, tmp_path):
    write_answers(tmp_path / "answers.json", {"case_001": next(case for case in drawn if case["kind"] == "mixed")})
    assert LATER_FORMAT["outside"] in (tmp_path / "answers.json").read_text()


def test_later_effects_are_in_later_sets_alone(drawn):
    """20 cases outside and 20 mixed, of 13 effects: every one is drawn in each kind."""
    second = draw_set("sealed_second", 7)
    for kind in ("outside", "mixed"):
        names = {effect["name"] for case in second if case["kind"] == kind for effect in case["effects"]}
        assert names - CATALOGUE.keys() == SITES.keys() | LATER_SITES.keys()
    assert not {effect["name"] for case in drawn for effect in case["effects"]} & LATER_SITES.keys()
