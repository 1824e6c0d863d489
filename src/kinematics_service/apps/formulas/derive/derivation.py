# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Derive an arm exactly: frames, Jacobian by four methods, determinant and singular set, in symbols.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import comb

import numpy as np
import sympy

from ....errors import DerivationError
from ....notebook import as_latex
from ....robot.loops import opened
from ....robot.robot import AnyRobot, Robot, robot_in_letters
from . import jacobian as ways
from .algebra.arithmetic import Arithmetic, arithmetic_of
from .algebra.laurent import Laurent
from .algebra.matrices import Matrix, terms_in
from .algebra.names import Names, names_of
from .closed_loops import LoopEquations, closed_determinant, loops_of
from .frames import Frames, frames_of
from .minors import (
    Minors,
    independent_columns,
    minors_of,
    product_of,
    remainder_of,
    simplest_view,
)
from .sampled_poses import PoseSampler, sampler_of
from .singular_set import (
    Determinant,
    FamilySearch,
    SingularSet,
    crossings_of,
    families_of,
    numbers_in_words,
    remainder_zeros,
    singular_factors,
    without_integers,
)
from .trigonometry import Writer, writer_of

# Maximum number of minors. If the task rows of J have a larger number of minors, no minor is
# derived. The number of minors is a binomial coefficient, so it grows steeply with the number of
# redundant joints.
MAX_MINORS = 100

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Derivation:
    """
    The exact derivation of an arm: sympy expressions in the symbols of the robot file.

    Expressions of an arm with closed loops contain joints and passive joints. Lengths are in the
    file's unit, joint angles in rad. The Jacobian has three linear rows, then three angular rows.
    Its reference point is the tool, its axes are those of the base frame.

    Attributes
    ----------
    robot
        The arm.
    names
        The symbols: `variables` (first the joints, then the passive joints), `lengths`, and the
        file's `values` of the lengths.
    jacobian_open : 6 x n
        The Jacobian with a column for each joint, then for each passive joint, as if each passive
        joint moved independently.
    methods
        The name of each of the four methods that compute `jacobian_open`, with the number of terms
        in the difference between its result and `jacobian_open`. The number is 0 if both are
        equal.
    coupling
        The matrix C in (theta, d) = C q + constants, where (theta, d) are all theta and d of the
        table that joints change. None if each joint moves one row, and no row is moved by two
        joints. With closed loops, q includes the passive joints.
    loops
        Equations of the closed loops, in the order of the file; empty without loops.
    singular_set
        The determinant of the task rows of J, its factors, and the families of singular poses with
        the rank of J on each family. With closed loops only the determinant.
    """

    robot: Robot
    names: Names
    jacobian_open: sympy.Matrix
    methods: Mapping[str, int]
    coupling: sympy.Matrix | None
    loops: tuple[LoopEquations, ...]
    singular_set: SingularSet
    exact: 'Exact' = field(repr=False)

    def __repr__(self) -> str:
        singular_set = self.singular_set
        factors = ', '.join(factor.name for factor in singular_set.factors) or 'none found'
        others = '' if singular_set.complete else ', perhaps others'
        return (
            f'Derivation({self.robot.name!r}, rank {singular_set.generic_rank}, '
            f'singular factors: {factors}{others})'
        )

    _repr_latex_ = as_latex

    @cached_property
    def row_transforms(self) -> tuple[sympy.Matrix, ...]:
        """Return the 4 x 4 transform T of each row of the table."""
        return tuple(map(self.exact.writer.matrix, self.exact.frames.row_transforms))

    @cached_property
    def frames(self) -> tuple[sympy.Matrix, ...]:
        """Return frame 0, then the frame after each row, as 4 x 4 poses in the base frame."""
        return tuple(map(self.exact.writer.matrix, self.exact.frames.in_base))

    @cached_property
    def T(self) -> sympy.Matrix:
        """Return the 4 x 4 pose of the tool in the base frame."""
        return self.exact.writer.matrix(self.exact.frames.T_base_tool)

    @cached_property
    def z(self) -> tuple[sympy.Matrix, ...]:
        """Return the unit vector along the axis of each moving row of the table, in base axes."""
        return tuple(self.exact.writer.matrix(axis.z[:, None]) for axis in self._axes)

    @cached_property
    def o(self) -> tuple[sympy.Matrix, ...]:
        """Return a point on the axis of each moving row of the table, in the base frame."""
        return tuple(self.exact.writer.matrix(axis.o[:, None]) for axis in self._axes)

    @property
    def _axes(self) -> tuple[ways.Axis, ...]:
        return ways.axes_seen_from(self.exact.frames, -1)

    @property
    def rotation(self) -> sympy.Matrix:
        """Return the rotation of the tool, 3 x 3."""
        return self.T[:3, :3]

    @property
    def position(self) -> sympy.Matrix:
        """Return the position of the tool, 3 x 1."""
        return self.T[:3, 3]

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """Return the joint variables, in the order of the columns of the Jacobian."""
        passive = sum(len(loop.passive) for loop in self.loops)
        return self.names.variables[: len(self.names.variables) - passive]

    @cached_property
    def jacobian(self) -> sympy.Matrix:
        """
        Return the Jacobian, 6 x n, with a column for each joint that is not passive.

        In an arm with closed loops, passive joints move along and keep the loops closed.
        """
        return self._by_joints(self.jacobian_open)

    @property
    def loop_coupling(self) -> sympy.Matrix:
        """
        Return the derivative C = d(q, psi) / dq, with positions q of active and psi of passive
        joints.

        `jacobian` is the product of `jacobian_open` and C.
        """
        rows = [sympy.eye(len(self.variables)), *(loop.coupling for loop in self.loops)]
        return sympy.ImmutableMatrix(sympy.Matrix.vstack(*rows))

    @property
    def determinant(self) -> sympy.Expr | None:
        """
        Return the determinant of the task rows of J in factored form. If J has more or fewer
        columns than task rows, return the product of the singular values.

        None if the product would be too long.
        """
        return self.singular_set.determinant.expression

    @property
    def lengths(self) -> dict[str, float | None]:
        """
        Return the file's lengths by name, in the file's unit; None for a length without a value.
        """
        letters = self.robot.description.letters.split(', ')
        values = self.names.values.items()
        return {s.name: None if s.name in letters else value for s, value in values}

    @property
    def factors(self) -> dict[str, sympy.Expr]:
        """Return the factors of the determinant as expressions, by name."""
        return {factor.name: factor.expression for factor in self.singular_set.factors}

    @property
    def angles(self) -> dict[sympy.Symbol, sympy.Expr]:
        """
        Return the value q + offset of each symbol theta. A joint has a symbol theta if its offset
        is not a multiple of a quarter turn.

        Examples
        --------
        >>> import kinematics_service as ks
        >>> ks.derive(ks.load_robot('planar_2r')).angles
        {}
        """
        return self.exact.arithmetic.in_variables

    def in_angles(self, expression: sympy.Expr) -> sympy.Expr:
        """
        Return an expression or matrix in which the symbols theta of `angles` replace q + offset.
        """
        offsets = self.exact.arithmetic.offsets
        symbols = self.exact.arithmetic.angles
        turned = {v: symbols[v] - offsets[v] for v in self.names.variables if offsets[v] != 0}
        return expression.xreplace(turned) if turned else expression

    def jacobian_in(self, frame: str | int = 'base', angular_first: bool = False) -> sympy.Matrix:
        """
        Return the Jacobian in other axes, or with the angular rows first.

        Parameters
        ----------
        frame
            `base`, `tool`, or the number of a frame of the table; the reference point stays the
            tool.
        angular_first
            Whether the rows are wx wy wz vx vy vz.

        Raises
        ------
        DerivationError
            The frame is unknown.
        """
        J = self.exact.jacobian_in(frame)
        J = np.roll(J, 3, axis=0) if angular_first else J
        return self._by_joints(self.exact.writer.matrix(J))

    def _by_joints(self, J: sympy.Matrix) -> sympy.Matrix:
        return J * self.loop_coupling if self.loops else J

    @cached_property
    def central_difference(self) -> float:
        """
        Return the largest difference (m, rad) between J and central differences of T at one random
        configuration.
        """
        return self.exact.sampler.central_difference()


