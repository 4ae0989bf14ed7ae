"""A model in the words of a simulator, a controller or a program without this package: one file per target.

`split` tells for each part of a model whether a field of the target carries it, the wrapper around the commands, or
neither; `gap` how many millimetres that costs. `export` calls both and the target's writer. `wheels` finds the robot of
wheels and masses that moves as the model says; `code` turns the laws of effects into lines of Python or C.

Called as a function, `jaxident.export(...)` is `jaxident.export.export.export`: a package and a function of one name
cannot both be an attribute of `jaxident`, so this package is both.
"""

import importlib
import sys
import types
from typing import Any


class _Callable(types.ModuleType):
    def __call__(self, *arguments: Any, **settings: Any) -> Any:
        """`jaxident.export.export.export`, looked up when it is called."""
        return importlib.import_module("jaxident.export.export").export(*arguments, **settings)


sys.modules[__name__].__class__ = _Callable
