"""The zero of a factor nearest to a pose: Newton's method, which needs no Jacobian."""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat
from ..measures import factors
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows

# Steps: where the factor does not change its sign they are each half of the one before. So many at
# the end go to the zero only.
STEPS, LAST_STEPS = 120, 24
# The last step, and the longest, rad; and a step along the zeros after which none is needed.
ARRIVED, LONGEST, SLID = 1e-10, 0.5, 1e-6
# How much of the way along the zeros one step goes, and of the motion itself at most: beside a
# saddle, which the tangent plane does not know, a longer one leads back to where no zero is.
LEAST, MOST, SLIDE = 1.0 / 16.0, 4.0, 0.2


def go(
    tape: Tape,
    f: int,
    task: TaskRows,
    origin: Flat,
    d: Flat,
    farthest: float,
    normal: Flat,
    work: Flat,
) -> bool:
    """
    Bring a motion d (n,) to a zero of a factor, and along the zeros to the one nearest to origin.

    Returns whether it is there, and fills the unit normal (n,) of the zeros; a zero without a
    slope has none, and is none that is looked for.

    Parameters
    ----------
    tape, f, task
        The factor.
    origin : shape (n,), rad or m
        Where motions begin.
    d, normal : shape (n,)
        Motion and normal, as `column_scales` counts them.
    farthest
        Zeros farther than this are none that are looked for, and are not reached; 0 to go to a
        zero only, and not along the zeros.
    work : shape (2 n + steps of the tape times n + 1,)
        Room.
    """
    n = task.joints
    q, before, values = work, arrays.after(work, n), arrays.after(work, 2 * n)
    step = arrays.after(values, tape.ends[f] * (n + 1))
    slides, share, slid = farthest > 0.0, 1.0, 0.0
    for turn in range(STEPS):
        for j in range(n):
            q[j] = origin[j] + task.column_scale[j] * d[j]
        factors.run_factor(tape, f, n, q, values)
        squares, along, whole = 0.0, 0.0, 0.0
        for j in range(n):
            slope = step[j] * task.column_scale[j]
            squares += slope * slope
            along += slope * d[j]
            whole += d[j] * d[j]
        norm = math.sqrt(squares)
        if not norm > 0.0 or not squares < places.INFINITY:
            return False
        if slides and math.sqrt(whole) - abs(step[n]) / norm > farthest:
            return False
        if turn >= STEPS - LAST_STEPS:
            slides = False
        product, last, slid = 0.0, slid, 0.0
        for j in range(n):
            normal[j] = step[j] * task.column_scale[j] / norm
            slide = along / norm * normal[j] - d[j]
            product += slide * before[j]
            slid += slide * slide
            before[j] = slide
        if turn > 0 and slides:
            # As much as would have brought the last slide to its end, by what it left: where the
            # zeros bend steps of one length go round, or arrive slowly.
            gone = (last - product) / share
            share = min(max(last / gone, LEAST), MOST) if gone > 0.0 else MOST
        if share * share * slid > SLIDE * SLIDE * whole:
            share = SLIDE * math.sqrt(whole / slid)
        moved = 0.0
        for j in range(n):
            q[j] = -step[n] / norm * normal[j] + (share * before[j] if slides else 0.0)
            moved += q[j] * q[j]
        moved = math.sqrt(moved)
        shorter = LONGEST / moved if moved > LONGEST else 1.0
        for j in range(n):
            d[j] += shorter * q[j]
        if moved < ARRIVED:
            return True
        slides = slides and slid > SLID * SLID
    return False
