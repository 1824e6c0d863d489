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
from ..arguments import number_or_nan, random_from
from ..clearance import clearances
from ..forward import forward_kinematics
from ..inverse.problem.plan import plan_for
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
PASSAGES, OF_TARGET = 40, 6
# Of so many paths that are found the one that keeps farthest from singular poses is returned.
PATHS = 2
# Postures that are nearer to each other are not told apart, rad.
APART = 1e-3


class _PosturePair(NamedTuple):
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

    `no` is proved of arms whose targets are solved joint by joint, with axes that meet or are
    parallel to 1e-12 of the arm's size, and of three turning joints without a place of three equal
    solutions. The latter rests on a theorem for three joints (Salunkhe, Spartalis, Capco, Chablat,
    Wenger 2022), which is not proved here.

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
        self.plan = plan_for(robot, robot.task.rows)
        check_plan(robot, [0.0], self.plan.middle[None], distance=number_or_nan(distance))
        self.bounds = self.plan.limits if respect_limits else self.plan.unlimited
        self.random = random_from(seed)
        self.passages = Passages(robot, distance, self.bounds, self.plan.periods, self.random)
        self.proof = proof_of_no_change(robot)

    def run(self) -> PostureChange:
        """Return what is known."""
        seeded = self.random.permutation(seeded_poses(self.bounds, self.robot.prismatic))
        examples = [self._postures(q) for q in seeded[:EXAMPLES]]
        target, groups = max(examples, key=lambda one: sum(len(group.q) for group in one[1]))
        if self.proof.sentence:
            return self._result('no', self.proof.sentence, target, groups)
        targets = np.concatenate([seeded[:TARGETS], self._near_cusps()])
        pairs = self._pairs(targets)
        paths = ((path, pair) for pair in pairs if (path := self._path(pair)) is not None)
        found = list(itertools.islice(paths, PATHS))
        if found:
            path, pair = max(found, key=lambda one: one[0].check.singularity.lower)
            reason = (
                f'a path of straight lines in the joints ({len(path.q) - 1}) leads from one '
                f'posture to another and keeps {path.check.singularity.lower:.2g} rad from all '
                'singular poses'
            )
            return self._result('yes', reason, pair.target, pair.groups, path)
        what = f'between {len(pairs)} pairs of postures no path' if pairs else 'no such pair'
        reason = (
            f'postures with the same signs were looked for at {len(targets)} targets: {what} was '
            'found; nor is there a proof that there is none'
        )
        return self._result('not decided', reason, target, groups)

    def _result(
        self,
        verdict: PostureVerdict,
        reason: str,
        target: Floats,
        groups: tuple[PostureGroup, ...],
        path: PosturePath | None = None,
    ) -> PostureChange:
        count = None if self.proof.grid is None else self.proof.grid.count
        return PostureChange(verdict, reason, target, groups, count, path)

    def _without_turns(self, way: Floats) -> Floats:
        # Ways (..., n) less the full turns in them.
        turns = np.where(np.isfinite(self.plan.periods), self.plan.periods, 0.0)
        return way - turns * np.round(way / np.where(turns > 0.0, turns, np.inf))

    def _near_cusps(self) -> Floats:
        # Joint positions (N, n) around those where three solutions become one.
        places: list[Floats] = []
        for cusp in self.random.permutation(self.proof.cusps):
            if all(np.linalg.norm(cusp - place) > CUSPS_APART for place in places):
                places.append(cusp)
            if len(places) == MOST_CUSPS:
                break
        shape = (len(NEAR_CUSP) * SHIFTS, self.robot.dof)
        shifts = np.repeat(NEAR_CUSP, SHIFTS)[:, None] * self.random.normal(size=shape)
        near = np.array([place + shifts for place in places]).reshape(-1, self.robot.dof)
        near = self.plan.middle + self._without_turns(near - self.plan.middle)
        low, high = self.bounds.T
        return near[np.all((near >= low) & (near <= high), axis=1)]

    def _pairs(self, targets: Floats) -> list[_PosturePair]:
        # The most promising first: in one aspect, of the first targets; otherwise those that are
        # nearest to each other.
        ranked: list[tuple[tuple[bool, int, float], _PosturePair]] = []
        for k, q in enumerate(targets):
            target, groups = self._postures(q)
            members = [(group, one) for group in groups for one in group.q]
            found = []
            for (one, first), (other, last) in itertools.combinations(members, 2):
                way = self._without_turns(last - first) / self.robot.task.column_scales
                length, apart = float(np.linalg.norm(way)), one.aspect != other.aspect
                if one.signs == other.signs and length > APART:
                    rank = (apart, 0 if apart else k, length)
                    found.append((rank, _PosturePair(target, groups, first, last)))
            ranked += sorted(found, key=lambda one: one[0])[:OF_TARGET]
        return [pair for _, pair in sorted(ranked, key=lambda one: one[0])][:PASSAGES]

    def _postures(self, q: Floats) -> tuple[Floats, tuple[PostureGroup, ...]]:
        # The target that the tool is at, and its postures.
        robot, rows = self.robot, self.robot.task.rows
        target = forward_kinematics(robot, q)
        found = inverse_kinematics(
            robot, target, respect_limits=self.inside, rows=rows, tolerance=0.0
        )
        if set(rows) == set(ROW_NAMES[:3]):
            target = target[:3, 3].copy()
        some = np.array([one.q for one in found if one.exact]).reshape(-1, robot.dof)
        return target, self._groups(some[clearances(robot, some) > self.distance])

    def _groups(self, q: Floats) -> tuple[PostureGroup, ...]:
        # The product of complete factors is det(J_t): its sign says no more than theirs.
        robot, grid = self.robot, self.proof.grid
        names: tuple[str, ...] = ()
        values = np.empty((len(q), 0))
        if robot.factors.complete:
            names, values = robot.factors.names, robot.factors.evaluate(q)[..., 0]
        elif robot.task.square and len(q):
            names, values = ('det',), np.array(singularity(robot, q).determinant)[:, None]
        groups: dict[tuple[str, int], list[Floats]] = {}
        for one, row in zip(q, values):
            signs = ', '.join(f'{name} {"><"[int(x < 0.0)]} 0' for name, x in zip(names, row))
            key = (signs, 0 if grid is None else grid.number(one))
            groups.setdefault(key, []).append(one)
        return tuple(PostureGroup(*key, np.array(groups[key])) for key in sorted(groups))

    def _path(self, pair: _PosturePair) -> PosturePath | None:
        q = self.passages.between(pair.first, pair.last)
        if q is None:
            return None
        steps = np.max(np.abs(np.diff(q, axis=0)) / self.robot.task.column_scales, axis=1)
        times = np.append(0.0, np.cumsum(np.maximum(steps, APART)))
        check = check_plan(self.robot, times, q, distance=self.distance)
        inside = all(joint.limits == 'proved' for joint in check.joints) or not self.inside
        return PosturePath(q, check) if check.singularity.verdict == 'proved' and inside else None
