"""What a calibration says of elasticity and of drifts, in words."""

from collections.abc import Iterator, Sequence

from ..frame_check.errors import Errors, angle_in_words, length_in_words
from .checking import in_words
from .optional_terms import ELASTICITY, PLACEMENT, ZEROS, TermValue, TriedTerm

WORDS = {
    PLACEMENT: 'A drift of where the instrument stands, from session to session,',
    ZEROS: 'A drift of the zeros of the joints, from session to session,',
    ELASTICITY: 'Elasticity of the joints',
}
# A number below 0 by so many of its deviations is negative.
TOLD = 3.0


def term_sentences(tried: Sequence[TriedTerm], positions: bool) -> Iterator[str]:
    """Yield which terms help; `positions` says whether poses are positions alone."""

    def rms(errors: Errors) -> str:
        return in_words(*errors.rms, positions)

    for one in tried:
        words = WORDS[one.kind]
        if one.without is None or one.with_term is None:
            yield f'{words} cannot be told from these rows and is left out: {one.doubt}'
            continue
        verdict = 'helps and is kept' if one.kept else 'is not seen to help and is left out'
        yield (
            f'{words} {verdict}: rows at held-out joint positions are {rms(one.with_term)} off '
            f'with it, {rms(one.without)} without it (rms)'
        )
    if any(one.kept for one in tried):
        yield 'What is kept of these is no part of the robot file'
    for one in tried:
        if one.kept and one.kind == ELASTICITY:
            yield from _of_elasticity(one.values)


def _of_elasticity(values: Sequence[TermValue]) -> Iterator[str]:
    yield (
        'The compliances are those of the torque of the load; what the arm bends by its own '
        'weight is there without a load too'
    )
    for one in values:
        if one.identifiable and one.value < -TOLD * one.deviation:
            yield (
                f'The compliance of {one.name} is negative, but no joint yields against a torque: '
                'look at the masses, at their centre (--load-at) and at --gravity'
            )


def value_name(one: TermValue) -> str:
    """Return what a value is of."""
    if one.session:
        return f'{one.name} of session {one.session}'
    return f'compliance of {one.name}'


def value_in_words(value: float, unit: str) -> str:
    """Return a value or a deviation of a term in words."""
    words = {'rad': angle_in_words, 'm': length_in_words}.get(unit)
    return f'{value:.3g} {unit}' if words is None else words(value)
