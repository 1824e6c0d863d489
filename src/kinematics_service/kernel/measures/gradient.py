# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute gradients with respect to the joint positions: the gradient of a weighted sum of the
entries of a Jacobian, and the gradients of loop determinants.

Let an arm with closed loops have joints q, passive variables psi, and x = (q, psi). The columns of
the Jacobian J_x = [J_q, J_psi] are the tool's motions at unit velocity of each variable. C is the
derivative of psi with respect to q. Then J = J_q + J_psi C = J_x G, where G = [I; C] is the
identity above C. A joint motion changes J_x by dJ_x, and C by dC. So J changes by
dJ = dJ_x G + J_psi dC.

Let Phi(x) be the residual of the loops, and Phi_x = [Phi_q, Phi_psi] its derivatives. The loops
stay closed, so Phi_x G = 0 at all joint positions. The change of this product is 0, too:
dPhi_x G + Phi_psi dC = 0. So dC = -Phi_psi^-1 dPhi_x G.

Each entry of J has a weight in the array Y. The gradient is the weighted sum of the entries of dJ.
It is the sum of two terms:

- the sum of the entries of dJ_x with the weights Y G^T;
- the sum of the entries of dPhi_x with the weights mu G^T, where mu = -Phi_psi^-T J_psi^T Y. This
  term comes from J_psi dC.

