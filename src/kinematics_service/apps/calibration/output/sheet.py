# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Make a sheet to print, with crosses at known positions that the tip of an arm touches."""

from html import escape
from typing import NamedTuple

from ....errors import CalibrationError

# COLUMNS: names of the columns of crosses from left to right. ROWS: names of the rows of crosses
# from the lower edge up. SPACING: distance between neighboring columns and rows, mm.
COLUMNS, ROWS = 'ABC', '1234'
SPACING = 80
# Width and height of each paper format, mm (ISO 216, ANSI Y14.1).
SIZES = {'a4': (210.0, 297.0), 'letter': (215.9, 279.4)}
# Half length of the lines of a cross, mm.
CROSS = 5.0
# ACROSS: length of the printed ruler across the page, mm. UP: length of the printed ruler up the
# page, mm. The user measures both rulers to check the scale of the print.
ACROSS, UP = 2 * SPACING, 3 * SPACING
STYLE = (
    'body{margin:0}svg{display:block}text{font:4px sans-serif;text-anchor:middle}'
    'path{stroke:#000;stroke-width:.2;fill:none}'
)


class Sheet(NamedTuple):
    """
    A sheet of paper with its width and height, mm.

    The frame of the sheet has its origin in the middle of the paper: x to the right, y to the
    upper edge, z out of the paper.
    """

    name: str
    width: float
    height: float

    @property
    def points(self) -> dict[str, tuple[float, float, float]]:
        """Return the positions of the crosses in the frame of the sheet, m, by name."""
        return {
            f'{column}{row}': ((i - 1) * SPACING / 1000, (2 * j - 3) * SPACING / 2000, 0.0)
            for i, column in enumerate(COLUMNS)
            for j, row in enumerate(ROWS)
        }

    def point(self, name: str) -> tuple[float, float, float]:
        """
        Return the position of a cross in the frame of the sheet, m.

        Raises
        ------
        CalibrationError
            The sheet has no cross of that name.
        """
        points = self.points
        if name not in points:
            message = f'unknown point {name!r}; the sheet has {", ".join(points)}'
            raise CalibrationError(message, code='unknown-name')
        return points[name]

    @property
    def page(self) -> str:
        """Return the page to print, as HTML; one unit of its drawing is 1 mm."""
        title = f'Points to touch, {self.name.upper()}'
        marks = ''.join(
            f'<path d="M{x - CROSS:g} {y:g}h{2 * CROSS:g}M{x:g} {y - CROSS:g}v{2 * CROSS:g}"/>'
            f'<text x="{x + CROSS:g}" y="{y - 2:g}">{name}</text>'
            for name, (right, up, _) in self.points.items()
            for x, y in [(1000 * right, -1000 * up)]
        )
        size = f'{self.width:g}mm', f'{self.height:g}mm'
        return (
            f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{escape(title)}'
            f'</title>\n<style>@page{{size:{" ".join(size)};margin:0}}{STYLE}</style>\n'
            f'<svg width="{size[0]}" height="{size[1]}" viewBox="{-self.width / 2:g} '
            f'{-self.height / 2:g} {self.width:g} {self.height:g}">\n{marks}\n{_rulers()}'
            '<text x="0" y="-128">Print at 100 % (no fit to page). Lay it flat before the arm, '
            'where all of it is reached.</text>\n'
            '<text x="0" y="-2">Touch each cross with the tip from two postures as different'
            '</text><text x="0" y="4">as they can be: the hand leaning to the arm, and away.'
            '</text>\n</svg></html>\n'
        )


def _rulers() -> str:
    # Draw the two rulers: a horizontal and a vertical line between the crosses, with a mark every
    # 10 mm.
    across = ''.join(f'M{x - ACROSS // 2} 80v{-2 if x else -4}' for x in range(0, ACROSS + 1, 10))
    up = ''.join(f'M65 {y - UP // 2}h{2 if y else 4}' for y in range(0, UP + 1, 10))
    return (
        f'<path d="M{-ACROSS // 2} 80h{ACROSS}{across}M65 {-UP // 2}v{UP}{up}"/>\n'
        f'<text x="0" y="86">This line is {ACROSS} mm long on a print that is right,</text>'
        f'<text transform="translate(63 60) rotate(-90)">and this one {UP} mm.</text>\n'
    )


SHEETS = {name: Sheet(name, *size) for name, size in SIZES.items()}
