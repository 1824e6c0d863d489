"""
How a Jacobian changes with the joints, as far as measures need it: the slope of a weighted sum.

Where loops are closed, J = J_open G with G = [1; C] and C = -Phi_psi^-1 Phi_q, and G changes too.
Of Phi_x G = 0 along every motion follows Phi_psi dC = -dPhi_x G, so that the weights of J_psi dC
are, with mu = -Phi_psi^-T J_psi^T Y, weights mu G^T of the residual's slopes: of screws again.
"""

from ..forward import linear_equations
from ..forward.chain import Chain, Closure, Loop, LoopGroup
from ..layout import arrays, places
from ..layout.arrays import Flat, Numbers, WholeNumbers
from ..loops import residual

# Of one chain of a loop.
LOOP_SCREWS = 32


def write_of_screws(chain: Chain, screws: Flat, Y: Flat, gradient: Flat) -> None:
    """
    Fill gradient[k] = sum_j Y[j] . dJ[:, j]/dq_k for the geometric Jacobian (Y in base axes), of
    the screws of its entries; where loops are closed, k is any of its variables.
    """
    _write_of_screws(chain, screws, Y, gradient, 1)


def write_side_by_side(chain: Chain, screws: Flat, Y: Flat, gradient: Flat) -> None:
    """Fill the gradients of LANES poses as `write_of_screws` does of each."""
    _write_of_screws(chain, screws, Y, gradient, places.LANES)


def _write_of_screws(chain: Chain, screws: Flat, Y: Flat, gradient: Flat, lanes: int) -> None:
    # A joint f turns everything behind it by its screw (v_f, w_f) and moves the tool under
    # everything before it: for an entry e behind f (or f itself) dv_e = w_f x v_e and
    # dw_e = w_f x w_e; for one before it dv_e = w_e x v_f. So
    # g_f = w_f . sum_behind(v_e x Yv + w_e x Yw) + v_f . sum_before(Yv x w_e): two running sums.
    step = chain.entries * lanes
    before, behind = [0.0] * 48, [0.0] * 48  # three numbers of LANES poses
    arrays.fill(gradient, chain.variables * lanes, 0.0)
    for k in range(3 * lanes):
        before[k] = behind[k] = 0.0
    for k in range(chain.elements):
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            into = arrays.after(gradient, chain.joint[e] * lanes)
            _add_along(arrays.after(screws, e * lanes), step, before, into, lanes)
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            y = arrays.after(Y, 6 * chain.joint[e] * lanes)
            _add_turned(y, arrays.after(screws, e * lanes), step, before, lanes)
    for k in range(chain.elements - 1, -1, -1):
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            y = arrays.after(Y, 6 * chain.joint[e] * lanes)
            _add_carried(y, arrays.after(screws, e * lanes), step, behind, lanes)
        for e in range(chain.first_entry[k], chain.first_entry[k + 1]):
            into = arrays.after(gradient, chain.joint[e] * lanes)
            _add_along(arrays.after(screws, e * lanes + 3 * step), step, behind, into, lanes)


def _add_turned(Y: Flat, screw: Flat, step: int, total: Numbers, lanes: int) -> None:
    # Of an entry: Yv x w, `step` numbers between the components of its screw.
    w = arrays.after(screw, 3 * step)
    for lane in range(lanes):
        x, y, z = Y[lane], Y[lanes + lane], Y[2 * lanes + lane]
        wx, wy, wz = w[lane], w[step + lane], w[2 * step + lane]
        total[lane] += y * wz - z * wy
        total[lanes + lane] += z * wx - x * wz
        total[2 * lanes + lane] += x * wy - y * wx


def _add_carried(Y: Flat, screw: Flat, step: int, total: Numbers, lanes: int) -> None:
    # Of an entry: v x Yv + w x Yw.
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
    # Of half a screw: its product with a sum.
    for lane in range(lanes):
        x, y, z = total[lane], total[lanes + lane], total[2 * lanes + lane]
        gradient[lane] += screw[lane] * x + screw[step + lane] * y + screw[2 * step + lane] * z


