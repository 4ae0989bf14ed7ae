"""Fisher scoring with Levenberg-Marquardt damping for unknowns shared by all runs and start states of each run.

Start states touch their own run alone: they are eliminated run by run (Schur complement), so that the cost grows
linearly with runs. optimistix has no solver for this structure, nor for the curvature of `curvature`.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, RunStates, Unknowns, UnknownsMatrix
from jaxident.estimation.poses.curvature import START_STATES, Local, Point, local_at_best_deviations
from jaxident.estimation.poses.parameters import Law, bounds, is_logarithmic, names
from jaxident.estimation.poses.prior import Prior, prior_terms
from jaxident.estimation.poses.runs import Runs

FIRST_DAMPING, EASE, STIFFEN, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 0.03, 10.0, 1e-12, 1e12
"""The least lies far below the flattest direction of a long run: 1e-6 and 0.1 take 27 steps over 32,000 rows, not 8."""
TOLERANCE = 1e-7
"""Expected fall of -log p below which the search ends: a step of 4e-4 standard deviations."""
KINK_STEP, KINK_TOLERANCE = 1e-2, 1e-4
"""At a kink: steps of dead zones below this many standard deviations fail, and the rest promises less than this."""
DEAD_ZONES = slice(6, 8)
SHORTEST = 0.1
"""Least part of a step that is walked; in traces of six fits most parts were 0.2 to 1, and two came to this one."""
LONGEST_LOG_STEP, LONGEST_SHARE = 1.5, 0.25
"""A step changes a logarithm by at most this much, and a dead zone by this share of its bound."""


class Damping(NamedTuple):
    """Of the dead zones' part of a step, and of all other unknowns', relative to the curvature.

    Alike along a curved valley, apart at a kink: a step of a dead zone across a level of the commands, where the cost
    has one, fails however near the optimum all others are; damped alike they would hardly move while it is shortened.
    """

    dead_zones: Any
    others: Any


class Search(NamedTuple):
    """Where a search stands: its best point, the curvature there, the point to look at next and whether its dead zones
    are held as they were, damping, part of a step that is walked, whole steps that failed one after the other, steps
    taken, whether it has arrived."""

    point: Point
    local: Local
    proposed: Point
    holding: Any
    damping: Any
    length: Any
    failures: Any
    steps: Any
    arrived: Any


def eliminate(local: Local, damping: Damping, held: Array) -> tuple[UnknownsMatrix, Unknowns, Array]:
    """The curvature of the shared unknowns with the start states eliminated, its gradient, and the elimination
    (runs, 5, unknowns + 1); `held` unknowns (unknowns,) stay where they are."""
    free = jnp.where(held, 0.0, 1.0)
    shared = local.shared * free[:, None] * free + jnp.diag(1.0 - free)
    own = jnp.full(len(held), damping.others).at[DEAD_ZONES].set(damping.dead_zones)
    shared = shared + jnp.diag(own * jnp.diagonal(shared))
    diagonal = jnp.diagonal(local.starts, axis1=1, axis2=2)
    largest = jnp.max(diagonal, axis=1, keepdims=True)
    own = damping.others * diagonal + jnp.where(largest > 0.0, 1e-12 * largest, 1.0)  # a run without a pose stays
    starts = local.starts + jax.vmap(jnp.diag)(own)
    between = local.between * free[:, None]
    right = jnp.concatenate([between.transpose(0, 2, 1), local.gradient.starts[:, :, None]], axis=2)
    solved = jnp.linalg.solve(starts, right)
    reduced = jnp.sum(between @ solved, axis=0)
    return shared - reduced[:, :-1], free * local.gradient.shared - reduced[:, -1], solved


def newton(local: Local, damping: Damping, held: Array) -> tuple[Unknowns, RunStates, Array]:
    """The step in the shared unknowns and the start states with some unknowns held, and the fall it promises."""
    shared, gradient, solved = eliminate(local, damping, held)
    step = -jnp.linalg.solve(shared, gradient)
    starts = -(solved[:, :, -1] + solved[:, :, :-1] @ step)
    promised = -0.5 * (jnp.sum(step * local.gradient.shared) + jnp.sum(starts * local.gradient.starts))
    return step, starts, promised


def cut_newton(local: Local, damping: Damping, held: Array, law: Law) -> tuple[Unknowns, RunStates, Array]:
    """The same step with logarithms that would go too far cut, all others best beside these, and what it promises.

    A memory that fades within a row, or no slip at all, bends nothing: its step of 1e13 must not shorten the others'.
    Logarithms are cut one by one or, where two that act alike then lead uphill, by one factor; that promises infinity,
    for it says nothing of how near the minimum is.
    """
    step, _, _ = newton(local, damping, held)
    far = is_logarithmic(law) & (jnp.abs(step) > LONGEST_LOG_STEP)
    whole = jnp.where(far, step, 0.0)
    longest = jnp.maximum(jnp.max(jnp.abs(whole)), LONGEST_LOG_STEP)
    cuts = jnp.stack([jnp.clip(whole, -LONGEST_LOG_STEP, LONGEST_LOG_STEP), whole * (LONGEST_LOG_STEP / longest)])

    def beside(cut: Unknowns) -> tuple[Unknowns, RunStates, Array]:
        starts = local.gradient.starts + jnp.einsum("rns,n->rs", local.between, cut)
        slope = Point(local.gradient.shared + local.shared @ cut, starts)
        rest, starts, promised = newton(local._replace(gradient=slope), damping, held | far)
        return cut + rest, starts, promised - cut @ (local.gradient.shared + 0.5 * local.shared @ cut)

    steps, starts, promised = jax.vmap(beside)(cuts)
    downhill = ~(promised[0] < 0.0)
    return (
        jnp.where(downhill, steps[0], steps[1]),
        jnp.where(downhill, starts[0], starts[1]),
        jnp.where(downhill, promised[0], jnp.inf),
    )


def along_steady_speeds(shared: Unknowns, step: Unknowns) -> Unknowns:
    """A vector (unknowns,) moved by a step. Gains move so that steady speeds, gain over rate, move in a straight line:
    poses tell these best, and a rate that hardly matters would otherwise drag them along."""
    faster = jnp.repeat(step[:2], 2)
    gain = jnp.exp(faster) * (shared[2:6] + step[2:6] - shared[2:6] * faster)
    return (shared + step).at[2:6].set(gain)


def propose(
    search: Search, kinked: Array, law: Law, low: Array, high: Array, held: Array
) -> tuple[Point, Array, Array]:
    """The damped step from a search's point, shortened where it is long and cut at the bounds; whether it holds the
    dead zones, as it does where they seem to be at a kink and the others alone promise something; and whether the
    point is a minimum. `held` unknowns (unknowns,) stay as they are, wherever the bounds are.

    It is one where the whole step promises next to nothing, or at a kink: where a dead zone meets a level of the
    commands the cost has two slopes. Both may point up, so that ever smaller steps of the dead zone fail while all
    other unknowns are at rest.
    """
    point, local, damping = search.point, search.local, search.damping
    slope = local.gradient.shared
    still = held | ((point.shared <= low) & (slope >= 0.0)) | ((point.shared >= high) & (slope <= 0.0))
    both = jnp.stack([still, still.at[DEAD_ZONES].set(True)])
    steps, starts, (promised, rest) = jax.vmap(lambda still: cut_newton(local, damping, still, law))(both)
    holding = kinked & (rest > KINK_TOLERANCE)
    step, starts = (jnp.where(holding, part[1], part[0]) for part in (steps, starts))
    longest = jnp.where(is_logarithmic(law), LONGEST_LOG_STEP, jnp.inf)
    longest = longest.at[DEAD_ZONES].set(LONGEST_SHARE * high[DEAD_ZONES])
    part = jnp.minimum(search.length, jnp.min(longest / jnp.maximum(jnp.abs(step), 1e-300)))
    shared = along_steady_speeds(point.shared, part * step)
    moved = Point(jnp.where(held, point.shared, jnp.clip(shared, low, high)), point.starts + part * starts)
    level = (promised >= 0.0) & (promised < TOLERANCE) & (damping.dead_zones <= FIRST_DAMPING)
    tiny = jnp.abs(steps[0]) * jnp.sqrt(jnp.diagonal(local.shared)) < KINK_STEP
    kink = (rest >= 0.0) & (rest * (1.0 + damping.others) < KINK_TOLERANCE) & jnp.all(tiny[DEAD_ZONES])
    return moved, holding, level | kink


def length_after(search: Search, there: Point, local: Local) -> Array:
    """The part of the next step to walk: expected curvature along the last one over what the gradients at its ends
    tell (Barzilai and Borwein 1988), at most 1.

    Where the law is wrong the likelihood bends more than it is expected to. Whole steps then jump from one side of the
    valley to the other.
    """
    step = jax.tree.map(jnp.subtract, there, search.point)
    slopes = jax.tree.map(jnp.subtract, local.gradient, search.local.gradient)
    told = jnp.sum(step.shared * slopes.shared) + jnp.sum(step.starts * slopes.starts)
    old = search.local
    along = old.shared @ step.shared + 2.0 * jnp.einsum("rns,rs->n", old.between, step.starts)
    expected = step.shared @ along + jnp.einsum("rs,rst,rt->", step.starts, old.starts, step.starts)
    return jnp.where(told > expected, jnp.maximum(expected / told, SHORTEST), 1.0)


def adapt(search: Search, better: Array, easily: Array) -> Search:
    """Less damping of what moved and did `easily`: better, and without a curvature that asks for shorter steps. More of
    what moved and did not do better. A whole step that fails stiffens all; from the second in a row on the dead zones
    alone, for it is they that are at a kink."""
    others, failures = search.damping.others, search.failures
    failed = ~better & ~search.holding
    stiffer = (~better & search.holding) | (failed & (failures == 0))
    others = jnp.maximum(others * jnp.where(easily, EASE, jnp.where(stiffer, STIFFEN, 1.0)), LEAST_DAMPING)
    stays = search.holding | (better & ~easily)
    dead_zones = search.damping.dead_zones * jnp.where(stays, 1.0, jnp.where(better, EASE, STIFFEN))
    failures = jnp.where(search.holding, failures, jnp.where(better, 0, failures + 1))
    return search._replace(damping=Damping(jnp.maximum(dead_zones, others), others), failures=failures)


def with_prior(local: Local, shared: Unknowns, law: Law, prior: Prior, sign: float = 1.0) -> Local:
    """A prior's terms added, or with sign -1 taken away again."""
    value, gradient, curvature = prior_terms(shared, law, prior)
    slope = local.gradient._replace(shared=local.gradient.shared + sign * gradient)
    return local._replace(value=local.value + sign * value, gradient=slope, shared=local.shared + sign * curvature)


