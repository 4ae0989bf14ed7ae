"""Between the robot's pose and the reported one, in this order: marker_offset, heading_offset, lens_distortion,
camera_tilt, camera_scale, white error, coloured_noise, outliers, frozen_frames."""

import jax
import jax.numpy as jnp

from jaxident.array_types import Array, Pose
from jaxident.effects.entry import ALONG, EVERYWHERE, LATERAL, Entry, Parameter
from jaxident.numerics import sin_cos


def marker_offset(pose: Pose, ahead: Array, left: Array) -> Pose:
    """The pose of a marker that sits ahead and to the left of the axle's centre [m]."""
    sine, cosine = sin_cos(pose.theta)
    return Pose(pose.x + ahead * cosine - left * sine, pose.y + ahead * sine + left * cosine, pose.theta)


def heading_offset(pose: Pose, offset: Array) -> Pose:
    """A marker turned by `offset` [rad]."""
    return pose._replace(theta=pose.theta + offset)


def lens_distortion(pose: Pose, strength: Array, centre_x: Array, centre_y: Array) -> Pose:
    """p -> c + (p - c) (1 + k |p - c|^2), Brown 1966's first radial term."""
    dx, dy = pose.x - centre_x, pose.y - centre_y
    stretch = strength * (dx * dx + dy * dy)
    return pose._replace(x=pose.x + stretch * dx, y=pose.y + stretch * dy)


def camera_tilt(pose: Pose, along_x: Array, along_y: Array) -> Pose:
    """p -> p / (1 + a x + b y): the plane seen at a slant, without its affine part."""
    depth = 1.0 + along_x * pose.x + along_y * pose.y
    return pose._replace(x=pose.x / depth, y=pose.y / depth)


def camera_scale(pose: Pose, difference: Array) -> Pose:
    """x (1 + d / 2), y (1 - d / 2): an isotropic scale would be a parameter, not a gap."""
    return pose._replace(x=pose.x * (1.0 + 0.5 * difference), y=pose.y * (1.0 - 0.5 * difference))


def coloured_noise(pose: Pose, error: Pose, position: Array, heading: Array) -> Pose:
    """Adds an error of unit variance, correlated in time (`robot.noise.correlated`), times its standard deviations."""
    return Pose(pose.x + position * error.x, pose.y + position * error.y, pose.theta + heading * error.theta)


def outliers(pose: Pose, chance: Array, error: Pose, probability: Array, position: Array, heading: Array) -> Pose:
    """Where chance, uniform in [0, 1), is below the probability: an error of these sizes times normal draws."""
    hit = jnp.where(chance < probability, 1.0, 0.0)
    return coloured_noise(pose, error, hit * position, hit * heading)


def frozen_frames(pose: Pose, chance: Array, probability: Array) -> Pose:
    """Where chance is below the probability, the pose of the frame before, which may itself be frozen."""
    rows = jnp.arange(len(chance))
    source = jax.lax.cummax(jnp.where(chance < probability, 0, rows))
    return Pose(*(column[source] for column in pose))


def _row(name, equation, parameters, channels, confused_with, source, **more) -> Entry:
    return Entry(name, "camera", equation, parameters, channels, confused_with, source, **more)


ENTRIES = (
    _row("marker_offset", "[x, y] += R(theta) [a, b]",
         (Parameter("ahead", "m", 0.0, (-0.1, 0.1), 0.02), Parameter("left", "m", 0.0, (-0.1, 0.1), 0.01)),
         (ALONG, LATERAL), ("lateral_slip",), "rigid body kinematics; Borenstein, Everett, Feng 1996"),
    _row("heading_offset", "theta += c", (Parameter("offset", "rad", 0.0, (-0.2, 0.2), 0.05),), (LATERAL,), (),
         "mounting of the marker; Censi et al. 2013, IEEE TRO 29"),
    _row("camera_scale", "x (1 + d / 2), y (1 - d / 2)",
         (Parameter("difference", "", 0.0, (-0.1, 0.1), 0.04, least=-2.0, most=2.0),), (ALONG, LATERAL),
         ("lens_distortion",), "non-square pixels; Hartley, Zisserman 2004, ch. 6"),
    _row("lens_distortion", "p -> c + (p - c) (1 + k |p - c|^2)",
         (Parameter("strength", "1/m^2", 0.0, (-0.1, 0.1), 0.05),
          Parameter("centre_x", "m", 0.0, (-3.0, 3.0), 0.0, shape=True),
          Parameter("centre_y", "m", 0.0, (-3.0, 3.0), 0.0, shape=True)), (ALONG, LATERAL), ("camera_scale",),
         "Brown 1966, Decentering distortion of lenses, Photogrammetric Engineering 32"),
    _row("coloured_noise", "error e_k = r e_{k-1} + sqrt(1 - r^2) draw, r = exp(-h / tau)",
         (Parameter("position", "m", 0.0, (0.0, 0.01), 0.002, least=0.0),
          Parameter("heading", "rad", 0.0, (0.0, 0.05), 0.01, least=0.0),
          Parameter("correlation_time", "s", 0.5, (0.05, 5.0), 0.5, least=0.0, above=True, shape=True)), EVERYWHERE,
         (), "Box, Jenkins 1970, Time Series Analysis, ch. 3", random=True),
    _row("outliers", "pose += draw with probability p",
         (Parameter("probability", "", 0.0, (0.0, 0.05), 0.02, least=0.0, most=1.0),
          Parameter("position", "m", 0.05, (0.01, 0.5), 0.05, least=0.0, shape=True),
          Parameter("heading", "rad", 0.2, (0.05, 3.0), 0.2, least=0.0, shape=True)), EVERYWHERE, (),
         "Huber 1964, Robust estimation, Ann. Math. Statist. 35 (contamination)", random=True, smooth=False,
         grid=(0.002, 0.005, 0.01, 0.02, 0.05)),
    _row("frozen_frames", "pose_k = pose_{k-1} with probability p",
         (Parameter("probability", "", 0.0, (0.0, 0.1), 0.05, least=0.0, most=1.0),), EVERYWHERE, (),
         "trackers that repeat the last frame when they are late", random=True, smooth=False,
         grid=(0.005, 0.01, 0.02, 0.05, 0.1)),
    _row("camera_tilt", "p -> p / (1 + a x + b y)",
         (Parameter("along_x", "1/m", 0.0, (-0.1, 0.1), 0.03), Parameter("along_y", "1/m", 0.0, (-0.1, 0.1), 0.02)),
         (ALONG, LATERAL), ("lens_distortion", "camera_scale"),
         "Hartley, Zisserman 2004, Multiple View Geometry, ch. 2 (homography)", extension=True),
)  # fmt: skip
"""Rows of the catalogue for this site."""
