"""All solutions of six joints in any order: the complex ones too, whose number is the proof."""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from . import complex_numbers, elimination, pairs, pencils, polynomials
from .complex_motion import Motion
from .elimination import Elimination
from .loop_positions import Positions
from .pairs import Complex
from .pencils import Pencil
from .six_screws import SixScrews
from .spherical_linkage import SphericalLinkage

# An option whose determinant has more noise is singular at this target, at every angle.
NOISE = 1e-6
# Roots as near to the unit circle may be those of real solutions.
NEAR_CIRCLE = 0.05
# A logarithm of a size whose exponential is no overflow.
FAR = 30.0
# A root known as well leads to its solution from one start.
SHARP = 1e-6
# An angle as near to that of a root is the same.
SAME_ROOT = 1e-9
# What is so many times as large as what errors make of it is not 0.
MARGIN = 1e3
# Errors of coefficients are taken for so many times what those beyond the degree show.
CAUTION = 10.0
# The joint of the loop that elimination hides.
THIRD = 2
# Room for solutions: more than there can be.
MOST = 32


class SixJoints:
    """
    Six joints as screws psi = coupling q, and the ways to eliminate them.

    Parameters
    ----------
    screws : shape (6, 7)
        Each joint at rest: its axis, a point on it, 1 where it slides.
    home_inverse : shape (4, 4)
        Inverse of the tool's pose at rest.
    to_joints : shape (6, 6)
        Joint positions from those of the screws.
    options : shape (k, 3)
        Where the loop begins, whether it runs backwards, whether joint 5 of it is multiplied.
        Where two joints slide, it begins with one, and the second one that turns may be hidden.
    bound
        No target has more isolated complex solutions.
    """

    def __init__(
        self,
        screws: Floats,
        home_inverse: Floats,
        to_joints: Floats,
        options: Integers,
        bound: int,
    ) -> None:
        self.screws, self.to_joints = arrays.numbers(screws, 42), arrays.numbers(to_joints, 36)
        self.home_inverse = arrays.numbers(home_inverse, 16)
        self.count = arrays.extent(options, 0)
        self.options = arrays.whole(options, 3 * self.count)
        if not 0 < bound <= MOST // 2:
            raise TypeError('so many solutions six joints cannot have')
        for k in range(3 * self.count):
            if not 0 <= self.options[k] < (6 if k % 3 == 0 else 2):
                raise TypeError('an option is none')
        self.bound, self.slides = bound, 0
        for k in range(6):
            self.slides += 1 if vectors.slides(self.screws, k) else 0

    def write_joints(self, psi: Numbers, q: Flat) -> None:
        """Write the positions of the joints that are those of the screws, real parts of pairs."""
        for i in range(6):
            q[i] = 0.0
            for j in range(6):
                q[i] += self.to_joints[6 * i + j] * psi[2 * j]

    def write_motion(self, pose: Flat, T: Numbers) -> None:
        """Write the motion (3, 4) from rest to a pose."""
        for i in range(3):
            for j in range(4):
                T[4 * i + j] = 0.0
                for k in range(4):
                    T[4 * i + j] += pose[4 * i + k] * self.home_inverse[4 * k + j]


