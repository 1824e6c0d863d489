"""
Singular poses from anywhere, with how the set of them lies there: an atlas of that set.

It is what keeps a search from depending on the luck of its starts: near a pose some of these are,
and from there Newton's method slides to the nearest.
"""

import math

import numpy as np

from ..forward.chain import Chain
from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers, Numbers
from ..measures.factors import Tape
from ..measures.task_rows import TaskRows
from . import factor_zeros, singular_equations
from .singular_equations import SingularEquations

# Seeds of a set, by how many joints it depends on; of more as the last. So many times more at most
# where joints reach farther than a turn.
SEEDS, MOST_TURNS = (1, 48, 512, 2048, 4096), 4
# Seeds of which positions of one joint that make an arm singular are found, poses at which one is
# tried, and how exact it is there.
FEW_SEEDS, TRIED, EXACT = 256, 8, 1e-11
# A normal along one joint, by its cosine; and positions that are one, rad.
ALONG, SAME = 1.0 - 1e-6, 1e-3
# Poses are all along curves where from each to the next, both ways, it is not farther, rad.
GAP = 0.3
# Newton's steps from a seed, and the longest of them, rad.
STEPS, LONGEST = 16, 0.5
# Converged: the singular value as a share of the largest, and the next step, rad.
SINGULAR, ARRIVED = 1e-6, 1e-5
# Of what is across a pose's tangent plane and what is along it, so much of the latter counts: the
# set bends.
BENDS = 0.5
# So far from a pose, rad, its tangent plane is followed.
FLAT = 0.4
# Poses are sorted into cells, by so many bins of each of two joints.
BINS = 16
# So many of a run of cells are tried side by side: 7 % less of a search than one by one.
AT_ONCE = 64
# Of positions inside a period, rad.
ROUND_OFF = 1e-9


