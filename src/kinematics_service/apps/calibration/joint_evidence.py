"""
Judge single joints: motion too small for their axes, and errors that depend on their positions.

The second is a score test of one added parameter, the gear ratio of each joint, beside those that
were fitted (Cook and Weisberg, Residuals and Influence in Regression, 1982, section 2.3.2).
"""

from collections.abc import Iterator
from statistics import NormalDist

import numpy as np

from ...robot.file.parts.parameters import ANGLE, GEARS, LENGTH
from ...robot.robot import Robot
from ...typography import listed
from ..checking.errors import angle_in_words, length_in_words
from .acceptance import TEST_LEVEL
from .checking import NAMES_IN_SENTENCE
from .fitting import FitProblem, Identified, normal_scores, one_more
from .knowledge import KNOWN


def joint_remarks(robot: Robot, problem: FitProblem, found: Identified) -> Iterator[str]:
    """Yield sentences on joints of an arm all of whose table was fitted."""
    yield from _nearly_still(robot, problem, found)
    if not any(one.group == GEARS for one in problem.parameters):
        yield from _by_position(robot, problem, found)


def _nearly_still(robot: Robot, problem: FitProblem, found: Identified) -> Iterator[str]:
    # An axis that is off by a usual error e moves the tool by e times the motion of its joint: a
    # distance of a turning axis (m), the direction of a sliding one (rad). The standard deviation
    # of e is the noise over the norm of the motion; it is known if that is KNOWN times smaller.
    q = problem.q[found.used]
    seen = np.linalg.norm(q - np.mean(q, axis=0), axis=0)
    usual = np.where(robot.prismatic, float(ANGLE), LENGTH)
    still = np.flatnonzero(usual * seen < KNOWN * found.noise.position)
    words = [length_in_words if robot.prismatic[j] else angle_in_words for j in still]
    named = [
        f'{robot.joint_names[j]} (by {of_kind(float(np.ptp(q[:, j])))})'
        for j, of_kind in zip(still.tolist(), words)
    ]
    if named:
        yield (
            f'Joints that move too little for their axes to be seen beside the noise: '
            f'{listed(named, NAMES_IN_SENTENCE)}; numbers of these axes mostly keep their '
            'nominal values: let these joints move farther'
        )


def _by_position(robot: Robot, problem: FitProblem, found: Identified) -> Iterator[str]:
    # The derivative by the gear ratio is that by the joint times its position.
    moves = problem.moves_with_joints(found.values) * problem.q[:, None, None, :]
    shown = np.any(moves != 0.0, axis=(0, 1, 2))
    joints = np.flatnonzero(shown)
    shares, deviations = one_more(problem, found, moves[..., joints])
    scores = normal_scores(np.abs(np.divide(shares, deviations)), found.freedom)
    best = int(np.argmax(scores))
    # Two-sided, and for the best of all joints (Bonferroni).
    if scores[best] > NormalDist().inv_cdf(1.0 - TEST_LEVEL / (2 * robot.dof)):
        yield (
            f'The errors depend on the position of joint {robot.joint_names[joints[best]]}, as '
            f'if its gear ratio were off by {100 * shares[best]:.2g} % (score test of an added '
            f'parameter, at {100 * TEST_LEVEL:g} %): --fit all fits gear ratios'
        )
