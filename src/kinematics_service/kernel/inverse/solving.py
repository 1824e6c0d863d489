# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Solve inverse kinematics without a search. A closed form or elimination gives candidates, and
Levenberg-Marquardt refines them.

A candidate becomes a solution if Levenberg-Marquardt (refinement.py) reduces the error of its tool
pose, computed by forward kinematics, below the tolerance. The list of solutions is complete in two
cases: the error bounds of the closed form prove that no solution is missing, or elimination has
certified every root.
"""

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from ..six_joints import six_screws
from ..six_joints.six_joints import Roots, SixJoints
from . import dependence, posture, solutions, targets
from .closed_forms import ClosedForm
from .refinement import Refinement
from .solutions import SolutionCandidates, Solutions

# If the bound of the candidates' errors is below this, rad, each candidate is so near to a
# solution that Levenberg-Marquardt converges to this solution.
MAX_SURE_ERROR = 1e-2
# If the bound of the candidates' errors is below this, rad, candidates that exceed a limit by more
# than LIMIT_MARGIN are dropped before the refinement.
MAX_LIMIT_TEST_ERROR = 1e-6
# A candidate that exceeds a limit by at most this, rad or m, is not dropped, because the
# refinement may move it inside the limits. The margin is 1000 times MAX_LIMIT_TEST_ERROR.
LIMIT_MARGIN = 1e-3
# If only the nearest solution is wanted, the candidates are refined in the order of their squared
# distances from `near`, the reference joint positions. OUTSIDE_PENALTY is added to the squared
# distance of each candidate outside the limits. So candidates inside the limits are refined first.
OUTSIDE_PENALTY = 1e200


def _write_candidates(
    form: ClosedForm, pose: Flat, near: Flat, candidates: SolutionCandidates, accuracy: Numbers
) -> int:
    # Writes the joint positions of all candidates for the target `pose` to `candidates.q`; returns
    # the number of candidates.
    T, free = [0.0] * 12, [0.0] * 6
    form.write_motion(pose, T)
    form.write_screws(near, free)
    count = form.candidates(T, targets.rotation_error(pose), free, candidates.q, accuracy)
    for i in range(count):
        form.turn_into_joints(arrays.after(candidates.q, i * form.n))
    return count


def _add_nearest(
    refinement: Refinement, count: int, candidates: SolutionCandidates, result: Solutions
) -> int:
    # Adds to `result` the solution inside the limits that is nearest to `result.near`; returns 1,
    # or 0 if no such solution exists.
    for i in range(count):
        q = arrays.after(candidates.q, i * result.n)
        inside = result.represent(q)
        candidates.distances[i] = result.joints.square_to(result.near, q)
        if not inside:
            candidates.distances[i] += OUTSIDE_PENALTY
    for _ in range(count):
        i = solutions.least(candidates.distances, count)
        candidates.distances[i] = places.INFINITY
        q = arrays.after(candidates.q, i * result.n)
        error = refinement.refine_one(q)
        if result.represent(q) and error < result.proved:
            result.add(q, error)
            return 1
    return 0


def _drop_beyond(count: int, candidates: SolutionCandidates, result: Solutions) -> int:
    # Drops the candidates that exceed a limit by more than LIMIT_MARGIN. Moves the other
    # candidates to the front, and returns their number.
    n, remaining = result.n, 0
    for i in range(count):
        q = arrays.after(candidates.q, i * n)
        result.joints.represent(result.near, q)
        if result.joints.margin(q) > -LIMIT_MARGIN:
            arrays.copy(arrays.after(candidates.q, remaining * n), n, q)
            remaining += 1
    return remaining


def _add_all(
    refinement: Refinement, count: int, candidates: SolutionCandidates, result: Solutions
) -> int:
    # Refines all candidates, and adds the distinct solutions to `result`, those nearest to
    # `result.near` first. Returns the number of solutions.
    n = result.n
    for i in range(count):
        candidates.errors[i] = refinement.refine_one(arrays.after(candidates.q, i * n))
    distinct = candidates.keep_distinct(count, refinement.residual, result.joints, result.proved)
    for i in range(distinct):
        q = arrays.after(candidates.q, candidates.which[i] * n)
        result.joints.represent(result.near, q)
        candidates.distances[i] = result.joints.square_to(result.near, q)
    for _ in range(distinct):
        best = solutions.least(candidates.distances, distinct)
        candidates.distances[best] = places.INFINITY
        row = candidates.which[best]
        result.add(arrays.after(candidates.q, row * n), candidates.errors[row])
    return distinct


def closed_solutions(
    form: ClosedForm, refinement: Refinement, only_one: bool, only_inside: bool, result: Solutions
) -> None:
    """
    Compute the solutions of one target for an arm with a closed form. Add them to `result`, those
    nearest to `result.near` first.

    Parameters
    ----------
    form
        The closed form of the arm.
    refinement
        The refinement for the target, without damping.
    only_one
        Whether to return only the nearest solution inside the limits.
    only_inside
        Whether to omit solutions that are clearly outside the limits.
    result
        Receives the solutions. Its arrays must have MAX_CANDIDATES rows, or one row if
        `only_one`.
    """
    capacity = places.MAX_CANDIDATES
    result.require_fit(refinement.residual, form.n, 1 if only_one else capacity)
    _solve(form, refinement, only_one, only_inside, SolutionCandidates(capacity, result.n), result)


def _solve(
    form: ClosedForm,
    refinement: Refinement,
    only_one: bool,
    only_inside: bool,
    candidates: SolutionCandidates,
    result: Solutions,
) -> int:
    # Adds the solutions of the target of `refinement` to `result`; returns their number.
    accuracy, first = [0.0], result.count
    total = _write_candidates(form, refinement.residual.pose, result.near, candidates, accuracy)
    if only_inside and accuracy[0] < MAX_LIMIT_TEST_ERROR:
        total = _drop_beyond(total, candidates, result)
    if only_one:
        count = _add_nearest(refinement, total, candidates, result)
    else:
        count = _add_all(refinement, total, candidates, result)
    # Store in `result` whether solutions may be missing. If `accuracy` is finite, no candidate is
    # missing. `total` is the number of candidates, and `count` the number of solutions. If both
    # numbers are equal, each candidate converged to its own solution.
    result.regular = accuracy[0] < places.INFINITY and count == total
    result.sure = accuracy[0] < MAX_SURE_ERROR and count == total
    for i in range(first, first + count):
        q = arrays.after(result.rows, i * result.n)
        # Store the pivot ratio of J (see `dependence.pivot_ratio`). The ratio is 0 if J has lost
        # rank. If `result.sure` is set, J has full rank at each solution; then store 1.
        result.shares[i] = 1.0
        if only_one or not result.sure:
            result.shares[i] = dependence.pivot_ratio(refinement.residual, result.joints.scales, q)
        posture.write_posture(form, q, arrays.whole_after(result.postures, 3 * i))
    return count


def closed_solutions_of_each(
    form: ClosedForm,
    refinement: Refinement,
    only_inside: bool,
    poses: Floats,
    result: Solutions,
    counts: Integers,
) -> None:
    """
    Compute the solutions of N targets for an arm with a closed form, and add them to `result`.

    Parameters
    ----------
    form, refinement, only_inside
        As for `closed_solutions`. The target of the refinement is replaced by each of `poses`.
    poses : shape (N, 4, 4)
        The targets.
    result
        Receives the solutions in the order of the targets. Its arrays must have N * MAX_CANDIDATES
        rows.
    counts : shape (N, 2)
        For each target: the number of solutions, then 1 if no solution is missing, otherwise 0.
    """
    capacity, count = places.MAX_CANDIDATES, arrays.extent(poses, 0)
    result.require_fit(refinement.residual, form.n, count * capacity)
    rows, written = arrays.numbers(poses, 16 * count), arrays.whole_results(counts, 2 * count)
    candidates, target = SolutionCandidates(capacity, result.n), refinement.residual.pose
    for i in range(count):
        refinement.residual.pose = arrays.after(rows, 16 * i)
        written[2 * i] = _solve(form, refinement, False, only_inside, candidates, result)
        written[2 * i + 1] = 1 if result.sure else 0
    refinement.residual.pose = target


def eliminated_solutions(
    arm: SixJoints, refinement: Refinement, result: Solutions, counts: Integers
) -> None:
    """
    Compute the solutions of one target for an arm of six joints by elimination. Add them to
    `result`, those nearest to `result.near` first.

    Parameters
    ----------
    arm
        The arm of six joints.
    refinement
        The refinement for the target, without damping.
    result
        Receives the solutions. Its arrays must have MAX_CANDIDATES rows.
    counts : shape (3,)
        Three numbers: how many complex solutions were certified, how many of them are real, and a
        flag. The flag is 1 if no real solution is missing, otherwise 0.
    """
    capacity = places.MAX_CANDIDATES
    result.require_fit(refinement.residual, 6, capacity)
    written = arrays.whole_results(counts, 3)
    candidates, roots = SolutionCandidates(capacity, 6), Roots()
    with arrays.without_lock():
        count = _write_real_roots(arm, refinement.residual.pose, roots, candidates)
        written[0], written[1], written[2] = roots.count, count, 1 if roots.proved else 0
        count = _add_all(refinement, count, candidates, result)
        for i in range(count):
            q = arrays.after(result.rows, 6 * i)
            result.shares[i] = dependence.pivot_ratio(refinement.residual, result.joints.scales, q)


def _write_real_roots(
    arm: SixJoints, pose: Flat, roots: Roots, candidates: SolutionCandidates
) -> int:
    # Writes the real solutions for the target `pose` to `candidates.q`; returns their number.
    T = [0.0] * 12
    six_screws.write_motion(pose, arm.home_inverse, T)
    roots.find(arm, T)
    count = 0
    for k in range(roots.count):
        if roots.is_real[k] == 1:
            q = arrays.after(candidates.q, 6 * count)
            arm.write_joints(arrays.after(roots.psi, 12 * k), q)
            count += 1
    return count
