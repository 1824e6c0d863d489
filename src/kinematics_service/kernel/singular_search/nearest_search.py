# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find the singular pose nearest to given joint positions: sequential projection from several starts.

The starts of the projection are:

- joint positions at which a singular value becomes zero to first order;
- joint positions at which the tool has lost a direction that is a combination (mixture) of the
  directions of the two least singular values;
- joint positions after a motion of one joint, for each joint in both directions;
- the nearest samples of the atlas, a list of singular poses.

If the joints move, the search updates the singular poses that it has found, and tries the starts
again one by one. By the time the joints have moved by a quarter of the distance to the nearest
singular pose, the search has tried each start once.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Public
from . import flat_loops, projection, rank_equations, start_motions
from .arm import Arm
from .projection import Projection
from .singular_atlas import SingularAtlas

# Number of samples of the atlas (stored singular poses) from which projections start.
SAMPLES = 24
# Number of atlas samples from which the search starts if the arm has closed loops. The number is
# small, because a step of the projection takes 20 times as long as without loops.
SAMPLES_OF_LOOPS = 6
# Number of atlas samples from which the search starts if J is nearly singular but no singular pose
# was found within DOUBTFUL_DISTANCE.
NEARLY_SINGULAR_SAMPLES = 96
# If J is nearly singular but the nearest singular pose found is farther than this, rad, the search
# tries more samples.
DOUBTFUL_DISTANCE = 0.1
# If the two least singular values are small, the direction that the tool loses at the nearest
# singular pose can be any combination of the two singular vectors. The search starts from this
# number of combinations. The weights of the two vectors are cosine and sine of angles 22.5 degrees
# apart.
MIXTURES = 8
# The search projects joint positions onto the set of singular poses (projection.py). Largest
# number of steps that a projection does along this set.
STEPS = 14
# The search runs projections onto the set of singular poses from several starts. Each projection
# estimates the distance from the present joint positions to the singular pose that it approaches.
# The projection is dropped if `estimate > DROP_MARGIN * smallest distance found so far`. The
# factor is above 1, because the estimate is linear and may be larger than the distance to the
# curved set of singular poses.
DROP_MARGIN = 1.3
# Largest number of singular poses that the search follows while the joints move.
MEMORY = 6
# A ratio with two uses.
#
# 1. If a projection finds a singular pose P, let r be the distance from the present joint
#    positions to P. A stored pose is taken as equal to P if the distance from the stored pose to P
#    is at most `SAME_POSE_RATIO * r`.
# 2. Only for an arm with closed loops: let f be the distance to the nearest joint positions at
#    which the loop equations are singular. The search for such joint positions is repeated after a
#    joint motion of `SAME_POSE_RATIO * f`.
SAME_POSE_RATIO = 0.1
# While the joints move, the search works in rounds. In a round, it runs one projection onto the
# set of singular poses from each start. A round ends after a joint motion of this fraction of the
# distance to the nearest singular pose.
SEARCH_RATIO = 0.25
# While the joints move, the search works in rounds. In a round, it runs one projection onto the
# set of singular poses from each start. A round ends after a joint motion of
# `SEARCH_RATIO * max(distance, SEARCH_FLOOR)`, rad, where `distance` is the distance to the
# nearest singular pose. Without SEARCH_FLOOR, a round near a singular pose would end after a tiny
# joint motion, and many rounds would take much time. These rounds are not needed: at distances
# below SEARCH_FLOOR, the status is already ERROR, because the default of `stop` is 0.03 rad.
SEARCH_FLOOR = 0.02


