# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Evaluate frames, Jacobian and axes of an arm at random configurations, with given or random
constants.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ....kernel import Floats
from ....kinematics.forward import forward_kinematics, jacobian
from ....kinematics.task_jacobian import task_jacobian
from ....robot.robot import Robot
from ....robot.task import seeded_poses
from ..arm.table import Table, table_of
from ..arm.world import World, twist_of, with_constants
from .algebra.arithmetic import Arithmetic
from .algebra.zeros import Box
from .singular_geometry import ArmAtPoses, rank_at

# Number of sampled configurations of a family. It is unlikely that a property holds at all sampled
# configurations by coincidence. The arm is evaluated at all of them within one second.
POSES = 60
# Seeds of the random values of the named constants, such as lengths. Each seed gives one value for
# each constant. A result is reported only if it holds with the values of both seeds. So a
# coincidence of the file's values, such as two equal lengths, gives no result.
SEEDS = (1955, 1964)
# Range of the ratio of a random value to the file's value. Some families of singular poses exist
# only if one length exceeds another. With a ratio near 1, the longer length usually stays longer.
LETTER_FACTORS = (0.8, 1.25)
# Step of central differences (rad or m). With this step, a difference has a round-off error below
# 1e-9 and a truncation error (third derivative) below 1e-9.
STEP = 1e-6


