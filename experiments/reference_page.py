"""The page of the documentation that lists every public name of `jaxident`, made from docstrings."""

import importlib
import inspect
import json

import jaxident as ji
from jaxident import _HOMES, _ROOMS, results

GROUPS = {
    "Begin": ("start_jax",),
    "Logs": ("read_log", "write_log", "read_bag", "Log", "make_log"),
    "Models": (
        "load_model",
        "save_model",
        "Model",
        "Physical",
        "Difference",
        "Effect",
        "Noise",
        "to_difference",
        "to_physical",
    ),
    "Simulate": ("simulate", "excite", "EXCITATIONS", "path_length"),
    "Identify and predict": ("identify", "identify_motors", "predict", "cramer_rao", "bootstrap"),
    "Diagnose": ("diagnose", "plan"),
    "Many trials": ("Study", "read_study", "summarise", "naming"),
    "Small types": ("Wheels", "Pose", "State", "Increment", "WheelSensor"),
    "Errors": ("InputError", "WorkError"),
}
"""Public names in the order of the page."""

RESULTS = {"identify": "Identification", "identify_motors": "Motors", "predict": "Prediction", "diagnose": "Diagnosis"}
"""What a function of `entry` returns, from `jaxident.results`."""

ROOMS = {
    "recursive": "One log row at a time: `ji.recursive`",
    "joint_filter": "State and parameters in one filter: `ji.joint_filter`",
    "study": "Studies from Python: `ji.study`",
    "export": "Models for simulators and controllers: `ji.export`",
    "effects": "Effects: `ji.effects`",
    "plot": "Pictures: `ji.plot`",
}
CALLED = {"study": "jaxident.files.sweeps.study", "export": "jaxident.export.export.export"}
"""Rooms that are called like a function, and the function that does the work."""

HEAD = """# Reference

Every public name, from its docstring. `import jaxident as ji`, then `ji.start_jax()` once before the first array.
Wherever a function takes a log, it takes a path, a folder, a data frame, a dict of arrays, or a list of these as well.
"""


def page() -> str:
    """The page as Markdown with directives for mkdocstrings. ValueError where a public name has no place on it."""
    named = {name for names in GROUPS.values() for name in names}
    if odd := named ^ _HOMES.keys() | ROOMS.keys() ^ _ROOMS.keys():
        raise ValueError(f"reference: add to or take from its groups: {', '.join(sorted(odd))}")
    parts = [HEAD, directive("A session", "jaxident.entry")]
    for title, names in GROUPS.items():
        parts.append(f"## {title}\n")
        for name in names:
            parts.append(directive(f"ji.{name}", home(name)))
            if name in RESULTS:
                parts += returned(name)
    for room, title in ROOMS.items():
        parts.append(f"## {title}\n")
        if room in CALLED:
            parts.append(directive(f"ji.{room}", CALLED[room]))
        parts += [directive(f"ji.{room}.{name}", place) for name, place in inside(room)]
    return "\n".join(parts)


def home(name: str) -> str:
    """The full name under which a public name is defined."""
    found = getattr(ji, name)
    found = inspect.unwrap(found) if callable(found) else found
    return f"{getattr(found, '__module__', _HOMES[name])}.{getattr(found, '__qualname__', name)}"


def inside(room: str) -> list[tuple[str, str]]:
    """Public functions and classes of a public module, and where each is defined."""
    module = importlib.import_module(_ROOMS[room])
    names = getattr(module, "__all__", None)
    listed = names or [name for name, found in vars(module).items() if getattr(found, "__module__", "") == _ROOMS[room]]
    found = {name: getattr(module, name) for name in listed if not name.startswith("_")}
    return [(name, f"{it.__module__}.{it.__qualname__}") for name, it in found.items() if hasattr(it, "__qualname__")]


def returned(name: str) -> list[str]:
    """What a function returns: what the result can do, and the fields of the tuple that it is made from."""
    result = RESULTS[name]
    fields = getattr(results, result).__mro__[1]
    return [
        directive(f"What ji.{name} returns", f"jaxident.results.{result}", own(result)),
        directive(f"Its fields: {result}", f"{fields.__module__}.{fields.__qualname__}"),
    ]


def own(name: str) -> list[str]:
    """What a class of results adds to the tuple that it is made from, without what begins with an underscore."""
    found = vars(getattr(results, name))
    return [each for each in (*found.get("__annotations__", ()), *found) if not each.startswith("_")]


def directive(heading: str, place: str, members: bool | list[str] = False) -> str:
    """The lines that mkdocstrings replaces by a docstring."""
    options = {"heading": heading, "toc_label": heading, "members": members}
    return "\n".join([f"::: {place}", "    options:", *(f"      {k}: {json.dumps(v)}" for k, v in options.items()), ""])
