"""The node itself, which runs where no command is given, and what is said without ROS."""

import typer

from .ros_variables import refuse_ros_variables

WITHOUT_ROS = (
    'this needs ROS 2 and its rclpy, which cannot be imported here ({reason}): pip install '
    "'.[ros]' in its checkout, or source a ROS 2 Jazzy installation"
)


class RosMissingError(Exception):
    """ROS cannot be imported; its text says how to get it."""


def without_ros(error: ImportError) -> Exception:
    """
    Return how to get ROS, for an import that failed.

    An import of our own that fails is a mistake of ours, and stays what it is.
    """
    ours = (error.name or '').startswith(__package__.partition('.')[0])
    return error if ours else RosMissingError(WITHOUT_ROS.format(reason=error))


def node(
    robots: list[str], ros_arguments: list[str], allow_unsecured: bool, allow_mixed_ros: bool
) -> None:
    """
    Run the node until it is told to stop.

    Raises
    ------
    RosMissingError
        rclpy or a message package cannot be imported.
    """
    refuse_ros_variables()
    try:
        from ..ros.process.runner import run_node
    except ImportError as error:
        raise without_ros(error) from error
    raise typer.Exit(run_node(robots, ros_arguments, allow_unsecured, allow_mixed_ros))
