# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Declare the parameters of a node in ROS, check all values together, and apply changes."""

import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from ...errors import KinematicsError, RobotConflictError, SettingsError
from ...kinematics.inverse.problem.plan import plan_for
from ...kinematics.uncertainty.arm_errors import errors_of_file
from ...robot.bundled import TOPIC, find_robot
from ...robot.robot import Robot, load_robot
from .description_topic import DescriptionTopic
from .settings import NodeSettings, check_value, defaults, settings_from
from .settled_file import read_settled
from .table import PARAMETERS, POINTS, ROBOT, TRANSPORT, Parameter

MEASURE = 'singularity.measure'
KINDS = {str: 'a string', bool: 'true or false', float: 'a number with a point'}
NAMES = frozenset(parameter.name for parameter in PARAMETERS)


class CheckedArm(NamedTuple):
    """
    An arm, valid values of all parameters, and the settings computed from both.

    Attributes
    ----------
    robot
        The arm of the robot file.
    values
        The value of each parameter, by name.
    settings
        The settings computed from `robot` and `values`.
    """

    robot: Robot
    values: dict[str, Any]
    settings: NodeSettings


class NodeParameters:
    """
    Declares the parameters of a node, and keeps the settings that follow from their values.

    Parameters
    ----------
    node
        The node whose parameters are declared.
    robot
        The robot as given on the command line: file, bundled name or topic; None: the parameter
        `robot` names it.
    stopped, report
        Two functions: `stopped` returns whether to end the wait for a description on a topic;
        `report` is called with the reason for the wait.

    Raises
    ------
    RobotConflictError
        The command line and the parameter differ.
    KinematicsError
        The robot or a parameter is wrong.
    StoppedWaiting
        No description came on the topic before `stopped()` was true.

    Attributes
    ----------
    description
        The topic with the description of the robot; None if the robot is a file.
    """

    def __init__(
        self,
        node: Node,
        robot: str | None,
        stopped: Callable[[], bool],
        report: Callable[[str], None],
    ) -> None:
        self._node = node
        self._checked: CheckedArm | None = None
        self._follows = False  # true while the method `take` sets a parameter
        name = self._declare(ROBOT, robot or ROBOT.default)
        if robot is not None and name != robot:
            raise RobotConflictError(
                f'--robot {robot} and the parameter robot:={name} differ; give only one of them'
            )
        self.transport = str(self._declare(TRANSPORT, TRANSPORT.default))
        check_value(TRANSPORT, self.transport)
        self.by_default = robot is None and name == ROBOT.default
        self._load: Callable[[], Robot] = lambda: load_robot(name)
        self.description: DescriptionTopic | None = None
        if name.startswith(TOPIC):
            self.description = DescriptionTopic(node, name)
            self._load = self.description.robot
            robot_of_file = self.description.first_robot(stopped, report)
        else:
            robot_of_file = self._load()
        # rclpy returns None for an empty list on the command line.
        self._points = self._declare(POINTS, POINTS.default) or ()
        for parameter in PARAMETERS:
            self._declare(parameter, defaults(robot_of_file)[parameter.name])
        self._force = self._judge(robot_of_file, self._values())

    @property
    def settings(self) -> NodeSettings:
        """Return the settings in force."""
        return self._force.settings

    def listen(self, apply: Callable[[NodeSettings], None]) -> None:
        """Check each change of parameters from now on; call `apply` after an accepted change."""

        def changed(parameters: Sequence[RosParameter]) -> None:
            if self._follows:
                return
            if any(parameter.name in NAMES for parameter in parameters):
                self._force = self._judge(self._force.robot, self._values())
                try:
                    apply(self.settings)
                except Exception as error:  # a client must get an answer after any error
                    self._internal_error(error)

        self._node.add_on_set_parameters_callback(self._check)
        self._node.add_post_set_parameters_callback(changed)

    def reading_again(self) -> Callable[[], CheckedArm]:
        """
        Return a function that reads the robot file again; a second thread may call it.

        The function returns the new arm, and raises `KinematicsError` if the arm has faults.
        """
        values, former = self._values(), self._force.robot
        name = self._node.get_parameter(ROBOT.name).value

        def read() -> CheckedArm:
            files: list[str | os.PathLike[str]] = []
            if self.description is None:
                files = [find_robot(name).file, *former.description.parts]
            robot = read_settled(self._load, files)
            fitting = _fitting(values, former, robot)
            settings = settings_from(fitting, robot, self._points)
            # Prepare the new arm's searches (singular poses, inverse kinematics) in this thread,
            # while the node still answers with the former arm.
            settings.robot.singularity.arm.atlas()
            plan_for(settings.robot, settings.target_rows, settings.target_axis or '')
            if settings.robot.description.uncertainty is not None:
                errors_of_file(settings.robot)
            return CheckedArm(robot, fitting, settings)

        return read

    def take(self, read: CheckedArm) -> NodeSettings:
        """
        Apply an arm that `reading_again` has read, with the present parameter values.

        Raises
        ------
        KinematicsError
            Parameters that changed while the robot was read contradict the new arm.
        """
        values = _fitting(self._values(), self._force.robot, read.robot)
        self._checked = read
        self._force = self._judge(read.robot, values)
        if values[MEASURE] != self._node.get_parameter(MEASURE).value:
            self._follows = True
            try:
                self._node.set_parameters([RosParameter(MEASURE, value=values[MEASURE])])
            finally:
                self._follows = False
        return self.settings

    def unknown(self) -> tuple[str, ...]:
        """Return the names of parameters that were given at start but are unknown to the node."""
        # Read a private attribute, because rclpy has no public function for the given parameters.
        given = getattr(self._node, '_parameter_overrides', {})
        return tuple(sorted(name for name in given if not self._node.has_parameter(name)))

    def _declare(self, parameter: Parameter, default: Any) -> Any:
        name = parameter.name
        # the parameter exists already if an earlier start failed after it was declared
        if self._node.has_parameter(name):
            return self._node.get_parameter(name).value
        try:
            return self._node.declare_parameter(name, default, parameter.descriptor()).value
        except InvalidParameterTypeException as error:
            hint = ', such as 1.0 instead of 1' if isinstance(default, float) else ''
            raise SettingsError(
                f'parameter {name}: {error}; give {KINDS[type(default)]}{hint}', code='wrong-type'
            ) from None
        except InvalidParameterValueException as error:
            raise SettingsError(f'parameter {name}: {error}', code='out-of-range') from None

    def _values(self) -> dict[str, Any]:
        return {name: self._node.get_parameter(name).value for name in NAMES}

    def _judge(self, robot: Robot, values: dict[str, Any]) -> CheckedArm:
        # Reuse the last settings if they were computed from this arm and these values. Each change
        # of parameters needs its settings twice: rclpy first asks for a check, and then applies
        # the change.
        last = self._checked
        if last is not None and last.robot is robot and last.values == values:
            return last
        if self.description is not None and values['publish_robot_description']:
            raise SettingsError(
                'parameter publish_robot_description: True is not accepted, because the robot '
                'comes from a published description; set false',
                code='conflict',
            )
        settings = settings_from(values, robot, self._points)
        self._checked = CheckedArm(robot, values, settings)
        return self._checked

    def _check(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        # Refuse the change of parameters after any error, because the client would get no answer
        # after an exception.
        changes = {p.name: p.value for p in parameters if p.name in NAMES}
        reason = ''
        try:
            for parameter in parameters:
                if parameter.name in NAMES and parameter.type_ is RosParameter.Type.NOT_SET:
                    raise SettingsError(
                        f'parameter {parameter.name}: it cannot be removed; set another value',
                        code='unsupported',
                    )
            if changes and not self._follows:
                self._judge(self._force.robot, {**self._values(), **changes})
        except KinematicsError as error:
            reason = str(error)
        except Exception as error:
            reason = self._internal_error(error)
        return SetParametersResult(successful=not reason, reason=reason)

    def _internal_error(self, error: Exception) -> str:
        sentence = f'internal error while handling a parameter, please report it: {error!a}'
        self._node.get_logger().error(sentence)
        return sentence


def _fitting(values: dict[str, Any], former: Robot, robot: Robot) -> dict[str, Any]:
    # If the parameter `singularity.measure` has the value of the former robot file, replace it by
    # that of the new file.
    if values[MEASURE] != former.singularity.thresholds.measure:
        return values
    return {**values, MEASURE: robot.singularity.thresholds.measure}
