"""The two ways in which a command ends badly."""


class InputError(ValueError):
    """What the user gave cannot be used: a file, a line, a key or an option. The program ends with exit code 2."""


class WorkError(RuntimeError):
    """The input was fine and the work failed: no convergence, a damaged store. The program ends with exit code 1."""