class Roots:
    """
    Room for the complex solutions of a target, and for what finds them.

    Attributes
    ----------
    psi : shape (MOST, 6)
        Positions of the screws, complex, rad or m.
    is_real : shape (MOST,)
        Whether they are real.
    count
        How many there are, each certified and each once.
    proved
        Whether no real one is missing: there are as many as there can be, or every root of a
        determinant that is real, or may be, has its solution.
    noise
        Of the last option.
    first_step
        The longest first step of Newton to a solution: how good the candidates were.
    """

    def __init__(self) -> None:
        self.psi, self.radii, self.lengths = arrays.rooms(12 * MOST, MOST, MOST)
        (self.is_real,) = arrays.whole_rooms(MOST)
        self.z, self.bounds, self.t, self.one = arrays.rooms(48, 24, 12, 12)
        self.weights, self.scales = arrays.rooms(6, 6 * MOST)
        self.loop, self.elimination, self.pencil = SixScrews(), Elimination(), Pencil()
        self.linkage, self.hidden = SphericalLinkage(), THIRD
        self.positions, self.motion = Positions(), Motion()
        self.count, self.proved = 0, False
        self.noise, self.first_step = 1.0, 0.0

    def find(self, arm: SixJoints, T: Numbers) -> None:
        """Fill in the solutions of a motion, by one option after the other until all are found."""
        self.count, self.proved, self.first_step = 0, False, 0.0
        for k in range(arm.count):
            self._find_by(arm, T, k)
            if self.proved:
                return

    def follow(self, arm: SixJoints, T: Numbers, starts: Flat, count: int) -> None:
        """Fill in the solutions of a motion that Newton leads to from those of one beside it."""
        self.count, self.proved = 0, False
        self.loop.close(arm.screws, T, 0, False)
        for i in range(count):
            for j in range(6):
                slides = vectors.slides(self.loop.screws, j)
                share = 1.0 / self.loop.length if slides else 1.0
                for e in range(2):
                    self.t[2 * j + e] = share * starts[12 * i + 2 * j + e]
            if self.motion.improve(self.loop, self.t) and self.motion.certify(self.loop, self.t):
                self._take()

    def _find_by(self, arm: SixJoints, T: Numbers, k: int) -> None:
        options = arm.options
        swapped = options[3 * k + 2] == 1
        self.loop.close(arm.screws, T, options[3 * k], options[3 * k + 1] == 1)
        self.noise = 1.0
        if arm.slides > 1:
            self.linkage.build(self.loop, swapped)
            self.hidden, self.noise = self.linkage.hidden, self.linkage.noise
            c, degree = self.linkage.coefficients, self.linkage.degree
        else:
            self.elimination.eliminate(self.loop)
            slides = vectors.slides(self.loop.screws, 4 if swapped else 3)
            self.pencil.build(self.elimination, swapped, slides)
            if self.pencil.degree > 0:
                self.pencil.sample()
                self.noise = self.pencil.noise
            c, degree = self.pencil.coefficients, self.pencil.degree
        if not self.noise < NOISE:
            return
        # Where the last coefficients are noise, their roots are far from the circle and nothing.
        while degree > 0 and _size(c, degree) <= self.noise:
            degree -= 1
        roots = polynomials.roots_on_plane(c, degree, self.z)
        errors = CAUTION * max(self.noise, 1e-16)
        polynomials.write_bounds(c, degree, errors, self.z, self.bounds)
        self._take_roots(arm, roots, swapped)

    def _take_roots(self, arm: SixJoints, roots: int, swapped: bool) -> None:
        accounted = True
        for i in range(roots):
            z = pairs.pair(self.z, i)
            away = _log_size(z)
            # Solutions are conjugate in pairs: their roots are inside the circle and outside.
            taken = away <= NEAR_CIRCLE
            taken = taken and self._take_root(arm, z, away, self.bounds[i], swapped)
            # Those of real solutions are on it. Where the disc of the inner one is far from it,
            # the pair is of none.
            if self.bounds[i] < 0.5 * (math.exp(min(abs(away), FAR)) - 1.0):
                continue
            accounted = accounted and polynomials.is_alone(self.z, self.bounds, roots, i)
            accounted = accounted and (taken or self._is_of_none(z, self.bounds[i]))
        self.proved = self.count >= arm.bound or accounted
        for i in range(roots):
            if self.proved:
                return
            z = pairs.pair(self.z, i)
            away = _log_size(z)
            if away > NEAR_CIRCLE:
                self._take_root(arm, z, away, self.bounds[i], swapped)
                self.proved = self.count >= arm.bound

    def _is_of_none(self, z: Complex, bound: float) -> bool:
        # Whether a root, the only one within its bound, is of combined equations and solves none.
        if self.pencil.count <= pencils.SIZE:
            return False
        self.pencil.write_null_vector(z, self.positions.x)
        moved = MARGIN * max(bound, SAME_ROOT) / max(self.pencil.gap, 1e-300)
        return self.pencil.misses(z, self.positions.x) > moved

    def _take_root(
        self, arm: SixJoints, z: Complex, away: float, bound: float, swapped: bool
    ) -> bool:
        # Takes the solutions of a root; whether the one that a simple root has is among them.
        if abs(away) < NEAR_CIRCLE:
            size = math.sqrt(pairs.square_of(z))
            on_circle = (z[0] / size, z[1] / size)
            taken = self._take_positions(arm, on_circle, z, bound, swapped)
            if taken and bound < SHARP:
                return True
        return self._take_positions(arm, z, z, bound, swapped)

    def _take_positions(
        self, arm: SixJoints, start: Complex, z: Complex, bound: float, swapped: bool
    ) -> bool:
        if arm.slides > 1:
            # The others follow from the hidden joint.
            written = self.linkage.write_positions(self.loop, self.motion, start, self.t)
            return written and self._take_candidate(z, bound)
        taken = False
        # Where the right side has its full rank, joints 1 and 2 follow from the others.
        only = bound < SHARP and self.elimination.rank == elimination.RIGHT - 1
        self.positions.find(self.loop, self.elimination, self.pencil, swapped, start)
        for _ in range(self.positions.count):
            # What misses the goal least is tried first.
            best, least = 0, places.INFINITY
            for k in range(self.positions.count):
                if self.positions.missed[k] < least:
                    best, least = k, self.positions.missed[k]
            self.positions.missed[best] = places.INFINITY
            arrays.copy(self.t, 12, arrays.after(self.positions.t, 12 * best))
            if self._take_candidate(z, bound):
                taken = True
                if only:
                    return True
        return taken

    def _take_candidate(self, z: Complex, bound: float) -> bool:
        # Takes the solution that positions t lead to; whether it is that of a root.
        if not self.motion.improve(self.loop, self.t):
            return False
        first = self.motion.first
        if not self.motion.certify(self.loop, self.t):
            return False
        self._take()
        self.first_step = max(self.first_step, first)
        return self._is_of(z, bound)

    def _is_of(self, z: Complex, bound: float) -> bool:
        # Whether the hidden joint of solution t is that of a root.
        here = complex_numbers.angle_of(z)
        re, im = self.t[2 * self.hidden] - here[0], self.t[2 * self.hidden + 1] - here[1]
        re -= places.TAU * math.floor(re / places.TAU + 0.5)
        return math.sqrt(re * re + im * im) <= max(bound, SAME_ROOT)

    def _take(self) -> None:
        # Takes the solution t of the loop, and its conjugate one where it is not real.
        length, radius = self.loop.length, self.motion.radius
        imaginary: float = 0.0
        for j in range(6):
            share = length if vectors.slides(self.loop.screws, j) else 1.0
            weight = self.motion.weights[j]
            imaginary = max(imaginary, weight * abs(self.t[2 * j + 1]))
            k = self.loop.order[j]
            self.weights[k] = weight
            self.one[2 * k] = share * self.t[2 * j]
            self.one[2 * k + 1] = share * self.t[2 * j + 1]
        # The conjugate is a solution, too: where that is the same one, it is real.
        real = 2.0 * imaginary < 0.5 * radius
        self._add(real, radius, length)
        if not real:
            for j in range(6):
                self.one[2 * j + 1] = -self.one[2 * j + 1]
            self._add(False, radius, length)

    def _add(self, real: bool, radius: float, length: float) -> None:
        if self.count >= MOST:
            return
        for i in range(self.count):
            if self._are_one(i, radius, length):
                return
        arrays.copy(arrays.after(self.scales, 6 * self.count), 6, self.weights)
        arrays.copy(arrays.after(self.psi, 12 * self.count), 12, self.one)
        self.radii[self.count] = radius
        self.lengths[self.count] = length
        self.is_real[self.count] = 1 if real else 0
        self.count += 1

    def _are_one(self, i: int, radius: float, length: float) -> bool:
        # Whether one is within half the other's radius, without full turns, in units of the longer
        # of both units.
        mine, others = 0.0, 0.0
        for k in range(6):
            j = 0
            while self.loop.order[j] != k:
                j += 1
            re = self.one[2 * k] - self.psi[12 * i + 2 * k]
            im = self.one[2 * k + 1] - self.psi[12 * i + 2 * k + 1]
            if vectors.slides(self.loop.screws, j):
                share = 1.0 / max(length, self.lengths[i])
                re, im = share * re, share * im
            else:
                re -= places.TAU * math.floor(re / places.TAU + 0.5)
            square = re * re + im * im
            mine += self.weights[k] * self.weights[k] * square
            others += self.scales[6 * i + k] * self.scales[6 * i + k] * square
        if math.sqrt(mine) < 0.5 * radius:
            return True
        return math.sqrt(others) < 0.5 * self.radii[i]


