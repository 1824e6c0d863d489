"""
The node's parameters as ROS has them: declared once, checked together, applied when they change.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from ...errors import KinematicsError, RobotConflictError, SettingsError
from ...robot.robot import load_robot
from .settings import NodeSettings, defaults, settings_from
from .table import PARAMETERS, POINTS, ROBOT, TRANSPORT

KINDS = {str: 'a string', bool: 'true or false', float: 'a number with a point'}
NAMES = frozenset(parameter.name for parameter in PARAMETERS)


class NodeParameters:
    """
    Declares the parameters of a node and keeps the settings that follow from them.

    Parameters
    ----------
    node
        The node they belong to.
    robot
        File or bundled name, as given on the command line; None to take the parameter `robot`.

    Raises
    ------
    RobotConflictError
        The command line and the parameter differ.
    KinematicsError
        The robot or a parameter is bad.
    """

    def __init__(self, node: Node, robot: str | None) -> None:
        self._node = node
        name = self._declare(ROBOT.name, robot or ROBOT.default, ROBOT.descriptor())
        if robot is not None and name != robot:
            raise RobotConflictError(
                f'--robot {robot} and the parameter robot:={name} differ; give one of them'
            )
        self.transport = self._transport()
        self.by_default = robot is None and name == ROBOT.default
        self._robot = load_robot(name)
        # An empty list on a command line arrives as nothing.
        self._points = self._declare(POINTS.name, POINTS.default, POINTS.descriptor()) or ()
        for parameter in PARAMETERS:
            default = defaults(self._robot)[parameter.name]
            self._declare(parameter.name, default, parameter.descriptor())
        self._settings = self._settings_with({})

    @property
    def settings(self) -> NodeSettings:
        """Return the settings in force."""
        return self._settings

    def listen(self, apply: Callable[[NodeSettings], None]) -> None:
        """Check changes from now on before they are made, and call `apply` after each."""

        def changed(parameters: Sequence[RosParameter]) -> None:
            if any(parameter.name in NAMES for parameter in parameters):
                self._settings = self._settings_with({})
                try:
                    apply(self._settings)
                except Exception as error:  # the client that set it would get no answer
                    self._internal_error(error)

        self._node.add_on_set_parameters_callback(self._check)
        self._node.add_post_set_parameters_callback(changed)

    def unknown(self) -> tuple[str, ...]:
        """Return the names of parameters that were given at start and that are not declared."""
        given = getattr(
            self._node, '_parameter_overrides', {}
        )  # rclpy has no public function for it
        return tuple(sorted(name for name in given if not self._node.has_parameter(name)))

    def _declare(self, name: str, default: Any, descriptor: Any) -> Any:
        try:
            return self._node.declare_parameter(name, default, descriptor).value
        except InvalidParameterTypeException as error:
            hint = ' (write 1.0, not 1)' if isinstance(default, float) else ''
            raise SettingsError(
                f'parameter {name} must be {KINDS[type(default)]}{hint}: {error}'
            ) from None
        except InvalidParameterValueException as error:
            raise SettingsError(f'parameter {name} is refused: {error}') from None

    def _transport(self) -> str:
        value = self._declare(TRANSPORT.name, TRANSPORT.default, TRANSPORT.descriptor())
        if value not in TRANSPORT.choices:
            raise SettingsError(
                f'parameter {TRANSPORT.name}: {value!r} is not accepted '
                f'(one of {", ".join(TRANSPORT.choices)})'
            )
        return str(value)

    def _settings_with(self, changes: Mapping[str, Any]) -> NodeSettings:
        values = {name: self._node.get_parameter(name).value for name in NAMES}
        return settings_from({**values, **changes}, self._robot, self._points)

    def _check(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        # After an exception here the client that sets the parameter would get no answer, so it is
        # refused.
        changes = {p.name: p.value for p in parameters if p.name in NAMES}
        reason = ''
        try:
            if changes:
                self._settings_with(changes)
        except KinematicsError as error:
            reason = str(error)
        except Exception as error:
            reason = self._internal_error(error)
        return SetParametersResult(successful=not reason, reason=reason)

    def _internal_error(self, error: Exception) -> str:
        sentence = f'internal error while handling a parameter, please report it: {error!a}'
        self._node.get_logger().error(sentence)
        return sentence
