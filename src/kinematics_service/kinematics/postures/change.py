"""
Whether an arm can change its posture without meeting a singular pose: whether it is cuspidal.

A path that does and was proved says `yes`. The geometry of some arms is a proof of `no`. Of all
others nothing is said but what was tried.
"""

import itertools
from typing import NamedTuple

import numpy as np

from ...errors import PlanError
from ...kernel import Floats
from ...robot.robot import AnyRobot, Robot, as_robot
from ...robot.task import ROW_NAMES, seeded_poses
from ..clearance import clearances
from ..forward import forward_kinematics
from ..inverse.plan import plan_for
from ..inverse.solve import inverse_kinematics
from ..plans.check import check_plan
from ..singularity import singularity
from .passage import Passages
from .proof import proof_of_no_change
from .result import PostureChange, PostureGroup, PosturePath

# How near a singular pose a path may come, rad: far more than encoders and round-off are off by.
DISTANCE = 1e-3
# Random targets that are looked at, and of them those that are looked at where `no` is proved.
TARGETS, EXAMPLES = 30, 8
# Targets near each place of three equal solutions (rad), and how many such places are taken.
NEAR_CUSP, MOST_CUSPS = (0.5, 0.2, 0.05), 12
# Passages that are looked for, and of one target.
PASSAGES, OF_TARGET = 60, 6
# Postures that are nearer to each other are not told apart, rad.
APART = 1e-3


class _Postures(NamedTuple):
    """A target and its postures away from singular poses, by their signs."""

    target: Floats
    groups: tuple[PostureGroup, ...]

    @property
    def count(self) -> int:
        return sum(len(group.q) for group in self.groups)


def posture_change(
    robot: AnyRobot, distance: float = DISTANCE, respect_limits: bool = True, seed: int = 0
) -> PostureChange:
    """
    Return whether an arm can change its posture without meeting a singular pose.

    Postures are the solutions of one target; those that differ by full turns are the same one. An
    arm that can is called cuspidal.

    Parameters
    ----------
    robot
        The arm: as many joints as its task asks for, or fewer.
    distance
        How near a singular pose the path may not come, rad, as in `check_plan`. It counts for
        `yes` only.
    respect_limits
        Whether the path stays inside the joint limits. `no` is proved without them.
    seed
        Of the search for a path: the same seed, the same answer.

    Raises
    ------
    PlanError
        `distance` means nothing, or the arm has no isolated postures or closed loops.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> ks.posture_change('ur5e').verdict
    'no'
    >>> change = ks.posture_change('crx10ia_l')
    >>> change.verdict, change.path.check.verdict
    ('yes', 'proved')
    """
    robot = as_robot(robot)
    _refuse(robot)
    proof = proof_of_no_change(robot)
    search = _PostureSearch(robot, distance, respect_limits, seed)
    if proof.sentence:
        return search.proved(proof.sentence)
    return search.run(proof.cusps)


def _refuse(robot: Robot) -> None:
    task, why = robot.task, ''
    if robot.chain.loops:
        why = 'has closed loops: of those no path is proved to be free of singular poses'
    elif task.generic_rank < robot.dof:
        why = (
            f'has {robot.dof} joints, but moves the tool ({" ".join(task.rows)}) in '
            f'{task.generic_rank} ways only: its postures are no isolated ones'
        )
    if why:
        raise PlanError(f'{robot.name} {why}', 'robot', ['isolated postures'], robot.name)


