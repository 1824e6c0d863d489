"""
Kinematics of any arm given by its Denavit-Hartenberg table: a library and a ROS 2 node.

The library needs no ROS: `load_robot`, `forward_kinematics`, `jacobian`, `twist`, `singularity`.
Each name is imported when it is first used, so that the command line answers `--help`, and hears
Ctrl-C, before the kernel is loaded.
"""

import signal
import sys

# As a command this file comes before `__main__`: Ctrl-C ends it without a traceback from here on.
_program = sys.argv[0] if sys.argv else ''
_is_command = (_program == '-m' and __name__ in sys.orig_argv) or _program.endswith(f'/{__name__}')
if _is_command and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from importlib import import_module  # noqa: E402
from typing import TYPE_CHECKING, Any  # noqa: E402

if TYPE_CHECKING:
    from .bundle import bundled_robots as bundled_robots
    from .errors import JointVectorError as JointVectorError
    from .errors import KinematicsError as KinematicsError
    from .errors import RobotFileError as RobotFileError
    from .errors import RobotNotFoundError as RobotNotFoundError
    from .frame_doctor.diagnosis import FrameDiagnosis as FrameDiagnosis
    from .frame_doctor.diagnosis import diagnose_frames as diagnose_frames
    from .inverse.aim import TargetError as TargetError
    from .inverse.result import IkFamily as IkFamily
    from .inverse.result import IkResult as IkResult
    from .inverse.result import IkSolution as IkSolution
    from .inverse.servo import ServoSettings as ServoSettings
    from .inverse.servo import ServoStep as ServoStep
    from .inverse.servo import TwistError as TwistError
    from .inverse.servo import joint_velocity as joint_velocity
    from .inverse.solve import inverse_kinematics as inverse_kinematics
    from .kinematics import forward_kinematics as forward_kinematics
    from .kinematics import jacobian as jacobian
    from .kinematics import link_frames as link_frames
    from .kinematics import twist as twist
    from .measures import Level as Level
    from .robot import Robot as Robot
    from .robot import load_robot as load_robot
    from .robot import robot_from_text as robot_from_text
    from .singularities import Singularity as Singularity
    from .singularities import singularity as singularity
    from .symbols.derivation import Derivation as Derivation
    from .symbols.derivation import derive as derive
    from .tool_state import ToolState as ToolState
    from .tool_state import evaluate as evaluate
    from .urdf.importer import UrdfImport as UrdfImport
    from .urdf.importer import import_urdf as import_urdf
    from .urdf.writer import urdf_text as urdf_text
    from .version import __version__ as __version__

_HOME = {
    'bundled_robots': 'bundle',
    'JointVectorError': 'errors',
    'KinematicsError': 'errors',
    'RobotFileError': 'errors',
    'RobotNotFoundError': 'errors',
    'FrameDiagnosis': 'frame_doctor.diagnosis',
    'diagnose_frames': 'frame_doctor.diagnosis',
    'TargetError': 'inverse.aim',
    'IkFamily': 'inverse.result',
    'IkResult': 'inverse.result',
    'IkSolution': 'inverse.result',
    'ServoSettings': 'inverse.servo',
    'ServoStep': 'inverse.servo',
    'TwistError': 'inverse.servo',
    'joint_velocity': 'inverse.servo',
    'inverse_kinematics': 'inverse.solve',
    'forward_kinematics': 'kinematics',
    'jacobian': 'kinematics',
    'link_frames': 'kinematics',
    'twist': 'kinematics',
    'Level': 'measures',
    'Robot': 'robot',
    'load_robot': 'robot',
    'robot_from_text': 'robot',
    'Singularity': 'singularities',
    'singularity': 'singularities',
    'Derivation': 'symbols.derivation',
    'derive': 'symbols.derivation',
    'ToolState': 'tool_state',
    'evaluate': 'tool_state',
    'UrdfImport': 'urdf.importer',
    'import_urdf': 'urdf.importer',
    'urdf_text': 'urdf.writer',
    '__version__': 'version',
}

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'.{_HOME[name]}', __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
