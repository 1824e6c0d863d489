"""A derivation as JSON, expressions in sympy's own syntax."""

import json
from collections.abc import Sequence
from typing import Any

import sympy

from .....printing import attributes
from ..derivation import Derivation
from ..path import Path
from ..singular_set import FamilyCrossing


def json_of(
    derivation: Derivation, path: Path | None = None, span: tuple[float, float] = (0.0, 6.3)
) -> str:
    """Return a JSON object; lengths in the file's unit, joint angles in rad."""
    found = derivation.singular_set
    determinant = found.determinant
    document: dict[str, Any] = {
        'robot': derivation.robot.name,
        'length_unit': derivation.robot.description.length_unit,
        'variables': [v.name for v in derivation.variables],
        'angles': {str(theta): str(angle) for theta, angle in derivation.angles.items()},
        'lengths': derivation.lengths,
        'row_transforms': [_strings(T) for T in derivation.row_transforms],
        'frames': [_strings(T) for T in derivation.frames],
        'T': _strings(derivation.T),
        'z': [_strings(z) for z in derivation.z],
        'o': [_strings(o) for o in derivation.o],
        'jacobian': _strings(derivation.jacobian),
        'coupling': _strings(derivation.coupling),
        'loops': [
            {
                'name': loop.name,
                'passive': [str(psi) for psi in loop.passive],
                'equations': [str(equation) for equation in loop.equations],
                'coupling': _strings(loop.coupling),
                'determinant': str(loop.determinant),
            }
            for loop in derivation.loops
        ],
        'terms_of_difference': dict(derivation.methods),
        'task': list(determinant.rows),
        'square': determinant.square,
        'determinant': '0' if determinant.identically_zero else _strings(determinant.expression),
        'product': _strings(determinant.expression),
        'product_in_angles': _strings(_in_angles(derivation)),
        'generic_rank': found.generic_rank,
        'dependent_joints': list(found.dependent),
        'complete': found.complete,
        'factors': [
            {
                'name': factor.name,
                'expression': str(factor.expression),
                'in_angles': str(derivation.in_angles(factor.expression)),
                **attributes(factor, 'power', 'irreducible'),
                'joint': None if factor.family.variable is None else str(factor.family.variable),
                'solutions': [str(s) for s in factor.family.solutions],
                'condition': _strings(factor.family.condition),
                'free_where_zero': [str(e) for e in factor.family.free],
                **attributes(factor, 'rank', 'lost', 'idle'),
                'sampled': list(factor.sampled),
                'within_limits': factor.within_limits,
                'pose_within_limits': factor.pose,
                'special': factor.special,
            }
            for factor in found.factors
        ],
        'crossings': _crossings(found.crossings),
        'remainder_zeros': _crossings(found.remainder_zeros),
        'special': found.special,
    }
    if path is not None:
        document['path'] = {
            'q': _strings(path.q),
            'qdot': _strings(path.qdot),
            'v': _strings(path.v),
            'omega': _strings(path.omega),
            'crossings': [
                {'time': c.time, 'until': c.until, 'factor': c.name, 'touches': c.touches}
                for c in path.crossings(*span)
            ],
        }
    return json.dumps(document, indent=1) + '\n'


def _crossings(crossings: Sequence[FamilyCrossing] | None) -> list[dict[str, Any]] | None:
    return (
        None
        if crossings is None
        else [
            {
                'factors': list(c.names),
                **attributes(c, 'rank', 'sampled', 'within_limits'),
                'pose_within_limits': c.pose,
            }
            for c in crossings
        ]
    )


def _in_angles(derivation: Derivation) -> Any:
    product = derivation.determinant
    return None if product is None else derivation.in_angles(product)


def _strings(value: Any) -> Any:
    if value is None:
        return None
    if not isinstance(value, sympy.MatrixBase):
        return str(value)
    if value.cols == 1:
        return [str(entry) for entry in value]
    return [[str(entry) for entry in row] for row in value.tolist()]
