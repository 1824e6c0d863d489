"""A path through a singular pose: the tool keeps its speed until damping bounds the joints."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .... import kernel
from ....kernel import Floats
from ....kinematics.singular_poses import STARTS, singular_poses
from ....kinematics.singularity import singularity
from ....kinematics.tool_state import evaluate
from ....robot.closed_poses import close_at
from ....robot.measures import Level
from ....robot.robot import Robot
from ....robot.task import ROW_NAMES, seeded_poses
from .motion import JointMotion, allowed_speeds, inside_limits

# Speeds of joints without a limit, rad/s, m/s.
FREE_TURNING, FREE_SLIDING = 1.0, 0.2
# Distance of the smooth path's ends from its singular pose.
TURNING_REACH, SLIDING_REACH = 0.7, 0.2  # rad, m
# Shortest period, in s: time to read along.
SHORTEST_PERIOD = 12.0
# The way through the singular pose begins along the motion that the tool follows least, which is
# this share of its reach.
LEAST_FELT = 0.5
# The joints are fastest at about this distance from a singular pose, rad: nearer to it damping
# takes over, as in damped least squares.
DAMPED = 0.06
# Damping is at most this share of the largest motion of the tool along the path: if the joints can
# turn without leaving the singular poses, the tool moves much at that distance.
DAMPING = 0.03
# A level lasts at least this time, s, so that it is visible on the table.
SEEN = 0.35
# The clock at the singular pose is slowed by one of these shares, the first that makes it long
# enough; and a turn takes such a share of the path.
SLOWEST = (1.0, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01, 0.003, 0.001)
TURN = 0.3
# Number of samples of the path's clock in a period.
SAMPLES = 4096
# Largest round-off of a period, as a share.
ROUND_OFF = 1e-12
# Largest error of a velocity by interpolation between them, as a share.
INTERPOLATED = 1e-3
# Number of ways tried through each singular pose, least motion of each joint as a share of the
# reach, and the seed that makes them repeatable.
WAYS = 16
LEAST_SHARE = 0.25
# The way of closed loops, rad or a share of their size, is halved to where they close all along.
WAY_OF_LOOPS, SHORTEST_WAY = 0.5, 0.001
SEED = 560
# Places of a way's outer parts, those that are nearest to its middle first.
OUTER = np.array([0.7, -0.7, 0.85, -0.85, 1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Passage:
    """
    q(x) = centre + x tangent + x^3 bend with x = cos(u(t)), back and forth between x = 1 and x =
    -1.

    Attributes
    ----------
    centre : shape (n,), rad or m
        The pose at x = 0: a singular pose, if one was found.
    tangent, bend : shape (n,), rad or m
    clock : shape (SAMPLES + 1,), s
        The time at which u = 2 pi k / SAMPLES; the first is 0, the last one the period.
    pace : shape (SAMPLES + 1,), 1/s
        du/dt there.
    """

    centre: Floats
    tangent: Floats
    bend: Floats
    clock: Floats
    pace: Floats

    @property
    def period(self) -> float:
        """Return the time after which the motion repeats itself, s."""
        return float(self.clock[-1])

    def at(self, t: npt.ArrayLike) -> JointMotion:
        """Return positions and velocities at times t (...,) in s."""
        u, rate = self._turned(np.remainder(np.asarray(t, dtype=np.float64), self.period))
        x = np.cos(u)[..., None]
        slope = -(np.sin(u) * rate)[..., None]
        return JointMotion(
            self.centre + x * self.tangent + x**3 * self.bend,
            slope * (self.tangent + 3.0 * x**2 * self.bend),
        )

    def _turned(self, t: Floats) -> tuple[Floats, Floats]:
        # u and du/dt: a cubic between two samples (Hermite), so that both are continuous.
        k = np.clip(np.searchsorted(self.clock, t, side='right') - 1, 0, SAMPLES - 1)
        length, turn = self.clock[k + 1] - self.clock[k], 2.0 * math.pi / SAMPLES
        s = (t - self.clock[k]) / length
        begin, end = length * self.pace[k], length * self.pace[k + 1]
        a, b = begin + end - 2.0 * turn, 3.0 * turn - 2.0 * begin - end
        u = k * turn + s * (begin + s * (b + s * a))
        return u, (begin + s * (2.0 * b + 3.0 * s * a)) / length


def smooth_trajectory(robot: Robot) -> Passage:
    """
    Return a path back and forth between two regular poses that leads exactly through a singular
    one.

    It goes through the singular pose along the joint motion that moves the tool least there, and
    its clock is that of damped least squares: far away the tool has a constant speed, so the
    joints speed up towards the singular pose, until the damping bounds them. At its ends it stands
    still. If the limits exclude singular poses, or leave no room around them, its middle is a
    regular pose. That of an arm with closed loops goes through the known position of its loops.
    """
    if robot.chain.loops:
        return _clocked(robot, _way_of_loops(robot))
    inside = inside_limits(robot)
    path = _clearest_way(robot, singular_poses(robot, inside), inside)
    if path is None:
        anywhere = seeded_poses(inside, robot.prismatic)[:STARTS]
        path = _clearest_way(robot, anywhere, inside)
    still = np.zeros(robot.dof)
    return _clocked(robot, path or _Way(still, still, still))


def _way_of_loops(robot: Robot) -> '_Way':
    # All joints together, as far as every loop closes and the limits allow.
    middle, units = robot.chain.closure.assembled(), np.minimum(robot.chain.closure.units(), 1.0)
    x = np.linspace(-1.0, 1.0, 21)[:, None]
    length = WAY_OF_LOOPS
    low, high = robot.limits.T
    while length > SHORTEST_WAY:
        q = middle + length * x * units
        inside = np.all((q >= low) & (q <= high))
        if inside and not np.any(close_at(robot.chain, q)[1]):
            return _Way(middle, length * units, np.zeros(robot.dof))
        length *= 0.5
    return _Way(middle, np.zeros(robot.dof), np.zeros(robot.dof))


class _Way(NamedTuple):
    # Through the pose s (n,): s + x tangent + x^3 bend, -1 <= x <= 1.
    s: Floats
    tangent: Floats
    bend: Floats

    def at(self, x: Floats) -> Floats:
        return self.s + x[:, None] * self.tangent + x[:, None] ** 3 * self.bend

    def slope(self, x: Floats) -> Floats:
        return self.tangent + 3.0 * x[:, None] ** 2 * self.bend


def _clearest_way(robot: Robot, middles: Floats, inside: Floats) -> _Way | None:
    # Of all ways through the middles the one whose outer parts keep farthest from singular poses.
    if not len(middles):
        return None
    random = np.random.default_rng(SEED)
    reach = np.where(robot.prismatic, SLIDING_REACH, TURNING_REACH)
    shape = (len(middles), WAYS, robot.dof)
    # Every joint takes part, so that there is something to see.
    d = reach * random.choice([-1.0, 1.0], shape) * random.uniform(LEAST_SHARE, 1.0, shape)
    least = singularity(robot, middles).joint_motion / reach
    largest = np.max(np.abs(least), axis=-1, keepdims=True)
    n = reach * LEAST_FELT * least / np.where(largest > 0.0, largest, 1.0)
    tangent = np.broadcast_to(n[:, None], d.shape)
    s = np.broadcast_to(middles[:, None], d.shape)
    room = np.minimum(reach, np.minimum(s - inside[:, 0], inside[:, 1] - s))
    share = np.min(room / (np.abs(d) + np.abs(tangent)), axis=-1, keepdims=True)
    d, tangent = share * d, share * tangent
    x = OUTER[:, None]
    tried = s[..., None, :] + x * tangent[..., None, :] + x**3 * d[..., None, :]
    clearance = clearances_of_ways(robot, tried.reshape(-1, len(x), robot.dof)).reshape(shape[:2])
    # Farther than it is told all are alike: of those the one along which every joint moves most.
    seen = np.where(clearance == np.max(clearance), np.min(np.abs(d) / reach, axis=-1), -1.0)
    best = np.unravel_index(int(np.argmax(seen)), d.shape[:2])
    return _Way(s[best], tangent[best], d[best]) if np.any(d[best]) else None


def clearances_of_ways(robot: Robot, ways: Floats) -> Floats:
    """
    Return the least distance (N,) of the poses (N, m, n) of each way, rad; of one that comes
    nearer than the clearest do, that of its first poses, which is less than theirs, too.
    """
    # A plan takes 0.4 of the time that it takes with the distances of all poses.
    clearance: Floats = np.array(singularity(robot, ways[:, 0]).distance)
    clearest = np.argsort(-clearance, kind='stable')[:WAYS]
    least = float(np.max(np.min(singularity(robot, ways[clearest]).distance, axis=-1)))
    for k in range(1, ways.shape[1]):
        left = np.flatnonzero(clearance >= least)
        distance = singularity(robot, ways[left, k]).distance
        clearance[left] = np.minimum(clearance[left], distance)
    return clearance


def _clocked(robot: Robot, way: _Way) -> Passage:
    # u goes round once in a period, and x = cos(u) back and forth.
    u, step = np.linspace(0.0, 2.0 * math.pi, SAMPLES + 1, retstep=True)
    x, sine = np.cos(u), np.abs(np.sin(u))
    q, slope = way.at(x), way.slope(x)
    near, felt = singularity(robot, q), _tool_motion(robot, q, slope)
    damped = float(np.max(felt[near.distance < DAMPED], initial=0.0)) or math.inf
    damping = min(damped, DAMPING * float(np.max(felt))) or 1.0
    speeds = allowed_speeds(robot, FREE_TURNING, FREE_SLIDING) * (1.0 - INTERPOLATED)
    for share in SLOWEST:
        # Of a tool speed of one damping leaves f / (f^2 + damping^2) of x in a second.
        f = np.hypot(felt, share * damping)
        seconds = sine * (f**2 + damping**2) / f
        seconds = np.hypot(seconds, TURN * (np.mean(seconds) or 1.0))
        # Trapezoids, and what their ends' slopes say beyond them (Euler and Maclaurin).
        bent = np.diff(np.gradient(seconds)) / 12.0
        mean = 0.5 * (seconds[1:] + seconds[:-1]) - bent
        clock = np.append(0.0, np.cumsum(step * mean))
        warned, stopped = (
            0.5 * step * float(np.sum(seconds[near.level == level]))
            for level in (Level.WARN, Level.ERROR)
        )
        slower = max(
            float(np.max(np.abs(slope) * (sine / seconds)[:, None] / speeds)),
            SHORTEST_PERIOD / clock[-1] * (1.0 + ROUND_OFF),
            SEEN / warned if warned > 0.0 else 0.0,
        )
        if stopped == 0.0 or slower * stopped >= SEEN:
            break
    return Passage(way.s, way.tangent, way.bend, slower * clock, 1.0 / (slower * seconds))


def _tool_motion(robot: Robot, q: Floats, slope: Floats) -> Floats:
    # Returns how far the tool moves along slopes (N, n) at poses (N, n), in the rows of the task,
    # m.
    state = evaluate(robot, q, depth=kernel.ALL_FRAMES)
    moved = np.einsum('nij,nj->ni', state.jacobian, slope)
    turned = state.link_frames[0, 0, :3, :3]
    moved = np.hstack(
        [moved[:, :3] @ turned, robot.singularity.task.length * moved[:, 3:] @ turned]
    )
    return np.asarray(
        np.linalg.norm(moved[:, [row in robot.singularity.task.rows for row in ROW_NAMES]], axis=1)
    )
