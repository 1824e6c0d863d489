# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Measure the bias of the joint efforts for the topic `~/wrench`, and make the status `wrench`.

The bias is the mean of recent joint efforts, which is subtracted from later joint efforts.
"""

from collections.abc import Callable

import numpy as np
from rclpy.node import Node
from std_srvs.srv import Trigger

from ..estimation.estimator import Estimator
from ..estimation.joint_efforts import JointEfforts
from ..estimation.status_text import StatusText, direction_in_words
from ..kernel import Floats
from ..robot.measures import Level
from .messages.messages import StateReport
from .messages.output_topics import wrench_estimate
from .messages.topics import SERVICE_QOS, WRENCH_ZERO

KINDS = ('force along', 'torque about')
RAW = 'not external: gravity, friction and inertia are in it; ~/wrench/zero takes them as bias'
EXTERNAL = 'external, near the pose at which the bias was taken'


class WrenchBias:
    """
    Measures the bias of the joint efforts when the service is called, and makes the status of the
    wrench.

    Parameters
    ----------
    node
        The node with the service.
    estimator
        The estimator, which keeps the joint efforts.
    has_subscriber
        A function that returns whether a wrench topic has a subscriber. Joint efforts are read
        only if it returns True.
    """

    def __init__(
        self, node: Node, estimator: Estimator, has_subscriber: Callable[[], bool]
    ) -> None:
        self._estimator, self._has_subscriber = estimator, has_subscriber
        node.create_service(Trigger, WRENCH_ZERO, self._zero, qos_profile=SERVICE_QOS)

    def _unknown(self) -> str:
        unknown = np.isnan(self._estimator.quantity(JointEfforts).efforts)
        names = [name for name, is_unknown in zip(self._estimator.names, unknown) if is_unknown]
        return ', '.join(names)

    def _zero(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if not self._has_subscriber():
            response.message = '~/wrench: no effort was read; subscribe to the topic first'
            return response
        count = self._estimator.quantity(JointEfforts).take_bias()
        response.success = count > 0
        response.message = (
            f'the bias is the mean of {count} messages; it holds near this pose: gravity and '
            'friction at others are not in it'
            if count
            else f'the last joint states have no effort of {self._unknown()}'
        )
        return response

    def status(self, report: StateReport) -> StatusText:
        """
        Return the status of a wrench: whether it contains only external forces (a bias was
        subtracted), and the directions of wrench that have no effect on the joints.
        """
        name, kind = report.settings.robot.name, RAW
        if self._estimator.quantity(JointEfforts).bias is not None:
            kind = EXTERNAL
        unknown, estimate = self._unknown(), wrench_estimate(report)
        values = [('robot', name), ('kind', kind), ('joints without effort', unknown)]
        if estimate is None:
            reason = f'the joint states have no effort of {unknown}' if unknown else 'not finite'
            return StatusText(Level.WARN, f'no wrench: {reason}', tuple(values))
        hidden, damped = (_in_words(rows) for rows in (estimate.hidden, estimate.damped))
        values += [
            ('directions felt', f'{int(estimate.rank)} of 6'),
            ('not felt', hidden),
            ('hardly felt', damped),
            ('torques unexplained', f'{float(np.linalg.norm(estimate.residual)):.3g}'),
        ]
        if damped:
            sentence = f'near a singular pose: {damped} is hardly felt, so its value is too small'
            return StatusText(Level.WARN, f'{sentence}; {kind}', tuple(values))
        return StatusText(Level.OK, kind, tuple(values))


def _in_words(rows: Floats) -> str:
    return '; '.join(direction_in_words(row, KINDS) for row in rows if row.any())
