"""Logs on disk: what is written reads back bit by bit, what is wrong is named by line and column."""

import gzip
import io
import os
import sys

import numpy as np
import pytest

from jaxident.errors import InputError
from jaxident.files import table
from jaxident.files.logs import find_logs, find_simulated, read_log, read_logs, require_poses, write_log
from jaxident.log import Log, make_log

HEADER = "t,u_r,u_l,x,y,theta\n"
GOOD = "0,1,2,0,0,0\n1,1,2,1,0,0\n"


def save(folder, text, name="log.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def same(one: Log, other: Log) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))


def random_log(seed: int, rows: int, runs: int) -> Log:
    draw = np.random.default_rng(seed)
    bits = draw.integers(0, 2**63, (5, 4 * rows)).view(float)  # numbers of any size, to their last bit
    u_r, u_l, x, y, theta = (row[np.isfinite(row)][:rows] for row in bits)
    blind = draw.random(rows) < 0.3
    pose = (np.where(blind, np.nan, column) for column in (x, y, theta))
    return make_log(np.cumsum(draw.uniform(1e-9, 1.0, rows)), u_r, u_l, *pose, run=np.arange(rows) * runs // rows - 1)


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz"])
@pytest.mark.parametrize(("rows", "runs"), [(2, 1), (2000, 1), (2000, 7)])
def test_what_is_written_reads_back_bit_by_bit(tmp_path, monkeypatch, name, rows, runs):
    monkeypatch.setattr(table, "BLOCK_BYTES", 5000)
    log = random_log(rows + runs, rows, runs)
    write_log(log, tmp_path / name)
    again = read_log(tmp_path / name)
    if runs == 1:
        log = log._replace(run=np.zeros(rows, int))
    assert same(again, log)
    assert [column.dtype for column in again] == [np.dtype(float)] * 6 + [np.dtype(np.int64)]


def test_the_text_is_the_shortest_and_has_no_run_column_for_one_run(tmp_path):
    nan = np.nan
    write_log(make_log([0.0, 0.1], [1.0, -2.5], [1e-9, 0.0], [nan, 0.1], [nan, 0.2], [nan, 3.0]), tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text() == HEADER + "0.0,1.0,1e-09,,,\n0.1,-2.5,0.0,0.1,0.2,3.0\n"


def test_equal_logs_give_equal_gzip_files(tmp_path):
    for name in ("a.csv.gz", "b.csv.gz"):
        write_log(random_log(0, 100, 2), tmp_path / name)
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()


@pytest.mark.parametrize(
    "text",
    [
        "t,u_r,u_l,x,y,theta\n0,1,2,3,4,5\n1,1,2,,,\n",
        "\ufefft,u_r,u_l,x,y,theta\n0,1,2,3,4,5\n1,1,2,,,\n",
        "t,u_r,u_l,x,y,theta\r\n0,1,2,3,4,5\r\n1,1,2,,,\r\n",
        "t,u_r,u_l,x,y,theta\r0,1,2,3,4,5\r1,1,2,,,",
        "\n \nt,u_r,u_l,x,y,theta\n\n0,1,2,3,4,5\n  \n1,1,2,,,\n\n",
        "theta,x,u_l,t,u_r,y\n5,3,2,0,1,4\n,,2,1,1,\n",
        ' "t", "u_r","u_l" , x,y,theta\n"0", 1 ,2,+3.,4e0,.5E+1\n1,1,2, ,"",\n',
    ],
    ids=["plain", "mark", "CRLF", "CR", "blank lines", "order", "quotes and blanks"],
)
@pytest.mark.parametrize("packed", [False, True])
def test_many_ways_to_write_one_log(tmp_path, text, packed):
    content = gzip.compress(text.encode()) if packed else text.encode()
    nan = np.nan
    expected = make_log(*np.array([[0, 1], [1, 1], [2, 2], [3, nan], [4, nan], [5, nan]]))
    assert same(read_log(save(tmp_path, content)), expected)


def test_standard_input(monkeypatch):
    for content in ((HEADER + GOOD).encode(), gzip.compress((HEADER + GOOD).encode())):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
        assert read_log("-").t.tolist() == [0.0, 1.0]
    with pytest.raises(InputError, match="standard input: is empty"):
        read_log("-")


def test_a_last_command_that_is_empty_repeats_the_one_before(tmp_path):
    rows = "0,1,2,,,,4\n1,3,,,,,4\n2,,5,,,,7\n0,6,7,,,,9\n1,,,,,,9\n"
    log = read_log(save(tmp_path, "t,u_r,u_l,x,y,theta,run\n" + rows))
    assert log.u_r.tolist() == [1, 3, 0, 6, 6]
    assert log.u_l.tolist() == [2, 2, 5, 7, 7]
    assert log.run.tolist() == [4, 4, 7, 9, 9]


@pytest.mark.parametrize("cell", ["7", "lost", '"a, b"', "nan", ""])
def test_further_columns_are_ignored_with_a_warning(tmp_path, cell):
    path = save(tmp_path, f"t,u_r,note,u_l,x,y,theta,n\n0,1,{cell},2,0,0,0,1\n1,1,{cell},2,1,0,0,1\n")
    with pytest.warns(UserWarning, match="log.csv: columns ignored: 'note', 'n'"):
        log = read_log(path)
    assert log.u_l.tolist() == [2.0, 2.0]


def test_a_column_that_nobody_reads_may_hold_any_bytes(tmp_path):
    path = save(tmp_path, b"t,u_r,u_l,x,y,theta,note\n0,1,2,,,,caf\xe9\n1,1,2,,,,\xff\n")
    with pytest.warns(UserWarning, match="'note'"):
        assert read_log(path).t.tolist() == [0.0, 1.0]


BAD_ROWS = {
    "0,1,2,0,0,0\n1,abc,2,1,0,0\n": "line 3, column u_r: 'abc' is not a finite decimal number",
    "0,1,2,0,0,0\n\n\n1,1,2,1,0,nan\n": "line 5, column theta: 'nan' is not a finite decimal number",
    "0,1,2,0,0,0\n1,-inf,2,1,0,0\n": "line 3, column u_r: '-inf' is not a finite",
    "0,1,2,0,0,0\n1,Infinity,2,1,0,0\n": "line 3, column u_r: 'Infinity' is not a finite",
    "0,1,2,0,0,0\n1,1e999,2,1,0,0\n": "line 3, column u_r: '1e999' is beyond double precision",
    "0,1,2,0,0,0\n1,1_0,2,1,0,0\n": "line 3, column u_r: '1_0'",
    "0,1,2,0,0,0\n1,0x10,2,1,0,0\n": "line 3, column u_r: '0x10'",
    "0,1,2,0,0,0\n1,1 2,2,1,0,0\n": "line 3, column u_r: '1 2'",
    "0,1,2,0,0,0\n1,\u0661,2,1,0,0\n": "line 3, column u_r",
    "0,1,2,0,0,0\n1,1,2,1,0\n": r"line 3: 5 cells, the header has 6 columns \(t,u_r,u_l,x,y,theta\)",
    "0,1,2,0,0,0,9\n1,1,2,1,0,0\n": "line 2: 7 cells, the header has 6",
    "0,1,2,0,0,0\n1;1;2;1;0;0\n": "line 3: 1 cells",
    "0,1,2,0,0,0\n1,1,2,1,0,0\n2,1,2," + "9" * 200_000 + ",0,0\n": "line 4: field larger than field limit",
    "0,1,2,0,0,0\n1,1,2,1,0,'" + "9" * 200 + "'\n": "line 3, column theta: .{20,60} is not",
    "0,1,2,0,0,0\n,1,2,1,0,0\n": "line 3, column t: is empty; every row needs a time",
    "0,1,2,0,0,0\n,,,,,\n": "line 3, column t: is empty",
    "0,1,2,0,0,0\n0,1,2,1,0,0\n": "line 3, column t: is 0; time must rise",
    "0,1,2,0,0,0\n1,1,2,1,0,0\n0.5,1,2,1,0,0\n": "line 4, column t: is 0.5; time must rise",
    "0,,2,0,0,0\n1,1,2,1,0,0\n": "line 2, column u_r: is empty; only a run's last row may have no command",
    "0,1,,0,0,0\n1,1,,1,0,0\n": "line 2, column u_l: is empty; only",
    "0,1,2,0,0,0\n1,1,2,1,,0\n": "line 3, column y: is empty; a pose has three cells, or none",
    "0,1,2,0,,\n1,1,2,1,0,0\n": "line 2, column y: is empty; a pose",
    "0,1,2,0,0,0\n": "log.csv: no run has two rows",
    "\n": "log.csv: has no rows",
    "0,1,2,0,0,0\n1,\x00\x01,2,1,0,0\n": "line 3, column u_r: .* is not a finite",
}


@pytest.mark.parametrize("rows", BAD_ROWS)
def test_a_bad_row_is_named(tmp_path, rows):
    with pytest.raises(InputError, match=r"log\.csv") as caught:
        read_log(save(tmp_path, HEADER + rows))
    caught.match(BAD_ROWS[rows])
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        ("a,0,1,1,,,\na,1,1,1,,,\n", "line 2, column run: 'a' is not a finite decimal number"),
        ("1,0,1,1,,,\n1.5,1,1,1,,,\n", "line 3, column run: is 1.5; it should be an integer"),
        ("1,0,1,1,,,\n,1,1,1,,,\n", "line 3, column run: is empty; it should be an integer"),
        ("1e17,0,1,1,,,\n1e17,1,1,1,,,\n", "line 2, column run: is 1e[+]17; it should be an integer"),
        ("1,0,1,1,,,\n1,1,1,1,,,\n2,0,1,1,,,\n1,2,1,1,,,\n", "line 5, column run: is 1; .* must stand together"),
        ("1,0,1,1,,,\n2,0,1,1,,,\n", "no run has two rows"),
    ],
)
def test_a_bad_run_number_is_named(tmp_path, rows, reason):
    with pytest.raises(InputError, match=reason):
        read_log(save(tmp_path, "run," + HEADER + rows))


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", r"is empty; it should begin with the header t,u_r,u_l,x,y,theta"),
        (b"\n\n", "is empty"),
        (b"t,u_r,x,y,theta\n", "line 1: no column u_l in the header 't,u_r,x,y,theta'; it should be t,u_r,u_l,"),
        (b"\n0,1,2,0,0,0\n", "line 2: no column t in the header '0,1,2,0,0,0'"),
        (b"t;u_r;u_l;x;y;theta\n", "has no rows; a log needs two"),
        (b"t|u_r|u_l\n", "line 1: no column t in the header 't[|]u_r"),
        (b"t,u_r,u_l,x,y,theta,t\n", "line 1: column t appears 2 times; keep one"),
        (b"t,u_r,u_l,x,y,theta,run,run\n", "line 1: column run appears 2 times"),
        (bytes(range(256)), "is not a text file in UTF-8"),
        ("t,u_r,u_l,x,y,theta\n".encode("utf-16"), "is not a text file in UTF-8"),
        (b"a" * 100_000, "is not a text file in UTF-8"),
        (
            gzip.compress(b"t,u_r,u_l,x,y,theta\n" + b"0,1,2,0,0,0\n" * 9, mtime=0)[:-12],
            r"damaged gzip .*; copy it again",
        ),
        (b"\x1f\x8b junk", "damaged gzip file"),
    ],
)
def test_a_file_that_is_no_log_is_refused(tmp_path, content, reason):
    with pytest.raises(InputError, match=reason) as caught:
        read_log(save(tmp_path, content))
    assert "\n" not in str(caught.value)