@dataclass(frozen=True, eq=False)
class Exact:
    """The exact polynomials of a derivation, before they become sympy expressions."""

    arithmetic: Arithmetic
    frames: Frames
    writer: Writer
    sampler: PoseSampler
    J: Matrix

    def jacobian_in(self, frame: str | int) -> Matrix:
        """Return J, as exact polynomials, in the axes of a frame."""
        if frame == 'base':
            return self.J
        if frame == 'tool':
            return ways.in_axes_of(self.J, self.frames.T_base_tool)
        last = len(self.frames.rows)
        if str(frame).isdigit() and int(frame) <= last:
            return ways.in_axes_of(self.J, self.frames.in_base[int(frame)])
        message = f'no frame {frame!r} (known: base, tool, 0 to {last})'
        raise DerivationError(message, code='unknown-name')


def derive(
    robot: AnyRobot, locked: Mapping[str, str] | None = None, progress: Progress | None = None
) -> Derivation:
    """
    Return the exact derivation of an arm.

    Parameters
    ----------
    robot
        The arm.
    locked
        Joint variables that are held still, and the texts, in the file's units, that replace them:
        `{'q3': '0'}` makes a six-joint arm of a seven-joint arm. Arms with closed loops accept
        none.
    progress
        Called with a short text about the next step.

    Raises
    ------
    DerivationError
        A name to lock is unknown, a row turns by an irrational multiple of a joint's angle, the
        tool's pose has too many terms, or closed loops need each other's passive joints.

    Examples
    --------
    >>> import kinematics_service as ks
    >>> ks.derive('crank_slider').loops[0].determinant
    rod*cos(psi + q)
    """
    robot = robot_in_letters(robot)
    tell = progress or (lambda _: None)
    if robot.description.loops and locked:
        message = f'{robot.name} has closed loops; derive it without locked joints'
        raise DerivationError(message, code='unsupported')
    tell('frames')
    exact = exact_of(robot, locked)
    frames, arithmetic, writer, J = exact.frames, exact.arithmetic, exact.writer, exact.J
    methods = {}
    for name, method in ways.METHODS.items():
        tell(f'Jacobian: {name}')
        methods[name] = terms_in(J - method(frames))
    loops = loops_of(robot, opened(robot.description), arithmetic, tell)
    singular_set = _closed_set(exact, loops, tell) if loops else _singular_set(exact, tell)
    singular_set = singular_set or _singular_set(exact_of(robot, locked, parts=2), tell)
    assert singular_set is not None  # `_singular_set` gives None only if parts is 1
    C = ways.coupling(frames)
    plain = C.shape[0] == C.shape[1] and all(sum(map(bool, row)) == 1 for row in C.tolist())
    return Derivation(
        robot=robot,
        names=arithmetic.names,
        jacobian_open=writer.matrix(J),
        methods=methods,
        coupling=None if plain else C,
        loops=loops,
        singular_set=singular_set,
        exact=exact,
    )


