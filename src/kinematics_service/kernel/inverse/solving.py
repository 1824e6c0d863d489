"""All solutions of an arm without a search, or the nearest of them, in one call."""

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from ..six_joints.six_joints import Roots, SixJoints
from . import dependence, posture, solutions, targets
from .closed_forms import ClosedForm
from .refinement import Refinement
from .solutions import SolutionCandidates, Solutions

# Candidates as near to solutions (rad) lead each to its own.
SURE = 1e-2
# A candidate as near to its solution as the first (rad) has it beyond the limits if it is itself
# by more than the second (rad or m).
KNOWN, BEYOND = 1e-6, 1e-3
# Penalty on the squared distance of a candidate outside the limits, which sorts it behind the
# others.
LAST = 1e200


def _find(
    form: ClosedForm, pose: Flat, near: Flat, psi: Flat, found: SolutionCandidates, said: Numbers
) -> int:
    # Fills in the candidates for a pose, with room psi for their screws; returns their number.
    T, free = [0.0] * 12, [0.0] * 6
    form.write_motion(pose, T)
    form.write_screws(near, free)
    count = form.candidates(T, targets.off(pose), free, psi, said)
    for i in range(count):
        form.write_joints(arrays.after(psi, i * form.k), arrays.after(found.q, i * form.n))
    return count


def _keep_nearest(
    refinement: Refinement, count: int, found: SolutionCandidates, kept: Solutions
) -> int:
    # Keeps the nearest of the solutions inside the limits; returns their number, 0 or 1.
    for i in range(count):
        q = arrays.after(found.q, i * kept.n)
        inside = kept.represent(q)
        found.away[i] = kept.joints.square_to(kept.near, q)
        if not inside:
            found.away[i] += LAST
    for _ in range(count):
        i = solutions.least(found.away, count)
        found.away[i] = places.INFINITY
        q = arrays.after(found.q, i * kept.n)
        misses = refinement.refine_one(q)
        if kept.represent(q) and misses < kept.proved:
            kept.take(0, q, misses)
            return 1
    return 0


def _drop_beyond(count: int, found: SolutionCandidates, kept: Solutions) -> int:
    # Keeps candidates that are not far beyond the limits; returns their number.
    n, left = kept.n, 0
    for i in range(count):
        q = arrays.after(found.q, i * n)
        kept.joints.represent(kept.near, q)
        if kept.joints.margin(q) > -BEYOND:
            arrays.copy(arrays.after(found.q, left * n), n, q)
            left += 1
    return left


def _keep_all(
    refinement: Refinement, count: int, found: SolutionCandidates, kept: Solutions, first: int
) -> int:
    # Keeps all solutions, nearest first, from a place on; returns their number.
    n = kept.n
    for i in range(count):
        found.errors[i] = refinement.refine_one(arrays.after(found.q, i * n))
    found.sort_by_error(count)
    distinct = found.keep_distinct(count, refinement.residual, kept.joints, kept.proved)
    for i in range(distinct):
        q = arrays.after(found.q, found.which[i] * n)
        kept.joints.represent(kept.near, q)
        found.away[i] = kept.joints.square_to(kept.near, q)
    for i in range(distinct):
        best = solutions.least(found.away, distinct)
        found.away[best] = places.INFINITY
        row = found.which[best]
        kept.take(first + i, arrays.after(found.q, row * n), found.errors[row])
    return distinct


def closed_solutions(
    form: ClosedForm, refinement: Refinement, only_one: bool, only_inside: bool, kept: Solutions
) -> None:
    """
    Fill in the solutions of an arm with a closed form.

    Each is refined, and proved by forward kinematics. If one is enough, it is the nearest of those
    inside the limits; if those inside them are, most others are left out.

    Parameters
    ----------
    form
        Of the arm.
    refinement
        Of the target, from candidates near to it.
    only_one, only_inside
        Whether the nearest solution inside the limits is enough, or all that are.
    kept
        Room for MOST_CANDIDATES solutions, or for one if that is enough.
    """
    most = places.MOST_CANDIDATES
    kept.require_fit(refinement.residual, form.n, 1 if only_one else most)
    found, psi = SolutionCandidates(most, kept.n), arrays.scratch(most * form.k)
    kept.count = _solve(form, refinement, only_one, only_inside, psi, found, kept, 0)
    arrays.give_back(psi)


