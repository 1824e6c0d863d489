# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the results of the check of planned trajectories as sentences."""

import math
from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from ....estimation.status_text import flat_position
from ....kinematics.singularity import flat_loop, singularity
from ....robot.measures import Level
from ....robot.robot import Robot
from ....typography import counted
from ..plans.point_speed import TOOL
from ..plans.verdicts import PlanMoment, PlanSingularity, PlanSpeed
from .auditing import Audit
from .findings import Finding, seconds

# If it is not proved that a trajectory keeps away from singular poses, a finding describes this
# trajectory. At most this number of trajectories are described; further ones are only counted.
MAX_SENTENCES = 3
# A singular factor of the robot file is named as the cause of a singular pose if the joint motion
# (rad) from this pose to a zero of the factor is below this.
ZERO_TOLERANCE = 1e-6


def rounded_down(value: float) -> str:
    """Return a number as text with four digits, rounded down."""
    return f'{_rounded(value, math.floor):.4g}'


def rounded_up(value: float) -> str:
    """Return a number as text with four digits, rounded up."""
    return f'{_rounded(value, math.ceil):.4g}'


def _rounded(value: float, rounding: Callable[[float], int]) -> float:
    if value == 0.0 or not math.isfinite(value):
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 3)
    return rounding(value / unit) * unit


def joints_refuted(audit: Audit, claim: Literal['limits', 'speed']) -> list[str]:
    """
    Return the names of the joints that exceed their position limits, or speed limits, in a plan.
    """
    joints = [joint for plan in audit.plans.values() for joint in plan.joints]
    return [joint.name for joint in joints if getattr(joint, claim) == 'refuted']


def plan_findings(audit: Audit) -> list[Finding]:
    """Return the findings on the plans of a file; empty if the file is a recording."""
    if not audit.plans:
        return []
    return [*_closures(audit), *_singular(audit), *_joints(audit), *_speeds(audit)]


def _closures(audit: Audit) -> Iterator[Finding]:
    # For an arm with closed loops, yields a finding for each plan: refuted if a loop does not
    # close at a sampled position, otherwise not decided.
    for number, plan in audit.plans.items():
        closure, where = plan.closure, _where(audit, number)
        if closure is None:
            continue
        if closure.moment is None:
            text = f'all loops close at {closure.samples:,} sampled positions'
            sentence = f'{where}Not decided: {text}; between them nothing is proved.'
            yield Finding(Level.WARN, sentence)
        else:
            sentence = f'{where}Refuted: {_at(closure.moment)}, {closure.sentence}.'
            yield Finding(Level.ERROR, sentence)


def _at(moment: PlanMoment) -> str:
    return f'at {moment.time:.3f} s, after points[{moment.point}]'


def _where(audit: Audit, number: int) -> str:
    return f'Trajectory {number} of {audit.trajectories}: ' if audit.trajectories > 1 else ''


def _of_those_checked(audit: Audit) -> str:
    # Returns the start of a sentence which says that a proof covers only the checked trajectories,
    # such as 'Of 2 of 3 trajectories: '. Returns '' if all trajectories were checked.
    if len(audit.plans) == audit.trajectories:
        return ''
    return f'Of {len(audit.plans):,} of {audit.trajectories:,} trajectories: '


def _singular(audit: Audit) -> list[Finding]:
    claims = {number: plan.singularity for number, plan in audit.plans.items()}
    open_ = [(number, claim) for number, claim in claims.items() if claim.verdict != 'proved']
    open_.sort(key=lambda pair: pair[1].verdict != 'refuted')
    sentences = [
        _not_proved(audit.robot, _where(audit, k), claim) for k, claim in open_[:MAX_SENTENCES]
    ]
    if len(open_) > MAX_SENTENCES:
        level = Level.ERROR if open_[MAX_SENTENCES][1].verdict == 'refuted' else Level.WARN
        more = counted(len(open_) - MAX_SENTENCES, 'trajectory')
        sentences.append(Finding(level, f'{more} more are refuted or not decided.'))
    if not open_:
        least = min(claims.values(), key=lambda claim: claim.lower)
        upper = min(claim.upper for claim in claims.values())
        near = f'; the nearest found is {rounded_up(upper)} rad away' if upper < math.inf else ''
        kept = f'the plan keeps {rounded_down(least.lower)} rad or more from every singular pose'
        text = f'{_of_those_checked(audit)}Proved, between its points too: {kept}'
        sentences.append(Finding(Level.OK, f'{text} ({least.threshold:g} asked){near}.'))
    return sentences