class _PostureSearch:
    """The search for two postures of one target and a path between them."""

    def __init__(self, robot: Robot, distance: float, respect_limits: bool, seed: int) -> None:
        self.robot, self.distance, self.inside = robot, distance, respect_limits
        plan = plan_for(robot, robot.task.rows)
        check_plan(robot, [0.0], plan.middle[None], distance=distance)
        self.bounds = plan.limits if respect_limits else plan.unlimited
        self.periods = plan.periods
        self.random = np.random.default_rng(seed)
        self.passages = Passages(robot, distance, self.bounds, self.periods, self.random)
        seeded = seeded_poses(self.bounds, robot.prismatic)
        self.seeds = seeded[self.random.permutation(len(seeded))[:TARGETS]]

    def proved(self, sentence: str) -> PostureChange:
        """Return `no`, with an example."""
        some = [self._postures(q) for q in self.seeds[:EXAMPLES]]
        best = max(some, key=lambda one: one.count)
        return PostureChange('no', sentence, best.target, best.groups, None)

    def run(self, cusps: Floats) -> PostureChange:
        """Return `yes` with a path, or `not decided`."""
        tried, best = 0, self._postures(self.seeds[0])
        targets = self._targets(cusps)
        for q in targets:
            postures = self._postures(q)
            best = max(best, postures, key=lambda one: one.count)
            for first, last in self._pairs(postures)[: PASSAGES - tried]:
                tried += 1
                path = self._path(first, last)
                if path is not None:
                    keeps = f'{path.check.singularity.lower:.2g} rad from all singular poses'
                    way = f'a path of {len(path.q) - 1} straight lines in the joints'
                    reason = f'{way} leads from one posture to another and keeps {keeps}'
                    return PostureChange('yes', reason, postures.target, postures.groups, path)
        reason = (
            f'of {len(targets)} targets {tried} pairs of postures with the same signs were tried, '
            'and no path was found that is proved; nor is there a proof that there is none'
        )
        return PostureChange('not decided', reason, best.target, best.groups, None)

    def _targets(self, cusps: Floats) -> Floats:
        # Joint positions whose tool poses are targets: random ones, and some where the others of
        # three equal solutions are near.
        near = [self.seeds[:0]]
        for centre in self.random.permutation(cusps)[:MOST_CUSPS]:
            shifts = self.random.normal(size=(len(NEAR_CUSP), self.robot.dof))
            near.append(self._inside(centre + shifts * np.array(NEAR_CUSP)[:, None]))
        first = self.seeds[: TARGETS // 3]
        return np.concatenate([first, *near, self.seeds[len(first) :]])

    def _inside(self, q: Floats) -> Floats:
        # Those of joint positions (N, n) that are inside the bounds on some turn.
        low, high = self.bounds.T
        turns = np.where(np.isfinite(self.periods), self.periods, 0.0)
        with np.errstate(invalid='ignore', divide='ignore'):
            up = np.where(np.isfinite(low), np.ceil((low - q) / turns), 0.0)
        q = q + np.where(turns > 0.0, up, 0.0) * turns
        return q[np.all((q >= low) & (q <= high), axis=1)]

    def _postures(self, q: Floats) -> _Postures:
        # All that are found of the target which the tool is at.
        robot, rows = self.robot, self.robot.task.rows
        target = forward_kinematics(robot, q)
        found = inverse_kinematics(
            robot, target, respect_limits=self.inside, rows=rows, tolerance=0.0
        )
        if set(rows) == set(ROW_NAMES[:3]):
            target = target[:3, 3].copy()
        some = np.array([one.q for one in found]).reshape(-1, robot.dof)
        some = some[clearances(robot, some) > self.distance]
        return _Postures(target, _by_signs(robot, some))

    def _pairs(self, postures: _Postures) -> list[tuple[Floats, Floats]]:
        # Two postures with the same signs, the nearest first.
        scales, pairs = self.robot.task.column_scales, []
        for group in postures.groups:
            for first, last in itertools.combinations(group.q, 2):
                away = last - first
                turns = np.where(np.isfinite(self.periods), np.round(away / self.periods), 0.0)
                away = away - turns * np.where(turns == 0.0, 0.0, self.periods)
                length = float(np.linalg.norm(away / scales))
                if length > APART:
                    pairs.append((length, first, last))
        return [(first, last) for _, first, last in sorted(pairs, key=lambda one: one[0])][
            :OF_TARGET
        ]

    def _path(self, first: Floats, last: Floats) -> PosturePath | None:
        q = self.passages.between(first, last)
        if q is None:
            return None
        steps = np.max(np.abs(np.diff(q, axis=0)) / self.robot.task.column_scales, axis=1)
        times = np.append(0.0, np.cumsum(np.maximum(steps, APART)))
        check = check_plan(self.robot, times, q, distance=self.distance)
        limits = all(joint.limits == 'proved' for joint in check.joints) or not self.inside
        return PosturePath(q, check) if check.singularity.verdict == 'proved' and limits else None


def _by_signs(robot: Robot, q: Floats) -> tuple[PostureGroup, ...]:
    # The product of complete factors is det(J_t): its sign says no more than theirs.
    names: tuple[str, ...] = ()
    values = np.empty((len(q), 0))
    if robot.factors.complete:
        names, values = robot.factors.names, robot.factors.evaluate(q)[..., 0]
    elif robot.task.square and len(q):
        names, values = ('det',), np.array(singularity(robot, q).determinant)[:, None]
    groups: dict[str, list[Floats]] = {}
    for one, row in zip(q, values):
        signs = ', '.join(f'{name} {"<>"[int(x > 0.0)]} 0' for name, x in zip(names, row))
        groups.setdefault(signs, []).append(one)
    return tuple(PostureGroup(signs, np.array(groups[signs])) for signs in sorted(groups))
