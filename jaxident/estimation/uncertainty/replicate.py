"""Poses that a fitted robot would have shown under other innovations: what a bootstrap of its likelihood refits."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose, PoseMatrix, PoseRows, PoseVector, State, StateVector
from jaxident.estimation.poses.filter import (
    Belief,
    Entries,
    belief_of,
    entries_of,
    first_belief,
    predict_belief,
    take_in,
)
from jaxident.estimation.poses.parameters import Robot
from jaxident.estimation.poses.runs import Runs
from jaxident.robot.dead_zone import effective_command
from jaxident.robot.drive import Force, force, hold
from jaxident.robot.noise import Noise


def replicate_run(robot: Robot, start: StateVector, run: Runs, normalised: PoseRows) -> Pose:
    """Poses (rows,) of a run (rows,) from its start state (5,) and normalised innovations (3, rows).

    The inverse of `likelihood.innovations`: the innovation form of the filter run forwards (Stoffer and Wall 1991),
    pose = expected pose + L z, L L' the covariance of the innovation. 0 where no pose was seen.
    """
    solution = hold(robot.drive, run.step if jnp.ndim(run.step) == 0 else run.step[:-1])
    even = jnp.ndim(solution.step) == 0
    pull = force(robot.drive, effective_command(run.command, jnp.stack(robot.dead_zone)))

    def show(belief: Entries, z: Array, seen: Array) -> tuple[Entries, Array]:
        pose = jnp.where(seen, _pose(belief_of(belief), z, robot.noise), 0.0)
        return take_in(belief, Pose(*pose), seen, robot.noise)[0], pose

    def body(belief, now):
        pull, own, z, seen = now
        belief, pose = show(belief, z, seen)
        return predict_belief(belief, pull, solution if even else own, robot.noise), pose

    begin = entries_of(first_belief(State(*start), robot.noise))
    pulls = Force(*(part[:-1] for part in pull))
    rows = pulls, None if even else solution, normalised.T[:-1], run.seen[:-1]
    belief, poses = jax.lax.scan(body, begin, rows)
    _, last = show(belief, normalised[:, -1], run.seen[-1])
    return Pose(*jnp.concatenate([poses, last[None]]).T)


def _pose(belief: Belief, z: PoseVector, noise: Noise) -> PoseVector:
    """The pose (3,) whose innovation, over its standard deviations coordinate by coordinate, is z (3,)."""
    mean, covariance = belief.mean[:3], belief.covariance[:3, :3]
    if noise.correlation_time is None:
        covariance = covariance + jnp.diag(jnp.stack([noise.position, noise.position, noise.heading]) ** 2)
    else:
        across = belief.covariance[:3, 5:]
        mean, covariance = mean + belief.mean[5:], covariance + across + across.T + belief.covariance[5:, 5:]
    return mean + _lower(covariance) @ z


def _lower(matrix: PoseMatrix) -> PoseMatrix:
    """The Cholesky factor of a positive definite matrix (3, 3) in plain arithmetic, which maps over trials."""
    columns = []
    for k in range(3):
        column = jnp.where(jnp.arange(3) < k, 0.0, matrix[:, k] / jnp.sqrt(matrix[k, k]))
        matrix = matrix - column[:, None] * column
        columns.append(column)
    return jnp.stack(columns, axis=1)