@dataclass(frozen=True, eq=False)
class PoseSampler:
    """
    A sampler of a robot's configurations in which only the k joints of a derivation move; other
    joints are locked.

    Attributes
    ----------
    robot
        The arm.
    moving
        Indices of the k joints that move.
    still : shape (n,), rad or m
        Positions of the locked joints; 0 for the joints that move.
    to_si : shape (k,)
        Factor from the file's units to SI: metres per length unit for prismatic joints, 1 for
        angles.
    arithmetic
        The polynomial ring of the arm, with values of the named constants.
    table
        The table of the arm, with the values of `arithmetic`.
    """

    robot: Robot
    moving: tuple[int, ...]
    still: Floats
    to_si: Floats
    arithmetic: Arithmetic
    table: Table

    @property
    def rows(self) -> tuple[int, ...]:
        """Return the indices of the task rows of J, 0 to 5."""
        return tuple(self.robot.singularity.task.axes.tolist())

    def whole(self, q: Floats) -> Floats:
        """
        Return the positions of all joints, shape (N, n), rad and m.

        The input q has the positions of the k moving joints in the file's units, shape (N, k).
        """
        result = np.tile(self.still, (len(q), 1))
        result[:, list(self.moving)] = q * self.to_si
        return result

    def random(self, count: int = POSES, within: bool = False) -> Floats:
        """
        Return random positions of the k moving joints, always from the same seed, shape (count,
        k), in the file's units.

        Parameters
        ----------
        count
            At most 1000.
        within
            Whether angles stay inside the joint limits; otherwise they are anywhere in a full
            turn.
        """
        robot = self.robot
        limits = np.array(robot.limits)
        if not within:
            limits[~robot.prismatic] = (-np.inf, np.inf)
        q = seeded_poses(limits, robot.prismatic)[:count]
        return np.asarray(q[:, list(self.moving)] / self.to_si)

    def limits(self, periods: Floats) -> Box:
        """
        Return the limits of the k moving joints, in the file's units. If a revolute joint may turn
        farther than its period, return a range of one period.

        Parameters
        ----------
        periods : shape (k,), rad
            The period of each joint: the change of its position after which all frames repeat.
        """
        low, high = np.array(self.robot.limits[list(self.moving)]).T / self.to_si
        turned = np.where(np.isfinite(high), high - periods, -periods / 2)
        start = np.where(self.slides | np.isfinite(low), low, turned)
        return Box(start, np.where(self.slides, high, np.minimum(high, start + periods)))

    def arm(self, q: Floats) -> ArmAtPoses:
        """
        Return Jacobian, frames and axes of the arm at positions q of the k moving joints.

        The input q has shape (N, k) and is in the file's units. The result is in m and rad.
        """
        task = self.robot.singularity.task
        column_scales = task.column_scales[list(self.moving)]
        J, frames, tool = self.kinematics(q)
        omega = np.swapaxes(J[:, 3:], 1, 2)
        size = np.linalg.norm(omega, axis=2, keepdims=True)
        with np.errstate(invalid='ignore', divide='ignore'):
            axes = np.where(size > 1e-9, omega / size, np.nan)
            velocity = np.swapaxes(J[:, :3], 1, 2) / size
        # Compute the point of each axis nearest to the tool's origin p. Let z be the direction of
        # the axis, r the vector from the point of the axis to p, and [v; w] the joint's column of
        # J. Then v = w x r, so the point of the axis is p + z x v / |w|.
        origins = tool[:, None] + np.cross(axes, velocity)
        return ArmAtPoses(
            J_t=task_jacobian(task, J) * task.row_scales[:, None] * column_scales,
            frames=frames,
            axes=axes,
            origins=origins,
            tool=tool,
            turns=tuple((~self.slides).tolist()),
            names=tuple(self.robot.variables[j] for j in self.moving),
        )

    def kinematics(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """
        Return J, the frames and the tool's position at positions q of the k moving joints, in m
        and rad. The shapes are (N, 6, k), (N, rows + 1, 4, 4) and (N, 3).
        """
        variables = dict(zip(self.table.variables, self.whole(q).T))
        world = World(self.table, with_constants(self.table, variables, len(q)), len(q))
        frames = np.stack(world.frames, axis=1)
        return world.columns_of(self.moving), frames[:, :-1], frames[:, -1, :3, 3]

    @cached_property
    def in_random_letters(self) -> tuple['PoseSampler', ...]:
        """
        Return two copies of the arm with random values of the named constants. If the arm has no
        named constants, return only the arm itself.
        """
        names, copies = self.arithmetic.names, []
        for seed in SEEDS if names.values else ():
            factors = np.random.default_rng(seed).uniform(*LETTER_FACTORS, len(names.values))
            by_name = {s.name: float(f) for s, f in zip(names.values, factors)}
            values = {s: v * by_name[s.name] for s, v in names.values.items()}
            other = replace(self.arithmetic, names=replace(names, values=values))
            # `values` have the units of the file, and the constants of the table have SI units. So
            # do not copy `values` into the table. Multiply each constant of the table by the
            # random factor of its name.
            given = {s: v * by_name.get(s.name, 1.0) for s, v in self.table.given.items()}
            copies.append(replace(self, arithmetic=other, table=replace(self.table, given=given)))
        return tuple(copies) or (self,)

    def central_difference(self) -> float:
        """
        Return the largest difference (m, rad) between J and central differences of T at one random
        configuration.
        """
        robot, moving = self.robot, list(self.moving)
        q = self.whole(self.random(1))[0]
        steps = STEP * np.eye(robot.dof)[moving]
        rates = forward_kinematics(robot, q + steps) - forward_kinematics(robot, q - steps)
        columns = twist_of(rates / (2 * STEP), forward_kinematics(robot, q)[None])
        return float(np.max(np.abs(jacobian(robot, q)[:, moving] - columns.T)))

    @cached_property
    def elsewhere(self) -> ArmAtPoses:
        """Return Jacobian, frames and axes of the arm at 200 random configurations."""
        return self.arm(self.random(200))

    @cached_property
    def generic_rank(self) -> int:
        """Return the rank of the task rows at almost all configurations."""
        return rank_at(self.elsewhere.J_t)

    @property
    def slides(self) -> npt.NDArray[np.bool_]:
        """Return which of the k moving joints are prismatic, shape (k,)."""
        return self.robot.prismatic[list(self.moving)]


def sampler_of(robot: Robot, arithmetic: Arithmetic) -> PoseSampler:
    """
    Return the sampler of a robot in which the joint variables of `arithmetic` move; the other
    joints are locked.
    """
    names, description = arithmetic.names, robot.description
    symbols = {symbol.name for symbol in names.variables}
    still = np.zeros(robot.dof)
    moving, to_si = [], []
    for j, name in enumerate(robot.variables):
        slides = robot.joint_types[j] == 'prismatic'
        if name in symbols:
            moving.append(j)
            to_si.append(description.metres if slides else 1.0)
            continue
        value = float(names.meanings[name].subs(dict(names.values)).evalf())
        still[j] = value * (description.metres if slides else description.radians)
    table = table_of(description)
    return PoseSampler(robot, tuple(moving), still, np.array(to_si), arithmetic, table)
