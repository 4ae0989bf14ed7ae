"""Kinds of options that `jaxident convert` alone has."""

import click

from jaxident.cli.session import Number


class OffsetOption(Number):
    """A time in seconds, or `auto`."""

    name = "S|auto"

    def convert(self, value, param, ctx):
        """The time, or the word `auto`."""
        if value == "auto":
            return value
        try:
            return super().convert(float(value), param, ctx)
        except ValueError:
            self.fail(f"{value!r} is neither a time in seconds nor auto", param, ctx)


class PairOption(click.ParamType):
    """Two different words."""

    def __init__(self, name: str, wanted: str) -> None:
        self.name, self.wanted = name, wanted

    def convert(self, value, param, ctx):
        """Both words."""
        words = tuple(word.strip() for word in value.split(",")) if isinstance(value, str) else value
        if len(words) != 2 or not all(words) or words[0] == words[1]:
            self.fail(f"{value!r} should be two {self.wanted}", param, ctx)
        return words


ORDER = PairOption("RIGHT,LEFT", "indices or joint names, the right wheel first, as in 1,0")
FRAMES = PairOption("FIXED,ROBOT", "frames, the robot's last, as in map,base_link")
