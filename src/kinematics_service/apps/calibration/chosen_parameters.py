# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Choose the parameters that a calibration fits, and set the priors of the parameters."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ...errors import CalibrationError, ParameterNotFoundError
from ...kernel import Floats
from ...kinematics.forward import forward_kinematics
from ...kinematics.uncertainty.corrected_chain import CorrectedChain, CorrectingMotion
from ...kinematics.uncertainty.parameters import placement, scaled_jacobian
from ...rigid_motion import inverses
from ...robot.file.parts.description import Tolerances
from ...robot.file.parts.parameters import (
    ENDS,
    GEARS,
    GROUPS,
    SIX,
    TABLE_GROUPS,
    ArmParameter,
    end_parameters,
)
from ...robot.file.parts.tolerances import GEAR
from ...robot.robot import Robot
from ..checking.hypotheses import Hypothesis
from ..recordings.readers.block import Flags
from .checking import BACKLASH, COMPLIANCE, LAG, PLACEMENT, ZEROS, Measured
from .explanations import misfits_of_poses
from .fitting import (
    FitProblem,
    Identified,
    KnownDistance,
    Noise,
    remainders_between,
    weighted_jacobian,
)
from .identified_table import ParameterCombination, combinations_of, motion_of, structural_rank
from .placing import Offsets

# Prior standard deviation (m and rad) of the poses of base and tool, and of touched points. It is
# wide, because base, tool and points may be anywhere.
PLACE_PRIOR = 1.0
# Prior standard deviation of the delay between joint states and poses, s, and of the backlash of
# the joints, rad.
LAG_PRIOR = 0.1
# The word in `fit` and `fix` for all groups of parameters. Gear ratios are fitted only if `fit`
# has this word, or a word for gear ratios, such as `gears` or `gear2`.
EVERYTHING = 'all'


@dataclass(frozen=True)
class TouchedPoint:
    """
    A point that the tip of the tool touched from many poses.

    Attributes
    ----------
    name
        The name of the point, from the argument `same_point` of `calibrate`.
    position, deviation
        Position of the point in the base frame, and its standard deviation; x y z in m.
    count
        How often the tip touched the point.
    """

    name: str
    position: tuple[float, float, float]
    deviation: tuple[float, float, float]
    count: int


class PlacedEnds(NamedTuple):
    """
    Base and tool of each set of measured poses; each array has the shape (sets, 4, 4).

    Let B and T be base and tool of the robot file. The fitted base of a set is `base_offset @ B`,
    and the fitted tool is `T @ tool_offset`. `base_starts` and `tool_starts` are base and tool
    before the fit.
    """

    base_offsets: Floats
    tool_offsets: Floats
    base_starts: Floats
    tool_starts: Floats


def asks_for_gears(fit: Sequence[str]) -> bool:
    """Return whether a word of `fit` asks for gear ratios, for example all, gears or gear2."""
    return any(word == EVERYTHING or word.startswith(GEAR) for word in fit)


