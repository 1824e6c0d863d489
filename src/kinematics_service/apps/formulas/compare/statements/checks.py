# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Check whether a formula of a matrix, a vector or a determinant is right.

A check also tests likely mistakes: it compares the values of a mistaken formula with the user's
values.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt
import sympy as sp

from .....robot.robot import Robot
from .....robot.task import TWIST_ROWS
from ...arm.numbers import DEGREE, Evaluation, Floats
from ...arm.table import general_row
from ...arm.world import World
from ..arm.quantities import ANGLES, Quantity, row_order, value_of
from ..text.file import Settings
from .names import ANGLE_IN_PLANE, FormulaNames
from .poses import Poses
from .statements import Statement

Mask = npt.NDArray[np.bool_]

# Largest round-off of a formula with some hundred operations. Two values a and b are equal if
# |a - b| <= ROUND_OFF * (1 + max(|a|, |b|)).
ROUND_OFF = 1e-9


@dataclass(frozen=True, eq=False)
class Check(ABC):
    """A formula of the user, evaluated at N configurations and compared with correct values."""

    robot: Robot
    names: FormulaNames
    statement: Statement
    poses: Poses

    @property
    def expressions(self) -> sp.Matrix:
        """Return the matrix of expressions that the user wrote."""
        return self.statement.value

    @property
    def reading(self) -> Settings:
        """Return the settings of the formula: how frames are numbered and rows of J ordered."""
        return self.statement.settings

    @cached_property
    def world(self) -> World:
        """Return the frames and the Jacobian of the robot file's table at the N configurations."""
        poses = self.poses
        return World(self.names.table, poses.values, poses.count, poses.coupling)

    @cached_property
    def evaluation(self) -> Evaluation:
        """
        Return the object that evaluates the user's expressions, with angles in the unit of the
        formula file.
        """
        values: Mapping[sp.Symbol, Floats] = self.poses.values
        degrees = self.statement.settings.degrees
        if degrees:
            turning = (*self.names.table.turning, ANGLE_IN_PLANE)
            values = {**values, **{symbol: values[symbol] / DEGREE for symbol in turning}}
        return Evaluation(values, self.poses.count, degrees)

    @cached_property
    def person(self) -> Floats:
        """Return the values of the formula that the user wrote, shape (N, rows, columns)."""
        return self.evaluation.of_matrix(self.expressions)

    @property
    def tolerance(self) -> float:
        """
        Return the tolerance: two values a and b are taken as equal if gap(a, b) is at most this.
        """
        decimals = self.statement.decimals
        return 0.5000001 * 10.0**-decimals if decimals else ROUND_OFF

    @property
    def shape(self) -> tuple[int, int]:
        """Return the numbers of rows and columns of the user's formula."""
        return int(self.expressions.rows), int(self.expressions.cols)

    def gap(self, x: Floats, y: Floats) -> Floats:
        """
        Return the difference |x - y| / (1 + max(|x|, |y|)), infinite if a value is undefined.

        If the formula consists of decimal numbers only, the divisor is 1.
        """
        with np.errstate(all='ignore'):
            larger = 0.0 if self.statement.decimals else np.maximum(np.abs(x), np.abs(y))
            gap = np.abs(x - y) / (1.0 + larger)
        return np.where(np.isfinite(gap), gap, np.inf)

    def agrees(self, x: Floats, y: Floats) -> Mask:
        """
        Compare two arrays of values, whose first axis counts the N configurations. Return a mask
        with the other axes: True where the values are equal at all configurations.
        """
        return np.asarray(np.all(self.gap(x, y) <= self.tolerance, axis=0))

    @property
    @abstractmethod
    def right(self) -> Floats:
        """Return the values that the user's formula should have, shape (N, rows, columns)."""

    @cached_property
    def wrong(self) -> Mask:
        """
        Return which entries are wrong. An entry is wrong if at some configuration it differs from
        the correct value by more than the rounding of the formula's decimal numbers explains.
        """
        wrong: Mask = ~self.agrees(self.person, self.right)
        if wrong.any() and self.statement.inexact is not None:
            wrong &= np.any(np.abs(self.person - self.right) > self.rounding, axis=0)
        return wrong

    @cached_property
    def rounding(self) -> Floats:
        """
        Return for each entry of the formula the largest error from rounding decimal numbers.

        A rounded decimal number has an error of at most half a unit of the last decimal. The
        result has shape (N, rows, columns).
        """
        moved, inexact = np.full_like(self.person, 0.0), self.statement.inexact
        assert inexact is not None  # the only caller, `wrong`, has checked `inexact`
        still = {symbol: np.zeros(self.poses.count) for symbol, _ in self.statement.half_units}
        for symbol, half in self.statement.half_units:
            at = {**self.evaluation.values, **still, symbol: np.full(self.poses.count, half)}
            near = Evaluation(at, self.poses.count, self.evaluation.degrees)
            moved += np.abs(near.of_matrix(inexact.value) - self.person)
            if inexact.left is not None:
                moved += np.abs(near.of(inexact.left)[:, None, None] - self.right)
        return moved * (1.0 + 1e-6) + ROUND_OFF

    @cached_property
    def is_one_configuration(self) -> bool:
        """
        Return whether all N configurations are equal, as after `at: q1=0, q2=90 deg` in the file.

        At a single configuration, a wrong entry may equal the correct entry by coincidence.
        """
        given = {*self.poses.chosen, *(s.name for s in self.names.table.constants)}
        still = not self.poses.randomised and not self.expressions.free_symbols - {
            s for s in self.poses.values if s.name in given
        }
        same = float(np.ptp(self.right, axis=0).max()) < 1e-12
        return still and same and bool(self.poses.chosen)

    def passes(self, values: Floats, right: Floats) -> bool:
        """
        Return whether the values (N,) of a repaired entry equal the values that it should have.
        """
        return bool(self.agrees(values, right))