def room(chain: Chain) -> int:
    """Return how many numbers `write_gradient` and `write_determinants` need room for."""
    if chain.loops == 0:
        return 0
    slopes = places.MOST_LOOP_ROWS * places.MOST_LOOP_ROWS
    return 8 * chain.variables + 6 * LOOP_SCREWS + chain.closure.passive * chain.dof + slopes


def write_gradient(chain: Chain, row: Flat, Y: Flat, gradient: Flat, work: Flat) -> None:
    """Fill the gradient as `write_of_screws` does, by the joints, of a row; Y (n, 6)."""
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
    total = work
    weights = arrays.after(total, variables)
    mu = arrays.after(weights, 6 * variables)
    free = arrays.after(mu, passive * n)
    arrays.copy(weights, 6 * n, Y)
    for a in range(passive):
        for i in range(6):
            weights[6 * (n + a) + i] = 0.0
            for j in range(n):
                weights[6 * (n + a) + i] += coupling[a * n + j] * Y[6 * j + i]
    write_of_screws(chain, screws, weights, total)
    # What the passive variables' screws are weighted with: J_psi^T Y.
    arrays.fill(mu, passive * n, 0.0)
    for e in range(chain.entries):
        a = chain.joint[e] - n
        if a >= 0:
            for j in range(n):
                for i in range(6):
                    mu[a * n + j] += screws[i * chain.entries + e] * Y[6 * j + i]
    own = arrays.after(section, closure.screws_at)
    _add_groups(closure.first, closure.groups, closure, section, own, mu, weights, total, free)
    _follow(n, passive, coupling, total, gradient)


def _follow(n: int, passive: int, coupling: Flat, total: Flat, gradient: Flat) -> None:
    # By the joints, of what is by all variables.
    for j in range(n):
        gradient[j] = total[j]
        for a in range(passive):
            gradient[j] += coupling[a * n + j] * total[n + a]


def _add_groups(
    group: LoopGroup,
    left: int,
    closure: Closure,
    section: Flat,
    screws: Flat,
    mu: Flat,
    weights: Flat,
    total: Flat,
    free: Flat,
) -> None:
    # The later groups first: they move with the variables of the earlier ones.
    if left > 1:
        following = arrays.after(screws, 6 * group.entries)
        _add_groups(
            group.following, left - 1, closure, section, following, mu, weights, total, free
        )
    n, count = closure.dof, group.count
    gap, order = [0.0] * 18, [0] * 18
    slopes = _behind_screws(closure, free)
    residual.write_slopes(group, screws, slopes)
    linear_equations.factorise(slopes, count, order)
    own = arrays.after(mu, (group.first - n) * n)
    for j in range(n):
        for i in range(count):
            gap[i] = -own[i * n + j]
        linear_equations.solve_transposed(slopes, count, order, gap)
        for i in range(count):
            own[i * n + j] = gap[i]
    coupling = arrays.after(section, closure.coupling_at)
    _add_loops(group.loop, group.loops, group, closure, coupling, screws, mu, weights, total, free)


def _behind_screws(closure: Closure, free: Flat) -> Flat:
    # Room for the slopes of a group, behind that of `_add_residual`.
    return arrays.after(free, closure.variables + 6 * LOOP_SCREWS)


def _add_loops(
    loop: Loop,
    left: int,
    group: LoopGroup,
    closure: Closure,
    coupling: Flat,
    screws: Flat,
    mu: Flat,
    weights: Flat,
    total: Flat,
    free: Flat,
) -> None:
    # Of a group, each in the axes where its chains begin.
    n, first = closure.dof, group.first
    own = arrays.after(mu, (first - n + loop.row) * n)
    arrays.fill(weights, 6 * closure.variables, 0.0)
    for i in range(loop.count):
        axis = loop.axis[i]
        for j in range(n):
            weights[6 * j + axis] += own[i * n + j]
            for a in range(first + group.count - n):
                weights[6 * (n + a) + axis] += own[i * n + j] * coupling[a * n + j]
    _add_residual(loop, screws, weights, total, free)
    # The variables of earlier groups move this one's residual.
    _pass_on(loop.there, first, n, loop, screws, 0, -1.0, own, mu)
    _pass_on(loop.back, first, n, loop, screws, 6 * loop.there.entries, 1.0, own, mu)
    if left > 1:
        following = arrays.after(screws, 6 * loop.entries)
        _add_loops(
            loop.following,
            left - 1,
            group,
            closure,
            coupling,
            following,
            mu,
            weights,
            total,
            free,
        )


