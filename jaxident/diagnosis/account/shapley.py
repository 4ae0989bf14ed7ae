"""Shares of what several effects do together (Shapley 1953): what each adds, averaged over orders of adding."""

import itertools
from collections.abc import Callable

import numpy as np

from jaxident.array_types import Array

MOST_EXACT = 4
"""Players up to which all orders of joining are followed: 16 models; six would ask for 64."""


def orders_of(players: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Orders in which players join: all of them; of more than MOST_EXACT the rotations of one order and their reverses,
    in which each comes first, last and in between as often as any other."""
    if len(players) <= MOST_EXACT:
        return list(itertools.permutations(players))
    turned = [players[k:] + players[:k] for k in range(len(players))]
    return [*turned, *(order[::-1] for order in turned)]


def joined_by(players: tuple[str, ...]) -> list[frozenset[str]]:
    """All sets of players that come about in these orders, smaller ones first."""
    found = {frozenset(order[:size]) for order in orders_of(players) for size in range(len(players) + 1)}
    return sorted(found, key=lambda joined: (len(joined), sorted(joined)))


def shapley(players: tuple[str, ...], value: Callable[[frozenset[str]], Array]) -> dict[str, np.ndarray]:
    """What each player takes away from `value`, an array for every set of `joined_by`, averaged over orders of
    joining."""
    orders = orders_of(players)
    found = {player: np.zeros(()) for player in players}
    for order in orders:
        for size, player in enumerate(order):
            before, after = value(frozenset(order[:size])), value(frozenset(order[: size + 1]))
            found[player] = found[player] + (before - after) / len(orders)
    return found
