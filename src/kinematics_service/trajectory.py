"""
Joint motions for an arm that is not there: sums of sines, so that velocities are exact.

"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .kernel import Floats
from .robot import Robot
from .singular_pose import STARTS, singular_poses
from .singularities import singularity
from .task import seeded_poses

# A path stays away from limits by this share of their range, and of a one-sided limit by this.
MARGIN, ONE_SIDED_MARGIN = 0.05, 0.05
# A path uses at most this share of a velocity limit, and these speeds where there is none.
SPEED_SHARE = 0.5
FREE_TURNING, FREE_SLIDING = 1.0, 0.2  # rad/s, m/s

# How far the smooth path leads away from its singular pose, either way.
TURNING_REACH, SLIDING_REACH = 1.0, 0.2  # rad, m
# It takes so long at least, in s: time to read along.
SHORTEST_PERIOD = 12.0
# Largest slope of cos^3, at sin^2 = 1/3.
STEEPEST = 2.0 / math.sqrt(3.0)
# Ways through a singular pose that are tried at each, what each joint moves at least as a share of
# the reach, and the seed that makes them repeatable.
WAYS = 16
LEAST_SHARE = 0.25
SEED = 560


class JointMotion(NamedTuple):
    """
    Joint positions (..., n) in rad or m, and velocities (..., n) in rad/s or m/s.

    """

    q: Floats
    qdot: Floats


@dataclass(frozen=True, eq=False)
class Trajectory:
    """
    q_j(t) = centre_j + sum over k of amplitude_kj sin(frequency_kj t + phase_kj).

    Attributes
    ----------
    centre : shape (n,), rad or m
        Middle of the motion; of the smooth path its singular pose.
    amplitude : shape (k, n), rad or m
    frequency : shape (k, n), rad/s
    phase : shape (k, n), rad
    period
        Time after which the motion repeats itself, s.

    """

    centre: Floats
    amplitude: Floats
    frequency: Floats
    phase: Floats
    period: float

    def at(self, t: npt.ArrayLike) -> JointMotion:
        """
        Return positions and velocities at times t (...,) in s.

        """
        angle = self.frequency * np.asarray(t, dtype=np.float64)[..., None, None] + self.phase
        return JointMotion(
            self.centre + np.sum(self.amplitude * np.sin(angle), axis=-2),
            np.sum(self.amplitude * self.frequency * np.cos(angle), axis=-2),
        )


def smooth_trajectory(robot: Robot) -> Trajectory:
    """
    Return a path to and fro between two regular poses that leads exactly through a singular one.

    q(t) = s + cos^3(w t) d: at its ends it stands still, and it slows down at the singular pose s,
    so that the warning stays long enough to be read. Where the limits keep singular poses out, or
    leave no room around them, s is a regular pose.

    """
    inside = _inside(robot)
    s, d = _clearest_way(robot, singular_poses(robot, inside), inside)
    if not np.any(d):
        anywhere = seeded_poses(inside, _sliding(robot).tolist())[:STARTS]
        s, d = _clearest_way(robot, anywhere, inside)
    speeds = _speeds(robot, SPEED_SHARE, FREE_TURNING, FREE_SLIDING)
    fastest = float(np.max(np.abs(d) * STEEPEST / speeds))
    period = max(SHORTEST_PERIOD, 2.0 * math.pi * fastest)
    w = 2.0 * math.pi / period
    # cos^3 x = (3 cos x + cos 3x) / 4, and a cosine is a sine a quarter turn ahead.
    return Trajectory(
        centre=s,
        amplitude=np.outer([0.75, 0.25], d),
        frequency=np.outer([w, 3.0 * w], np.ones_like(d)),
        phase=np.full((2, len(d)), 0.5 * math.pi),
        period=period,
    )


def sine_trajectory(robot: Robot) -> Trajectory:
    """
    Return q_1 = sin t, q_2 = cos 2t, q_3 = sin 3t and so on, moved and shrunk into the limits.

    The motion of document 002; the clock runs slower for arms whose velocity limits ask for it.

    """
    n = robot.dof
    inside = _inside(robot)
    low, high = inside[:, 0], inside[:, 1]
    amplitude = np.minimum(1.0, 0.5 * (high - low))
    w = np.arange(1.0, n + 1.0)
    # Limited joints at their share of the limit, the others as fast as the document's.
    speeds = _speeds(robot, SPEED_SHARE, math.inf, math.inf)
    clock = min(1.0, float(np.min(speeds / (amplitude * w))))
    return Trajectory(
        centre=np.clip(0.0, low + amplitude, high - amplitude),
        amplitude=amplitude[None],
        frequency=clock * w[None],
        phase=np.where(np.arange(n) % 2 == 0, 0.0, 0.5 * math.pi)[None],
        period=2.0 * math.pi / clock,
    )


TRAJECTORIES: dict[str, Callable[[Robot], Trajectory]] = {
    'smooth': smooth_trajectory,
    'sine': sine_trajectory,
}


def _sliding(robot: Robot) -> npt.NDArray[np.bool_]:
    return np.array([kind == 'prismatic' for kind in robot.joint_types])


def _inside(robot: Robot) -> Floats:
    # The limits (n, 2), a little narrower.
    low, high = np.array(robot.limits[:, 0]), np.array(robot.limits[:, 1])
    both = np.isfinite(high - low)
    margin = np.where(both, MARGIN * np.where(both, high - low, 0.0), ONE_SIDED_MARGIN)
    return np.stack([low + margin, high - margin], axis=1)


def _speeds(robot: Robot, share: float, turning: float, sliding: float) -> Floats:
    limits = robot.velocity_limits
    free = np.where(_sliding(robot), sliding, turning)
    return np.where(np.isinf(limits), free, share * limits)


def _clearest_way(robot: Robot, middles: Floats, inside: Floats) -> tuple[Floats, Floats]:
    # Of all lines s - d to s + d through the middles s, the one whose outer halves keep farthest
    # from singular poses; d is zero where there is none.
    if not len(middles):
        return np.zeros(robot.dof), np.zeros(robot.dof)
    random = np.random.default_rng(SEED)
    reach = np.where(_sliding(robot), SLIDING_REACH, TURNING_REACH)
    shape = (len(middles), WAYS, robot.dof)
    # Every joint takes part, so that there is something to see.
    d = reach * random.choice([-1.0, 1.0], shape) * random.uniform(LEAST_SHARE, 1.0, shape)
    s = np.broadcast_to(middles[:, None], d.shape)
    room = np.minimum(reach, np.minimum(s - inside[:, 0], inside[:, 1] - s))
    d = d * np.min(room / np.abs(d), axis=-1, keepdims=True)
    shares = np.array([-1.0, -0.75, -0.5, 0.5, 0.75, 1.0])
    clearance = singularity(robot, s[..., None, :] + shares[:, None] * d[..., None, :]).distance
    best = np.unravel_index(int(np.argmax(np.min(clearance, axis=-1))), d.shape[:2])
    return np.array(s[best]), d[best]