class ChosenParameters:
    """
    All parameters of an arm. The user's words in `fit` and `fix` select the parameters that are
    fitted.

    Attributes
    ----------
    every
        All parameters. The kinematic chains take an array with one correction for each parameter,
        in the order of this list.
    placed_groups
        Groups of parameters that place the arm: base and tool, or tool and touched points. A fit
        of these groups alone, with the nominal table, gives the errors before a calibration.
    """

    placed_groups: tuple[str, ...] = ENDS
    words: tuple[str, ...] = (*GROUPS, PLACEMENT, ZEROS, COMPLIANCE)

    def __init__(
        self, robot: Robot, given: Measured, own: tuple[str, ...], table: Sequence[ArmParameter]
    ) -> None:
        self.robot, self.given, self.own, self.table = robot, given, own, tuple(table)
        count = given.set_count
        self.ends = {end: count if end in own else 1 for end in ENDS}
        ends = [
            axis for end in ENDS for k in range(self.ends[end]) for axis in end_parameters(end, k)
        ]
        self.every = (*table, *ends, *given.placements, *given.moving)

    def first(self, end: str, k: int) -> int:
        """
        Return the index in `every` at which the six corrections of base or tool begin.

        `end` is `base` or `tool`, and k is the index of a set of measured poses, from 0.
        """
        number = k if end in self.own else 0
        before = self.ends['base'] if end == 'tool' else 0
        return len(self.table) + 6 * (before + number)

    def fitted(
        self, fit: Sequence[str], fix: Sequence[str], tolerances: Iterable[str] = ()
    ) -> list[int]:
        """
        Return the indices, in `every`, of the parameters to fit; raise an error if a word of `fit`
        or `fix` names no parameter.
        """
        groups, names = (*self.words, EVERYTHING), [parameter.name for parameter in self.every]
        for word in (*fit, *fix, *tolerances):
            if word not in (*groups, *names):
                message = (
                    f'unknown parameter {word!r} of {self.robot.name}; write a group '
                    f'({", ".join(groups)}) or a parameter ({", ".join(names)})'
                )
                raise ParameterNotFoundError(message, word, (*groups, *names))

        def is_among(parameter: ArmParameter, words: Sequence[str]) -> bool:
            return bool({parameter.name, parameter.group, EVERYTHING} & set(words))

        chosen = [
            k
            for k, parameter in enumerate(self.every)
            if (not fit or parameter.name in self.given.priors or is_among(parameter, fit))
            and not is_among(parameter, fix)
            # If only positions of one point on the tool are measured, skip the parameters that
            # rotate the tool.
            and not (self.given.positions and parameter.group == 'tool' and parameter.angle)
        ]
        if not chosen:
            message = 'fit, fix: nothing is left to fit; fit more, or fix less'
            raise CalibrationError(message, code='empty')
        return chosen

    def chains(self, arm: CorrectedChain, offsets: Sequence[Offsets]) -> list[CorrectedChain]:
        """
        Return the kinematic chains that predict the measured poses.

        Each set of measured poses has a chain. Base and tool of the chain are moved by the offsets
        from which the fit starts. If the measurements have `placements` (drifts of the instrument
        between sessions), each set has one chain for each session. Then the order is: all sets in
        the first session, all sets in the second session, and so on.
        """
        description = self.robot.description
        base, tool = description.base.motion.matrix, description.tool.motion.matrix
        firsts = [(self.first('base', k), self.first('tool', k)) for k in range(len(offsets))]
        chains = [
            placement(arm, offset.base @ base, tool @ offset.tool, first)
            for offset, first in zip(offsets, firsts)
        ]
        drifts = self.given.placements
        first = len(self.every) - len(drifts) - len(self.given.moving)
        return chains + [
            _moved(chain, first + k) for k in range(0, len(drifts), len(SIX)) for chain in chains
        ]

    def problem(
        self,
        chains: Sequence[CorrectedChain],
        poses: Floats,
        chosen: Sequence[int],
        tolerances: Mapping[str, float],
        known_distances: tuple[KnownDistance, ...] = (),
    ) -> FitProblem:
        """
        Return the problem of fitting the `chosen` parameters of the kinematic chains to measured
        poses.
        """
        parameters = tuple(self.every[k] for k in chosen)
        given, of_file = self.given, self.robot.description.tolerances
        session = given.sessions if given.placements else 0
        priors, still = {**given.priors, **tolerances}, len(self.every) - len(given.moving)
        rows = given._replace(
            sets=given.sets + given.set_count * session,
            poses=poses,
            rates=given.rates[:, :, [k - still for k in chosen if k >= still]],
        )
        before = np.array([prior_of(parameter, priors, of_file) for parameter in parameters])
        columns, count = np.array(chosen), len(self.every)
        return FitProblem(parameters, before, columns, count, tuple(chains), rows, known_distances)

    def possible(self, problem: FitProblem) -> int:
        """
        Return how many independent combinations of the parameters can be determined from poses.

        Enough different poses determine all these combinations.
        """
        # J is the Jacobian of the poses of the first chain: rank(J) combinations can be determined
        # from these poses. A parameter that does not belong to the first chain has a zero column
        # in J, and is counted in `elsewhere`. It belongs to another set or session, or it corrects
        # joint positions (for example a lag). Enough poses determine each parameter in
        # `elsewhere`, except an `idle` one: its derivatives in `rates` are zero for all poses.
        J = scaled_jacobian(self.robot, problem.chains[0], self.every, problem.given.positions)
        J = J[:, problem.columns]
        elsewhere = sum(not np.any(column) for column in J.T)
        idle = int(np.sum(~np.any(problem.given.rates, axis=(0, 1))))
        return structural_rank(J) + elsewhere - idle

    def combinations(
        self, problem: FitProblem, noise: Noise, used: Flags
    ) -> tuple[ParameterCombination, ...]:
        """Return the sets of parameters that the used poses do not determine separately."""
        return combinations_of(usual_motions(problem, noise, used), problem.parameters)

    def ends_of(self, problem: FitProblem, values: Floats) -> PlacedEnds:
        """Return base and tool of each set of measured poses, after the fit and before it."""
        description = self.robot.description
        B, T = description.base.motion.matrix, description.tool.motion.matrix
        chains, deltas = problem.chains[: self.given.set_count], problem.every(values)
        bases, tools = (
            np.array([motion_of(deltas[self.first(end, k) :][:6]) for k in range(len(chains))])
            for end in ENDS
        )
        base_starts = np.array([chain.still[0][0] for chain in chains])
        tool_starts = np.array([chain.still[-1][-1] for chain in chains])
        base_offsets = base_starts @ bases @ np.linalg.inv(B)
        tool_offsets = np.linalg.inv(T) @ tools @ tool_starts
        return PlacedEnds(base_offsets, tool_offsets, base_starts, tool_starts)

    def as_given(self) -> Floats:
        """
        Return the residuals (N, 2, 3), m and rad, between the measured poses and those of the
        unchanged robot file.
        """
        poses = forward_kinematics(self.robot, self.given.q)
        return remainders_between(self.given.poses, poses, self.given.positions)

    def undone(self, change: Hypothesis) -> dict[str, Any]:
        """
        Correct a mistake of the input, and return the corrected joint positions, poses and sets as
        keyword arguments of `calibrate`.
        """
        T = change.seen(self.given.poses)
        poses = T[:, :3, 3] if self.given.positions else inverses(T) if self.given.from_tool else T
        return {'q': change.joints(self.given.q), 'poses': poses, 'sets': self.given.sets}

    def misfits(self, used: Flags, changes: Sequence[Hypothesis]) -> Floats:
        """
        Return the misfit (H,) between measured poses and robot file for each of H mistakes of the
        input, after the mistake is corrected: 0 for a perfect fit, at most 1 (see
        `misfits_of_poses`).
        """
        return misfits_of_poses(self.robot, self.given, used, changes)

    def points(self, problem: FitProblem, identified: Identified) -> tuple[TouchedPoint, ...]:
        """Return the points that were touched; none if poses were measured."""
        return ()

    def remarks(self, problem: FitProblem, identified: Identified) -> tuple[str, ...]:
        """
        Return remarks for the report: a sentence that names unused tolerances of the robot file,
        and sentences on the sessions and loads of the measurements.
        """
        names = {parameter.name for parameter in self.every}
        unused = [
            name
            for name, _ in self.robot.description.tolerances.named
            if name not in names and not name.startswith(GEAR)
        ]
        sentence = f'The tolerance of {", ".join(unused)} in the robot file is not used'
        return (*([sentence] if unused else []), *self.given.remarks)