def test_a_path_that_is_no_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv: no such file"):
        read_log(tmp_path / "none.csv")
    with pytest.raises(InputError, match="the folder holds no logs"):
        read_log(tmp_path)
    with pytest.raises(InputError, match="cannot be read: Not a directory"):
        read_log(save(tmp_path, HEADER + GOOD) / "log.csv")
    with pytest.raises(InputError, match="cannot be read: File name too long"):
        read_logs("n" * 300)


def test_the_line_is_right_in_a_later_block(tmp_path, monkeypatch):
    monkeypatch.setattr(table, "BLOCK_BYTES", 100)
    rows = [f"{k},1,2,0,0,0\n" + "\n" * (k % 3 == 0) for k in range(200)]
    line = 2 + sum(row.count("\n") for row in rows[:150])
    rows[150] = "150,1,?,0,0,0\n"
    with pytest.raises(InputError, match=f"line {line}, column u_l"):
        read_log(save(tmp_path, HEADER + "".join(rows)))
    rows[150] = "149,1,2,0,0,0\n"
    with pytest.raises(InputError, match=f"line {line}, column t"):
        read_log(save(tmp_path, HEADER + "".join(rows)))


def test_both_parsers_read_the_same(tmp_path, monkeypatch):
    log = random_log(3, 500, 3)
    write_log(log, tmp_path / "log.csv")
    monkeypatch.setattr(table, "_parse_fast", lambda text, width: None)
    assert same(read_log(tmp_path / "log.csv"), log)