class Atlas:
    """
    Poses all over the singular set of an arm, or over the zeros of each of its factors: frozen.

    Motions are in rad, those of prismatic joints divided by the length.

    Attributes
    ----------
    sets
        Number of sets: one for each factor, or one of all.
    codimension
        How many directions lead off a set.
    joints
        Number n of joints.
    positions : shape (alone, 3)
        Joints, and where each of them alone makes an arm singular by more equations than one, with
        their periods: these sets are known, and not among those of the atlas.
    is_dense
        Whether the set is curves, or less, that its poses are all along.

    Parameters
    ----------
    chain, task, tape
        Of the arm.
    of_factors
        Whether the sets are the factors' zeros.
    spans : shape (n, 3)
        Where the seeds of each joint begin and how far they reach, and its period, endless without
        one. No reach: the joint does not count.
    """

    def __init__(
        self, chain: Chain, task: TaskRows, tape: Tape, of_factors: bool, spans: Floats
    ) -> None:
        n = chain.dof
        equations = SingularEquations(chain, task)
        self.joints, self.sets = n, tape.factors if of_factors else 1
        self.codimension = 1 if of_factors else equations.count
        self.width = n * (1 + self.codimension)
        alone, lost = np.zeros((0, 3)), np.zeros(n)
        self.is_dense = False
        if self.codimension > 1 and n <= task.count and chain.loops == 0:
            alone, lost = _positions_alone(equations, self.codimension, spans)
        charts = 0
        tables, counts, begins, joints = [], np.zeros((self.sets, n)), [0], []
        for f in range(self.sets):
            reaches = spans[:, 1].copy()
            if of_factors:
                reaches[: tape.joints][~tape.dependences[f]] = 0.0
                reaches[tape.joints :] = 0.0
            counts[f] = reaches > 0.0
            turns = int(np.prod(np.maximum(reaches / places.TAU, 1.0)))
            seeds = SEEDS[min(int(np.sum(counts[f])), len(SEEDS) - 1)] * min(turns, MOST_TURNS)
            if chain.loops > 0 or n > places.MAX_SEARCHED_JOINTS:
                seeds = 0  # on the way loops might not close; above, nothing is searched
            table = np.zeros((seeds, self.width))
            given = np.column_stack([spans[:, 0], reaches])
            if of_factors:
                found = _fill_of_factor(tape, f, task, given, table)
            else:
                leaves_out = equations.leave_out(arrays.numbers(lost, n))
                found = _fill(equations, given, table)
                self.is_dense = _is_dense(table[:found], counts[0], spans)
                if not (leaves_out and self.is_dense):
                    alone, lost = alone[:0], np.zeros(n)
                if leaves_out and not self.is_dense:
                    equations.leave_out(arrays.numbers(lost, n))
                    found = _fill(equations, given, table)
            table = table[:found]
            table[:, :n][:, reaches == 0.0] = 0.0
            sorting = _joints_to_sort_by(counts[f])
            joints += sorting
            table, cells = _sorted(table, n, spans, sorting)
            tables.append(table)
            begins += [charts + int(np.sum(cells <= k)) for k in range(BINS * BINS)]
            charts += found
        table = np.ascontiguousarray(np.concatenate(tables))
        first, sorted_by = np.array(begins, dtype=np.int64), np.array(joints, dtype=np.int64)
        dimensions = (np.sum(counts, axis=1) - self.codimension).astype(np.int64)
        ends = np.array([_ends_of_counted(row) for row in counts], dtype=np.int64)
        turned, around = np.ascontiguousarray(table[:, :n].T), np.ascontiguousarray(spans)
        self.charts = arrays.numbers(table, charts * self.width)
        self.begins = arrays.whole(first, self.sets * BINS * BINS + 1)
        self.sorting = arrays.whole(sorted_by, 2 * self.sets)
        self.counts = arrays.numbers(counts, self.sets * n)
        self.spans = arrays.numbers(around, 3 * n)
        self.dimensions = arrays.whole(dimensions, self.sets)
        self.counted = arrays.whole(ends, 2 * self.sets)
        # The poses' positions again, those of one joint after those of another.
        self.by_joint, self.total = arrays.numbers(turned, charts * n), charts
        self.alone, self.positions = len(alone), arrays.numbers(alone, alone.size)
        self.left_out = arrays.numbers(lost, n)

    def dimension(self, f: int) -> int:
        """Return the dimension of a set: 0 where its poses are all there are."""
        return self.dimensions[f]

    def counts_of(self, f: int) -> Flat:
        """Return which of the joints (n,) a set depends on: those above zero."""
        return arrays.after(self.counts, f * self.joints)

    def nearest(
        self,
        f: int,
        u: Flat,
        radius: float,
        promise: float,
        most: int,
        picked: FlatIntegers,
        scores: Flat,
        away: Flat,
    ) -> int:
        """
        Fill in which poses of a set near u promise to be nearest, the most promising first.

        Returns how many there are within the radius.

        Parameters
        ----------
        f
            The set.
        u : shape (n,)
            Where from; brought into the periods.
        radius
            How far at most.
        promise
            How near they promise to be at least.
        most
            How many at most.
        picked, scores : shape (most,)
            Filled with the poses, and with how far from u the set promises to be by each.
        away : shape (n,)
            Room.
        """
        first, second = self.sorting[2 * f], self.sorting[2 * f + 1]
        # What is farther promises too little.
        radius = min(radius, (1.0 + ROUND_OFF) / BENDS * promise)
        columns = [0.0] * 16
        arrays.fill(scores, most, promise)
        for j in range(self.joints):
            counts = self.counts[f * self.joints + j] > 0.0
            u[j] = singular_equations.wrapped(u[j], self.spans[3 * j + 2]) if counts else 0.0
        for i in range(BINS):
            columns[i] = self._apart(second, i, u[second]) if second != first else 0.0
        found = 0
        for k in range(BINS):
            row = self._apart(first, k, u[first])
            i = 0
            while i < BINS:
                begin = i
                while i < BINS and row * row + columns[i] * columns[i] <= radius * radius:
                    i += 1
                if i > begin:
                    cell = (f * BINS + k) * BINS
                    found = self._look_into(
                        f, cell + begin, cell + i, u, radius, found, most, picked, scores, away
                    )
                i += 1
        return found

    def _apart(self, joint: int, k: int, value: float) -> float:
        # How far a position of a joint is from those of a bin.
        span = arrays.after(self.spans, 3 * joint)
        half = 0.5 * span[1] / BINS
        away = abs(value - span[0] - (2 * k + 1) * half)
        return max(min(away, abs(span[2] - away)) - half - ROUND_OFF, 0.0)

    def _look_into(
        self,
        f: int,
        cell: int,
        end: int,
        u: Flat,
        radius: float,
        found: int,
        most: int,
        picked: FlatIntegers,
        scores: Flat,
        away: Flat,
    ) -> int:
        # The poses of a run of cells, as in `nearest`.
        squares = [0.0] * 64
        begin, behind = self.begins[cell], self.begins[end]
        while begin < behind:
            count = min(behind - begin, AT_ONCE)
            poses = arrays.after(self.by_joint, begin)
            first, last = self.counted[2 * f], self.counted[2 * f + 1]
            write_squares(poses, self.total, first, last, count, u, self.spans, squares)
            for k in range(count):
                if not squares[k] <= radius * radius:
                    continue
                score = self._score(f, u, begin + k, away)
                if not score < scores[most - 1]:
                    continue
                found = min(found + 1, most)
                i = found - 1
                while i > 0 and scores[i - 1] > score:
                    scores[i], picked[i] = scores[i - 1], picked[i - 1]
                    i -= 1
                scores[i], picked[i] = score, begin + k
            begin += count
        return found

    def _score(self, f: int, u: Flat, at: int, away: Flat) -> float:
        # Fills `away` with the motion from u to a pose; returns how far the set promises to be
        # there. Joints that do not count are at 0 everywhere.
        chart = arrays.after(self.charts, at * self.width)
        begin, end = self.counted[2 * f], self.counted[2 * f + 1]
        whole = 0.0
        for j in range(begin, end):
            step = chart[j] - u[j]
            half = 0.5 * self.spans[3 * j + 2]
            if step > half:
                step -= 2.0 * half
            elif step < -half:
                step += 2.0 * half
            away[j] = step
            whole += step * step
        across = 0.0
        for i in range(self.codimension):
            share = _along(arrays.after(chart, self.joints * (1 + i)), away, begin, end)
            across += share * share
        return math.sqrt(across + BENDS * BENDS * max(whole - across, 0.0))

    def write_motion(self, f: int, u: Flat, at: int, away: Flat, motion: Flat) -> None:
        """
        Fill the motion (n,) from u to the foot on the tangent plane of a pose of a set, or as near
        to that as the pose still tells; `away` (n,) is room.
        """
        n, chart = self.joints, arrays.after(self.charts, at * self.width)
        arrays.fill(away, n, 0.0)
        arrays.fill(motion, n, 0.0)
        self._score(f, u, at, away)
        for i in range(self.codimension):
            normal = arrays.after(chart, n * (1 + i))
            share = _along(normal, away, 0, n)
            for j in range(n):
                motion[j] += share * normal[j]
        along = singular_equations.apart(away, motion, n)
        rest = 1.0 - FLAT / along if along > FLAT else 0.0
        for j in range(n):
            motion[j] += rest * (away[j] - motion[j])


