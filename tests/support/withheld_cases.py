"""The robot of a drawn case as a model of the package."""

import numpy as np

from jaxident.robot.drive import Physical
from jaxident.robot.model import Effect, Model


def model_of(case, effects=True):
    """With its hidden effects, or as the nominal model would be at best."""
    robot = case["robot"]
    drive = Physical(np.array(robot["rate"]), np.array(robot["gain"]), np.array(robot["coupling"]))
    own = tuple(Effect(e["name"], e["parameters"]) for e in case["effects"]) if effects else ()
    return Model(case["period"], drive, np.array(robot["dead_zone"]), effects=own)
