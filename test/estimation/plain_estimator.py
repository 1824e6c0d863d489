# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
The estimator's rules once more, in plain Python, joint by joint: what the compiled call must do.

Slow and without numpy arrays, so that it can be read beside the table of docs/reference/input.md.
The state is evaluated through the library, so that only the rules are compared.
"""

import math
from collections import Counter

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.estimation import outcomes as reasons
from kinematics_service.estimation.estimator import AcceptedMessage, RefusedMessage

LARGEST = 1e15
MOVED_APART, RETURNED, JUMPS_KEPT = 1e-3, 0.2, 16
DISPUTE_WINDOW, JUMPS = 2_000_000_000, 4


class Joint:
    """What is known of one joint."""

    def __init__(self, name, wraps):
        self.name, self.wraps = name, wraps
        self.position = self.before = self.velocity = math.nan
        self.differenced = self.stamped = False
        self.stamp = self.arrival = None
        self.jumps = []


class PlainEstimator:
    """A model of `estimation.estimator.Estimator`: the same counts, answers and disputes."""

    def __init__(self, robot, settings):
        self.robot, self.settings = robot, settings
        self.counts = Counter()
        self.quaternion = None
        self.forget()

    def forget(self):
        names = (self.settings.joint_prefix + name for name in self.robot.joint_names)
        self.joints = {
            name: Joint(name, wraps) for name, wraps in zip(names, self.robot.continuous)
        }

    def take(self, sample, depth=kernel.ALL_FRAMES):
        """Return (q, qdot, stamp, source, numbers, quaternion), or (reason, sentence)."""
        outcome = self.accept(sample)
        if len(outcome) == 2:
            return outcome
        q, qdot, stamp, source = outcome
        try:
            state = ks.evaluate(self.robot, q, qdot, depth=depth)
        except ks.JointVectorError:
            self.forget()
            self.counts[reasons.ACCEPTED] -= 1
            self.counts[reasons.TOO_LARGE] += 1
            sentence = 'positions or velocities are too large to compute with'
            return reasons.TOO_LARGE, sentence
        quaternion = state.quaternion_xyzw
        if self.quaternion is not None:
            along = sum(a * b for a, b in zip(quaternion.tolist(), self.quaternion.tolist()))
            if along < 0.0:
                quaternion = -quaternion
        self.quaternion = quaternion
        return q, qdot, stamp, source, state.numbers, quaternion

    def accept(self, sample):
        """Return (q, qdot, stamp, source), or (reason, sentence)."""
        refusal = self._refusal(sample)
        if refusal is not None:
            self.counts[refusal[0]] += 1
            return refusal
        self.counts[reasons.ACCEPTED] += 1
        joints = list(self.joints.values())
        q = [joint.position for joint in joints]
        qdot = [joint.velocity for joint in joints]
        stamp = sample.stamp or sample.received
        if any(map(math.isnan, qdot)):
            return q, None, stamp, 'none'
        differenced = any(joint.differenced for joint in joints)
        return q, qdot, stamp, 'difference' if differenced else 'message'

    def missing(self, arrival):
        return tuple(
            joint.name
            for joint in self.joints.values()
            if joint.arrival is None or arrival - joint.arrival > self.settings.timeout
        )

    def age(self, arrival):
        return max(
            math.inf if joint.arrival is None else (arrival - joint.arrival) * 1e-9
            for joint in self.joints.values()
        )

    def newest(self):
        return max(
            (joint.stamp for joint in self.joints.values() if joint.stamp is not None),
            default=None,
        )

    def disputed(self, arrival):
        return tuple(
            joint.name
            for joint in self.joints.values()
            if sum(arrival - time < DISPUTE_WINDOW for time in joint.jumps) >= JUMPS
        )

    def _refusal(self, sample):
        ours = [
            (place, self.joints[name])
            for place, name in enumerate(sample.names)
            if name in self.joints
        ]
        if not ours:
            return reasons.NOT_OURS, ''
        if len(sample.positions) == 0:
            return reasons.NO_POSITION, ''
        if len(sample.positions) != len(sample.names):
            sentence = f'{len(sample.names)} names but {len(sample.positions)} positions'
            return reasons.MALFORMED, sentence
        for k, (_, joint) in enumerate(ours):
            if any(joint is earlier for _, earlier in ours[:k]):
                return reasons.DUPLICATE, f'joint {joint.name!r} is named twice'
        heard = [(joint, float(sample.positions[place])) for place, joint in ours]
        for joint, position in heard:
            if not abs(position) <= LARGEST:
                reason = reasons.TOO_LARGE if math.isfinite(position) else reasons.NOT_FINITE
                return reason, f'position of joint {joint.name!r} is {position}'
        if sample.stamp == 0:
            self.counts[reasons.NOT_STAMPED] += 1
        else:
            stamps = [joint.stamp for joint, _ in heard if joint.stamped]
            if stamps and sample.stamp <= max(stamps):
                if max(stamps) - sample.stamp <= self.settings.timeout:
                    self._note_late(heard, sample)
                    return reasons.DROPPED, ''
                self.counts[reasons.RESETS] += 1
                self.forget()
                self.quaternion = None
                heard = [(self.joints[joint.name], position) for joint, position in heard]
        self._store(heard, [place for place, _ in ours], sample)
        return (reasons.WAITING, '') if self.missing(sample.arrival) else None

    def _note_late(self, heard, sample):
        for joint, position in heard:
            if joint.stamp is None:
                continue
            speed = 0.0 if math.isnan(joint.velocity) else abs(joint.velocity)
            moved = 2.0 * speed * abs(joint.stamp - sample.stamp) * 1e-9
            if abs(position - joint.position) > MOVED_APART + moved:
                joint.jumps = [*joint.jumps[1 - JUMPS_KEPT :], sample.arrival]

    def _store(self, heard, places, sample):
        velocities = self._message_velocities(places, sample)
        stamp = sample.stamp or sample.received
        for k, (joint, position) in enumerate(heard):
            jump = abs(position - joint.position)
            if jump > MOVED_APART and abs(position - joint.before) < RETURNED * jump:
                joint.jumps = [*joint.jumps[1 - JUMPS_KEPT :], sample.arrival]
            velocity, differenced = math.nan, False
            if velocities is not None:
                velocity = velocities[k]
            elif self.settings.velocity_source != 'message':
                velocity, differenced = self._difference(joint, position, stamp), True
            joint.before, joint.position = joint.position, position
            joint.velocity, joint.differenced = velocity, differenced
            joint.stamp, joint.stamped = stamp, sample.stamp != 0
            joint.arrival = sample.arrival

    def _message_velocities(self, places, sample):
        if self.settings.velocity_source == 'difference':
            return None
        if len(sample.velocities) != len(sample.names):
            return None
        velocities = [float(sample.velocities[place]) for place in places]
        return velocities if all(abs(velocity) <= LARGEST for velocity in velocities) else None

    def _difference(self, joint, position, stamp):
        if joint.stamp is None or not 0 < stamp - joint.stamp <= self.settings.timeout:
            return math.nan
        step = position - joint.position
        if joint.wraps:
            step = math.remainder(step, math.tau)
        velocity = step / ((stamp - joint.stamp) * 1e-9)
        return velocity if math.isfinite(velocity) else math.nan


def same(outcome, expected):
    """Return whether an answer, an acceptance or a refusal is the model's, to the last bit."""
    if isinstance(outcome, RefusedMessage):
        return tuple(outcome) == tuple(expected)
    if len(expected) == 2:
        return False
    if isinstance(outcome, AcceptedMessage):
        found = [outcome.q, outcome.qdot]
    else:
        found = [outcome.state.q, outcome.state.qdot]
        arrays = [
            (outcome.state.numbers, expected[4]),
            (outcome.state.continuous_quaternion_xyzw, expected[5]),
        ]
        if any(a.tobytes() != np.asarray(b).tobytes() for a, b in arrays):
            return False
    for numbers, wanted in zip(found, expected[:2]):
        if (numbers is None) != (wanted is None):
            return False
        if numbers is not None and numbers.tobytes() != np.array(wanted).tobytes():
            return False
    return (outcome.stamp, outcome.velocity_source) == expected[2:4]
