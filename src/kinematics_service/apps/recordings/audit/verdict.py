# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write the verdict of an audit as sentences: the summary, then the other findings, worst first.
"""

from collections.abc import Iterator

from ....estimation import outcomes
from ....robot.measures import MEASURES, Level
from ....typography import counted
from .auditing import Audit
from .findings import Finding, seconds
from .frames import NotCompared
from .intervals import watched_at
from .joints import look_like_degrees
from .plan_findings import joints_refuted, plan_findings

# The verdict is at least WARN if `unjudged > max(MAX_UNJUDGED, MAX_UNJUDGED_RATIO * messages)`.
# Here `messages` is the number of all messages, and `unjudged` is the number of messages that
# yield no state of the arm. One or two such messages are usual while several drivers start.
MAX_UNJUDGED = 2
# Largest accepted number of messages that yield no state of the arm, divided by the number of all
# messages, see MAX_UNJUDGED. At 1 kHz one message without a state is accepted in each second. No
# arm passes a singularity in the 1 ms of one message.
MAX_UNJUDGED_RATIO = 1e-3


def verdict_of(audit: Audit) -> tuple[Finding, ...]:
    """
    Return all findings of an audit: first the summary, then the others, ERROR before WARN before
    OK.
    """
    findings = [
        *_not_judged(audit),
        *plan_findings(audit),
        _singular(audit),
        *_limits(audit),
        *_frames(audit),
        *_slowing(audit),
    ]
    if not audit.planned:
        findings += [*_messages(audit), *_stream(audit), *_velocities(audit)]
    findings += [
        *_jumps(audit),
        *(Finding(remark.level, f'{remark.text}.', remark.code) for remark in audit.remarks),
    ]
    first, *others = findings
    return first, *sorted(others, key=lambda finding: -finding.level)


def _unjudged(audit: Audit) -> int:
    # In a recording, do not count messages whose stamp is not newer than the latest stamp of the
    # same joints. Such messages repeat states that were judged before.
    repeated = 0 if audit.planned else audit.refused.get(outcomes.DROPPED, 0)
    return sum(audit.refused.values()) - repeated


def _unjudged_share(audit: Audit) -> str:
    refused, total = _unjudged(audit), audit.stream.messages
    noun = 'sample' if audit.planned else 'message'
    return f'{refused:,} of {counted(total, noun)} ({100.0 * refused / total:.3g} %)'


def judged_in_words(audit: Audit) -> str:
    """Return the number of judged states as text, such as `2,001 samples` or `1 joint state`."""
    return counted(len(audit.timeline), 'sample' if audit.planned else 'joint state')


def _in_doubt(audit: Audit) -> bool:
    # Returns whether the verdict is uncertain, because too many messages of a recording yielded no
    # state of the arm.
    return not audit.planned and _unjudged(audit) > max(
        MAX_UNJUDGED, MAX_UNJUDGED_RATIO * audit.stream.messages
    )


def _not_judged(audit: Audit) -> Iterator[Finding]:
    if audit.planned and audit.refused:
        text = f'The planned motion could not be judged in {_unjudged_share(audit)}'
        yield Finding(Level.ERROR, f'{text}: {_reasons(audit.refused)}.')


def _reasons(refused: dict[str, int]) -> str:
    return ', '.join(f'{reason} ({number:,})' for reason, number in refused.items())


def _singular(audit: Audit) -> Finding:
    finding = _singular_poses(audit)
    if audit.planned:  # another finding lists the samples without a pose
        return finding._replace(level=max(finding.level, Level.WARN)) if audit.refused else finding
    if not _in_doubt(audit):
        return finding
    level = max(finding.level, Level.WARN)
    return Finding(level, f'{finding.text} {_unjudged_share(audit)} could not be judged.')


def _away(audit: Audit) -> str:
    # Returns a sentence which says that no state is near a singular pose. The sentence says
    # nothing about the motion between the states.
    subject = 'planned motion' if audit.planned else 'arm'
    states = f'its {judged_in_words(audit)}'
    if audit.planned and audit.refused:
        states = f'the {judged_in_words(audit)} that could be judged'
    if audit.robot.singularity.thresholds.measure == 'distance':
        return f'No singular pose was found near the {subject} at {states}'
    return f'The {subject} keeps away from singular poses at {states}'


def _singular_poses(audit: Audit) -> Finding:
    measure = MEASURES[audit.robot.singularity.thresholds.measure]
    thresholds = audit.robot.singularity.thresholds
    subject = 'The planned motion' if audit.planned else 'The arm'
    row = audit.moments[0].row
    worst = watched_at(audit.robot, audit.timeline, row)
    value = f'{measure.words} {worst:.3g} {measure.unit}'.rstrip()
    if not audit.intervals:
        nearest = measure.farther(worst) or f'the nearest is {value}'
        text = f'{_away(audit)}: {nearest} (WARN at {thresholds.warn:g}).'
        return Finding(Level.OK, text)
    level = max(interval.level for interval in audit.intervals)
    sign = -1.0 if measure.small_is_bad else 1.0
    interval = max(audit.intervals, key=lambda item: (item.level, sign * item.value))
    near = sum(interval.seconds for interval in audit.intervals)
    total = audit.timeline.end
    names = dict.fromkeys([interval.factor, *(passage.name for passage in interval.factors)])
    named = f' ({", ".join(names)})' if interval.factor else ''
    where = (
        f'{counted(len(audit.intervals), "interval")} near it, {seconds(near)} of {seconds(total)}'
    )
    nearness = 'too close to' if level == Level.ERROR else 'near'
    text = f'{subject} comes {nearness} a singularity{named}'
    at = seconds(float(audit.timeline.t[interval.worst]))
    return Finding(
        level,
        f'{text}: {value} at {at} (WARN at {thresholds.warn:g}, ERROR at '
        f'{thresholds.stop:g}); {where}.',
    )


def _limits(audit: Audit) -> Iterator[Finding]:
    beyond = [joint.name for joint in audit.joints if joint.beyond]
    beyond = list(dict.fromkeys([*beyond, *joints_refuted(audit, 'limits')]))
    if beyond:
        hint = ''
        if look_like_degrees(audit.joints):
            hint = ' by many turns: the positions may be in degrees'
        yield Finding(Level.ERROR, f'Beyond its limits: {", ".join(beyond)}{hint}.')
    elif look_like_degrees(audit.joints):
        yield Finding(Level.WARN, 'Joints turn many times: the positions may be in degrees.')
    touched = [joint.name for joint in audit.joints if joint.touching and joint.name not in beyond]
    if touched:
        yield Finding(Level.WARN, f'At its limit: {", ".join(touched)}.')
    fast = [joint.name for joint in audit.joints if joint.too_fast]
    fast = list(dict.fromkeys([*fast, *joints_refuted(audit, 'speed')]))
    if fast:
        yield Finding(Level.WARN, f'Faster than its limit: {", ".join(fast)}.')


def _frames(audit: Audit) -> Iterator[Finding]:
    report = audit.frames
    if report is None:
        return
    name = f'Poses of {report.name}'
    if isinstance(report, NotCompared):
        yield Finding(Level.WARN, f'{name} are not compared: {report.reason}.', report.code)
        return
    yield Finding(report.level, f'{name}: {report.sentence}.')
    for doubt in report.doubts:
        yield Finding(Level.WARN, f'{name}: {doubt}.')
    if report.unmatched:
        # Warn if most of the measured poses have no joint positions at their time, because the
        # comparison then covers little of the recording.
        few = 2 * report.matched < report.considered
        yield Finding(Level.WARN if few else Level.OK, f'{name}: {report.unmatched}.')


def _slowing(audit: Audit) -> Iterator[Finding]:
    slowing = audit.slowing
    if slowing is None:
        return
    judged = judged_in_words(audit)
    if slowing.unknown:
        judged += f', {slowing.unknown:,} of them without velocities'
    if not slowing.stretches:
        yield Finding(Level.OK, f'ks.scale would have slowed it nowhere ({judged}).')
        return
    least = min(slowing.stretches, key=lambda stretch: stretch.value)
    at = seconds(float(audit.timeline.t[least.worst]))
    shares = ', '.join(f'{cause} {seconds(time)}' for cause, time in slowing.by_cause.items())
    total = seconds(sum(slowing.by_cause.values()))
    yield Finding(
        Level.OK,
        f'ks.scale would have slowed it for {total}, most to {least.value:.2g} at {at} '
        f'({least.cause}): {shares} ({judged}).',
    )


def _messages(audit: Audit) -> Iterator[Finding]:
    refused = audit.refused
    dropped = refused.pop(outcomes.DROPPED, 0)
    if refused:
        number = counted(sum(refused.values()), 'message')
        level = Level.WARN if _in_doubt(audit) else Level.OK
        yield Finding(level, f'{number} made no new state: {_reasons(refused)}.')
    if dropped:
        stream = audit.stream
        text = f'{counted(dropped, "message")} dropped because the stamp is not newer'
        if stream.identical:
            text += f' ({stream.identical:,} of them plain repetitions)'
        yield Finding(Level.WARN, f'{text}.')
    if resets := audit.counts.get(outcomes.RESETS, 0):
        step = seconds(audit.stream.largest_step_back)
        text = f'The stamps jump back {counted(resets, "time")}, by up to {step}'
        yield Finding(Level.WARN, f'{text}: the state started again.')


def _stream(audit: Audit) -> Iterator[Finding]:
    stream = audit.stream
    if stream.gap_count:
        longest = seconds(max(gap.seconds for gap in stream.gaps))
        usual = f'{1e3 * stream.median_interval:.3g} ms'
        text = f'{counted(stream.gap_count, "gap")} in the stamps, the longest of {longest}'
        yield Finding(Level.WARN, f'{text} (usual interval {usual}).')
    if stream.unstamped:
        text = f'{counted(stream.unstamped, "message")} without stamp'
        yield Finding(Level.WARN, f'{text}: the time of recording is used instead.')
    if stream.changes_of_order:
        changes = counted(stream.changes_of_order, 'time')
        text = f'The joints come in {stream.orders} different orders, changing {changes}'
        yield Finding(Level.WARN, f'{text}; they were matched by name.')


def _velocities(audit: Audit) -> Iterator[Finding]:
    for joint in audit.joints:
        text = joint.check.in_words('m' if joint.sliding else 'rad') if joint.check else ''
        if text:
            yield Finding(Level.WARN, f'Reported velocities of {joint.name} {text}.')


def _jumps(audit: Audit) -> Iterator[Finding]:
    if audit.jump_count:
        jump = audit.jumps[0]
        at = seconds(float(audit.timeline.t[jump.row]))
        jumps = f'{counted(audit.jump_count, "jump")} of a joint that its speed does not explain'
        first = f'the first of {jump.joint} by {jump.step:+.3g} at {at}'
        yield Finding(Level.WARN, f'{jumps}, {first}.')
