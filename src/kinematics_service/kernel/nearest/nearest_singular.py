"""
The singular pose nearest to a pose: Newton's method from where the first and second order point.

One step goes onto the set of singular poses and along it to its nearest point at once. Most poses
need no search; most others one start; a saddle of the least singular value needs several.

Along a motion the answer of the last search serves for some way: no singular pose comes nearer
faster than the joints move.
"""

import math

from ..layout import arrays, places
from ..layout.arrays import Flat, Public
from . import factor_zeros, singular_equations
from .arm import Arm
from .atlas import Atlas
from .factor_proof import FactorProof
from .singular_equations import SingularEquations
from .singular_pencil import SingularPencil
from .singular_quadric import SingularQuadric

# Beyond so many rad (a prismatic joint's divided by the length) nothing is looked for.
HORIZON = 1.0
# Evaluations at most of one search, of some 2 to 4 us each; hardly any needs more. A thorough one
# has so many times as many.
ENOUGH, THOROUGH = 200, 20
# A pose is singular where the singular value is below this share of the largest, and the next step
# below this share of the way: at a flat saddle the first alone would lie.
SINGULAR, NEXT_STEP, NO_STEP = 1e-7, 1e-3, 1e-9
# Longest step of a run, rad.
LONGEST = 0.3
# Gains of the distance that end a run, as a share; and one of few steps, which follows a pose.
NO_GAIN, NO_GAIN_FOLLOWED = 1e-5, 5e-4
# Steps of a run, of these at full length, and at its end onto the set only: along it they may go
# round between two branches.
STEPS, FULL_STEPS, LAST_STEPS = 10, 4, 3
# A run that is on its way to a nearer one than was found, the next step below this share of the
# way, has so many steps more: where two singular values vanish nearly together it is late.
ON_ITS_WAY, LATE, MORE_STEPS = 0.5, 0.4, 12
# It goes round a place that is all but singular where its next step is no shorter than this share
# of what it was so many steps before. After its first steps, a run that comes as near to the last
# such place as a step there was long, or as this share of the way, ends too, unless its own step
# is shorter than that one by this share.
ROUND, STEPS_ROUND, TRIED, TRAPPED, SHORTER = 0.8, 4, 2, 0.03, 0.5
# A run that comes beside a pose that was found, by this share of the way, would find it again, and
# ends: 4 to 7 % less of a search of six joints in general. Not of a thorough one: a run may end
# nearer to the same pose.
BESIDE = 0.02
# What the first order says, or such a run did not reach, is another one where it is nearer than
# this share of what was found.
NEARER = 0.6
# Of what is farther than this, rad, the first order says too little for that; and a place where
# runs of a search that is not thorough went round, beyond the second.
MISSED, GONE_ROUND = 0.1, 0.2
# Of larger positions, rad, the last digit is too coarse for singular poses to be found.
COARSE = 1e8
# What the first order says of a pose nearer than this, rad, is believed where it agrees.
SURE = 0.1
# Not so where the second order may see one nearer than this share of what was found.
SADDLE = 0.1
# So many poses of the atlas are starts at most, that are farther than what was found by so much at
# most, rad; and of the zeros of a factor, farther by so much at most.
CHARTS, SPREAD = 32, 0.35
# Those of a thorough search.
MORE_CHARTS, WIDER_SPREAD, WIDER, NEAR_BY = 128, 1.0, 2.0, 0.1
# Of a dense atlas so many poses are starts at most, farther than what was found by so much, rad.
FEW_CHARTS, GAP = 8, 0.1
# Of starts that lead to farther ones than that by this share none is given up: along a motion they
# may become the nearest. Starts nearer to each other than this share of their length are one.
WIDE, APART = 1.1, 0.4
ZEROS, FEW_ZEROS, ZEROS_APART = 3, 1, 0.2
# Of zeros of more dimensions than the first the atlas has too few, and beside a saddle nearer than
# the second, rad, of others too: there the second order of a factor says where to begin.
NARROW, FINE = 2, 0.1
# Where the slope changes by so many times itself up to what was found, a zero may be on the other
# side; by so many times, on all sides. From there a way may lead so many times as far; all joints
# together go both ways for so many joints at most.
BENT, VERY_BENT, AROUND, CORNERS = 1.2, 1.7, 2.0, 6
# Without factors the other side is tried so near only, rad: of what is farther it finds no more.
NEAR_BENT = 0.25
# From a direction between those of the two least singular values a search starts where one is lost
# within this times what was found.
BETWEEN = 1.5
# A pose that is all but singular, by this share of the second singular value, though nothing was
# found nearer than this, rad, is searched as if it were asked for alone: a saddle that errors of a
# table leave has its nearest singular poses anywhere. Of random poses that is none of a thousand;
# where more equations than one tell, many along a motion.
LEAST, THOUGH = 0.01, 0.05
# So many poses that were found are remembered, those nearer to each other than this share of their
# distance as one. They are followed along a motion up to this share of the distance; then another
# search tells whether new ones have come near.
MEMORY, SAME, FOLLOWED = 6, 0.2, 0.1
FOLLOWING_STEPS = 6
# One is not moved before the joints have moved by this share of its distance, which is then too
# large by half the square of that; nor before it may be nearer than the nearest by this share.
KEPT, LITTLE_NEARER = 0.03, 0.005
# A search begins with what the last one found, up to this motion, rad.
KNOWN = 0.3
# What was found agrees with the first order up to this share.
AGREES = 0.3
# Of all factors within this share of what was found no zero is, where that is proved: by so many
# boxes.
CLEARED, TOLD, BOXES, HALVINGS = 0.95, 1.1, 200, 40
# What was found in another way serves while the joints move by this share of its distance.
HELD = 0.05


