"""What is said where ROS cannot be imported."""

WITHOUT_ROS = (
    'this needs ROS 2 and its rclpy, which cannot be imported here ({reason}): pip install '
    "'.[ros]' in its checkout, or source a ROS 2 Jazzy installation"
)


class RosMissingError(Exception):
    """ROS cannot be imported; its text says how to get it."""

    def __init__(self, reason: ImportError) -> None:
        super().__init__(WITHOUT_ROS.format(reason=reason))


def is_ours(error: ImportError) -> bool:
    """Return whether what failed is an import of our own: a mistake, which stays what it is."""
    return (error.name or '').startswith(__package__.partition('.')[0])


def without_ros(error: ImportError) -> Exception:
    """Return what to raise where an import of what needs ROS failed."""
    return error if is_ours(error) else RosMissingError(error)
