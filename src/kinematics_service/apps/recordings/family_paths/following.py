"""
A joint path of a redundant arm through a sequence of targets: a shortest path over sampled arcs.

The nodes are samples of the arcs of each target, the edges lead from a target to the next, and the
cost is the sum of the squared joint steps (Bellman's dynamic programming). The joint path that is
found is checked as a plan. A search proves nothing: if no path is found, there may be one.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....errors import JointVectorError, PlanError, TargetError
from ....kernel import Floats, Integers
from ....kinematics.arguments import number_or_nan, numbers_of
from ....kinematics.inverse.problem.plan import InversePlan, plan_for
from ....kinematics.inverse.problem.target import IkTarget, ik_target_of
from ....kinematics.inverse.search import errors_at
from ....kinematics.inverse.self_motion.arcs import IkArc
from ....kinematics.inverse.solve import TOLERANCE, inverse_kinematics
from ....kinematics.singularity import singularity
from ....robot.robot import AnyRobot, Robot, as_robot
from ..plans.check import check_plan, threshold_of_distance
from .joint_path import StepRule, deviations, on_turns_inside, step_rule
from .result import FamilyPath, FollowedPath

# Largest motion of a joint from a target to the next, by default and at most, rad.
STEP, LARGEST_STEP = 0.2, 1.0
SHAPES = ['(N, 4, 4)', '(N, 3)']
# Samples of an arc in a step; neighbours of a path's samples are then a step apart.
SAMPLES = 4
# Largest number of samples of an arc.
MOST_SAMPLES = 1000


class Layer(NamedTuple):
    """
    The samples of the arcs of a target.

    Attributes
    ----------
    arc : shape (m,)
        The number of the arc of each.
    q : shape (m, n), rad or m
        The postures.
    away : shape (m,), rad
        The distance of each to the nearest singular pose that was found.
    """

    arc: Integers
    q: Floats
    away: Floats


def follow_family(
    robot: AnyRobot,
    targets: npt.ArrayLike,
    max_step: float = STEP,
    distance: float | None = None,
    start: npt.ArrayLike | None = None,
    rows: Sequence[str] | None = None,
    axis: str | None = None,
) -> FamilyPath:
    """
    Return a joint path of an arm with one joint more than its targets ask for, if one is found.

    The tool is exactly at each target, all joints are inside their limits, no singular pose is
    within `distance`, and from a target to the next each joint moves straight, by `max_step` at
    most; the path is checked for all of this. Between two targets the tool is where these joints
    bring it: `path` says how far from the straight line; targets that are nearer to each other
    bring it nearer. If no path is found, there may be one.

    Parameters
    ----------
    robot
        The arm.
    targets : shape (N, 4, 4) or (N, 3)
        Poses of the tool, or its positions (m), in the base frame.
    max_step : rad
        The largest motion of a joint from a target to the next, at most 1 rad; prismatic joints
        are divided by the arm's length.
    distance
        How near a singular pose the arm may not come, rad, as in `check_plan`.
    start : shape (n,), rad or m
        The posture at the first target; default: any.
    rows, axis
        What counts of each target, as in `inverse_kinematics`.

    Raises
    ------
    TargetError
        There is no target, or one of them is none, or rows or axis are not as they may be.
    PlanError
        `max_step` or `distance` means nothing.
    JointVectorError
        `start` is not n finite numbers inside the limits with the tool at the first target.

    Examples
    --------
    >>> import numpy as np
    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('kuka_iiwa14')
    >>> q = np.array([0.4, 0.7, -0.3, -1.2, 0.5, 0.9, -0.2])
    >>> q = np.linspace(q, q + 0.1, 3)
    >>> ks.follow_family(robot, ks.forward_kinematics(robot, q)).verdict
    'yes'
    """
    robot = as_robot(robot)
    if not 0.0 < number_or_nan(max_step) <= LARGEST_STEP:
        raise PlanError(
            f'max_step must be above 0, at most {LARGEST_STEP:g} rad, not {max_step}',
            'max_step',
            ['above 0, at most 1 rad'],
            max_step,
        )
    given = _targets(targets)
    checked = [ik_target_of(robot, one, rows, axis, TOLERANCE) for one in given]
    plan = plan_for(robot, checked[0].rows, checked[0].axis)
    threshold = threshold_of_distance(robot) if distance is None else distance
    q = None if start is None else _start(robot, checked[0], start, threshold)
    if q is None:
        check_plan(robot, [0.0], plan.middle[None], distance=threshold)
    search = _PathSearch(robot, plan, checked, step_rule(plan, max_step), threshold, q)
    return search.run(given, rows, axis)


def _targets(targets: npt.ArrayLike) -> Floats:
    try:
        given = np.array(targets, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        given = np.empty(0)
    if len(given.shape) not in (2, 3) or not len(given):
        raise TargetError(
            'targets must be one or more poses (N, 4, 4) or positions (N, 3)', 'targets', SHAPES
        )
    return given


def _start(robot: Robot, target: IkTarget, start: npt.ArrayLike, distance: float) -> Floats:
    rows = np.atleast_1d(numbers_of('start', start))
    check = check_plan(robot, [0.0], rows[None], distance=distance)
    beyond = [joint.name for joint in check.joints if joint.limits != 'proved']
    if beyond or not target.is_near_at(rows):
        why = f'is beyond the limits of {", ".join(beyond)}' if beyond else 'is not there'
        raise JointVectorError(
            f'start must bring the tool to the first target, inside the limits: it {why}',
            'start',
            [(robot.dof,)],
            rows.shape,
        )
    return rows


class _PathSearch:
    """The sampled arcs of all targets, and the joint paths through them."""

    def __init__(
        self,
        robot: Robot,
        plan: InversePlan,
        targets: list[IkTarget],
        rule: StepRule,
        distance: float,
        start: Floats | None,
    ) -> None:
        self.robot, self.plan, self.targets = robot, plan, targets
        self.rule, self.distance, self.start = rule, distance, start
        self.arcs: list[tuple[IkArc, ...]] = []

    def run(self, given: Floats, rows: Sequence[str] | None, axis: str | None) -> FamilyPath:
        """Return the result; `given` are the targets as they were given."""
        layers: list[Layer] = []
        for k, target in enumerate(given):
            result = inverse_kinematics(self.robot, target, rows=rows, axis=axis, tolerance=0.0)
            arcs = tuple(arc for family in result.families for arc in family.intervals)
            self.arcs.append(arcs)
            known = not k and self.start is not None
            layers.append(self._start_alone(arcs) if known else self._sampled(arcs))
            if not len(layers[k].q):
                return self._none(f'target {k}: {result.reason}')
            if not np.any(layers[k].away > self.distance):
                return self._none(
                    f'target {k}: each posture that was found is within {self.distance:g} rad of '
                    'a singular pose'
                )
        return self._path(layers)

    def _none(self, reason: str) -> FamilyPath:
        return FamilyPath(f'no path was found; {reason}', None, tuple(self.arcs))

    def _start_alone(self, arcs: tuple[IkArc, ...]) -> Layer:
        assert self.start is not None
        q = self.start
        ways = [self.rule.shortest(arc.q - q) / self.rule.scales for arc in arcs]
        nearest = [float(np.linalg.norm(way, axis=1).min()) for way in ways]
        return self._layer(np.array([int(np.argmin(nearest)) if arcs else 0]), q[None])

    def _sampled(self, arcs: tuple[IkArc, ...]) -> Layer:
        arc, q = [np.empty(0, dtype=np.int64)], [np.empty((0, self.robot.dof))]
        for k, one in enumerate(arcs):
            count = int(np.ceil(SAMPLES * one.length / self.rule.most))
            extra = np.linspace(0.0, one.length, min(count, MOST_SAMPLES) + 1)
            rows = one.q if len(one.q) > len(extra) else np.array([one.at(s) for s in extra])
            arc.append(np.full(len(rows), k))
            q.append(rows)
        return self._layer(np.concatenate(arc), np.concatenate(q))

    def _layer(self, arc: Integers, q: Floats) -> Layer:
        if not len(q):
            return Layer(arc, q, np.empty(0))
        nearest = singularity(self.robot, np.ascontiguousarray(q)).nearest_singular
        way = np.linalg.norm((nearest - q) / self.robot.singularity.task.column_scales, axis=1)
        return Layer(arc, q, np.where(np.isfinite(way), way, np.inf))

    def _path(self, layers: list[Layer]) -> FamilyPath:
        nodes, reached = self._shortest(layers)
        if len(nodes) < len(layers):
            return self._none(
                f'from target {reached} no sampled posture leads to one of target {reached + 1} '
                f'by a step of {self.rule.most:g} rad'
            )
        raw = np.array([layer.q[i] for layer, i in zip(layers, nodes)])
        ways = self.rule.shortest(np.diff(raw, axis=0))
        q = np.vstack([raw[:1], raw[0] + np.cumsum(ways, axis=0)])
        turned = on_turns_inside(q, self.plan.limits, self.rule, self.start is not None)
        if turned is None:
            return self._none('the shortest path leaves the joint limits on any full turns')
        arcs = tuple(int(layer.arc[i]) for layer, i in zip(layers, nodes))
        path = self._checked(turned, arcs)
        if path is None:
            return self._none('the shortest path fails the check as a plan')
        return FamilyPath(self._how(path), path, tuple(self.arcs))

    def _how(self, path: FollowedPath) -> str:
        return (
            f'{len(self.targets)} targets with joint steps of at most {path.step:.3g} rad; '
            f'where it was looked at between them the tool is at most '
            f'{path.position_deviation:.2g} m off straight lines'
        )

    def _shortest(self, layers: list[Layer]) -> tuple[list[int], int]:
        # Return a sample of each target, with the least sum of squared steps, and the last target
        # that is reached.
        cost = np.where(layers[0].away > self.distance, 0.0, np.inf)
        came: list[Integers] = []
        for k, (a, b) in enumerate(zip(layers, layers[1:])):
            total, back = np.full(len(b.q), np.inf), np.zeros(len(b.q), dtype=np.int64)
            # A sample at a time: all pairs at once take gigabytes.
            for i in np.flatnonzero(np.isfinite(cost)).tolist():
                way = np.abs(self.rule.shortest(b.q - a.q[i])) / self.rule.scales
                free = np.max(way, axis=1) <= self.rule.most
                through = np.where(free, cost[i] + np.sum(way**2, axis=1), np.inf)
                less = through < total
                total[less], back[less] = through[less], i
            cost = np.where(b.away > self.distance, total, np.inf)
            if not np.any(np.isfinite(cost)):
                return [], k
            came.append(back)
        nodes = [int(np.argmin(cost))]
        for back in reversed(came):
            nodes.append(int(back[nodes[-1]]))
        return nodes[::-1], len(came)

    def _checked(self, q: Floats, arcs: tuple[int, ...]) -> FollowedPath | None:
        # Return the path if limits, steps, distance and targets are as asked.
        check = check_plan(self.robot, np.arange(len(q)), q, distance=self.distance)
        steps = np.abs(np.diff(q, axis=0)) / self.rule.scales
        step = float(np.max(steps, initial=0.0))
        is_fine = (
            check.singularity.verdict == 'proved'
            and all(joint.limits == 'proved' for joint in check.joints)
            and all(target.is_near_at(one) for target, one in zip(self.targets, q))
            and step <= self.rule.most
        )
        if not is_fine:
            return None
        pairs = zip(self.targets, q)
        error = max(float(errors_at(target, self.plan, one[None])[0]) for target, one in pairs)
        whole = bool(set(self.targets[0].rows) & {'rx', 'ry', 'rz'})
        off, turned = deviations(self.robot, [one.pose for one in self.targets], q, whole)
        return FollowedPath(q, arcs, step, error, off, turned, check)
