# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the exact time derivative of the Jacobian from its screws, and the acceleration of the
tool.

An element is a row of the DH table that a joint moves. If only one element moves, with speed 1,
the tool gets the angular velocity w, and the reference point (the tool's origin by default) gets
the linear velocity s. The pair (s, w) is the screw of the element. Each column of the Jacobian is
a sum of screws.

The screw of an element changes with time. The elements between the base and this element move its
axis: together they turn the axis with the angular velocity W, and give the reference point the
velocity V. All elements of the arm together give the reference point the velocity V_all. So the
reference point moves relative to the axis with V_all - V. The derivatives are dw/dt = W x w and
ds/dt = W x s + w x (V_all - V). The last term comes from w x r, the part of s that depends on the
vector r from the axis to the reference point.

If the arm has closed loops, J = J_open [1; C]. J_open has a column for each joint and for each
passive joint, and C = d psi / d q has the derivatives of the passive joints psi by the joints q.
Let Phi be the residual of the loops, and Phi_x the derivatives of Phi by x = (q, psi). The columns
of Phi_x also are sums of screws. The passive joints keep Phi at 0, so Phi_x [1; C] = 0 at all
times. The time derivative of this equation gives Phi_psi dC/dt = -dPhi_x/dt [1; C], where Phi_psi
has the columns of Phi_x for psi.
"""

import numpy as np
import numpy.typing as npt

from .. import kernel
from ..errors import JointVectorError
from ..kernel import Chain, Closure, Floats, Integers, groups_from
from ..robot.chain import first_entries
from ..robot.points import TOOL, Point
from ..robot.robot import AnyRobot, as_robot
from .arguments import finite_rows
from .forward import BASE, chosen, cross, offset_of, state_of, with_point_at
from .tool_state import ToolState, velocities_of


def jacobian_rate(
    robot: AnyRobot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return the time derivative of the geometric Jacobian, shape (..., 6, n), which KDL calls
    JacDot.

    Parameters
    ----------
    robot
        The arm.
    q, qdot : shape (..., n), rad or m, rad/s or m/s
        Joint positions and velocities.
    axes, of, at
        As in `jacobian`. The derivative is taken in the base frame, and then expressed in `axes`.

    Raises
    ------
    JointVectorError
        The last dimension of `q` or `qdot` is not n, or a number is not finite.
    PointError
        The arm has no frame `of` or `axes`; `at` is not three finite numbers.
    """
    robot = as_robot(robot)
    state = state_of(robot, of, q, qdot)
    return chosen(robot, q, state, _rate(state, robot.point(of), at), of, None, axes)


def acceleration(
    robot: AnyRobot,
    q: npt.ArrayLike,
    qdot: npt.ArrayLike,
    qddot: npt.ArrayLike,
    axes: str | int = BASE,
    *,
    of: str | int = TOOL,
    at: npt.ArrayLike | None = None,
) -> Floats:
    """
    Return the acceleration of the tool, J qddot + dJ/dt qdot, shape (..., 6), m/s^2 and rad/s^2.

    The linear part is the second derivative of the position of the reference point. The angular
    part is the derivative of the angular velocity.

    Parameters
    ----------
    robot
        The arm.
    q, qdot, qddot : shape (..., n)
        Joint positions, velocities and accelerations, in rad or m and s.
    axes, of, at
        As in `jacobian_rate`.

    Raises
    ------
    JointVectorError
        The last dimension of `q`, `qdot` or `qddot` is not n, or a number is not finite.
    PointError
        The arm has no frame `of` or `axes`; `at` is not three finite numbers.

    Examples
    --------
    The end of an arm of 1 m that turns by 2 rad/s has the centripetal acceleration 4 m/s^2:

    >>> import kinematics_service as ks
    >>> robot = ks.load_robot('planar_2r')
    >>> ks.acceleration(robot, [0, 0], [2.0, 0], [0, 0], of=1)[0].tolist()
    -4.0
    """
    robot = as_robot(robot)
    state, point = state_of(robot, of, q, qdot), robot.point(of)
    accelerations = finite_rows(JointVectorError, 'qddot', qddot, robot.dof, state.q.shape)
    total = acceleration_of(state, point, accelerations, at)
    return chosen(robot, q, state, total[..., None], of, None, axes)[..., 0]


def acceleration_of(
    state: ToolState, point: Point, qddot: Floats, at: npt.ArrayLike | None = None
) -> Floats:
    """
    Return the acceleration (..., 6) of `point` in base axes, m/s^2 and rad/s^2; `state` must have
    velocities.
    """
    J, qdot = state.jacobian, velocities_of(state)
    if at is not None:
        J = with_point_at(J, offset_of(state.pose, at))
    return np.asarray(J @ qddot[..., None] + _rate(state, point, at) @ qdot[..., None])[..., 0]


def _rate(state: ToolState, point: Point, at: npt.ArrayLike | None) -> Floats:
    # Returns the time derivative of the Jacobian in base axes, shape (..., 6, n).
    chain, qdot = point.chain, velocities_of(state)
    n, entries = chain.dof, chain.entries
    screws = state.row[..., chain.screws_at : chain.screws_at + 6 * entries]
    screws = screws.reshape(*state.row.shape[:-1], 6, entries)
    if at is not None:
        screws = with_point_at(screws, offset_of(state.pose, at))
    if not chain.loops:
        rates = _screw_rates(chain, point.first_entries, screws, qdot)
        if chain.form != kernel.MIXED:
            # MIXED marks chains in which a joint may move several rows of the table, or none. In
            # all other chains, each joint moves exactly one row. Then column j of J is the screw
            # of the row that joint j moves.
            return rates
        return _by_variable(chain, rates)
    closure = chain.closure
    section = state.row[..., chain.closure_at : chain.closure_at + closure.width]
    all_rates = section[..., closure.variables : 2 * closure.variables]
    coupling, its_rate = _coupling_and_rate(closure, section, all_rates)
    rates = _by_variable(chain, _screw_rates(chain, point.first_entries, screws, all_rates))
    passive = _by_variable(chain, screws)[..., n:]
    return np.asarray(rates[..., :n] + rates[..., n:] @ coupling + passive @ its_rate)


def _screw_rates(chain: Chain, first: Integers, screws: Floats, rates: Floats) -> Floats:
    # Returns the time derivatives (..., 6, entries) of the screws of a chain whose joints (and
    # passive joints) have the velocities `rates`. An entry is a pair of an element (a row of the
    # table) and a joint that moves this row.
    entries = chain.entries
    sums = np.zeros((*screws.shape[:-1], entries + 1))
    np.cumsum(screws * rates[..., None, chain.table.joint], axis=-1, out=sums[..., 1:])
    # Each column of `screws` is the screw of an element (a row of the table). The same column of
    # `before` is the twist of the element's axis: the sum of the twists of all elements between
    # the base and this element. The element itself is left out, because an element that moves does
    # not move its own axis.
    before = sums[..., first]
    W, V = before[..., 3:, :], sums[..., :3, -1:] - before[..., :3, :]
    halves = screws.reshape(*screws.shape[:-2], 2, 3, entries)
    result = cross(W[..., None, :, :], halves)
    result[..., 0, :, :] += cross(screws[..., 3:, :], V)
    return result.reshape(screws.shape)


def _by_variable(chain: Chain, six_rows: Floats) -> Floats:
    # Each column of `six_rows` belongs to a row of the table and to one joint that moves this row.
    # Returns one column for each joint and each passive joint: the sum of the columns that belong
    # to the joint.
    result = np.zeros((*six_rows.shape[:-1], chain.variables))
    for k, j in enumerate(chain.table.joint):
        result[..., j] += six_rows[..., k]
    return result


def _coupling_and_rate(closure: Closure, section: Floats, rates: Floats) -> tuple[Floats, Floats]:
    # Returns the matrix C and the matrix dC/dt, shape (..., P, n) each. C = d psi / d q has the
    # derivatives of the P passive joints psi by the n joints q. `rates` are the velocities of all
    # joints and passive joints.
    n, P = closure.dof, closure.passive
    leading = section.shape[:-1]
    coupling = section[..., closure.coupling_at : closure.status_at].reshape(*leading, P, n)
    slopes, slope_rates = [], []
    at = closure.screws_at
    for loop in (loop for group in groups_from(closure.first) for loop in group.members()):
        ends = []
        for chain in (loop.there, loop.back):
            numbers = section[..., at : at + 6 * chain.entries]
            screws = np.swapaxes(numbers.reshape(*leading, chain.entries, 6), -1, -2)
            changing = _screw_rates(chain, first_entries(chain), screws, rates)
            ends.append([_by_variable(chain, vectors) for vectors in (screws, changing)])
            at += 6 * chain.entries
        there, back = ends
        slopes.append((back[0] - there[0])[..., loop.axes(), :])
        slope_rates.append((back[1] - there[1])[..., loop.axes(), :])
    by_variable, changing = (np.concatenate(rows, axis=-2) for rows in (slopes, slope_rates))
    following = changing[..., :n] + changing[..., n:] @ coupling
    return coupling, np.asarray(-np.linalg.solve(by_variable[..., n:], following))
