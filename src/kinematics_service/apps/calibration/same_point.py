# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Calibrate without an instrument: the tip of the tool touches a few points, each from many poses.

The residual of a touch is the distance from the tip to its point. The positions of points and tip
are fitted with the arm. The fit starts from Huber's estimate of points and tip with the nominal
table. If all lengths of arm, tip and points grow by one factor, the residuals of exact touches
stay zero. So only ratios of lengths are identifiable, unless the distance between two points is
known.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...errors import CalibrationError
from ...kernel import Floats, Integers
from ...kinematics.forward import forward_kinematics, jacobian
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, CorrectingMotion, Part
from ...kinematics.uncertainty.parameters import parameters_of
from ...robot.file.parts.parameters import GROUPS, LENGTH, SIX, ArmParameter, end_parameters
from ...robot.robot import Robot
from ...robot.task import seeded_poses
from ..checking.diagnosis import MIN_POSES
from ..checking.errors import ERROR_LIMIT, length_in_words
from ..checking.hypotheses import DEGREES, Hypothesis, from_degrees
from ..recordings.readers.block import Flags
from . import checking, chosen_parameters, fitting
from .explanations import truncated
from .identified_table import ParameterCombination, combinations_of, structural_rank
from .placing import PLACING_STEPS

# The group of the parameters that are positions of touched points.
POINTS = 'points'
# A touch is exact if the distance from the tip to the touched point is below this value (m). Then
# the distance is only round-off.
TOUCH_TOLERANCE = 1e-13
# Longest step (rad, m) of a joint in the search for joint positions at which the tip touches a
# point exactly.
STEP_LIMIT = 0.5
# Usual joints turn by at most this angle (rad). If a joint angle is larger, test whether the joint
# positions are in degrees.
MAX_TURN = 4 * np.pi
# A matrix that reverses the sign of translations. It is needed because the residual is the
# position of the tip relative to the touched point. If a correction moves the point, the relative
# position changes in the opposite direction.
MIRROR = np.diag([-1.0, -1.0, -1.0, 1.0])


class TouchStart(NamedTuple):
    """
    Positions of K touched points (..., K, 3) in the base frame, and of the tip (..., 3) in the
    tool frame, m, from which the fit starts. `residuals` (..., N, 3) go from tip to touched point,
    m.
    """

    points: Floats
    tip: Floats
    residuals: Floats

    @property
    def distances(self) -> Floats:
        """Return the distances (..., N), m, from the tip to the touched point at each touch."""
        return np.asarray(np.linalg.norm(self.residuals, axis=-1))


def started(robot: Robot, q: Floats, point: Integers, free: bool = True) -> TouchStart:
    """
    Fit the touched points and the tip to N touches, with the nominal table, and return both. The
    method is Huber's estimate (reweighted least squares).

    The residuals are linear in points and tip. Each step solves for the tip. Then each point
    becomes the weighted mean of the tip positions at its touches.

    Parameters
    ----------
    q : shape (..., N, n), rad or m
        Joint positions at the touches. If `q` has leading dimensions, each array (N, n) has a fit
        of its own.
    point : shape (N,)
        The point of each touch, as a number from 0.
    free
        Whether the tip is fitted; otherwise it is the origin of the tool.
    """
    T = forward_kinematics(robot, q)
    at, R = T[..., :3, 3], T[..., :3, :3]
    touch = (point == np.arange(np.max(point) + 1)[:, None]).astype(np.float64)
    tip = np.zeros((*at.shape[:-2], 3))
    points = np.stack([np.median(at[..., point == k, :], axis=-2) for k in range(len(touch))], -2)
    residuals = points[..., point, :] - at
    for _ in range(fitting.MAX_ROUNDS):
        before, distances = tip, np.linalg.norm(residuals, axis=-1)
        noise = fitting.median_noise(distances)[..., None]
        weights = fitting.huber_weights(distances / noise, 1)
        shares = touch * weights[..., None, :]
        shares /= np.sum(shares, axis=-1, keepdims=True)
        mean_at, mean_R = shares @ at, np.einsum('...kn,...nij->...kij', shares, R)
        if free:
            # Each touch gives an equation. Subtract from each equation the mean over all touches
            # of the same point. This eliminates the positions of the points. Then solve for the
            # tip, with a prior so wide that it hardly changes the solution.
            J, off = R - mean_R[..., point, :, :], mean_at[..., point, :] - at
            M = np.einsum('...n,...nij,...nik->...jk', weights, J, J)
            M = M + (noise[..., None] / chosen_parameters.PLACE_PRIOR) ** 2 * np.eye(3)
            right = np.einsum('...n,...nij,...ni->...j', weights, J, off)
            tip = np.linalg.solve(M, right[..., None])[..., 0]
        points = mean_at + np.einsum('...kij,...j->...ki', mean_R, tip)
        residuals = points[..., point, :] - at - np.einsum('...nij,...j->...ni', R, tip)
        if np.all(np.abs(tip - before) < fitting.STEP_TOLERANCE * noise):
            break
    return TouchStart(points, tip, residuals)


