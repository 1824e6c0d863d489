# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Move joint positions onto a curve of solutions by Newton's method, and compute the tangent of the
curve.

Allgower and Georg, Introduction to Numerical Continuation Methods, section 3.3: the target
prescribes n - 1 components of the tool's pose for n joints. So it gives n - 1 equations, and their
Jacobian has n - 1 rows and n columns. An additional last row, called the border, makes the matrix
square. Newton's method then corrects the joint positions in a direction perpendicular to the
border. The tangent of the curve is the null vector of the Jacobian.
"""

import math

from ..forward import linear_equations
from ..inverse.residuals import Residual
from ..layout import arrays, places
from ..layout.arrays import Floats

# Largest number of Newton steps; three steps are usual after a step along the curve.
MAX_NEWTON_STEPS = 12
# Newton's method ends if a step is shorter than this, rad or m. Convergence is quadratic, so the
# next step would be about 1e-14, which is round-off.
STEP_TOLERANCE = 1e-7


class CurvePoint:
    """
    Joint positions on a curve of inverse kinematics solutions, and the tangent of the curve at
    these positions.

    Parameters
    ----------
    residual
        The residual of the target. For n joints, n - 1 of its six rows have a positive weight.
    periods : shape (n,), rad or m
        Motion of a joint after which the tool has the same pose; 1e12 for a joint without such a
        motion.

    Attributes
    ----------
    q, tangent : shape (n,)
        Joint positions, rad or m, and the unit tangent of the curve at q. The scalar product of
        the tangent and `border` is positive.
    border : shape (n,)
        Last row of the linear system of Newton's method. Corrections of q are perpendicular to
        this vector.
    orientation
        The sign of the determinant of a square matrix: the Jacobian (n - 1, n) of the target's
        equations, with the tangent as additional last row. The sign is constant along a curve. It
        is opposite on another curve that nearly crosses this curve (Allgower and Georg, definition
        2.1.1).
    """

    def __init__(self, residual: Residual, periods: Floats) -> None:
        self.residual, self.n = residual, residual.n
        n = residual.n
        self.periods = arrays.numbers(periods, n)
        self.q, self.tangent, self.border, self.ones = arrays.rooms(n, n, n, n)
        self.A, self.step = arrays.rooms(n * n, n)
        self.rows, self.order = arrays.whole_rooms(6, n)
        self.orientation: float = 1.0
        count = 0
        for i in range(6):
            if self.residual.weights[i] > 0.0:
                self.rows[count] = i
                count += 1
        if count != n - 1:
            raise TypeError('a self-motion has one joint more than its target has rows')
        arrays.fill(self.ones, n, 1.0)

    def look_along(self, side: float) -> None:
        """
        Set `border` to the unit tangent of the curve at q. `side` selects one of two directions.

        `side` is 1 or -1. The two unit tangents at q are opposite. The method takes the tangent
        with which `orientation` equals `side`.

        The tangent is the null vector of the Jacobian (n - 1, n) of the target's equations.
        Element j of the null vector is the determinant of the Jacobian with unit vector j as
        additional last row (a cofactor).
        """
        n, null = self.n, self.tangent
        arrays.fill(self.border, n, 0.0)
        for j in range(n):
            self.border[j] = side
            self.linearise()
            null[j] = linear_equations.factorise(self.A, n, self.order)
            self.border[j] = 0.0
        size: float = math.sqrt(arrays.dot(null, null, n))
        for j in range(n):
            self.border[j] = null[j] / size if size > 0.0 else 0.0

    def improve(self) -> bool:
        """
        Move q to a solution by Newton's method, and compute the tangent of the curve at the
        solution. Return whether Newton's method converged.
        """
        n, A, step = self.n, self.A, self.step
        for _ in range(MAX_NEWTON_STEPS):
            self.linearise()
            determinant: float = linear_equations.factorise(A, n, self.order)
            if determinant == 0.0:
                return False
            linear_equations.solve(A, n, self.order, step)
            square: float = arrays.dot(step, step, n)
            if not square < 1.0:
                return False
            for j in range(n):
                self.q[j] += step[j]
            if square < STEP_TOLERANCE * STEP_TOLERANCE:
                self.orientation = 1.0 if determinant > 0.0 else -1.0
                self._write_tangent()
                return True
        return False

    def linearise(self) -> None:
        """
        Fill the linear system of a Newton step: the matrix A, and `step` with the right side.

        The first n - 1 rows of A are the Jacobian of the target's equations at q. The last row is
        `border`. The right side has the errors of the n - 1 equations, then 0.
        """
        n = self.n
        self.residual.square(self.q, places.JACOBIAN)
        self.residual.write_columns(self.ones)
        for i in range(n - 1):
            row = self.rows[i]
            self.step[i] = self.residual.error[row]
            for j in range(n):
                self.A[i * n + j] = self.residual.columns[6 * j + row]
        self.step[n - 1] = 0.0
        arrays.copy(arrays.after(self.A, n * n - n), n, self.border)

    def _write_tangent(self) -> None:
        n, tangent = self.n, self.tangent
        arrays.fill(tangent, n, 0.0)
        tangent[n - 1] = 1.0
        linear_equations.solve(self.A, n, self.order, tangent)
        size: float = 1.0 / math.sqrt(arrays.dot(tangent, tangent, n))
        for j in range(n):
            tangent[j] *= size

    def way(self, j: int, motion: float) -> float:
        """
        Return a motion of joint j, rad or m, minus full turns. The size of the result is at most
        half a period of the joint.
        """
        return motion - self.periods[j] * math.floor(motion / self.periods[j] + 0.5)


def write_derivative(point: CurvePoint, q: Floats, derivative: Floats) -> None:
    """
    Write to `derivative` (n - 1, n) the Jacobian of the target's equations at joint positions q.

    The target prescribes n - 1 components of the tool's pose, and each component gives one
    equation. q (n,) is in rad or m.
    """
    n = point.n
    arrays.copy(point.q, n, arrays.numbers(q, n))
    point.linearise()
    arrays.copy(arrays.results(derivative, n * n - n), n * n - n, point.A)
