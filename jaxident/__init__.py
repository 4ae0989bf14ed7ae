"""jaxident: identification of differential-drive robots from motor commands and camera poses.

    import jaxident as ji
    ji.start_jax()
    found = ji.identify(ji.read_log("log.csv"))

Names are looked up on first use, so that importing the package stays light.
"""

import importlib
from typing import Any

__version__ = "0.2.0"

_HOMES = {
    "Log": "jaxident.log",
    "make_log": "jaxident.log",
    "Wheels": "jaxident.array_types",
    "Pose": "jaxident.array_types",
    "start_jax": "jaxident.start",
    "State": "jaxident.array_types",
    "Increment": "jaxident.array_types",
    "InputError": "jaxident.errors",
    "WorkError": "jaxident.errors",
    "Model": "jaxident.robot.model",
    "Physical": "jaxident.robot.drive",
    "Difference": "jaxident.robot.difference",
    "Effect": "jaxident.robot.model",
    "Noise": "jaxident.robot.noise",
    "to_difference": "jaxident.robot.difference",
    "to_physical": "jaxident.robot.difference",
    "simulate": "jaxident.entry",
    "path_length": "jaxident.robot.path_length",
    "EXCITATIONS": "jaxident.robot.excitation",
    "excite": "jaxident.study.synthetic",
    "identify": "jaxident.entry",
    "diagnose": "jaxident.entry",
    "bootstrap": "jaxident.entry",
    "identify_motors": "jaxident.entry",
    "WheelSensor": "jaxident.robot.wheel_sensor",
    "plan": "jaxident.diagnosis.planning.next_run",
    "cramer_rao": "jaxident.entry",
    "predict": "jaxident.entry",
    "read_log": "jaxident.files.logs",
    "write_log": "jaxident.files.logs",
    "read_bag": "jaxident.files.bags",
    "load_model": "jaxident.files.models",
    "save_model": "jaxident.files.models",
    "read_study": "jaxident.files.studies",
    "summarise": "jaxident.study.statistics",
    "naming": "jaxident.study.naming",
    "Study": "jaxident.study.design",
}
_ROOMS = {
    "recursive": "jaxident.estimation.increments.recursive",
    "joint_filter": "jaxident.estimation.online.joint_filter",
    "effects": "jaxident.effects",
    "study": "jaxident.study",
    "export": "jaxident.export",
    "plot": "jaxident.plot",
}

__all__ = ["__version__", *_HOMES, *_ROOMS]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    if name in _ROOMS:
        return importlib.import_module(_ROOMS[name])
    raise AttributeError(f"module 'jaxident' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
