"""Strategies for inputs that strangers and accidents make: mutated logs, models, studies, streams and options."""

import copy
import gzip
import json
from typing import Any

from hypothesis import strategies as st

from jaxident.files.models import load_model, model_to_dict
from jaxident.files.study_example import EXAMPLE

TOKENS = [
    b"", b"nan", b"inf", b"-inf", b"1e999", b"1e308", b"-1e308", b"1e-320", b"-0", b"0", b"1", b"9" * 400, b"1_000",
    b"0x10", "２".encode(),b'"', b"'", b"''", b'"""', b",", b",,", b";", b"\0", b"\n", b"\r", b"\n\n", b"\xef\xbb\xbf",
    b"\xff\xfe", "\u2028".encode(), b"#", b"=1+1", b"../../x", b"/dev/null", b"<script>alert(1)</script>", b"true",
    b"null", b"[", b"]", b"{", b"}", b"[[", b"a.b.c", b"\\ud800", b"\\u0000", b"\x1b[2J", b"2024-01-01", b"1e18", b":",
    b"t", b"run", b"9007199254740993", b"-1", b"0.1", b" ", b"\t", b"[" * 300, b"a" * 3000,
]  # fmt: skip
"""What parsers stumble over."""

_ROWS = [f"{k / 30:.4f},{k % 3 - 1},{k % 4 - 2},{0.1 * k:.3f},{-0.05 * k:.3f},{0.3 * k:.4f}" for k in range(12)]
LOGS = [
    "t,u_r,u_l,x,y,theta\n" + "\n".join(_ROWS) + "\n",
    "run,t,u_r,u_l,x,y,theta\n" + "\n".join(f"{k // 6},{row}" for k, row in enumerate(_ROWS)),
    't,u_r,u_l,x,y,theta,"a note"\r\n' + "\r\n".join(f"{row},text" for row in _ROWS),
    "t,u_r,u_l,x,y,theta\n0,1,1,,,\n1,1,,,,\n",
]
COMMANDS = [
    "t,v,w\n0,0.1,0\n0.5,0.1,0.2\n0.5,0,0\n1,0.2,-0.2\n",
    "t,u_r,u_l\n0,1,1\n0.1,1,-1\n0.4,0,0\n",
]
POSES = ["t,x,y,theta\n0.01,0,0,0\n0.2,,,\n0.49,0.05,0,3.2\n", "t,x,y,theta\n0,1e9,1e9,-40\n3,1e9,1e9,40\n"]


@st.composite
def mutated(draw: Any, bases: list[str]) -> bytes:
    """One of some texts with up to four edits, or bytes at random; now and then gzipped, whole or damaged."""
    if draw(st.integers(0, 30)) == 0:
        content = draw(st.binary(max_size=300))
    else:
        content = draw(st.sampled_from(bases)).encode()
        for _ in range(draw(st.integers(0, 4))):
            content = _edited(draw, content)
    packed = draw(st.integers(0, 40))
    if packed == 0:
        return gzip.compress(content)
    return gzip.compress(content)[: draw(st.integers(2, 60))] if packed == 1 else content


def _edited(draw: Any, content: bytes) -> bytes:
    """Some bytes taken out, doubled, or replaced by a token."""
    begin = draw(st.integers(0, len(content)))
    end = min(len(content), begin + draw(st.sampled_from([0, 1, 2, 5, 20, 100])))
    kind = draw(st.sampled_from(["replace", "replace", "delete", "double"]))
    middle = {"delete": b"", "double": content[begin:end] * 2}.get(kind)
    return content[:begin] + (draw(st.sampled_from(TOKENS)) if middle is None else middle) + content[end:]


def logs() -> st.SearchStrategy[bytes]:
    """Files that may be logs."""
    return mutated(LOGS)


def streams() -> st.SearchStrategy[tuple[bytes, bytes, dict[str, Any]]]:
    """Commands, poses, and settings to merge them with."""
    number = st.none() | st.sampled_from([0.0, -1.0, 1e-9, 1e-3, 0.05, 1.0, 1e9, 1e308, float("nan"), float("inf")])
    settings = {"period": number, "track": st.none() | st.just(0.2) | number, "hold_timeout": number}
    offset = st.sampled_from([0.0, 0.01, -1e9, 1e308, float("nan")])
    return st.tuples(mutated(COMMANDS), mutated(POSES), st.fixed_dictionaries({**settings, "pose_offset": offset}))


def values() -> st.SearchStrategy[Any]:
    """JSON values: numbers at the end of what a double holds, odd texts, lists, objects."""
    numbers = st.sampled_from([0, 1, -1, 0.5, 1e308, -1e308, 1e-320, 10**400, 2**53, 1e18, True, 3]) | st.floats()
    texts = st.sampled_from(["", "nan", "../x", "<script>", "\ud800", "\0", "published", "motor_lag", "a" * 2000])
    leaves = st.none() | numbers | texts | st.text(max_size=5)
    return st.recursive(leaves, lambda v: st.lists(v, max_size=4) | st.dictionaries(texts, v, max_size=3), max_leaves=6)


