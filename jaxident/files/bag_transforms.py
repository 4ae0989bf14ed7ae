"""The pose of a frame in a bag, from the transforms (tf) that lead to it."""

from array import array
from typing import Any

import numpy as np

from jaxident.columns import heading_of, seconds
from jaxident.errors import InputError
from jaxident.files.messages import Choice, read_links
from jaxident.files.transforms import Chain, Link, Pair, find_chain, follow_chain

STATIC = "tf_static"
"""What the name of a topic ends in whose transforms hold at any time."""
WIDTH = 7
"""Numbers of a transform: place and quaternion."""


def read_pose_of_frame(
    path: Any, reader: Any, topics: list[str], choice: Choice
) -> tuple[np.ndarray, dict[str, np.ndarray], tuple[str, ...]]:
    """Times [s], the columns x, y, theta of the frame choice.frames[1] in choice.frames[0], and a line on how they were
    made. InputError where no chain leads from one to the other, or where it holds for no time."""
    first, last = (frame.lstrip("/") for frame in choice.frames or ("", ""))
    try:
        links = _read_links(reader, topics, choice)
        chain = follow_chain(links, first, last)
        steps = [step.pair for step in find_chain(list(links), first, last)]
    except InputError as error:
        raise InputError(f"{path}: {', '.join(topics)}: {error}") from None
    columns = {"x": chain.x, "y": chain.y, "theta": heading_of(*chain.turn.T)}
    return chain.t, columns, (_told(links, steps, chain, first, last),)


def _read_links(reader: Any, topics: list[str], choice: Choice) -> dict[Pair, Link]:
    """All links of some topics, kept as flat arrays of numbers."""
    stamps: dict[Pair, array] = {}
    values: dict[Pair, array] = {}
    fixed: set[Pair] = set()
    for connection, recorded, raw in reader.messages([c for c in reader.connections if c.topic in topics]):
        for one in read_links(reader.deserialize(raw, connection.msgtype)):
            pair = one.parent, one.child
            if connection.topic.endswith(STATIC):
                fixed.add(pair)
            stamps.setdefault(pair, array("q")).append(one.stamp if one.stamp and not choice.bag_time else recorded)
            values.setdefault(pair, array("d")).extend(one.values)
    return {pair: _link(pair, stamps[pair], values[pair], pair in fixed) for pair in stamps}


def _link(pair: Pair, stamps: array, values: array, fixed: bool) -> Link:
    """One link; of several entries at one time the last counts."""
    t, rows = seconds(np.frombuffer(stamps, np.int64)), np.frombuffer(values).reshape(-1, WIDTH)
    length = np.linalg.norm(rows[:, 3:], axis=1)
    if not (np.isfinite(rows).all() and length.all()):
        raise InputError(f"{pair[0]} -> {pair[1]}: holds a number that is not finite, or (0, 0, 0, 0) as rotation")
    if not fixed:
        check_clock(f"{pair[0]} -> {pair[1]}", t)
    kept = np.append(np.diff(t) > 0.0, True)
    return Link(t[kept], rows[kept, :3], (rows[:, 3:] / length[:, None])[kept], fixed)


def check_clock(place: str, t: np.ndarray) -> None:
    """InputError for a clock that goes back."""
    back = np.flatnonzero(np.diff(t) < 0.0)
    if back.size:
        k = back[0]
        raise InputError(
            f"{place}: the clock goes back from {t[k]:.10g} to {t[k + 1]:.10g} s at message {k + 1}: a simulation that "
            "was reset? Record anew, or cut the bag there; --bag-time takes times from the bag"
        )


def _told(links: dict[Pair, Link], steps: list[Pair], chain: Chain, first: str, last: str) -> str:
    """A line on how the poses were made."""
    named = ", ".join(f"{p} -> {c}{' (static)' if links[p, c].fixed else ''}" for p, c in steps)
    between = [f"{p} -> {c}" for p, c in steps if (p, c) != chain.own and not links[p, c].fixed]
    line = f"{last} in {first} from {named}, at the {len(chain.t)} stamps of {' -> '.join(chain.own)}"
    line += f"; {', '.join(between)} interpolated there" if between else ""
    return line + (
        f"; {chain.left_out} stamps left out, where another transform is not known" if chain.left_out else ""
    )