def _solve(
    form: ClosedForm,
    refinement: Refinement,
    only_one: bool,
    only_inside: bool,
    psi: Flat,
    found: SolutionCandidates,
    kept: Solutions,
    first: int,
) -> int:
    # Does the work of `closed_solutions`; how many solutions stand from a place on.
    said = [0.0]
    candidates = _find(form, refinement.residual.pose, kept.near, psi, found, said)
    if only_inside and said[0] < KNOWN:
        candidates = _drop_beyond(candidates, found, kept)
    count = candidates
    if only_one:
        count = _keep_nearest(refinement, count, found, kept)
    else:
        count = _keep_all(refinement, count, found, kept, first)
    # Where no candidate is missing, and none has led to the solution of another.
    kept.regular = said[0] < places.INFINITY and count == candidates
    kept.sure = said[0] < SURE and count == candidates
    for i in range(first, first + count):
        q = arrays.after(kept.rows, i * kept.n)
        # All of sure ones are far from singular.
        kept.shares[i] = 1.0
        if only_one or not kept.sure:
            kept.shares[i] = dependence.share_of_last_pivot(
                refinement.residual, kept.joints.scales, q
            )
        posture.write_posture(form, q, arrays.whole_after(kept.postures, 3 * i))
    return count


def closed_solutions_of_each(
    form: ClosedForm,
    refinement: Refinement,
    only_inside: bool,
    poses: Floats,
    kept: Solutions,
    counts: Integers,
) -> None:
    """
    Fill in the solutions of many targets, as `closed_solutions` those of one.

    Parameters
    ----------
    form, refinement, only_inside
        As there; the refinement of any target.
    poses : shape (N, 4, 4)
        The targets.
    kept
        Room for MOST_CANDIDATES solutions of each; those of a target stand behind the others'.
    counts : shape (N, 2)
        How many solutions each has, and 1 where there are surely no others.
    """
    most, count = places.MOST_CANDIDATES, arrays.extent(poses, 0)
    kept.require_fit(refinement.residual, form.n, count * most)
    rows, written = arrays.numbers(poses, 16 * count), arrays.whole_results(counts, 2 * count)
    found, psi = SolutionCandidates(most, kept.n), arrays.scratch(most * form.k)
    target, first = refinement.residual.pose, 0
    for i in range(count):
        refinement.residual.pose = arrays.after(rows, 16 * i)
        more = _solve(form, refinement, False, only_inside, psi, found, kept, first)
        written[2 * i], written[2 * i + 1] = more, 1 if kept.sure else 0
        first += more
    refinement.residual.pose = target
    kept.count = first
    arrays.give_back(psi)


def eliminated_solutions(
    arm: SixJoints, refinement: Refinement, kept: Solutions, counts: Integers
) -> None:
    """
    Fill in the solutions of an arm of six joints that elimination finds.

    Each is refined, and proved by forward kinematics.

    Parameters
    ----------
    arm
        The joints.
    refinement
        Of the target, from candidates near to it.
    kept
        Room for MOST_CANDIDATES solutions.
    counts : shape (3,)
        How many complex solutions were found, each certified; how many of them are real; 1 where
        no real one is missing.
    """
    most = places.MOST_CANDIDATES
    kept.require_fit(refinement.residual, 6, most)
    written = arrays.whole_results(counts, 3)
    found, roots = SolutionCandidates(most, 6), Roots()
    lock = arrays.let_go()
    count = _find_roots(arm, refinement.residual.pose, roots, found)
    written[0], written[1], written[2] = roots.count, count, 1 if roots.proved else 0
    count = _keep_all(refinement, count, found, kept, 0)
    for i in range(count):
        q = arrays.after(kept.rows, 6 * i)
        kept.shares[i] = dependence.share_of_last_pivot(refinement.residual, kept.joints.scales, q)
    kept.count = count
    arrays.take_back(lock)


def _find_roots(arm: SixJoints, pose: Flat, roots: Roots, found: SolutionCandidates) -> int:
    # Fills in the real solutions of a pose; how many there are.
    T = [0.0] * 12
    arm.write_motion(pose, T)
    roots.find(arm, T)
    count = 0
    for k in range(roots.count):
        if roots.is_real[k] == 1:
            arm.write_joints(arrays.after(roots.psi, 12 * k), arrays.after(found.q, 6 * count))
            count += 1
    return count
