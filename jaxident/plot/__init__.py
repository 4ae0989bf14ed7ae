"""Pictures of logs, predictions and estimates. They compute nothing: arrays in, the axes drawn on out.

Every picture takes `ax`, or makes one with pyplot where it is left out. `figure` makes axes for a file, off screen, and
`save` writes them; `new_axes` makes axes of the same style that pyplot shows. Names are looked up on first use, so that
matplotlib is loaded only when something is drawn.
"""

import importlib
from typing import Any

_HOMES = {
    "dead_zone": "signals",
    "commands": "signals",
    "increments": "signals",
    "wheel_speeds": "wheels",
    "path": "motion",
    "prediction_error": "motion",
    "stretches": "motion",
    "convergence": "estimates",
    "tracking": "estimates",
    "error_against_noise": "estimates",
    "residuals": "fits",
    "correlation": "fits",
    "effect_signature": "effects",
    "confusion": "diagnosis",
    "waterfall": "account",
    "gap_levels": "diagnosis",
    "gap_map": "diagnosis",
    "ranking": "diagnosis",
    "shrinks": "diagnosis",
    "discovered": "laws",
    "estimate_errors": "studies",
    "error_sizes": "studies",
    "break_down": "studies",
    "heat_map": "studies",
    "error_curves": "studies",
    "error_histogram": "studies",
    "name_matrix": "naming",
    "share_curves": "naming",
    "figure": "style",
    "new_axes": "style",
    "legend_above": "style",
    "image": "output",
    "save": "output",
}

__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"jaxident.plot.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'jaxident.plot' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
