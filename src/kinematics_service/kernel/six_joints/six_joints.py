# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Find all inverse kinematics solutions of six joints by elimination, and prove that no real solution
is missing.

The method is that of Raghavan and Roth (J. Mech. Des. 115 (1993) 502): elimination
(elimination.py) and a determinant in one hidden joint (pencils.py). In this package the
determinant is a trigonometric polynomial (polynomials.py) instead of an eigenvalue problem. If two
or three joints are prismatic, spherical_linkage.py computes the polynomial. Back substitution
(loop_positions.py) and Newton's method (complex_motion.py) give a solution for each complex root,
certified by the Newton-Kantorovich theorem.

Two cases prove that no real solution is missing. In the first case, as many solutions are
certified as the arm can have. In the second case, for each root that may belong to a real
solution, the error disc contains no other root and the solution is certified.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, Floats, Integers, Numbers
from . import complex_numbers, pairs, pencils, polynomials
from .complex_motion import Motion
from .elimination import Elimination
from .loop_positions import Positions
from .pairs import Complex
from .pencils import Pencil
from .six_screws import SixScrews
from .spherical_linkage import SphericalLinkage

# A determinant is not used if its relative noise is above this. The limit must be above 1e-7,
# because pivots as small as PIVOT_RATIO increase round-off to 1e-7. If the determinant vanishes at
# every angle, the noise is near 1.
MAX_NOISE = 1e-6
# The search for roots starts from points on two circles around 0, with the radii START_RADIUS and
# 2 * START_RADIUS. Roots come in pairs z and 1 / conj(z), so as many roots are inside the unit
# circle as outside. So half of the starting points are inside the unit circle, too.
START_RADIUS = 0.7
# A root z = e^(i a) has a complex angle a. If the root gives real joint positions, the imaginary
# part of a is 0, except for errors. The absolute value of the imaginary part is |log |z||. A root
# may belong to a real solution if this value is at most MAX_REAL_DEVIATION, rad. If the noise is
# 1e-6, a double root is off by sqrt(1e-6) = 1e-3, a fourfold root by 3e-2.
MAX_REAL_DEVIATION = 0.05
# Each root z = e^(i a) gives joint positions, with the angle a of the hidden joint, from which
# Newton's method starts. If z is near the unit circle, the first start uses, instead of z, the
# nearest point of the circle. A second start uses z itself. The second start is left out if the
# first start found a solution with the angle a, and the relative error of z is below SHARP_ROOT.
SHARP_ROOT = 1e-6
# A solution belongs to a root z = e^(i a) if the angle of its hidden joint differs from a by at
# most `max(error of the root, ANGLE_TOLERANCE)`, rad. The tolerance covers the round-off of a
# solution near a singular pose.
ANGLE_TOLERANCE = 1e-9
# If there are more than twelve equations, only twelve combinations of them are solved
# (pencils.py). A root is spurious if it solves the combinations, but not the original equations.
# The error of a true root also causes a residual in the original equations. A root is taken as
# spurious if its residual exceeds this factor times the residual that its error can cause.
RESIDUAL_MARGIN = 1e3
# The noise of the determinant times this factor bounds the error of a coefficient of the
# determinant. The factor is above 1, because the noise is estimated from only a few harmonics.
NOISE_MARGIN = 10.0
# The six joints and the target form a closed loop. The elimination reduces the equations of the
# loop to one polynomial in the angle of one joint, called the hidden joint. It is joint 3 of the
# loop; HIDDEN_JOINT is the index of this joint, from 0.
HIDDEN_JOINT = 2


