"""
Kinematics of any arm given by its Denavit-Hartenberg table: a library and a ROS 2 node.

The library needs no ROS: `load_robot`, `forward_kinematics`, `jacobian`, `twist`, `singularity`.
"""

from .errors import JointVectorError as JointVectorError
from .errors import KinematicsError as KinematicsError
from .errors import RobotFileError as RobotFileError
from .errors import RobotNotFoundError as RobotNotFoundError
from .kinematics import forward_kinematics as forward_kinematics
from .kinematics import jacobian as jacobian
from .kinematics import link_frames as link_frames
from .kinematics import twist as twist
from .measures import Level as Level
from .robot import Robot as Robot
from .robot import bundled_robots as bundled_robots
from .robot import load_robot as load_robot
from .robot import robot_from_text as robot_from_text
from .singularity import Singularity as Singularity
from .singularity import singularity as singularity
from .tool_state import ToolState as ToolState
from .tool_state import evaluate as evaluate
from .version import __version__ as __version__
