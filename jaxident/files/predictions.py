"""Predictions as CSV."""

import numpy as np

from jaxident.estimation.predict import Prediction
from jaxident.files.atomic import Target, writing_text


def write_prediction(prediction: Prediction, path: Target) -> None:
    """Write the columns run,start,step,t,x,y,theta,sd_x,sd_y,sd_theta, whole or not at all."""
    names = [name for name in Prediction._fields if name != "run_up"]
    columns = [np.asarray(getattr(prediction, name)).tolist() for name in names]
    with writing_text(path) as stream:
        stream.write(",".join(names) + "\n")
        stream.writelines(",".join(map(repr, row)) + "\n" for row in zip(*columns, strict=True))
