"""
Find the singular pose nearest to a pose: multi-start sequential projection.

The starts are the pose itself, each joint both ways, and the nearest samples of the atlas. Along a
motion the poses that were found are followed, and the starts are tried again one after the other:
a whole search is repeated each time the joints have moved by a share of the distance.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Public
from ..nearest.arm import Arm
from . import flat_loops, rank_equations
from .projection import Projection
from .singular_atlas import SingularAtlas

# Samples of the atlas that are starts; and if the pose is nearly singular but none was found near.
SAMPLES = 24
MORE_SAMPLES = 96
# Nearly singular: the condition number.
CONDITION_LIMIT = 1e3
# Distance times condition number, rad, above which a nearly singular pose is searched from more
# starts: it is 5 to 50 for most poses of most arms.
CONDITION_DISTANCE = 100.0
# Motion of one joint of a start, rad.
JOINT_START = 0.4
# Steps of a projection at most.
STEPS = 14
# A start is dropped if its estimate exceeds the best distance by this factor: the estimate of a
# bent set may be too large by that.
DROP_MARGIN = 1.3
# Poses that are followed.
MEMORY = 6
# Two poses nearer to each other than this share of their distance are the same.
SAME_SHARE = 0.1
# A search is repeated when the joints have moved by this share of the distance.
SEARCH_SHARE = 0.25
# Distances below this count as this for it, rad: the level is ERROR, and one search a message is
# enough.
SEARCH_FLOOR = 0.02
# The same for flat positions of loops.
FLAT_SHARE = 0.05


class SingularSearch:
    """
    Room for searches, the poses that were found, and the progress of the search under way.

    Parameters
    ----------
    arm
        The arm.
    samples
        Number of samples of the atlas that are starts.

    Attributes
    ----------
    distance
        To the nearest pose that was found, rad; infinite if none was found.
    nearest : shape (n,)
        The motion to it, rad.
    evaluations
        Number of evaluations of J so far.
    """

    def __init__(self, arm: Arm, samples: int = SAMPLES) -> None:
        self.arm, self.samples = arm, samples
        self.atlas = SingularAtlas(arm.chain, arm.task, arm.spans)
        self.projection = Projection(arm.chain, arm.task)
        self.groups: int = arm.chain.groups
        self.flat_moved: float = 0.0
        self.n, self.values = arm.chain.dof, arm.task.generic_rank
        self.distance: float = places.INFINITY
        self.evaluations: Public[int] = 0
        self.known, self.picks, self.tried, self.follows = 0, 0, 0, False
        self.moved = 0.0
        n, most = self.n, max(samples, MORE_SAMPLES)
        self.last, self.u, self.nearest = arrays.rooms(n, n, n)
        self.poses, self.lengths, self.drifts = arrays.rooms(MEMORY * n, MEMORY, MEMORY)
        self.away, self.work = arrays.rooms(most, flat_loops.room(arm.chain))
        self.flats, self.flat_lengths = arrays.rooms(self.groups * n, self.groups)
        (self.picked,) = arrays.whole_rooms(most)

    def forget(self) -> None:
        """Let the next pose be searched from all starts."""
        self.follows = False

    def look(self, q: Flat, row: Flat) -> None:
        """Search from all starts at positions q (n,), which `row` evaluates."""
        self._stand_at(q, row)
        self.known, self.distance, self.follows = 0, places.INFINITY, True
        # First: beyond the flat positions no start closes.
        self._look_for_flat_loops()
        self._begin()
        while self._try_next():
            pass
        if self._is_odd():
            self.picks = self.atlas.nearest(self.u, MORE_SAMPLES, self.picked, self.away)
            while self._try_next():
                pass
        self.moved = 0.0
        self.evaluations = self.projection.evaluations

    def follow(self, q: Flat, row: Flat) -> None:
        """Search on from the last pose of a motion; from all starts if there was none."""
        if not self.follows:
            self.look(q, row)
            return
        step = self._stand_at(q, row)
        self.moved += step
        self.distance = places.INFINITY
        self.flat_moved += step
        self._hold_flat_loops()
        for k in range(self.known):
            self.drifts[k] += step
        while self._bring_next():
            pass
        reach = SEARCH_SHARE * max(min(self.distance, places.FARTHEST), SEARCH_FLOOR)
        while self.tried * reach < self.moved * self._starts():
            if not self._try_next():
                self.moved = 0.0
                self._begin()
        self.evaluations = self.projection.evaluations

    def _look_for_flat_loops(self) -> None:
        # Of each group of loops, from the pose itself.
        self.flat_moved = 0.0
        d = self.projection.d
        for k in range(self.groups):
            limit = DROP_MARGIN * min(self.distance, places.FARTHEST)
            length = flat_loops.look(
                self.projection.equations, self.projection.origin, k, limit, d, self.work
            )
            self.flat_lengths[k] = length
            for j in range(self.n):
                self.flats[k * self.n + j] = self.u[j] + d[j]
            self._take_flat(k)

    def _hold_flat_loops(self) -> None:
        # What was found serves until the joints have moved by a share of the distance.
        nearest: float = places.FARTHEST
        for k in range(self.groups):
            nearest = min(nearest, self.flat_lengths[k])
        if self.groups > 0 and self.flat_moved > FLAT_SHARE * nearest:
            self._look_for_flat_loops()
            return
        for k in range(self.groups):
            if self.flat_lengths[k] < places.INFINITY:
                for j in range(self.n):
                    self.projection.d[j] = self.flats[k * self.n + j] - self.u[j]
                self.flat_lengths[k] = rank_equations.length_of(self.projection.d, self.n)
                self._take_flat(k)

    def _take_flat(self, k: int) -> None:
        # A flat position of group k is singular, too.
        if self.flat_lengths[k] < self.distance:
            self.distance = self.flat_lengths[k]
            arrays.copy(self.nearest, self.n, self.projection.d)

    def _stand_at(self, q: Flat, row: Flat) -> float:
        # Take the pose; returns the motion from the last one, rad.
        self.projection.equations.decompose(row)
        squares = 0.0
        for j in range(self.n):
            self.projection.origin[j] = q[j]
            at = q[j] / self.arm.task.column_scale[j]
            squares += (at - self.u[j]) * (at - self.u[j])
            self.u[j] = at
        return math.sqrt(squares)

    def _begin(self) -> None:
        # Begin another search.
        self.tried = 0
        most = MORE_SAMPLES if self.known > 0 and self._is_odd() else self.samples
        self.picks = self.atlas.nearest(self.u, most, self.picked, self.away)

    def _is_odd(self) -> bool:
        # Whether the pose is nearly singular, though no singular pose was found near.
        condition = self.projection.equations.condition_number()
        return condition > CONDITION_LIMIT and self.distance * condition > CONDITION_DISTANCE

    def _starts(self) -> int:
        return self.values + 2 * self.n + self.picks

    def _bring_next(self) -> bool:
        # Project the known pose that may be the nearest, if one may be nearer than the best.
        first = -1
        for k in range(self.known):
            is_first = first < 0 or self._least(k) < self._least(first)
            first = k if is_first and self.drifts[k] > 0.0 else first
        if first < 0 or not self._least(first) < self.distance:
            return False
        pose = arrays.after(self.poses, first * self.n)
        for j in range(self.n):
            self.projection.d[j] = pose[j] - self.u[j]
        length = self.projection.run(places.INFINITY, STEPS)
        if length < places.INFINITY:
            self._put(first, length)
        else:
            self.known -= 1
            self._copy(self.known, first)
        return True

    def _least(self, k: int) -> float:
        # The length changes by no more than the motion of the joints.
        return self.lengths[k] - self.drifts[k]

    def _put(self, k: int, length: float) -> None:
        # The motion of the projection is that to pose k.
        for j in range(self.n):
            self.poses[k * self.n + j] = self.u[j] + self.projection.d[j]
        self.lengths[k], self.drifts[k] = length, 0.0
        if length < self.distance:
            self.distance = length
            arrays.copy(self.nearest, self.n, self.projection.d)

    def _copy(self, k: int, to: int) -> None:
        arrays.copy(
            arrays.after(self.poses, to * self.n), self.n, arrays.after(self.poses, k * self.n)
        )
        self.lengths[to], self.drifts[to] = self.lengths[k], self.drifts[k]

    def _try_next(self) -> bool:
        # Run from the next start; False if there is none.
        k = self.tried
        if k >= self._starts():
            return False
        self.tried += 1
        limit = DROP_MARGIN * min(self.distance, places.FARTHEST)
        if self._write_start(k, limit):
            length = self.projection.run(limit, STEPS)
            if length < limit:
                self._remember(length)
        return True

    def _write_start(self, k: int, limit: float) -> bool:
        # Write the motion of start k to the projection; False if it leads nowhere nearer.
        d = self.projection.d
        if k < self.values:
            r = self.values - 1 - k
            return self.projection.equations.write_zero_of(r, d) < limit
        k -= self.values
        if k >= 2 * self.n:
            self.atlas.write_motion(self.u, self.picked[k - 2 * self.n], d)
            return True
        # Half of the way to a flat position the loops still close.
        reach = min(JOINT_START, self.distance if self.groups == 0 else 0.5 * self.distance)
        arrays.fill(d, self.n, 0.0)
        d[k // 2] = reach if k % 2 == 0 else -reach
        return self.atlas.count == 0 or self.atlas.matters(k // 2)

    def _remember(self, length: float) -> None:
        # Keep what the projection found: in the place of the same pose, or of the farthest.
        place = self.known
        for k in range(self.known):
            squares = 0.0
            for j in range(self.n):
                apart = self.poses[k * self.n + j] - self.u[j] - self.projection.d[j]
                squares += apart * apart
            if math.sqrt(squares) <= SAME_SHARE * length:
                place = k
        if place == self.known:
            if self.known < MEMORY:
                self.known += 1
                self.lengths[place] = places.INFINITY
            else:
                place = 0
                for k in range(self.known):
                    if self.lengths[k] > self.lengths[place]:
                        place = k
        if length < self.lengths[place]:
            self._put(place, length)


def find_singular(
    search: SingularSearch,
    rows: Floats,
    q: Floats,
    distances: Floats,
    poses: Floats,
    in_order: bool,
) -> None:
    """
    Fill the distance to the nearest singular pose of each position, and that pose.

    Parameters
    ----------
    search
        Of the arm.
    rows : shape (N, width)
        As `evaluate` fills them.
    q : shape (N, n), rad or m
        Positions.
    distances, poses : shape (N,) and (N, n)
        Filled; infinite and undefined if none was found.
    in_order
        Whether they are poses of a motion.
    """
    n, count, width = search.n, arrays.extent(q, 0), arrays.extent(rows, 1)
    table, positions = arrays.numbers(rows, 0), arrays.numbers(q, 0)
    lengths, found = arrays.results(distances, count), arrays.results(poses, count * n)
    scale = search.arm.task.column_scale
    lock = arrays.let_go()
    for k in range(count):
        position = arrays.after(positions, k * n)
        if in_order:
            search.follow(position, arrays.after(table, k * width))
        else:
            search.look(position, arrays.after(table, k * width))
        lengths[k] = search.distance
        for j in range(n):
            found[k * n + j] = position[j] + scale[j] * search.nearest[j]
    arrays.take_back(lock)