def write_squares(
    by_joint: Flat,
    total: int,
    begin: int,
    end: int,
    count: int,
    u: Flat,
    spans: Flat,
    squares: Numbers,
) -> None:
    """
    Fill the squared distances from u of so many poses, by the joints from `begin` to `end`.

    Positions of one joint are `total` apart from those of the next.
    """
    arrays.fill(squares, count, 0.0)
    for j in range(begin, end):
        value, period = u[j], spans[3 * j + 2]
        positions = arrays.after(by_joint, j * total)
        for k in range(count):
            step = abs(positions[k] - value)
            other = period - step
            nearer = step if step < other else other
            squares[k] += nearer * nearer


def _along(normal: Flat, away: Flat, begin: int, end: int) -> float:
    return arrays.dot(arrays.after(normal, begin), arrays.after(away, begin), end - begin)


def _joints_to_sort_by(counts: Floats) -> list[int]:
    # The first two joints that count, the last of them again where there are fewer.
    counted = np.flatnonzero(counts)
    last = len(counted) - 1
    return [int(counted[min(k, last)]) if last >= 0 else 0 for k in range(2)]


def _ends_of_counted(counts: Floats) -> tuple[int, int]:
    # The joints that count are among these.
    counted = np.flatnonzero(counts)
    return (int(counted.min()), int(counted.max()) + 1) if len(counted) else (0, 0)


