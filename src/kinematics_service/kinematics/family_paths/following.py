"""
Whether a redundant arm can follow a path of targets, and by which posture: a graph over its arcs.

The arcs of each target are cut into pieces, each in a box. Where no pieces of neighbouring targets
are a step apart, no postures are: that proves `no`. Where postures at the pieces' begins are a
step apart all along, the joint path through them is checked as a plan: that proves `yes`. What is
neither is cut into halves, less what no path can pass.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...errors import JointVectorError, PlanError, TargetError
from ...kernel import Floats, Integers
from ...robot.robot import AnyRobot, Robot, as_robot
from ..arguments import number_or_nan, numbers_of
from ..inverse.problem.plan import InversePlan, plan_for
from ..inverse.problem.target import IkTarget, ik_target_of
from ..inverse.result import Complete, IkResult
from ..inverse.search import errors_at
from ..inverse.self_motion.arcs import IkArc
from ..inverse.solve import TOLERANCE, inverse_kinematics
from ..plans.check import check_plan, threshold_of_distance
from .joint_path import banned_step, deviations, on_turns_inside, smoothed
from .pieces import ArcPieces, StepRule, a_step_apart, only, pieces_of, step_rule
from .result import ArcLink, FamilyPath, FamilyVerdict, FollowedPath

Pairs = tuple[Integers, Integers]
Which = npt.NDArray[np.bool_]

# A joint may move so far from a target to the next (rad), and at most as far can be asked for.
STEP, LARGEST_STEP = 0.2, 1.0
SHAPES = ['(N, 4, 4)', '(N, 3)']
# Pieces are cut into halves so many times at most, while a target has no more of them.
ROUNDS, MOST_PIECES = 8, 4_000
# Joint paths that are tried.
PATHS = 12


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
    Return whether an arm with one joint more than its targets ask for can follow all of them.

    To follow is: the tool is exactly at each target, all joints are inside their limits and no
    singular pose is within `distance`, and from a target to the next each joint moves straight, by
    `max_step` at most. Between two targets the tool is where these joints bring it: how far from
    the straight line, `path` says; targets that are nearer to each other bring it nearer.

    `no` rests on the proof that all arcs are known (`complete`), with the exception that
    `inverse_kinematics` names, and is never said without.

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
    """The pieces of all targets, and what is known of the ways between them."""

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
        self.complete: list[Complete] = []
        self.proved: list[bool] = []
        self.layers: list[ArcPieces] = []
        self.links: tuple[tuple[ArcLink, ...], ...] = ()
        self.tries = 0
        # The last target at which postures were left out that are come to, but lead no farther.
        self.left_out = -1

    def run(self, given: Floats, rows: Sequence[str] | None, axis: str | None) -> FamilyPath:
        """Return the verdict; `given` are the targets as they were given."""
        for k, target in enumerate(given):
            self._take(inverse_kinematics(self.robot, target, rows=rows, axis=axis, tolerance=0.0))
            if self.proved[k] and not len(self.layers[k].arc):
                return self._result('no', f'target {k}: {self.reason}', k)
        for round_ in range(ROUNDS):
            pairs = [a_step_apart(a, b, self.rule) for a, b in zip(self.layers, self.layers[1:])]
            if not round_:
                self.links = tuple(self._links(k, *both) for k, both in enumerate(pairs))
            onwards, ended = self._come_to(pairs, False)
            if ended is not None:
                return self._refused(ended)
            path = self._followed(pairs)
            if path is not None:
                return self._result('yes', self._how(path), None, path)
            if self.tries == PATHS:
                break
            back, _ = self._come_to([both[::-1] for both in reversed(pairs)], True)
            alive = [a & b for a, b in zip(onwards, reversed(back))]
            if not self._halve(alive):
                break
            dead = [k for k, (a, b) in enumerate(zip(onwards, alive)) if np.any(a & ~b)]
            self.left_out = max([self.left_out, *dead])
        return self._result('not decided', self._open(), None)

    def _take(self, result: IkResult) -> None:
        first = not self.arcs
        arcs = tuple(arc for family in result.families for arc in family.intervals)
        known = first and self.start is not None
        curves = not result.solutions and all(family.intervals for family in result.families)
        # Of a joint with one limit the arcs on other turns are not known.
        one_sided = np.isfinite(self.plan.limits).sum(axis=1) == 1
        turned = bool(np.any(one_sided & np.isfinite(self.plan.periods)))
        proved = result.complete == 'proved' and curves and not (turned and result.families)
        self.arcs.append(arcs)
        self.complete.append(result.complete)
        self.proved.append(known or (proved and result.status != 'family'))
        self.reason = result.reason
        if known:
            assert self.start is not None
            self.layers.append(only(self.robot, arcs, self.start, self.rule))
        else:
            self.layers.append(pieces_of(self.robot, arcs))

    def _links(self, k: int, i: Integers, j: Integers) -> tuple[ArcLink, ...]:
        a, b = self.layers[k], self.layers[k + 1]
        shown = self._is_step(b.begin[j] - a.begin[i])
        both = np.column_stack([a.arc[i], b.arc[j]])
        near = {(i, j) for i, j in both[shown].tolist()}
        return tuple(
            ArcLink(i, j, 'yes' if (i, j) in near else 'not decided')
            for i, j in sorted({(i, j) for i, j in both.tolist()})
        )

    def _is_step(self, way: Floats) -> Which:
        along = np.abs(self.rule.shortest(way)) / self.rule.scales
        return np.asarray(np.max(along, axis=1, initial=0.0) <= self.rule.most)

    def _come_to(self, pairs: list[Pairs], backwards: bool) -> tuple[list[Which], int | None]:
        # Which pieces a path may come to, and the first target at which it cannot come to any.
        turn = slice(None, None, -1 if backwards else 1)
        layers, proved = self.layers[turn], self.proved[turn]
        come: list[Which] = []
        for k, layer in enumerate(layers):
            free = ~layer.are_within(self.distance, self.rule.scales)
            if k and proved[k - 1]:
                i, j = pairs[k - 1]
                reached = np.zeros(len(free), dtype=bool)
                reached[j[come[-1][i]]] = True
                free &= reached
            come.append(free)
            if proved[k] and not np.any(free):
                return come, k
        return come, None

    def _refused(self, k: int) -> FamilyPath:
        # At which of the targets what is left ends; what was left out may lead farther.
        if self.left_out < k:
            return self._result('no', self._why(k), k)
        k = self.left_out + 1
        return self._result('no', f'target {k}: no path of postures leads to it', k)

    def _why(self, k: int) -> str:
        if np.all(self.layers[k].are_within(self.distance, self.rule.scales)):
            return (
                f'target {k}: each posture inside the limits is within {self.distance:g} rad of a '
                'singular pose'
            )
        return (
            f'target {k}: no posture that a path may have at target {k - 1} is within a step of '
            f'{self.rule.most:g} rad of one there'
        )

    def _how(self, path: FollowedPath) -> str:
        return (
            f'{len(self.targets)} targets with joint steps of at most {path.step:.3g} rad; '
            f'where it was looked at between them the tool is at most '
            f'{path.position_deviation:.2g} m off straight lines'
        )

    def _open(self) -> str:
        gaps = [str(k) for k, proved in enumerate(self.proved) if not proved]
        sentence = 'no path was found that is proved, nor proof that there is none'
        if gaps:
            sentence += f'; not all postures are known at target {", ".join(gaps)}'
        return sentence

    def _halve(self, alive: list[Which]) -> bool:
        # Cuts what is left into halves; whether there is anything to be won by it.
        layers = [layer.chosen(which) for layer, which in zip(self.layers, alive)]
        if not all(len(layer.arc) for layer in layers):
            return False
        if max(len(layer.arc) for layer in layers) > MOST_PIECES:
            return False
        self.layers = [
            layer if not layer.s.any() else layer.halves(self.robot, arcs)
            for layer, arcs in zip(layers, self.arcs)
        ]
        return True

    def _followed(self, pairs: list[Pairs]) -> FollowedPath | None:
        banned: set[tuple[int, int, int]] = set()
        while self.tries < PATHS:
            self.tries += 1
            nodes = self._least_motion(pairs, banned)
            if nodes is None:
                return None
            chosen = zip(self.layers, nodes)
            raw = np.array([layer.begin[i] for layer, i in chosen])
            ways = self.rule.shortest(np.diff(raw, axis=0))
            q = np.vstack([raw[:1], raw[0] + np.cumsum(ways, axis=0)])
            arcs = tuple(int(layer.arc[i]) for layer, i in zip(self.layers, nodes))
            turned = on_turns_inside(q, self.plan.limits, self.rule, self.start is not None)
            if turned is None:
                k = banned_step(q, self.plan.limits)
            else:
                path, k = self._checked(turned, arcs)
                if path is not None:
                    on_arcs = [one[k] if one else None for one, k in zip(self.arcs, arcs)]
                    smooth = smoothed(turned, on_arcs, self.rule, self.start is None)
                    return self._checked(smooth, arcs)[0] or path
            k = min(k, len(nodes) - 2)
            if k < 0:
                return None
            banned.add((k, nodes[k], nodes[k + 1]))
        return None

    def _least_motion(
        self, pairs: list[Pairs], banned: set[tuple[int, int, int]]
    ) -> list[int] | None:
        # Of each target a piece, so that the squares of the steps between their begins are least.
        costs = [np.where(one.away > self.distance, 0.0, np.inf) for one in self.layers]
        came: list[Integers] = []
        for k, (i, j) in enumerate(pairs):
            way = self.layers[k + 1].begin[j] - self.layers[k].begin[i]
            free = self._is_step(way) & np.isfinite(costs[k][i]) & np.isfinite(costs[k + 1][j])
            for one, a, b in banned:
                if one == k:
                    free &= (i != a) | (j != b)
            i, j, way = i[free], j[free], self.rule.shortest(way[free]) / self.rule.scales
            cost = costs[k][i] + np.sum(way**2, axis=1)
            order = np.argsort(-cost, kind='stable')
            costs[k + 1][:] = np.inf
            costs[k + 1][j[order]] = cost[order]
            back = np.full(len(costs[k + 1]), -1)
            back[j[order]] = i[order]
            came.append(back)
        if not len(costs[-1]) or not np.isfinite(costs[-1].min()):
            return None
        nodes = [int(np.argmin(costs[-1]))]
        for back in reversed(came):
            nodes.append(int(back[nodes[-1]]))
        return nodes[::-1]

    def _checked(self, q: Floats, arcs: tuple[int, ...]) -> tuple[FollowedPath | None, int]:
        # The path, if limits, steps, distance and targets are as asked; otherwise a step of it
        # that is not.
        check = check_plan(self.robot, np.arange(len(q)), q, distance=self.distance)
        near = check.singularity
        if near.verdict != 'proved':
            at = near.undecided[0][0] if near.undecided else near.moment.point
            return None, int(at)
        inside = all(joint.limits == 'proved' for joint in check.joints)
        steps = np.abs(np.diff(q, axis=0)) / self.rule.scales
        step = float(np.max(steps, initial=0.0))
        errors = [
            float(errors_at(target, self.plan, one[None])[0])
            for target, one in zip(self.targets, q)
        ]
        met = all(target.is_near_at(one) for target, one in zip(self.targets, q))
        if not inside or not met or step > self.rule.most:
            return None, int(np.argmax(np.append(np.max(steps, axis=1, initial=0.0), 0.0)))
        whole = bool(set(self.targets[0].rows) & {'rx', 'ry', 'rz'})
        off, turned = deviations(self.robot, [one.pose for one in self.targets], q, whole)
        return FollowedPath(q, arcs, step, max(errors), off, turned, check), 0

    def _result(
        self, verdict: FamilyVerdict, reason: str, k: int | None, path: FollowedPath | None = None
    ) -> FamilyPath:
        arcs, complete = tuple(self.arcs), tuple(self.complete)
        return FamilyPath(verdict, reason, k, path, arcs, complete, self.links)
