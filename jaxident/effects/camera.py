"""Between the robot's pose and the reported one: first the optics, then the camera's white error, then the errors of
single frames."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose
from jaxident.effects import statements
from jaxident.effects.effect import (
    ALONG,
    BOTH,
    EVERYWHERE,
    LATERAL,
    Chance,
    Coordinate,
    EffectRecord,
    Parameter,
    Search,
    Suggested,
    Transform,
    positive,
    signed,
)
from jaxident.numerics import safe_divide, sin_cos
from jaxident.robot.noise import correlated

CENTRAL = 0.01
"""Strength [1/m^2] of a lens whose centre is looked for."""


def camera_latency(time: Array, _: Array, delay: Array) -> Array:
    """t + T: poses that come T late are those of a robot at rest before, whose commands come T late."""
    return time + delay


def marker_offset(pose: Pose, ahead: Array, left: Array) -> Pose:
    """The pose of a marker that sits ahead and to the left of the axle's centre [m]."""
    sine, cosine = sin_cos(pose.theta)
    return Pose(pose.x + ahead * cosine - left * sine, pose.y + ahead * sine + left * cosine, pose.theta)


def heading_offset(pose: Pose, offset: Array) -> Pose:
    """A marker turned by `offset` [rad]."""
    return pose._replace(theta=pose.theta + offset)


def lens_distortion(pose: Pose, strength: Array, centre_x: Array, centre_y: Array, edge: Array) -> Pose:
    """p -> c + (p - c) (1 + k r^2 (1 + e r^2)), r = |p - c|: the first two radial terms of Brown 1966, k and k e."""
    dx, dy = pose.x - centre_x, pose.y - centre_y
    square = dx * dx + dy * dy
    stretch = strength * square * (1.0 + edge * square)
    return pose._replace(x=pose.x + stretch * dx, y=pose.y + stretch * dy)


def lens_by_pulls(pose: Pose, strength: Array, pull_x: Array, pull_y: Array, edge: Array) -> Pose:
    """`lens_distortion` by the products of strength and centre: of strength and centre many pairs bend the field nearly
    alike, of these numbers few."""
    x, y = (safe_divide(pull, strength, 0.0) for pull in (pull_x, pull_y))
    return lens_distortion(pose, strength, x, y, edge)


def _to_lens(coordinates) -> dict[str, float]:
    strength = float(coordinates["strength"])
    x, y = (float(coordinates[key]) / strength if strength else 0.0 for key in ("pull_x", "pull_y"))
    return {"strength": strength, "centre_x": x, "centre_y": y, "edge": float(coordinates["edge"])}


def _from_lens(parameters) -> dict[str, float]:
    strength = parameters["strength"]
    pulls = (strength * parameters.get(key, 0.0) for key in ("centre_x", "centre_y"))
    named = dict(zip(("pull_x", "pull_y"), pulls, strict=True))
    return {"strength": strength, **named, "edge": parameters.get("edge", 0.0)}


def camera_tilt(pose: Pose, along_x: Array, along_y: Array) -> Pose:
    """p -> p / (1 + a x + b y): the plane seen at a slant, without its affine part."""
    depth = 1.0 + along_x * pose.x + along_y * pose.y
    return pose._replace(x=pose.x / depth, y=pose.y / depth)


def camera_scale(pose: Pose, difference: Array) -> Pose:
    """x (1 + d / 2), y (1 - d / 2): an isotropic scale would be a parameter, not a gap."""
    return pose._replace(x=pose.x * (1.0 + 0.5 * difference), y=pose.y * (1.0 - 0.5 * difference))


def coloured_noise(pose: Pose, step: Array, keys, position: Array, heading: Array, correlation_time: Array) -> Pose:
    """Adds an error that is correlated in time (`robot.noise.correlated`), of these standard deviations."""
    draws = jax.random.normal(keys[0], (3, len(pose.x)))
    error = Pose(*(correlated(draw, step, correlation_time) for draw in draws))
    return _with_error(pose, error, position, heading)


def _with_error(pose: Pose, error: Pose, position: Array, heading: Array) -> Pose:
    return Pose(pose.x + position * error.x, pose.y + position * error.y, pose.theta + heading * error.theta)


