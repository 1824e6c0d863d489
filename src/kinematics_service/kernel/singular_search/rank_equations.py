# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the equations of a singular pose, and their derivatives, by the Schur complement of the
task Jacobian J_t.

Gaussian elimination with complete pivoting (Golub and Van Loan, Matrix Computations, section
3.4.8) stops after k - 1 pivots, where k is the generic rank. Then J_t = [A B; C D] up to the order
of rows and columns, where A has k - 1 rows and columns. The rank of J_t is below k if the Schur
complement S = D - C A^-1 B is zero.

Let I be an identity matrix, Y^T = [-C A^-1, I] and X = [-A^-1 B; I]. Then S = Y^T J_t X, and the
derivatives by the joints are dS = Y^T dJ_t X (Griewank and Reddien, 1984).

The norm of S is an upper bound of the k-th singular value of J_t. Proof: X contains an identity
matrix, so |v| >= |z| for each vector v = X z. J_t X = [0; S], so |J_t v| = |S z| <= |S| |v|. X has
n - k + 1 columns, where n is the number of joints. So the bound follows from the min-max theorem
for singular values.
"""

import math

from ..forward import chain_pass
from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats
from ..loops import closed_pass, closing
from ..measures import gradient, singular_values, singularity
from ..measures.task_rows import TaskRows
from . import jacobian_changes

# dS is the matrix of the derivatives of S by the joints, where S = 0 are the equations of a
# singular pose. A singular value of dS is taken as zero if its ratio to the largest singular value
# of dS is at most RANK_RATIO. If the DH table has errors of 1e-5, singular values that are 0
# without the errors have ratios of about 1e-5. So they are not taken as zero.
RANK_RATIO = 1e-6


class RankEquations:
    """
    Computes the linear equations S + dS d = 0 for d, a joint motion to a singular pose.

    S is the Schur complement of J_t (see the module's docstring). It is zero at a singular pose.
    The matrix dS is the derivative of S by the joints.

    d is in rad; prismatic joints are divided by the characteristic length.

    Parameters
    ----------
    chain, task
        The arm.
    spans : shape (n, 3)
        First position, range and period of each joint, as in `SingularAtlas`. The range 0 marks a
        joint that does not change the rank of J_t. Such a joint is not moved.

    Attributes
    ----------
    n, count
        Number of joints, and of entries of S.
    residual, size
        `residual` is the norm of S, an upper bound of the k-th singular value of J_t, where k is
        the generic rank. `size` is a lower bound of the largest singular value of J_t.
    """

    def __init__(self, chain: Chain, task: TaskRows, spans: Floats) -> None:
        self.chain, self.task = chain, task
        n, m = self.chain.dof, self.task.count
        self.n, self.m = n, m
        self.residual, self.size = 0.0, 0.0
        # Size the arrays for the largest S. If the elimination has fewer pivots, S has more
        # entries. The smallest number of pivots is k - 2, where k is the generic rank.
        self.pivots: int = max(task.generic_rank - 2, 0)
        self.idle: int = n - self.pivots
        self.lost: int = m - self.pivots
        self.count: int = self.idle * self.lost
        count, entries, m_n = self.count, self.chain.entries, m * n
        section = self.chain.frames_at - self.chain.closure_at
        work = gradient.room(self.chain)
        self.q, self.still, self.row = arrays.rooms(n, n, self.chain.frames_at)
        self.axes, self.M, self.S = arrays.rooms(3 * m, m_n, count)
        self.X, self.Y, self.G = arrays.rooms(self.idle * n, self.lost * 6, count * (n + count))
        self.slopes, self.changes, self.y = arrays.rooms(count, 6 * entries, m)
        self.section, self.home = arrays.rooms(section, self.chain.frames_at)
        self.weights, self.work = arrays.rooms(6 * n, work)
        self.W, self.sigma = arrays.rooms(min(m, n) * (m + n), min(m, n))
        self.mixed, self.units = arrays.rooms(count * (n + count), n)
        self.onto, self.along = arrays.rooms(n, n)
        self.rows, self.columns = arrays.whole_rooms(m, n)
        arrays.fill(self.still, n, 0.0)
        self.sigma[0] = 0.0
        self.stop_after(task.generic_rank - 1)
        for j in range(n):
            self.units[j] = self.task.column_scale[j] if spans[j, 1] > 0.0 else 0.0
        for i in range(m):
            axis = self.task.axis[i] if self.task.axis[i] < 3 else self.task.axis[i] - 3
            for k in range(3):
                along = self.task.rotation[3 * k + axis]
                self.axes[3 * i + k] = along * self.task.row_scale[i]

    def stop_after(self, pivots: int) -> None:
        """
        Set the number of pivots after which the Gaussian elimination of J_t stops.

        The rest of the matrix is the Schur complement S. So if there are fewer pivots, S has more
        entries.
        """
        self.pivots, self.idle, self.lost = pivots, self.n - pivots, self.m - pivots
        self.count = self.idle * self.lost

    def restart(self) -> None:
        """
        Restore the results for the arm that were given to `decompose`.

        The next `move_to` solves the loop equations. It starts at the passive variables in these
        results.
        """
        arrays.copy(self.row, self.chain.frames_at, self.home)

    def begin_assembled(self) -> None:
        """
        Let the next `restart` begin at the joint positions at which the loops are known to close;
        `decompose` need not be called.
        """
        if self.chain.loops > 0:
            section = arrays.after(self.home, self.chain.closure_at)
            arrays.copy(section, self.chain.closure.width, self.chain.closure.start)

    def move_to(self, origin: Flat, d: Flat) -> bool:
        """
        Evaluate S, which is zero at a singular pose, after a motion d from the joint positions
        `origin`. Return whether S was evaluated.

        If the arm has closed loops, the loops are closed at the new joint positions. If this
        fails, the method returns False, and the passive variables are as before the call. The
        method also returns False if a number is not finite.
        """
        for j in range(self.n):
            self.q[j] = origin[j] + self.task.column_scale[j] * d[j]
        if self.chain.loops == 0:
            chain_pass.write_jacobian(self.chain, self.q, self.row)
        elif not self._close():
            return False
        self._write_task_rows()
        self._eliminate()
        self._write_remainder()
        return self.residual < places.INFINITY

    def _close(self) -> bool:
        into = arrays.after(self.row, self.chain.closure_at)
        arrays.copy(self.section, self.chain.closure.width, into)
        if closing.close_next(self.chain.closure, self.section, self.q, into) != 0:
            arrays.copy(into, self.chain.closure.width, self.section)
            return False
        total = closed_pass.evaluate_closed(self.chain, self.still, places.JACOBIAN, self.row)
        return total < places.INFINITY

    def _write_task_rows(self) -> None:
        # Fills M with the scaled task Jacobian J_t, and `size` with a lower bound of its largest
        # singular value.
        n, squares = self.n, 0.0
        for i in range(self.m):
            axis = arrays.after(self.axes, 3 * i)
            half = 3 * n if self.task.axis[i] > 2 else 0
            x = arrays.after(self.row, places.JACOBIAN_AT + half)
            for j in range(n):
                along = axis[0] * x[j] + axis[1] * x[n + j] + axis[2] * x[2 * n + j]
                along *= self.task.column_scale[j]
                squares += along * along
                self.M[i * n + j] = along
        self.size = math.sqrt(squares / min(self.m, n))

    def _eliminate(self) -> None:
        # Gaussian elimination in place. At first, the array M has the blocks J_t = [A B; C D]. The
        # block A is replaced by its factors L and U. The block B is replaced by the product
        # L^-1 B, the block C by the product C U^-1, and the block D by the Schur complement S.
        # Rows and columns of M are not moved; `rows` and `columns` store their indices in the
        # order of the pivots.
        m, n, M, rows, columns = self.m, self.n, self.M, self.rows, self.columns
        for i in range(m):
            rows[i] = i
        for j in range(n):
            columns[j] = j
        for step in range(self.pivots):
            pivot, row, column = 0.0, step, step
            for i in range(step, m):
                below = arrays.after(M, rows[i] * n)
                for j in range(step, n):
                    if abs(below[columns[j]]) > pivot:
                        pivot, row, column = abs(below[columns[j]]), i, j
            rows[step], rows[row] = rows[row], rows[step]
            columns[step], columns[column] = columns[column], columns[step]
            pivot_row = arrays.after(M, rows[step] * n)
            inverse = 1.0 / pivot_row[columns[step]] if pivot > 0.0 else 0.0
            for i in range(step + 1, m):
                below = arrays.after(M, rows[i] * n)
                factor = below[columns[step]] * inverse
                below[columns[step]] = factor
                for j in range(step + 1, n):
                    below[columns[j]] -= factor * pivot_row[columns[j]]

    def _write_remainder(self) -> None:
        # Copies S from the result of the elimination, and fills the joint motions X and the tool
        # motions Y (see the module's docstring).
        n, first, M, squares = self.n, self.pivots, self.M, 0.0
        for a in range(self.lost):
            row = arrays.after(M, self.rows[first + a] * n)
            for b in range(self.idle):
                value = row[self.columns[first + b]]
                self.S[a * self.idle + b] = value
                squares += value * value
            self._write_tool_motion(a)
        for b in range(self.idle):
            self._write_joint_motion(b)
        self.residual = math.sqrt(squares)

    def _write_joint_motion(self, b: int) -> None:
        # Fills column b of X = [-A^-1 B; I] with a joint motion, rad or m, where J_t = [A B; C D].
        # The elimination has factored A = L U, and has written L^-1 B to the right of U. Let c be
        # column b of L^-1 B. Solves U x = -c by back substitution.
        n, first, M, columns = self.n, self.pivots, self.M, self.columns
        x = arrays.after(self.X, b * n)
        arrays.fill(x, n, 0.0)
        x[columns[first + b]] = 1.0
        for k in range(first - 1, -1, -1):
            row = arrays.after(M, self.rows[k] * n)
            value = -row[columns[first + b]]
            for i in range(k + 1, first):
                value -= row[columns[i]] * x[columns[i]]
            pivot = row[columns[k]]
            x[columns[k]] = value / pivot if pivot != 0.0 else 0.0
        for j in range(n):
            x[j] *= self.task.column_scale[j]

    def _write_tool_motion(self, a: int) -> None:
        # Fills row `a` of Y^T = [-C A^-1, I] with a tool motion in base axes, where
        # J_t = [A B; C D]. The elimination has factored A = L U, and has written C U^-1 below L.
        # Let r be row `a` of C U^-1. Solves y^T L = -r, beginning with the last component of y.
        first, y = self.pivots, self.y
        last = arrays.after(self.M, self.rows[first + a] * self.n)
        tool = arrays.after(self.Y, 6 * a)
        arrays.fill(tool, 6, 0.0)
        self.add_tool_motion(self.rows[first + a], 1.0, tool)
        for k in range(first - 1, -1, -1):
            value = -last[self.columns[k]]
            for i in range(k + 1, first):
                value -= y[i] * self.M[self.rows[i] * self.n + self.columns[k]]
            y[k] = value
            self.add_tool_motion(self.rows[k], value, tool)

    def add_tool_motion(self, row: int, factor: float, tool: Flat) -> None:
        """
        Add `factor` times the axis of one row of J_t to the tool motion `tool` (6,), in base axes.

        Row `row` of J_t gives the component of the tool's velocity along or about this axis.
        """
        half = 3 if self.task.axis[row] > 2 else 0
        for k in range(3):
            tool[half + k] += factor * self.axes[3 * row + k]

    def are_singular(self, ratio: float) -> bool:
        """
        Return whether the task Jacobian J_t is singular.

        S is the Schur complement of J_t (see the module's docstring). J_t is taken as singular if
        the norm of S is at most `ratio` times the largest singular value of J_t, or at most
        `TaskRows.zero`.

        The largest singular value of J_t at the present pose is not computed. Instead, the larger
        of two numbers is taken. The first is `size`, a lower bound of this singular value. The
        second is the largest singular value at the pose given to `decompose`.
        """
        return self.residual <= max(ratio * max(self.size, self.sigma[0]), self.task.zero)

    def linearise(self) -> None:
        """
        Fill G with dS, the derivatives of S by the joints, and make the rows of G orthogonal.
        """
        self.write_slopes()
        self.orthogonalise()

    def write_slopes(self) -> None:
        """Fill G with dS: for each entry of S one row of n derivatives by the joints."""
        n, count = self.n, self.count
        for b in range(self.idle):
            x = arrays.after(self.X, b * n)
            if self.chain.loops == 0:
                jacobian_changes.write_changes(self.chain, self.row, x, self.changes)
            for a in range(self.lost):
                slope = arrays.after(self.G, (a * self.idle + b) * (n + count))
                self.write_slope(x, arrays.after(self.Y, 6 * a), slope)

    def orthogonalise(self) -> None:
        """
        Rotate the rows of dS until they are orthogonal, and store the rotation matrix.

        The first n columns of G (count, n + count) are dS. The last columns receive the rotation
        matrix.
        """
        n, count = self.n, self.count
        for k in range(count):
            for i in range(count):
                self.G[k * (n + count) + n + i] = 1.0 if i == k else 0.0
        singular_values.orthogonalise(self.G, count, n, n + count, 1)
        singular_values.sort_by_norm(self.G, self.slopes, count, n, n + count, 1)

    def write_slope(self, x: Flat, y: Flat, slope: Flat) -> None:
        """
        Fill `slope` (n,) with the gradient of y^T J x by the joint positions, rad.

        J (6, n) is the geometric Jacobian, a function of the joint positions. The joint motion x
        (n,) and the tool motion y (6,) are constant. In the gradient, the positions of prismatic
        joints are divided by the characteristic length. If a joint never changes the rank of the
        task Jacobian, its component of the gradient is 0.
        """
        if self.chain.loops == 0:
            jacobian_changes.write_slope(self.chain, self.changes, y, slope)
        else:
            for j in range(self.n):
                for i in range(6):
                    self.weights[6 * j + i] = x[j] * y[i]
            gradient.write_gradient(self.chain, self.row, self.weights, slope, self.work)
        for j in range(self.n):
            slope[j] *= self.units[j]

    def condition_number(self) -> float:
        """Return the condition number of J_t at the pose given to `decompose`."""
        smallest = self.sigma[self.pivots]
        is_lost = smallest == 0.0 or self.sigma[0] <= self.task.zero
        return places.INFINITY if is_lost else self.sigma[0] / smallest

    def decompose(self, row: Flat) -> None:
        """
        Compute the singular value decomposition of J_t, and store a copy of `row`.

        `row` has the results for the arm at given joint positions, with the Jacobian.
        """
        arrays.copy(self.home, self.chain.frames_at, row)
        singularity.write_directions(self.n, self.task, self.home, self.W, self.sigma)

    def write_steps(self, d: Flat, onto: Flat, along: Flat) -> bool:
        """
        Fill `onto` and `along` (n,), two joint motions. After d, they lead to a singular pose.

        d is the joint motion of the last call of `move_to`. S is zero at a singular pose, and the
        matrix dS is the derivative of S by the joints. `onto` is the shortest joint motion that
        makes S zero to first order: dS * onto = -S. `along` is the part of -d that does not change
        S to first order: dS * along = 0. To first order, the sum d + onto + along is the shortest
        joint motion to a singular pose. Returns False if no joint motion changes S.
        """
        n, count = self.n, self.count
        for j in range(n):
            onto[j], along[j] = 0.0, -d[j]
        for i in range(count):
            slope = self.slopes[i]
            if not slope > RANK_RATIO * self.slopes[0] or not slope > 0.0:
                break
            row = arrays.after(self.G, i * (n + count))
            factor = arrays.dot(arrays.after(row, n), self.S, count) / (slope * slope)
            back = arrays.dot(row, d, n) / (slope * slope)
            for j in range(n):
                onto[j] -= factor * row[j]
                along[j] += back * row[j]
        return self.slopes[0] > 0.0 or self.residual == 0.0


def length_of(d: Flat, n: int) -> float:
    """Return the Euclidean length of a joint motion d (n,)."""
    return math.sqrt(arrays.dot(d, d, n))