class SixJoints:
    """
    The screws of an arm of six joints, and the options of the elimination.

    The six screw positions psi are the angles (rad) or displacements (m) of the six screws. They
    are linear functions of the six joint positions q.

    Parameters
    ----------
    screws : shape (6, 7)
        For each screw at rest: the direction of its axis, a point on the axis, and 1 if the screw
        is prismatic.
    home_inverse : shape (4, 4)
        Inverse of the tool's pose at rest.
    to_joints : shape (6, 6)
        Matrix that gives the joint positions: q = to_joints psi.
    options : shape (k, 3)
        The screws and the target form a closed loop, which can begin at any joint (six_screws.py).
        Each row is one option to write the equations of the loop. The first number is the index of
        the joint with which the loop begins, 0 to 5. The second number is 1 if the loop runs
        backwards. The third number is 1 if the equations are multiplied by functions of the fifth
        joint of the loop, 0 if by functions of the fourth joint (pencils.py). If two joints are
        prismatic, the loop begins with a prismatic joint, and the third number has another
        meaning: 1 if the polynomial is in the angle of the second revolute joint, 0 if it is in
        the angle of the first.
    bound
        Largest number of isolated complex solutions of a target.
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
        if not 0 < bound <= places.MAX_CANDIDATES // 2:
            raise TypeError('bound is not 1 to 16 solutions')
        for k in range(3 * self.count):
            if not 0 <= self.options[k] < (6 if k % 3 == 0 else 2):
                raise TypeError('an option is not (0 to 5, 0 or 1, 0 or 1)')
        self.bound, self.slides = bound, 0
        for k in range(6):
            self.slides += 1 if vectors.slides(self.screws, k) else 0

    def write_joints(self, psi: Numbers, q: Flat) -> None:
        """
        Write to q (6,) the joint positions for the real parts of psi (6 complex screw positions).
        """
        for i in range(6):
            q[i] = 0.0
            for j in range(6):
                q[i] += self.to_joints[6 * i + j] * psi[2 * j]


class Roots:
    """
    Finds the complex inverse kinematics solutions of six joints for one target.

    Attributes
    ----------
    psi : shape (MAX_CANDIDATES, 6)
        Solutions: each row has the complex angles (rad) or displacements (m) of the six screws.
    is_real : shape (MAX_CANDIDATES,)
        1 if the positions of the solution are real, else 0.
    count
        Number of solutions. Each is certified, and none is listed twice.
    proved
        Whether it is proved that no real solution is missing.
    noise
        Relative round-off of a polynomial. `find` tries the options of the arm
        (`SixJoints.options`) in order, and computes a polynomial for each. `noise` belongs to the
        polynomial of the last option that was tried.
    first_step
        Newton's method starts from candidates. `first_step` is the largest change of a joint in
        the first Newton step from a candidate, rad or the loop's unit of length. Candidates that
        led to no solution are left out. A large `first_step` means that candidates were
        inaccurate.
    """

    def __init__(self) -> None:
        capacity = places.MAX_CANDIDATES
        self.psi, self.radii, self.lengths = arrays.rooms(12 * capacity, capacity, capacity)
        (self.is_real,) = arrays.whole_rooms(capacity)
        self.a, self.z, self.bounds = arrays.rooms(50, 48, 24)
        self.t, self.solution = arrays.rooms(12, 12)
        self.weights, self.scales = arrays.rooms(6, 6 * capacity)
        self.loop, self.elimination, self.pencil = SixScrews(), Elimination(), Pencil()
        self.linkage, self.hidden = SphericalLinkage(), HIDDEN_JOINT
        self.positions, self.motion = Positions(), Motion()
        self.count, self.proved = 0, False
        self.noise, self.first_step = 1.0, 0.0

    def find(self, arm: SixJoints, T: Numbers) -> None:
        """
        Find the solutions for T, the motion of the tool from its rest pose to the target.

        The options of the arm (`SixJoints.options`) are tried in order, until a proof shows that
        no real solution is missing.
        """
        self.count, self.proved, self.first_step = 0, False, 0.0
        for k in range(arm.count):
            self._find_by(arm, T, k)
            if self.proved:
                return

    def follow(self, arm: SixJoints, T: Numbers, starts: Flat, count: int) -> None:
        """
        Find solutions for T, the motion of the tool from its rest pose to the target.

        Each row of `starts` (count, 6 complex numbers) is a solution for another target, near this
        target. Newton's method starts from each row.
        """
        self.count, self.proved = 0, False
        self.loop.close(arm.screws, T, 0, False)
        for i in range(count):
            for j in range(6):
                slides = vectors.slides(self.loop.screws, j)
                scale = 1.0 / self.loop.length if slides else 1.0
                for e in range(2):
                    self.t[2 * j + e] = scale * starts[12 * i + 2 * j + e]
            if self.motion.improve(self.loop, self.t) and self.motion.certify(self.loop, self.t):
                self._add_solution()

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
        if not self.noise < MAX_NOISE:
            return
        # Drop leading coefficients of the polynomial that are noise. Such coefficients only add
        # roots far from the unit circle, which belong to no solution.
        while degree > 0 and complex_numbers.absolute(pairs.pair(c, degree)) <= self.noise:
            degree -= 1
        roots = 2 * degree
        polynomials.write_both_halves(c, degree, self.a)
        polynomials.write_starts(roots, START_RADIUS, 2.0 * START_RADIUS, self.z)
        polynomials.find_roots(self.a, roots, self.z)
        errors = NOISE_MARGIN * max(self.noise, complex_numbers.ROUND_OFF)
        polynomials.write_bounds(self.a, roots, errors, self.z, self.bounds)
        self._solve_roots(arm, roots, swapped)

    def _solve_roots(self, arm: SixJoints, roots: int, swapped: bool) -> None:
        accounted = True
        for i in range(roots):
            z = pairs.pair(self.z, i)
            deviation = _log_size(z)
            # Solve only roots inside the unit circle or near it. A root outside has a mirror image
            # inside, which belongs to the conjugate solution, and `_add_solution` adds both
            # solutions.
            is_solved = deviation <= MAX_REAL_DEVIATION
            is_solved = is_solved and self._solve_root(arm, z, deviation, self.bounds[i], swapped)
            # Roots of real solutions are on the unit circle. If the error disc of this root does
            # not meet the circle, no real solution belongs to the root, so skip it.
            if self.bounds[i] < 0.5 * (math.exp(abs(deviation)) - 1.0):
                continue
            accounted = accounted and polynomials.is_alone(self.z, self.bounds, roots, i)
            accounted = accounted and (is_solved or self._is_spurious(z, self.bounds[i]))
        self.proved = self.count >= arm.bound or accounted
        for i in range(roots):
            if self.proved:
                return
            z = pairs.pair(self.z, i)
            deviation = _log_size(z)
            if deviation > MAX_REAL_DEVIATION:
                self._solve_root(arm, z, deviation, self.bounds[i], swapped)
                self.proved = self.count >= arm.bound

    def _is_spurious(self, z: Complex, bound: float) -> bool:
        # Returns whether root z is spurious: no point in its error disc solves the original
        # equations. If there are more than twelve equations, they are combined into twelve, and
        # this adds spurious roots. If there are only twelve, returns False.
        if self.pencil.count <= pencils.SIZE:
            return False
        self.pencil.write_null_vector(z, self.positions.x)
        error = max(bound, ANGLE_TOLERANCE) / max(self.pencil.gap, complex_numbers.TINY)
        return self.pencil.residual(z, self.positions.x) > RESIDUAL_MARGIN * error

    def _solve_root(
        self, arm: SixJoints, z: Complex, deviation: float, bound: float, swapped: bool
    ) -> bool:
        # z = e^(i a) is a root of the polynomial in the angle of the hidden joint. Adds the
        # solutions that Newton's method finds from this root. Returns whether the hidden joint has
        # the angle a in one of these solutions.
        if abs(deviation) < MAX_REAL_DEVIATION:
            size = complex_numbers.absolute(z)
            on_circle = (z[0] / size, z[1] / size)
            is_solved = self._solve_positions(arm, on_circle, z, bound, swapped)
            if is_solved and bound < SHARP_ROOT:
                return True
        return self._solve_positions(arm, z, z, bound, swapped)

    def _solve_positions(
        self, arm: SixJoints, start: Complex, z: Complex, bound: float, swapped: bool
    ) -> bool:
        if arm.slides > 1:
            written = self.linkage.write_positions(self.loop, self.motion, start, self.t)
            return written and self._refine(z, bound)
        if not self.positions.find(self.loop, self.elimination, self.pencil, swapped, start):
            return False
        arrays.copy(self.t, 12, self.positions.t)
        return self._refine(z, bound)

    def _refine(self, z: Complex, bound: float) -> bool:
        # z = e^(i a) is a root of the polynomial in the angle of joint `hidden`. `self.t` has
        # joint positions for this root. Newton's method moves them to a solution. Adds the
        # solution if it is certified. Returns whether joint `hidden` has the angle a in this
        # solution.
        if not self.motion.improve(self.loop, self.t):
            return False
        first = self.motion.first
        if not self.motion.certify(self.loop, self.t):
            return False
        self._add_solution()
        self.first_step = max(self.first_step, first)
        return self._is_of(z, bound)

    def _is_of(self, z: Complex, bound: float) -> bool:
        # z = e^(i a) is a root of the polynomial in the angle of the hidden joint. Returns whether
        # the hidden joint has the angle a in the solution `self.t`.
        angle = complex_numbers.angle_of(z)
        re, im = self.t[2 * self.hidden] - angle[0], self.t[2 * self.hidden + 1] - angle[1]
        re -= places.TAU * math.floor(re / places.TAU + 0.5)
        return math.sqrt(re * re + im * im) <= max(bound, ANGLE_TOLERANCE)

    def _add_solution(self) -> None:
        # Adds the solution t of the loop, and also its conjugate unless t is real.
        length, radius = self.loop.length, self.motion.radius
        imaginary: float = 0.0
        for j in range(6):
            scale = length if vectors.slides(self.loop.screws, j) else 1.0
            weight = self.motion.weights[j]
            imaginary = max(imaginary, weight * abs(self.t[2 * j + 1]))
            k = self.loop.order[j]
            self.weights[k] = weight
            self.solution[2 * k] = scale * self.t[2 * j]
            self.solution[2 * k + 1] = scale * self.t[2 * j + 1]
        # The conjugate of a solution is also a solution. If both are within the radius of
        # uniqueness, they are equal, so the solution is real.
        real = 2.0 * imaginary < 0.5 * radius
        self._add_once(real, radius, length)
        if not real:
            for j in range(6):
                self.solution[2 * j + 1] = -self.solution[2 * j + 1]
            self._add_once(False, radius, length)

    def _add_once(self, real: bool, radius: float, length: float) -> None:
        if self.count >= places.MAX_CANDIDATES:
            return
        for i in range(self.count):
            if self._is_same(i, radius, length):
                return
        arrays.copy(arrays.after(self.scales, 6 * self.count), 6, self.weights)
        arrays.copy(arrays.after(self.psi, 12 * self.count), 12, self.solution)
        self.radii[self.count] = radius
        self.lengths[self.count] = length
        self.is_real[self.count] = 1 if real else 0
        self.count += 1

    def _is_same(self, i: int, radius: float, length: float) -> bool:
        # Returns whether `solution` and stored solution i are equal up to full turns. Let d1 be
        # the distance between the two, measured with the joint weights of `solution`. Let d2 be
        # the same distance, measured with the joint weights of stored solution i. The two are
        # equal if d1 is below half the radius of uniqueness of `solution`, or d2 below half the
        # radius of uniqueness of stored solution i (`Motion.radius`). If the two come from loops
        # with different units of length, prismatic positions are divided by the longer unit.
        mine, others = 0.0, 0.0
        for j in range(6):
            k = self.loop.order[j]
            re = self.solution[2 * k] - self.psi[12 * i + 2 * k]
            im = self.solution[2 * k + 1] - self.psi[12 * i + 2 * k + 1]
            if vectors.slides(self.loop.screws, j):
                scale = 1.0 / max(length, self.lengths[i])
                re, im = scale * re, scale * im
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
    if not complex_numbers.TINY < square < 1.0 / complex_numbers.TINY:
        return places.INFINITY
    return 0.5 * math.log(square)


def complex_solutions(arm: SixJoints, T: Floats, psi: Floats, accuracy: Floats) -> int:
    """
    Fill `psi` with the complex solutions for one target; return the number of solutions.

    Parameters
    ----------
    arm
        The arm of six joints. Its options (`SixJoints.options`) are tried in order, until a proof
        shows that no real solution is missing.
    T : shape (4, 4)
        The motion of the tool from its rest pose to the target.
    psi : shape (MAX_CANDIDATES, 6, 2)
        For each solution, the complex angles (rad) or displacements (m) of the six screws, as real
        and imaginary parts.
    accuracy : shape (3,)
        Filled with `Roots.noise`, `Roots.first_step` and `Roots.proved` (1 if true, else 0). In
        short: the round-off of the last polynomial, the inaccuracy of the candidates from which
        Newton's method started, and whether it is proved that no real solution is missing.
    """
    roots, positions = Roots(), arrays.results(psi, 12 * places.MAX_CANDIDATES)
    measures = arrays.results(accuracy, 3)
    roots.find(arm, arrays.numbers(T, 16))
    arrays.copy(positions, 12 * roots.count, roots.psi)
    measures[0], measures[1] = roots.noise, roots.first_step
    measures[2] = 1.0 if roots.proved else 0.0
    return roots.count


def followed_solutions(arm: SixJoints, T: Floats, count: int, psi: Floats) -> int:
    """
    Replace the complex solutions `psi` for one target by the solutions for a nearby target; return
    the number of solutions.

    Newton's method starts from each given solution. Solutions that cannot be certified are left
    out.

    Parameters
    ----------
    arm
        The arm of six joints.
    T : shape (4, 4)
        The motion of the tool from its rest pose to the nearby target.
    count
        Number of given solutions.
    psi : shape (MAX_CANDIDATES, 6, 2)
        For each solution, the complex angles (rad) or displacements (m) of the six screws, as real
        and imaginary parts.
    """
    if not 0 <= count <= places.MAX_CANDIDATES:
        raise TypeError('count is not 0 to 32 solutions')
    roots, positions = Roots(), arrays.results(psi, 12 * places.MAX_CANDIDATES)
    roots.follow(arm, arrays.numbers(T, 16), positions, count)
    arrays.copy(positions, 12 * roots.count, roots.psi)
    return roots.count
