r"""One page for a set of robots of one make: what the diagnosis of each says, side by side.

    python -m experiments.withheld.real.set_page --found experiments/withheld/real/create_*.json \
        --title "Five Creates" --out creates.html

A cause that all robots of a make share should be named on each of them by itself; the page shows whether it is.
"""

import argparse
import json
import pathlib
from collections import Counter

import numpy as np

from jaxident import plot
from jaxident.report.page import Figure, Page, Section, Table, write_page

MODELS = {"refitted": "nominal model", "after": "corrected model"}
LIKELY = 0.05
"""Probability from which an effect is listed under a robot."""


def set_page(found: dict[str, dict], title: str) -> Page:
    """The page of diagnoses (content of diagnosis.json) by the robot's name."""
    sections = [_gap(found), _where(found), _causes(found)]
    return Page(title, lead(found), sections, "Made by experiments/withheld/real/set_page.py")


def lead(found: dict[str, dict]) -> str:
    """How many robots came out as what, and what most of them have in common."""
    verdicts = Counter(each["verdict"] for each in found.values())
    told = ", ".join(f"{count} as {verdict}" for verdict, count in verdicts.most_common())
    named = Counter(effect for each in found.values() for effect in each["selected"])
    if not named:
        return f"Of {len(found)} robots {told}: no effect is named on any."
    effect, count = named.most_common(1)[0]
    return f"Of {len(found)} robots {told}. {effect} is named on {count}."


def _gap(found: dict[str, dict]) -> Section:
    levels = {name: [each["gap"][key] for each in found.values()] for key, name in MODELS.items()}
    floor = [each["gap"]["floor"]["value"] for each in found.values()]
    figure, ax = plot.figure(size=(6.3, 1.2 + 0.4 * len(found)))
    plot.gap_levels(levels, floor, rows=tuple(found), ax=ax)
    rows = [
        (name, *(float(f"{each['gap'][key]:.3g}") for key in MODELS), float(f"{each['gap']['floor']['value']:.3g}"),
         shrink(each["gap"]))
        for name, each in found.items()
    ]  # fmt: skip
    table = Table(("robot", *MODELS.values(), "floor", "shrink (90 % interval)"), rows,
                  "Mean squared errors on stretches that took part in no fit, in camera variances.")  # fmt: skip
    picture = Figure(plot.image(figure), "Errors of the models on each robot", "Black bars: what noise makes.")
    return Section("How large the gap is", [picture, table])


def shrink(gap: dict) -> str:
    """The shrink in words."""
    if gap["shrink"] is None:
        return "none told"
    low, high = (f"{100.0 * end:.0f}" for end in gap["shrink_interval"])
    return f"{100.0 * gap['shrink']:.0f} % ({low} to {high} %)"


def _where(found: dict[str, dict]) -> Section:
    shares: dict[str, dict[str, float]] = {}
    for name, each in found.items():
        for region in each["where"]["regions"]:
            shares.setdefault(region["variable"], {})[name] = region["share"]
    order = sorted(shares, key=lambda variable: -sum(shares[variable].values()))
    channels = [
        (name, *(f"{100.0 * share:.0f} %" for share in each["where"]["excess"].values()), _site(each))
        for name, each in found.items()
    ]
    table = Table(("robot", "along", "lateral", "heading", "most probable site"), channels,
                  "Of the nominal model's error beyond the floor, parameters refitted.")  # fmt: skip
    if not order:
        return Section("Where it lies", [table, "No region stands out on any robot."])
    figure, ax = plot.figure(size=(6.3, 1.2 + 0.24 * len(order)))
    plot.confusion([[shares[v].get(name, 0.0) for name in found] for v in order], order, tuple(found), ax=ax)
    ax.set_xlabel("robot")
    ax.set_ylabel("sorted by")
    caption = (
        "Share of the excess [%] in the region that stands out most, stretches sorted by what the robot did; dark: no "
        "region of this kind stands out."
    )
    return Section("Where it lies", [table, Figure(plot.image(figure), "Regions by robot", caption)])


def _site(found: dict) -> str:
    sites = found["where"]["site"]
    site = max(sites, key=lambda name: sites[name])
    return f"{site} ({sites[site]:.2f})" if sites[site] > 0.0 else ""


def _causes(found: dict[str, dict]) -> Section:
    rows = []
    for name, each in found.items():
        likely = [f"{c['effect']} ({c['probability']:.2f})" for c in each["causes"] if c["probability"] > LIKELY]
        best = max(each["probability"]["sets"], key=lambda one: one["p"], default={"effects": []})["effects"]
        terms = sorted(each["terms"], key=lambda term: -term["gain"])[:2]
        rows.append((
            name, each["verdict"], float(f"{each['probability']['unexplained']:.3f}"), ", ".join(likely),
            ", ".join(best), "; ".join(term["term"] for term in terms),
        ))  # fmt: skip
    heads = ("robot", "verdict", "unexplained", "named or likely", "best known set", "largest of what is left")
    share = np.mean([each["verdict"] in ("partly", "unknown") for each in found.values()])
    text = f"On {100.0 * share:.0f} % of the robots something takes part that no named effect covers."
    return Section("Which cause", [text, Table(heads, rows)])


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--found", type=pathlib.Path, nargs="+", required=True, help="a diagnosis.json per robot")
    parser.add_argument("--title", required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    found = {path.stem: json.loads(path.read_text()) for path in options.found}
    write_page(set_page(found, options.title), options.out)
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