def search_from(point: Point, runs: Runs, law: Law, d_max: Array, most: int, prior: Prior) -> Search:
    """Walk downhill from a point until a step promises less than TOLERANCE, at most `most` steps; values and curvatures
    are those of poses and prior. Each whole step that fails halves the part of the next one that is walked, down to
    SHORTEST."""
    nothing_held = jnp.zeros(len(names(law)), bool)

    def body(search: Search) -> Search:
        return advance(search, *local_at_best_deviations(search.proposed, runs, law), law, d_max, prior, nothing_held)

    return jax.lax.while_loop(lambda search: walking(search, most), body, first_search(point, law))


def first_search(point: Point, law: Law) -> Search:
    """A search that is to look at a point first."""
    unknown, count = len(names(law)), len(point.starts)
    shapes = (unknown, unknown), (count, START_STATES, START_STATES), (count, unknown, START_STATES)
    nothing = Local(jnp.asarray(jnp.inf), jax.tree.map(jnp.zeros_like, point), *map(jnp.zeros, shapes))
    damping, no, none = Damping(*jnp.full(2, FIRST_DAMPING)), jnp.asarray(False), jnp.asarray(0)
    return Search(point, nothing, point, no, damping, jnp.asarray(1.0), none, none, no)


def walking(search: Search, most: int) -> Array:
    """Whether a search goes on, for `most` steps in all."""
    return ~search.arrived & (search.steps < most) & (search.damping.others < LARGEST_DAMPING)


def advance(search: Search, there: Point, local: Local, law: Law, d_max: Array, prior: Prior, held: Array) -> Search:
    """One step of a search that has looked at the point it proposed: `there`, with the poses' `local`. `held` unknowns
    (unknowns,) stay as they are."""
    low, high = bounds(law, d_max)
    local = with_prior(local, there.shared, law, prior)
    better = (local.value <= search.local.value) | (search.steps == 0)
    tells = better | search.holding  # a whole step may have failed at a kink, which is no curvature
    half = jnp.maximum(0.5 * search.length, SHORTEST)
    length = jnp.where(tells, length_after(search, there, local), half)
    point, local = jax.tree.map(lambda a, b: jnp.where(better, a, b), (there, local), (search.point, search.local))
    after = adapt(search, better, better & (length == 1.0))._replace(
        point=point, local=local, steps=search.steps + 1, length=length
    )
    kinked = (after.failures > 1) & ~search.holding
    proposed, holding, arrived = propose(after, kinked, law, low, high, held)
    return after._replace(proposed=proposed, holding=holding, arrived=arrived)