def _closed_set(exact: Exact, loops: tuple[LoopEquations, ...], tell: Progress) -> SingularSet:
    robot = exact.sampler.robot
    tell('determinant')
    expression = closed_determinant(robot, exact.J, exact.frames, loops, exact.writer)
    task = robot.singularity.task
    determinant = Determinant(
        task.square, task.rows, expression, columns=robot.variables, minors=1
    )
    return SingularSet(determinant, (), (), task.generic_rank, task.dependent_joints, False)


def _singular_set(exact: Exact, tell: Progress) -> SingularSet | None:
    # Return the singular set. Return None if polynomials in half angles are needed, but `exact`
    # has polynomials in sin q and cos q only. Half angles are needed if a factor such as sin(q/2)
    # has a family of singular poses of its own.
    sampler, arithmetic, writer = exact.sampler, exact.arithmetic, exact.writer
    n = len(sampler.moving)
    search = FamilySearch(sampler, sampler.in_random_letters)
    rank, square = search.rank, n == len(sampler.rows)
    tell('determinant')
    minors = _minors(exact, independent_columns(search.generic[0]), rank)
    names = [v.name for v in arithmetic.names.variables]
    task, joints = sampler.robot.singularity.task, sampler.robot.joint_names
    dependent: tuple[str, ...] = ()
    if rank < min(n, len(sampler.rows)):
        moving = zip(names, sampler.moving)
        dependent = tuple(name for name, j in moving if joints[j] in task.dependent_joints)
    if minors is None:
        determinant = Determinant(False, task.rows)
        return SingularSet(determinant, (), (), rank, dependent, False)
    tell('factors')
    product, quotients = product_of(minors, arithmetic)
    tell('singular set')
    families = families_of(product, search)
    if families is None:
        return None
    product = without_integers(families, writer)
    J_t = minors.view.J[[*sampler.rows]]
    factors = singular_factors(product, search, writer, exact.frames, J_t)
    constant = writer.expression(product.constant)
    remainder = remainder_of(quotients, writer)
    bases = [f.expression if minors.square else sympy.Abs(f.expression) for f in factors]
    powers = [base**factor.power for base, factor in zip(bases, factors)]
    # Multiply by the constant last, because sympy would expand a constant times a single sum.
    expression = constant * sympy.Mul(*powers, remainder)
    determinant = Determinant(
        square=minors.square and square and rank == n,
        expression=expression,
        constant=constant,
        remainder=remainder,
        view=f'axes of {minors.view.axes}, point: {minors.view.point}',
        rows=task.rows,
        columns=tuple(names[j] for j in minors.columns),
        minors=len(minors.values),
        identically_zero=square and rank < n,
        split=product.complete,
    )
    crossings = crossings_of(product, factors, search, J_t)
    others = remainder_zeros(quotients, search, writer, J_t) if quotients else ()
    special = None
    if sampler.generic_rank < rank:
        numbers = numbers_in_words(arithmetic.names)
        special = f'with {numbers} of this file: rank {sampler.generic_rank} at every pose'
    complete = product.complete and others == ()
    return SingularSet(determinant, factors, crossings, rank, dependent, complete, others, special)


