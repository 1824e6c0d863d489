# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compute the pose, Jacobian, twist and frames of an arm that may have closed loops."""

from ..forward import chain_pass
from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat
from . import closing


def evaluate_row(chain: Chain, q: Flat, qdot: Flat, depth: int, row: Flat) -> float:
    """
    Fill `row` with the results of `evaluation.evaluate` at one q; return a number that is finite
    if all results are finite.

    The number is NaN if a loop does not close.
    """
    if chain.loops == 0:
        return chain_pass.evaluate_row(chain, q, qdot, depth, row)
    if closing.close(chain.closure, q, arrays.after(row, chain.closure_at)) != 0:
        return places.NAN
    return evaluate_closed(chain, qdot, depth, row)


def evaluate_closed(chain: Chain, qdot: Flat, depth: int, row: Flat) -> float:
    """
    Fill a row of results of an arm with closed loops. The row must already have the joint
    positions and passive variables.
    """
    n, variables = chain.dof, chain.variables
    x = arrays.after(row, chain.closure_at)
    rates = arrays.after(x, variables)
    coupling = arrays.after(rates, variables)
    arrays.copy(rates, n, qdot)
    for i in range(variables - n):
        rate = 0.0
        for j in range(n):
            rate += coupling[i * n + j] * qdot[j]
        rates[n + i] = rate
    total = chain_pass.evaluate_row(chain, x, rates, depth, row)
    if depth >= places.JACOBIAN:
        _add_up_screws(chain, arrays.after(row, chain.screws_at), coupling, row)
    return total


def _add_up_screws(chain: Chain, screws: Flat, coupling: Flat, row: Flat) -> None:
    # Fills the Jacobian J. Each screw belongs to a joint or to a passive variable. Column j of J
    # is the sum of the screws of joint j, plus a sum over all passive variables: the screws of the
    # passive variable, multiplied by the derivative of the variable by joint j (in `coupling`).
    n, entries = chain.dof, chain.entries
    J = arrays.after(row, places.JACOBIAN_AT)
    arrays.fill(J, 6 * n, 0.0)
    for e in range(entries):
        variable = chain.joint[e]
        if variable < n:
            for i in range(6):
                J[i * n + variable] += screws[i * entries + e]
            continue
        for j in range(n):
            derivative = coupling[(variable - n) * n + j]
            for i in range(6):
                J[i * n + j] += derivative * screws[i * entries + e]
