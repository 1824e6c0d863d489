"""
A joint path from one posture to another that keeps its distance from all singular poses.

Each pose has a radius in which no pose is singular (`clearances`). Two trees of such poses grow
towards each other, by steps that stay inside these radii, until two radii overlap.
"""

import itertools

import numpy as np

from ...kernel import Floats
from ...robot.clearance_bounds import moving_joints
from ...robot.robot import Robot
from ..clearance import clearances

# Poses that are tried for one passage.
POSES = 320
# What a step takes of a radius; the rest is left for round-off.
STEP = 0.95
# A pose whose radius is smaller than this share of the distance to keep is no part of a tree.
LEAST = 0.5
# How often a step is towards the other tree, rather than towards a random pose.
TOWARDS = 0.3
# How far beyond the ends random poses are at most, rad.
AROUND = 2.0
# Goals that differ by full turns: how many there are at most, and to how many straight lines lead.
GOALS, LINES = 64, 4
# Rounds in which a passage is made shorter.
SHORTER = 60


class _Tree:
    """Poses (N, d) of the joints that count, their radii, and from which each was come to."""

    def __init__(self, roots: Floats, radii: Floats) -> None:
        self.poses, self.radii, self.parents = roots, radii, [-1] * len(roots)

    def add(self, pose: Floats, radius: float, parent: int) -> None:
        self.poses = np.vstack([self.poses, pose])
        self.radii = np.append(self.radii, radius)
        self.parents.append(parent)

    def nearest(self, pose: Floats) -> int:
        return int(np.argmin(np.linalg.norm(self.poses - pose, axis=1)))

    def way_to(self, k: int) -> list[Floats]:
        """Return the poses from a root to one of them."""
        way = []
        while k >= 0:
            way.append(self.poses[k])
            k = self.parents[k]
        return way[::-1]


class Passages:
    """
    Passages of an arm inside bounds.

    Parameters
    ----------
    robot
        The arm.
    distance
        Which they keep from singular poses, rad.
    bounds : shape (n, 2), rad or m
        Which they stay inside; infinite where there are none.
    periods : shape (n,), rad or m
        Turn after which a joint is back; infinite where there is none.
    random
        Where poses are drawn from.
    """

    def __init__(
        self,
        robot: Robot,
        distance: float,
        bounds: Floats,
        periods: Floats,
        random: np.random.Generator,
    ) -> None:
        self._robot, self._distance, self._random = robot, distance, random
        self._bounds, self._periods = bounds, periods
        # The other joints change the rank of no pose: they move evenly from end to end.
        self._moving = moving_joints(robot.chain, robot.task)
        self._scales = robot.task.column_scales[self._moving]

    def between(self, first: Floats, last: Floats) -> Floats | None:
        """Return a path (N, n) from joint positions to others, but for full turns; or None."""
        goals = self._on_turns(first, last)
        scaled = goals[:, self._moving] / self._scales
        start = first[self._moving] / self._scales
        for k in range(min(LINES, len(goals))):
            if self._is_free(start, scaled[k]):
                return np.array([first, goals[k]])
        way = self._by_trees(start, scaled)
        if way is None:
            return None
        k = int(np.argmin(np.linalg.norm(scaled - way[-1], axis=1)))
        way = self._shorter(way)
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
        path = first + (along / along[-1])[:, None] * (goals[k] - first)
        path[1:-1, self._moving] = way[1:-1] * self._scales
        return np.asarray(path)

    def _on_turns(self, first: Floats, last: Floats) -> Floats:
        # The last positions on all turns inside the bounds that are near, the nearest first.
        choices: list[list[float]] = []
        for j, period in enumerate(self._periods.tolist()):
            if not np.isfinite(period):
                choices.append([float(last[j])])
                continue
            near = last[j] + period * np.round((first[j] - last[j]) / period)
            low, high = self._bounds[j]
            turned = (near, near - period, near + period)
            inside = [float(x) for x in turned if low <= x <= high] or [float(last[j])]
            choices.append(inside if j in self._moving else inside[:1])
        goals = np.array(list(itertools.product(*choices)))
        away = np.linalg.norm((goals - first) / self._robot.task.column_scales, axis=1)
        return np.asarray(goals[np.argsort(away, kind='stable')][:GOALS])

    def _by_trees(self, start: Floats, goals: Floats) -> Floats | None:
        begin = _Tree(start[None], self._radii(start[None]))
        here, there = begin, _Tree(goals, self._radii(goals))
        for _ in range(POSES):
            aim = there.poses[self._random.integers(len(there.poses))]
            if self._random.uniform() > TOWARDS:
                aim = self._somewhere(start, goals)
            k = here.nearest(aim)
            pose = self._step(here.poses[k], float(here.radii[k]), aim)
            radius = float(self._radii(pose[None])[0])
            if radius > LEAST * self._distance:
                here.add(pose, radius, k)
                j = there.nearest(pose)
                away = float(np.linalg.norm(there.poses[j] - pose))
                if away < STEP * (radius + there.radii[j]):
                    one, other = here.way_to(len(here.poses) - 1), there.way_to(j)
                    if here is not begin:
                        one, other = other, one
                    return np.array(one + other[::-1])
            here, there = there, here
        return None

    def _somewhere(self, start: Floats, goals: Floats) -> Floats:
        # Around the ends, as near as the passage may be short; the nearest goals more often.
        goal = goals[int(len(goals) * self._random.uniform() ** 2)]
        around = AROUND * self._random.uniform() ** 2
        low, high = (self._bounds[self._moving] / self._scales[:, None]).T
        low = np.maximum(low, np.minimum(start, goal) - around)
        high = np.minimum(high, np.maximum(start, goal) + around)
        return np.asarray(self._random.uniform(low, high))

    def _radii(self, poses: Floats) -> Floats:
        # The clearance, less the distance to keep.
        q = np.zeros((len(poses), self._robot.dof))
        q[:, self._moving] = poses * self._scales
        return clearances(self._robot, q) - self._distance

    def _step(self, pose: Floats, radius: float, aim: Floats) -> Floats:
        way = aim - pose
        length = float(np.linalg.norm(way))
        return pose + min(1.0, STEP * radius / max(length, 1e-300)) * way

    def _is_free(self, a: Floats, b: Floats) -> bool:
        # Whether the line between two poses is inside the radii of poses on it.
        while True:
            radius = float(self._radii(a[None])[0])
            if np.linalg.norm(b - a) < STEP * radius:
                return True
            if radius <= LEAST * self._distance:
                return False
            a = self._step(a, radius, b)

    def _shorter(self, way: Floats) -> Floats:
        for _ in range(SHORTER):
            if len(way) < 3:
                break
            i, k = np.sort(self._random.choice(len(way), 2, replace=False))
            if k - i > 1 and self._is_free(way[i], way[k]):
                way = np.delete(way, slice(i + 1, k), axis=0)
        return way
