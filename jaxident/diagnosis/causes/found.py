"""Where a search ends."""

from typing import NamedTuple

import numpy as np

from jaxident.diagnosis.causes.discrepancy import Rest
from jaxident.diagnosis.causes.discrepancy_basis import WORTH
from jaxident.diagnosis.causes.settled import Settled
from jaxident.diagnosis.fit.nominal import coasts
from jaxident.diagnosis.fit.refit import Solution
from jaxident.diagnosis.noise.law import Law
from jaxident.diagnosis.preparation.dropped_commands import Lost


class Found(NamedTuple):
    """Where a search ends: as it stands, the noise law, the likeliest law without the terms of `rest`, what is in no
    catalogue, the commands that were lost, None if none, and the fit without effects to the same data."""

    settled: Settled
    law: Law
    likely: Law
    rest: Rest
    lost: Lost | None
    nominal: Solution

    @property
    def worse_than_none(self) -> bool:
        """Whether no effect at all fits better under the same law: the search has lost its way. On a Husky's log it
        ended at a speed that settles in 14 ms."""
        return -self.nominal.cost > self.settled.now.evidence

    @property
    def coasting(self) -> np.ndarray:
        """Which speeds (2,) coast of the robot without effects and of that with them: a robot without its effects may
        seem to for want of these. A speed that settles at 0.54 1/s did, seen by a marker 3 cm off the axle."""
        windows, doubted = self.settled.data.windows, bool(self.rest.terms)
        return coasts(self.nominal, windows, doubted) & coasts(self.settled.now.fit, windows, doubted)

    @property
    def log_evidence(self) -> float:
        """Of effects, terms and noise law together."""
        now = self.settled.now
        return self.rest.log_likelihood + (now.evidence + now.fit.cost) - WORTH * len(self.rest.terms)
