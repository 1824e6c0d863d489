# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the posture of an arm whose inverse kinematics has a closed form: shoulder right or left,
elbow up or down, wrist flipped or not.

The posture is three signs: of the shoulder, of the elbow and of the wrist. Each sign is 1, -1 or
0. If a sign is 0, two solutions of inverse kinematics coincide. Let z1 to z6 be the directions of
the axes.

- Shoulder: the vector z2 x z1 points to one side of the plane of axes 1 and 2. The sign is 1
  (right) if the end of the arm (the tool or the wrist: `ClosedForm.point`) is on this side, and 0
  if it is in the plane.
- Elbow: in the view along axis 2, the parallel axes 2 and 3 are points. Draw a line in this view
  from axis 2 to the end of the arm, or to axis 4 if axes 2 to 4 are parallel. The sign is 1 (up)
  if axis 3 is on the side of the line to which z1 points, and 0 if axis 3 is on the line (the
  elbow is stretched).
- Wrist: the sign is 1 (not flipped) if the triple product (z4 x z5) . z6 is positive, and 0 if
  axes 4 and 6 are parallel.
"""

import math

from ..forward import vectors
from ..layout import arrays, places
from ..layout.arrays import Flat, FlatIntegers, Floats, Integers, Vector
from .closed_forms import ClosedForm

# A triple product is taken as 0 if its ratio to the product of the lengths of its three vectors is
# at most this number. The number is 1e-9, because poses are written with nine digits.
ZERO_RATIO = 1e-9
# An arm has a shoulder if the squared sine of the angle between axes 1 and 2 exceeds this number:
# the angle must exceed 3e-5 rad.
MIN_SHOULDER_SINE_SQUARED = 1e-9
# An arm has an elbow if axes 2 and 3 are parallel. The axes are taken as parallel if the squared
# sine of their angle is below this number: the angle must be below 1e-6 rad.
MAX_ELBOW_SINE_SQUARED = 1e-12


def _sign(value: float, size: float) -> int:
    if abs(value) <= ZERO_RATIO * size:
        return 0
    return 1 if value > 0.0 else -1


def _shoulder(screws: Flat, end: Vector) -> int:
    # Returns the sign of the shoulder. The vector z2 x z1 points to one side of the plane of axes
    # 1 and 2. The sign is 1 if the point `end` (the tool or the wrist) is on this side, -1 if it
    # is on the opposite side, and 0 if it is in the plane.
    side = vectors.cross(vectors.axis_of(screws, 1), vectors.axis_of(screws, 0))
    reach = vectors.plus(end, -1.0, vectors.point_of(screws, 0))
    return _sign(vectors.dot(side, reach), math.sqrt(vectors.dot(reach, reach)))


def _elbow(screws: Flat, second: float, tip: Vector) -> int:
    # Returns the sign of the elbow. In the view along axis 2, the parallel axes 2 and 3 are
    # points. Draw a line in this view from axis 2 to the point `tip`, which is the tool, the
    # wrist, or a point of axis 4. The sign is 1 if the elbow (axis 3) is on the side of the line
    # to which the vector z1 points, -1 if the elbow is on the opposite side, and 0 if it is on the
    # line.
    z2, o2 = vectors.axis_of(screws, 1), vectors.point_of(screws, 1)
    chord = vectors.plus(tip, -1.0, o2)
    chord = vectors.plus(chord, -vectors.dot(chord, z2), z2)
    upper = vectors.moved(screws, 1, second, vectors.point_of(screws, 2))
    upper = vectors.plus(upper, -1.0, o2)
    upper = vectors.plus(upper, -vectors.dot(upper, z2), z2)
    square = vectors.dot(chord, chord)
    if not square > 0.0:
        return 0
    off = vectors.plus(upper, -vectors.dot(upper, chord) / square, chord)
    return _sign(
        vectors.dot(off, vectors.axis_of(screws, 0)), math.sqrt(vectors.dot(upper, upper))
    )


def _wrist(screws: Flat, fifth: float) -> int:
    a = vectors.axis_of(screws, 4)
    first = vectors.turned(a, -fifth, vectors.axis_of(screws, 3))
    across = vectors.cross(first, a)
    return _sign(vectors.dot(across, vectors.axis_of(screws, 5)), 1.0)


def write_posture(form: ClosedForm, q: Flat, signs: FlatIntegers) -> None:
    """Write the posture at joint positions q (n,): the signs (3,) of shoulder, elbow and wrist."""
    signs[0], signs[1], signs[2] = 0, 0, 0
    if form.backwards:
        return
    psi = [0.0] * 6
    form.write_screws(q, psi)
    screws = form.screws
    z1, z2, z3 = vectors.axis_of(screws, 0), vectors.axis_of(screws, 1), vectors.axis_of(screws, 2)
    side, elbow = vectors.cross(z2, z1), vectors.cross(z2, z3)
    turn_2 = not vectors.slides(screws, 1)
    has_shoulder = (
        not vectors.slides(screws, 0)
        and turn_2
        and vectors.dot(side, side) > MIN_SHOULDER_SINE_SQUARED
    )
    has_elbow = (
        turn_2
        and not vectors.slides(screws, 2)
        and vectors.dot(elbow, elbow) < MAX_ELBOW_SINE_SQUARED
    )
    # Compute `end`, the position of `form.point` (the tool or the wrist), in the frame of joint 1.
    end = vectors.three(form.point, 0)
    if form.way == places.PARALLEL_AXES:
        end = vectors.moved(screws, 3, psi[3], end)
    end = vectors.moved(screws, 1, psi[1], vectors.moved(screws, 2, psi[2], end))
    if has_shoulder:
        signs[0] = _shoulder(screws, end)
    if has_shoulder and has_elbow:
        tip = end
        if form.way == places.PARALLEL_AXES:
            tip = vectors.moved(screws, 2, psi[2], vectors.point_of(screws, 3))
            tip = vectors.moved(screws, 1, psi[1], tip)
        signs[1] = _elbow(screws, psi[1], tip)
    if form.way != places.POSITION_3:
        signs[2] = _wrist(screws, psi[4])


def postures(form: ClosedForm, q: Floats, signs: Integers) -> None:
    """
    Fill `signs` (N, 3) with the signs of shoulder, elbow and wrist at N joint positions.

    The sign 1 means shoulder right, elbow up, or wrist not flipped; -1 means the opposite. 0 means
    neither.

    Parameters
    ----------
    form
        The closed form of the arm. If its screws are ordered from tool to base, all signs are 0.
    q : shape (N, n), rad or m
        Joint positions.
    signs : shape (N, 3)
        The postures.
    """
    count = arrays.extent(q, 0)
    positions = arrays.numbers(q, count * form.n)
    result = arrays.whole_results(signs, 3 * count)
    for i in range(count):
        write_posture(form, arrays.after(positions, i * form.n), arrays.whole_after(result, 3 * i))
