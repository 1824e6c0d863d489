"""The error vectors of a calibration drawn at the arm, which the page's script turns."""

import math
from collections.abc import Iterator

import numpy as np

from ....kernel import Floats, Integers
from ....kinematics.forward import forward_kinematics, link_frames
from ...frame_check.errors import length_in_words
from ..camera import ON_TOOL
from ..result import Calibration

WIDTH, HEIGHT = 720, 460
# From where it is seen, to begin with (rad).
TURN, LIFT = -0.9, 0.4
# Vectors drawn at most; the longest one takes this share of the picture's height.
MOST, LONGEST = 400, 0.12
# Round numbers by which vectors may be longer than they are.
ROUND = (1.0, 2.0, 5.0)


def arm_picture(found: Calibration) -> str:
    """Return the arm at one pose, and the error at every pose before and after."""
    used = np.setdiff1d(np.arange(found.count), found.outliers)
    rows = used[np.unique(np.linspace(0, len(used) - 1, MOST).astype(int))]
    tips = _tools(found, rows)[:, :3, 3]
    before, after = (
        _in_base(found, rows, one) for one in (found.remainders_before, found.remainders)
    )
    arm = _arm(found, int(rows[len(rows) // 2]))
    every = np.concatenate([tips, arm, np.zeros((1, 3))])
    low, high = every.min(axis=0), every.max(axis=0)
    # The square of the base's plane that the arm stands over.
    (x1, y1, _), (x2, y2, _) = low, high
    floor = np.array([[x1, y1, 0.0], [x2, y1, 0.0], [x2, y2, 0.0], [x1, y2, 0.0]])
    middle = 0.5 * (low + high)
    size = float(np.linalg.norm(high - low)) or 1.0
    scale = HEIGHT / size
    factor = _round(LONGEST * size / max(float(np.max(_lengths(before))), 1e-12))
    lines = [
        *_lines('floor', floor, np.roll(floor, -1, axis=0)),
        *_lines('arm', arm[:-1], arm[1:]),
        *_lines('before', tips, tips + factor * before),
        *_lines('after', tips, tips + factor * after),
    ]
    drawn = ''.join(_line(style, p, q, middle, scale) for style, p, q in lines)
    longest = length_in_words(float(np.max(_lengths(before))))
    return (
        '<figure><figcaption><b>error vectors at the arm</b>, drawn '
        f'{factor:,.0f} times as long as they are; the longest before is {longest}'
        '<span class="key"><span class="swatch before"></span>before</span>'
        '<span class="key"><span class="swatch after"></span>after</span>'
        '<span class="key"><span class="swatch arm"></span>the arm at one of the poses; drag to '
        'turn</span></figcaption>'
        f'<div class="wide"><svg class="drawing turned" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="error vectors at the arm" data-scale="{scale:.6g}" data-turn="{TURN}" '
        f'data-lift="{LIFT}" data-center="{_numbers(middle)}">{drawn}</svg></div></figure>\n'
    )


def _lengths(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _tools(found: Calibration, rows: Integers) -> Floats:
    # Where the calibrated arm has what was measured, in its base frame.
    tool = _of_sets(found.tool_offsets, found, rows)
    return np.asarray(forward_kinematics(found.calibrated, found.q[rows]) @ tool)


def _in_base(found: Calibration, rows: Integers, remainders: Floats) -> Floats:
    # Remainders are in the frame of the camera, or in that of the measured poses.
    if found.camera == ON_TOOL:
        R = _tools(found, rows)[:, :3, :3]
    else:
        R = np.swapaxes(_of_sets(found.base_offsets, found, rows)[:, :3, :3], 1, 2)
    return np.asarray((R @ remainders[rows, 0, :, None])[:, :, 0])


def _of_sets(offsets: Floats, found: Calibration, rows: Integers) -> Floats:
    return offsets[found.sets[rows] if len(offsets) > 1 else np.zeros_like(rows)]


def _arm(found: Calibration, row: int) -> Floats:
    frames = link_frames(found.calibrated, found.q[row])[:, :3, 3]
    tool = _tools(found, np.array([row]))[:, :3, 3]
    return np.concatenate([np.zeros((1, 3)), frames, tool])


def _round(factor: float) -> float:
    power = 10.0 ** math.floor(math.log10(max(factor, 1.0)))
    return max((power * one for one in ROUND if power * one <= factor), default=1.0)


Line = tuple[str, Floats, Floats]


def _lines(style: str, begin: Floats, end: Floats) -> Iterator[Line]:
    for p, q in zip(begin, end):
        yield style, p, q


def _line(style: str, p: Floats, q: Floats, middle: Floats, scale: float) -> str:
    (x1, y1), (x2, y2) = (_projected(point - middle, scale) for point in (p, q))
    return (
        f'<line class="{style}" x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" '
        f'data-p="{_numbers(p)} {_numbers(q)}"/>'
    )


def _projected(point: Floats, scale: float) -> tuple[float, float]:
    # As the script does.
    x, y, z = point.tolist()
    s, c, u, v = math.sin(TURN), math.cos(TURN), math.sin(LIFT), math.cos(LIFT)
    right, up = c * y - s * x, v * z - u * (c * x + s * y)
    return WIDTH / 2 + scale * right, HEIGHT / 2 - scale * up


def _numbers(point: Floats) -> str:
    return ' '.join(f'{x:.4f}' for x in point.tolist())
