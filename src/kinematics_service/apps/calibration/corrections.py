# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Add corrections to the description of a robot. Each corrected number is written as nominal +
correction.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import KinematicsError
from ...kernel import Floats
from ...kinematics.uncertainty.corrected_chain import small_motion
from ...rigid_motion import exact_rpy
from ...robot.file.parts.description import (
    IDENTITY,
    DhRow,
    ElementaryMotion,
    Link,
    RigidMotion,
    RobotDescription,
    ShapeRow,
    Tolerances,
    Uncertainty,
)
from ...robot.file.parts.links import AXES
from ...robot.file.parts.parameters import ArmParameter
from ...robot.file.parts.tolerances import GEAR
from ...robot.file.text.expressions import Affine, Expression
from ...robot.robot import Robot, build_robot
from ...robot.task import ROW_NAMES
from ...typography import number_text

ZERO = Expression('0', Affine(0.0, ()))
# A correction that is converted to degrees or millimetres is rounded to this number of decimals.
DIGITS = 12


def corrected_robot(robot: Robot, parameters: Sequence[ArmParameter], values: Floats) -> Robot:
    """
    Return the robot with corrections of its table.

    The result has no known poses, tolerances or uncertainty of the table, since these belong to
    the nominal table. The task rows are those of the nominal table. The singular factors of the
    nominal table are kept and marked as approximate, or left out if their zeros are far from
    singular poses.

    Parameters
    ----------
    parameters, values : P
        Parameters of the table and their corrections, rad and m. Corrections of base and tool are
        ignored.
    """
    entries = {
        (parameter.row, parameter.place): float(value)
        for parameter, value in zip(parameters, values)
        if parameter.row >= 0 and value != 0.0
    }
    nominal = robot.description
    table = _Corrections(_Corrections(nominal, entries).geared(), entries)
    links, ends_at = table.links()
    corrected = replace(
        nominal,
        links=links,
        points=tuple(replace(point, row=ends_at[point.row]) for point in nominal.points),
        uncertainty=of_joints_alone(nominal.uncertainty),
        known_poses=(),
        warnings=(),
        tolerances=Tolerances(),
        singularity=replace(nominal.singularity, task=task_of(robot)),
    )
    return built_nearly(corrected) if entries else build_robot(corrected)


def task_of(robot: Robot) -> tuple[str, ...] | None:
    """
    Return the task rows of the nominal arm, which the corrected arm keeps.

    Task rows are rows of the Jacobian, such as `x` or `rz`. If the task has all six rows and the
    robot file does not name them, return None.

    Small corrections move a planar arm slightly out of its plane. If the motion out of the plane
    became part of the task, the Jacobian would have full rank at all poses, and no pose would be
    singular.
    """
    rows = robot.singularity.task.rows
    return rows if len(rows) < len(ROW_NAMES) else robot.description.singularity.task


def with_ends(description: RobotDescription, base: Floats, tool: Floats) -> RobotDescription:
    """Return a description with another base and tool, given as poses (4, 4), m."""
    return replace(
        description,
        base=replace(description.base, motion=rigid_motion(base, description)),
        tool=replace(description.tool, motion=rigid_motion(tool, description)),
    )


def built_nearly(description: RobotDescription) -> Robot:
    """
    Build a robot from a corrected description, and mark the singular factors as approximate.

    The singular factors in the description are those of the nominal arm. The corrections are
    small, so the zeros of a factor are still near singular poses. If a factor is zero at a pose
    far from all singular poses of the built robot, all factors are left out.
    """
    singularity = description.singularity
    nearly = tuple(replace(factor, approximate=True) for factor in singularity.factors)
    try:
        return build_robot(replace(description, singularity=replace(singularity, factors=nearly)))
    except KinematicsError:
        return build_robot(replace(description, singularity=replace(singularity, factors=())))


def of_joints_alone(given: Uncertainty | None) -> Uncertainty | None:
    """
    Return a section `uncertainty` with only its entries on the joints (noise of positions and
    velocities); None without such entries. Entries on the table are removed, since a calibration
    writes its own.
    """
    if given is None:
        return None
    kept = replace(given, parameters=(), factor=(), floor_xyz=0.0, floor_rpy=0.0)
    return kept if kept.of_pose or kept.velocity_noise else None


