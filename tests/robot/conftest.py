"""The published robot, as physical parameters at a period of one sample (paper/NOTES.md, A and B)."""

import jax.numpy as jnp
import pytest

from jaxident.robot.drive import Physical
from jaxident.robot.model import Model


@pytest.fixture(scope="session")
def published() -> Model:
    drive = Physical(
        rate=jnp.array([1.80462e-2, 2.605681e-1]),
        gain=jnp.array([[1.4332e-4, 1.4143e-4], [7.424912e-2, -7.25032e-2]]),
        coupling=jnp.array([-4.56e-6, -9.36313e-2]),
    )
    return Model(1.0, drive, jnp.array([0.25, 0.20]))