class SamePointParameters(chosen_parameters.ChosenParameters):
    """
    The parameters of an arm whose tip touched points, and the fit problem of these touches.

    Parameters
    ----------
    q : shape (N, n), rad or m
        Joint positions.
    same_point : N
        The name of the touched point at each of the N joint positions.
    apart
        Known distances (m) between two points, by the names of both points.
    gears
        Whether gear ratios are among the parameters.

    Raises
    ------
    CalibrationError
        Shapes do not fit, a number is not finite, or a point was touched at too few different
        joint positions.
    """

    placed_groups = ('tool', POINTS)
    words = tuple(group for group in GROUPS if group not in ('base', 'lag', 'backlash'))

    def __init__(
        self,
        robot: Robot,
        q: npt.ArrayLike,
        same_point: Sequence[str | int],
        apart: Mapping[tuple[str, str], float],
        gears: bool,
    ) -> None:
        marks = [str(mark) for mark in same_point]
        joints = checking.finite_rows('q', q, robot.dof, len(marks))
        names = tuple(dict.fromkeys(marks))
        point = np.array([names.index(mark) for mark in marks], dtype=np.int64)
        if not names:
            message = f'same_point: no row touches a point; at least {MIN_POSES} at one are needed'
            raise CalibrationError(message, code='empty')
        for k, name in enumerate(names):
            checking.check_mark('point', name)
            # Require only two different joint positions at a point, because an arm of three joints
            # reaches a point at only a few joint positions.
            usual = f'{2 * robot.dof} or more at each point'
            checking.check_enough(joints[point == k], usual, f'point {name}: ', least=2)
        self.marks, self.names, self.apart = marks, names, _checked(apart, names)
        self.chain = (arm := parameters_of(robot, gears)).chain
        nowhere = checking.rigid_positions(np.zeros((len(marks), 3)))
        super().__init__(robot, checking.Measured.of(joints, nowhere, True, point), (), arm.table)
        axes = [(name, axis) for name in names for axis in SIX[:3]]
        points = (ArmParameter(f'{name}.{axis}', POINTS, False, place=axis) for name, axis in axes)
        self.every = (*arm.table, *points, *end_parameters('tool', 0))

    def first(self, end: str, k: int) -> int:
        """
        Return the index in `every` at which the corrections of a point or of the tool begin.

        If `end` is `points`, they are the three corrections of touched point k. Otherwise they are
        the corrections of the tool.
        """
        points = k if end == POINTS else len(self.names)
        return len(self.table) + 3 * points

    def fitted(
        self, fit: Sequence[str], fix: Sequence[str], tolerances: Iterable[str] = ()
    ) -> list[int]:
        """
        Return the indices, in `every`, of the parameters to fit, which include the positions of
        all touched points. Raise an error if a word of `fit` or `fix` names no parameter.
        """
        for word in (*fit, *fix):
            if word.rpartition('.')[0] in self.names:
                message = f'{word!r}: points are always fitted; leave it out of fit and fix'
                raise CalibrationError(message, code='conflict')
        points = range(self.first(POINTS, 0), self.first('tool', 0))
        return sorted({*super().fitted(fit, fix, tolerances), *points})

    def touch_problem(
        self, chosen: Sequence[int], tolerances: Mapping[str, float], check: bool
    ) -> fitting.FitProblem:
        """
        Return the fit problem for points that the tip of the tool has touched. The fit starts from
        the positions of points and tip that fit the nominal arm.

        Raises
        ------
        CalibrationError
            The touches show a mistake of the input that a calibration cannot correct.
        """
        tool = self.first('tool', 0)
        free = {*range(tool, tool + 3)} <= {*chosen}
        self.start = start = started(self.robot, self.given.q, self.given.sets, free)
        if check:
            self._check_touches(start)
            self._check_distances(start)
        points, first = start.points, [self.first(POINTS, k) for k in range(len(self.names))]
        distances = tuple(
            fitting.KnownDistance(first[i], first[j], points[j] - points[i], distance)
            for (i, j), distance in self.apart.items()
        )
        chains = [self._chain(k, start.tip) for k in range(len(self.names))]
        poses = checking.rigid_positions(points[self.given.sets])
        return self.problem(chains, poses, chosen, tolerances, distances)

    def undone(self, change: Hypothesis) -> dict[str, Any]:
        """
        Correct a mistake of the input, and return the corrected touches as keyword arguments of
        `calibrate`.
        """
        return {'q': change.joints(self.given.q), 'same_point': self.marks}

    def misfits(self, used: Flags, changes: Sequence[Hypothesis]) -> Floats:
        """
        Return the misfit (H,) of the touches for each of H possible mistakes, after the mistake is
        corrected in the data.

        Let d be the distance from the tip to the touched point. The misfit is the mean over all
        touches of min((d / 20 mm)^2, 1).
        """
        distances = self._distances(np.stack([change.joints(self.given.q) for change in changes]))
        return truncated((distances / ERROR_LIMIT.position) ** 2)

    def _distances(self, joints: Floats) -> Floats:
        # Take H corrected arrays of joint positions (H, N, n). Fit tip and points to each array,
        # and return the distances (H, N) from tip to touched point, m.
        return started(self.robot, joints, self.given.sets).distances

    def _check_touches(self, start: TouchStart) -> None:
        robot, q, middle = self.robot, self.given.q, float(np.median(start.distances))
        if middle < checking.MIN_CHANGE:
            return
        # Test for degrees only if angles are large. If small angles are divided by 57, the arm
        # hardly moves and the tip stays near one point, so the test would always report degrees.
        if np.max(np.abs(q[:, ~robot.prismatic]), initial=0.0) > MAX_TURN:
            distances = self._distances(from_degrees(robot, q))
            checking.refuse_mistake(DEGREES, 'wrong-unit', float(np.median(distances)), middle)
        if middle > checking.MAX_ERROR:
            raise CalibrationError(
                f'half of the touches are more than {length_in_words(middle)} from their points: '
                f'no robot {robot.name} is off by that much; it is another robot, or rows '
                'name the wrong points'
                f'{checking.explained_by_joints(robot, q, middle, self._distances)}',
                code='another-robot',
            )

    def _check_distances(self, start: TouchStart) -> None:
        for (i, j), given in self.apart.items():
            distance = float(np.linalg.norm(start.points[j] - start.points[i]))
            if abs(given - distance) > checking.MAX_ERROR:
                thousandth = abs(given / 1000 - distance) < checking.MAX_ERROR
                raise CalibrationError(
                    f'points {self.names[i]} and {self.names[j]} are {length_in_words(distance)} '
                    f'apart by the touches, not {length_in_words(given)}'
                    f'{"; write metres, not millimetres" if thousandth else ""}',
                    code='wrong-unit' if thousandth else 'mismatch',
                )

    def _chain(self, k: int, tip: Floats) -> CorrectedChain:
        # The chain goes from the base frame to the tip. The fit compares the tip with point k, and
        # keeps point k at its initial position. So instead of moving point k by a correction c,
        # the chain moves the tip by -c.
        description = self.robot.description
        tool = np.array(description.tool.motion.matrix)
        tool[:3, 3] += tool[:3, :3] @ tip
        moved = [CorrectingMotion(False, i, self.first(POINTS, k) + i) for i in range(3)]
        end = [CorrectingMotion(i > 2, i % 3, self.first('tool', 0) + i) for i in range(6)]
        still = list(self.chain.still)
        begin: list[Part] = [MIRROR, *moved, MIRROR @ description.base.motion.matrix]
        still[0] = (*begin, *still[0])
        still[-1] = (*still[-1], *end, tool)
        return replace(self.chain, still=tuple(still))

    def possible(self, problem: fitting.FitProblem) -> int:
        """
        Return how many independent combinations of the parameters can be determined from touches.

        Enough different touches determine all these combinations.
        """
        q = seeded_poses(self.robot.limits, self.robot.prismatic)
        point = np.arange(len(q)) % len(self.names)
        return structural_rank(self._exact_jacobian(problem, fitting.Noise(LENGTH, 1.0), q, point))

    def combinations(
        self, problem: fitting.FitProblem, noise: fitting.Noise, used: Flags
    ) -> tuple[ParameterCombination, ...]:
        """
        Return the sets of parameters that the touches do not determine separately.

        Touches that are outliers are left out.
        """
        J = self._exact_jacobian(problem, noise, self.given.q[used], self.given.sets[used])
        return combinations_of(J, problem.parameters)

    def _exact_jacobian(
        self, problem: fitting.FitProblem, noise: fitting.Noise, q: Floats, point: Integers
    ) -> Floats:
        # Return the scaled Jacobian of the tip at joint positions with which the nominal arm
        # touches the points exactly. At these joint positions, the touches stay exact if all
        # lengths grow by one factor. So the null space of the Jacobian contains the change of all
        # lengths by one factor, which is not identifiable.
        touching, exact = _touching(self.robot, q, self.start.points[point], self.start.tip)
        if not np.any(exact):
            touching, exact = q, np.ones(len(q), dtype=bool)
        rows = problem.given._replace(
            q=touching[exact],
            sets=point[exact],
            rates=np.zeros((int(np.sum(exact)), q.shape[1], 0)),
            poses=checking.rigid_positions(self.start.points[point[exact]]),
        )
        exact_problem = replace(problem, given=rows)
        return chosen_parameters.usual_motions(
            exact_problem, noise, np.ones(len(rows.q), dtype=bool)
        )

    def ends_of(self, problem: fitting.FitProblem, values: Floats) -> chosen_parameters.PlacedEnds:
        """
        Return base and tool, after the fit and before it, as in `ChosenParameters.ends_of`.

        The origin of the fitted tool is the fitted tip. The base offset is the identity, because
        the base is that of the robot file.
        """
        _, tool_offsets, _, tool_starts = super().ends_of(problem, values)
        base = self.robot.description.base.motion.matrix[None]
        return chosen_parameters.PlacedEnds(
            np.eye(4)[None], tool_offsets[:1], base, tool_starts[:1]
        )

    def as_given(self) -> Floats:
        """
        Return the residuals (N, 2, 3), m, with the unchanged robot file.

        A residual goes from the tip to the touched point. The tip positions are computed with the
        numbers of the robot file. The positions of the touched points are fitted to them.
        Residuals of rotations are zero.
        """
        residuals = started(self.robot, self.given.q, self.given.sets, free=False).residuals
        return np.stack([residuals, np.zeros_like(residuals)], axis=1)

    def points(
        self, problem: fitting.FitProblem, identified: fitting.Identified
    ) -> tuple[chosen_parameters.TouchedPoint, ...]:
        """Return the touched points with their fitted positions and standard deviations."""
        span = slice(self.first(POINTS, 0), self.first('tool', 0))
        moved = problem.every(identified.values)[span].reshape(-1, 3)
        deviations = np.sqrt(problem.every(np.diag(identified.covariance)))[span].reshape(-1, 3)
        counts = np.bincount(self.given.sets).tolist()
        numbers = zip((self.start.points + moved).tolist(), deviations.tolist(), counts)
        return tuple(
            chosen_parameters.TouchedPoint(name, (x, y, z), (dx, dy, dz), count)
            for name, ((x, y, z), (dx, dy, dz), count) in zip(self.names, numbers)
        )

    def remarks(
        self, problem: fitting.FitProblem, identified: fitting.Identified
    ) -> tuple[str, ...]:
        """
        Return remarks: a sentence if the scale of the lengths is unknown, and a sentence for each
        touch that seems to have the name of a wrong point.
        """
        result, names = [*super().remarks(problem, identified)], self.names
        # All lengths may grow by one factor, unless a known distance or a prismatic joint sets
        # the scale.
        kinds = ('lengths', False), ('tool', False)
        lengths = {entry for entry in self.every if (entry.group, entry.angle) in kinds}
        known = self.apart or any(self.robot.prismatic)
        if not known and lengths <= {*problem.parameters}:
            result.append(
                'The scale of the lengths is not identifiable: if arm, tip and points are all '
                'larger by one factor, they touch in the same way; the priors decide the scale, '
                'and a known distance between two points makes it identifiable'
            )
        points = np.array([point.position for point in self.points(problem, identified)])
        marked, residuals = self.given.sets, problem.remainders(identified.values)[:, 0]
        distances = np.linalg.norm(points - (points[marked] - residuals)[:, None], axis=2)
        nearest = np.argmin(distances, axis=1)
        near = np.min(distances, axis=1) < fitting.outlier_limit(1) * identified.noise.position
        for row in np.flatnonzero(~identified.used)[: checking.NAMES_IN_SENTENCE]:
            if nearest[row] != marked[row] and near[row]:
                touched = names[nearest[row]]
                result.append(f'Row {row} is marked {names[marked[row]]} but touches {touched}')
        return tuple(result)