def _rich_model() -> dict[str, Any]:
    """A model file with every section."""
    content = model_to_dict(load_model("published"))
    content["noise"] = {"position": 1e-3, "heading": 1e-2, "correlation_time": 0.1, "slip_along": 0.01}
    content["effects"] = [{"name": "motor_lag", "parameters": {"time_constant": 0.05}, "standard_deviation": None}]
    content["covariance"] = {"parameter_order": ["rate_1", "rate_2"], "matrix": [[1.0, 0.0], [0.0, 1.0]]}
    runs = [{"mark": "a", "session_time": 0.0}]
    content["provenance"] = {"version": "0.1.0", "method": "paper", "logs": ["a.csv"], "seed": 0, "runs": runs}
    return content


@st.composite
def models(draw: Any) -> bytes:
    """Files that may be models: a value or a key of one changed, or its text mutated."""
    content: Any = _rich_model()
    if draw(st.booleans()):
        return draw(mutated([json.dumps(content)]))
    for _ in range(draw(st.integers(1, 3))):
        content = _changed(draw, copy.deepcopy(content))
    return json.dumps(content, ensure_ascii=draw(st.booleans())).encode("utf-8", "surrogatepass")


def _changed(draw: Any, content: Any) -> Any:
    """A value somewhere inside replaced, taken out or doubled, or a key added."""
    if not isinstance(content, dict | list) or not content or draw(st.integers(0, 5)) == 0:
        return draw(values())
    key = draw(st.sampled_from(sorted(content) if isinstance(content, dict) else range(len(content))))
    kind = draw(st.sampled_from(["inside", "inside", "inside", "delete", "add"]))
    if kind == "inside":
        content[key] = _changed(draw, content[key])
    elif kind == "delete":
        del content[key]
    elif isinstance(content, dict):
        content[draw(st.sampled_from(["", "mark", "slip_time", "x", "at_bound", "standard_deviation"]))] = draw(
            values()
        )
    else:
        content.append(content[key])
    return content


_ALL_KEYS = EXAMPLE.replace("# period", "period").replace("# effects", "effects").replace("# scale", "scale")
STUDIES = [EXAMPLE, _ALL_KEYS.replace("# spread", "spread").replace("# correlation_time", "correlation_time")]
_TOML = ["nan", "-inf", "1e18", "-1", "0", "[]", "{}", "[[]]", '""', "true", "1979-05-27", "0x7fffffffffffffffffff",
         "9" * 4400, "[1, 1]", '["staircase"]', "{ a.b = 1 }", '{ slope = [0.5, 2], motor_lag = [1, 2] }', "1e308",
         '"""a"""', "[nan]", '["none", "none"]', "5e-324", '"published"', "[" * 500, "{a=" * 200]  # fmt: skip


@st.composite
def studies(draw: Any) -> bytes:
    """Files that may be studies: the value of a key replaced, or the text mutated."""
    text = draw(st.sampled_from(STUDIES))
    for _ in range(draw(st.integers(0, 2))):
        lines = text.split("\n")
        given = [k for k, line in enumerate(lines) if "=" in line]
        place = draw(st.sampled_from(given))
        lines[place] = f"{lines[place].split('=')[0]}= {draw(st.sampled_from(_TOML))}"
        text = "\n".join(lines)
    return draw(mutated([text])) if draw(st.booleans()) else text.encode()


_NUMBERS = [
    "nan",
    "inf",
    "-inf",
    "1e999",
    "0",
    "-1",
    "1",
    "0.1",
    "9" * 25,
    "",
    "1,2",
    "x",
    "1e-320",
    "18446744073709551616",
]
_OPTIONS = {
    "identify": ["--setup-time", "--forgetting", "--d-max", "--bootstrap", "--seed", "--method", "--noise-law"],
    "predict": ["--horizon", "--burn-in", "--stride", "--from", "--to", "--session-time"],
    "diagnose": ["--horizon", "--seed", "--sim", "--model"],
    "simulate": ["--samples", "--amplitude", "--hold", "--noise", "--seed", "--effect", "--excitation", "--inputs"],
    "plan": ["--between", "--samples", "--limit", "--seed"],
    "convert": ["--period", "--track", "--pose-offset", "--hold-timeout", "--commands", "--poses"],
    "sweep": ["--scheduler", "--trial", "--seed", "--example"],
}
"""Options whose values may be wrong; what the commands need besides is missing, so that no work begins."""


@st.composite
def options(draw: Any) -> list[str]:
    """Words of a command line."""
    command = draw(st.sampled_from(sorted(_OPTIONS)))
    words = [
        command,
        *draw(st.lists(st.sampled_from(["no.csv", "no.json", "-x", "--", "\udcff"]), max_size=2)),
    ]
    for name in draw(st.lists(st.sampled_from(_OPTIONS[command]), max_size=4)):
        words += [name, draw(st.sampled_from(_NUMBERS) | st.text("a:=,./<\n\0\x1b'\"", max_size=6))]
    return [*words, "--out", draw(st.sampled_from(["out", "missing/out", "", "."]))] if draw(st.booleans()) else words
