"""Coupling of a closed loop by implicit differentiation, for loops that are no parallelogram."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import sympy

# Longer expressions, by their operations, stay as they are: to simplify one takes seconds.
MOST_OPERATIONS = 60


@dataclass(frozen=True)
class LoopCoupling:
    """
    How the passive joints of a closed loop follow the actuated ones.

    Attributes
    ----------
    passive
        d psi / d q, one row a passive joint.
    determinant
        Of d Phi / d psi: where it is 0 the loop is flat and may change its branch.
    """

    passive: Any
    determinant: Any


def simplified(expression: Any) -> Any:
    """Return an expression of sines and cosines in a shorter form, where that is soon found."""
    if sympy.count_ops(expression) > MOST_OPERATIONS:
        return expression
    return sympy.trigsimp(expression)


def loop_coupling(
    constraint: Sequence[Any], actuated: Sequence[Any], passive: Sequence[Any]
) -> LoopCoupling:
    """
    Return the coupling of a loop closed by Phi(q, psi) = 0.

    Phi stays 0 along every motion, dPhi/dq + dPhi/dpsi dpsi/dq = 0, so that
    dpsi/dq = -(dPhi/dpsi)^-1 dPhi/dq.

    Parameters
    ----------
    constraint
        Phi, as many expressions as there are passive joints.
    actuated, passive
        Symbols q and psi.
    """
    phi = sympy.Matrix(constraint)
    by_passive = phi.jacobian(list(passive))
    by_actuated = phi.jacobian(list(actuated))
    determinant = simplified(by_passive.det())
    rates = -by_passive.adjugate() * by_actuated / determinant
    return LoopCoupling(sympy.ImmutableMatrix(rates.applyfunc(simplified)), determinant)
