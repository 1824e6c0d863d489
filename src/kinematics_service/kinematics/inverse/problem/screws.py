# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Describe an arm by its joint screws and the pose of its tool, with all joints at zero.

Let s_1 ... s_k be the joint screws: the axes, from base to tool, about or along which the rows of
the DH table move. Let psi_i be the angle or displacement of screw s_i, and `home` the pose of the
tool with all joints at zero. Then the pose of the tool is the product of exponentials (Brockett
1984) exp(s_1 psi_1) ... exp(s_k psi_k) home. The joint positions q determine the vector psi =
(psi_1 ... psi_k): psi = coupling q. The screws do not depend on the convention of the DH table.
"""

from dataclasses import dataclass

import numpy as np

from ....kernel import Chain, Floats
from ....rigid_motion import screw_z
from ....robot.chain import FrozenArrays


@dataclass(frozen=True, eq=False)
class Screws(FrozenArrays):
    """
    The joint screws of an arm, from base to tool, in the base frame.

    Attributes
    ----------
    axes, points : shape (k, 3), m
        Directions of the axes (unit vectors), and a point on each axis, m.
    slides : shape (k,)
        Whether a screw is a translation; otherwise it is a rotation.
    coupling : shape (k, n)
        Matrix that converts joint positions q (n,) to the angles or displacements psi (k,) of the
        screws: psi = coupling q.
    home : shape (4, 4)
        The tool's pose with every joint at zero.
    off
        Bound of the error of `axes` (rad) and of `points` (divided by the arm's size). It is above
        0 if nearly parallel axes of the arm were made parallel here, or if axes that nearly meet
        were made to meet.
    """

    axes: Floats
    points: Floats
    slides: tuple[bool, ...]
    coupling: Floats
    home: Floats
    off: float = 0.0

    @property
    def tool(self) -> Floats:
        """Return the tool's origin with every joint at zero, shape (3,), m."""
        return self.home[:3, 3]


def screws_of(chain: Chain) -> Screws:
    """
    Return the joint screws of a chain, with all joints at zero.

    An element (a moving row of the DH table) that both turns and slides becomes two screws on one
    axis.
    """
    table = chain.table
    axes, points, slides, coupling = [], [], [], []
    T = np.eye(4)
    for k, before in enumerate(table.before):
        T = T @ np.vstack([before, [0, 0, 0, 1]])
        if k == chain.elements:
            break
        for ratios, is_slide in ((table.by_theta, False), (table.by_d, True)):
            moves = np.zeros(chain.dof)
            for e in range(table.first_entry[k], table.first_entry[k + 1]):
                moves[table.joint[e]] += ratios[e]
            if np.any(moves):
                axes.append(T[:3, 2].copy())
                points.append(T[:3, 3].copy())
                slides.append(is_slide)
                coupling.append(moves)
        T = T @ screw_z(table.theta_0[k], table.d_0[k])
    return Screws(np.array(axes), np.array(points), tuple(slides), np.array(coupling), T)
