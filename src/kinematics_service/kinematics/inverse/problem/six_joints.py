# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Choose the variants of elimination (Raghavan and Roth 1993) that find all solutions of an arm of
six joints.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from .... import kernel
from ....kernel import Floats, Integers
from ....rigid_motion import inverse
from .screws import Screws

# For each number of prismatic joints among six, the largest number of isolated complex solutions
# (Raghavan and Roth 1993; for two or three see kernel/six_joints/spherical_linkage.py).
BOUNDS = {0: 16, 1: 16, 2: 8, 3: 2}
# Number of target poses at which each variant of the elimination (option) is tried.
POSE_COUNT = 4
# Number of variants of the elimination (options) that are kept: the best ones.
OPTION_COUNT = 4


Option: TypeAlias = tuple[int, int, int]


def six_joints_of(screws: Screws, targets: Floats) -> kernel.SixJoints | None:
    """
    Return the elimination that solves an arm of six joint screws; None if elimination fails.

    Elimination has several variants (options), such as the joint at which it begins. They are
    tried at poses that the tool can have. The result has the best variants, the best one first. A
    variant fails if it finds no solution at one of the poses.

    Parameters
    ----------
    screws
        Six joint screws. Their angles or displacements correspond one to one to the positions of
        six joints.
    targets : shape (m, 4, 4)
        Poses that the tool can have. The variants are tried at the first four poses.
    """
    bound = BOUNDS.get(sum(screws.slides))
    if bound is None:
        return None
    motions = [T @ inverse(screws.home) for T in targets[:POSE_COUNT]]
    ranks = sorted(
        rank
        for option in _options(screws.slides)
        if (rank := _rank_of(_form(screws, np.array([option]), bound), motions, option))
    )
    if not ranks:
        return None
    return _form(screws, np.array([option for *_, option in ranks[:OPTION_COUNT]]), bound)


def _rank_of(
    form: kernel.SixJoints, motions: list[Floats], option: Option
) -> tuple[int, int, float, Option] | None:
    # Returns three numbers that rank a variant of the elimination; smaller is better. They are the
    # number of poses at which its solutions are not proved complete, the number of missing
    # solutions, and the largest error of a candidate solution. Returns None if the variant finds
    # no solution at a pose.
    psi, accuracy = np.empty((kernel.MAX_CANDIDATES, 6, 2)), np.empty(3)
    unproved, missing, worst = 0, 0, 0.0
    for T in motions:
        count = kernel.complex_solutions(form, T, psi, accuracy)
        if not count:
            return None
        _, step, proved = accuracy.tolist()
        unproved += not proved
        missing += max(form.bound - count, 0)
        worst = max(worst, step)
    return unproved, missing, worst, option


def _options(slides: tuple[bool, ...]) -> list[Option]:
    options = []
    for backwards in (0, 1):
        ordered = slides[::-1] if backwards else slides
        for first in range(6):
            turned = ordered[first:] + ordered[:first]
            if sum(slides) < 2:
                # Number the joints cyclically from joint `first`. Joint 3 is the unknown of the
                # polynomial (hidden joint). Joint 6 is eliminated before all others. Joints 3 and
                # 6 must be revolute; `turned` is True for prismatic joints.
                allowed = not turned[2] and not turned[5]
            else:
                # With two or more prismatic joints, joint `first` must be prismatic. Counted
                # cyclically, at most two revolute joints may come between it and the next
                # prismatic joint.
                allowed = turned[0] and any(turned[1:4])
            if allowed:
                options += [(first, backwards, swapped) for swapped in (0, 1)]
    return options


def _form(screws: Screws, options: Integers, bound: int) -> kernel.SixJoints:
    slides = np.array(screws.slides, dtype=np.float64)
    return kernel.SixJoints(
        screws=np.ascontiguousarray(np.column_stack([screws.axes, screws.points, slides])),
        home_inverse=np.ascontiguousarray(inverse(screws.home)),
        to_joints=np.ascontiguousarray(np.linalg.inv(screws.coupling)),
        options=np.ascontiguousarray(options, dtype=np.int64),
        bound=bound,
    )
