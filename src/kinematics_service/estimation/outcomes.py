# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Name what may happen to a JointState message (accepted, or why refused): the keys of
`Estimator.counts`, as the diagnostics show them.
"""

UNREADABLE = 'not a JointState'
NOT_OURS = 'none of our joints'
NO_POSITION = 'no position'
MALFORMED = 'position and name of different length'
DUPLICATE = 'joint named twice'
NOT_FINITE = 'position not finite'
TOO_LARGE = 'position too large'
TOO_FAST = 'velocity too large'
NOT_CLOSED = 'loop does not close'
DROPPED = 'stamp not newer'
WAITING = 'waiting for other joints'
ACCEPTED = 'accepted'
NOT_STAMPED = 'not stamped'
RESETS = 'resets'