def test_a_log_that_would_not_read_back_is_not_written(tmp_path):
    wrong = {
        "row 1, column t: is 0; time must rise": make_log([0.0, 0.0], [1, 1], [1, 1]),
        "row 0, column u_r: is empty": make_log([0.0, 1.0], [np.nan, 1], [1, 1]),
        "row 1, column x: is inf; a pose": make_log([0.0, 1.0], [1, 1], [1, 1], *np.full((3, 2), [0.0, np.inf])),
        "has no rows": make_log(*np.empty((3, 0))),
    }
    for reason, log in wrong.items():
        with pytest.raises(InputError, match=reason):
            write_log(log, tmp_path / "a.csv")
    assert os.listdir(tmp_path) == []


def test_folders_stand_for_their_logs_in_natural_order(tmp_path):
    names = ["real_10.csv", "real_2.csv.gz", "real_1.csv", "sim_1.csv", "other.csv", "real_3.txt", ".real_4.csv"]
    for name in names:
        save(tmp_path, HEADER + GOOD, name)
    (tmp_path / "real_5.csv").mkdir()
    found = [os.path.basename(path) for path in find_logs(tmp_path)]
    assert found == ["real_1.csv", "real_2.csv.gz", "real_10.csv"]
    assert [os.path.basename(path) for path in find_simulated([tmp_path, "-"])] == ["sim_1.csv"]
    for name in names:
        if name.startswith("real_"):
            (tmp_path / name).unlink()
    assert [os.path.basename(path) for path in find_logs([str(tmp_path)])] == ["other.csv", "sim_1.csv"]
    assert find_logs(["-", tmp_path / "none.csv"]) == ["-", str(tmp_path / "none.csv")]


