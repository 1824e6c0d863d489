"""Six joints in any order: by which eliminations all their solutions are found, ranked once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .... import kernel
from ....kernel import Floats, Integers
from ....rigid_motion import inverse
from .screws import Screws

# Isolated complex solutions a target has at most, by the number of prismatic joints (Raghavan and
# Roth 1993; with two or three of them kernel/six_joints/spherical_linkage.py has the reason).
BOUNDS = {0: 16, 1: 16, 2: 8, 3: 2}
# Poses the options are tried at, and how many options are kept.
TRIED, KEPT = 4, 4


class _Rank(NamedTuple):
    # At how many poses an option proved nothing, how many solutions it lacks of all that there can
    # be, and how far off its candidates were.
    unproved: int
    missing: int
    worst: float
    option: tuple[int, int, int]


def six_joints_of(screws: Screws, targets: Floats) -> kernel.SixJoints | None:
    """
    Return the form of six joints with the best options first, None where no option finds them.

    Parameters
    ----------
    screws
        Of the arm: six, their positions one to one with those of six joints.
    targets : shape (m, 4, 4)
        Poses of the tool that the arm can have; the options are tried at the first ones.
    """
    bound = BOUNDS.get(sum(screws.slides))
    if bound is None:
        return None
    motions = [T @ inverse(screws.home) for T in targets[:TRIED]]
    ranks = sorted(
        rank
        for option in _options(screws.slides)
        if (rank := _rank_of(_form(screws, np.array([option]), bound), motions, option))
    )
    if not ranks:
        return None
    return _form(screws, np.array([rank.option for rank in ranks[:KEPT]]), bound)


def _rank_of(
    form: kernel.SixJoints, motions: list[Floats], option: tuple[int, int, int]
) -> _Rank | None:
    # None where it is singular at one of the targets, and so at most of them.
    psi, accuracy = np.empty((kernel.MOST_CANDIDATES, 6, 2)), np.empty(3)
    unproved, missing, worst = 0, 0, 0.0
    for T in motions:
        found = kernel.complex_solutions(form, T, psi, accuracy)
        if not found:
            return None
        _, step, proved = accuracy.tolist()
        unproved += not proved
        missing += max(form.bound - found, 0)
        worst = max(worst, step)
    return _Rank(unproved, missing, worst, option)


def _options(slides: tuple[bool, ...]) -> list[tuple[int, int, int]]:
    options = []
    for backwards in (0, 1):
        ordered = slides[::-1] if backwards else slides
        for first in range(6):
            turned = ordered[first:] + ordered[:first]
            if sum(slides) < 2:
                # The joint that is hidden and the one that is eliminated first must turn.
                allowed = not turned[2] and not turned[5]
            else:
                # One that slides begins, and at most two that turn are before another.
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
