"""Diagnoses of cases whose answers are kept elsewhere, as they came out: one file each and a table."""

import json
import pathlib
import shutil

HEAD = (
    "| case | verdict | named (probability) | alike | site | unexplained | gap refitted / after / floor | "
    "shrink (90 %) |"
)


def collect(found: pathlib.Path, out: pathlib.Path) -> None:
    """OUT/case_NN.json for every FOUND/case_NN/diagnosis.json, and OUT/table.md."""
    out.mkdir(parents=True, exist_ok=True)
    rows = [HEAD, "|---" * 8 + "|"]
    for folder in sorted(each for each in found.iterdir() if each.is_dir()):
        path = folder / "diagnosis.json"
        if not path.exists():
            rows.append(f"| {folder.name} | failed |" + " |" * 6)
            continue
        shutil.copyfile(path, out / f"{folder.name}.json")
        rows.append(_row(folder.name, json.loads(path.read_text())))
    (out / "table.md").write_text("\n".join(rows) + "\n")


def _row(name: str, found: dict) -> str:
    causes = {cause["effect"]: cause for cause in found["causes"]}
    named = ", ".join(f"{effect} ({causes[effect]['probability']:.2f})" for effect in found["selected"])
    alike = ", ".join(sorted({a for effect in found["selected"] for a in causes[effect]["indistinguishable_from"]}))
    sites = found["where"]["site"]
    site = max(sites, key=sites.__getitem__) if max(sites.values()) > 0.5 else ""
    gap, interval = found["gap"], found["gap"]["shrink_interval"]
    levels = " / ".join(f"{gap[key]:.3g}" for key in ("refitted", "after")) + f" / {gap['floor']['value']:.3g}"
    shrink = "" if interval is None else f"{gap['shrink']:.2f} ({interval[0]:.2f} to {interval[1]:.2f})"
    rest = f"{found['probability']['unexplained']:.2f}"
    return f"| {name} | {found['verdict']} | {named} | {alike} | {site} | {rest} | {levels} | {shrink} |"
