"""
Three joints that bring a point to a position: whether each aspect has one posture of it.

What the first joint does not change of the position are two numbers: where it turns, the height
along its axis and the distance from a point on it; where it slides, two coordinates across. They
are functions of the other two joints x and y, sums of products of (1, cos x, sin x), or of
(1, x, x^2) where x slides, and the same of y. det(J) is zero where their Jacobian is.
"""

import itertools
from typing import NamedTuple

import numpy as np

from ...kernel import Floats
from ...rigid_motion import turn_about
from ..inverse.problem.chain_geometry import with_feet
from ..inverse.problem.screws import Screws

# What coefficients are off by, as a share of the arm's size: axes that miss each other by less
# are taken to meet.
ROUND_OFF = 1e-12
# Boxes of the torus of x and y, a side: at the beginning; and how many of them are halved, how
# often.
SIDE, MOST_BOXES, HALVINGS = 16, 20_000, 12
# Products of three functions of degree 1 have degree 3: so many samples give all of them.
SAMPLES = 8
# Round-off of a product of three numbers that are known to 1e-14 and are some tens at most.
SLACK = 1e-11
NOWHERE = np.empty((0, 2))

IN_TURN = 'joints 2 and 3 can be solved one after the other'
ON_A_SURFACE = 'joints 2 and 3 move the point on a plane or a sphere'
ON_RAYS = 'joint 3 scales an ellipse that joint 2 draws'
TOLD = 'each step has two solutions, told apart by the sign of a factor of det(J_t)'
NO_CUSPS = (
    'no position of the three joints has three equal solutions, which is proved by subdivision, '
    'and without such a position there is no change (a theorem for three turning joints: '
    'Salunkhe, Spartalis, Capco, Chablat, Wenger 2022, arXiv 2202.08686)'
)


# Boxes of the torus in which aspects are counted, a side, and the share of it below which a part
# is not counted.
GRID, LEAST = 128, 1e-3


class PositionProof(NamedTuple):
    """
    What is proved of three joints and a point.

    Attributes
    ----------
    sentence
        Why each aspect has one posture of a target at most; empty where that is not proved.
    cusps : shape (k, 2), rad
        Where x and y may be of three equal solutions.
    """

    sentence: str
    cusps: Floats


def position_proof(screws: Screws, point: Floats) -> PositionProof:
    """Return what is proved of the first three screws and a point (3,), m, that they move."""
    form = with_feet(screws)
    invariants, coordinates = _coefficients(form, point)
    if form.off > ROUND_OFF:
        return PositionProof('', NOWHERE)
    if any(_rank(_moved_by(invariants, axis)) < 2 for axis in (1, 2)):
        return PositionProof(f'{IN_TURN}: {TOLD}', NOWHERE)
    if _rank(coordinates.reshape(4, 9)[:, 1:]) < 4:
        return PositionProof(f'{ON_A_SURFACE}: {TOLD}', NOWHERE)
    if not form.slides[1] and _is_scaled(invariants):
        return PositionProof(f'{ON_RAYS}: {TOLD}', NOWHERE)
    if any(form.slides[:3]):
        return PositionProof('', NOWHERE)
    cusps = _cusps(invariants)
    return PositionProof('' if len(cusps) else NO_CUSPS, cusps)


class AspectGrid:
    """
    The parts of the torus of x and y in which det is not zero, by boxes in which it is proved.

    Two places in one part are proved to be in one aspect. Parts that touch in boxes too coarse to
    tell may be one aspect, too.

    Parameters
    ----------
    screws
        Three screws, the last two of which turn.

    Attributes
    ----------
    count
        How many parts there are, the smallest ones left out.
    """

    def __init__(self, screws: Screws) -> None:
        self._to_screws = screws.coupling[1:]
        invariants, _ = _coefficients(with_feet(screws), screws.tool)
        det = _cusp_terms(invariants)[:1]
        middles, side = _boxes(GRID)
        values, slack = _at_boxes(det, middles, side)
        values = np.where(np.abs(values) > slack, values, 0.0).reshape(GRID, GRID)
        parts = np.where(values != 0.0, np.arange(1, GRID**2 + 1).reshape(GRID, GRID), 0)
        grown = np.zeros(0)
        while not np.array_equal(grown, parts):
            grown = parts
            for axis, step in itertools.product((0, 1), (1, -1)):
                same = np.roll(values, step, axis) * values > 0.0
                parts = np.maximum(parts, np.where(same, np.roll(parts, step, axis), 0))
        names, sizes = np.unique(parts[parts > 0], return_counts=True)
        large = names[sizes > LEAST * GRID**2]
        self.count = len(large)
        self._numbers = np.where(np.isin(parts, large), np.searchsorted(large, parts) + 1, 0)

    def number(self, q: Floats) -> int:
        """Return which part joint positions (n,) are in, counted from 1; 0 where it is none."""
        i, j = np.floor(self._to_screws @ q * GRID / (2.0 * np.pi)).astype(int) % GRID
        return int(self._numbers[i, j])


