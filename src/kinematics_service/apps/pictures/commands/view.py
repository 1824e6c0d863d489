# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command `view`: a web page that shows the arm live."""

import sys
from collections.abc import Callable
from typing import Optional

import typer

from ....cli import options
from ....cli.missing_ros import RosMissingError, is_ours, ros_module
from ....errors import ViewError
from ....stop_signals import stop_signals

# Name of the bundled arm that is shown if neither a node nor --robot names an arm.
DEFAULT = 'puma560'
WITHOUT_VISER = (
    'view needs viser, which cannot be imported here ({reason}): '
    "pip install '.[view]' in its checkout"
)


def view(
    context: typer.Context,
    robot: Optional[str] = options.option(
        options.ROBOT_WORDS, options.ROBOT, shown=f"the node's, or {DEFAULT}"
    ),
    of: options.OfOption = None,
    node: str = options.option(
        'The full name of the node.',
        'NAME',
        default='',
        shown='/kinematics, or the first one found',
    ),
    port: int = options.option(
        'Port of the page; 0: any free one.', default=8080, least=0, most=65535
    ),
    host: str = options.option(
        'Address of the page; 0.0.0.0: for the whole network, with a token.', default='127.0.0.1'
    ),
    allow_host: Optional[list[str]] = options.option(
        'Another host name of this computer; repeatable.', 'NAME'
    ),
    sliders: bool = options.flag('--sliders', 'Use sliders only, without ROS.'),
    publish: bool = options.flag('--publish', 'Let the sliders publish joint states.'),
) -> None:
    """
    Show the arm on a web page, live from a running node, or moved by sliders if no joint states
    arrive. The page draws the links and joint axes that follow from the DH table. It also shows
    velocity, manipulability ellipsoids, the motion that a singular pose makes impossible, the
    distance to the nearest singular pose, the Jacobian and the joint limits.

    \b
    Examples:
      kinematics_service view
      kinematics_service view --robot ur5e --sliders
      kinematics_service view --node /left/kinematics --port 8081
      kinematics_service view --robot my_arm.yaml --publish

    If several nodes run, the page has a list to choose from. By default, only this computer can
    open the page. With --host, other computers can open it, too. The page then opens only at the
    printed address, which contains a token. With --publish the page has a check box. If you tick
    it, the sliders publish joint states, so that a node can run without a real arm. Without ROS
    there are only sliders.
    """
    if sliders and publish:
        raise options.WrongUsage(
            '--sliders works without ROS, and --publish needs it; give one of them'
        )
    if of is not None and robot is None:
        raise options.WrongUsage('--of names a point of a robot: give --robot, too')
    try:
        from ..view.address import Address, check_address
        from ..view.run import ArmSource, run_page
    except ImportError as error:
        if is_ours(error):
            raise
        raise ViewError(WITHOUT_VISER.format(reason=error), code='missing-package') from error
    check_address(host, port)
    address = Address(host, port, tuple(allow_host or ()))
    arm = None if robot is None else options.ending_at(options.given_robot(robot), of)
    status = 'sliders'
    if not sliders:
        run_view = _with_ros(publish)
        if run_view is not None:
            raise typer.Exit(run_view(arm, DEFAULT, node, address, publish, context.obj))
        status = 'sliders only: there is no ROS here'
    with stop_signals() as stop:
        default = '' if arm else '; choose an arm with --robot FILE|NAME'
        source = ArmSource(arm or options.given_robot(DEFAULT), f'{status}{default}')
        run_page(source, address, False, lambda: stop.came)


def _with_ros(publish: bool) -> Callable[..., int] | None:
    # Return the function that runs the view with ROS; without ROS print a message.
    try:
        run_view: Callable[..., int] = ros_module('apps.pictures.view.view_session').run_view
    except RosMissingError as missing:
        if publish:
            raise
        print(f'kinematics_service: sliders only: {missing}', file=sys.stderr, flush=True)
        return None
    return run_view
