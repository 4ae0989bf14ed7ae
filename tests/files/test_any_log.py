"""Everything that takes a log takes a path, a folder, a frame, a dict, a `Log`, or a list of them."""

import subprocess
import sys

import numpy as np
import pytest

import jaxident as ji
from jaxident.errors import InputError
from jaxident.files.any_log import as_log, as_logs
from jaxident.files.logs import read_log, write_log
from jaxident.log import Log

LOG = Log.from_arrays(*np.arange(12.0).reshape(4, 3).T, x=np.ones(4), y=np.zeros(4), theta=np.zeros(4))


def same(first, second):
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


def test_every_form_gives_the_same_log(tmp_path):
    write_log(LOG, tmp_path / "a.csv")
    write_log(LOG[:2], tmp_path / "b.csv")
    columns = {name: np.asarray(column) for name, column in LOG._asdict().items()}
    for form in (LOG, columns, tmp_path / "a.csv", str(tmp_path / "a.csv"), [LOG], [columns]):
        (log,) = as_logs(form)
        assert same(log, LOG)
    assert [len(log.t) for log in as_logs(tmp_path)] == [4, 2]
    assert [len(log.t) for log in as_logs([tmp_path, LOG, columns])] == [4, 2, 4, 4]
    assert as_log(tmp_path).run.tolist() == [0, 0, 0, 0, 1, 1]
    assert same(ji.read_log(tmp_path), as_log([LOG, LOG[:2]]))
    assert same(ji.read_log(sorted(tmp_path.glob("*.csv"))), as_log([LOG, LOG[:2]]))
    with pytest.raises(InputError, match="empty list"):
        ji.read_log([])


def test_a_pandas_frame_is_a_log(tmp_path):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed; frames are taken by their shape alone")
    frame = pandas.DataFrame(LOG._asdict())
    assert same(as_log(frame), LOG)
    stamped = frame.assign(t=pandas.to_datetime(frame.t, unit="s", utc=True))
    assert same(as_log(stamped), LOG)
    foreign = frame.rename(columns={"t": "time_ms", "theta": "yaw"}).assign(time_ms=1e3 * frame.t)
    assert same(Log.from_dataframe(foreign, {"t": "time_ms", "theta": "yaw"}, {"t": "ms"}), LOG)


@pytest.mark.parametrize("wrong", [3, None, [], [3]])
def test_what_is_no_log_is_named(wrong):
    with pytest.raises(InputError, match="it should be a Log, a path, a folder"):
        as_logs(wrong)


def test_entry_points_read_paths(tmp_path):
    model = ji.load_model("published")
    log = ji.simulate(model, {"t": np.arange(60) / 30, "u_r": np.sign(np.sin(np.arange(60))), "u_l": np.ones(60)})
    write_log(log, tmp_path / "log.csv")
    made = ji.simulate(model, str(tmp_path / "log.csv"))
    np.testing.assert_allclose(made.x, log.x, rtol=1e-12, atol=1e-15)
    assert len(ji.plot.path(tmp_path / "log.csv").lines) > 0
    for call in (ji.identify, ji.diagnose):
        with pytest.raises(InputError, match="no such file"):
            call(str(tmp_path / "none.csv"))
    with pytest.raises(InputError, match=r"recursive.init takes a Log, not a str: jaxident.read_log"):
        ji.recursive.init("log.csv", d_max=1.0)


def test_double_precision_is_asked_for_by_one_call(tmp_path):
    write_log(LOG, tmp_path / "log.csv")
    code = f"""
import jaxident as ji
for call in (ji.identify, ji.diagnose):
    try:
        call({str(tmp_path / "log.csv")!r})
    except RuntimeError as error:
        print(error)
"""
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert shown.stdout.count("needs double precision: call jaxident.start_jax()") == 2


@pytest.mark.parametrize("separator", [";", "\t", ","])
def test_a_foreign_file(tmp_path, separator):
    """Names, units, ISO times, quaternions; beside semicolons and tabs the decimal points are commas."""
    rows = [
        ["time", "right", "left", "X", "Y", "qz", "qw", "qx", "qy"],
        ["2026-01-02T00:00:00Z", "1", "2", "1500", "0", "0", "1", "0", "0"],
        ["2026-01-02T00:00:00.5Z", "1", "2", "1500.5", "0", "2", "0", "0", "0"],
    ]
    lines = [[cell.replace("1500.5", "1500.5" if separator == "," else "1500,5") for cell in row] for row in rows]
    (tmp_path / "f.csv").write_text("\n".join(separator.join(row) for row in lines))
    log = read_log(tmp_path / "f.csv", "t=time,u_r=right,u_l=left,x=X:mm,y=Y:mm")
    assert (log.t - log.t[0]).tolist() == [0.0, 0.5]
    assert log.x.tolist() == [1.5, 1.5005]
    assert log.theta.tolist() == [0.0, np.pi]