def _coefficients(form: Screws, tool: Floats) -> tuple[Floats, Floats]:
    # Of the two numbers (2, 3, 3), and of the coordinates and half the square of the distance
    # from a point of the first axis (4, 3, 3), all lengths as shares of the arm's size.
    o, fits = form.points[0], []
    # 1 m where all of it slides out of one point.
    size = float(np.max(np.linalg.norm(np.vstack([form.points[1:3], tool]) - o, axis=1))) or 1.0
    grid = (tool - o) / size
    for k in (2, 1):
        point = (form.points[k] - o) / size
        if form.slides[k]:
            at = np.array([-1.0, 0.0, 1.0])
            basis = np.column_stack([np.ones(3), at, at**2])
            grid = grid + at.reshape(3, *[1] * grid.ndim) * form.axes[k]
        else:
            at = 2.0 * np.pi / 3.0 * np.arange(3.0)
            basis = _basis(at)
            grid = point + np.einsum('kij,...j->k...i', turn_about(form.axes[k], at), grid - point)
        fits.append(np.linalg.inv(basis))
    values = np.concatenate([np.moveaxis(grid, -1, 0), 0.5 * np.sum(grid**2, axis=-1)[None]])
    coordinates = fits[1] @ values @ fits[0].T
    if form.slides[0]:
        across = np.linalg.svd(form.axes[:1])[2][1:]
        return np.tensordot(across, coordinates[:3], 1), coordinates
    height = np.tensordot(form.axes[:1], coordinates[:3], 1)
    return np.concatenate([height, coordinates[3:]]), coordinates


def _basis(x: Floats, order: int = 0) -> Floats:
    # The derivatives of 1, cos x, sin x, shape (N, 3).
    turned = x + 0.5 * np.pi * order
    return np.column_stack([np.full(len(x), float(order == 0)), np.cos(turned), np.sin(turned)])


def _derivative(invariants: Floats, at: Floats, by_x: int, by_y: int) -> Floats:
    # Of both numbers, some times by x and by y, on the grid of some angles, (2, N, N).
    return np.asarray(_basis(at, by_x) @ invariants @ _basis(at, by_y).T)


def _rank(rows: Floats) -> int:
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > ROUND_OFF))


def _moved_by(invariants: Floats, axis: int) -> Floats:
    # What of both numbers depends on one of the joints, shape (2, 6).
    return np.delete(invariants, 0, axis=axis).reshape(2, 6)


def _is_scaled(invariants: Floats) -> bool:
    # Whether both numbers are, but for constants, functions of x times the same function of y.
    by_x = invariants[:, 1:].reshape(4, 3)
    by_y = invariants[:, :, 1:].reshape(6, 2)
    return _rank(by_x[:, 1:]) == _rank(by_x) == _rank(by_y) == 1


def _cusps(invariants: Floats) -> Floats:
    # The middles (k, 2) of the boxes in which det and both of its slopes along the motion that
    # changes neither number may be zero; none: there is no such pose.
    terms = _cusp_terms(invariants)
    middles, side = _boxes(SIDE)
    for _ in range(HALVINGS):
        values, slack = _at_boxes(terms, middles, side)
        middles = middles[np.all(np.abs(values) <= slack, axis=0)]
        if not len(middles) or len(middles) > MOST_BOXES:
            break
        side *= 0.5
        corners = side * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
        middles = (middles[:, None] + corners).reshape(-1, 2)
    return middles


def _cusp_terms(invariants: Floats) -> Floats:
    # det and its two slopes as Fourier coefficients (3, SAMPLES, SAMPLES).
    at = 2.0 * np.pi / SAMPLES * np.arange(float(SAMPLES))
    orders = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    (z_x, r_x), (z_y, r_y), (z_xx, r_xx), (z_xy, r_xy), (z_yy, r_yy) = (
        _derivative(invariants, at, i, j) for i, j in orders
    )
    det = r_x * z_y - r_y * z_x
    det_x = r_xx * z_y + r_x * z_xy - r_xy * z_x - r_y * z_xx
    det_y = r_xy * z_y + r_x * z_yy - r_yy * z_x - r_y * z_xy
    slopes = [det_x * f_y - det_y * f_x for f_x, f_y in ((z_x, z_y), (r_x, r_y))]
    return np.asarray(np.fft.fft2(np.array([det, *slopes])) / SAMPLES**2)


def _boxes(count: int) -> tuple[Floats, float]:
    # Middles (count^2, 2) of boxes that cover the torus, and half their side.
    side = np.pi / count
    return side * (2.0 * np.indices((count, count), float).reshape(2, -1).T + 1.0), side


def _at_boxes(terms: Floats, middles: Floats, side: float) -> tuple[Floats, Floats]:
    # Of each term its value at the middle of each box, and by how much it changes in the box at
    # most, by Taylor's formula, (F, N).
    k = np.fft.fftfreq(SAMPLES, 1.0 / SAMPLES)
    by_x, by_y = (np.exp(1j * middles[:, axis, None] * k) for axis in (0, 1))
    sizes, order = np.abs(terms), np.abs(k)[:, None] + np.abs(k)
    rest = 0.5 * side**2 * np.sum(sizes * order**2, axis=(1, 2)) + SLACK
    value, slope_x, slope_y = (
        np.einsum('nk,fkl,nl->fn', by_x, one, by_y, optimize=True).real
        for one in (terms, 1j * k[:, None] * terms, 1j * k * terms)
    )
    return value, side * (np.abs(slope_x) + np.abs(slope_y)) + rest[:, None]
