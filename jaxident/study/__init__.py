"""Many trials: the paper's experiment, synthetic logs, Monte-Carlo studies.

Called as a function, `jaxident.study(...)` runs a study: see `jaxident.files.sweeps.study`. A package and a function
of one name cannot both be an attribute of `jaxident`, so this package is both.
"""

import importlib
import sys
import types
from typing import Any


class _Callable(types.ModuleType):
    def __call__(self, *arguments: Any, **settings: Any) -> Any:
        """`jaxident.files.sweeps.study`, looked up when it is called: it lives floors above."""
        return importlib.import_module("jaxident.files.sweeps").study(*arguments, **settings)


sys.modules[__name__].__class__ = _Callable
