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


def _rounded(value: float, way: Callable[[float], int]) -> float:
    if value == 0.0 or not math.isfinite(value):
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 3)
    return way(value / unit) * unit


def joints_refuted(audit: Audit, what: Literal['limits', 'speed']) -> list[str]:
    """
    Return the names of the joints that exceed their position limits, or speed limits, in a plan.
    """
    joints = [joint for plan in audit.plans.values() for joint in plan.joints]
    return [joint.name for joint in joints if getattr(joint, what) == 'refuted']


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
            what = f'{where}Not decided: {text}; between them nothing is proved.'
            yield Finding(Level.WARN, what)
        else:
            what = f'{where}Refuted: {_at(closure.moment)}, {closure.sentence}.'
            yield Finding(Level.ERROR, what)


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
    found = {number: plan.singularity for number, plan in audit.plans.items()}
    open_ = [(number, one) for number, one in found.items() if one.verdict != 'proved']
    open_.sort(key=lambda pair: pair[1].verdict != 'refuted')
    sentences = [
        _not_proved(audit.robot, _where(audit, k), one) for k, one in open_[:MAX_SENTENCES]
    ]
    if len(open_) > MAX_SENTENCES:
        level = Level.ERROR if open_[MAX_SENTENCES][1].verdict == 'refuted' else Level.WARN
        more = counted(len(open_) - MAX_SENTENCES, 'trajectory')
        sentences.append(Finding(level, f'{more} more are refuted or not decided.'))
    if not open_:
        least = min(found.values(), key=lambda one: one.lower)
        upper = min(one.upper for one in found.values())
        near = f'; the nearest found is {rounded_up(upper)} rad away' if upper < math.inf else ''
        kept = f'the plan keeps {rounded_down(least.lower)} rad or more from every singular pose'
        text = f'{_of_those_checked(audit)}Proved, between its points too: {kept}'
        sentences.append(Finding(Level.OK, f'{text} ({least.threshold:g} asked){near}.'))
    return sentences


def _named(robot: Robot, found: PlanSingularity) -> str:
    # Returns, as text, the names of the singular factors that are 0 at the singular pose nearest
    # to the plan.
    if found.nearest_singular is None or not robot.singularity.factors.names:
        return ''
    # for an arm with loops, name only the loop whose equations are singular
    if robot.loop_names:
        loop = flat_loop(robot, singularity(robot, found.moment.q))
        return f' ({flat_position(loop)})' if loop else ''
    factors = singularity(robot, found.nearest_singular).factors
    assert factors is not None
    names = [name for name, away in zip(factors.names, factors.estimates) if away < ZERO_TOLERANCE]
    return f' ({", ".join(names)})' if names else ''


def _not_proved(robot: Robot, where: str, found: PlanSingularity) -> Finding:
    asked = f'{found.threshold:g} rad'
    if found.verdict == 'refuted':
        pose = f'{rounded_up(found.upper)} rad from a singular pose{_named(robot, found)}'
        text = f'Refuted: {_at(found.moment)}, the plan is {pose}'
        return Finding(Level.ERROR, f'{where}{text} ({found.threshold:g} asked).')
    if robot.loop_names:
        text = f'no singular pose was found within {asked} of {found.evaluations:,} sampled'
        bent = 'there may be one, because nothing is proved of closed loops'
        return Finding(Level.WARN, f'{where}Not decided: {text} positions; {bent}.')
    begin, end = found.undecided[0]
    span = seconds(sum(end - begin for begin, end in found.undecided))
    nearest = 'none was found near it'
    if math.isfinite(found.upper):
        nearest = f'the nearest found is {rounded_up(found.upper)} rad away'
    return Finding(
        Level.WARN,
        f'{where}Not decided in {counted(len(found.undecided), "interval")} ({span}), the first '
        f'from {begin:.3f} to {end:.3f} s: there it is neither proved that the plan keeps {asked} '
        f'from every singular pose (proved: {rounded_down(found.lower)}) nor refuted ({nearest}).',
    )


def _joints(audit: Audit) -> Iterator[Finding]:
    if joints_refuted(audit, 'limits') or joints_refuted(audit, 'speed'):
        return
    robot = audit.robot
    given = {
        'limits': bool(np.any(np.isfinite(robot.limits))),
        'speeds': bool(np.any(np.isfinite(robot.velocity_limits))),
    }
    kept = ' and '.join(what for what, there in given.items() if there)
    missing = ' and no '.join(what for what, there in given.items() if not there)
    text = f'Proved, between its points too: joints keep their {kept}' if kept else ''
    if missing:
        text += f'{"; t" if kept else "T"}he robot file gives no {missing} of joints'
    yield Finding(Level.OK, f'{_of_those_checked(audit) if kept else ""}{text}.')


def _speeds(audit: Audit) -> Iterator[Finding]:
    if not audit.asked.speeds_told:
        return
    for k in range(len(next(iter(audit.plans.values())).speeds)):
        number, plan = max(audit.plans.items(), key=lambda pair: pair[1].speeds[k].upper)
        found = _speed(plan.speeds[k])
        yield found._replace(text=f'{_where(audit, number)}{found.text}')


def point_in_words(of: str) -> str:
    """
    Return the name of a point of the arm in words; `of` is `tool`, a frame number, or a joint.
    """
    if of == TOOL:
        return 'the tool'
    return f'frame {of}' if of.isdecimal() else of


def _speed(speed: PlanSpeed) -> Finding:
    who, at = point_in_words(speed.of), f'{speed.moment.time:.3f} s'
    low = rounded_down(speed.lower)
    if speed.verdict == 'refuted':
        text = f'{who} moves at {low} m/s {_at(speed.moment)} ({speed.limit:g} allowed)'
        return Finding(Level.ERROR, f'Refuted: {text}.')
    if math.isinf(speed.upper):  # no upper bound is computed for closed loops
        found = f'the largest sampled speed of {who} is {low} m/s, at {at}'
        if speed.limit is None:
            return Finding(Level.OK, f'{found[0].upper()}{found[1:]}; nothing bounds it.')
        allowed = f'({speed.limit:g} allowed); between the samples nothing is proved'
        return Finding(Level.WARN, f'Not decided: {found} {allowed}.')
    bracket = f'{low} to {rounded_up(speed.upper)} m/s, at {at}'
    if speed.verdict == 'not decided':
        text = f'the largest speed of {who} is {bracket} ({speed.limit:g} allowed)'
        return Finding(Level.WARN, f'Not decided: {text}.')
    if speed.verdict == 'proved':
        text = f'{who} keeps below {speed.limit:g} m/s; its largest speed is {bracket}'
        return Finding(Level.OK, f'Proved: {text}.')
    return Finding(Level.OK, f'The largest speed of {who} is {bracket}.')
