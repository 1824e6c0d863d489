"""The node with a life cycle: configured it has its arm, active it answers, else it is silent."""

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
    A kinematics node that a life cycle manager leads through its states.

    Its topics are there from the first time it is configured. Unless it is active it answers
    nothing, and targets get the reason. Parameters are as of `KinematicsNode`.
    """

    def _begin(self, start: Callable[[], None]) -> None:
        self._start_once, self._in_order = start, False
        self.silent = INACTIVE
        LifecycleNodeMixin.__init__(self)
        # A transition that does not lead out of the present state raises there, and the manager
        # would get no answer.
        self._change = self._service_change_state.callback
        self._service_change_state.callback = self._on_change
        self.get_logger().info('waiting to be configured')

    def _on_change(self, request: Any, response: Any) -> Any:
        try:
            return self._change(request, response)
        except Exception as error:
            state = self._state_machine.current_state[1]
            wanted = request.transition.label or request.transition.id
            self.get_logger().error(f'transition {wanted} is refused in state {state}: {error}')
            response.success = False
            return response

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the robot and check the parameters; what is wrong is in the log."""
        try:
            if self.is_started:
                self.read_robot_again()
            else:
                self._start_once()
                if self._in_order:
                    super().trust_the_order_of_events()
        except StoppedWaiting:
            return REFUSED
        except (KinematicsError, ParameterException) as error:
            self.get_logger().error(f'cannot be configured: {error}')
            return REFUSED
        return DONE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer from now on."""
        self.silent = ''
        self.get_logger().info('active')
        return DONE

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer no longer, and say so; after an error the node can be configured again."""
        self.fall_silent(INACTIVE)
        return DONE

    on_shutdown = on_error = on_deactivate

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget the state of the joints; the robot is read anew when it is configured again."""
        self.forget_joints()
        return DONE

    def trust_the_order_of_events(self) -> None:
        """Note it for the time when the topics are there."""
        self._in_order = True
        if self.is_started:
            super().trust_the_order_of_events()

    def events_were_left_out(self, messages: int) -> None:
        """Count them where anything counts."""
        if self.is_started:
            super().events_were_left_out(messages)

    def end_motion(self) -> None:
        """Stop the motion of the last target twist, if there can be one."""
        if self.is_started:
            super().end_motion()
