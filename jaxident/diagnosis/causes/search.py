"""The set of effects with the highest log evidence on a table: greedy forward, backward and by exchange."""

from collections.abc import Collection, Sequence

from jaxident.diagnosis.causes.columns import Table
from jaxident.diagnosis.causes.evidence import Worth, log_evidence, worth

MOST_EFFECTS = 6
"""Effects in a set at most."""
MOST_MOVES = 40
"""Of one search; sets of five were found in six to nine."""


def best_set(table: Table, begin: Sequence[int], without: Collection[str] = ()) -> list[int]:
    """The options chosen, from some others on. Effects in `without` never join. An effect that is worth nothing beside
    the others leaves first; then the best of all joinings and exchanges is taken."""
    chosen, seen = list(begin), {frozenset(begin)}
    for _ in range(MOST_MOVES):
        own = {k: worth(table, chosen, k) for k in chosen}
        weakest = min(own, key=lambda k: own[k].evidence, default=None)
        if weakest is not None and own[weakest].evidence < 0.0:
            chosen.remove(weakest)
            seen.add(frozenset(chosen))
            continue
        better = _best_move(table, chosen, own, without)
        if better is None or frozenset(better) in seen:
            break
        chosen = better
        seen.add(frozenset(chosen))
    return chosen


def _best_move(table: Table, chosen: list[int], own: dict[int, Worth], without: Collection[str]) -> list[int] | None:
    """The set with one option more or one exchanged that is worth most beyond what is chosen; None if nothing is."""
    now, most, best = log_evidence(table, chosen), 0.0, None
    bases = [(None, chosen)] if len(chosen) < MOST_EFFECTS else []
    for old, base in [*bases, *((old, [k for k in chosen if k != old]) for old in chosen)]:
        paid = 0.0 if old is None else own[old].evidence
        for k in joining(table, base, without):
            if k == old:
                continue
            gained = log_evidence(table, [*base, k]) - now
            if gained > most:  # what windows say of it can only be less
                gained = min(gained, worth(table, [*base, k], k).evidence - paid)
            if gained > most:
                most, best = gained, [*base, k]
    return best


def joining(table: Table, chosen: Collection[int], without: Collection[str] = ()) -> list[int]:
    """Options of effects that are not among some chosen, nor in `without`."""
    names = {*table.effects(chosen), *without}
    return [k for k, option in enumerate(table.options) if option.effect not in names]
