"""The functions of the floors below as users call them: where they take a log, they take whatever may stand for one.

A robot with camera noise, its log, its model, and how well that model predicts:

    >>> import dataclasses, jax
    >>> import jaxident as ji
    >>> ji.start_jax()
    >>> robot = dataclasses.replace(ji.load_model("published"), noise=ji.Noise(position=5e-4, heading=5e-3))
    >>> inputs = ji.excite(jax.random.key(0), "multilevel", 600, robot.sample_period)
    >>> log = ji.simulate(robot, inputs, key=jax.random.key(1))
    >>> found = ji.identify(log, noise_law="white", coupling=True)
    >>> print(found)
    identified from 600 poses in 1 runs: 11 determined, 1 not determined
    rate_1 ...
    >>> prediction = ji.predict(found.model, log, horizon=30)
    >>> print(prediction)
    19 free runs of 1 s, 19 end at a measured pose
    error there: 1.1 mm and ... mrad root mean square, ...

What the model misses takes a minute, and several runs:

    >>> gap = ji.diagnose("logs")  # doctest: +SKIP
    >>> gap.report("diagnosis.html")  # doctest: +SKIP
"""

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from jaxident import results
from jaxident.diagnosis import diagnose as diagnosing
from jaxident.effects import simulate as simulating
from jaxident.estimation import bootstrap as resampling
from jaxident.estimation import identify as identifying
from jaxident.estimation import identify_motors as motors
from jaxident.estimation import predict as predicting
from jaxident.estimation.uncertainty import precision
from jaxident.files.any_log import as_log, as_logs
from jaxident.progress import UNSEEN, working

Function = TypeVar("Function", bound=Callable)


def taking(
    doing: str, function: Function, then: Callable[..., Any] | None = None, **readers: Callable[[Any], Any]
) -> Function:
    """The function, some of its arguments read first by `readers`; None stays None. `then` makes a result of what it
    returns and of these arguments. `doing`: what a notebook shows while it runs."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        bound = signature.bind(*args, **kwargs)
        for name, read in readers.items():
            if bound.arguments.get(name) is not None:
                bound.arguments[name] = read(bound.arguments[name])
        with working(doing, UNSEEN):
            found = function(*bound.args, **bound.kwargs)
        return found if then is None else then(found, *(bound.arguments.get(name) for name in readers))

    return call  # type: ignore[return-value]


identify = taking("identifying", identifying.identify, results.identified, logs=as_logs)
identify_motors = taking("identifying", motors.identify_motors, results.motors, logs=as_logs)
diagnose = taking("diagnosing", diagnosing.diagnose, results.diagnosed, logs=as_logs, sim=as_logs)
bootstrap = taking("refitting", resampling.bootstrap, logs=as_logs)
predict = taking("predicting", predicting.predict, results.predicted, log=as_log)
simulate = taking("simulating", simulating.simulate, log=as_log)
cramer_rao = taking("computing the bound", precision.cramer_rao, inputs=as_logs)
