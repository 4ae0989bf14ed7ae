"""The section `provenance` of a model file."""

from typing import Any

from jaxident.errors import InputError
from jaxident.files.origins import KEYS, origin_from_dict, origin_to_dict
from jaxident.files.schema import take_keys, take_list, take_number, take_text
from jaxident.robot.model import Provenance

_OWN = tuple(name for name in Provenance._fields if name != "origin")


def read_provenance(value: Any, where: str) -> Provenance:
    """Version and method, the logs, the seed or None, the session (its duration and the runs that are known), which
    parameters come from the prior or stand at a bound, and the command that wrote the model, where one did."""
    found = take_keys(value, where, (), (*_OWN, *KEYS))
    version, method = (take_text(found[key] or "", f"{where}.{key}") for key in ("version", "method"))
    logs = take_list(found["logs"] or [], f"{where}.logs")
    seed = found["seed"]
    if seed is not None and type(seed) is not int:
        raise InputError(f"{where}.seed: should be an integer or null")
    names = tuple(take_text(log, f"{where}.logs[{k}]") for k, log in enumerate(logs))
    duration = take_number(found["duration"] or 0.0, f"{where}.duration", least=0.0)
    runs = [
        _read_run(run, f"{where}.runs[{k}]") for k, run in enumerate(take_list(found["runs"] or [], f"{where}.runs"))
    ]
    borrowed, bounded = (_read_names(found[key], f"{where}.{key}") for key in ("from_prior", "at_bound"))
    origin = None if found["command"] is None else origin_from_dict(value, where)
    return Provenance(version, method, names, seed, duration, tuple(runs), borrowed, bounded, origin)


def _read_names(value: Any, where: str) -> tuple[str, ...]:
    """A list of names; none where nothing is given."""
    return tuple(take_text(name, f"{where}[{k}]") for k, name in enumerate(take_list(value or [], where)))


def _read_run(value: Any, where: str) -> tuple[str, float]:
    found = take_keys(value, where, ("mark", "session_time"), ())
    return take_text(found["mark"], f"{where}.mark"), take_number(
        found["session_time"], f"{where}.session_time", least=0.0
    )


def write_provenance(origin: Provenance) -> dict[str, Any]:
    """Where the model comes from; the session where it is known, the command where there was one."""
    content = {key: getattr(origin, key) for key in _OWN} | {"logs": list(origin.logs)}
    content["runs"] = [{"mark": own, "session_time": time} for own, time in origin.runs]
    if not origin.runs:
        del content["runs"], content["duration"]
    for key in ("from_prior", "at_bound"):
        content[key] = list(content[key])
        if not content[key]:
            del content[key]
    return content | ({} if origin.origin is None else origin_to_dict(origin.origin))