def _sorted(table: Floats, n: int, spans: Floats, sorting: list[int]) -> tuple[Floats, Integers]:
    # With every joint inside its period around zero, by the cells of two joints, which are
    # returned.
    for j in range(n):
        if spans[j, 2] < places.INFINITY:
            table[:, j] -= spans[j, 2] * np.floor(table[:, j] / spans[j, 2] + 0.5)
    inside = (table[:, sorting] - spans[sorting, 0]) / np.maximum(spans[sorting, 1], 1e-300)
    bins = np.clip(np.floor(BINS * inside), 0, BINS - 1).astype(np.int64)
    cells = BINS * bins[:, 0] + bins[:, 1]
    order = np.argsort(cells, kind='stable')
    return table[order], cells


def _write_seed(n: int, i: int, spans: Flat, u: Flat) -> None:
    # The i-th of a sequence that fills the spans evenly: multiples of the golden ratio's kin.
    ratio = 2.0
    counted = 0
    for j in range(n):
        if spans[2 * j + 1] > 0.0:
            counted += 1
    for _ in range(40 if counted > 0 else 0):
        power = 1.0
        for _ in range(counted):
            power *= ratio
        # Newton's method for ratio^(counted + 1) = ratio + 1.
        ratio -= (power * ratio - ratio - 1.0) / ((counted + 1) * power - 1.0)
    share = 1.0
    for j in range(n):
        u[j] = spans[2 * j] + 0.5 * spans[2 * j + 1]
        if spans[2 * j + 1] > 0.0:
            share /= ratio
            turn = 0.5 + (i + 1) * share
            u[j] = spans[2 * j] + spans[2 * j + 1] * (turn - math.floor(turn))


