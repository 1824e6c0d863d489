# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a derivation as JSON, with expressions in the syntax of sympy."""

import json
from collections.abc import Sequence
from typing import Any

import sympy

from .....printing import attributes
from ..derivation import Derivation
from ..path import Path
from ..singular_set import FamilyCrossing


def json_of(derivation: Derivation, path: Path | None = None) -> str:
    """Return a derivation as JSON text; lengths in the file's unit, joint angles in rad."""
    singular_set = derivation.singular_set
    determinant, product = singular_set.determinant, singular_set.determinant.expression
    document: dict[str, Any] = {
        'robot': derivation.robot.name,
        'length_unit': derivation.robot.description.length_unit,
        'variables': derivation.variables,
        'angles': {str(theta): angle for theta, angle in derivation.angles.items()},
        **attributes(derivation, 'lengths', 'row_transforms', 'frames', 'T', 'z', 'o'),
        **attributes(derivation, 'jacobian', 'coupling'),
        'loops': [
            attributes(loop, 'name', 'passive', 'equations', 'coupling', 'determinant')
            for loop in derivation.loops
        ],
        'terms_of_difference': derivation.methods,
        'task': determinant.rows,
        'square': determinant.square,
        'determinant': '0' if determinant.identically_zero else product,
        'product': product,
        'product_in_angles': None if product is None else derivation.in_angles(product),
        'generic_rank': singular_set.generic_rank,
        'dependent_joints': singular_set.dependent,
        'complete': singular_set.complete,
        'factors': [
            {
                'name': factor.name,
                'expression': factor.expression,
                'in_angles': derivation.in_angles(factor.expression),
                **attributes(factor, 'power', 'irreducible'),
                'joint': factor.family.variable,
                **attributes(factor.family, 'solutions', 'condition'),
                'free_where_zero': factor.family.free,
                **attributes(factor, 'rank', 'lost', 'idle', 'sampled', 'within_limits'),
                'pose_within_limits': factor.pose,
                'special': factor.special,
            }
            for factor in singular_set.factors
        ],
        'crossings': _crossings(singular_set.crossings),
        'remainder_zeros': _crossings(singular_set.remainder_zeros),
        'special': singular_set.special,
    }
    if path is not None:
        document['path'] = {
            **attributes(path, 'q', 'qdot', 'v', 'omega'),
            'crossings': [
                {'time': c.time, 'until': c.until, 'factor': c.name, 'touches': c.touches}
                for c in path.crossings
            ],
        }
    return json.dumps(document, indent=1, default=_written) + '\n'


def _crossings(crossings: Sequence[FamilyCrossing] | None) -> list[dict[str, Any]] | None:
    if crossings is None:
        return None
    return [
        {
            'factors': c.names,
            **attributes(c, 'rank', 'sampled', 'within_limits'),
            'pose_within_limits': c.pose,
        }
        for c in crossings
    ]


def _written(value: sympy.Basic) -> str | list[Any]:
    # Convert expressions to text, and vectors and matrices to lists of text.
    if not isinstance(value, sympy.MatrixBase):
        return str(value)
    rows: list[Any] = value.flat() if value.cols == 1 else value.tolist()
    return rows