def usual_motions(problem: FitProblem, noise: Noise, used: Flags) -> Floats:
    """
    Return the QR factor R (P, P) of a scaled Jacobian of the predicted poses by the parameters.

    In the scaled Jacobian, column k is multiplied by the usual error of parameter k, and each row
    is divided by the noise of one measured number. Priors are not used, since they must not decide
    which parameters are identifiable. The Jacobian is computed with all corrections zero, so axes
    that are parallel in the nominal arm are exactly parallel. If corrections tilted these axes by
    tiny angles, some parameters would wrongly seem identifiable.
    """
    scales = np.array([parameter.scale for parameter in problem.parameters]) / problem.prior
    return weighted_jacobian(problem, np.zeros(len(scales)), noise, used) * scales


def _moved(chain: CorrectedChain, first: int) -> CorrectedChain:
    # Return the chain with six further corrections: the drift of the instrument's pose in one
    # session. They stand directly after the corrections of the base. `first` is the index of the
    # first of these six corrections.
    begin = chain.still[0]
    six = [CorrectingMotion(k > 2, k % 3, first + k) for k in range(len(SIX))]
    at = 1 + len(SIX)
    return replace(chain, still=((*begin[:at], *six, *begin[at:]), *chain.still[1:]))


def prior_of(number: ArmParameter, tolerances: Mapping[str, float], of_file: Tolerances) -> float:
    """
    Return the prior standard deviation of a parameter, rad, m or s.

    Parameters
    ----------
    tolerances
        Standard deviations by name or group.
    of_file
        Tolerances of the robot file, used if `tolerances` has none for this parameter.
    """
    if number.group not in TABLE_GROUPS:
        return tolerances.get(number.name, LAG_PRIOR if number in (LAG, BACKLASH) else PLACE_PRIOR)
    by_kind = of_file.angle if number.angle else of_file.length
    usual = dict(of_file.named).get(number.name)
    usual = usual or (of_file.gear if number.group == GEARS else by_kind)
    prior = tolerances.get(number.name, tolerances.get(number.group, usual or number.scale))
    if not prior > 0.0:
        message = f'tolerances: {number.name} is {prior:g}, not above 0; fix {number.name} instead'
        raise CalibrationError(message, code='out-of-range')
    return float(prior)
