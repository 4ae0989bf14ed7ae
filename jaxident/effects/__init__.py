"""What real robots do that the quasi-linear model leaves out: one file per site, the catalogue, the full simulator."""

from jaxident.effects.catalogue import CATALOGUE, NEUTRAL, ORDER, SITES, by_name, to_vector
from jaxident.effects.full import run_full

__all__ = ["CATALOGUE", "NEUTRAL", "ORDER", "SITES", "by_name", "run_full", "to_vector"]