def test_logs_come_in_the_order_given(tmp_path):
    for k in (1, 2):
        save(tmp_path, HEADER + GOOD.replace("0,1,2", f"-{k},1,2", 1), f"real_{k}.csv")
    logs = read_logs([tmp_path / "real_2.csv", tmp_path])
    assert [log.t[0] for log in logs] == [-2.0, -1.0, -2.0]


def test_a_folder_without_logs_is_refused(tmp_path):
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match=r"the folder holds no logs \(\.csv or \.csv\.gz\)"):
        read_logs([tmp_path])
    assert find_simulated(tmp_path) == []


def test_poses_are_required_only_where_asked_for(tmp_path):
    blind = read_log(save(tmp_path, HEADER + "0,1,2,,,\n1,1,2,0,0,0\n2,1,2,,,\n"))
    with pytest.raises(InputError, match=r"log\.csv: no run has two poses"):
        require_poses(blind, "log.csv")
    require_poses(read_log(save(tmp_path, HEADER + GOOD)), "log.csv")


def test_the_husky_log_reads(shared):
    log = read_log(shared / "data" / "drive_husky" / "husky.csv.gz")
    runs = log.runs()
    assert len(runs) == 603
    assert len(log.t) == 24120
    assert all(np.allclose(np.diff(run.t), 0.05) for run in runs)
    assert np.isfinite(log.command).all()


def test_numbered_logs_come_in_the_order_of_their_numbers_and_others_as_given():
    first, second, tenth, evening = "run_1.csv", "run_2.csv", "run_10.csv", "evening.csv"
    for given in ([first, tenth, second], [tenth, second, first]):
        assert find_logs(given) == [first, second, tenth]
    assert find_logs([tenth, evening, first]) == [tenth, evening, first]
    assert find_logs([second, first, first]) == [second, first, first]
