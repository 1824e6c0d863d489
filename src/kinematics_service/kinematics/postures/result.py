"""What is known of an arm's postures: a path from one to another, the proof that there is none."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from ...kernel import Floats
from ...robot.chain import FrozenArrays
from ..plans.verdicts import PlanCheck

PostureVerdict = Literal['yes', 'no', 'not decided']


class PostureGroup(NamedTuple):
    """
    Postures of a target that are not told apart.

    Attributes
    ----------
    signs
        Those of the factors of the robot file, where their product is det(J_t), otherwise that of
        det(J_t), as `elbow > 0, wrist < 0`; empty where it is not square. Postures with different
        signs are in different aspects.
    aspect
        Of a position of three joints, the last two of which turn: the number, from 1, of the
        aspect they are in. One number is one aspect, proved; two numbers may be, where they touch
        in a passage too narrow for the boxes. Of other arms, and near singular poses, 0.
    q : shape (k, n), rad or m
        The postures.
    """

    signs: str
    aspect: int
    q: Floats


@dataclass(frozen=True, eq=False)
class PosturePath(FrozenArrays):
    """
    A joint path from a posture to another one of the same target, free of singular poses.

    Attributes
    ----------
    q : shape (N, n), rad or m
        From the one to the other; between two of them each joint moves straight.
    check
        Of it as a plan in which the fastest joint moves 1 rad/s: its distance from singular poses
        is proved, and inside the limits these are.
    """

    q: Floats
    check: PlanCheck


@dataclass(frozen=True, eq=False)
class PostureChange(FrozenArrays):
    """
    Whether an arm can change its posture without meeting a singular pose.

    Attributes
    ----------
    verdict
        `yes`: `path` does. `no`: it is proved, limits left aside, that none does: each aspect (a
        connected part of the joint positions without the singular ones) has one posture of each
        target. `not decided`.
    reason
        The same in a sentence: of `no` the proof, otherwise what was tried.
    target : shape (4, 4) or (3,)
        The target of the path; without one an example, that has the most postures of some.
    groups
        Its postures away from singular poses, by signs and aspect.
    aspects
        How many such numbers there are; None of other arms.
    path
        Of `yes`; otherwise None.
    """

    verdict: PostureVerdict
    reason: str
    target: Floats
    groups: tuple[PostureGroup, ...]
    aspects: int | None
    path: PosturePath | None

    def __repr__(self) -> str:
        return f'PostureChange({self.verdict}, {self.reason})'
