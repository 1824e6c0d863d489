"""Which parameters measured poses identify, and which only in combinations, in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernel import Floats
from ...kinematics.uncertainty.parameters import NOTHING
from ...robot.file.parts.parameters import ArmParameter
from ...typography import listed
from .checking import NAMES_IN_SENTENCE

# A direction is known where the poses tell it this much better than its prior does.
KNOWN = 3.0
# Coefficients below this share of the largest are round-off.
SMALL = 1e-6


@dataclass(frozen=True)
class ParameterCombination:
    """
    Parameters that no pose tells apart.

    Attributes
    ----------
    names
        Of the parameters.
    determined
        Number of their combinations that the poses determine.
    coefficients
        Of the only one, by rad and m, the first being 1; empty if there are several or none.
    sentence
        The same in words.
    """

    names: tuple[str, ...]
    determined: int
    coefficients: tuple[float, ...]
    sentence: str


def combinations_of(
    J: Floats, parameters: Sequence[ArmParameter]
) -> tuple[ParameterCombination, ...]:
    """
    Return the sets of parameters that poses do not tell apart.

    Parameters
    ----------
    J : shape (rows, P)
        How the poses move with usual errors of the parameters.
    """
    null = _reduced(null_space(J))
    sets: list[set[int]] = []
    for row in null:
        own = set(np.flatnonzero(row).tolist())
        for other in [one for one in sets if one & own]:
            own |= other
            sets.remove(other)
        sets.append(own)
    return tuple(_combination(sorted(own), null, parameters) for own in sorted(sets, key=min))


def null_space(J: Floats) -> Floats:
    """Return the directions (f, P) that no row of J (rows, P) tells, up to round-off."""
    if not J.size:
        return np.zeros((0, J.shape[1]))
    _, values, right = np.linalg.svd(J, full_matrices=len(J) < J.shape[1])
    rank = int(np.sum(values > NOTHING * values[0]))
    return np.asarray(right[rank:])


def _reduced(null: Floats) -> Floats:
    # Gauss-Jordan: each row begins with a parameter that no other row has.
    rows = np.array(null)
    done = 0
    for column in range(rows.shape[1] if len(rows) else 0):
        pivot = done + int(np.argmax(np.abs(rows[done:, column])))
        if abs(rows[pivot, column]) < SMALL:
            continue
        rows[[done, pivot]] = rows[[pivot, done]]
        rows[done] /= rows[done, column]
        others = np.arange(len(rows)) != done
        rows[others] -= rows[others, column : column + 1] * rows[done]
        done += 1
        if done == len(rows):
            break
    rows[np.abs(rows) < SMALL] = 0.0
    return rows


def _combination(
    own: Sequence[int], null: Floats, parameters: Sequence[ArmParameter]
) -> ParameterCombination:
    part = null[:, own]
    part = part[np.any(part != 0.0, axis=1)]
    chosen = [parameters[k] for k in own]
    names = tuple(one.name for one in chosen)
    determined, shown = len(own) - len(part), listed(names, NAMES_IN_SENTENCE)
    if determined == 0:
        return ParameterCombination(names, 0, (), f'not identifiable: {shown}')
    if determined > 1:
        sentence = f'only {determined} combinations of {shown} are identifiable'
        return ParameterCombination(names, determined, (), sentence)
    # What the poses see is at right angles to what they do not see.
    seen = np.linalg.svd(part)[2][-1] / np.array([one.scale for one in chosen])
    seen = seen / seen[0]
    others = ' '.join(map(_term, seen[1:].tolist(), names[1:]))
    sentence = f'only {names[0]} {others} is identifiable, not each of them'
    return ParameterCombination(names, 1, tuple(seen.tolist()), sentence)


def _term(coefficient: float, name: str) -> str:
    size = abs(coefficient)
    factor = '' if f'{size:.3g}' == '1' else f'{size:.3g} '
    return f'{"-" if coefficient < 0.0 else "+"} {factor}{name}'