def _pass_on(
    chain: Chain,
    first: int,
    n: int,
    loop: Loop,
    screws: Numbers,
    at: int,
    sign: float,
    own: Flat,
    mu: Flat,
) -> None:
    for e in range(chain.entries):
        variable = chain.joint[e]
        if n <= variable < first:
            for j in range(n):
                for i in range(loop.count):
                    slope = sign * screws[at + 6 * e + loop.axis[i]]
                    mu[(variable - n) * n + j] += slope * own[i * n + j]


def _add_residual(loop: Loop, screws: Numbers, weights: Flat, total: Flat, free: Flat) -> None:
    # The gradient of the weighted slopes of a loop's residual, added up.
    gradient = free
    own = arrays.after(free, loop.there.dof)
    _side_by_side(loop.there, screws, 0, own)
    write_of_screws(loop.there, own, weights, gradient)
    for k in range(loop.there.dof):
        total[k] -= gradient[k]
    _side_by_side(loop.back, screws, 6 * loop.there.entries, own)
    write_of_screws(loop.back, own, weights, gradient)
    for k in range(loop.there.dof):
        total[k] += gradient[k]


def _side_by_side(chain: Chain, screws: Numbers, at: int, own: Flat) -> None:
    for e in range(chain.entries):
        for i in range(6):
            own[i * chain.entries + e] = screws[at + 6 * e + i]


def write_determinants(chain: Chain, row: Flat, results: Flat, work: Flat) -> None:
    """
    Fill the determinant of the slopes of each group's residual by its own passive variables, and
    its gradient by the joints: 1 + n numbers a group.
    """
    arrived = arrays.after(row, chain.closure_at)
    screws = arrays.after(arrived, chain.closure.screws_at)
    _write_determinant(
        chain.closure.first, chain.groups, chain.closure, arrived, screws, results, work
    )


def _write_determinant(
    group: LoopGroup,
    left: int,
    closure: Closure,
    section: Flat,
    screws: Flat,
    results: Flat,
    work: Flat,
) -> None:
    # d det = det trace(slopes^-1 d slopes).
    n, count, variables = closure.dof, group.count, closure.variables
    order = [0] * 18
    total = work
    weights = arrays.after(total, variables)
    free = arrays.after(weights, 6 * variables)
    slopes = _behind_screws(closure, free)
    residual.write_slopes(group, screws, slopes)
    determinant = linear_equations.factorise(slopes, count, order)
    arrays.fill(total, variables, 0.0)
    _add_inverse(
        group.loop, group.loops, group, determinant, slopes, order, screws, weights, total, free
    )
    results[0] = determinant
    coupling = arrays.after(section, closure.coupling_at)
    _follow(n, closure.passive, coupling, total, arrays.after(results, 1))
    if left > 1:
        following = arrays.after(screws, 6 * group.entries)
        others = arrays.after(results, 1 + n)
        _write_determinant(group.following, left - 1, closure, section, following, others, work)


def _add_inverse(
    loop: Loop,
    left: int,
    group: LoopGroup,
    determinant: float,
    slopes: Flat,
    order: WholeNumbers,
    screws: Flat,
    weights: Flat,
    total: Flat,
    free: Flat,
) -> None:
    # The slopes of each loop of a group, weighted with the columns of det slopes^-1.
    gap = [0.0] * 18
    arrays.fill(weights, 6 * group.variables, 0.0)
    for i in range(loop.count):
        for k in range(group.count):
            gap[k] = determinant if k == loop.row + i else 0.0
        linear_equations.solve(slopes, group.count, order, gap)
        for k in range(group.count):
            weights[6 * (group.first + k) + loop.axis[i]] = gap[k]
    _add_residual(loop, screws, weights, total, free)
    if left > 1:
        following = arrays.after(screws, 6 * loop.entries)
        _add_inverse(
            loop.following,
            left - 1,
            group,
            determinant,
            slopes,
            order,
            following,
            weights,
            total,
            free,
        )
