# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compute the product of exponentials of six screws at complex positions (Brockett 1984).

R. W. Brockett, "Robotic manipulators and the product of exponentials formula", 1984. Each screw is
an axis and a point on the axis. The rotation is Rodrigues' formula with complex cosine and sine.
"""

from ..forward import vectors
from ..layout import arrays
from ..layout.arrays import Flat, Numbers, Vector
from . import complex_numbers, pairs
from .pairs import Complex


def write_turned(re: Vector, im: Vector, axis: Vector, turn: Numbers, row: Numbers) -> None:
    """
    Write the complex row v^T E to `row`, where v = re + i im and E is the rotation about `axis`.

    `turn` has the complex cosine and the complex sine of the rotation angle. Its four numbers are
    the real and imaginary part of the cosine, then those of the sine.
    """
    along, along_i = vectors.dot(axis, re), vectors.dot(axis, im)
    u, w = vectors.plus(re, -along, axis), vectors.cross(re, axis)
    u_i, w_i = vectors.plus(im, -along_i, axis), vectors.cross(im, axis)
    c, c_im, s, s_im = turn[0], turn[1], turn[2], turn[3]
    row[0] = c * u[0] + s * w[0] + along * axis[0] - (c_im * u_i[0] + s_im * w_i[0])
    row[1] = c_im * u[0] + s_im * w[0] + (c * u_i[0] + s * w_i[0] + along_i * axis[0])
    row[2] = c * u[1] + s * w[1] + along * axis[1] - (c_im * u_i[1] + s_im * w_i[1])
    row[3] = c_im * u[1] + s_im * w[1] + (c * u_i[1] + s * w_i[1] + along_i * axis[1])
    row[4] = c * u[2] + s * w[2] + along * axis[2] - (c_im * u_i[2] + s_im * w_i[2])
    row[5] = c_im * u[2] + s_im * w[2] + (c * u_i[2] + s * w_i[2] + along_i * axis[2])


class Product:
    """
    The product of exponentials of six screws, and each screw as moved by the preceding screws.

    Attributes
    ----------
    R, p : shape (3, 3), (3,), complex
        Rotation and translation of the product.
    axes, points : shape (6, 3), complex
        Axis of each screw and a point on the axis, as moved by the preceding screws.
    frames : shape (6, 3, 3), complex
        For each screw, the product of the rotations by the preceding screws.
    """

    def __init__(self) -> None:
        self.R, self.p, self.turn = arrays.rooms(18, 6, 4)
        self.axes, self.points, self.frames = arrays.rooms(36, 36, 108)

    def multiply(self, screws: Flat, t: Numbers) -> None:
        """
        Compute the product of exponentials of screws (6, 7) at positions t (6 complex numbers).
        """
        o: Complex
        R, p = self.R, self.p
        for i in range(18):
            R[i] = 1.0 if i % 8 == 0 else 0.0
        arrays.fill(p, 6, 0.0)
        for k in range(6):
            arrays.copy(arrays.after(self.frames, 18 * k), 18, R)
            axis, point = vectors.axis_of(screws, k), vectors.point_of(screws, k)
            for i in range(3):
                z, o = self.row_times(i, axis), self.row_times(i, point)
                pairs.put(self.axes, 3 * k + i, z)
                o = pairs.plus(o, 1.0, pairs.pair(p, i))
                pairs.put(self.points, 3 * k + i, o)
            if vectors.slides(screws, k):
                d = pairs.pair(t, k)
                for i in range(3):
                    shift = pairs.times(d, pairs.pair(self.axes, 3 * k + i))
                    pairs.put(p, i, pairs.plus(pairs.pair(p, i), 1.0, shift))
                continue
            complex_numbers.write_turn(pairs.pair(t, k), self.turn)
            for i in range(3):
                row = arrays.after(R, 6 * i)
                re, im = (row[0], row[2], row[4]), (row[1], row[3], row[5])
                write_turned(re, im, axis, self.turn, row)
                # `point` is on the axis of this screw, so this screw does not move it. The product
                # of the preceding screws moves `point` to o. So the product with this screw also
                # moves `point` to o: p + R * point = o, where R already has the rotation by this
                # screw. Solve for the translation p.
                o = pairs.pair(self.points, 3 * k + i)
                pairs.put(p, i, pairs.plus(o, -1.0, self.row_times(i, point)))

    def row_times(self, i: int, v: Vector) -> Complex:
        """Return the scalar product of row i of the complex rotation R and a real vector v."""
        row = arrays.after(self.R, 6 * i)
        return (
            row[0] * v[0] + row[2] * v[1] + row[4] * v[2],
            row[1] * v[0] + row[3] * v[1] + row[5] * v[2],
        )