class NearestSearch:
    """
    Searches the singular pose nearest to the joint positions of one arm, and updates this pose
    while the joints move.

    Parameters
    ----------
    arm
        The arm.
    samples
        Number of samples in the atlas (stored singular poses) from which projections start; by
        default SAMPLES or SAMPLES_OF_LOOPS.

    Attributes
    ----------
    distance
        Distance to the nearest singular pose that was found, rad; infinite if none was found.
    evaluations
        Number of evaluations of J by projections so far.
    """

    def __init__(self, arm: Arm, samples: int = -1) -> None:
        if samples < 0:
            samples = SAMPLES_OF_LOOPS if arm.chain.loops > 0 else SAMPLES
        self.arm, self.samples = arm, samples
        self.atlas: SingularAtlas = arm.atlas()
        self.projection = Projection(arm.chain, arm.task, arm.spans)
        self.groups: int = arm.chain.groups
        self.n, self.values = arm.chain.dof, arm.task.generic_rank
        self.distance: float = places.INFINITY
        self.evaluations: Public[int] = 0
        self.pose_count, self.starts, self.tried, self.is_following = 0, 0, 0, False
        self.moved, self.flat_moved = 0.0, 0.0
        n, max_count = self.n, max(samples, NEARLY_SINGULAR_SAMPLES)
        self.last, self.u, self.nearest = arrays.rooms(n, n, n)
        self.poses, self.lengths, self.drifts = arrays.rooms(MEMORY * n, MEMORY, MEMORY)
        self.sample_distances, self.work = arrays.rooms(max_count, flat_loops.room(arm.chain))
        self.flats, self.flat_lengths = arrays.rooms(self.groups * n, self.groups)
        (self.picked,) = arrays.whole_rooms(max_count)

    def write_pose(self, pose: Flat) -> None:
        """
        Fill `pose` (n,) with the joint positions of the nearest singular pose found, rad or m.
        """
        for j in range(self.n):
            scale = self.arm.task.column_scale[j]
            pose[j] = self.projection.origin[j] + scale * self.nearest[j]

    def look(self, q: Flat, row: Flat) -> None:
        """
        Find the singular pose nearest to joint positions q (n,) by projections from all starts.

        The module's docstring lists the starts. `row` has the results of `evaluate` at q.
        """
        self._stand_at(q, row)
        self.pose_count, self.distance, self.is_following = 0, places.INFINITY, True
        # Search first the joint positions at which the loop equations are singular. The loops do
        # not close beyond such positions, so the distance to them limits the steps of the
        # projections.
        self._look_for_flat_loops()
        self._take_own_pose()
        self._begin()
        while self._try_next():
            pass
        if self._is_searched() and self._is_unexplained():
            self._pick(NEARLY_SINGULAR_SAMPLES)
            while self._try_next():
                pass
        self._polish()
        self.moved = 0.0
        self.evaluations = self.projection.evaluations

    def follow(self, q: Flat, row: Flat) -> None:
        """
        Update the nearest singular pose for the next joint positions q (n,) of a motion; `row` has
        the results at q.

        If q is the first position of the motion, or far from the previous position, the method
        searches from all starts.
        """
        if not self.is_following:
            self.look(q, row)
            return
        step = self._stand_at(q, row)
        reach = SEARCH_RATIO * max(min(self.distance, places.FARTHEST), SEARCH_FLOOR)
        if not step <= reach:
            self.look(q, row)
        elif step > 0.0:
            self._follow(q, row, step)
        self.evaluations = self.projection.evaluations

    def _follow(self, q: Flat, row: Flat, step: float) -> None:
        self.moved += step
        self.flat_moved += step
        previous_count, self.distance = self.pose_count, places.INFINITY
        self._hold_flat_loops()
        for k in range(self.pose_count):
            self.drifts[k] += step
        self._take_own_pose()
        while self._bring_next():
            pass
        if previous_count > 0 and self.pose_count == 0:
            self.look(q, row)
            return
        reach = SEARCH_RATIO * max(min(self.distance, places.FARTHEST), SEARCH_FLOOR)
        # In a round, each start is tried once, and the joints move by `reach`, rad. `tried` counts
        # the starts tried in this round, and `moved` is the joint motion in this round. Try the
        # next starts until `tried / starts` is at least `moved / reach`.
        while self.tried * reach < self.moved * self.starts:
            if not self._try_next():
                self.moved = 0.0
                self._begin()

    def _polish(self) -> None:
        # Runs one more projection from the nearest singular pose that was found so far. Its
        # tolerance is `places.SOLUTION_TOLERANCE`, so that this pose gets full accuracy.
        nearest = -1
        for k in range(self.pose_count):
            nearest = k if self.lengths[k] == self.distance else nearest
        if nearest >= 0:
            arrays.copy(self.projection.d, self.n, self.nearest)
            length = self.projection.run(places.INFINITY, STEPS, places.SOLUTION_TOLERANCE)
            if length <= self.distance * (1.0 + projection.SLIDE_TOLERANCE):
                self.distance = places.INFINITY
                self._put(nearest, length)

    def _take_own_pose(self) -> None:
        # If the present joint positions are singular, stores them as a singular pose. If they are
        # nearly singular, projects them onto the set of singular poses, and stores the projected
        # positions.
        condition, length = self.projection.equations.condition_number(), places.INFINITY
        arrays.fill(self.projection.d, self.n, 0.0)
        if condition >= 1.0 / places.RANK_TOLERANCE:
            length = 0.0
        elif condition > places.NEARLY_SINGULAR and self._is_searched():
            length = self.projection.run(places.FARTHEST, STEPS, projection.SLIDE_TOLERANCE)
        if length < places.FARTHEST:
            self._remember(length)

    def _look_for_flat_loops(self) -> None:
        # For each group of loops, searches the nearest joint positions at which the equations of
        # the group are singular.
        self.flat_moved = 0.0
        d = self.projection.d
        for k in range(self.groups):
            limit = DROP_MARGIN * min(self.distance, places.FARTHEST)
            origin = self.projection.origin
            length = flat_loops.look(self.projection.equations, origin, k, limit, d, self.work)
            self.flat_lengths[k] = length
            for j in range(self.n):
                self.flats[k * self.n + j] = self.u[j] + d[j]
            self._take_flat(k)
        # Limit each projection step to half of the distance to the nearest pose at which the loop
        # equations are singular. The loops still close after such a step.
        if self.groups > 0:
            self.projection.radius = min(projection.TRUST_RADIUS, 0.5 * self.distance)

    def _hold_flat_loops(self) -> None:
        # Flat positions are joint positions at which loop equations are singular. If the joints
        # have moved by more than a tenth of the distance to the nearest flat position, searches
        # new flat positions. Otherwise, keeps the stored flat positions and updates the distances
        # to them.
        nearest: float = places.FARTHEST
        for k in range(self.groups):
            nearest = min(nearest, self.flat_lengths[k])
        if self.groups > 0 and self.flat_moved > SAME_POSE_RATIO * nearest:
            self._look_for_flat_loops()
            return
        for k in range(self.groups):
            if self.flat_lengths[k] < places.INFINITY:
                for j in range(self.n):
                    self.projection.d[j] = self.flats[k * self.n + j] - self.u[j]
                self.flat_lengths[k] = rank_equations.length_of(self.projection.d, self.n)
                self._take_flat(k)

    def _take_flat(self, k: int) -> None:
        # Row k of `flats` has joint positions at which the equations of loop group k are singular.
        # If this row is nearer to the present joint positions than the nearest singular pose found
        # so far, stores the row as the nearest singular pose.
        if self.flat_lengths[k] < self.distance:
            self.distance = self.flat_lengths[k]
            arrays.copy(self.nearest, self.n, self.projection.d)

    def _stand_at(self, q: Flat, row: Flat) -> float:
        # Sets the present joint positions to q. Returns the length of the motion from the previous
        # joint positions to q, rad.
        self.projection.equations.decompose(row)
        squares = 0.0
        for j in range(self.n):
            self.projection.origin[j] = q[j]
            at = q[j] / self.arm.task.column_scale[j]
            squares += (at - self.u[j]) * (at - self.u[j])
            self.u[j] = at
        return math.sqrt(squares)

    def _begin(self) -> None:
        # Begins a new round in which each start is tried once.
        self.tried = 0
        is_unexplained = self.pose_count > 0 and self._is_unexplained()
        self._pick(NEARLY_SINGULAR_SAMPLES if is_unexplained else self.samples)
        if not self._is_searched():
            self.tried = self.starts

    def _pick(self, max_count: int) -> None:
        picked: int = self.atlas.nearest(self.u, max_count, self.picked, self.sample_distances)
        self.starts = self.values + MIXTURES + 2 * self.n + picked

    def _is_searched(self) -> bool:
        # Returns whether singular poses are searched. Returns False if a joint position is above
        # LARGEST_REDUCED, because the round-off of so large a position is too large for the
        # search. Returns False if the arm has too many joints for an atlas.
        largest = 0.0
        for j in range(self.n):
            largest = max(largest, abs(self.u[j]))
        return largest < places.LARGEST_REDUCED and self.n <= places.MAX_SEARCHED_JOINTS

    def _is_unexplained(self) -> bool:
        # Returns whether J is nearly singular although the search found no singular pose within
        # DOUBTFUL_DISTANCE.
        condition = self.projection.equations.condition_number()
        return condition > places.NEARLY_SINGULAR and self.distance > DOUBTFUL_DISTANCE

    def _bring_next(self) -> bool:
        # Updates one stored singular pose by a projection that starts from it. Each stored pose
        # has a lower bound of its distance from the present joint positions (`_least`). Chooses
        # the pose with the least bound among the poses not yet updated after the last joint
        # motion. Returns False, without a projection, if this bound is not below `distance`, the
        # smallest distance found so far.
        first = -1
        for k in range(self.pose_count):
            is_first = first < 0 or self._least(k) < self._least(first)
            first = k if is_first and self.drifts[k] > 0.0 else first
        if first < 0 or not self._least(first) < self.distance:
            return False
        pose = arrays.after(self.poses, first * self.n)
        for j in range(self.n):
            self.projection.d[j] = pose[j] - self.u[j]
        length = self.projection.run(places.INFINITY, STEPS, projection.SLIDE_TOLERANCE)
        if length < places.INFINITY:
            self._put(first, length)
        else:
            self.pose_count -= 1
            last = arrays.after(self.poses, self.pose_count * self.n)
            arrays.copy(pose, self.n, last)
            self.lengths[first] = self.lengths[self.pose_count]
            self.drifts[first] = self.drifts[self.pose_count]
        return True

    def _least(self, k: int) -> float:
        # Returns a lower bound of the distance to stored pose k: the last computed distance minus
        # the later motion of the joints.
        return self.lengths[k] - self.drifts[k]

    def _put(self, k: int, length: float) -> None:
        # Writes to row k of `poses` the singular pose that the projection found. `length` is the
        # length of the joint motion from the present positions to this pose, rad.
        for j in range(self.n):
            self.poses[k * self.n + j] = self.u[j] + self.projection.d[j]
        self.lengths[k], self.drifts[k] = length, 0.0
        if length < self.distance:
            self.distance = length
            arrays.copy(self.nearest, self.n, self.projection.d)

    def _try_next(self) -> bool:
        # Runs the projection from the next start. Returns False if all starts have been tried.
        k = self.tried
        if k >= self.starts:
            return False
        self.tried += 1
        limit = DROP_MARGIN * min(self.distance, places.FARTHEST)
        if limit > 0.0 and self._write_start(k, limit):
            length = self.projection.run(limit, STEPS, projection.SLIDE_TOLERANCE)
            if length < limit:
                self._remember(length)
        return True

    def _write_start(self, k: int, limit: float) -> bool:
        # Fills the array `d` of the projection with the joint motion from the present joint
        # positions to start number k. Returns False if no singular pose nearer than `limit` can be
        # found from this start.
        d = self.projection.d
        if k < self.values:
            r = self.values - 1 - k
            return start_motions.write_zero_of(self.projection.equations, r, d) < limit
        k -= self.values
        if k < MIXTURES:
            turn = places.PI * (k + 0.5) / MIXTURES
            origin = self.projection.origin
            length = start_motions.write_zero_between(
                self.projection.equations, origin, turn, limit, d
            )
            return length < limit
        k -= MIXTURES
        if k >= 2 * self.n:
            self.atlas.write_motion(self.u, self.picked[k - 2 * self.n], d)
            return True
        reach = min(self.projection.radius, self.distance)
        arrays.fill(d, self.n, 0.0)
        d[k // 2] = reach if k % 2 == 0 else -reach
        return self.atlas.matters(k // 2)

    def _remember(self, length: float) -> None:
        # Stores the singular pose that the projection found. If a stored pose is nearly equal, the
        # nearer of the two is kept. If the memory is full, the new pose replaces the farthest
        # stored pose, if the new pose is nearer.
        place, farthest = -1, 0
        for k in range(self.pose_count):
            squares = 0.0
            for j in range(self.n):
                apart = self.poses[k * self.n + j] - self.u[j] - self.projection.d[j]
                squares += apart * apart
            if math.sqrt(squares) <= SAME_POSE_RATIO * length:
                place = k
            if self.lengths[k] > self.lengths[farthest]:
                farthest = k
        if place < 0 and self.pose_count < MEMORY:
            place = self.pose_count
            self.pose_count += 1
            self.lengths[place] = places.INFINITY
        elif place < 0:
            place = farthest
        if length < self.lengths[place]:
            self._put(place, length)
