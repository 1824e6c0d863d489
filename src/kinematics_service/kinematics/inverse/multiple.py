"""
Solutions that several have become: where exactly they are, and how many.

At such a solution J has lost one motion v, and w is the direction it has lost. The other equations
are solved along q + s v, and what is left of the target along w is a function g(s), the reduced
equation of Lyapunov and Schmidt: its roots are the solutions near by, a root of order m stands for
m of them. Refinement of q itself ends as far from it as the m-th root of round-off; a polynomial
through g does not.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...kernel import Floats
from ...rigid_motion import rotation_vector
from ...robot.robot import Robot
from ...robot.task import ROW_NAMES
from ..forward import forward_kinematics, jacobian
from .plan import InversePlan
from .search import DistinctSolutions, apart, errors_at
from .target import TOOL_AXES, IkTarget

# g is sampled so far on both sides (rad), at so many places, by a polynomial of a lower degree.
SPAN, SAMPLES, DEGREE = 0.02, 13, 9
# Simple roots so near to 0, as a share of the span, stand beside each other.
NEXT = 0.05
# Largest order looked for.
MOST = 6
# What of g and its derivatives is round-off, as a share of the length.
ROUND_OFF = 1e-15
STEPS = 12
# Joint positions that end as near to each other are the same solution (rad, scaled).
SAME = 1e-7


class Multiple(NamedTuple):
    """
    A solution that several have become.

    Attributes
    ----------
    q : shape (n,), rad or m
        Where it is.
    error
        What is left of the target, m.
    multiplicity
        How many it stands for; 0 where that is not known, as where J has lost two motions.
    """

    q: Floats
    error: float
    multiplicity: int


def with_multiplicities(
    robot: Robot,
    target: IkTarget,
    plan: InversePlan,
    found: DistinctSolutions,
    singular: npt.NDArray[np.bool_],
) -> DistinctSolutions:
    """
    Return isolated solutions, those that are one made one, with the multiplicity of each.

    `singular` says of which J has lost a motion; the others are simple.
    """
    if not np.any(singular):
        return found
    simple = found.q[~singular], found.errors[~singular]
    q, errors = list(simple[0]), list(simple[1])
    multiplicities = [1] * len(q)
    kept: list[Multiple] = []
    for one, error in zip(found.q[singular], found.errors[singular]):
        for multiple in _multiples(robot, target, plan, one, float(error)):
            ways = (apart(plan, other.q, multiple.q) / plan.scales for other in kept)
            if all(np.max(np.abs(way)) >= SAME for way in ways):
                kept.append(multiple)
    q += [one.q for one in kept]
    errors += [one.error for one in kept]
    multiplicities += [one.multiplicity for one in kept]
    return DistinctSolutions(
        np.array(q).reshape(-1, robot.dof), np.array(errors), tuple(multiplicities)
    )


def _multiples(
    robot: Robot, target: IkTarget, plan: InversePlan, q: Floats, error: float
) -> list[Multiple]:
    # What a singular solution really is: one of a multiplicity, or several next to each other.
    unknown = [Multiple(q, error, 0)]
    n = robot.dof
    J = _weighted_jacobian(robot, target, plan, q)
    if n > len(J):
        return unknown
    left, sizes, right = np.linalg.svd(J)
    if n > 1 and sizes[n - 2] < 1e-3 * sizes[0]:
        return unknown
    along, across = right[n - 1], right[: n - 1]
    kept, lost = left[:, : n - 1], left[:, n - 1 :]
    at = SPAN * np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    ways = []
    for s in at:
        way = _way(robot, target, plan, q, s, (along, across, kept))
        if way is None:
            return unknown
        ways.append(way)
    rests = np.array([_weighted_error(robot, target, q + w * plan.scales) @ lost for w in ways])
    direction = np.linalg.svd(rests)[2][0]
    g = np.polynomial.Polynomial.fit(at, rests @ direction, DEGREE, domain=[-SPAN, SPAN])
    nothing = ROUND_OFF * max(robot.task.length, robot.task.reach)
    found = []
    for order, s in _roots(np.array(g.coef), nothing):
        way = _way(robot, target, plan, q, SPAN * s, (along, across, kept))
        if way is None:
            return unknown
        place = q + way * plan.scales
        left_over = float(errors_at(target, plan, place[None])[0])
        if left_over >= target.proved:
            return unknown
        found.append(Multiple(place, left_over, order))
    return found or unknown


def _roots(coefficients: Floats, nothing: float) -> list[tuple[int, float]]:
    # Orders and places of the roots next to 0: the one of the highest order, or all simple ones.
    order, at = _root(coefficients, nothing)
    if order != 1:
        return [(order, at)] if order else []
    roots = np.polynomial.polynomial.polyroots(coefficients)
    near = roots[(np.abs(roots) < NEXT) & (np.abs(roots.imag) < 1e-9)].real
    return [(1, float(root)) for root in near]


def _root(coefficients: Floats, nothing: float) -> tuple[int, float]:
    # The highest order of a root next to 0, and where it is: that of a derivative that is simple.
    for order in range(MOST, 0, -1):
        derivative = coefficients
        for _ in range(order - 1):
            derivative = np.asarray(np.polynomial.polynomial.polyder(derivative), np.float64)
        roots = np.polynomial.polynomial.polyroots(derivative)
        if not len(roots):
            continue
        root = roots[int(np.argmin(np.abs(roots)))]
        if abs(root) > 0.5 or abs(root.imag) > 1e-3:
            continue
        # Taylor's coefficients at it: all below the order are round-off.
        terms, factor = coefficients, 1.0
        sizes = []
        for k in range(order + 1):
            sizes.append(abs(float(np.polynomial.polynomial.polyval(root.real, terms))) / factor)
            terms = np.asarray(np.polynomial.polynomial.polyder(terms), np.float64)
            factor *= k + 1
        if max(sizes[:order]) <= nothing < sizes[order]:
            return order, float(root.real)
    return 0, 0.0


def _way(
    robot: Robot,
    target: IkTarget,
    plan: InversePlan,
    q: Floats,
    s: float,
    parts: tuple[Floats, Floats, Floats],
) -> Floats | None:
    # The scaled way from q with s along the lost motion that solves the equations not lost.
    along, across, kept = parts
    y = np.zeros(len(across))
    for _ in range(STEPS):
        here = q + (s * along + y @ across) * plan.scales
        rest = kept.T @ _weighted_error(robot, target, here)
        J = kept.T @ _weighted_jacobian(robot, target, plan, here) @ across.T
        step = np.asarray(np.linalg.lstsq(J, rest, rcond=None)[0])
        y = np.asarray(y + step)
        if np.max(np.abs(step), initial=0.0) < 1e-13:
            return np.asarray(s * along + y @ across)
        if np.max(np.abs(y), initial=0.0) > 0.5:
            return None
    return np.asarray(s * along + y @ across)


def _rows(target: IkTarget) -> list[int]:
    rows = [ROW_NAMES.index(name) for name in target.rows]
    return rows + [3, 4, 5] if target.axis else rows


def _weighted_error(robot: Robot, target: IkTarget, q: Floats) -> Floats:
    T = forward_kinematics(robot, q)
    R = robot.task.rotation
    linear = R.T @ (target.pose[:3, 3] - T[:3, 3])
    if target.axis:
        k = TOOL_AXES.index(target.axis)
        angular = R.T @ _turn_between(T[:3, k], target.pose[:3, k])
    else:
        angular = R.T @ rotation_vector(target.pose[:3, :3] @ T[:3, :3].T)
    return np.concatenate([linear, robot.task.length * angular])[_rows(target)]


def _turn_between(a: Floats, b: Floats) -> Floats:
    # The shortest turn (3,) that takes a unit vector to another less than half a turn away.
    normal = np.cross(a, b)
    sine = float(np.linalg.norm(normal))
    return np.asarray(normal * (np.arctan2(sine, a @ b) / sine if sine > 0.0 else 1.0))


def _weighted_jacobian(robot: Robot, target: IkTarget, plan: InversePlan, q: Floats) -> Floats:
    J = jacobian(robot, q)
    R = robot.task.rotation
    turns = J[3:]
    if target.axis:
        along = forward_kinematics(robot, q)[:3, TOOL_AXES.index(target.axis)]
        turns = turns - np.outer(along, along @ turns)
    rows = np.vstack([R.T @ J[:3], robot.task.length * R.T @ turns])
    return np.asarray(rows[_rows(target)] * plan.scales)