The columns of Phi_x are screws like the columns of J_x, so one function computes both terms.
"""

from ..forward import linear_equations
from ..forward.chain import Chain, Closure, Loop, LoopGroup
from ..layout import arrays, places
from ..layout.arrays import Flat, Numbers, WholeNumbers
from ..loops import residual

# Largest number of screws of one chain of a loop; equal to places.MAX_LOOP_ENTRIES.
LOOP_SCREWS = 32


def write_of_screws(chain: Chain, screws: Flat, Y: Flat, gradient: Flat) -> None:
    """
    Fill gradient[k] = sum_j Y[j] . dJ[:, j]/dq_k for the geometric Jacobian J and weights Y.

    `screws` has one screw for each entry of the chain. An entry is a pair: an element of the
    chain, and a joint that moves the element. Column j of J is the sum of the screws of joint j. Y
    is in base axes. If the arm has loops, j and k run over all joints and passive variables.
    """
    _write_of_screws(chain, screws, Y, gradient, 1)


def write_side_by_side(chain: Chain, screws: Flat, Y: Flat, gradient: Flat) -> None:
    """Fill the gradients of `write_of_screws` for LANES poses at once, in interleaved arrays."""
    _write_of_screws(chain, screws, Y, gradient, places.LANES)


def _write_of_screws(chain: Chain, screws: Flat, Y: Flat, gradient: Flat, lanes: int) -> None:
    # Y[j] has six weights for column j of the Jacobian J. Let S be the sum of Y[j] . J[:, j] over
    # all joints j. The function computes the derivative of S by each joint.
    # An entry is a pair: an element of the chain, and a joint that moves the element. The screw of
    # entry e has the velocity v_e of the tool's origin and the angular velocity w_e, at unit
    # velocity of the joint. Let Yv and Yw be the linear and the angular weights of this joint.
    # Then S is the sum of v_e . Yv + w_e . Yw over all entries e.
    # A unit motion of entry f rotates each entry e that is nearer to the tool than f:
    # dv_e = w_f x v_e and dw_e = w_f x w_e. The formulas also hold for e = f. If e is nearer to
    # the base than f, the motion of f only moves the tool's origin: dv_e = w_e x v_f.
    # So the motion of f changes S by w_f . later + v_f . earlier. `later` is a sum over f and all
    # entries e nearer to the tool than f: the sum of v_e x Yv + w_e x Yw. `earlier` is a sum over
    # all entries e nearer to the base than f: the sum of Yv x w_e.
    step = chain.entries * lanes
    earlier, later = [0.0] * 48, [0.0] * 48  # three numbers for each of LANES poses
    arrays.fill(gradient, chain.variables * lanes, 0.0)
    for k in range(3 * lanes):
        earlier[k] = later[k] = 0.0
    for k in range(chain.elements):
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            into = arrays.after(gradient, chain.joint[e] * lanes)
            _add_along(arrays.after(screws, e * lanes), step, earlier, into, lanes)
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            y = arrays.after(Y, 6 * chain.joint[e] * lanes)
            _add_turned(y, arrays.after(screws, e * lanes), step, earlier, lanes)
    for k in range(chain.elements - 1, -1, -1):
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            y = arrays.after(Y, 6 * chain.joint[e] * lanes)
            _add_carried(y, arrays.after(screws, e * lanes), step, later, lanes)
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            into = arrays.after(gradient, chain.joint[e] * lanes)
            _add_along(arrays.after(screws, e * lanes + 3 * step), step, later, into, lanes)


def _add_turned(Y: Flat, screw: Flat, step: int, total: Numbers, lanes: int) -> None:
    # Adds the vector product Yv x w to `total`. Yv is the first three of the six weights in Y, and
    # w is the angular part of `screw`. The components of `screw` are `step` numbers apart.
    w = arrays.after(screw, 3 * step)
    for lane in range(lanes):
        x, y, z = Y[lane], Y[lanes + lane], Y[2 * lanes + lane]
        wx, wy, wz = w[lane], w[step + lane], w[2 * step + lane]
        total[lane] += y * wz - z * wy
        total[lanes + lane] += z * wx - x * wz
        total[2 * lanes + lane] += x * wy - y * wx


def _add_carried(Y: Flat, screw: Flat, step: int, total: Numbers, lanes: int) -> None:
    # Adds the vector products v x Yv + w x Yw to `total`. v and w are the linear and the angular
    # part of `screw`. Yv is the first three of the six weights in Y, and Yw is the last three.
    w = arrays.after(screw, 3 * step)
    for lane in range(lanes):
        x, y, z = Y[lane], Y[lanes + lane], Y[2 * lanes + lane]
        a, b, c = Y[3 * lanes + lane], Y[4 * lanes + lane], Y[5 * lanes + lane]
        vx, vy, vz = screw[lane], screw[step + lane], screw[2 * step + lane]
        wx, wy, wz = w[lane], w[step + lane], w[2 * step + lane]
        total[lane] += vy * z - vz * y + wy * c - wz * b
        total[lanes + lane] += vz * x - vx * z + wz * a - wx * c
        total[2 * lanes + lane] += vx * y - vy * x + wx * b - wy * a


def _add_along(screw: Flat, step: int, total: Numbers, gradient: Flat, lanes: int) -> None:
    # Adds to the gradient the scalar product of `total` and one half of a screw: the linear or the
    # angular part. The array `screw` begins at this half.
    for lane in range(lanes):
        x, y, z = total[lane], total[lanes + lane], total[2 * lanes + lane]
        gradient[lane] += screw[lane] * x + screw[step + lane] * y + screw[2 * step + lane] * z


def room(chain: Chain) -> int:
    """Return how many numbers of scratch memory `write_gradient` and `write_determinants` need."""
    if chain.loops == 0:
        return 0
    return _room_of_groups(chain.variables) + chain.closure.passive * chain.dof


def _room_of_groups(variables: int) -> int:
    # The scratch memory `work` has two parts: one for `_add_residual`, then one for the
    # derivatives of the residual of a group of loops. Returns the length of the two parts
    # together.
    return 8 * variables + 6 * LOOP_SCREWS + places.MAX_LOOP_ROWS * places.MAX_LOOP_ROWS


def write_gradient(chain: Chain, row: Flat, Y: Flat, gradient: Flat, work: Flat) -> None:
    """
    Fill `gradient` (n,) with the gradient of sum(Y * J^T) with respect to the joints, at the pose
    of a row of results. The weights Y (n, 6) are constant.
    """
    screws = arrays.after(row, chain.screws_at)
    if chain.loops == 0:
        write_of_screws(chain, screws, Y, gradient)
    else:
        _write_closed(chain, chain.closure, row, Y, gradient, work)


def _write_closed(
    chain: Chain, closure: Closure, row: Flat, Y: Flat, gradient: Flat, work: Flat
) -> None:
    n, variables, passive = chain.dof, chain.variables, closure.passive
    section = arrays.after(row, chain.closure_at)
    coupling = arrays.after(section, closure.coupling_at)
    screws = arrays.after(row, chain.screws_at)
    weights = arrays.after(work, variables)
    mu = arrays.after(work, _room_of_groups(variables))
    arrays.copy(weights, 6 * n, Y)
    for a in range(passive):
        for i in range(6):
            weights[6 * (n + a) + i] = 0.0
            for j in range(n):
                weights[6 * (n + a) + i] += coupling[a * n + j] * Y[6 * j + i]
    write_of_screws(chain, screws, weights, work)
    # Fill mu (passive variables, n) with J_psi^T Y (see the module's docstring). Column a of J_psi
    # is the motion of the tool at unit velocity of passive variable a. Y[j] has six weights for
    # column j of J. `_add_groups` later multiplies mu by -Phi_psi^-T.
    arrays.fill(mu, passive * n, 0.0)
    for e in range(chain.entries):
        a = chain.joint[e] - n
        if a >= 0:
            for j in range(n):
                for i in range(6):
                    mu[a * n + j] += screws[i * chain.entries + e] * Y[6 * j + i]
    loop_screws = arrays.after(section, closure.screws_at)
    _add_groups(closure.first, closure.groups, closure, coupling, loop_screws, mu, work)
    _reduce_to_joints(n, passive, coupling, work, gradient)


def _reduce_to_joints(n: int, passive: int, coupling: Flat, total: Flat, gradient: Flat) -> None:
    # `total` has the derivatives of a function with respect to all joints and passive variables.
    # Computes the gradient with respect to the joints by the chain rule, because the passive
    # variables depend on the joints.
    for j in range(n):
        gradient[j] = total[j]
        for a in range(passive):
            gradient[j] += coupling[a * n + j] * total[n + a]


def _add_groups(
    group: LoopGroup,
    groups: int,
    closure: Closure,
    coupling: Flat,
    screws: Flat,
    mu: Flat,
    work: Flat,
) -> None:
    # The gradient has two terms. The second term is the weighted sum of the entries of dPhi_x (see
    # the module's docstring). Adds to `work` the part of the second term that comes from `group`
    # and all later groups of loops. Also multiplies mu, from which the weights follow, by
    # -Phi_psi^-T. The function calls itself for the later groups first, because each group changes
    # the rows of mu that belong to earlier groups.
    if groups > 1:
        following = arrays.after(screws, 6 * group.entries)
        _add_groups(group.following, groups - 1, closure, coupling, following, mu, work)
    n, count = closure.dof, group.count
    gap, order = [0.0] * 18, [0] * 18
    slopes = _slopes_in(work, closure.variables)
    residual.write_slopes(group, screws, slopes)
    linear_equations.factorise(slopes, count, order)
    block = arrays.after(mu, (group.first - n) * n)
    for j in range(n):
        for i in range(count):
            gap[i] = -block[i * n + j]
        linear_equations.solve_transposed(slopes, count, order, gap)
        for i in range(count):
            block[i * n + j] = gap[i]
    _add_loops(group.loop, group, n, coupling, screws, mu, work)


def _slopes_in(work: Flat, variables: int) -> Flat:
    # Returns the part of `work` that stores the derivatives of a group's residual. This part
    # follows the part that `_add_residual` uses.
    return arrays.after(work, 8 * variables + 6 * LOOP_SCREWS)


def _add_loops(
    loop: Loop, group: LoopGroup, n: int, coupling: Flat, screws: Flat, mu: Flat, work: Flat
) -> None:
    # The gradient has two terms. The second term is the weighted sum of the entries of dPhi_x (see
    # the module's docstring). Adds to `work` the part of the second term that comes from `loop`
    # and the following loops of the group. The screws and weights of a loop are in the axes of the
    # frame in which the two chains of the loop begin.
    first = group.first
    weights = arrays.after(work, group.variables)
    block = arrays.after(mu, (first - n + loop.row) * n)
    arrays.fill(weights, 6 * group.variables, 0.0)
    for i in range(loop.count):
        axis = loop.axis[i]
        for j in range(n):
            weights[6 * j + axis] += block[i * n + j]
            for a in range(first + group.count - n):
                weights[6 * (n + a) + axis] += block[i * n + j] * coupling[a * n + j]
    _add_residual(loop, screws, work)
    # `_add_groups` multiplies mu by -Phi_psi^-T, one group after another, the last group first.
    # Passive variables of earlier groups also change the residual of this loop. So the loop adds a
    # term to each row of mu that belongs to a passive variable of an earlier group.
    back = arrays.after(screws, 6 * loop.there.entries)
    _add_to_earlier_groups(loop, loop.there, -1.0, first, n, screws, block, mu)
    _add_to_earlier_groups(loop, loop.back, 1.0, first, n, back, block, mu)
    if loop.following is not None:
        following = arrays.after(screws, 6 * loop.entries)
        _add_loops(loop.following, group, n, coupling, following, mu, work)


def _add_to_earlier_groups(
    loop: Loop, chain: Chain, sign: float, first: int, n: int, screws: Flat, block: Flat, mu: Flat
) -> None:
    for e in range(chain.entries):
        variable = chain.joint[e]
        if n <= variable < first:
            for j in range(n):
                for i in range(loop.count):
                    slope = sign * screws[6 * e + loop.axis[i]]
                    mu[(variable - n) * n + j] += slope * block[i * n + j]


def _add_residual(loop: Loop, screws: Flat, work: Flat) -> None:
    # Let R_k be the derivative of the loop's residual by variable k, with six components. Let W_k
    # be six weights, and S the sum over all variables of W_k . R_k. Adds the gradient of S to the
    # first part of `work`, with one number for each variable. The second part of `work` has the
    # weights W_k. The rest of `work` is scratch memory.
    _add_end(loop.there, -1.0, screws, work)
    _add_end(loop.back, 1.0, arrays.after(screws, 6 * loop.there.entries), work)


def _add_end(chain: Chain, sign: float, screws: Flat, work: Flat) -> None:
    variables = chain.dof
    gradient = arrays.after(work, 7 * variables)
    transposed = arrays.after(work, 8 * variables)
    for e in range(chain.entries):
        for i in range(6):
            transposed[i * chain.entries + e] = screws[6 * e + i]
    write_of_screws(chain, transposed, arrays.after(work, variables), gradient)
    for k in range(variables):
        work[k] += sign * gradient[k]


def write_determinants(chain: Chain, row: Flat, results: Flat, work: Flat) -> None:
    """
    Fill `results` with the loop determinant of each group of loops and its gradient with respect
    to the joints.

    `results` has 1 + n numbers for each group. The loop determinant is det(S), where S is the
    matrix of the derivatives of the group's residual with respect to the group's passive
    variables.
    """
    section = arrays.after(row, chain.closure_at)
    screws = arrays.after(section, chain.closure.screws_at)
    coupling = arrays.after(section, chain.closure.coupling_at)
    _write_determinant(
        chain.closure.first, chain.groups, chain.dof, coupling, screws, results, work
    )


def _write_determinant(
    group: LoopGroup, groups: int, n: int, coupling: Flat, screws: Flat, results: Flat, work: Flat
) -> None:
    # Writes a loop determinant and its gradient. Let S (`slopes`) be the matrix of the derivatives
    # of the group's residual with respect to the group's passive variables. The loop determinant
    # is det(S). If S changes by dS, det(S) changes by det(S) trace(S^-1 dS) (Jacobi's formula).
    order = [0] * 18
    slopes = _slopes_in(work, group.variables)
    residual.write_slopes(group, screws, slopes)
    results[0] = linear_equations.factorise(slopes, group.count, order)
    arrays.fill(work, group.variables, 0.0)
    _add_inverse(group.loop, group, results[0], slopes, order, screws, work)
    _reduce_to_joints(n, group.variables - n, coupling, work, arrays.after(results, 1))
    if groups > 1:
        following = arrays.after(screws, 6 * group.entries)
        others = arrays.after(results, 1 + n)
        _write_determinant(group.following, groups - 1, n, coupling, following, others, work)


def _add_inverse(
    loop: Loop,
    group: LoopGroup,
    determinant: float,
    slopes: Flat,
    order: WholeNumbers,
    screws: Flat,
    work: Flat,
) -> None:
    # `slopes` is the matrix of the derivatives of the group's residual with respect to the group's
    # passive variables. The gradient of the determinant is a weighted sum of the gradients of the
    # entries of `slopes`. The weight of an entry is its cofactor. Adds to `work` the terms of this
    # sum for this loop and for the following loops of the group.
    gap = [0.0] * 18
    weights = arrays.after(work, group.variables)
    arrays.fill(weights, 6 * group.variables, 0.0)
    for i in range(loop.count):
        for k in range(group.count):
            gap[k] = determinant if k == loop.row + i else 0.0
        linear_equations.solve(slopes, group.count, order, gap)
        for k in range(group.count):
            weights[6 * (group.first + k) + loop.axis[i]] = gap[k]
    _add_residual(loop, screws, work)
    if loop.following is not None:
        following = arrays.after(screws, 6 * loop.entries)
        _add_inverse(loop.following, group, determinant, slopes, order, following, work)