def _log_size(z: Complex) -> float:
    square = pairs.square_of(z)
    return 0.5 * math.log(square) if 1e-300 < square < 1e300 else 1e3


def _size(c: Numbers, k: int) -> float:
    return math.sqrt(pairs.square_of(pairs.pair(c, k)))


def complex_solutions(arm: SixJoints, T: Floats, psi: Floats, said: Floats) -> int:
    """
    Fill in all complex solutions of a motion that the arm's options lead to; return their number.

    Parameters
    ----------
    arm
        Its options are tried in their order until there are as many as there can be.
    T : shape (4, 4)
        The motion from rest to the target.
    psi : shape (MOST, 6, 2)
        Positions of the screws: real and imaginary parts, rad or m.
    said : shape (3,)
        The noise of the last option, the longest first step of Newton to a solution, and 1 where
        no real solution is missing.
    """
    roots, found = Roots(), arrays.results(psi, 12 * MOST)
    about = arrays.results(said, 3)
    roots.find(arm, arrays.numbers(T, 16))
    arrays.copy(found, 12 * roots.count, roots.psi)
    about[0], about[1] = roots.noise, roots.first_step
    about[2] = 1.0 if roots.proved else 0.0
    return roots.count


def followed_solutions(arm: SixJoints, T: Floats, count: int, psi: Floats) -> int:
    """
    Replace complex solutions of a motion by those of a motion beside it; return their number.

    Simple solutions are followed; those that have become one are left out.

    Parameters
    ----------
    arm
        Of the arm.
    T : shape (4, 4)
        The motion from rest to the target.
    count
        How many solutions there are.
    psi : shape (MOST, 6, 2)
        Positions of the screws: real and imaginary parts, rad or m.
    """
    if not 0 <= count <= MOST:
        raise TypeError('so many solutions six joints cannot have')
    roots, found = Roots(), arrays.results(psi, 12 * MOST)
    roots.follow(arm, arrays.numbers(T, 16), found, count)
    arrays.copy(found, 12 * roots.count, roots.psi)
    return roots.count
