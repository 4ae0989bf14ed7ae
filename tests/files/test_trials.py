"""The store of trials: whole, resumed, repaired, refused."""

import errno
import json

import numpy as np
import pytest
import xarray
from support.studies import SMALL, UNDER_EFFECTS

import jaxident as ji
from jaxident.errors import InputError, WorkError
from jaxident.files import sweeps, trials
from jaxident.files.sweeps import Told, sweep
from jaxident.files.trials import opened
from jaxident.robot.model import Effect
from jaxident.study.dataset import study_arrays
from jaxident.study.design import EffectSet
from jaxident.study.engine import run_chunk


def files(folder):
    """Everything in the finished store; of the list of all metadata the content, as old versions of zarr write its
    keys in any order."""
    store = folder / "trials.zarr"
    found = {str(path.relative_to(store)): path.read_bytes() for path in store.rglob("*") if path.is_file()}
    return {name: json.loads(content) if name == ".zmetadata" else content for name, content in found.items()}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    sweep(SMALL, folder)
    return files(folder)


@pytest.fixture
def counted(monkeypatch):
    """The chunks that are computed from now on."""
    numbers = []

    def run(study, todo):
        for number in todo:
            numbers.append(number)
            yield number, run_chunk(study, trials.chunks(study)[number])

    monkeypatch.setattr(sweeps, "run_locally", run)
    return numbers


class Killed(BaseException):
    pass


def killed_after(count):
    """Who ends the sweep after so many chunks."""
    left = [count]

    def advance(_):
        left[0] -= 1
        if not left[0]:
            raise Killed

    return Told(lambda trials, done: None, advance, lambda count: None)


def test_the_store_is_the_study_in_memory(tmp_path):
    found = ji.study(SMALL, out=tmp_path)
    xarray.testing.assert_identical(found.load(), study_arrays(SMALL))
    with xarray.open_zarr(tmp_path / "trials.zarr") as again:
        assert again["estimate"].dims[-1] == "parameter"
        assert json.loads(again.attrs["versions"])["jaxident"]


@pytest.mark.parametrize("count", [1, 3, 4])
def test_a_sweep_that_was_ended_goes_on(tmp_path, finished, counted, count):
    with pytest.raises(Killed):
        sweep(SMALL, tmp_path, told=killed_after(count))
    assert not (tmp_path / "trials.zarr").exists()
    (tmp_path / ".trials.zarr" / "estimate" / "0.0.0.0.0.1.1.0.00abc.partial").write_text("a killed write")
    (tmp_path / ".part-old").mkdir()
    counted.clear()
    sweep(SMALL, tmp_path)
    assert counted == list(range(count, 4))
    assert files(tmp_path) == finished
    assert not list(tmp_path.glob(".part-*"))


@pytest.mark.slow
def test_a_sweep_over_effects_goes_on(tmp_path, counted):
    sweep(UNDER_EFFECTS, tmp_path / "whole")
    with pytest.raises(Killed):
        sweep(UNDER_EFFECTS, tmp_path / "ended", told=killed_after(5))
    counted.clear()
    found = ji.study(UNDER_EFFECTS, out=tmp_path / "ended")
    assert counted == list(range(5, 12))
    assert files(tmp_path / "ended") == files(tmp_path / "whole")
    assert list(found["effect"].values) == ["none", "payload", "late"]
    xarray.testing.assert_identical(found.load(), study_arrays(UNDER_EFFECTS))


