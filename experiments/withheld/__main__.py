"""`python -m experiments.withheld COMMAND`: see README.md here."""

import argparse
import json
import pathlib
import secrets
import tempfile

import jaxident as ji

from .baselines import methods as baselines
from .protocol import seal
from .protocol.collect import collect
from .protocol.diagnose import DEFAULT, diagnose
from .protocol.draw import draw
from .protocol.sets import COUNTS
from .scoring.judge import added, judge


def main() -> None:
    """Read the command line and run one step of the protocol, or all of them."""
    options = _parser().parse_args()
    ji.start_jax()
    options.step(options)


def _draw(options) -> None:
    draw(options.set, options.seed, options.cases, options.answers)


def _seal(options) -> None:
    print(f"{seal.seal(options.answers, options.sealed, options.key)}  sealed in {options.sealed}")


def _diagnose(options) -> None:
    diagnose(options.cases, options.found, options.command, options.jobs)


def _collect(options) -> None:
    collect(options.found, options.out)


def _baselines(options) -> None:
    baselines.run(options.cases, options.found)


def _score(options) -> None:
    """Open the answers, sealed or plain, and judge every method's folder."""
    text = seal.unseal(options.sealed, options.key) if options.sealed else options.answers.read_bytes()
    folders = dict(each.split("=", 1) for each in options.found)
    answers, found = json.loads(text)["cases"], {k: pathlib.Path(v) for k, v in folders.items()}
    if options.partial:
        first = next(iter(found.values()))
        answers = {name: answer for name, answer in answers.items() if (first / name / "process.json").exists()}
    judge(answers, found, options.out, not options.quick, added(answers, options.shares, options.promise))


def _all(options) -> None:
    """Draw, seal, diagnose, run the baselines, unseal, score. The seed, unless given, is drawn and told afterwards."""
    out, seed = options.out, secrets.randbits(62) if options.seed is None else options.seed
    with tempfile.TemporaryDirectory() as hidden:
        answers, key = pathlib.Path(hidden, "answers.json"), out / "key"
        if not (out / "SEAL").exists():
            draw(options.set, seed, out / "cases", answers)
            print(f"sealed: {seal.seal(answers, out, key)}")
    secret = key.read_bytes()  # in the memory of this process alone while the diagnosis runs
    key.unlink()
    try:
        diagnose(out / "cases", out / "diagnosis", options.command, options.jobs)
        baselines.run(out / "cases", out)
    finally:
        key.touch(mode=0o600)
        key.write_bytes(secret)
    found = {"diagnosis": out / "diagnosis"} | {name: out / name for name in baselines.METHODS}
    judge(json.loads(seal.unseal(out, key))["cases"], found, out / "scores", not options.quick)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m experiments.withheld", description=__doc__)
    steps = parser.add_subparsers(dest="name", required=True)
    path = {"type": pathlib.Path}

    def step(name: str, run, text: str, *required: str) -> argparse.ArgumentParser:
        one = steps.add_parser(name, help=text, description=text)
        one.set_defaults(step=run)
        for each in required:
            one.add_argument(f"--{each}", required=True, **path)
        return one

    def runs(one: argparse.ArgumentParser) -> None:
        one.add_argument("--command", default=DEFAULT, help="with {case} and {out} for the folders")
        one.add_argument("--jobs", type=int, default=1, help="cases at the same time")

    one = step("draw", _draw, "draw a set of cases; keep ANSWERS outside CASES", "cases", "answers")
    one.add_argument("--set", nargs="+", choices=COUNTS, required=True)
    one.add_argument("--seed", type=int, required=True)
    step("seal", _seal, "replace ANSWERS by SEALED/SEAL and SEALED/answers.sealed", "answers", "sealed", "key")
    step(
        "collect",
        _collect,
        "OUT/case_NN.json and OUT/table.md of diagnoses whose answers are elsewhere",
        "found",
        "out",
    )
    runs(step("diagnose", _diagnose, "diagnose every case once, each in its own process", "cases", "found"))
    step("baselines", _baselines, "FOUND/METHOD for every baseline", "cases", "found")
    one = step("score", _score, "open the answers and write table and pictures to OUT", "out")
    one.add_argument("--found", nargs="+", required=True, metavar="METHOD=FOLDER")
    one.add_argument("--answers", **path)
    one.add_argument("--sealed", **path)
    one.add_argument("--key", **path)
    one.add_argument("--quick", action="store_true", help="without the shrink on fresh runs")
    one.add_argument("--shares", **path, help="what `shares` wrote for the first method")
    one.add_argument("--promise", **path, help="what `promise` wrote for the first method")
    one.add_argument("--partial", action="store_true", help="leave out cases that the first method has not come to yet")
    one = step("all", _all, "everything in one go; what was drawn or diagnosed in OUT is kept", "out")
    one.add_argument("--set", nargs="+", choices=COUNTS, default=["sealed", "sealed_engine"])
    one.add_argument("--seed", type=int)
    one.add_argument("--quick", action="store_true")
    runs(one)
    return parser


if __name__ == "__main__":
    main()
