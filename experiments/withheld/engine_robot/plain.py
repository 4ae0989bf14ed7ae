"""How near is the engine's plain robot to the nominal model?

    python -m experiments.withheld.engine_robot.plain --robots 6 --out plain_engine.json

Plain robots are drawn, driven for six runs of 1000 rows without camera error, and identified with coupling: what is
left over whole runs is all that contact, castors and the engine's steps add, beside the cameras of the sealed cases
(0.2 to 1 mm, and their headings). A gap below a tenth of the camera's error is no gap that one can see.
"""

import argparse
import json
import pathlib

import numpy as np

import jaxident as ji
from jaxident.log import make_log

from ..protocol.cases import plan
from .cases import describe, drive_run


def excess(seed: int) -> dict[str, float]:
    """Root mean square misfit of one plain robot [mm], [mrad], and over its own camera's error."""
    case = describe(seed, [], slip=False, sim=False) | {"noise": None}
    noise = describe(seed, [], slip=False, sim=False)["noise"]
    runs = [make_log(*drive_run(case, run | {"effects": {}}).T) for run in plan(case)]
    found = ji.identify(runs, coupling=True, noise_law="white")
    misfit = [float(np.sqrt(np.nanmean(np.square(column)))) for column in found.residuals]
    position, heading = max(misfit[:2]), misfit[2]
    return {
        "position_mm": 1e3 * position,
        "heading_mrad": 1e3 * heading,
        "position_over_camera": position / float(noise["position"]),
        "heading_over_camera": heading / float(noise["heading"]),
    }


def main() -> None:
    """Draw, identify, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=6)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    rows = []
    for seed in range(options.robots):
        rows.append(excess(seed))
        print({key: round(value, 3) for key, value in rows[-1].items()}, flush=True)
    options.out.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    ji.start_jax()
    main()