@pytest.mark.parametrize("harm", ["delete", "truncate", "change", "empty_marker", "metadata"])
def test_damage_is_repaired(tmp_path, finished, counted, harm):
    sweep(SMALL, tmp_path)
    counted.clear()
    chunk = tmp_path / "trials.zarr" / "deviation" / "0.0.0.0.0.1.0.0.0"
    content = chunk.read_bytes()
    match harm:
        case "delete":
            chunk.unlink()
        case "truncate":
            chunk.write_bytes(content[: len(content) // 2])
        case "change":
            chunk.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        case "empty_marker":
            (tmp_path / ".chunks" / "2.json").write_text("")
        case "metadata":
            (tmp_path / "trials.zarr" / ".zmetadata").write_text("{")
    damaged = []
    sweep(SMALL, tmp_path, told=sweeps.SILENT._replace(damaged=damaged.append))
    assert files(tmp_path) == finished
    assert counted == ([] if harm == "metadata" else [2])
    assert damaged == ([] if harm == "metadata" else [1])


def test_a_finished_sweep_computes_nothing(tmp_path, finished, counted):
    sweep(SMALL, tmp_path)
    counted.clear()
    sweep(SMALL, tmp_path)
    assert counted == []
    assert files(tmp_path) == finished


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (SMALL._replace(seed=1), ["study.seed", "0 there", "1 here"]),
        (SMALL._replace(noise=(1e-6, 1e-3)), ["study.noise"]),
        (UNDER_EFFECTS, ["study.effects is null there"]),
        (SMALL._replace(robots=(SMALL.robots[0]._replace(name="other"),)), ["study.robots"]),
        (SMALL._replace(estimators=(SMALL.estimators[0]._replace(settings=(("d_max_share", 0.5),)),)), ["estimators"]),
    ],
)
def test_another_study_is_refused(tmp_path, other, words):
    with opened(SMALL, tmp_path):
        pass
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError) as error, opened(other, tmp_path):
        pass
    for word in [*words, "another folder"]:
        assert word in str(error.value)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_study_whose_effect_has_another_form_since_goes_on(tmp_path):
    lag = Effect("motor_lag", {"time_constant": 0.1, "second_order": 0.0})
    study = SMALL._replace(effects=(EffectSet("none"), EffectSet("lag", (lag,))))
    with opened(study, tmp_path):
        pass
    path = tmp_path / "study.json"
    kept = json.loads(path.read_text())
    del kept["study"]["effects"][1]["effects"]["motor_lag"]["second_order"]
    path.write_text(json.dumps(kept))
    with opened(study, tmp_path):
        pass
    twice = Effect("motor_lag", {"time_constant": 0.1, "second_order": 0.5})
    with (
        pytest.raises(InputError, match="another study"),
        opened(study._replace(effects=(EffectSet("none"), EffectSet("lag", (twice,)))), tmp_path),
    ):
        pass


def test_another_version_is_refused(tmp_path, monkeypatch):
    with opened(SMALL, tmp_path):
        pass
    versions = trials.versions()
    monkeypatch.setattr(trials, "versions", lambda: versions | {"jaxident": "9.9"})
    with pytest.raises(InputError, match=r"versions\.jaxident"), opened(SMALL, tmp_path):
        pass


def test_damaged_or_missing_study_json_is_refused(tmp_path):
    with opened(SMALL, tmp_path):
        pass
    (tmp_path / "study.json").write_text('{"schema": ')
    with pytest.raises(WorkError, match="damaged"), opened(SMALL, tmp_path):
        pass
    (tmp_path / "study.json").unlink()
    with pytest.raises(InputError, match=r"without study\.json"), opened(SMALL, tmp_path):
        pass


def test_one_sweep_at_a_time(tmp_path):
    with opened(SMALL, tmp_path), pytest.raises(WorkError, match="another sweep"), opened(SMALL, tmp_path):
        pass


def test_a_full_disk_loses_nothing(tmp_path, finished, counted, monkeypatch):
    real, calls = trials.zarr.open_group, []

    def full(*arguments, **settings):
        calls.extend([settings] if settings.get("use_consolidated") is False and settings["mode"] == "r+" else [])
        if len(calls) > 1:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(*arguments, **settings)

    with monkeypatch.context() as patch:
        patch.setattr(trials.zarr, "open_group", full)
        with pytest.raises(WorkError, match="No space left"):
            sweep(SMALL, tmp_path)
    counted.clear()
    sweep(SMALL, tmp_path)
    assert counted == [1, 2, 3]
    assert files(tmp_path) == finished


def test_a_full_disk_leaves_a_finished_store_its_name(tmp_path, finished, monkeypatch):
    def full(study, path):
        raise OSError(errno.ENOSPC, "No space left on device")

    sweep(SMALL, tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(trials, "_write_skeleton", full)
        with pytest.raises(WorkError, match=r"No space left .* are kept"):
            sweep(SMALL, tmp_path)
    assert files(tmp_path) == finished


def test_a_chunk_that_does_not_come_back_is_missed(tmp_path, monkeypatch):
    monkeypatch.setattr(sweeps, "run_locally", lambda study, todo: iter(()))
    with pytest.raises(WorkError, match="12 trials did not come back"):
        sweep(SMALL, tmp_path)
    assert not (tmp_path / "trials.zarr").exists()


def test_memory_layout_is_one_file_per_chunk(finished):
    assert sum(name.startswith("estimate/0") for name in finished) == 4
    assert np.prod(SMALL.shape) == 12