def _minors(exact: Exact, columns: Sequence[int], rank: int) -> Minors | None:
    sampler = exact.sampler
    if comb(len(columns), rank) * comb(len(sampler.rows), rank) > MAX_MINORS:
        return None
    # Let `simplest_view` change the reference point only if the rank is 6. Minors of six rows do
    # not depend on the reference point, but smaller minors do.
    view = simplest_view(exact.J, exact.frames, sampler.rows, columns, rank == 6)
    return minors_of(view, sampler.rows, columns, rank)


def exact_of(robot: Robot, locked: Mapping[str, str] | None = None, parts: int = 1) -> Exact:
    """
    Return the exact polynomials of an arm with its loops open, in half angles if `parts` is 2.

    Raises
    ------
    DerivationError
        A name to lock is unknown, a row turns by an irrational multiple of a joint's angle, or the
        tool's pose has too many terms.
    """
    description = robot.description
    arm = opened(description) if description.loops else description
    # Use the rows of the arm and of its loops, so that the polynomial ring contains the angles of
    # all these rows.
    rows_of_loops = (link for loop in description.loops for link in loop.links)
    whole = replace(arm, links=(*arm.links, *rows_of_loops))
    arithmetic = arithmetic_of(whole, names_of(whole, locked), parts)
    frames = frames_of(arm, arithmetic)
    J = ways.geometric(frames)
    sampler = sampler_of(robot, arithmetic)
    return Exact(arithmetic, frames, writer_of(frames), sampler, J)


def determinant_factors(exact: Exact) -> dict[sympy.Expr, Laurent]:
    """
    Return the factors of the determinant of an arm without closed loops. The task Jacobian of the
    arm must be square.

    The keys are the factors as sympy expressions, the values are the polynomials.
    """
    sampler = exact.sampler
    minors = _minors(exact, independent_columns(sampler), sampler.generic_rank)
    assert minors is not None  # J_t is square, so there is only one minor
    product, _ = product_of(minors, exact.arithmetic)
    return {exact.writer.expression(f.value): f.value for f in product.factors}
