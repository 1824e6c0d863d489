# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Run the node with a life cycle: the transition `configure` reads the arm, and only an active node
answers.
"""

from collections.abc import Callable
from typing import Any

from rclpy.exceptions import ParameterException
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from ..errors import KinematicsError
from .node import KinematicsNode
from .parameters.description_topic import StoppedWaiting

DONE, REFUSED = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
INACTIVE = 'the node is not active'


class ManagedNode(KinematicsNode, LifecycleNodeMixin):
    """
    A kinematics node with a life cycle. Parameters are as in `KinematicsNode`.

    The topics of the node exist from its first configuration on. While the node is not active, it
    answers no message, and refuses targets with the reason.
    """

    def _begin(self, start: Callable[[], None]) -> None:
        self._start_once = start
        self.silent = INACTIVE
        LifecycleNodeMixin.__init__(self)
        # Replace the callback of rclpy, which raises an error for a transition that the present
        # state does not allow. The manager of the node would then get no answer.
        self._change = self._service_change_state.callback
        self._service_change_state.callback = self._on_change
        self.get_logger().info('waiting to be configured')

    def _on_change(self, request: Any, response: Any) -> Any:
        try:
            return self._change(request, response)
        except Exception as error:
            state = self._state_machine.current_state[1]
            label = request.transition.label or request.transition.id
            self.get_logger().error(f'transition {label} is refused in state {state}: {error}')
            response.success = False
            return response

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the robot and check the parameters; errors are logged."""
        try:
            if self.is_started:
                self.read_robot_again()
            else:
                self._start_once()
        except StoppedWaiting:
            return REFUSED
        except (KinematicsError, ParameterException) as error:
            self.get_logger().error(f'cannot be configured: {error}')
            return REFUSED
        return DONE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the node answer messages from now on; rclpy calls this method at the transition."""
        self.silent = ''
        self.get_logger().info('active')
        return DONE

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop answering and publish STALE; after an error the node can be configured again."""
        self.fall_silent(INACTIVE)
        return DONE

    on_shutdown = on_error = on_deactivate

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget all joint positions; the next transition `configure` reads the robot again."""
        self.forget_joints()
        return DONE
