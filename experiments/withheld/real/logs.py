"""Logs of the real robots that lie beside the project, as runs."""

import itertools
import pathlib

import numpy as np

import jaxident as ji
from jaxident.files.streams import Commands, Poses, merge, read_commands, read_poses
from jaxident.log import Log

CREATES = [f"create_{k}" for k in range(1, 6)]
CREATE_TRACK, PERIOD, PARTS = 0.258, 0.05, 12
"""Distance of a Create's wheels [m], sample period of its merged log [s], runs into which the log is cut."""


def read_streams(data: pathlib.Path, robot: str) -> tuple[Commands, Poses]:
    """Commands and poses of one Create, each at its own instants."""
    stem = data / "mrclam" / f"D6_R{int(robot.removeprefix('create_'))}"
    return read_commands(f"{stem}_commands.csv.gz"), read_poses(f"{stem}_poses.csv.gz")


def read_robot(data: pathlib.Path, robot: str) -> list[Log]:
    """The runs of one robot: create_1 .. create_5, each log cut into PARTS, or husky, its windows."""
    if robot == "husky":
        return ji.read_log(data / "drive_husky" / "husky.csv.gz").runs()
    log = merge(*read_streams(data, robot), track=CREATE_TRACK, period=PERIOD)
    cuts = np.linspace(0, len(log.t), PARTS + 1).astype(int)
    return [log.rows(first, last) for first, last in itertools.pairwise(cuts)]