def _touching(robot: Robot, q: Floats, targets: Floats, tip: Floats) -> tuple[Floats, Flags]:
    # Start at joint positions q (N, n), and move the tip to N targets by damped least squares
    # (Levenberg and Marquardt). Return the N joint positions, and N flags: whether the tip has
    # reached the target.
    for _ in range(PLACING_STEPS + 1):
        T, J = forward_kinematics(robot, q), jacobian(robot, q, at=tip)[:, :3]
        residuals = targets - (T[:, :3, 3] + T[:, :3, :3] @ tip)
        exact = np.linalg.norm(residuals, axis=1) < TOUCH_TOLERANCE
        squares = np.sum(residuals**2, axis=1) + np.finfo(float).eps
        inverse = np.linalg.inv(J @ np.swapaxes(J, 1, 2) + squares[:, None, None] * np.eye(3))
        step = np.einsum('nji,njk,nk->ni', J, inverse, residuals)
        longest = np.max(np.abs(step), axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, STEP_LIMIT / np.maximum(longest, STEP_LIMIT))
    return q, exact


def _checked(
    apart: Mapping[tuple[str, str], float], names: Sequence[str]
) -> dict[tuple[int, int], float]:
    # Check the known distances `apart` between points. The keys are pairs of point names. Return
    # the distances with pairs of point indices as keys.
    for (first, other), distance in apart.items():
        if missing := [name for name in (first, other) if name not in names]:
            points = ', '.join(names)
            message = f'apart: no row touches point {missing[0]}; the points are {points}'
            raise CalibrationError(message, code='unknown-name')
        if first == other or not 0.0 < distance < np.inf:
            raise CalibrationError(
                f'apart: points {first} and {other} cannot be {distance:g} m apart; give two '
                'points and a length above 0',
                code='out-of-range',
            )
    return {(names.index(i), names.index(j)): distance for (i, j), distance in apart.items()}