def outliers(pose: Pose, _: Array, keys, probability: Array, position: Array, heading: Array) -> Pose:
    """With a probability each pose has an error of these sizes times normal draws."""
    chance, error = _chances(keys[0], len(pose.x))[0], Pose(*jax.random.normal(keys[1], (3, len(pose.x))))
    hit = jnp.where(chance < probability, 1.0, 0.0)
    return _with_error(pose, error, hit * position, hit * heading)


def outlier_squares(late, probability: Array, position: Array, heading: Array) -> Array:
    """Expected squares of `outliers`; `late` tells the shape."""
    sizes = jnp.array([position, position, heading])
    return jnp.broadcast_to(probability * sizes**2, jnp.shape(late[0]))


def frozen_frames(pose: Pose, _: Array, keys, probability: Array) -> Pose:
    """With a probability the pose of the frame before, which may itself be frozen."""
    chance = _chances(keys[0], len(pose.x))[1]
    rows = jnp.arange(len(chance))
    source = jax.lax.cummax(jnp.where(chance < probability, 0, rows))
    return Pose(*(column[source] for column in pose))


def frozen_squares(late, probability: Array) -> Array:
    """Expected squares of `frozen_frames`: a pose is k frames late with probability (1 - p) p^k."""
    p = probability
    return sum((1.0 - p) * p**k * part**2 for k, part in enumerate(late, start=1))


def _chances(key, count: int) -> Array:
    """Uniform draws (2, count) for outliers and for repeats."""
    return jax.random.uniform(key, (2, count))