class QuantityCheck(Check):
    """The check of a matrix, vector or determinant against the robot's value."""

    @property
    def quantity(self) -> Quantity:
        """Return the quantity that the formula defines."""
        assert self.statement.quantity is not None
        return self.statement.quantity

    @cached_property
    def right(self) -> Floats:
        """Return the values that the user's formula should have, shape (N, rows, columns)."""
        return self.right_of(self.world)

    def right_of(self, world: World, reading: Settings | None = None) -> Floats:
        """
        Return the correct values of the quantity that the user's formula defines.

        The values are computed from the frames and the Jacobian in `world`. Rows and columns that
        the formula lacks are left out.
        """
        return self.cut(self.whole_of(world, reading or self.reading), self.quantity)

    def whole_of(self, world: World, reading: Settings) -> Floats:
        """
        Return the correct values of the quantity that the user's formula defines.

        `right_of` leaves out rows and columns that the formula lacks; this method keeps all of
        them. The result has shape (N, rows, columns).
        """
        if self.quantity.kind == 'det':
            return task_determinant(self.robot, world)[:, None, None]
        if self.quantity.kind == 'general':
            table = replace(world.table, rows=(general_row(self.names.table),), variables=())
            return World(table, world.evaluation.values, world.poses).rows[0]
        return np.asarray(value_of(self.quantity, world, reading))

    def cut(self, whole: Floats, quantity: Quantity) -> Floats:
        """
        Return the part of the matrix `whole` that has the shape of the user's formula. Return
        `whole` itself if no part has this shape.
        """
        rows, columns = self.shape
        size = whole.shape[1:]
        if size == (rows, columns):
            return whole
        if size[1] == 1 and size == (columns, rows):
            return np.swapaxes(whole, 1, 2)
        if size == (3, 1) and (rows, columns) == (4, 1):
            return np.concatenate([whole, np.ones((len(whole), 1, 1))], axis=1)
        if size == (4, 4) and (rows, columns) in ((3, 4), (3, 3)):
            return whole[:, :rows, :columns]
        if quantity.kind == 'jacobian' and quantity.part == 'all' and not quantity.rows:
            picked = self.jacobian_rows
            if len(picked) == rows:
                return whole[:, picked]
        return whole

    @property
    def jacobian_rows(self) -> list[int]:
        """
        Return which rows of J the user's matrix contains, as indices: all rows, the task's rows,
        or the linear rows.
        """
        rows = self.shape[0]
        order = row_order(replace(self.quantity, part='all'), self.reading)
        if rows == 6 or self.quantity.rows:
            return list(range(rows))
        task = self.robot.singularity.task.axes.tolist()
        kept = task if rows == len(task) else [0, 1, 2]
        return [order.index(k) for k in kept]

    @cached_property
    def readings(self) -> tuple['QuantityCheck', ...]:
        """
        Return one check for each textbook definition of the Jacobian that the formula may follow,
        the most common definition first.
        """
        quantity, form = self.quantity, self.quantity.form
        if quantity.kind != 'jacobian' or quantity.rows or self.names.table.passive:
            return (self,)
        forms = tuple(ANGLES) if form == 'analytic' else (form,)
        orders = [self.reading.angular_first]
        if orders == [None] and form in ('space', 'body'):
            orders = [True, False]
        checks: list[QuantityCheck] = []
        for form, order in product(forms, orders):
            settings = replace(self.reading, angular_first=order)
            statement = replace(
                self.statement, quantity=replace(quantity, form=form), settings=settings
            )
            check = replace(self, statement=statement)
            checks.append(check)
            whole = check.whole_of(self.world, settings)
            # Select the rows that are nonzero at some configuration; in a planar arm they are x, y
            # and the angle phi.
            rows = tuple(np.flatnonzero(np.abs(whole).max(axis=(0, 2)) > ROUND_OFF).tolist())
            if len(rows) == self.shape[0] < whole.shape[1]:
                chosen = replace(check.quantity, rows=rows)
                checks.append(replace(self, statement=replace(statement, quantity=chosen)))
        return tuple(checks)

    @property
    def reading_in_words(self) -> tuple[str, ...]:
        """
        Return which definition of the Jacobian the check assumes: a tuple with one text, empty if
        only one definition is possible.
        """
        if self.quantity.kind != 'jacobian' or not (self.quantity.rows or self.quantity.form):
            return ()
        angles = [ANGLES[self.quantity.form]] if self.quantity.form in ANGLES else []
        return (', '.join([f'rows {" ".join(self.labels)}', *angles]),)

    @property
    def fits(self) -> bool:
        """Return whether the user's matrix has the shape of the quantity that it defines."""
        return self.right.shape[1:] == self.shape

    @property
    def labels(self) -> tuple[str, ...]:
        """
        Return the names of the rows in the user's Jacobian, such as vx or wz; empty for other
        quantities.
        """
        if self.quantity.kind != 'jacobian' or not self.fits:
            return ()
        rows = self.quantity.rows or (
            self.jacobian_rows if self.quantity.part == 'all' else range(self.shape[0])
        )
        order = row_order(self.quantity, self.reading)
        return tuple(TWIST_ROWS[order[k]] for k in rows)


def task_determinant(robot: Robot, world: World) -> Floats:
    """
    Return det(J_t) of the task rows J_t of the Jacobian in the axes of frame 0, shape (N,); NaN if
    J_t is not square.
    """
    R_t = np.swapaxes(world.base[:, :3, :3], 1, 2)
    v, w = R_t @ world.jacobian[:, :3], R_t @ world.jacobian[:, 3:]
    J_t = np.concatenate([v, w], axis=1)[:, robot.singularity.task.axes]
    if J_t.shape[1] != J_t.shape[2]:
        return np.full(len(J_t), np.nan)
    return np.asarray(np.linalg.det(J_t))
