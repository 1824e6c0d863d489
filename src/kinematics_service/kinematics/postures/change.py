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
from .result import PostureChange, PostureGroup, PosturePath, PostureVerdict

# How near a singular pose a path may come, rad: far more than encoders and round-off are off by.
DISTANCE = 1e-4
# Random targets: how many there are, and of them those that are looked at where `no` is proved.
TARGETS, EXAMPLES = 24, 8
# Near a place of three equal solutions so many targets are random at each of these distances, rad;
# places are told apart, and so many of them taken.
NEAR_CUSP, SHIFTS = (0.3, 0.1, 0.03, 0.01), 6
CUSPS_APART, MOST_CUSPS = 0.02, 8
# Passages that are looked for, and of one target.
PASSAGES, OF_TARGET = 60, 6
# Of so many paths that are found the one that keeps farthest from singular poses is returned.
PATHS = 3
# Postures that are nearer to each other are not told apart, rad.
APART = 1e-3


class _Pair(NamedTuple):
    """Two postures of a target."""

    target: Floats
    groups: tuple[PostureGroup, ...]
    first: Floats
    last: Floats


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
    return _PostureSearch(robot, distance, respect_limits, seed).run()


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
        self.proof = proof_of_no_change(robot)

    def run(self) -> PostureChange:
        """Return what is known."""
        seeded = self.random.permutation(seeded_poses(self.bounds, self.robot.prismatic))
        if self.proof.sentence:
            return self._result('no', self.proof.sentence, seeded[:EXAMPLES])
        targets = np.concatenate([seeded[:TARGETS], self._near_cusps()])
        pairs = self._pairs(targets)
        found = []
        for pair in pairs:
            path = self._path(pair)
            if path is not None:
                found.append((path, pair))
            if len(found) == PATHS:
                break
        if found:
            path, pair = max(found, key=lambda one: one[0].check.singularity.lower)
            keeps = f'{path.check.singularity.lower:.2g} rad from all singular poses'
            way = f'a path of {len(path.q) - 1} straight lines in the joints'
            reason = f'{way} leads from one posture to another and keeps {keeps}'
            return self._of('yes', reason, pair.target, pair.groups, path)
        reason = (
            f'no path was found between {len(pairs)} pairs of postures of {len(targets)} targets, '
            'nor a proof that there is none'
        )
        return self._result('not decided', reason, seeded[:EXAMPLES])

    def _result(self, verdict: PostureVerdict, reason: str, q: Floats) -> PostureChange:
        # Shown of the target with the most postures of some.
        some = [self._postures(one) for one in q]
        target, groups = max(some, key=lambda one: sum(len(group.q) for group in one[1]))
        return self._of(verdict, reason, target, groups, None)

    def _of(
        self,
        verdict: PostureVerdict,
        reason: str,
        target: Floats,
        groups: tuple[PostureGroup, ...],
        path: PosturePath | None,
    ) -> PostureChange:
        count = None if self.proof.grid is None else self.proof.grid.count
        return PostureChange(verdict, reason, target, groups, count, path)

    def _near_cusps(self) -> Floats:
        # Joint positions (N, n) around those where solutions become three in one.
        places: list[Floats] = []
        for cusp in self.random.permutation(self.proof.cusps):
            if all(np.linalg.norm(cusp - place) > CUSPS_APART for place in places):
                places.append(cusp)
            if len(places) == MOST_CUSPS:
                break
        shape = (len(NEAR_CUSP) * SHIFTS, self.robot.dof)
        shifts = np.repeat(NEAR_CUSP, SHIFTS)[:, None] * self.random.normal(size=shape)
        near = np.array([place + shifts for place in places]).reshape(-1, self.robot.dof)
        turned = near + self._turns_up(near)
        low, high = self.bounds.T
        return turned[np.all((turned >= low) & (turned <= high), axis=1)]

    def _turns_up(self, q: Floats) -> Floats:
        # The full turns (N, n) that bring joint positions just above the lower bounds.
        low = self.bounds[:, 0]
        turns = np.isfinite(self.periods) & np.isfinite(low)
        periods, up = np.where(turns, self.periods, 1.0), np.where(turns, low, 0.0) - q
        return np.where(turns, np.ceil(up / periods) * periods, 0.0)

    def _pairs(self, targets: Floats) -> list[_Pair]:
        # The most promising first: in one aspect of the grid, of the first targets; otherwise
        # those that are nearest to each other.
        ranked: list[tuple[tuple[bool, int, float], _Pair]] = []
        for k, q in enumerate(targets):
            target, groups = self._postures(q)
            found = []
            for one, other in itertools.combinations_with_replacement(groups, 2):
                both = itertools.product(one.q, other.q)
                if one is other:
                    both = itertools.combinations(one.q, 2)
                if one.signs == other.signs:
                    pairs = [_Pair(target, groups, a, b) for a, b in both]
                    found += [
                        ((one is not other, 0 if one is not other else k, length), pair)
                        for pair in pairs
                        if (length := self._length(pair)) > APART
                    ]
            ranked += sorted(found, key=lambda one: one[0])[:OF_TARGET]
        return [pair for _, pair in sorted(ranked, key=lambda one: one[0])][:PASSAGES]

    def _length(self, pair: _Pair) -> float:
        away = pair.last - pair.first
        turns = np.where(np.isfinite(self.periods), self.periods, 0.0)
        whole = np.round(away / np.where(turns > 0.0, turns, np.inf))
        return float(np.linalg.norm((away - whole * turns) / self.robot.task.column_scales))

    def _postures(self, q: Floats) -> tuple[Floats, tuple[PostureGroup, ...]]:
        # The target that the tool is at, and its postures.
        robot, rows = self.robot, self.robot.task.rows
        target = forward_kinematics(robot, q)
        found = inverse_kinematics(
            robot, target, respect_limits=self.inside, rows=rows, tolerance=0.0
        )
        if set(rows) == set(ROW_NAMES[:3]):
            target = target[:3, 3].copy()
        some = np.array([one.q for one in found]).reshape(-1, robot.dof)
        return target, self._groups(some[clearances(robot, some) > self.distance])

    def _groups(self, q: Floats) -> tuple[PostureGroup, ...]:
        # The product of complete factors is det(J_t): its sign says no more than theirs.
        robot, names, values = self.robot, (), np.empty((len(q), 0))
        if robot.factors.complete:
            names, values = robot.factors.names, robot.factors.evaluate(q)[..., 0]
        elif robot.task.square and len(q):
            names, values = ('det',), np.array(singularity(robot, q).determinant)[:, None]
        groups: dict[tuple[str, int], list[Floats]] = {}
        for one, row in zip(q, values):
            signs = ', '.join(f'{name} {"<>"[int(x > 0.0)]} 0' for name, x in zip(names, row))
            groups.setdefault((signs, self.proof.aspect(one)), []).append(one)
        return tuple(PostureGroup(*key, np.array(groups[key])) for key in sorted(groups))

    def _path(self, pair: _Pair) -> PosturePath | None:
        q = self.passages.between(pair.first, pair.last)
        if q is None:
            return None
        steps = np.max(np.abs(np.diff(q, axis=0)) / self.robot.task.column_scales, axis=1)
        times = np.append(0.0, np.cumsum(np.maximum(steps, APART)))
        check = check_plan(self.robot, times, q, distance=self.distance)
        limits = all(joint.limits == 'proved' for joint in check.joints) or not self.inside
        return PosturePath(q, check) if check.singularity.verdict == 'proved' and limits else None
