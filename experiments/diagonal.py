"""The paper's robot without coupling, which most experiments identify."""

import dataclasses

import numpy as np

import jaxident as ji
from jaxident.robot.drive import Physical
from jaxident.robot.model import require_physical

PUBLISHED = ji.load_model("published")
DRIVE = Physical(*(np.array(part) for part in require_physical(PUBLISHED)[:2]))
ROBOT = dataclasses.replace(PUBLISHED, dynamics=DRIVE)
PERIOD = float(ROBOT.sample_period)  # [s]
TRUTH = np.concatenate([DRIVE.rate, np.ravel(DRIVE.gain), ROBOT.dead_zone])
"""Eight numbers: two rates [1/s], four gains [m/s^2, m/s^2, rad/s^2, rad/s^2 per unit of command], two dead zones."""
