"""Coordinate frames that move in each other (ROS tf): from links between two frames each to the pose of one in another.

A link is the transform T_pc from a child's coordinates to its parent's. Along a chain a - b - ... - z of links
T_az = T_ab T_b. ... T_.z, each link inverted where it is passed from the parent down the other way. Quaternions are
(x, y, z, w) as in ROS.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxident.errors import InputError

Pair = tuple[str, str]


class Link(NamedTuple):
    """A child frame in its parent: times t (n,) [s], rising; place (n, 3) [m]; turn (n, 4), of length 1. fixed: its
    last entry holds at any time."""

    t: Any
    place: Any
    turn: Any
    fixed: bool


class Step(NamedTuple):
    """A link of a chain by its frames, and whether it is passed from the child to the parent."""

    pair: Pair
    inverted: bool


class Chain(NamedTuple):
    """The pose of a frame in another: times t (n,) [s], x, y (n,) [m], turn (n, 4); `own`: the link whose times these
    are; left_out: times of it at which another link is not known."""

    t: Any
    x: Any
    y: Any
    turn: Any
    own: Pair
    left_out: int


def find_chain(pairs: list[Pair], first: str, last: str) -> list[Step]:
    """The shortest chain of links (parent, child) from one frame to another; InputError where there is none, with all
    links that there are."""
    ways: dict[str, list[Step]] = {first: []}
    edge = [first]
    while edge and last not in ways:
        reached = []
        for frame in edge:
            for parent, child in sorted(pairs):
                for begin, end in ((parent, child), (child, parent)):
                    if begin == frame and end not in ways:
                        ways[end] = [*ways[frame], Step((parent, child), begin == child)]
                        reached.append(end)
        edge = reached
    if last not in ways or not ways[last]:
        there = ", ".join(f"{parent} -> {child}" for parent, child in sorted(pairs)) or "none at all"
        raise InputError(f"no chain of transforms leads from {first!r} to {last!r}; there are {there}")
    return ways[last]


def follow_chain(links: Mapping[Pair, Link], first: str, last: str) -> Chain:
    """The pose of the frame `last` in `first`, at the times of the moving link nearest to `last`; links further up are
    interpolated there and never continued beyond their own times. InputError where there is no chain, where nothing in
    it moves, or where its links share no time."""
    steps = find_chain(list(links), first, last)
    moving = [step.pair for step in steps if not links[step.pair].fixed]
    if not moving:
        raise InputError(f"nothing moves between {first!r} and {last!r}: all of its transforms are static")
    t = np.asarray(links[moving[-1]].t)
    known = np.ones(len(t), bool)
    for pair in moving:
        known &= (t >= links[pair].t[0]) & (t <= links[pair].t[-1])
    if not known.any():
        spans = ", ".join(f"{p} -> {c} from {links[p, c].t[0]:.10g} to {links[p, c].t[-1]:.10g} s" for p, c in moving)
        raise InputError(f"the transforms between {first!r} and {last!r} share no time: {spans}")
    t = t[known]
    place, turn = np.zeros((len(t), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(t), 1))
    for step in steps:
        ahead, after = transform_at(links[step.pair], t)
        if step.inverted:
            after = after * np.array([-1.0, -1.0, -1.0, 1.0])
            ahead = -rotate(after, ahead)
        place, turn = place + rotate(turn, ahead), multiply(turn, after)
    return Chain(t, place[:, 0], place[:, 1], turn, moving[-1], int(np.sum(~known)))


def transform_at(link: Link, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place (n, 3) and turn (n, 4) at times within those of the link: linear, and along the shorter arc
    (Shoemake 1985)."""
    place, turn = np.asarray(link.place), np.asarray(link.turn)
    if link.fixed or len(place) == 1:
        return np.tile(place[-1], (len(t), 1)), np.tile(turn[-1], (len(t), 1))
    k = np.clip(np.searchsorted(link.t, t, side="right") - 1, 0, len(place) - 2)
    share = ((t - link.t[k]) / (link.t[k + 1] - link.t[k]))[:, None]
    before, after = turn[k], turn[k + 1]
    dot = np.sum(before * after, axis=1, keepdims=True)
    after, angle = np.where(dot < 0.0, -after, after), np.arccos(np.clip(np.abs(dot), 0.0, 1.0))
    wide = angle > 1e-6
    size = np.where(wide, np.sin(angle), 1.0)
    weights = (np.where(wide, np.sin(angle * part) / size, part) for part in (1.0 - share, share))
    mixed = sum(weight * side for weight, side in zip(weights, (before, after), strict=True))
    return place[k] + share * (place[k + 1] - place[k]), mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def multiply(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The product of quaternions (n, 4): `second` turns first."""
    a, b = first[:, :3], second[:, :3]
    p, q = first[:, 3:], second[:, 3:]
    return np.concatenate([p * b + q * a + np.cross(a, b), p * q - np.sum(a * b, axis=1, keepdims=True)], axis=1)


def rotate(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) turned by unit quaternions (n, 4): v + 2 q x (q x v + w v)."""
    q, w = turn[:, :3], turn[:, 3:]
    return vector + 2.0 * np.cross(q, np.cross(q, vector) + w * vector)
