"""What real robots do that the quasi-linear model leaves out: one record per effect, and two integrators over stages.

`effect` is the record and says how to add one. `signals` is what passes between stages, `stages` their order.
Records by site: `actuation` (with laws in `commands`, `motors` and `gears`), `drive`, `contact`, `session`, `camera`;
`catalogue` gathers them, `coordinates` is what a diagnosis searches of them. Laws in no catalogue: `law_kinds` says
what they may act and depend on, `past` computes what commands leave behind, `discovered` runs them. The full integrator
is `full` with `intervals`, `input_chain`, `substep` and `friction`; the fast one `fast_input` and `fast_motion`.
"""

from jaxident.effects.catalogue import CATALOGUE, NEUTRAL, ORDER, SITES, by_name, to_vector
from jaxident.effects.full import run_full

__all__ = ["CATALOGUE", "NEUTRAL", "ORDER", "SITES", "by_name", "run_full", "to_vector"]