def _is_dense(table: Floats, counts: Floats, spans: Floats) -> bool:
    # Whether poses are all along curves, or single: each has all normals, and of every fourth
    # others are near on both sides along its tangent.
    n = len(spans)
    counted = np.flatnonzero(counts)
    normals = table[:, n:].reshape(len(table), table.shape[1] // n - 1, n)[:, :, counted]
    poses, dimension = table[:, counted], len(counted) - normals.shape[1]
    if (
        normals.shape[1] == 1
        or not len(table)
        or dimension not in (0, 1)
        or not np.all(np.any(normals, axis=2))
    ):
        return False
    periods = np.minimum(spans[counted, 2], places.LARGEST)
    for one, across in zip(poses[::4], normals[::4]) if dimension == 1 else ():
        away = poses - one
        away -= periods * np.round(away / periods)
        squares = np.einsum('ij,ij->i', away, away)
        along = squares - np.sum((away @ across.T) ** 2, axis=1)
        near = away[(squares > SAME * SAME) & (squares < GAP * GAP) & (along > 0.5 * squares)]
        if not len(near) or not np.any(near @ near[0] < 0.0):
            return False
    return True


def _positions_alone(
    equations: SingularEquations, codimension: int, spans: Floats
) -> tuple[Floats, Floats]:
    # Positions of one joint (K, 3) at which J_t is singular wherever the others are, and the turns
    # (n,) that are so. There one normal is enough, along that joint.
    n = len(spans)
    table = np.zeros((FEW_SEEDS, n * (1 + codimension)))
    table = table[: _fill(equations, np.ascontiguousarray(spans[:, :2]), table)]
    found: list[tuple[int, float, float]] = []
    lost = np.zeros(n)
    for one in table:
        joint = int(np.argmax(np.abs(one[n : 2 * n])))
        if np.any(one[2 * n :] != 0.0) or not abs(one[n + joint]) > ALONG:
            continue
        period = float(spans[joint, 2])
        is_known = False
        for j, at, _ in found:
            apart = singular_equations.wrapped(one[joint] - at, period)
            is_known = is_known or joint == j and abs(apart) < SAME
        if is_known:
            continue
        turns = np.zeros(n)
        position = _position_alone(equations, joint, one[joint], spans, turns)
        if position < places.INFINITY:
            found.append((joint, singular_equations.wrapped(position, period), period))
            lost += turns
    return np.array(found).reshape(-1, 3), lost


def _position_alone(
    equations: SingularEquations, joint: int, position: float, spans: Floats, turns: Floats
) -> float:
    # Newton's method of one joint, at several poses; infinite where it does not make all of them
    # singular. Marks the turns that are.
    n = equations.n
    given, lost = np.ascontiguousarray(spans[:, :2]), arrays.results(turns, equations.turns)
    work = arrays.scratch(2 * n)
    u, still = work, arrays.after(work, n)
    arrays.fill(still, n, 0.0)
    for i in range(2 * TRIED):
        _write_seed(n, i, arrays.numbers(given, 2 * n), u)
        u[joint] = position
        equations.move_to(still, u)
        equations.linearise()
        if i < TRIED:
            position += equations.step_of(joint)
        elif equations.are_singular(EXACT):
            equations.mark_lost(lost)
        else:
            position = places.INFINITY
    arrays.give_back(work)
    return position


def _fill(equations: SingularEquations, spans: Floats, table: Floats) -> int:
    # Fills the singular poses that are found from seeds; returns their number.
    n, seeds = equations.n, arrays.extent(table, 0)
    given, charts = arrays.numbers(spans, 2 * n), arrays.results(table, 0)
    width = n * (1 + equations.count)
    work = arrays.scratch(3 * n)
    found = 0
    lock = arrays.let_go()
    for i in range(seeds):
        found += _go(equations, i, given, arrays.after(charts, found * width), work)
    arrays.take_back(lock)
    arrays.give_back(work)
    return found


def _go(equations: SingularEquations, i: int, spans: Flat, chart: Flat, work: Flat) -> int:
    # From a seed onto the set; whether it was reached.
    n = equations.n
    u, step, still = work, arrays.after(work, n), arrays.after(work, 2 * n)
    _write_seed(n, i, spans, u)
    arrays.fill(still, n, 0.0)
    for _ in range(STEPS):
        equations.move_to(still, u)
        equations.linearise()
        length = equations.write_step_onto(step)
        if equations.are_singular(SINGULAR) and length < ARRIVED:
            arrays.copy(chart, n, u)
            equations.write_normals(arrays.after(chart, n))
            return 1
        if not length < places.INFINITY:
            return 0
        share = LONGEST / length if length > LONGEST else 1.0
        for j in range(n):
            u[j] += share * step[j]
    return 0


def _fill_of_factor(tape: Tape, f: int, task: TaskRows, spans: Floats, table: Floats) -> int:
    # The same of a factor's zeros.
    n, seeds = task.joints, arrays.extent(table, 0)
    given, charts = arrays.numbers(spans, 2 * n), arrays.results(table, 0)
    work = arrays.scratch(5 * n + tape.steps * (n + 1))
    origin, d, normal = work, arrays.after(work, n), arrays.after(work, 2 * n)
    found = 0
    lock = arrays.let_go()
    for i in range(seeds):
        _write_seed(n, i, given, origin)
        for j in range(n):
            origin[j] *= task.column_scale[j]
            d[j] = 0.0
        if factor_zeros.go(tape, f, task, origin, d, 0.0, normal, arrays.after(work, 3 * n)):
            chart = arrays.after(charts, found * 2 * n)
            for j in range(n):
                chart[j] = origin[j] / task.column_scale[j] + d[j]
                chart[n + j] = normal[j]
            found += 1
    arrays.take_back(lock)
    arrays.give_back(work)
    return found