def rigid_motion(T: Floats, description: RobotDescription) -> RigidMotion:
    """
    Return a pose (4, 4) as a `RigidMotion`: the matrix, and x y z roll pitch yaw as text in the
    units of the robot file.
    """
    six = enumerate([*T[:3, 3].tolist(), *exact_rpy(T[:3, :3])])
    return RigidMotion(T, tuple(number_text(in_file_units(x, k > 2, description)) for k, x in six))


def in_file_units(value: float, angle: bool, description: RobotDescription) -> float:
    """Convert a number from rad or m to the units of a robot file."""
    unit = description.radians if angle else description.metres
    return value if unit == 1.0 else round(value / unit, DIGITS)


@dataclass(frozen=True, eq=False)
class _Corrections:
    # Adds corrections (rad or m) to a table. Each key of `entries` has the index of a table row
    # and the name of the corrected number in this row.
    description: RobotDescription
    entries: Mapping[tuple[int, str], float]

    def of(self, row: int, place: str) -> float:
        return self.entries.get((row, place), 0.0)

    def geared(self) -> RobotDescription:
        # Return the description with corrected gear ratios: each joint variable gets a new factor.
        def link(given: Link) -> Link:
            if isinstance(given, DhRow):
                return replace(given, motions=tuple(map(self._moved_more, given.motions)))
            if isinstance(given, ElementaryMotion):
                return self._moved_more(given)
            joint = given.joint
            return given if joint is None else replace(given, joint=self._moved_more(joint))

        return replace(self.description, links=tuple(map(link, self.description.links)))

    def _moved_more(self, motion: ElementaryMotion) -> ElementaryMotion:
        description, argument = self.description, motion.argument
        for k, joint in enumerate(description.joints):
            factors = dict(argument.affine.coefficients)
            more = self.of(k, GEAR) * factors.get(joint.variable, 0.0)
            if not more:
                continue
            written = more
            if not motion.turns and joint.type == 'helical':  # length (m) per angle (rad)
                written *= description.radians / description.metres
            factors[joint.variable] += more
            text = _sum(argument, written, f'{number_text(abs(written))}*{joint.variable}')
            affine = replace(argument.affine, coefficients=tuple(factors.items()))
            argument = Expression(text, affine)
        return replace(motion, argument=argument)

    def links(self) -> tuple[tuple[Link, ...], tuple[int, ...]]:
        # Return the corrected rows of the table, to which a correction may add rows. Return also,
        # for each frame of the nominal table, the number of corrected rows from the base up to
        # this frame.
        links: list[Link] = []
        ends_at = [0]
        turn = 0.0  # extra rotation (rad) about z, which theta of the next row must contain
        for k, link in enumerate(self.description.links):
            if isinstance(link, DhRow):
                rows, turn = self._dh_rows(k, link, turn)
            elif isinstance(link, ShapeRow):
                rows = self._shape_rows(k, link)
            else:
                rows = self._elementary_rows(k, link)
            links += rows
            # If `turn` is not zero, the last of the corrected rows is an extra row, and the frame
            # after the extra row is turned by 90 degrees. Then the frame before the extra row is
            # the one that corresponds to the nominal frame. So do not count the extra row.
            ends_at.append(len(links) - (1 if turn else 0))
        if turn and isinstance(link, DhRow):
            links.append(_row(link, {'theta': self._turned(ZERO, turn)}))
        return tuple(links), tuple(ends_at)

    def _dh_rows(self, k: int, link: DhRow, turn: float) -> tuple[list[Link], float]:
        def corrected(name: str, given: Expression) -> Expression:
            return self._added(given, self.of(k, name), name in ('theta', 'alpha'))

        cells = {name: corrected(name, link[name]) for name in link.names}
        if turn:
            cells['theta'] = corrected('theta', self._turned(link['theta'], turn))
        beta, b = self.of(k, 'Ry'), self.of(k, 'Ty')
        if not beta and not b:
            return [_row(link, cells)], 0.0
        # A DH row has no Ry and Ty, but Ry(beta) Ty(b) = Rz(90 deg) Rx(beta) Tx(b) Rz(-90 deg). So
        # write Rz(90 deg) Rx(beta) Tx(b) as an extra row, and add -90 deg to theta of the row
        # after the extra row.
        quarter = self._turned(ZERO, math.pi / 2.0)
        extra = {'a': self._number(b, False), 'alpha': self._number(beta, True)}
        if self.description.convention == 'standard':
            row = _row(link, cells)
            return [row, _row(link, {**extra, 'theta': quarter})], -math.pi / 2.0
        # In the modified convention, a and alpha of the nominal row come before the extra a and
        # alpha; theta and d of the nominal row come after the extra a and alpha.
        first = _row(link, {'a': cells['a'], 'alpha': cells['alpha'], 'theta': quarter})
        back = corrected('theta', self._turned(link['theta'], -math.pi / 2.0))
        return [first, _row(link, {**extra, 'd': cells['d'], 'theta': back})], 0.0

    def _elementary_rows(self, k: int, link: ElementaryMotion) -> list[Link]:
        numbers = ((axis, self.of(k, axis)) for axis in AXES if (k, axis) in self.entries)
        extra = (ElementaryMotion(axis, self._number(x, axis[0] == 'R')) for axis, x in numbers)
        return [*extra, self._joint_added(link, k)]

    def _shape_rows(self, k: int, link: ShapeRow) -> list[Link]:
        if link.joint is None:
            return [link]
        joint = self._joint_added(link.joint, k)
        numbers = [self.of(k, axis) for axis in AXES]
        if not any(numbers):
            return [replace(link, joint=joint)]
        T = np.eye(4)
        for axis, number in zip(AXES, numbers):
            T = T @ small_motion(axis[0] == 'R', 'xyz'.index(axis[1]), number)
        # Write the matrix `in` of the file unchanged as a row of its own. The next row has the
        # correction as its `in`, then the joint and the matrix `out` of the file.
        extra = ShapeRow(rigid_motion(T, self.description), joint, link.outer)
        if link.inner == IDENTITY:
            return [extra]
        return [ShapeRow(link.inner, None, IDENTITY), extra]

    def _turned(self, given: Expression, turn: float) -> Expression:
        # Return a theta expression plus a rotation of +90 or -90 degrees, which is written as 90
        # or pi/2.
        text = '90' if self.description.angle_unit == 'deg' else 'pi/2'
        if turn and given.text == '0':
            text = text if turn > 0.0 else f'-{text}'
            return Expression(text, replace(given.affine, constant=given.affine.constant + turn))
        return _shifted(given, turn, text)

    def _added(self, given: Expression, value: float, angle: bool) -> Expression:
        number = in_file_units(value, angle, self.description)
        return _shifted(given, value, number_text(abs(number)))

    def _joint_added(self, joint: ElementaryMotion, k: int) -> ElementaryMotion:
        argument = self._added(joint.argument, self.of(k, 'own'), joint.axis[0] == 'R')
        return replace(joint, argument=argument)

    def _number(self, value: float, angle: bool) -> Expression:
        # Return the cell for a number (m or rad) of an extra row, which the nominal table does not
        # have.
        text = number_text(in_file_units(value, angle, self.description))
        return Expression(text, Affine(value, ()))


def _row(like: DhRow, cells: Mapping[str, Expression]) -> DhRow:
    # Return a DH row of the kind of `like` with the given cells; all other numbers of the row are
    # zero.
    pairs = zip(like.names, like.motions)
    motions = (replace(motion, argument=cells.get(name, ZERO)) for name, motion in pairs)
    return replace(like, motions=tuple(motions))


def _shifted(given: Expression, value: float, size: str) -> Expression:
    # Return the sum of an expression and a value (rad or m). `size` is the absolute value as text.
    if value == 0.0:
        return given
    affine = replace(given.affine, constant=given.affine.constant + value)
    return Expression(_sum(given, value, size), affine)


def _sum(given: Expression, value: float, size: str) -> str:
    # Return the text of the sum of an expression and a value. `size` is the absolute value as
    # text.
    return f'{given.text} {"-" if value < 0.0 else "+"} {size}'