class NearestSearch:
    """
    Room to look for the singular pose nearest to a pose, what was found, and how far that serves.

    Parameters
    ----------
    arm
        The arm.
    thorough
        Whether all starts are tried, and more of them, whatever the first ones find.

    Attributes
    ----------
    budget
        Evaluations of the arm at most, of one pose.
    distance
        To the pose that was found, rad; infinite where none was.
    complete
        Whether all starts of the search were tried, or none was needed.
    evaluations
        How many there were.
    reads_directions
        Whether it begins with the directions of a pose's J_t.
    lasting
        Up to this motion from the pose of the last search its answer serves, rad; negative where
        there was none.
    """

    def __init__(self, arm: Arm, thorough: bool = False) -> None:
        if not arm.reach > 0.0:
            raise TypeError('an arm without reach has no singular poses to look for')
        self.arm, self.thorough = arm, thorough
        self.atlas: Atlas = arm.atlas()
        self.here = SingularEquations(arm.chain, arm.task)
        self.equations = SingularEquations(arm.chain, arm.task)
        self.equations.leave_out(self.atlas.left_out)
        self.quadric = SingularQuadric(arm.chain.dof)
        self.proof = FactorProof(arm.tape, arm.task)
        self.along_curves = self.atlas.is_dense and not thorough
        self.reads_directions = not (arm.factors_complete or self.along_curves)
        self.boxes: Public[int] = THOROUGH * BOXES if thorough else BOXES
        self.pieces: Public[int] = 0
        self.wide, self.apart, self.cleared = WIDE, APART, 0.0
        self.budget: Public[int] = THOROUGH * ENOUGH if thorough else ENOUGH
        self.n, self.count = arm.chain.dof, self.equations.count
        self.pencil = SingularPencil(self.n, self.count)
        self.distance: float = places.INFINITY
        self.complete, self.evaluations = True, 0
        self.by_product, self.by_least, self.by_quadric = 0.0, 0.0, 0.0
        self.smallest, self.second, self.slope = 0.0, 0.0, 0.0
        self.free, self.lasting = 0.0, -1.0
        self.standing, self.stands_for, self.trap_step = False, -1, 0.0
        self.missed: float = places.INFINITY
        self.left_before: float = places.INFINITY
        self.known, self.settled = 0, False
        n = self.n
        tape = self.arm.tape.steps * (n + 1) + 2 * n
        charts = max(MORE_CHARTS, ZEROS)
        self.origin, self.first, self.curved, self.d = arrays.rooms(n, n, n, n)
        self.onto, self.along, self.reached, self.nearest = arrays.rooms(n, n, n, n)
        self.wrapped, self.searched, self.before, self.trap = arrays.rooms(n, n, n, n)
        self.tape, self.away, self.motion = arrays.rooms(tape, n, n)
        (self.scores,) = arrays.rooms(charts)
        (self.picked,) = arrays.whole_rooms(charts)
        self.poses, self.slid_at = arrays.rooms(MEMORY * n, MEMORY * n)
        (self.lengths_of,) = arrays.rooms(MEMORY)

    def look(
        self,
        q: Flat,
        row: Flat,
        W: Flat,
        measures: Flat,
        first_order: float,
    ) -> None:
        """
        Look for the singular pose nearest to q (n,).

        Parameters
        ----------
        q, row
            The pose, and what evaluates it.
        W, measures
            As `measure_row` left them; W is not read by a search that `reads_directions` not.
        first_order
            The distance by the product of the singular values, or by the factors, rad.
        """
        n, k = self.n, self.arm.task.generic_rank
        self.complete, self.evaluations = True, 0
        self.by_product, self.free = first_order, first_order
        self.missed, self.settled = places.INFINITY, False
        self.trap_step = 0.0
        if not (self.lasting >= 0.0 and self._moved_from(self.searched, q) <= KNOWN):
            self.known = 0
        self._bring_known(q)
        for j in range(n):
            self.searched[j] = q[j]
            if not abs(q[j]) < COARSE * self.arm.task.column_scale[j]:
                self.complete = False
        self.lasting = -1.0
        if n > places.MAX_SEARCHED_JOINTS:
            self._stand_at(q)
            self.complete = False
            return
        if measures[places.RANK] < k:
            self._stand_at(q)
            self.distance, self.complete = 0.0, True
            return
        if self.arm.factors_complete:
            self._look_at_factors()
            self.settled = True
        else:
            way_out = arrays.after(measures, places.LOST_AT + 6 + n)
            sigma = arrays.after(way_out, n)
            if self.along_curves:
                self._search_along_curves()
            else:
                self.here.take(row, W, sigma)
                self._estimate(sigma)
                self.settled = self._search()
        self.lasting = FOLLOWED * min(self.distance, HORIZON)

    def forget(self) -> None:
        """Let the next search begin with nothing that the last one found."""
        self.lasting = -1.0

    def hold(self, q: Flat, pose: Flat, away: float, is_decided: bool) -> None:
        """Hold what was found from q (n,) in another way, while the joints move little."""
        self.distance, self.complete = away, is_decided
        self.lasting = HELD * min(away, HORIZON)
        arrays.copy(self.searched, self.n, q)
        arrays.copy(self.poses, self.n, pose)

    def holds(self, q: Flat) -> bool:
        """Return whether what is held serves at q (n,); its distance is brought to what it is."""
        if not self._moved_from(self.searched, q) <= self.lasting:
            return False
        if self.distance < places.INFINITY:
            self.distance = self._moved_from(self.poses, q)
        return True

    def follow(self, q: Flat, first_order: float) -> bool:
        """
        Return whether the answer of the last search serves at q (n,), brought to what it is there.
        """
        if not self._moved_from(self.searched, q) <= self.lasting:
            return False
        self.evaluations = 0
        if not self._bring_known(q):
            return False
        if self.arm.factors_complete:
            # Nearer than what is proved there is nothing, so far as the joints have not moved.
            cleared = self.cleared - self._moved_from(self.searched, q)
            return not min(self.distance, HORIZON) > TOLD * cleared or not self.complete
        # What the first order said there already the search has looked at.
        looked_at = self.by_product if self.is_decided() else places.INFINITY
        return not (first_order < MISSED and first_order < NEARER * min(self.distance, looked_at))

    def _bring_known(self, q: Flat) -> bool:
        # Brings the poses that were found to the nearest ones to q, those that can be the nearest;
        # returns whether all of them are found again.
        first, away = -1, places.INFINITY
        for k in range(self.known):
            length = self._moved_from(arrays.after(self.poses, k * self.n), q)
            if length < away:
                first, away = k, length
        self._stand_at(q)
        self._keep_positions()
        if first < 0:
            return True
        if not self._bring(first, q):
            return False
        for k in range(self.known):
            if k != first and self._may_be_nearer(k, q) and not self._bring(k, q):
                return False
        return True

    def _may_be_nearer(self, k: int, q: Flat) -> bool:
        # Than what was found by more than a little: what was moved along the way to the pose
        # brings it nearer, and what was moved across by its square where the set is bent.
        pose, at = arrays.after(self.poses, k * self.n), arrays.after(self.slid_at, k * self.n)
        length, along, squares = self.lengths_of[k], 0.0, 0.0
        for j in range(self.n):
            scale = self.arm.task.column_scale[j]
            moved = (q[j] - at[j]) / scale
            along += moved * (pose[j] - at[j]) / scale
            squares += moved * moved
        nearest = (1.0 - LITTLE_NEARER) * self.distance
        return length * length - along - squares < length * nearest

    def _bring(self, k: int, q: Flat) -> bool:
        # Brings a pose that was found to the nearest to q; keeps it where no other is nearer.
        pose, at = arrays.after(self.poses, k * self.n), arrays.after(self.slid_at, k * self.n)
        scale = self.arm.task.column_scale
        moved = self._moved_from(at, q)
        before = self.distance
        for j in range(self.n):
            self.d[j] = (pose[j] - q[j]) / scale[j]
        if moved <= KEPT * self.lengths_of[k]:
            away = singular_equations.length_of(self.d, self.n)
            if away < before:
                self.distance = away
                arrays.copy(self.nearest, self.n, self.d)
            return True
        arrays.copy(self.before, self.n, self.nearest)
        self.distance, self.standing = places.INFINITY, self.standing and self.stands_for == k
        self._run(FOLLOWING_STEPS, moved + self.lengths_of[k], True)
        self.stands_for = k
        found = self.found()
        if found:
            self.lengths_of[k] = self.distance
            for j in range(self.n):
                pose[j] = q[j] + scale[j] * self.nearest[j]
                at[j] = q[j]
        if not self.distance < before:
            self.distance = before
            arrays.copy(self.nearest, self.n, self.before)
        return found

    def _remember(self, away: float) -> None:
        # What was reached, if a run reached one, among the nearest of those that were found.
        if not away < places.INFINITY:
            return
        n = self.n
        place = -1
        for k in range(self.known):
            if self._is_known(k, away):
                if self.lengths_of[k] <= away:
                    return
                place = k
                break
        if place < 0 and self.known < MEMORY:
            place = self.known
            self.known += 1
        if place < 0:
            place = 0
            for k in range(self.known):
                if self.lengths_of[k] > self.lengths_of[place]:
                    place = k
            if self.lengths_of[place] <= away:
                return
        self.lengths_of[place] = away
        if self.stands_for == place:
            self.stands_for = -1
        pose, at = arrays.after(self.poses, place * n), arrays.after(self.slid_at, place * n)
        for j in range(n):
            pose[j] = self.origin[j] + self.arm.task.column_scale[j] * self.reached[j]
            at[j] = self.origin[j]

    def _is_known(self, k: int, away: float) -> bool:
        # Whether what was reached is a pose that was found, or beside it.
        pose = arrays.after(self.poses, k * self.n)
        squares = 0.0
        for j in range(self.n):
            apart = (pose[j] - self.origin[j]) / self.arm.task.column_scale[j] - self.reached[j]
            squares += apart * apart
        return math.sqrt(squares) < SAME * away

    def _stand_at(self, q: Flat) -> None:
        # With nothing found.
        self.distance = places.INFINITY
        arrays.copy(self.origin, self.n, q)
        arrays.fill(self.nearest, self.n, 0.0)

    def _keep_positions(self) -> None:
        # The nearest of those at which one joint alone makes the arm singular.
        for p in range(self.atlas.alone):
            position = arrays.after(self.atlas.positions, 3 * p)
            joint: int = int(position[0])
            angle = self.origin[joint] / self.arm.task.column_scale[joint] - position[1]
            away = singular_equations.wrapped(angle, position[2])
            if abs(away) < self.distance:
                self.distance = abs(away)
                for j in range(self.n):
                    self.nearest[j] = -away if j == joint else 0.0

    def _moved_from(self, pose: Flat, q: Flat) -> float:
        squares = 0.0
        for j in range(self.n):
            moved = (q[j] - pose[j]) / self.arm.task.column_scale[j]
            squares += moved * moved
        return math.sqrt(squares)

    def _estimate(self, sigma: Flat) -> None:
        # The figures of first order: by the product of the singular values, or the factors; by the
        # least singular value; and of second order.
        k = self.arm.task.generic_rank
        self.by_least = self._first_order_of(self.here)
        smallest = sigma[k - 1]
        self.smallest = smallest
        self.second = sigma[k - 2] if k > 1 else places.INFINITY
        self.quadric.stand_at(self.here, self.atlas.counts_of(0))
        self.by_quadric = self.quadric.write_nearest(False, self.curved)
        estimate = min(self.by_product, min(self.by_least, self.by_quadric))
        # Nearer than this neither they nor the second order see a singular pose: the least
        # singular value falls by slope r + reach r^2 / 2 at most, or so.
        self.slope = smallest / self.by_least if self.by_least > 0.0 else 0.0
        reach = self.arm.reach
        falls = math.sqrt(self.slope * self.slope + 2.0 * reach * smallest) - self.slope
        self.free = min(estimate, falls / reach)

    def _first_order_of(self, equations: SingularEquations) -> float:
        # How far the equations at the pose are from fulfilled; fills the motion to there.
        equations.linearise()
        length = equations.write_step_onto(self.first)
        return length if equations.are_fulfilled(self.first) else places.INFINITY

    def _search_along_curves(self) -> None:
        # From where the curves are nearest that the atlas has poses all along, and from where the
        # first order says that one is near.
        arrays.fill(self.d, self.n, 0.0)
        self.equations.move_to(self.origin, self.d)
        self.evaluations += 1
        self.by_least = self._first_order_of(self.equations)
        if self.by_least < min(self.distance, HORIZON):
            self._run_from(self.first, self.by_least, 1.0, LONGEST)
        near = min(self.distance, HORIZON)
        count: int = self._pick_charts(0, near + GAP, FEW_CHARTS)
        for k in range(count):
            if self.scores[k] > self.distance:
                return
            self.atlas.write_motion(0, self.wrapped, self.picked[k], self.away, self.d)
            if not self._leads_to_known(self.d, self.apart):
                self._run(STEPS, LONGEST, False)

    def _search(self) -> bool:
        # From one start after the other, until what is found agrees with the first order; returns
        # whether it does. Of what is farther the first order says little: there starts are poses
        # that are known to be singular.
        settled = self.found() and self._is_where_the_first_order_says() and self._is_settled()
        if not settled:
            self._run_from(self.first, self.by_least, min(1.0, 0.5 / self.by_least), LONGEST)
            settled = self._is_settled()
        if not settled or self.distance > SURE:
            self._run_from_known_poses(CHARTS, SPREAD, 3.0)
        if settled and not self.thorough:
            return True
        self._run_from_second_order(False)
        # On the other side are other singular poses only where the second singular value, which
        # falls by the reach, may vanish too.
        bent = self.distance < NEAR_BENT and self.quadric.bend(self.distance) > VERY_BENT
        if bent or self.second < self.distance * self.arm.reach:
            self._run_from_second_order(True)
        if bent:
            self._run_from(self.nearest, self.distance, -1.0, max(0.4 * self.distance, 1e-4))
        if self.count > 1:
            self._run_between_directions()
        if self.thorough or self._is_odd():
            self.wide, self.apart = WIDER, NEAR_BY
            self._run_from_known_poses(MORE_CHARTS, WIDER_SPREAD, 20.0)
            self.wide, self.apart = WIDE, APART
        if self.thorough:
            self._run_with_fewer_joints()
        return settled

    def _is_odd(self) -> bool:
        # Whether a pose is all but singular, though nothing was found near.
        all_but = self.count == 1 and self.smallest < LEAST * self.second
        return all_but and self.distance > THOUGH

    def _run_with_fewer_joints(self) -> None:
        # From what was found without the motion of one of its joints.
        for left_out in range(self.n):
            if self.is_near() and abs(self.nearest[left_out]) > SAME * self.distance:
                for j in range(self.n):
                    self.d[j] = self.nearest[j] if j != left_out else 0.0
                self._run(STEPS, LONGEST, False)

    def _run_from_known_poses(self, most: int, spread: float, times: float) -> None:
        # From those poses of the atlas that promise to be nearest.
        n = self.n
        near = min(self.distance, HORIZON)
        count: int = self._pick_charts(0, min(near + spread, times * near), most)
        for k in range(count):
            if self.scores[k] > self.wide * self.distance:
                return
            self.atlas.write_motion(0, self.wrapped, self.picked[k], self.away, self.motion)
            if not self._leads_to_known(self.motion, self.apart):
                arrays.copy(self.d, n, self.motion)
                self._run(STEPS, LONGEST, False)
                if singular_equations.length_of(self.away, n) < self.distance:
                    # The pose itself is singular, wherever the way along the others led.
                    arrays.copy(self.d, n, self.away)
                    self._run(LAST_STEPS, LONGEST, False)

    def _pick_charts(self, f: int, radius: float, most: int) -> int:
        # Those of a set that promise nothing farther than what was found; returns their number.
        for j in range(self.n):
            self.wrapped[j] = self.origin[j] / self.arm.task.column_scale[j]
        promise = self.wide * min(self.distance, HORIZON)
        return self.atlas.nearest(
            f, self.wrapped, radius, promise, most, self.picked, self.scores, self.away
        )

    def _leads_to_known(self, motion: Flat, share: float) -> bool:
        # Whether a motion leads beside a pose that was found, by this share of its length.
        away = share / SAME * singular_equations.length_of(motion, self.n)
        arrays.copy(self.reached, self.n, motion)
        beside = False
        for k in range(self.known):
            beside = beside or self._is_known(k, away)
        return beside

    def _look_at_factors(self) -> None:
        # The nearest zero of all factors: from here, and from known zeros.
        n = self.n
        for f in range(self.arm.tape.factors):
            dimension: int = self.atlas.dimension(f)
            if dimension > NARROW:
                self._go_by_second_order(f)
            elif dimension > 0:
                arrays.fill(self.d, n, 0.0)
                self._go_to_zero(f, WIDE)
            near = min(self.distance, HORIZON)
            most = ZEROS if dimension > NARROW else FEW_ZEROS
            count: int = self._pick_charts(f, near + ZEROS_APART, most)
            for k in range(count):
                if self.scores[k] > WIDE * self.distance:
                    break
                self.atlas.write_motion(f, self.wrapped, self.picked[k], self.away, self.d)
                self._go_to_zero(f, WIDE)
            if dimension > NARROW:
                self._go_from_all_around(f)
        self._prove_factors()
        if not self.found():
            return
        # All of it, evaluated: a factor's zero is singular, and the nearest there.
        arrays.copy(self.d, n, self.nearest)
        self.free = self.distance
        self.distance, self.standing = places.INFINITY, False
        self._run(STEPS, LONGEST, True)
        self.stands_for = -1
        if self.found():
            return
        # Where two directions are lost at once the least singular value may have no slope.
        self.equations.move_to(self.origin, self.nearest)
        if self.equations.are_singular(SINGULAR):
            self.distance = self.free
        else:
            self.complete = False

    def _prove_factors(self) -> None:
        # That no zero of a factor is nearer, or which is. Of many joints that takes a hundred
        # boxes: there is time for them where a pose is asked for alone.
        self.proof.pieces, self.cleared = 0, places.INFINITY
        for f in range(self.arm.tape.factors):
            radius = min(CLEARED * self.distance, HORIZON)
            if not radius > NO_STEP or not (self.thorough or self.atlas.dimension(f) <= NARROW):
                continue
            state = places.OPEN
            if self.proof.begin(f, self.atlas.counts_of(f), self.origin, radius):
                state = self.proof.go_on(radius, self.boxes, self.d)
                while state == places.CHANGED:
                    self._go_to_change(f)
                    radius = min(CLEARED * self.distance, HORIZON)
                    state = self.proof.go_on(radius, self.boxes, self.d)
            self.complete = self.complete and state == places.PROVED
            self.cleared = radius
        self.pieces = self.proof.pieces

    def _go_to_change(self, f: int) -> None:
        # To the nearest zero from the one on the way to a motion d at which the sign is another.
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            if self.proof.changes_at(share, self.d):
                high = share
            else:
                low = share
        for j in range(self.n):
            self.d[j] *= high
            self.motion[j] = self.d[j]
        self._go_to_zero(f, AROUND)
        length = singular_equations.length_of(self.motion, self.n)
        if length < self.distance:
            arrays.copy(self.reached, self.n, self.motion)
            self._remember(length)
            self._keep(length, False)

    def _go_by_second_order(self, f: int) -> None:
        # From the point of the factor's quadric that is nearest, and from the one on its other
        # side: beside a saddle the slope leads anywhere.
        self.quadric.stand_at_factor(
            self.arm.tape, f, self.arm.task, self.origin, self.atlas.counts_of(f), self.tape
        )
        for other in range(2):
            length = self.quadric.write_nearest(other == 1, self.d)
            if length < min(1.2 * self.distance, 2.0 * HORIZON):
                self._go_to_zero(f, WIDE)

    def _go_from_all_around(self, f: int) -> None:
        # Where the slope turns on the way to what was found: from the other side of it; where it
        # turns round, from each joint alone either way, and from all of them together.
        n, counts, counted = self.n, self.atlas.counts_of(f), 0
        bend = self.quadric.bend(min(self.distance, HORIZON))
        if bend < BENT:
            return
        for j in range(n):
            self.d[j] = -self.nearest[j]
            counted += 1 if counts[j] > 0.0 else 0
        self._go_to_zero(f, AROUND)
        if bend < VERY_BENT:
            return
        for side in range(2 * n):
            if counts[side // 2] > 0.0:
                arrays.fill(self.d, n, 0.0)
                length = min(self.distance, HORIZON)
                self.d[side // 2] = length if side % 2 == 0 else -length
                self._go_to_zero(f, AROUND)
        for corner in range(1 << min(counted, CORNERS)):
            length, sides = min(self.distance, HORIZON) / math.sqrt(counted), corner
            for j in range(n):
                self.d[j] = 0.0
                if counts[j] > 0.0:
                    self.d[j] = length if sides % 2 == 0 else -length
                    sides //= 2
            self._go_to_zero(f, AROUND)

    def _go_to_zero(self, f: int, wide: float) -> None:
        # From d to the nearest zero of a factor; keeps it where it is nearer than what was found.
        farthest = min(wide * self.distance, 1.5 * HORIZON)
        if factor_zeros.go(
            self.arm.tape, f, self.arm.task, self.origin, self.d, farthest, self.onto, self.tape
        ):
            away = singular_equations.length_of(self.d, self.n)
            arrays.copy(self.reached, self.n, self.d)
            self._remember(away)
            self._keep(away, False)

    def found(self) -> bool:
        """Return whether a singular pose was found."""
        return self.distance < places.INFINITY

    def is_near(self) -> bool:
        """Return whether one was found that is not beyond the horizon."""
        return self.distance <= HORIZON

    def is_decided(self) -> bool:
        """
        Return whether nothing more is to be looked for.

        False where the budget ended, or where one that is nearer than what was found is not
        excluded.
        """
        return self.complete and not self.not_excluded() < self.distance

    def not_excluded(self) -> float:
        """
        Return how near a singular pose may be, as the search has left it, rad.

        As near as a run was on its way to when it ended, or as the pose itself says that one may
        be; or as near as what was found.
        """
        missed = min(self.missed, self.by_quadric if self.count == 1 else self.by_least)
        if not missed < MISSED:
            told = self.thorough or self.missed < GONE_ROUND
            missed = self.missed if told else places.INFINITY
        nearer = missed < NEARER * self.distance
        return missed if nearer and not self.settled else self.distance

    def write_pose(self, pose: Flat) -> None:
        """Fill the pose (n,) that was found, rad or m."""
        for j in range(self.n):
            pose[j] = self.origin[j] + self.arm.task.column_scale[j] * self.nearest[j]

    def _is_settled(self) -> bool:
        # Found where the first order said, and no other figure of it is shorter.
        found, by_least = self.distance, self.by_least
        return (
            abs(found - by_least) < 0.3 * by_least
            and self.by_quadric > 0.92 * found
            and self.by_product > 0.7 * found
            and found * max(self.slope, 1e-3 * self.arm.reach) < 0.35 * self.second
            and self.free > SADDLE * found
            and (self.count == 1 or found * self.arm.reach < self.second)
        )

    def _is_where_the_first_order_says(self) -> bool:
        # Of what a search before has found.
        return self._apart(self.first) < AGREES * self.by_least

    def _run_from(self, motion: Flat, length: float, factor: float, longest: float) -> None:
        # From a motion of this length, times a factor, with steps up to `longest`.
        if not abs(factor) * length < places.TAU:
            return
        for j in range(self.n):
            self.d[j] = factor * motion[j]
        self._run(STEPS, longest, False)

    def _run(self, steps: int, longest: float, known: bool) -> None:
        # Newton's method from d; keeps what it finds where that is nearer. `known`: d leads to
        # what was found last.
        n = self.n
        best = places.INFINITY
        standing, self.standing = self.standing and known, False
        self.left_before = places.INFINITY
        for step in range(steps + MORE_STEPS):
            if step > 0 or not standing:
                if self.evaluations >= self.budget:
                    self.complete = False
                    break
                self.evaluations += 1
                self.equations.move_to(self.origin, self.d)
                self.equations.linearise()
                standing = False
            left = self.equations.write_step_onto(self.onto)
            away = singular_equations.length_of(self.d, n)
            nearest = self.equations.write_nearest(self.d, self.along)
            if self.equations.are_singular(SINGULAR) and left < NEXT_STEP * away + NO_STEP:
                if not away < best:
                    break
                gain = min(best - away, away - nearest)
                best, standing = away, True
                arrays.copy(self.reached, n, self.d)
                enough = NO_GAIN if steps == STEPS else NO_GAIN_FOLLOWED
                if gain < enough * away or away > 2.0 * HORIZON:
                    break
            elif self._promise(left, away, nearest) > self.wide * self.distance:
                break  # it is on its way to one that is farther than what was found
            if best < places.INFINITY:
                if step >= steps - 1:
                    break
            elif self._is_given_up(step, step - steps, left, away, known):
                break
            share = _share_along(step, steps)
            for j in range(n):
                slide = self.along[j] - self.d[j] - self.onto[j]
                self.onto[j] += share * slide
            length = singular_equations.length_of(self.onto, n)
            share = longest / length if length > longest else 1.0
            for j in range(n):
                self.d[j] += share * self.onto[j]
        if not known:
            self.stands_for = -1
            self._remember(best)
        self._keep(best, standing)

    def _mark_trap(self, left: float, away: float) -> None:
        # Where a run goes round; what it has not reached is kept in mind.
        self.missed = min(self.missed, away)
        self.trap_step = left
        arrays.copy(self.trap, self.n, self.d)

    def _is_trapped(self, left: float, away: float) -> bool:
        # Whether a run has come beside such a place, and steps no less.
        apart = singular_equations.apart(self.trap, self.d, self.n)
        beside = max(TRAPPED * away, self.trap_step)
        return apart < beside and left > SHORTER * self.trap_step

    def _promise(self, left: float, away: float, nearest: float) -> float:
        # How far the singular pose will be that a run is on its way to. Of more equations than one
        # the first order alone may tell that it slides to a nearer one.
        return away - left if self.count == 1 else min(away - left, nearest)

    def _is_given_up(self, step: int, more: int, left: float, away: float, known: bool) -> bool:
        # Whether a run that has found nothing ends; `more`: its steps after those of all runs.
        if step > 0 and not (known or self.thorough) and self._leads_to_known(self.d, BESIDE):
            return True
        if step >= TRIED and self.trap_step > 0.0 and self._is_trapped(left, away):
            return True
        if more < -1:
            return False
        if not self._is_late(more, left, away):
            return True
        if (more + 1) % STEPS_ROUND == 0:
            if not left < ROUND * self.left_before:
                self._mark_trap(left, away)
                return True
            self.left_before = left
        return False

    def _is_late(self, more: int, left: float, away: float) -> bool:
        # Whether a run that should have ended is on its way to a nearer one than was found; what
        # it has not reached after all its steps is kept in mind. A step that leaves what it should
        # bring to zero is short, and leads nowhere.
        if not left < ON_ITS_WAY * away or not away < min(self.distance, LATE):
            return False
        if not self.equations.are_fulfilled(self.onto):
            return False
        if more == MORE_STEPS - 1:
            self.missed = min(self.missed, away)
        return True

    def _keep(self, best: float, standing: bool) -> None:
        # `standing`: the equations stand there.
        if best < self.distance:
            self.distance, self.standing = best, standing
            arrays.copy(self.nearest, self.n, self.reached)

    def _run_from_second_order(self, other: bool) -> None:
        # From the point of the quadric that is nearest, or from the one on its other side.
        if not (self.by_quadric < 1.2 * self.distance and self.by_quadric < 2.0 * HORIZON):
            return
        point = self.curved
        length = self.quadric.write_nearest(True, point) if other else self.by_quadric
        if other and not length < 1.2 * self.distance:
            return
        if self.distance == places.INFINITY or self._apart(point) > SAME * self.distance:
            self._run_from(point, length, 1.0, max(0.4 * length, 1e-4))

    def _run_between_directions(self) -> None:
        # Where a direction between those of the two least singular values is lost.
        if not self.arm.task.generic_rank > 1:
            return
        self.pencil.stand_at(self.here, self.along)
        farthest = BETWEEN * min(self.distance, HORIZON)
        for angle in range(self.pencil.angles):
            if self.pencil.is_shortest(angle) and self.pencil.lengths[angle] < farthest:
                length = self.pencil.write_motion(angle, self.along)
                if not self.found() or self._apart(self.along) > SAME * self.distance:
                    self._run_from(self.along, length, 1.0, max(0.4 * length, 1e-4))

    def _apart(self, motion: Flat) -> float:
        # From what was found.
        return singular_equations.apart(motion, self.nearest, self.n)


def _share_along(step: int, steps: int) -> float:
    # How much of the way along the singular poses a step of a run goes.
    if step >= steps - LAST_STEPS:
        return 0.0
    return 0.5 if step >= FULL_STEPS else 1.0