def _named(robot: Robot, claim: PlanSingularity) -> str:
    # Returns, as text, the names of the singular factors that are 0 at the singular pose nearest
    # to the plan.
    if claim.nearest_singular is None or not robot.singularity.factors.names:
        return ''
    # for an arm with loops, name only the loop whose equations are singular
    if robot.loop_names:
        loop = flat_loop(robot, singularity(robot, claim.moment.q))
        return f' ({flat_position(loop)})' if loop else ''
    factors = singularity(robot, claim.nearest_singular).factors
    assert factors is not None
    names = [name for name, away in zip(factors.names, factors.estimates) if away < ZERO_TOLERANCE]
    return f' ({", ".join(names)})' if names else ''


def _not_proved(robot: Robot, where: str, claim: PlanSingularity) -> Finding:
    limit = f'{claim.threshold:g} rad'
    if claim.verdict == 'refuted':
        pose = f'{rounded_up(claim.upper)} rad from a singular pose{_named(robot, claim)}'
        text = f'Refuted: {_at(claim.moment)}, the plan is {pose}'
        return Finding(Level.ERROR, f'{where}{text} ({claim.threshold:g} asked).')
    if robot.loop_names:
        text = f'no singular pose was found within {limit} of {claim.evaluations:,} sampled'
        bent = 'there may be one, because nothing is proved of closed loops'
        return Finding(Level.WARN, f'{where}Not decided: {text} positions; {bent}.')
    begin, end = claim.undecided[0]
    span = seconds(sum(end - begin for begin, end in claim.undecided))
    nearest = 'none was found near it'
    if math.isfinite(claim.upper):
        nearest = f'the nearest found is {rounded_up(claim.upper)} rad away'
    return Finding(
        Level.WARN,
        f'{where}Not decided in {counted(len(claim.undecided), "interval")} ({span}), the first '
        f'from {begin:.3f} to {end:.3f} s: there it is neither proved that the plan keeps {limit} '
        f'from every singular pose (proved: {rounded_down(claim.lower)}) nor refuted ({nearest}).',
    )


def _joints(audit: Audit) -> Iterator[Finding]:
    if joints_refuted(audit, 'limits') or joints_refuted(audit, 'speed'):
        return
    robot = audit.robot
    given = {
        'limits': bool(np.any(np.isfinite(robot.limits))),
        'speeds': bool(np.any(np.isfinite(robot.velocity_limits))),
    }
    kept = ' and '.join(name for name, known in given.items() if known)
    missing = ' and no '.join(name for name, known in given.items() if not known)
    text = f'Proved, between its points too: joints keep their {kept}' if kept else ''
    if missing:
        text += f'{"; t" if kept else "T"}he robot file gives no {missing} of joints'
    yield Finding(Level.OK, f'{_of_those_checked(audit) if kept else ""}{text}.')


def _speeds(audit: Audit) -> Iterator[Finding]:
    if not audit.plan_settings.speeds_requested:
        return
    for k in range(len(next(iter(audit.plans.values())).speeds)):
        number, plan = max(audit.plans.items(), key=lambda pair: pair[1].speeds[k].upper)
        finding = _speed(plan.speeds[k])
        yield finding._replace(text=f'{_where(audit, number)}{finding.text}')


def point_in_words(of: str) -> str:
    """
    Return the name of a point of the arm in words; `of` is `tool`, a frame number, or a joint.
    """
    if of == TOOL:
        return 'the tool'
    return f'frame {of}' if of.isdecimal() else of


def _speed(speed: PlanSpeed) -> Finding:
    point, at = point_in_words(speed.of), f'{speed.moment.time:.3f} s'
    low = rounded_down(speed.lower)
    if speed.verdict == 'refuted':
        text = f'{point} moves at {low} m/s {_at(speed.moment)} ({speed.limit:g} allowed)'
        return Finding(Level.ERROR, f'Refuted: {text}.')
    if math.isinf(speed.upper):  # no upper bound is computed for closed loops
        sentence = f'the largest sampled speed of {point} is {low} m/s, at {at}'
        if speed.limit is None:
            return Finding(Level.OK, f'{sentence[0].upper()}{sentence[1:]}; nothing bounds it.')
        allowed = f'({speed.limit:g} allowed); between the samples nothing is proved'
        return Finding(Level.WARN, f'Not decided: {sentence} {allowed}.')
    bracket = f'{low} to {rounded_up(speed.upper)} m/s, at {at}'
    if speed.verdict == 'not decided':
        text = f'the largest speed of {point} is {bracket} ({speed.limit:g} allowed)'
        return Finding(Level.WARN, f'Not decided: {text}.')
    if speed.verdict == 'proved':
        text = f'{point} keeps below {speed.limit:g} m/s; its largest speed is {bracket}'
        return Finding(Level.OK, f'Proved: {text}.')
    return Finding(Level.OK, f'The largest speed of {point} is {bracket}.')