RECORDS = (
    EffectRecord(
        name="marker_offset", site="camera", stage="optics", step=statements.MARKER, quantity="marker place",
        words="the tracked marker is not on the axle's centre",
        equation="[x, y] += R(theta) [a, b]",
        source="rigid body kinematics; Borenstein, Everett, Feng 1996",
        parameters=(Parameter("ahead", "m", 0.0, (-0.1, 0.1), 0.02), Parameter("left", "m", 0.0, (-0.1, 0.1), 0.01)),
        channels=(ALONG, LATERAL),
        act=marker_offset, rank=-2, confused_with=("lateral_slip",),
        search=Search((signed("ahead", 0.3), signed("left", 0.3, silent=True, unseen=True))),
    ),
    EffectRecord(
        name="heading_offset", site="camera", stage="optics", step=statements.TURNED, quantity="marker turn",
        words="the reported heading is off by a constant",
        equation="theta += c",
        source="mounting of the marker; Censi et al. 2013, IEEE TRO 29",
        parameters=(Parameter("offset", "rad", 0.0, (-0.2, 0.2), 0.05),), channels=(LATERAL,),
        act=heading_offset, rank=-2,
        search=Search((signed("offset", 0.6),)),
    ),
    EffectRecord(
        name="camera_scale", site="camera", stage="optics", step=statements.SCALE,
        words="the camera scales x and y differently",
        equation="x (1 + d / 2), y (1 - d / 2)",
        source="non-square pixels; Hartley, Zisserman 2004, ch. 6",
        parameters=(Parameter("difference", "", 0.0, (-0.1, 0.1), 0.04, least=-2.0, most=2.0),),
        channels=(ALONG, LATERAL),
        act=camera_scale, rank=1, confused_with=("lens_distortion",),
        search=Search((signed("difference", 0.4),)),
    ),
    EffectRecord(
        name="lens_distortion", site="camera", stage="optics", step=statements.LENS,
        words="the camera's lens bends the picture",
        equation="p -> c + (p - c) (1 + k r^2 (1 + e r^2)), r = |p - c|",
        source="Brown 1966, Decentering distortion of lenses, Photogrammetric Engineering 32",
        parameters=(Parameter("strength", "1/m^2", 0.0, (-0.1, 0.1), 0.05),
                    Parameter("centre_x", "m", 0.0, (-3.0, 3.0), 0.0, shape=True),
                    Parameter("centre_y", "m", 0.0, (-3.0, 3.0), 0.0, shape=True),
                    Parameter("edge", "1/m^2", 0.0, (-1.0, 10.0), 0.0, shape=True)),
        channels=(ALONG, LATERAL),
        act=lens_distortion, fast=lens_by_pulls, rank=-1, confused_with=("camera_scale",),
        search=Search((signed("strength", 2.0), Coordinate("pull_x", 0.0, -5.0, 5.0, 0.1, silent=True),
                       Coordinate("pull_y", 0.0, -5.0, 5.0, 0.1, silent=True),
                       Coordinate("edge", 0.0, -5.0, 25.0, 1.0, shape=True)), Transform(_to_lens, _from_lens),
                      suggested=Suggested("places", lambda x, y: {
                          "strength": CENTRAL, "pull_x": CENTRAL * x, "pull_y": CENTRAL * y})),
    ),
    EffectRecord(
        name="coloured_noise", site="camera", stage="frames",
        words="the camera's errors persist from frame to frame",
        equation="error e_k = r e_{k-1} + sqrt(1 - r^2) draw, r = exp(-h / tau)",
        source="Box, Jenkins 1970, Time Series Analysis, ch. 3",
        parameters=(Parameter("position", "m", 0.0, (0.0, 0.01), 0.002, least=0.0),
                    Parameter("heading", "rad", 0.0, (0.0, 0.05), 0.01, least=0.0),
                    Parameter("correlation_time", "s", 0.5, (0.05, 5.0), 0.5, least=0.0, above=True, shape=True)),
        channels=EVERYWHERE,
        act=coloured_noise,
        chance=Chance("memory", keys=(1,)),
    ),
    EffectRecord(
        name="outliers", site="camera", stage="frames",
        words="single poses are far off",
        equation="pose += draw with probability p",
        source="Huber 1964, Robust estimation, Ann. Math. Statist. 35 (contamination)",
        parameters=(Parameter("probability", "", 0.0, (0.0, 0.05), 0.02, least=0.0, most=1.0),
                    Parameter("position", "m", 0.05, (0.01, 0.5), 0.05, least=0.0, shape=True),
                    Parameter("heading", "rad", 0.2, (0.05, 3.0), 0.2, least=0.0, shape=True)),
        channels=EVERYWHERE,
        act=outliers, smooth=False, grid=(0.002, 0.005, 0.01, 0.02, 0.05),
        chance=Chance("outlier", (2, 3), outlier_squares),
    ),
    EffectRecord(
        name="frozen_frames", site="camera", stage="frames",
        words="the camera repeats old poses",
        equation="pose_k = pose_{k-1} with probability p",
        source="trackers that repeat the last frame when they are late",
        parameters=(Parameter("probability", "", 0.0, (0.0, 0.1), 0.05, least=0.0, most=1.0),), channels=EVERYWHERE,
        act=frozen_frames, smooth=False, grid=(0.005, 0.01, 0.02, 0.05, 0.1),
        chance=Chance("repeat", (2,), frozen_squares),
    ),
    EffectRecord(
        name="camera_tilt", site="camera", stage="optics", step=statements.TILT,
        words="the camera looks at the floor aslant",
        equation="p -> p / (1 + a x + b y)",
        source="Hartley, Zisserman 2004, Multiple View Geometry, ch. 2 (homography)",
        parameters=(Parameter("along_x", "1/m", 0.0, (-0.1, 0.1), 0.03),
                    Parameter("along_y", "1/m", 0.0, (-0.1, 0.1), 0.02)),
        channels=(ALONG, LATERAL),
        act=camera_tilt, confused_with=("lens_distortion", "camera_scale"), extension=True,
        search=Search((signed("along_x", 0.4), signed("along_y", 0.4))),
    ),
    EffectRecord(
        name="camera_latency", site="camera", stage="arrival", step=statements.DELAY,
        words="the camera's poses come late, the wheels' speeds do not",
        equation="pose(t) = that of the robot at t - T",
        source="Furgale, Rehder, Siegwart 2013, Unified temporal and spatial calibration, IROS",
        parameters=(Parameter("delay", "s", 0.0, (0.0, 0.3), 0.05, least=0.0),),
        channels=BOTH,
        act=camera_latency, rank=2, confused_with=("transport_delay", "motor_lag"), extension=True, poses_only=True,
        search=Search((positive("delay", 0.5),)),
    ),
)  # fmt: skip
"""The effects of this site."""
