"""Effects of the catalogue as unknown ones, each left out in turn.

    python -m experiments.withheld.leave_out --cases CASES --answers ANSWERS --out FILE.json

Cases with one hidden effect, diagnosed by a catalogue from which that effect is taken: something should be told as
unexplained, at the right site. Answers must be plain, and the cases of a set to develop on: thresholds may be chosen
here.
"""

import argparse
import json
import pathlib

import jaxident as ji
from jaxident.diagnosis.causes.finding import find_effects
from jaxident.diagnosis.decide import decide
from jaxident.diagnosis.diagnose import believed
from jaxident.diagnosis.posterior import judge
from jaxident.diagnosis.preparation.prepare import prepare
from jaxident.effects import CATALOGUE
from jaxident.effects.coordinates import COORDINATES

from .scoring.intervals import wilson


def main() -> None:
    """Diagnose every such case without its effect in the catalogue; write what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("cases", "answers", "out"):
        parser.add_argument(f"--{name}", required=True, type=pathlib.Path)
    options = parser.parse_args()
    ji.start_jax()
    answers = json.loads(options.answers.read_text())["cases"]
    rows = []
    for name, answer in answers.items():
        hidden = [effect["name"] for effect in answer["effects"]]
        if answer["kind"] == "single" and hidden[0] in COORDINATES:
            rows.append({"case": name, "hidden": hidden[0]} | without(options.cases / name, hidden[0]))
            print(rows[-1], flush=True)
    options.out.write_text(json.dumps(rows, indent=1) + "\n")
    for key in ("unexplained", "site"):
        count = sum(row[key] for row in rows)
        low, high = wilson(count, len(rows))
        print(f"{key}: {count} of {len(rows)} (95 % interval {low:.2f} to {high:.2f})")


def without(case: pathlib.Path, effect: str) -> dict:
    """Verdict, what was named, and whether the most probable site is that of the effect that was left out."""
    logs = [ji.read_log(path) for path in sorted(case.glob("real_*"))]
    prepared, finding = find_effects(prepare(logs, None), without=(effect,))
    (finding, extra, shown, measured), _ = believed(prepared, finding, None, None, 0)
    judgement = judge(finding, measured.gap, extra)
    verdict = decide(prepared, judgement, shown if judgement.none < 0.5 else (), [])
    site = max(judgement.sites, key=judgement.sites.__getitem__)
    right = CATALOGUE[effect].site
    told = verdict in ("partly", "unknown")
    return {"unexplained": told, "verdict": verdict, "named": list(shown), "site": site == right}


if __name__ == "__main__":
    main()
